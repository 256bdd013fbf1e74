//! Grasps of one annealing run: the best states of the hand, closed, rated and judged.

use nalgebra::Vector3;
use prost::Message;

use super::{GraspFacts, LadderFacts, TrialFacts};
use crate::codec::{
    RecordError,
    fields::{broken, lengthy, named, pose, ranged},
    proto, sample_from_proto, wire,
};
use kernel::{
    geom::{Approach, Frame, HandBase, Object, Pose},
    ids::{Digest, ObjectId, SampleId},
    words::{BothWays, FreeWays, GraspVerdict, PathStage, PointScheme, STRETCHES},
};

const MESSAGE: &str = "GraspRun";
/// Where a search began: origin on an object's surface, z along the inward normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seed;

impl Frame for Seed {
    const NAME: &'static str = "seed";
}

/// Method of search and rating: settings that energies and quality were computed with.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspMethod {
    /// Sampler of the hand's states: `annealing`, `uniform`, `antipodal` or `approach`.
    pub sampler: String,
    /// Energy that was minimised: `contact` or `contact_and_potential`.
    pub energy: String,
    /// The space of the potential: `force` or `wrench`.
    pub energy_space: String,
    /// Friction coefficient of the potential.
    pub energy_friction: f64,
    /// Factor of the potential while it was minimised.
    pub potential_scale: f64,
    /// Contact model of the quality: `hard_point` or `soft_finger`.
    pub contact_model: String,
    /// Friction coefficient of the quality.
    pub friction: f64,
    /// Edges of the friction cone.
    pub edges: u32,
    /// Torsional coefficient of soft fingers [share of the normal force times the object's radius]; 0 for hard points.
    pub torsion: f64,
    /// The space in which force closure is required: `force` or `wrench`.
    pub space: String,
    /// Smallest epsilon in that space of a kept grasp.
    pub min_epsilon: f64,
    /// Deepest overlap of hand and mesh before closing [m].
    pub max_penetration: f64,
    /// Largest distance that the hand could move along its approach before it closed [m].
    pub max_advance: f64,
    /// Distance of the pregrasp back along the approach [m].
    pub stand_off: f64,
}

/// The hand of a run: the names that the numbers of its grasps refer to.
#[derive(Clone, Debug, PartialEq)]
pub struct HandNames {
    /// Name of the hand.
    pub name: String,
    /// Digest of the description and table.
    pub id: ObjectId,
    /// Names of the links; the base is the first.
    pub links: Vec<String>,
    /// All its joints, in the order of its tree.
    pub joints: Vec<String>,
    /// Names of the joints with motors: a posture has one value for each.
    pub driven: Vec<String>,
}

/// A tenth of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RunInterval {
    /// Steps that were accepted.
    pub accepted: u32,
    /// Mean energy after its steps; NaN before the first legal state.
    pub mean_energy: f64,
}

/// A point where the closed hand touches, in `Object`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldContact {
    /// Index of the link in [`HandNames::links`].
    pub link: u32,
    /// On the object's surface [m].
    pub point: [f64; 3],
    /// Outward from the object, of unit length.
    pub normal: [f64; 3],
    /// From the object to the link [m].
    pub distance: f64,
}

/// One state of the best list, closed and rated.
#[derive(Clone, Debug, PartialEq)]
pub struct Grasp {
    /// The approach frame where the hand closes: origin on the palm, z towards the object.
    pub object_from_approach: Pose<Object, Approach>,
    /// The hand's base there.
    pub object_from_base: Pose<Object, HandBase>,
    /// Posture of the opened hand: opened, but for joints that shape the hand [rad or m].
    pub opening: Vec<f64>,
    /// Posture before closing [rad or m], one value per driven joint.
    pub posture: Vec<f64>,
    /// Amplitudes of the eigengrasps in that posture.
    pub amplitudes: Vec<f64>,
    /// All joints in that posture [rad or m].
    pub joints_before: Vec<f64>,
    /// All joints of the closed hand [rad or m].
    pub joints: Vec<f64>,
    /// Distance that the hand moved along its approach from the annealed state [m].
    pub advance: f64,
    /// Translation by which a gripper gave way until both pads hold the object, expressed in its approach frame before
    /// that [m]; `None` where it did not.
    pub shift: Option<[f64; 3]>,
    /// Rotation by which it gave way: an axis times an angle [rad].
    pub turn: Option<[f64; 3]>,
    /// Overlap of hand and mesh in that state [m].
    pub penetration: f64,
    /// Energy that was minimised, of that state, with exact distances.
    pub energy: f64,
    /// The contact energy.
    pub contact_energy: f64,
    /// -epsilon of the weighted virtual contacts, or 1; not scaled.
    pub potential: f64,
    /// Where the closed hand touches.
    pub contacts: Vec<HeldContact>,
    /// Radius of the largest ball in the hull of forces.
    pub epsilon_force: f64,
    /// Radius of the largest ball in the hull of forces and torques.
    pub epsilon_wrench: f64,
    /// Volume of that hull.
    pub volume: f64,
    /// The closed joints, binned; `None` for a hand for which it is not defined.
    pub kind: Option<u32>,
    /// Free width between the pads of the closed hand [m]; `None` for a hand without a width.
    pub width: Option<f64>,
    /// Whether it is kept.
    pub verdict: GraspVerdict,
    /// For each pose of [`GraspRun::resting_poses`], the lowest point of the hand over the table [m], negative below it: while it
    /// approaches in its posture and closes; and while it approaches opened, takes that posture, and closes. Empty if the verdict
    /// is [`GraspVerdict::Penetrates`]: such a hand was not closed.
    pub clearances: Vec<[f64; 2]>,
    /// Phase of each way of approach in which the object obstructs the hand before it closes; `None` if it does not. No phases at
    /// all if the verdict is [`GraspVerdict::Penetrates`].
    pub object_in_way: Option<BothWays<Option<PathStage>>>,
    /// Scheme by which the first point of its pair was drawn; `None` of samplers without pairs.
    pub point_scheme: Option<PointScheme>,
}

/// Obstacles of a hand that approaches a grasp.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WayObstacles {
    /// The object itself, before the hand closes on it.
    pub object: bool,
    /// The table on which the object rests.
    pub table: bool,
}

impl WayObstacles {
    /// Whether there is no obstacle.
    pub fn is_free(self) -> bool {
        !self.object && !self.table
    }

    /// Their names: `object`, `table`, `object and table`, or nothing.
    pub fn words(self) -> &'static str {
        match (self.object, self.table) {
            (false, false) => "",
            (true, false) => "object",
            (false, true) => "table",
            (true, true) => "object and table",
        }
    }
}

impl Grasp {
    /// Whether the hand that approaches in its posture stays above the table on which the object rests in a pose.
    pub fn is_above_table(&self, pose: usize) -> bool {
        self.clearances.get(pose).is_some_and(|[shaped, _]| *shaped >= 0.0)
    }

    /// Index of the most likely resting pose above whose table the hand stays while it approaches in its posture.
    pub fn likeliest_table(&self) -> Option<usize> {
        (0..self.clearances.len()).find(|pose| self.is_above_table(*pose))
    }

    /// Obstacles on both ways of approach: without a table, or on that of a resting pose. `None` if the verdict is
    /// [`GraspVerdict::Penetrates`], or there is no such pose.
    pub fn obstacles(&self, pose: Option<usize>) -> Option<BothWays<WayObstacles>> {
        let BothWays { shaped, opened } = self.object_in_way?.map(|stage| stage.is_some());
        let below = match pose {
            None => [false; 2],
            Some(pose) => self.clearances.get(pose)?.map(|clearance| clearance < 0.0),
        };
        let obstacles = |object: bool, table: bool| WayObstacles { object, table };
        Some(BothWays { shaped: obstacles(shaped, below[0]), opened: obstacles(opened, below[1]) })
    }

    /// Ways of approach without an obstacle: without a table, or on that of a resting pose.
    pub fn free_ways(&self, pose: Option<usize>) -> FreeWays {
        self.obstacles(pose).map_or(FreeWays::None, |obstacles| obstacles.map(WayObstacles::is_free).into())
    }

    /// Driven joints of a hand that approaches on the first free way, opened before in its posture [rad or m]; `None` if neither
    /// is free.
    pub fn pregrasp(&self, pose: Option<usize>) -> Option<&[f64]> {
        match self.free_ways(pose) {
            FreeWays::None => None,
            FreeWays::Opened | FreeWays::Both => Some(&self.opening),
            FreeWays::Posture => Some(&self.posture),
        }
    }

    /// Quality in the space that a method selects.
    pub fn epsilon(&self, method: &GraspMethod) -> f64 {
        if method.space == FORCE { self.epsilon_force } else { self.epsilon_wrench }
    }
}

/// One run of annealing, of one seed of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspRun {
    /// Which sample: the object, and the seed's number as its view.
    pub sample: SampleId,
    /// The hand.
    pub hand: HandNames,
    /// Where the search began.
    pub object_from_seed: Pose<Object, Seed>,
    /// Steps that the job sets.
    pub asked_steps: u32,
    /// Steps that were taken: fewer where the seed was given up.
    pub steps: u32,
    /// Number of steps without a legal neighbour.
    pub failed: u32,
    /// Neighbours that were evaluated.
    pub tries: u64,
    /// Number of tries whose wrench space was evaluated.
    pub potentials: u64,
    /// Ten tenths of the run.
    pub course: [RunInterval; STRETCHES],
    /// Method that the numbers were computed with.
    pub method: GraspMethod,
    /// Best first by energy.
    pub grasps: Vec<Grasp>,
    /// Resting poses of the object, which the asset table lists; each grasp that was closed has a clearance over the table
    /// for every one of them.
    pub resting_poses: u32,
    /// Whether a run over pairs or approaches drew its whole budget before it had its states.
    pub budget_spent: bool,
}

/// Names of spaces, energies and contact models.
pub const FORCE: &str = "force";
/// Forces and torques.
pub const WRENCH: &str = "wrench";
const ENERGIES: [&str; 2] = ["contact", "contact_and_potential"];
const SAMPLERS: [&str; 4] = ["annealing", "uniform", "antipodal", "approach"];
const MODELS: [&str; 2] = ["hard_point", "soft_finger"];

impl GraspRun {
    /// Whether the seed was given up before the run was over.
    pub fn is_given_up(&self) -> bool {
        self.steps < self.asked_steps
    }

    /// The kept grasps, best first by energy.
    pub fn kept(&self) -> impl Iterator<Item = &Grasp> {
        self.grasps.iter().filter(|grasp| grasp.verdict == GraspVerdict::Kept)
    }

    /// Counts for tables.
    pub fn facts(&self) -> GraspFacts {
        let mut verdicts = [0; GraspVerdict::ALL.len()];
        self.grasps.iter().for_each(|grasp| verdicts[grasp.verdict as usize] += 1);
        GraspFacts {
            verdicts,
            best_energy: self.grasps.iter().map(|grasp| grasp.energy).fold(f64::INFINITY, f64::min),
            best_epsilon: self.kept().map(|grasp| grasp.epsilon(&self.method)).fold(0.0, f64::max),
            given_up: self.is_given_up(),
            budget_spent: self.budget_spent,
            trials: TrialFacts::default(),
            ladder: LadderFacts::default(),
        }
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let HandNames { name, id, links, joints, driven } = &self.hand;
        wire::sample(out, 1, &self.sample);
        wire::bytes(out, 2, name.as_bytes());
        wire::bytes(out, 3, &id.0.0);
        for (field, names) in [(4, links), (5, joints), (6, driven)] {
            names.iter().for_each(|name| wire::element(out, field, name.as_bytes()));
        }
        wire::doubles(out, 7, &self.object_from_seed.to_rows());
        wire::uint32(out, 8, self.asked_steps);
        wire::uint32(out, 9, self.steps);
        wire::uint32(out, 10, self.failed);
        wire::uint64(out, 11, self.tries);
        wire::uint64(out, 12, self.potentials);
        wire::uint32s(out, 13, self.course.iter().map(|stretch| stretch.accepted));
        // IEEE 754 does not define which NaN an operation returns.
        let one_nan = |value: f64| if value.is_nan() { f64::NAN } else { value };
        wire::doubles_of(out, 14, self.course.iter().map(|stretch| one_nan(stretch.mean_energy)));
        self.method.encode(out);
        let mut message = Vec::new();
        for grasp in &self.grasps {
            message.clear();
            grasp.encode(&mut message);
            wire::element(out, 28, &message);
        }
        // The name of annealing is not written, so that runs of earlier versions keep their bytes.
        if self.method.sampler != SAMPLERS[0] {
            wire::bytes(out, 40, self.method.sampler.as_bytes());
        }
        wire::uint32(out, 41, self.resting_poses);
        wire::uint32(out, 42, u32::from(self.budget_spent));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, a number is out of range or not finite, a pose is not a rigid motion, a normal is not
    /// of unit length, or a name is unknown.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let mut run = proto::GraspRun::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, run.sample.take())?;
        let method = GraspMethod::of(&run)?;
        lengthy(MESSAGE, "hand_digest", 32, run.hand_digest.len())?;
        let id = ObjectId(Digest(run.hand_digest.as_slice().try_into().unwrap_or_default()));
        ranged(MESSAGE, "links", run.links.len() as f64, !run.links.is_empty(), "at least one, the base")?;
        lengthy(MESSAGE, "links", run.joints.len() + 1, run.links.len())?;
        let (driven, joints) = (run.driven.len(), run.joints.len());
        ranged(MESSAGE, "driven", driven as f64, (1..=joints).contains(&driven), "1 to the count of joints")?;
        let steps = run.steps;
        ranged(MESSAGE, "steps", f64::from(steps), (1..=run.asked_steps).contains(&steps), "1 to asked_steps")?;
        ranged(MESSAGE, "failed", f64::from(run.failed), run.failed <= steps, "at most steps")?;
        ranged(MESSAGE, "potentials", run.potentials as f64, run.potentials <= run.tries, "at most tries")?;
        let course = course(&run)?;
        let mut grasps: Vec<Grasp> = Vec::with_capacity(run.grasps.len());
        for grasp in &run.grasps {
            let grasp = Grasp::of(grasp, &run)?;
            let best = grasps.last().map_or(f64::NEG_INFINITY, |before| before.energy);
            ranged(MESSAGE, "grasps.energy", grasp.energy, grasp.energy >= best, "no better than the one before")?;
            grasps.push(grasp);
        }
        Ok(Self {
            sample,
            object_from_seed: pose(MESSAGE, "object_from_seed", &run.object_from_seed)?,
            asked_steps: run.asked_steps,
            steps,
            failed: run.failed,
            tries: run.tries,
            potentials: run.potentials,
            course,
            method,
            grasps,
            resting_poses: run.resting_poses,
            budget_spent: run.budget_spent,
            hand: HandNames { name: run.hand, id, links: run.links, joints: run.joints, driven: run.driven },
        })
    }
}

fn course(run: &proto::GraspRun) -> Result<[RunInterval; STRETCHES], RecordError> {
    lengthy(MESSAGE, "accepted", STRETCHES, run.accepted.len())?;
    lengthy(MESSAGE, "mean_energy", STRETCHES, run.mean_energy.len())?;
    if let Some(value) = run.mean_energy.iter().find(|value| value.is_infinite()) {
        ranged(MESSAGE, "mean_energy", *value, false, "finite or NaN")?;
    }
    Ok(std::array::from_fn(|index| RunInterval { accepted: run.accepted[index], mean_energy: run.mean_energy[index] }))
}

impl GraspMethod {
    /// Appends fields 15 to 26 of a run.
    fn encode(&self, out: &mut Vec<u8>) {
        wire::bytes(out, 15, self.energy.as_bytes());
        wire::bytes(out, 16, self.energy_space.as_bytes());
        wire::double(out, 17, self.energy_friction);
        wire::double(out, 18, self.potential_scale);
        wire::bytes(out, 19, self.contact_model.as_bytes());
        wire::double(out, 20, self.friction);
        wire::uint32(out, 21, self.edges);
        wire::double(out, 22, self.torsion);
        wire::bytes(out, 23, self.space.as_bytes());
        wire::double(out, 24, self.min_epsilon);
        wire::double(out, 25, self.max_penetration);
        wire::double(out, 26, self.stand_off);
        wire::double(out, 27, self.max_advance);
    }

    fn of(run: &proto::GraspRun) -> Result<Self, RecordError> {
        let sampler = if run.sampler.is_empty() { SAMPLERS[0] } else { &run.sampler };
        named(MESSAGE, "sampler", sampler, &SAMPLERS)?;
        named(MESSAGE, "energy", &run.energy, &ENERGIES)?;
        named(MESSAGE, "energy_space", &run.energy_space, &[FORCE, WRENCH])?;
        named(MESSAGE, "space", &run.space, &[FORCE, WRENCH])?;
        named(MESSAGE, "contact_model", &run.contact_model, &MODELS)?;
        let torsion = run.torsion;
        let soft = run.contact_model == MODELS[1];
        ranged(MESSAGE, "torsion", torsion, (torsion > 0.0) == soft, "above 0 of soft fingers, else 0")?;
        for (field, value) in [
            ("energy_friction", run.energy_friction),
            ("potential_scale", run.potential_scale),
            ("friction", run.friction),
        ] {
            ranged(MESSAGE, field, value, value > 0.0 && value.is_finite(), "positive and finite")?;
        }
        for (field, value) in [
            ("torsion", torsion),
            ("min_epsilon", run.min_epsilon),
            ("max_penetration", run.max_penetration),
            ("max_advance", run.max_advance),
            ("stand_off", run.stand_off),
        ] {
            ranged(MESSAGE, field, value, value >= 0.0 && value.is_finite(), "0 or positive, and finite")?;
        }
        ranged(MESSAGE, "edges", f64::from(run.edges), run.edges >= 3, "3 or more")?;
        Ok(Self {
            sampler: sampler.to_owned(),
            energy: run.energy.clone(),
            energy_space: run.energy_space.clone(),
            energy_friction: run.energy_friction,
            potential_scale: run.potential_scale,
            contact_model: run.contact_model.clone(),
            friction: run.friction,
            edges: run.edges,
            torsion,
            space: run.space.clone(),
            min_epsilon: run.min_epsilon,
            max_penetration: run.max_penetration,
            max_advance: run.max_advance,
            stand_off: run.stand_off,
        })
    }
}

impl Grasp {
    fn encode(&self, out: &mut Vec<u8>) {
        let contacts = &self.contacts;
        wire::doubles(out, 1, &self.object_from_approach.to_rows());
        wire::doubles(out, 2, &self.object_from_base.to_rows());
        wire::doubles(out, 3, &self.opening);
        wire::doubles(out, 4, &self.posture);
        wire::doubles(out, 5, &self.amplitudes);
        wire::doubles(out, 6, &self.joints_before);
        wire::doubles(out, 7, &self.joints);
        wire::double(out, 8, self.penetration);
        wire::double(out, 9, self.energy);
        wire::double(out, 10, self.contact_energy);
        wire::double(out, 11, self.potential);
        wire::uint32s(out, 12, contacts.iter().map(|contact| contact.link));
        wire::doubles_of(out, 13, contacts.iter().flat_map(|contact| contact.point));
        wire::doubles_of(out, 14, contacts.iter().flat_map(|contact| contact.normal));
        wire::doubles_of(out, 15, contacts.iter().map(|contact| contact.distance));
        wire::double(out, 16, self.epsilon_force);
        wire::double(out, 17, self.epsilon_wrench);
        wire::double(out, 18, self.volume);
        wire::uint32s(out, 19, self.kind.iter().copied());
        wire::doubles_of(out, 20, self.width.iter().copied());
        wire::uint32(out, 21, self.verdict as u32);
        wire::double(out, 22, self.advance);
        for (field, posture) in [(24, 0), (25, 1)] {
            wire::doubles_of(out, field, self.clearances.iter().map(|lowest| lowest[posture]));
        }
        let stages = self.object_in_way.map(|BothWays { shaped, opened }| [shaped, opened]);
        let number = |stage: &Option<PathStage>| stage.map_or(0, |stage| u32::from(stage.number()));
        let numbers: Vec<u32> = stages.iter().flatten().map(number).collect();
        wire::uint32s(out, 26, numbers.iter().copied());
        wire::doubles_of(out, 30, self.shift.iter().flatten().copied());
        wire::doubles_of(out, 31, self.turn.iter().flatten().copied());
        wire::uint32(out, 32, self.point_scheme.map_or(0, PointScheme::number));
    }

    /// Reads a grasp of a run whose names have been checked.
    fn of(grasp: &proto::Grasp, run: &proto::GraspRun) -> Result<Self, RecordError> {
        let (driven, joints) = (run.driven.len(), run.joints.len());
        let is_closed = grasp.verdict != GraspVerdict::Penetrates as u32;
        let watched = if is_closed { run.resting_poses as usize } else { 0 };
        for (field, expected, values) in [
            ("grasps.opening", driven, &grasp.opening),
            ("grasps.posture", driven, &grasp.posture),
            ("grasps.amplitudes", grasp.amplitudes.len(), &grasp.amplitudes),
            ("grasps.joints_before", joints, &grasp.joints_before),
            ("grasps.joints", joints, &grasp.joints),
            ("grasps.points", 3 * grasp.links.len(), &grasp.points),
            ("grasps.normals", 3 * grasp.links.len(), &grasp.normals),
            ("grasps.distances", grasp.links.len(), &grasp.distances),
            ("grasps.width", grasp.width.len().min(1), &grasp.width),
            ("grasps.clearances", watched, &grasp.clearances),
            ("grasps.clearances_opened", watched, &grasp.clearances_opened),
            ("grasps.turn", grasp.shift.len(), &grasp.turn),
            ("grasps.shift", if grasp.shift.is_empty() { 0 } else { 3 }, &grasp.shift),
        ] {
            lengthy(MESSAGE, field, expected, values.len())?;
            let wild = values.iter().find(|value| !value.is_finite());
            ranged(MESSAGE, field, wild.copied().unwrap_or_default(), wild.is_none(), "finite")?;
        }
        lengthy(MESSAGE, "grasps.type", grasp.r#type.len().min(1), grasp.r#type.len())?;
        lengthy(MESSAGE, "grasps.object_in_way", if is_closed { 2 } else { 0 }, grasp.object_in_way.len())?;
        for (field, value) in [
            ("grasps.energy", grasp.energy),
            ("grasps.contact_energy", grasp.contact_energy),
            ("grasps.potential", grasp.potential),
        ] {
            ranged(MESSAGE, field, value, value.is_finite(), "finite")?;
        }
        for (field, value) in [
            ("grasps.advance", grasp.advance),
            ("grasps.penetration", grasp.penetration),
            ("grasps.epsilon_force", grasp.epsilon_force),
            ("grasps.epsilon_wrench", grasp.epsilon_wrench),
            ("grasps.volume", grasp.volume),
        ] {
            ranged(MESSAGE, field, value, value >= 0.0 && value.is_finite(), "0 or positive, and finite")?;
        }
        let verdict = GraspVerdict::ALL.get(grasp.verdict as usize).copied();
        let unknown = RecordError::Range {
            message: MESSAGE,
            field: "grasps.verdict",
            value: f64::from(grasp.verdict),
            allowed: "0 to 5",
        };
        Ok(Self {
            object_from_approach: pose(MESSAGE, "grasps.object_from_approach", &grasp.object_from_approach)?,
            object_from_base: pose(MESSAGE, "grasps.object_from_base", &grasp.object_from_base)?,
            opening: grasp.opening.clone(),
            posture: grasp.posture.clone(),
            amplitudes: grasp.amplitudes.clone(),
            joints_before: grasp.joints_before.clone(),
            joints: grasp.joints.clone(),
            advance: grasp.advance,
            shift: grasp.shift.as_slice().try_into().ok(),
            turn: grasp.turn.as_slice().try_into().ok(),
            penetration: grasp.penetration,
            energy: grasp.energy,
            contact_energy: grasp.contact_energy,
            potential: grasp.potential,
            contacts: contacts(grasp, run.links.len())?,
            epsilon_force: grasp.epsilon_force,
            epsilon_wrench: grasp.epsilon_wrench,
            volume: grasp.volume,
            kind: grasp.r#type.first().copied(),
            width: grasp.width.first().copied(),
            verdict: verdict.ok_or(unknown)?,
            clearances: grasp.clearances.iter().zip(&grasp.clearances_opened).map(|(a, b)| [*a, *b]).collect(),
            object_in_way: object_in_way(&grasp.object_in_way)?,
            point_scheme: point_scheme(grasp.point_scheme)?,
        })
    }
}

/// A scheme by its number, or none.
fn point_scheme(number: u32) -> Result<Option<PointScheme>, RecordError> {
    let scheme = PointScheme::of_number(number);
    ranged(MESSAGE, "grasps.point_scheme", f64::from(number), number == 0 || scheme.is_some(), "0 to 3")?;
    Ok(scheme)
}

/// Phases in which the object is an obstacle, from two numbers, or none.
fn object_in_way(numbers: &[u32]) -> Result<Option<BothWays<Option<PathStage>>>, RecordError> {
    let [shaped, opened] = numbers else { return Ok(None) };
    let stage = |number: u32, is_opened: bool| {
        let known = u8::try_from(number).ok().and_then(PathStage::of_number);
        // The hand closes on the object, and a hand that approaches in its posture does not change it.
        let known = known.filter(|stage| *stage != PathStage::Closing && (is_opened || *stage != PathStage::Shaping));
        let is_known = number == 0 || known.is_some();
        ranged(MESSAGE, "grasps.object_in_way", f64::from(number), is_known, "0, 1 or 2, the second also 4")?;
        Ok(known)
    };
    Ok(Some(BothWays { shaped: stage(*shaped, false)?, opened: stage(*opened, true)? }))
}

/// The contacts of a grasp whose lengths have been checked.
fn contacts(grasp: &proto::Grasp, links: usize) -> Result<Vec<HeldContact>, RecordError> {
    let triple = |values: &[f64], index: usize| [values[3 * index], values[3 * index + 1], values[3 * index + 2]];
    let mut contacts = Vec::with_capacity(grasp.links.len());
    for (index, link) in grasp.links.iter().copied().enumerate() {
        ranged(MESSAGE, "grasps.links", f64::from(link), (link as usize) < links, "an index into links")?;
        let (point, normal) = (triple(&grasp.points, index), triple(&grasp.normals, index));
        let length = Vector3::from(normal).norm();
        ranged(MESSAGE, "grasps.normals", length, (length - 1.0).abs() < 1e-9, "of unit length")?;
        contacts.push(HeldContact { link, point, normal, distance: grasp.distances[index] });
    }
    Ok(contacts)
}
