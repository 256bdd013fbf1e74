//! Record of the grasps of one body of a scene, and of their obstacles.

use std::f64::consts::TAU;

use prost::Message;

use super::{PickObstacle, TakenGrasps};
use crate::{
    SceneContainer,
    codec::{
        RecordError,
        fields::{broken, lengthy, named, pose, ranged},
        proto, sample_from_proto, wire,
    },
};
use kernel::{
    geom::{HandBase, Object, Pose, World},
    ids::{Digest, ObjectId, SampleId},
    words::{BothWays, FreeWays, PathStage},
};

const MESSAGE: &str = "PickCandidates";

/// Bodies of a scene, at most.
const MAX_BODIES: usize = 1000;

/// Grasps of one body of a settled scene.
#[derive(Clone, Debug, PartialEq)]
pub struct PickCandidates {
    /// Which sample: the scene, and the number of the body minus one.
    pub sample: SampleId,
    /// Container of the scene.
    pub container: SceneContainer,
    /// The bodies of the scene, in its order: object and pose.
    pub bodies: Vec<(ObjectId, Pose<World, Object>)>,
    /// Name of the hand.
    pub hand: String,
    /// Digest of the hand's description and table.
    pub hand_id: ObjectId,
    /// Names of the hand's joints, in the order of its tree.
    pub joints: Vec<String>,
    /// Choice of the stored grasps, or that they are sampled.
    pub take: TakenGrasps,
    /// Grasps of the body's object from which candidates are drawn; 0 where they are sampled.
    pub stored: u32,
    /// Number of directions about its closing line in which each is evaluated.
    pub rolls: u32,
    /// Distance that the hand keeps from everything except the body [m].
    pub margin: f64,
    /// The grasps that were evaluated, sorted by run, rank and direction.
    pub candidates: Vec<PickCandidate>,
}

/// A grasp of a body, and its obstacles.
#[derive(Clone, Debug, PartialEq)]
pub struct PickCandidate {
    /// Number of the run of the stored grasp; 0 of a sampled one.
    pub run: u32,
    /// Index of the stored grasp in its run; of a sampled one the number of its pose in drawn order, from 0.
    pub rank: u32,
    /// Number of its direction; 0 is the stored grasp.
    pub direction: u32,
    /// The hand's base where it closes.
    pub world_from_base: Pose<World, HandBase>,
    /// The hand's path on both ways of approach.
    pub ways: BothWays<PickPassage>,
    /// All joints of the closed hand, if at least one way is free [rad or m]; else empty.
    pub closed: Vec<f64>,
}

/// The path of a hand on one way of approach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickPassage {
    /// Obstacle on the path, and the stage of the path; `None` if the path is free.
    pub blocked: Option<Blocked>,
    /// Distance from the obstacle [m], negative where they overlap, by at most [`PickCandidates::DEEP`]; for a free path the
    /// smallest distance from anything except the body, up to [`PickCandidates::FAR`].
    pub clearance: f64,
}

/// Obstacle of a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Blocked {
    /// Part of the path.
    pub stage: PathStage,
    /// The obstacle.
    pub by: PickObstacle,
}

impl PickPassage {
    /// Whether the hand approaches and closes without touching anything except the body.
    pub fn is_free(&self) -> bool {
        self.blocked.is_none()
    }

    /// Number of the neighbour that is the obstacle; 0 without one.
    fn neighbour(&self) -> u32 {
        match self.blocked.map(|blocked| blocked.by) {
            Some(PickObstacle::Neighbour(number)) => number,
            _ => 0,
        }
    }
}

impl PickCandidate {
    /// Whether the hand, approaching in its posture as in trials, approaches and closes without touching anything except the body.
    pub fn is_free(&self) -> bool {
        self.ways.shaped.is_free()
    }

    /// Ways on which the hand approaches and closes without touching anything except the body.
    pub fn free_ways(&self) -> FreeWays {
        self.ways.map(|way| way.is_free()).into()
    }

    fn key(&self) -> [u32; 3] {
        [self.run, self.rank, self.direction]
    }
}

impl PickCandidates {
    /// Largest clearance that is stored [m].
    pub const FAR: f64 = 0.01;
    /// Deepest overlap that is stored [m].
    pub const DEEP: f64 = 0.001;

    /// Number of the body in the scene, from 1.
    pub fn body(&self) -> u32 {
        self.sample.item.0 + 1
    }

    /// The body's object.
    pub fn object(&self) -> ObjectId {
        self.bodies[self.sample.item.0 as usize].0
    }

    /// Indices of the candidates that are free for the hand in its posture.
    pub fn free(&self) -> impl Iterator<Item = usize> + '_ {
        self.candidates.iter().enumerate().filter(|(_, candidate)| candidate.is_free()).map(|(index, _)| index)
    }

    /// Smallest rotation about its closing line by which each candidate becomes a free one, from -pi to pi [rad]: 0 of a free
    /// candidate, `None` where no direction of the same stored grasp is free. Of two equally large ones the positive one.
    /// Directions are evaluated in steps of `2 pi / rolls`, so that the exact smallest rotation is less than a step nearer.
    pub fn nearest_free_rotations(&self) -> Vec<Option<f64>> {
        let rolls = i64::from(self.rolls);
        let mut found = Vec::with_capacity(self.candidates.len());
        for same in self.candidates.chunk_by(|a, b| (a.run, a.rank) == (b.run, b.rank)) {
            let free: Vec<_> =
                same.iter().filter(|each| each.is_free()).map(|each| i64::from(each.direction)).collect();
            found.extend(same.iter().map(|candidate| {
                let steps = free.iter().map(|free| {
                    let ahead = (free - i64::from(candidate.direction)).rem_euclid(rolls);
                    if 2 * ahead > rolls { ahead - rolls } else { ahead }
                });
                let nearest = steps.min_by_key(|steps| (steps.abs(), *steps < 0))?;
                Some(TAU * nearest as f64 / rolls as f64)
            }));
        }
        found
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let all = || self.candidates.iter();
        out.reserve(160 * self.candidates.len() + 144 * self.bodies.len() + 256);
        wire::sample(out, 1, &self.sample);
        wire::bytes(out, 2, self.container.name().as_bytes());
        wire::doubles(out, 3, &self.container.sizes());
        let objects: Vec<u8> = self.bodies.iter().flat_map(|(object, _)| object.0.0).collect();
        wire::bytes(out, 4, &objects);
        wire::doubles_of(out, 5, self.bodies.iter().flat_map(|(_, pose)| pose.to_rows()));
        wire::bytes(out, 6, self.hand.as_bytes());
        wire::bytes(out, 7, &self.hand_id.0.0);
        wire::bytes(out, 8, self.take.name().as_bytes());
        wire::uint32(out, 9, self.stored);
        wire::uint32(out, 10, self.rolls);
        wire::double(out, 11, self.margin);
        wire::uint32s(out, 12, all().map(|candidate| candidate.run));
        wire::uint32s(out, 13, all().map(|candidate| candidate.rank));
        wire::uint32s(out, 14, all().map(|candidate| candidate.direction));
        wire::doubles_of(out, 15, all().flat_map(|candidate| candidate.world_from_base.to_rows()));
        encode_ways(out, [16, 17, 18, 19], all().map(|candidate| candidate.ways.shaped));
        self.joints.iter().for_each(|name| wire::element(out, 20, name.as_bytes()));
        wire::doubles_of(out, 21, all().flat_map(|candidate| candidate.closed.iter().copied()));
        self.container.encode_mesh(out, [22, 23]);
        encode_ways(out, [24, 25, 26, 27], all().map(|candidate| candidate.ways.opened));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, a number is out of range or not finite, a pose is not a rigid motion, a name is
    /// unknown, or candidates are out of order.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::PickCandidates::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample.clone())?;
        let container = SceneContainer::of(
            MESSAGE,
            &raw.container,
            &raw.container_size,
            [&raw.container_vertices, &raw.container_triangles],
        )?;
        let bodies = bodies(&raw)?;
        let item = sample.item.0;
        let is_body = (item as usize) < bodies.len();
        ranged(MESSAGE, "sample.item", f64::from(item), is_body, "a body of the scene, from 0")?;
        lengthy(MESSAGE, "hand_digest", 32, raw.hand_digest.len())?;
        let names = TakenGrasps::ALL.map(TakenGrasps::name);
        named(MESSAGE, "take", &raw.take, &names)?;
        let take = TakenGrasps::ALL[names.iter().position(|name| *name == raw.take).unwrap_or_default()];
        ranged(MESSAGE, "rolls", f64::from(raw.rolls), raw.rolls > 0, "1 or more")?;
        let margin = raw.margin;
        ranged(MESSAGE, "margin", margin, (0.0..Self::FAR).contains(&margin), "from 0 to below 0.01")?;
        let candidates = candidates(&raw, bodies.len() as u32)?;
        let drawn_from = u64::from(raw.stored) * u64::from(raw.rolls);
        let count = candidates.len();
        let fits = take == TakenGrasps::Sampled || count as u64 <= drawn_from;
        ranged(MESSAGE, "runs", count as f64, fits, "at most stored times rolls")?;
        Ok(Self {
            sample,
            container,
            bodies,
            hand_id: ObjectId(Digest(raw.hand_digest.as_slice().try_into().unwrap_or_default())),
            hand: raw.hand,
            joints: raw.joints,
            take,
            stored: raw.stored,
            rolls: raw.rolls,
            margin,
            candidates,
        })
    }
}

/// Appends verdicts, stages, neighbours and clearances of one way.
fn encode_ways(out: &mut Vec<u8>, fields: [u32; 4], ways: impl ExactSizeIterator<Item = PickPassage> + Clone) {
    let [verdicts, stages, neighbours, clearances] = fields;
    wire::bytes_of(out, verdicts, ways.clone().map(|way| way.blocked.map_or(0, |blocked| blocked.by.number())));
    wire::bytes_of(out, stages, ways.clone().map(|way| way.blocked.map_or(0, |blocked| blocked.stage.number())));
    wire::uint32s(out, neighbours, ways.clone().map(|way| way.neighbour()));
    wire::doubles_of(out, clearances, ways.map(|way| way.clearance));
}

/// Object and pose of each body.
type Bodies = Vec<(ObjectId, Pose<World, Object>)>;

fn bodies(raw: &proto::PickCandidates) -> Result<Bodies, RecordError> {
    let count = raw.objects.len() / 32;
    ranged(MESSAGE, "objects", count as f64, (1..=MAX_BODIES).contains(&count), "1 to 1000 bodies")?;
    lengthy(MESSAGE, "objects", 32 * count, raw.objects.len())?;
    lengthy(MESSAGE, "world_from_object", 12 * count, raw.world_from_object.len())?;
    let digests = raw.objects.chunks_exact(32);
    let body = |(digest, rows): (&[u8], &[f64])| {
        let object = ObjectId(Digest(digest.try_into().expect("32 bytes")));
        Ok((object, pose(MESSAGE, "world_from_object", rows)?))
    };
    digests.zip(raw.world_from_object.chunks_exact(12)).map(body).collect()
}

fn candidates(raw: &proto::PickCandidates, bodies: u32) -> Result<Vec<PickCandidate>, RecordError> {
    let count = raw.runs.len();
    for (field, expected, found) in [
        ("ranks", count, raw.ranks.len()),
        ("directions", count, raw.directions.len()),
        ("world_from_base", 12 * count, raw.world_from_base.len()),
    ] {
        lengthy(MESSAGE, field, expected, found)?;
    }
    let shaped = Way {
        fields: ["verdicts", "stages", "neighbours", "clearances"],
        verdicts: &raw.verdicts,
        stages: &raw.stages,
        neighbours: &raw.neighbours,
        clearances: &raw.clearances,
        stage_words: "1 to 3, of the own object 1 or 2",
        is_opened: false,
    };
    let opened = Way {
        fields: ["verdicts_opened", "stages_opened", "neighbours_opened", "clearances_opened"],
        verdicts: &raw.verdicts_opened,
        stages: &raw.stages_opened,
        neighbours: &raw.neighbours_opened,
        clearances: &raw.clearances_opened,
        stage_words: "1 to 4, of the own object 1, 2 or 4",
        is_opened: true,
    };
    let (shaped, opened) = (shaped.passages(raw, count, bodies)?, opened.passages(raw, count, bodies)?);
    let joints = raw.joints.len();
    ranged(MESSAGE, "joints", joints as f64, joints > 0, "at least one")?;
    let is_closed = |index: usize| shaped[index].is_free() || opened[index].is_free();
    let closed_count = (0..count).filter(|index| is_closed(*index)).count();
    lengthy(MESSAGE, "closed_joints", closed_count * joints, raw.closed_joints.len())?;
    let wild = raw.closed_joints.iter().find(|value| !value.is_finite());
    ranged(MESSAGE, "closed_joints", wild.copied().unwrap_or_default(), wild.is_none(), "finite")?;
    let mut closed = raw.closed_joints.chunks_exact(joints);
    let mut found: Vec<PickCandidate> = Vec::with_capacity(count);
    for index in 0..count {
        let direction = raw.directions[index];
        ranged(MESSAGE, "directions", f64::from(direction), direction < raw.rolls, "below rolls")?;
        let candidate = PickCandidate {
            run: raw.runs[index],
            rank: raw.ranks[index],
            direction,
            world_from_base: pose(MESSAGE, "world_from_base", &raw.world_from_base[12 * index..][..12])?,
            ways: BothWays { shaped: shaped[index], opened: opened[index] },
            closed: if is_closed(index) { closed.next().unwrap_or_default().to_vec() } else { Vec::new() },
        };
        let is_next = found.last().is_none_or(|before| before.key() < candidate.key());
        ranged(MESSAGE, "directions", f64::from(direction), is_next, "sorted by run, rank and direction, none twice")?;
        found.push(candidate);
    }
    Ok(found)
}

/// The arrays of one way as they are stored.
struct Way<'r> {
    /// Names of verdicts, stages, neighbours and clearances.
    fields: [&'static str; 4],
    verdicts: &'r [u8],
    stages: &'r [u8],
    neighbours: &'r [u32],
    clearances: &'r [f64],
    /// Allowed stages, in words.
    stage_words: &'static str,
    /// Whether the hand takes its posture on this way.
    is_opened: bool,
}

impl Way<'_> {
    fn passages(
        &self,
        raw: &proto::PickCandidates,
        count: usize,
        bodies: u32,
    ) -> Result<Vec<PickPassage>, RecordError> {
        let [verdicts, stages, neighbours, clearances] = self.fields;
        for (field, found) in [
            (verdicts, self.verdicts.len()),
            (stages, self.stages.len()),
            (neighbours, self.neighbours.len()),
            (clearances, self.clearances.len()),
        ] {
            lengthy(MESSAGE, field, count, found)?;
        }
        (0..count).map(|index| self.passage(raw, index, bodies)).collect()
    }

    fn passage(&self, raw: &proto::PickCandidates, index: usize, bodies: u32) -> Result<PickPassage, RecordError> {
        let [.., clearances] = self.fields;
        let (blocked, clearance) = (self.blocked(raw, index, bodies)?, self.clearances[index]);
        // A free candidate keeps the margin, up to the tolerance of clearances.
        let fits = match blocked {
            Some(_) => (-PickCandidates::DEEP..raw.margin).contains(&clearance),
            None => (0.0..=PickCandidates::FAR).contains(&clearance),
        };
        let allowed = "from -0.001 to below the margin with an obstacle, else 0 to 0.01";
        ranged(MESSAGE, clearances, clearance, fits, allowed)?;
        Ok(PickPassage { blocked, clearance })
    }

    fn blocked(&self, raw: &proto::PickCandidates, index: usize, bodies: u32) -> Result<Option<Blocked>, RecordError> {
        let [verdicts, stages, neighbours, _] = self.fields;
        let (verdict, stage, neighbour) = (self.verdicts[index], self.stages[index], self.neighbours[index]);
        let own = raw.sample.as_ref().map_or(0, |sample| sample.item) + 1;
        let by = match verdict {
            0 => None,
            1 => Some(PickObstacle::Ground),
            2 => Some(PickObstacle::Container),
            3 => Some(PickObstacle::Own),
            4 => Some(PickObstacle::Neighbour(neighbour)),
            _ => return ranged(MESSAGE, verdicts, f64::from(verdict), false, "0 to 4").map(|()| None),
        };
        let has_walls = raw.container != "plane";
        let is_there = verdict != 2 || has_walls;
        ranged(MESSAGE, verdicts, f64::from(verdict), is_there, "a container only if the scene has one")?;
        let fits = match by {
            Some(PickObstacle::Neighbour(number)) => (1..=bodies).contains(&number) && number != own,
            _ => neighbour == 0,
        };
        ranged(MESSAGE, neighbours, f64::from(neighbour), fits, "another body where the verdict is 4, else 0")?;
        let Some(by) = by else {
            return ranged(MESSAGE, stages, f64::from(stage), stage == 0, "0 for a free candidate").map(|()| None);
        };
        // A hand that closes may touch the body, and a hand that approaches in its posture does not change it.
        let known = PathStage::of_number(stage)
            .filter(|stage| by != PickObstacle::Own || *stage != PathStage::Closing)
            .filter(|stage| self.is_opened || *stage != PathStage::Shaping);
        ranged(MESSAGE, stages, f64::from(stage), known.is_some(), self.stage_words)?;
        Ok(known.map(|stage| Blocked { stage, by }))
    }
}
