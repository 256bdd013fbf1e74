//! Record of how the grasps of one body were sampled in its scene.

use prost::Message;

use super::{PickCandidates, PickObstacle, TakenGrasps};
use crate::codec::{
    RecordError,
    fields::{broken, lengthy, ranged},
    proto, sample_from_proto, wire,
};
use kernel::{ids::SampleId, words::PointScheme};

const MESSAGE: &str = "PickSampling";

/// Numbers of an obstacle: ground, container, own object, neighbour.
const OBSTACLES: usize = PickObstacle::NAMES.len();

/// Poses of one body by result: `poses` is the sum of all others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PickPoses {
    /// Poses drawn.
    pub poses: u32,
    /// Without an opposite point within the friction cones.
    pub unopposed: u32,
    /// Wider than the hand opens.
    pub too_wide: u32,
    /// Without a roll that brings the approach within the half angle of straight down.
    pub tilted: u32,
    /// With fingertips below the floor before they are past the pair.
    pub too_low: u32,
    /// Rejected by a yes-or-no test against each of [`PickObstacle::NAMES`].
    pub rejected: [u32; OBSTACLES],
    /// Alike to a free grasp that was found before, and not tested.
    pub alike: u32,
    /// Blocked on the exact path by each of [`PickObstacle::NAMES`].
    pub blocked: [u32; OBSTACLES],
    /// Free and unlike each other.
    pub free: u32,
}

/// Sampling of the grasps of one body.
#[derive(Clone, Debug, PartialEq)]
pub struct PickSampling {
    /// The sample of the candidates.
    pub sample: SampleId,
    /// Coefficient of friction of the cone in which the second point of a pair lies.
    pub friction: f64,
    /// Largest angle between the approach and straight down [rad].
    pub half_angle: f64,
    /// Poses, at most.
    pub budget: u32,
    /// Poses by result.
    pub poses: PickPoses,
    /// Whether no grasp is free and a pose was rejected for the palm alone: its fingers pass every yes-or-no test.
    pub palm_only: bool,
    /// One draw per candidate.
    pub drawn: Vec<DrawnPick>,
}

/// Draw of a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnPick {
    /// Scheme that drew its first point.
    pub scheme: PointScheme,
    /// The two points between the pads, in `Object` [m].
    pub points: [[f64; 3]; 2],
    /// Distance between the opened pads [m].
    pub opening: f64,
    /// Distance of the fingertips past the points along the approach [m].
    pub depth: f64,
}

impl PickPoses {
    /// Obstacle that blocks most poses at the last stage that a pose reached: the exact path, or else the yes-or-no tests; an index
    /// into [`PickObstacle::NAMES`]. `None` if a grasp is free, or no pose met an obstacle.
    pub fn blocked_by(&self) -> Option<usize> {
        let most = |counts: &[u32; OBSTACLES]| {
            // Of equal counts the first.
            let best = (0..OBSTACLES).fold(0, |best, index| if counts[index] > counts[best] { index } else { best });
            (counts[best] > 0).then_some(best)
        };
        if self.free > 0 { None } else { most(&self.blocked).or_else(|| most(&self.rejected)) }
    }

    /// Whether the body is wider than the hand opens wherever two points oppose each other.
    pub fn is_too_wide(&self) -> bool {
        self.poses == self.unopposed + self.too_wide
    }

    /// Sum of all results.
    fn sum(&self) -> u64 {
        let &Self { poses: _, unopposed, too_wide, tilted, too_low, rejected, alike, blocked, free } = self;
        let single = [unopposed, too_wide, tilted, too_low, alike, free];
        single.into_iter().chain(rejected).chain(blocked).map(u64::from).sum()
    }
}

impl PickSampling {
    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let PickPoses { poses, unopposed, too_wide, tilted, too_low, rejected, alike, blocked, free } = self.poses;
        let drawn = || self.drawn.iter();
        wire::sample(out, 1, &self.sample);
        wire::double(out, 2, self.friction);
        wire::double(out, 3, self.half_angle);
        for (field, count) in [(4, self.budget), (5, poses), (6, unopposed), (7, too_wide), (8, tilted), (9, too_low)] {
            wire::uint32(out, field, count);
        }
        wire::uint32s(out, 10, rejected.into_iter());
        wire::uint32(out, 11, alike);
        wire::uint32s(out, 12, blocked.into_iter());
        wire::uint32(out, 13, free);
        wire::uint32(out, 14, u32::from(self.palm_only));
        wire::bytes_of(out, 15, drawn().map(|drawn| drawn.scheme as u8));
        wire::doubles_of(out, 16, drawn().flat_map(|drawn| drawn.points.into_iter().flatten()));
        wire::doubles_of(out, 17, drawn().map(|drawn| drawn.opening));
        wire::doubles_of(out, 18, drawn().map(|drawn| drawn.depth));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, counts do not add up, or a number is out of range or not finite.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::PickSampling::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample.clone())?;
        positive("friction", raw.friction)?;
        positive("half_angle", raw.half_angle)?;
        let obstacles = |field, counts: &[u32]| {
            lengthy(MESSAGE, field, OBSTACLES, counts.len())?;
            Ok(std::array::from_fn(|index| counts[index]))
        };
        let poses = PickPoses {
            poses: raw.poses,
            unopposed: raw.unopposed,
            too_wide: raw.too_wide,
            tilted: raw.tilted,
            too_low: raw.too_low,
            rejected: obstacles("rejected", &raw.rejected)?,
            alike: raw.alike,
            blocked: obstacles("blocked", &raw.blocked)?,
            free: raw.free,
        };
        let (count, sum) = (u64::from(poses.poses), poses.sum());
        ranged(MESSAGE, "poses", f64::from(poses.poses), sum == count, "the sum of all results")?;
        ranged(MESSAGE, "poses", f64::from(poses.poses), poses.poses <= raw.budget, "at most the budget")?;
        let palm_only = match raw.palm_only {
            0 => false,
            value => {
                ranged(
                    MESSAGE,
                    "palm_only",
                    f64::from(value),
                    value == 1 && poses.free == 0,
                    "1 without a free grasp, or 0",
                )?;
                true
            }
        };
        Ok(Self {
            sample,
            friction: raw.friction,
            half_angle: raw.half_angle,
            budget: raw.budget,
            poses,
            palm_only,
            drawn: drawn(&raw)?,
        })
    }

    /// Compares the record with the candidates of its sample.
    ///
    /// # Errors
    /// When it is of other candidates, or they were not sampled.
    pub fn check_beside(&self, candidates: &PickCandidates) -> Result<(), RecordError> {
        let found = &candidates.candidates;
        lengthy(MESSAGE, "schemes", found.len(), self.drawn.len())?;
        let is_sampled = candidates.take == TakenGrasps::Sampled;
        ranged(MESSAGE, "sample", f64::from(self.sample.item.0), is_sampled, "a sample whose grasps are sampled")?;
        let free = candidates.free().count();
        let fits = free == self.poses.free as usize;
        ranged(MESSAGE, "free", f64::from(self.poses.free), fits, "the number of free candidates")?;
        let last = found.last().map_or(0, |candidate| candidate.rank);
        let fits = found.is_empty() || last < self.poses.poses;
        ranged(MESSAGE, "poses", f64::from(self.poses.poses), fits, "above the rank of every candidate")
    }
}

fn drawn(raw: &proto::PickSampling) -> Result<Vec<DrawnPick>, RecordError> {
    let count = raw.schemes.len();
    for (field, expected, values) in
        [("points", 6 * count, &raw.points), ("openings", count, &raw.openings), ("depths", count, &raw.depths)]
    {
        lengthy(MESSAGE, field, expected, values.len())?;
        let wild = values.iter().find(|value| !value.is_finite());
        ranged(MESSAGE, field, wild.copied().unwrap_or_default(), wild.is_none(), "finite")?;
    }
    let one = |index: usize| {
        let number = raw.schemes[index];
        let scheme = PointScheme::ALL.get(usize::from(number)).copied();
        ranged(MESSAGE, "schemes", f64::from(number), scheme.is_some(), "0 to 2")?;
        let [opening, depth] = [raw.openings[index], raw.depths[index]];
        positive("openings", opening)?;
        positive("depths", depth)?;
        let point = |first: usize| std::array::from_fn(|axis| raw.points[6 * index + first + axis]);
        Ok(DrawnPick { scheme: scheme.unwrap_or(PointScheme::Area), points: [point(0), point(3)], opening, depth })
    };
    (0..count).map(one).collect()
}

fn positive(field: &'static str, value: f64) -> Result<(), RecordError> {
    ranged(MESSAGE, field, value, value > 0.0 && value.is_finite(), "positive and finite")
}
