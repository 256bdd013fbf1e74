//! Bytes of graded labels.

use prost::Message;

use super::{
    ClosedHand, FailureReason, GraspLadder, GraspLadders, LadderLevel, LadderMethod, LevelResult, LevelTrial,
    TrialOutcome, TriedStates, WayObstacles,
    ladder::LEVELS,
    trial::{StoredHand, nested},
    trial_phases,
};
use crate::codec::{
    RecordError,
    fields::{broken, lengthy, named, ranged},
    proto, sample_from_proto, wire,
};
use kernel::words::{BothWays, GraspVerdict};

const MESSAGE: &str = "GraspLadders";
const SOURCES: [&str; 4] = ["job", "table", "material", "hull"];

impl GraspLadders {
    /// `Err` unless there is one ladder per state of the run that the method tries, on tables of its object's resting poses;
    /// `verdicts` are those of all states of the run.
    pub(super) fn check_beside(&self, verdicts: &[GraspVerdict], resting_poses: u32) -> Result<(), RecordError> {
        let tried = (0..).zip(verdicts).filter(|(_, verdict)| self.method.tried.includes(**verdict));
        let tried: Vec<u32> = tried.map(|(index, _)| index).collect();
        lengthy(MESSAGE, "ladders", tried.len(), self.ladders.len())?;
        let other = self.ladders.iter().zip(&tried).find(|(ladder, tried)| ladder.grasp != **tried);
        let value = other.map_or(0.0, |(ladder, _)| f64::from(ladder.grasp));
        ranged(MESSAGE, "ladders.grasp", value, other.is_none(), "the indices of the tried states of the run")?;
        let beyond = self.ladders.iter().filter_map(|ladder| ladder.resting_pose).find(|pose| *pose >= resting_poses);
        let value = f64::from(beyond.unwrap_or_default());
        ranged(MESSAGE, "ladders.resting_pose", value, beyond.is_none(), "below the resting poses of the object")
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let LadderMethod { friction, torsion, mass, mass_from, mass_source, tried, table_friction, lost, followed } =
            &self.method;
        wire::sample(out, 1, &self.sample);
        wire::bytes(out, 2, self.hand.as_bytes());
        self.links.iter().for_each(|name| wire::element(out, 3, name.as_bytes()));
        wire::uint32(out, 4, self.joints);
        wire::double(out, 5, *friction);
        wire::double(out, 6, *torsion);
        wire::double(out, 7, *mass);
        wire::bytes(out, 8, mass_from.as_bytes());
        wire::bytes(out, 9, mass_source.as_bytes());
        wire::bytes(out, 10, tried.name().as_bytes());
        wire::doubles(out, 11, table_friction.as_slice());
        wire::double(out, 12, lost[0]);
        wire::double(out, 13, lost[1]);
        wire::double(out, 14, *followed);
        LadderLevel::ALL.iter().for_each(|level| wire::element(out, 15, level.name().as_bytes()));
        for ladder in &self.ladders {
            nested(out, 16, |out| ladder.encode(out));
        }
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, a number is out of range or not finite, the hand's pose is not a rigid motion, a
    /// name or a number of a word is unknown, or levels, reasons or a label contradict each other.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let mut raw = proto::GraspLadders::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample.take())?;
        let (joints, links) = (raw.joints, raw.links);
        ranged(MESSAGE, "links", links.len() as f64, links.len() == joints as usize + 1, "one more than joints")?;
        named(MESSAGE, "mass_from", &raw.mass_from, &SOURCES)?;
        named(MESSAGE, "tried", &raw.tried, &TriedStates::ALL.map(TriedStates::name))?;
        let tried = TriedStates::from_name(&raw.tried).expect("the name is known");
        ranged(MESSAGE, "mass", raw.mass, raw.mass > 0.0 && raw.mass.is_finite(), "positive and finite")?;
        lengthy(MESSAGE, "table_friction", raw.table_friction.len().min(1), raw.table_friction.len())?;
        let table_friction = raw.table_friction.first().copied();
        for (field, value) in [
            ("friction", raw.friction),
            ("torsion", raw.torsion),
            ("table_friction", table_friction.unwrap_or_default()),
            ("lost_distance", raw.lost_distance),
            ("lost_angle", raw.lost_angle),
            ("followed", raw.followed),
        ] {
            not_below_zero(field, value)?;
        }
        lengthy(MESSAGE, "levels", LEVELS, raw.levels.len())?;
        for (level, name) in LadderLevel::ALL.iter().zip(&raw.levels) {
            named(MESSAGE, "levels", name, &[level.name()])?;
        }
        let method = LadderMethod {
            friction: raw.friction,
            torsion: raw.torsion,
            mass: raw.mass,
            mass_from: raw.mass_from,
            mass_source: raw.mass_source,
            tried,
            table_friction,
            lost: [raw.lost_distance, raw.lost_angle],
            followed: raw.followed,
        };
        let mut ladders: Vec<GraspLadder> = Vec::with_capacity(raw.ladders.len());
        for ladder in raw.ladders {
            let ascends = ladders.last().is_none_or(|before| before.grasp < ladder.grasp);
            ranged(MESSAGE, "ladders.grasp", f64::from(ladder.grasp), ascends, "ascending")?;
            ladders.push(GraspLadder::of(ladder, joints as usize, &method)?);
        }
        Ok(Self { sample, hand: raw.hand, links, joints, method, ladders })
    }
}

impl GraspLadder {
    fn encode(&self, out: &mut Vec<u8>) {
        wire::uint32(out, 1, self.grasp);
        wire::uint32s(out, 2, self.resting_pose.iter().copied());
        let BothWays { shaped, opened } = self.obstacles;
        wire::uint32s(out, 3, [shaped, opened].into_iter().map(number_of));
        for level in self.levels.iter().flatten() {
            nested(out, 4, |out| match level {
                LevelResult::Tried(trial) => trial.encode(out),
                LevelResult::Inferred(holds) => wire::uint32(out, 1, if *holds { 1 } else { 2 }),
                LevelResult::Unknown => wire::uint32(out, 1, 3),
            });
        }
        self.second_law.iter().for_each(|trial| nested(out, 5, |out| trial.encode(out)));
        wire::uint32(out, 6, self.label().number());
        self.closed.iter().for_each(|closed| closed.encode(out, 7));
    }

    fn of(raw: proto::GraspLadder, joints: usize, method: &LadderMethod) -> Result<Self, RecordError> {
        lengthy(MESSAGE, "ladders.resting_pose", raw.resting_pose.len().min(1), raw.resting_pose.len())?;
        let resting_pose = raw.resting_pose.first().copied();
        let may_be = resting_pose.is_none() || method.table_friction.is_some();
        let value = f64::from(resting_pose.unwrap_or_default());
        ranged(MESSAGE, "ladders.resting_pose", value, may_be, "none without a table_friction")?;
        lengthy(MESSAGE, "ladders.obstacles", 2, raw.obstacles.len())?;
        let obstacles = BothWays { shaped: obstacles(raw.obstacles[0])?, opened: obstacles(raw.obstacles[1])? };
        let is_blocked = !obstacles.shaped.is_free() && !obstacles.opened.is_free();
        lengthy(MESSAGE, "ladders.levels", if is_blocked { 0 } else { LEVELS }, raw.levels.len())?;
        let mut levels = [const { LevelResult::Unknown }; LEVELS];
        for (level, raw) in levels.iter_mut().zip(&raw.levels) {
            *level = LevelResult::of(raw)?;
        }
        let second_law = raw.second_law.as_ref().map(LevelTrial::of).transpose()?.map(Box::new);
        let stored = StoredHand {
            joints: &raw.joints,
            object_from_base: &raw.object_from_base,
            links: &raw.links,
            points: &raw.points,
            normals: &raw.normals,
            distances: &raw.distances,
            forces: &raw.forces,
        };
        let ladder = Self {
            grasp: raw.grasp,
            resting_pose,
            obstacles,
            levels: (!is_blocked).then_some(levels),
            second_law,
            closed: ClosedHand::of(&stored, joints)?,
        };
        ladder.check_order()?;
        let is_so = raw.label == ladder.label().number();
        ranged(MESSAGE, "ladders.label", f64::from(raw.label), is_so, "the label that follows from the levels")?;
        Ok(ladder)
    }

    /// `Err` unless the levels are those of a bisection.
    fn check_order(&self) -> Result<(), RecordError> {
        use LevelResult::{Inferred, Tried, Unknown};
        let trial = |level| self.level(level).and_then(LevelResult::trial);
        let (easy, nominal) = (trial(LadderLevel::Easy), trial(LadderLevel::Nominal));
        let holds = nominal.and_then(LevelTrial::holds);
        let fits = match &self.levels {
            None => true,
            Some([Unknown, Tried(_), Unknown, Unknown]) => holds.is_none(),
            Some([Inferred(true), Tried(_), adverse, Tried(hard)]) => {
                let inferred = matches!(adverse, Inferred(true)) && hard.holds() == Some(true);
                let tried = adverse.trial().is_some() && hard.holds() != Some(true);
                holds == Some(true) && (inferred || tried)
            }
            Some([Tried(_), Tried(_), Inferred(false), Inferred(false)]) => holds == Some(false),
            Some(_) => false,
        };
        ranged(MESSAGE, "ladders.levels", f64::from(self.grasp), fits, "those of a bisection")?;
        let needs = easy.is_some_and(|easy| easy.holds() != Some(true));
        let has = self.second_law.is_some();
        ranged(MESSAGE, "ladders.second_law", f64::from(u8::from(has)), has == needs, "that of a lost easiest level")?;
        let closed = self.closed.is_some();
        let may_be = !closed || nominal.is_some();
        ranged(MESSAGE, "ladders.joints", f64::from(u8::from(closed)), may_be, "none without a trial")
    }
}

impl LevelResult {
    fn of(raw: &proto::LadderLevel) -> Result<Self, RecordError> {
        let inferred = |result: Self| {
            let is_bare = *raw == proto::LadderLevel { state: raw.state, ..Default::default() };
            ranged(MESSAGE, "levels.state", f64::from(raw.state), is_bare, "0 for a level with a trial")?;
            Ok(result)
        };
        match raw.state {
            0 => Ok(Self::Tried(Box::new(LevelTrial::of(raw)?))),
            1 => inferred(Self::Inferred(true)),
            2 => inferred(Self::Inferred(false)),
            3 => inferred(Self::Unknown),
            state => Err(RecordError::Range {
                message: MESSAGE,
                field: "levels.state",
                value: f64::from(state),
                allowed: "0 to 3",
            }),
        }
    }
}

impl LevelTrial {
    fn encode(&self, out: &mut Vec<u8>) {
        nested(out, 2, |out| self.outcome.encode(out));
        wire::uint32(out, 3, self.reason.map_or(0, |reason| reason as u32 + 1));
        wire::uint32(out, 4, self.farthest_phase);
        wire::double(out, 5, self.rotation);
        wire::uint32(out, 6, self.rotation_phase);
        wire::uint32(out, 7, u32::from(self.touched));
        wire::double(out, 8, self.closing[0]);
        wire::double(out, 9, self.closing[1]);
        wire::double(out, 10, self.pressed_speed);
        wire::uint32(out, 11, self.closed_links);
        wire::double(out, 12, self.imbalance);
    }

    fn of(raw: &proto::LadderLevel) -> Result<Self, RecordError> {
        ranged(MESSAGE, "levels.state", f64::from(raw.state), raw.state == 0, "0 for a level with a trial")?;
        let outcome = TrialOutcome::of(raw.outcome.as_ref())?;
        let count = FailureReason::ALL.len();
        let is_known = raw.reason as usize <= count && raw.reason != FailureReason::Blocked as u32 + 1;
        let fits = is_known && (raw.reason == 0) == outcome.verdict.is_held();
        ranged(MESSAGE, "levels.reason", f64::from(raw.reason), fits, "0 if it held, else 2 to 12")?;
        let reason = (raw.reason as usize).checked_sub(1).map(|index| FailureReason::ALL[index]);
        let phases = trial_phases("lifted").len();
        for (field, phase) in
            [("levels.farthest_phase", raw.farthest_phase), ("levels.rotation_phase", raw.rotation_phase)]
        {
            ranged(MESSAGE, field, f64::from(phase), (phase as usize) < phases, "0 closing, 1 lift, 2 shake")?;
        }
        for (field, value) in [
            ("levels.rotation", raw.rotation),
            ("levels.closing_moved", raw.closing_moved),
            ("levels.closing_turned", raw.closing_turned),
            ("levels.pressed_speed", raw.pressed_speed),
        ] {
            not_below_zero(field, value)?;
        }
        let balanced = (0.0..=1.0).contains(&raw.imbalance);
        ranged(MESSAGE, "levels.imbalance", raw.imbalance, balanced, "0 to 1")?;
        Ok(Self {
            outcome,
            reason,
            farthest_phase: raw.farthest_phase,
            rotation: raw.rotation,
            rotation_phase: raw.rotation_phase,
            touched: raw.touched,
            closing: [raw.closing_moved, raw.closing_turned],
            pressed_speed: raw.pressed_speed,
            closed_links: raw.closed_links,
            imbalance: raw.imbalance,
        })
    }
}

/// Obstacles as a number: 1 the object, 2 the table, 3 both.
fn number_of(obstacles: WayObstacles) -> u32 {
    u32::from(obstacles.object) + 2 * u32::from(obstacles.table)
}

fn obstacles(number: u32) -> Result<WayObstacles, RecordError> {
    ranged(MESSAGE, "ladders.obstacles", f64::from(number), number < 4, "0 to 3")?;
    Ok(WayObstacles { object: number & 1 == 1, table: number & 2 == 2 })
}

fn not_below_zero(field: &'static str, value: f64) -> Result<(), RecordError> {
    ranged(MESSAGE, field, value, value >= 0.0 && value.is_finite(), "0 or positive, and finite")
}
