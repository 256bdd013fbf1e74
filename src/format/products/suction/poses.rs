//! Record of the poses of a suction cup on one body of a scene.

use crate::{Blocked, PickObstacle, PickPassage, SceneContainer};
use kernel::{
    geom::{Approach, Object, Pose, World},
    ids::{ObjectId, SampleId},
    words::PointScheme,
};

/// Poses of a suction cup on one body of a settled scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SuctionPoses {
    /// Which sample: the scene, and the number of the body minus one.
    pub sample: SampleId,
    /// Container of the scene.
    pub container: SceneContainer,
    /// The bodies of the scene, in its order: object and pose.
    pub bodies: Vec<(ObjectId, Pose<World, Object>)>,
    /// Mass of the body [kg].
    pub mass: f64,
    /// Centre of mass of the body, in `Object` [m].
    pub centre_of_mass: [f64; 3],
    /// Measures of the cup.
    pub cup: CupMeasures,
    /// Rules by which poses were drawn and decided.
    pub rules: SuctionRules,
    /// All drawn poses by result.
    pub draws: SuctionDraws,
    /// The stored poses, in drawn order.
    pub poses: Vec<SuctionPose>,
}

/// Measures of a suction cup.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CupMeasures {
    /// Radius of the circle along which the lip seals [m].
    pub radius: f64,
    /// Outer radius of the lip [m].
    pub outer_radius: f64,
    /// Length of the relaxed cup [m].
    pub height: f64,
    /// Radius of the tube behind it [m].
    pub tube_radius: f64,
    /// Length of the tube [m].
    pub tube_length: f64,
}

/// Rules by which poses are drawn and decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuctionRules {
    /// Distance that cup and tube keep from everything except the body [m].
    pub margin: f64,
    /// Largest angle between the approach and straight down [rad].
    pub half_angle: f64,
    /// Largest angle between the approach and the inward normal of the drawn point [rad].
    pub tilt: f64,
    /// Factor on the weight.
    pub safety: f64,
    /// Whether the cup must hold the body in every direction of gravity, and not only as it lies.
    pub any_direction: bool,
    /// Poses, at most.
    pub budget: u32,
    /// Free poses at which the run ends.
    pub wanted: u32,
}

/// Poses by result: `drawn` is the sum of all others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SuctionDraws {
    /// Poses drawn.
    pub drawn: u32,
    /// With an approach beyond the half angle.
    pub tilted: u32,
    /// Leaking, by the limit of [`SuctionPoses::SEAL_LIMITS`] that is used most.
    pub leaking: [u32; 7],
    /// Too weak for the weight, by the strength of [`SuctionPoses::STRENGTHS`] that is used most.
    pub weak: [u32; 4],
    /// Alike to a free pose that was found before, and not followed.
    pub alike: u32,
    /// Blocked by each of [`PickObstacle::NAMES`].
    pub blocked: [u32; 4],
    /// Free and unlike each other.
    pub free: u32,
}

/// Result of a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SuctionResult {
    /// The cup seals, holds the body, and gets there without touching anything else.
    Free,
    /// The cup seals and holds the body, but something is on its path.
    Blocked,
    /// The cup seals, but does not hold the body.
    Weak,
    /// The cup does not seal.
    Leaking,
}

impl SuctionResult {
    /// Every result, in the order of their numbers on disk.
    pub const ALL: [Self; 4] = [Self::Free, Self::Blocked, Self::Weak, Self::Leaking];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Blocked => "blocked",
            Self::Weak => "weak",
            Self::Leaking => "leaking",
        }
    }
}

/// A pose of the cup.
#[derive(Clone, Debug, PartialEq)]
pub struct SuctionPose {
    /// Number of the pose in drawn order, from 0.
    pub number: u32,
    /// Scheme that drew its point.
    pub scheme: PointScheme,
    /// The cup: origin where its axis meets the surface, z the approach.
    pub object_from_cup: Pose<Object, Approach>,
    /// Limit of [`SuctionPoses::SEAL_LIMITS`] that is used most.
    pub seal_limit: u8,
    /// 1 less the used share of that limit, at least -1; minus the share of rays that miss, if any does. The cup seals from 0 on.
    pub seal_margin: f64,
    /// Rays that miss the surface.
    pub missed: u32,
    /// Measures of the surface; `None` if a ray misses it.
    pub surface: Option<SealedSurface>,
    /// Scores of seal and wrench of SuctionNet-1Billion, 0 to 1.
    pub suctionnet: [f64; 2],
    /// Hold of the weight; `None` where the cup leaks.
    pub hold: Option<SuctionHold>,
    /// Path of cup and tube.
    pub passage: PickPassage,
    /// Share of poses with errors in which the cup seals and holds; `None` unless the pose is free and errors were drawn.
    pub robustness: Option<f64>,
}

/// Measures of the surface under a cup, along its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SealedSurface {
    /// Distance from the cup's frame to the farthest point of the lip [m].
    pub seat: f64,
    /// Mean compression of the bellows [m].
    pub compression: f64,
    /// Range of the lip's distances [m].
    pub spread: f64,
    /// Slope of the lip's plane along x and y of the cup's frame.
    pub slope: [f64; 2],
    /// Range of the lip's distances from its plane [m].
    pub flex: f64,
    /// Largest stretch of a piece of the lip, as a share of its length.
    pub stretch: f64,
    /// Largest height of the surface inside of the lip over its plane [m].
    pub bulge: f64,
    /// Largest depth of the surface inside of the lip, or along its outer edge, below its plane [m].
    pub hole: f64,
    /// Principal curvatures, ascending, positive where the object is convex [1/m].
    pub curvatures: [f64; 2],
}

/// Hold of the weight of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuctionHold {
    /// Strength of [`SuctionPoses::STRENGTHS`] that is used most.
    pub strength: u8,
    /// 1 less the used share of that strength, at least -1. The cup holds from 0 on.
    pub margin: f64,
    /// Used share of each of [`SuctionPoses::STRENGTHS`].
    pub used: [f64; 4],
    /// Force of the vacuum less that of the bellows [N].
    pub force: f64,
}

impl SealedSurface {
    /// Number of the measures.
    pub const COUNT: usize = 11;

    /// The measures in the order of the record.
    pub fn values(&self) -> [f64; Self::COUNT] {
        let &Self { seat, compression, spread, slope, flex, stretch, bulge, hole, curvatures } = self;
        [seat, compression, spread, slope[0], slope[1], flex, stretch, bulge, hole, curvatures[0], curvatures[1]]
    }

    /// Measures in the order of the record.
    pub(super) fn of_values(values: [f64; Self::COUNT]) -> Self {
        let [seat, compression, spread, x, y, flex, stretch, bulge, hole, low, high] = values;
        Self { seat, compression, spread, slope: [x, y], flex, stretch, bulge, hole, curvatures: [low, high] }
    }
}

impl SuctionPose {
    /// Whether the cup seals.
    pub fn is_sealed(&self) -> bool {
        self.seal_margin >= 0.0
    }

    /// Result of the pose.
    pub fn result(&self) -> SuctionResult {
        match self.hold {
            None => SuctionResult::Leaking,
            Some(hold) if hold.margin < 0.0 => SuctionResult::Weak,
            Some(_) if self.passage.is_free() => SuctionResult::Free,
            Some(_) => SuctionResult::Blocked,
        }
    }

    /// Whether the pose is free.
    pub fn is_free(&self) -> bool {
        self.result() == SuctionResult::Free
    }

    /// Obstacle on the path, as a number on disk; 0 for none.
    pub fn obstacle(&self) -> u8 {
        self.passage.blocked.map_or(0, |Blocked { by, .. }| by.number())
    }

    /// Number of the neighbour that is the obstacle; 0 without one.
    pub fn neighbour(&self) -> u32 {
        match self.passage.blocked {
            Some(Blocked { by: PickObstacle::Neighbour(number), .. }) => number,
            _ => 0,
        }
    }
}

impl SuctionDraws {
    /// Sum of all results.
    pub(super) fn sum(&self) -> u64 {
        let &Self { drawn: _, tilted, leaking, weak, alike, blocked, free } = self;
        let counts = [tilted, alike, free].into_iter().chain(leaking).chain(weak).chain(blocked);
        counts.map(u64::from).sum()
    }
}

impl SuctionPoses {
    /// Limits of a seal, in the order of their numbers on disk.
    pub const SEAL_LIMITS: [&str; 7] = ["surface", "stroke", "flex", "stretch", "bulge", "hole", "curvature"];

    /// Strengths of a cup, in the order of their numbers on disk.
    pub const STRENGTHS: [&str; 4] = ["pull", "shear", "torsion", "tilt"];

    /// Number of the body in the scene, from 1.
    pub fn body(&self) -> u32 {
        self.sample.item.0 + 1
    }

    /// The body's object.
    pub fn object(&self) -> ObjectId {
        self.bodies[self.sample.item.0 as usize].0
    }

    /// Pose of the body.
    pub fn world_from_object(&self) -> &Pose<World, Object> {
        &self.bodies[self.sample.item.0 as usize].1
    }

    /// The free poses.
    pub fn free(&self) -> impl Iterator<Item = &SuctionPose> + '_ {
        self.poses.iter().filter(|pose| pose.is_free())
    }
}
