//! Graded labels of the states that a run found.

use std::sync::Arc;

use super::{
    recorded_trial::{closed_hand, recorded},
    series::phase_index,
    settings::{GraspJob, Physics},
};
use crate::{
    ProduceError,
    sections::{JobHand, Weight},
};
use assets::object::PreparedObject;
use format::{
    FailureReason, Grasp, GraspLadder, GraspLadders, GraspRun, LadderFacts, LadderMethod, LevelResult, LevelTrial,
    WayObstacles,
};
use kernel::{
    contact::ContactSurface,
    geom::RestingPoses,
    words::{BothWays, FreeWays, MassSource},
};
use sim::{
    Climb, FOLLOWED, HandError, HandModel, Outcome, Peak, Rung, TableSupport, TrialConditions, TrialFailure,
    TrialLevel, TrialProtocol, TrialSim, TrialWorker, climb, conditions_at, failure_reason,
};

/// One thread's ladders of one hand.
pub(super) struct Ladders {
    model: HandModel,
    scene: String,
    settings: Physics,
    /// The object that was loaded last.
    object: Option<TriedObject>,
    record: GraspLadders,
}

struct TriedObject {
    worker: TrialWorker,
    conditions: TrialConditions,
    /// Tables under the resting poses of the object, the most likely first; none where grasps are tried in the air alone.
    tables: Vec<TableSupport>,
}

impl Ladders {
    /// Reads the hand; `run` is a record of it without grasps.
    ///
    /// # Errors
    /// When the hand cannot be read.
    pub fn new(job: &GraspJob, settings: Physics, run: &GraspRun) -> Result<Self, ProduceError> {
        let JobHand { file, .. } = &job.hand;
        let scene = file.display().to_string();
        let model = HandModel::open(file).map_err(|error| ProduceError::unusable(&scene, error))?;
        let TrialProtocol { lost_distance, lost_angle, .. } = TrialProtocol::STANDARD;
        let record = GraspLadders {
            sample: run.sample,
            hand: run.hand.name.clone(),
            links: run.hand.links.clone(),
            joints: run.hand.joints.len() as u32,
            method: LadderMethod {
                friction: settings.friction,
                torsion: TrialConditions::TORSION,
                mass: 1.0,
                mass_from: String::new(),
                mass_source: String::new(),
                tried: settings.tried,
                table_friction: settings.table_friction,
                lost: [lost_distance, lost_angle],
                followed: FOLLOWED,
            },
            ladders: Vec::new(),
        };
        Ok(Self { model, scene, settings, object: None, record })
    }

    /// Switches to an object of a weight, unless the job gives one mass to all.
    ///
    /// # Errors
    /// When it has no solid inside, or MuJoCo refuses the hand.
    pub fn load(
        &mut self,
        object: &PreparedObject,
        surface: &Arc<ContactSurface>,
        resting: &RestingPoses,
        weight: &Weight,
    ) -> Result<(), ProduceError> {
        self.object = None;
        let no_solid = || ProduceError::unusable(&self.scene, "no solid to be weighed");
        let properties = *object.mass().ok_or_else(no_solid)?;
        let compile = if self.settings.table_friction.is_some() { TrialSim::on_table } else { TrialSim::new };
        let sim =
            compile(&self.model, surface, &properties).map_err(|error| ProduceError::unusable(&self.scene, error))?;
        let tables = self.settings.table_friction.map(|friction| {
            resting.poses.iter().map(|pose| TableSupport { friction, ..TableSupport::under(pose) }).collect()
        });
        let given = self.settings.mass.map(|mass| (mass, MassSource::Job.name(), ""));
        let (mass, from, source) = given.unwrap_or((weight.kilograms, weight.from.name(), weight.source.as_str()));
        let conditions = TrialConditions { friction: self.settings.friction, ..TrialConditions::new(mass) };
        let method = &mut self.record.method;
        (method.mass, method.mass_from, method.mass_source) = (mass, from.to_owned(), source.to_owned());
        self.object =
            Some(TriedObject { worker: TrialWorker::new(&sim), conditions, tables: tables.unwrap_or_default() });
        Ok(())
    }

    /// Tries the selected states of a run and appends the payload.
    ///
    /// # Errors
    /// When a grasp does not fit the hand.
    pub fn run(&mut self, run: &GraspRun, payload: &mut Vec<u8>) -> Result<LadderFacts, ProduceError> {
        let Self { scene, settings, object, record, .. } = self;
        let object = object.as_mut().expect("an object is loaded before its grasps are tried");
        record.sample = run.sample;
        record.ladders.clear();
        for (index, grasp) in (0..).zip(&run.grasps) {
            if settings.tried.includes(grasp.verdict) {
                let ladder = object.ladder(index, grasp);
                record.ladders.push(ladder.map_err(|error| ProduceError::unusable(scene.as_str(), error))?);
            }
        }
        record.encode(payload);
        Ok(record.facts())
    }
}

impl TriedObject {
    /// Tries a grasp on the table of the likeliest resting pose on which a way of approach is free, or in the air if the hand
    /// is below every table; a grasp without a free way is not tried.
    fn ladder(&mut self, index: u32, grasp: &Grasp) -> Result<GraspLadder, HandError> {
        let pose = likeliest_pose(grasp, self.tables.len());
        let clear = WayObstacles::default();
        let obstacles = grasp.obstacles(pose).unwrap_or(BothWays { shaped: clear, opened: clear });
        let mut ladder = GraspLadder {
            grasp: index,
            resting_pose: pose.map(|pose| pose as u32),
            obstacles,
            levels: None,
            second_law: None,
            closed: None,
        };
        if !obstacles.shaped.is_free() && !obstacles.opened.is_free() {
            return Ok(ladder);
        }
        let nominal = TrialConditions { table: pose.map(|pose| self.tables[pose]), ..self.conditions };
        let base_from_object = grasp.object_from_base.isometry().inverse();
        let Climb { levels, second_law } = climb(
            |level, law| {
                let outcome =
                    self.worker.run(&grasp.posture, &base_from_object, &conditions_at(level, &nominal, law))?;
                if level == TrialLevel::Nominal {
                    ladder.closed = outcome.closed.as_ref().map(closed_hand);
                }
                Ok::<_, HandError>(level_trial(&outcome))
            },
            LevelTrial::holds,
        )?;
        ladder.levels = Some(levels.map(|level| match level {
            Rung::Tried(trial) => LevelResult::Tried(Box::new(trial)),
            Rung::Inferred(holds) => LevelResult::Inferred(holds),
            Rung::Unknown => LevelResult::Unknown,
        }));
        ladder.second_law = second_law.map(Box::new);
        Ok(ladder)
    }
}

/// The likeliest resting pose on whose table a way of approach is free; else the likeliest above whose table the hand stays
/// on a way; `None` without such a pose. Only poses below `tables` count.
fn likeliest_pose(grasp: &Grasp, tables: usize) -> Option<usize> {
    let poses = || 0..tables.min(grasp.clearances.len());
    let is_free = |pose: &usize| grasp.free_ways(Some(*pose)) != FreeWays::None;
    let is_above = |pose: &usize| grasp.clearances[*pose].iter().any(|clearance| *clearance >= 0.0);
    poses().find(is_free).or_else(|| poses().find(is_above))
}

fn level_trial(outcome: &Outcome) -> LevelTrial {
    let margins = outcome.margins.clone().unwrap_or_default();
    let peak = |peak: Option<Peak>| peak.map_or((0.0, 0), |peak| (peak.value, phase_index(peak.phase) as u32));
    let ((_, farthest_phase), (rotation, rotation_phase)) = (peak(margins.farthest), peak(margins.rotation));
    LevelTrial {
        outcome: recorded(outcome),
        reason: failure_reason(outcome).map(recorded_reason),
        farthest_phase,
        rotation,
        rotation_phase,
        touched: margins.has_touched,
        closing: margins.closing,
        pressed_speed: margins.pressed_speed,
        closed_links: outcome.closed.as_ref().map_or(0, |closed| closed.links().len() as u32),
        imbalance: outcome.closed.as_ref().map_or(1.0, |closed| closed.imbalance()),
    }
}

fn recorded_reason(reason: TrialFailure) -> FailureReason {
    FailureReason::from_name(reason.name()).expect("records know every reason (a test compares them)")
}

#[cfg(test)]
mod tests {
    use super::*;
    use format::LadderLevel;

    #[test]
    fn records_know_every_reason_and_level() {
        let reasons = [
            TrialFailure::Nothing,
            TrialFailure::PushedAway,
            TrialFailure::Ejected,
            TrialFailure::OneSided,
            TrialFailure::SlippedLift,
            TrialFailure::RotatedLift,
            TrialFailure::SlippedShake,
            TrialFailure::RotatedShake,
            TrialFailure::LetGo,
            TrialFailure::Unstable,
            TrialFailure::StartsTooDeep,
        ];
        assert_eq!(reasons.map(recorded_reason), FailureReason::ALL[1..]);
        let names = TrialLevel::ALL.map(|level| format!("{level:?}").to_lowercase());
        assert_eq!(names, LadderLevel::ALL.map(LadderLevel::name));
    }
}
