//! Codec of the poses of a cup, with all checks.

use prost::Message;

use super::{
    CupMeasures, SealedSurface, SuctionDraws, SuctionHold, SuctionPose, SuctionPoses, SuctionResult, SuctionRules,
};
use crate::{
    Blocked, PickCandidates, PickObstacle, PickPassage, SceneContainer,
    codec::{
        RecordError,
        fields::{broken, lengthy, pose, ranged},
        proto, sample_from_proto, wire,
    },
};
use kernel::{
    geom::{Object, Pose, World},
    ids::{Digest, ObjectId},
    words::{PathStage, PointScheme},
};

const MESSAGE: &str = "SuctionPoses";

/// Bodies of a scene, at most.
const MAX_BODIES: usize = 1000;

/// Strength on disk of a pose in which the cup leaks.
const NO_STRENGTH: u8 = 255;

const FINITE: &str = "finite";

impl SuctionPoses {
    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        out.reserve(360 * self.poses.len() + 144 * self.bodies.len() + 512);
        wire::sample(out, 1, &self.sample);
        wire::bytes(out, 2, self.container.name().as_bytes());
        wire::doubles(out, 3, &self.container.sizes());
        let objects: Vec<u8> = self.bodies.iter().flat_map(|(object, _)| object.0.0).collect();
        wire::bytes(out, 4, &objects);
        wire::doubles_of(out, 5, self.bodies.iter().flat_map(|(_, pose)| pose.to_rows()));
        self.container.encode_mesh(out, [6, 7]);
        wire::double(out, 8, self.mass);
        wire::doubles(out, 9, &self.centre_of_mass);
        let CupMeasures { radius, outer_radius, height, tube_radius, tube_length } = self.cup;
        wire::doubles(out, 10, &[radius, outer_radius, height, tube_radius, tube_length]);
        let SuctionRules { margin, half_angle, tilt, safety, any_direction, budget, wanted } = self.rules;
        for (field, value) in [(11, margin), (12, half_angle), (13, tilt), (14, safety)] {
            wire::double(out, field, value);
        }
        let SuctionDraws { drawn, tilted, leaking, weak, alike, blocked, free } = self.draws;
        let counts = [(15, u32::from(any_direction)), (16, budget), (17, wanted), (18, drawn), (19, tilted)];
        counts.into_iter().for_each(|(field, count)| wire::uint32(out, field, count));
        wire::uint32s(out, 20, leaking.into_iter());
        wire::uint32s(out, 21, weak.into_iter());
        wire::uint32(out, 22, alike);
        wire::uint32s(out, 23, blocked.into_iter());
        wire::uint32(out, 24, free);
        self.encode_poses(out);
    }

    fn encode_poses(&self, out: &mut Vec<u8>) {
        let all = || self.poses.iter();
        let held = |of: fn(&SuctionHold) -> f64| all().map(move |pose| pose.hold.as_ref().map_or(f64::NAN, of));
        wire::uint32s(out, 25, all().map(|pose| pose.number));
        wire::bytes_of(out, 26, all().map(|pose| pose.scheme as u8));
        wire::doubles_of(out, 27, all().flat_map(|pose| pose.object_from_cup.to_rows()));
        wire::bytes_of(out, 28, all().map(|pose| pose.result() as u8));
        wire::bytes_of(out, 29, all().map(|pose| pose.seal_limit));
        wire::doubles_of(out, 30, all().map(|pose| pose.seal_margin));
        wire::uint32s(out, 31, all().map(|pose| pose.missed));
        let surface =
            |pose: &SuctionPose| pose.surface.map_or([f64::NAN; SealedSurface::COUNT], |found| found.values());
        wire::doubles_of(out, 32, all().flat_map(surface));
        wire::doubles_of(out, 33, all().map(|pose| pose.suctionnet[0]));
        wire::doubles_of(out, 34, all().map(|pose| pose.suctionnet[1]));
        wire::bytes_of(out, 35, all().map(|pose| pose.hold.map_or(NO_STRENGTH, |hold| hold.strength)));
        wire::doubles_of(out, 36, held(|hold| hold.margin));
        wire::doubles_of(out, 37, all().flat_map(|pose| pose.hold.map_or([f64::NAN; 4], |hold| hold.used)));
        wire::doubles_of(out, 38, held(|hold| hold.force));
        wire::bytes_of(out, 39, all().map(SuctionPose::obstacle));
        wire::bytes_of(out, 40, all().map(|pose| pose.passage.blocked.map_or(0, |blocked| blocked.stage.number())));
        wire::uint32s(out, 41, all().map(SuctionPose::neighbour));
        wire::doubles_of(out, 42, all().map(|pose| pose.passage.clearance));
        wire::doubles_of(out, 43, all().map(|pose| pose.robustness.unwrap_or(f64::NAN)));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, counts do not add up, a number is out of range, a pose is not a rigid motion, a name is
    /// unknown, or the result of a pose is not that of its numbers.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::SuctionPoses::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample.clone())?;
        let mesh = [raw.container_vertices.as_slice(), raw.container_triangles.as_slice()];
        let container = SceneContainer::of(MESSAGE, &raw.container, &raw.container_size, mesh)?;
        let bodies = bodies(&raw)?;
        let item = sample.item.0;
        let is_body = (item as usize) < bodies.len();
        ranged(MESSAGE, "sample.item", f64::from(item), is_body, "a body of the scene, from 0")?;
        positive("mass", raw.mass)?;
        let centre_of_mass = array("centre_of_mass", &raw.centre_of_mass)?;
        let wild = centre_of_mass.iter().find(|value: &&f64| !value.is_finite());
        ranged(MESSAGE, "centre_of_mass", wild.copied().unwrap_or_default(), wild.is_none(), FINITE)?;
        let cup: [f64; 5] = array("cup", &raw.cup)?;
        cup.iter().try_for_each(|measure| positive("cup", *measure))?;
        let [radius, outer_radius, height, tube_radius, tube_length] = cup;
        let (rules, draws) = (rules(&raw)?, draws(&raw)?);
        ranged(MESSAGE, "drawn", f64::from(draws.drawn), draws.drawn <= rules.budget, "at most the budget")?;
        let found = Self {
            sample,
            container,
            mass: raw.mass,
            centre_of_mass,
            cup: CupMeasures { radius, outer_radius, height, tube_radius, tube_length },
            rules,
            draws,
            poses: poses(&raw, item + 1, bodies.len() as u32)?,
            bodies,
        };
        found.check_counts()?;
        Ok(found)
    }

    /// All free poses are stored, and of the others no more than were drawn.
    fn check_counts(&self) -> Result<(), RecordError> {
        let sum = |counts: &[u32]| counts.iter().copied().map(u64::from).sum::<u64>();
        let stored = |result| self.poses.iter().filter(|pose| pose.result() == result).count() as u64;
        let free = u64::from(self.draws.free);
        let fits = stored(SuctionResult::Free) == free;
        ranged(MESSAGE, "free", free as f64, fits, "the number of free poses that are stored")?;
        for (field, result, drawn) in [
            ("blocked", SuctionResult::Blocked, sum(&self.draws.blocked)),
            ("weak", SuctionResult::Weak, sum(&self.draws.weak)),
            ("leaking", SuctionResult::Leaking, sum(&self.draws.leaking)),
        ] {
            ranged(MESSAGE, field, drawn as f64, stored(result) <= drawn, "at least the number of stored poses")?;
        }
        let last = self.poses.last().map_or(0, |pose| u64::from(pose.number) + 1);
        let fits = last <= u64::from(self.draws.drawn);
        ranged(MESSAGE, "drawn", f64::from(self.draws.drawn), fits, "above the number of every pose")
    }
}

fn positive(field: &'static str, value: f64) -> Result<(), RecordError> {
    ranged(MESSAGE, field, value, value > 0.0 && value.is_finite(), "positive and finite")
}

fn share(field: &'static str, value: f64) -> Result<(), RecordError> {
    ranged(MESSAGE, field, value, (0.0..=1.0).contains(&value), "0 to 1")
}

fn array<T: Copy, const COUNT: usize>(field: &'static str, values: &[T]) -> Result<[T; COUNT], RecordError> {
    lengthy(MESSAGE, field, COUNT, values.len())?;
    Ok(std::array::from_fn(|index| values[index]))
}

/// Object and pose of each body.
type Bodies = Vec<(ObjectId, Pose<World, Object>)>;

fn bodies(raw: &proto::SuctionPoses) -> Result<Bodies, RecordError> {
    let count = raw.objects.len() / 32;
    ranged(MESSAGE, "objects", count as f64, (1..=MAX_BODIES).contains(&count), "1 to 1000 bodies")?;
    lengthy(MESSAGE, "objects", 32 * count, raw.objects.len())?;
    lengthy(MESSAGE, "world_from_object", 12 * count, raw.world_from_object.len())?;
    let body = |(digest, rows): (&[u8], &[f64])| {
        let object = ObjectId(Digest(digest.try_into().expect("32 bytes")));
        Ok((object, pose(MESSAGE, "world_from_object", rows)?))
    };
    raw.objects.chunks_exact(32).zip(raw.world_from_object.chunks_exact(12)).map(body).collect()
}

fn rules(raw: &proto::SuctionPoses) -> Result<SuctionRules, RecordError> {
    let margin = raw.margin;
    ranged(MESSAGE, "margin", margin, (0.0..PickCandidates::FAR).contains(&margin), "from 0 to below 0.01")?;
    positive("half_angle", raw.half_angle)?;
    ranged(MESSAGE, "tilt", raw.tilt, raw.tilt >= 0.0 && raw.tilt.is_finite(), "at least 0 and finite")?;
    positive("safety", raw.safety)?;
    ranged(MESSAGE, "any_direction", f64::from(raw.any_direction), raw.any_direction <= 1, "0 or 1")?;
    Ok(SuctionRules {
        margin,
        half_angle: raw.half_angle,
        tilt: raw.tilt,
        safety: raw.safety,
        any_direction: raw.any_direction == 1,
        budget: raw.budget,
        wanted: raw.wanted,
    })
}

fn draws(raw: &proto::SuctionPoses) -> Result<SuctionDraws, RecordError> {
    let draws = SuctionDraws {
        drawn: raw.drawn,
        tilted: raw.tilted,
        leaking: array("leaking", &raw.leaking)?,
        weak: array("weak", &raw.weak)?,
        alike: raw.alike,
        blocked: array("blocked", &raw.blocked)?,
        free: raw.free,
    };
    let fits = draws.sum() == u64::from(draws.drawn);
    ranged(MESSAGE, "drawn", f64::from(draws.drawn), fits, "the sum of all results")?;
    Ok(draws)
}

fn poses(raw: &proto::SuctionPoses, own: u32, bodies: u32) -> Result<Vec<SuctionPose>, RecordError> {
    let count = raw.poses.len();
    for (field, expected, found) in [
        ("schemes", count, raw.schemes.len()),
        ("object_from_cup", 12 * count, raw.object_from_cup.len()),
        ("results", count, raw.results.len()),
        ("seal_limits", count, raw.seal_limits.len()),
        ("seal_margins", count, raw.seal_margins.len()),
        ("missed", count, raw.missed.len()),
        ("surfaces", SealedSurface::COUNT * count, raw.surfaces.len()),
        ("seals", count, raw.seals.len()),
        ("wrenches", count, raw.wrenches.len()),
        ("strengths", count, raw.strengths.len()),
        ("hold_margins", count, raw.hold_margins.len()),
        ("used", 4 * count, raw.used.len()),
        ("forces", count, raw.forces.len()),
        ("obstacles", count, raw.obstacles.len()),
        ("stages", count, raw.stages.len()),
        ("neighbours", count, raw.neighbours.len()),
        ("clearances", count, raw.clearances.len()),
        ("robustness", count, raw.robustness.len()),
    ] {
        lengthy(MESSAGE, field, expected, found)?;
    }
    let mut found: Vec<SuctionPose> = Vec::with_capacity(count);
    for index in 0..count {
        let next = one_pose(raw, index, (own, bodies))?;
        let is_next = found.last().is_none_or(|before| before.number < next.number);
        ranged(MESSAGE, "poses", f64::from(next.number), is_next, "ascending")?;
        found.push(next);
    }
    Ok(found)
}

fn one_pose(raw: &proto::SuctionPoses, index: usize, (own, bodies): (u32, u32)) -> Result<SuctionPose, RecordError> {
    let number = raw.schemes[index];
    let scheme = PointScheme::ALL.get(usize::from(number)).copied();
    ranged(MESSAGE, "schemes", f64::from(number), scheme.is_some(), "0 to 2")?;
    let (seal_limit, seal_margin) = (raw.seal_limits[index], raw.seal_margins[index]);
    let is_limit = usize::from(seal_limit) < SuctionPoses::SEAL_LIMITS.len();
    ranged(MESSAGE, "seal_limits", f64::from(seal_limit), is_limit, "0 to 6")?;
    ranged(MESSAGE, "seal_margins", seal_margin, (-1.0..=1.0).contains(&seal_margin), "-1 to 1")?;
    let missed = raw.missed[index];
    let fits = missed == 0 || (seal_limit == 0 && seal_margin < 0.0);
    ranged(MESSAGE, "missed", f64::from(missed), fits, "0 unless the surface is the weakest limit")?;
    let suctionnet = [raw.seals[index], raw.wrenches[index]];
    share("seals", suctionnet[0])?;
    share("wrenches", suctionnet[1])?;
    let found = SuctionPose {
        number: raw.poses[index],
        scheme: scheme.unwrap_or(PointScheme::Area),
        object_from_cup: pose(MESSAGE, "object_from_cup", &raw.object_from_cup[12 * index..][..12])?,
        seal_limit,
        seal_margin,
        missed,
        surface: surface(raw, index)?,
        suctionnet,
        hold: hold(raw, index)?,
        passage: passage(raw, index, (own, bodies))?,
        robustness: None,
    };
    let result = raw.results[index];
    ranged(MESSAGE, "results", f64::from(result), result == found.result() as u8, "the result of the pose's numbers")?;
    let robustness = raw.robustness[index];
    let fits = robustness.is_nan() || (found.is_free() && (0.0..=1.0).contains(&robustness));
    ranged(MESSAGE, "robustness", robustness, fits, "0 to 1 of a free pose, else NaN")?;
    Ok(SuctionPose { robustness: (!robustness.is_nan()).then_some(robustness), ..found })
}

/// Measures of the surface, unless a ray misses it.
fn surface(raw: &proto::SuctionPoses, index: usize) -> Result<Option<SealedSurface>, RecordError> {
    let values: [f64; SealedSurface::COUNT] =
        array("surfaces", &raw.surfaces[SealedSurface::COUNT * index..][..SealedSurface::COUNT])?;
    let is_met = raw.missed[index] == 0;
    let wild = values.iter().find(|value| value.is_finite() != is_met || (!is_met && !value.is_nan()));
    let allowed = "finite, or NaN where a ray misses";
    ranged(MESSAGE, "surfaces", wild.copied().unwrap_or_default(), wild.is_none(), allowed)?;
    Ok(is_met.then(|| SealedSurface::of_values(values)))
}

/// Hold of the weight, if the cup seals.
fn hold(raw: &proto::SuctionPoses, index: usize) -> Result<Option<SuctionHold>, RecordError> {
    let (strength, margin, force) = (raw.strengths[index], raw.hold_margins[index], raw.forces[index]);
    let used: [f64; 4] = array("used", &raw.used[4 * index..][..4])?;
    if raw.seal_margins[index] < 0.0 {
        ranged(MESSAGE, "strengths", f64::from(strength), strength == NO_STRENGTH, "255 where the cup leaks")?;
        let numbers = [margin, force].into_iter().chain(used);
        let wild = numbers.into_iter().find(|value| !value.is_nan());
        ranged(MESSAGE, "used", wild.unwrap_or_default(), wild.is_none(), "NaN where the cup leaks")?;
        return Ok(None);
    }
    let is_known = usize::from(strength) < SuctionPoses::STRENGTHS.len();
    ranged(MESSAGE, "strengths", f64::from(strength), is_known, "0 to 3 where the cup seals")?;
    ranged(MESSAGE, "hold_margins", margin, (-1.0..=1.0).contains(&margin), "-1 to 1")?;
    // A cup without any strength left uses an infinite share.
    let wild = used.iter().find(|share| share.is_nan() || **share < 0.0);
    ranged(MESSAGE, "used", wild.copied().unwrap_or_default(), wild.is_none(), "at least 0")?;
    ranged(MESSAGE, "forces", force, force >= 0.0 && force.is_finite(), "at least 0 and finite")?;
    Ok(Some(SuctionHold { strength, margin, used, force }))
}

fn passage(raw: &proto::SuctionPoses, index: usize, (own, bodies): (u32, u32)) -> Result<PickPassage, RecordError> {
    let (obstacle, stage, neighbour) = (raw.obstacles[index], raw.stages[index], raw.neighbours[index]);
    let clearance = raw.clearances[index];
    let by = match obstacle {
        0 => None,
        1 => Some(PickObstacle::Ground),
        2 => Some(PickObstacle::Container),
        3 => Some(PickObstacle::Own),
        4 => Some(PickObstacle::Neighbour(neighbour)),
        _ => {
            ranged(MESSAGE, "obstacles", f64::from(obstacle), false, "0 to 4")?;
            None
        }
    };
    let is_there = obstacle != 2 || raw.container != "plane";
    ranged(MESSAGE, "obstacles", f64::from(obstacle), is_there, "a container only if the scene has one")?;
    let fits = match by {
        Some(PickObstacle::Neighbour(number)) => (1..=bodies).contains(&number) && number != own,
        _ => neighbour == 0,
    };
    ranged(MESSAGE, "neighbours", f64::from(neighbour), fits, "another body where the obstacle is 4, else 0")?;
    let known = PathStage::of_number(stage).filter(|stage| matches!(stage, PathStage::Pregrasp | PathStage::Approach));
    ranged(MESSAGE, "stages", f64::from(stage), known.is_some() == by.is_some(), "1 or 2 with an obstacle, else 0")?;
    ranged(MESSAGE, "stages", f64::from(stage), stage <= 2, "0 to 2")?;
    let blocked = known.zip(by).map(|(stage, by)| Blocked { stage, by });
    let fits = match blocked {
        Some(_) => (-PickCandidates::DEEP..raw.margin).contains(&clearance),
        None => (0.0..=PickCandidates::FAR).contains(&clearance),
    };
    let allowed = "from -0.001 to below the margin with an obstacle, else 0 to 0.01";
    ranged(MESSAGE, "clearances", clearance, fits, allowed)?;
    Ok(PickPassage { blocked, clearance })
}
