//! Physical trials of a run's grasps: outcome of each, and the closed hand.

use nalgebra::Vector3;
use prost::Message;

use super::{
    GraspLabel, TrialFacts, TrialOutcome, TrialSeries, TrialVerdict, TriedStates,
    outcome::{MESSAGE, finite, not_below_zero, verdict_of},
};
use crate::codec::{
    RecordError,
    fields::{broken, lengthy, pose, ranged},
    proto, sample_from_proto, wire,
};
use kernel::{
    geom::{HandBase, Object, Pose},
    ids::SampleId,
    words::GraspVerdict,
};

/// Deepest start of a hand in the object at which a trial is conclusive [m]: contacts push deeper ones out, differently in each
/// simulation.
const MAX_LABELLED_START: f64 = 5e-4;

/// Conditions of a trial, and the spread of perturbed ones.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialMethod {
    /// Coefficient of friction of the object against the hand.
    pub friction: f64,
    /// Torsional friction of a contact about its normal [m].
    pub torsion: f64,
    /// The object's mass [kg].
    pub mass: f64,
    /// Origin of the mass: `job`, `table`, `material` or `hull`; `volume` in older datasets.
    pub mass_from: String,
    /// Source of the figure, or the material, in words; may be empty.
    pub mass_source: String,
    /// Gravity: `lifted` (a lift and a shake) or `six` (directions, one after another).
    pub gravity: String,
    /// Standard deviations of perturbed runs: of the logarithms of friction and mass, of position [m] and rotation [rad].
    pub spreads: [f64; 4],
    /// States that are tried; all others are untried, which does not mean that they fail.
    pub tried: TriedStates,
    /// Names of the variants under which chosen grasps are tried again.
    pub variants: Vec<String>,
    /// Friction of the object against the table; `None` where grasps are not tried on one.
    pub table_friction: Option<f64>,
    /// Time from one sample of a series to the next [s]; `None` where no trial has a series.
    pub series_interval: Option<f64>,
    /// Names of the harder conditions under which grasps that held are tried again.
    pub confirm_held: Vec<String>,
    /// Names of the easier conditions under which grasps that failed are tried again.
    pub confirm_failed: Vec<String>,
    /// Maximum confirmed failures of a run per grasp labelled held; `None` confirms all.
    pub failed_per_held: Option<f64>,
}

impl TrialMethod {
    /// Number of conditions under which a grasp is tried again: those of positives once its trials in the air and on a table
    /// held, those of negatives where no trial did, unless the grasp is left unconfirmed.
    fn confirmations(&self, trial: &GraspTrial) -> usize {
        match (trial.settled(), trial.agreed()) {
            (Some(true), _) => self.confirm_held.len(),
            (_, Some(false)) if !trial.is_unconfirmed => self.confirm_failed.len(),
            _ => 0,
        }
    }
}

/// A contact of the closed hand, in `Object`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressedContact {
    /// Index of the link in [`GraspTrials::links`].
    pub link: u32,
    /// On the object's surface [m].
    pub point: [f64; 3],
    /// Outward from the object, of unit length.
    pub normal: [f64; 3],
    /// From the object to the link [m]: negative where it presses in.
    pub distance: f64,
    /// Along the normal [N].
    pub force: f64,
}

/// The hand on its object when gravity was switched on, or when it was found to hold nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedHand {
    /// All joints [rad or m], in the order of the hand's tree.
    pub joints: Vec<f64>,
    /// The hand's base.
    pub object_from_base: Pose<Object, HandBase>,
    /// Contacts that pressed.
    pub contacts: Vec<PressedContact>,
}

/// Trial of the grasp under other conditions.
#[derive(Clone, Debug, PartialEq)]
pub struct PerturbedTrial {
    /// Coefficient of friction.
    pub friction: f64,
    /// The object's mass [kg].
    pub mass: f64,
    /// Offset of the object, along the axes of the hand's base [m].
    pub shift: [f64; 3],
    /// Rotation of the object about its centre of mass: an axis times an angle [rad].
    pub turn: [f64; 3],
    /// Outcome of the trial.
    pub outcome: TrialOutcome,
}

/// Trial of a grasp of the object as it rests on a table: gravity is on, and nothing holds the object while the hand closes.
#[derive(Clone, Debug, PartialEq)]
pub struct TableTrial {
    /// Index in the resting poses of the object: the most likely one above whose table the hand stays.
    pub resting_pose: u32,
    /// Outcome of the trial.
    pub outcome: TrialOutcome,
    /// The trial over time; `None` for a grasp that was not chosen for it.
    pub series: Option<TrialSeries>,
}

/// All trials of one grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspTrial {
    /// Index in [`GraspRun::grasps`](super::GraspRun::grasps).
    pub grasp: u32,
    /// Outcome under the given conditions.
    pub outcome: TrialOutcome,
    /// The closed hand, if the hand closed.
    pub closed: Option<ClosedHand>,
    /// Under other conditions.
    pub perturbed: Vec<PerturbedTrial>,
    /// More such trials, and how many of them held; 0 for a grasp that was not chosen for them.
    pub roll_outs: [u32; 2],
    /// Verdict under each of [`TrialMethod::variants`]; empty for a grasp that was not chosen for them.
    pub variants: Vec<TrialVerdict>,
    /// Trial on a table; `None` where the hand would come below it in every resting pose of the object, and in datasets
    /// without such trials.
    pub table: Option<TableTrial>,
    /// Verdict under each of [`TrialMethod::confirm_held`] where the trials in the air and on a table held, under each of
    /// [`TrialMethod::confirm_failed`] where no trial did, up to the first that ends otherwise; else none.
    pub confirmed: Vec<TrialVerdict>,
    /// Whether no trial so far held and further ones were not made, since the run has
    /// [negatives enough](TrialMethod::failed_per_held).
    pub is_unconfirmed: bool,
    /// The trial under the given conditions, over time; `None` for a grasp that was not chosen for it.
    pub series: Option<TrialSeries>,
}

impl GraspTrial {
    /// Whether the grasp held in the air and on a table; `None` if the two disagree, or are inconclusive because the hand starts
    /// in the object or the simulation became unstable.
    pub fn settled(&self) -> Option<bool> {
        let on_table = self.table.as_ref().map(|trial| trial.outcome.verdict);
        self.is_tested().then(|| self.alike(on_table)).flatten()
    }

    /// Whether the grasp held in the air, on a table and in every perturbed trial alike; `None` if they disagree, or are
    /// inconclusive.
    pub fn agreed(&self) -> Option<bool> {
        self.settled()?;
        self.alike(self.perturbed.iter().map(|run| run.outcome.verdict))
    }

    /// The outcome of the trial in the air, if all conclusive verdicts of these agree with it.
    fn alike(&self, verdicts: impl IntoIterator<Item = TrialVerdict>) -> Option<bool> {
        let held = self.outcome.verdict.is_held();
        let mut tested = verdicts.into_iter().filter(|verdict| verdict.is_tested());
        tested.all(|verdict| verdict.is_held() == held).then_some(held)
    }

    /// The combined label of all trials of the grasp.
    pub fn label(&self) -> GraspLabel {
        let is_confirmed = |held: bool| self.confirmed.iter().all(|verdict| verdict.is_held() == held);
        match self.agreed() {
            _ if !self.is_tested() => GraspLabel::Untested,
            Some(true) if is_confirmed(true) => GraspLabel::Held,
            Some(false) if self.is_unconfirmed => GraspLabel::Unconfirmed,
            Some(false) if is_confirmed(false) => GraspLabel::Failed,
            _ => GraspLabel::Borderline,
        }
    }

    /// Whether the trial in the air is conclusive.
    fn is_tested(&self) -> bool {
        self.outcome.verdict.is_tested() && self.outcome.penetration[0] <= MAX_LABELLED_START
    }

    /// Share of the roll-outs that held; `None` without any.
    pub fn success(&self) -> Option<f64> {
        let [count, held] = self.roll_outs;
        (count > 0).then(|| f64::from(held) / f64::from(count))
    }

    /// Whether the grasp held, and holds under every variant too; `None` where no variant was tried.
    pub fn is_robust(&self) -> Option<bool> {
        let holds = self.outcome.verdict.is_held() && self.variants.iter().all(|verdict| verdict.is_held());
        (!self.variants.is_empty()).then_some(holds)
    }

    /// Whether the grasp lifted the object from a table; `None` where it was not tried on one.
    pub fn is_held_on_table(&self) -> Option<bool> {
        self.table.as_ref().map(|trial| trial.outcome.verdict.is_held())
    }

    /// Perturbed runs whose verdict is another one: held or not.
    pub fn turned(&self) -> usize {
        let held = self.outcome.verdict.is_held();
        self.perturbed.iter().filter(|trial| trial.outcome.verdict.is_held() != held).count()
    }
}

/// Trials of the grasps of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspTrials {
    /// Which sample.
    pub sample: SampleId,
    /// The hand's name.
    pub hand: String,
    /// Links of the hand; the base is the first.
    pub links: Vec<String>,
    /// Number of joints of the hand.
    pub joints: u32,
    /// Method of the trials.
    pub method: TrialMethod,
    /// One per tried grasp, in their order.
    pub trials: Vec<GraspTrial>,
}

const SOURCES: [&str; 5] = ["volume", "job", "table", "material", "hull"];
const GRAVITIES: [&str; 2] = ["lifted", "six"];

impl GraspTrials {
    /// Counts for tables.
    pub fn facts(&self) -> TrialFacts {
        let count =
            |is: fn(TrialVerdict) -> bool| self.trials.iter().filter(|trial| is(trial.outcome.verdict)).count() as u32;
        TrialFacts {
            tried: self.trials.len() as u32,
            held: count(TrialVerdict::is_held),
            refused: count(|verdict| verdict == TrialVerdict::StartsTooDeep),
            tried_on_table: self.trials.iter().flat_map(|trial| &trial.table).count() as u32,
            held_on_table: self.trials.iter().filter(|trial| trial.is_held_on_table() == Some(true)).count() as u32,
        }
    }

    /// `Err` unless there is one trial per state of the run that the method tries, on tables of its object's resting poses;
    /// `verdicts` are those of all states of the run.
    pub(super) fn check_beside(&self, verdicts: &[GraspVerdict], resting_poses: u32) -> Result<(), RecordError> {
        let tried = (0..).zip(verdicts).filter(|(_, verdict)| self.method.tried.includes(**verdict));
        let tried: Vec<u32> = tried.map(|(index, _)| index).collect();
        lengthy(MESSAGE, "trials", tried.len(), self.trials.len())?;
        let other = self.trials.iter().zip(&tried).find(|(trial, tried)| trial.grasp != **tried);
        let value = other.map_or(0.0, |(trial, _)| f64::from(trial.grasp));
        ranged(MESSAGE, "trials.grasp", value, other.is_none(), "the indices of the tried states of the run")?;
        let pose = |trial: &GraspTrial| trial.table.as_ref().map(|table| table.resting_pose);
        let beyond = self.trials.iter().filter_map(pose).find(|pose| *pose >= resting_poses);
        let value = f64::from(beyond.unwrap_or_default());
        ranged(MESSAGE, "trials.table.resting_pose", value, beyond.is_none(), "below the resting poses of the object")
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let TrialMethod {
            friction,
            torsion,
            mass,
            mass_from,
            mass_source,
            gravity,
            spreads,
            tried,
            variants,
            table_friction,
            series_interval,
            confirm_held,
            confirm_failed,
            failed_per_held,
        } = &self.method;
        wire::sample(out, 1, &self.sample);
        wire::bytes(out, 2, self.hand.as_bytes());
        self.links.iter().for_each(|name| wire::element(out, 3, name.as_bytes()));
        wire::uint32(out, 4, self.joints);
        wire::double(out, 5, *friction);
        wire::double(out, 6, *torsion);
        wire::double(out, 7, *mass);
        wire::bytes(out, 8, mass_from.as_bytes());
        wire::bytes(out, 9, gravity.as_bytes());
        for (field, spread) in (10..).zip(spreads) {
            wire::double(out, field, *spread);
        }
        for trial in &self.trials {
            nested(out, 14, |out| trial.encode(out));
        }
        wire::bytes(out, 15, mass_source.as_bytes());
        wire::bytes(out, 16, tried.name().as_bytes());
        variants.iter().for_each(|name| wire::element(out, 17, name.as_bytes()));
        wire::doubles(out, 18, table_friction.as_slice());
        confirm_held.iter().for_each(|name| wire::element(out, 19, name.as_bytes()));
        confirm_failed.iter().for_each(|name| wire::element(out, 20, name.as_bytes()));
        wire::doubles(out, 21, failed_per_held.as_slice());
        wire::double(out, 30, series_interval.unwrap_or_default());
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, a number is out of range or not finite, the hand's pose is not a rigid motion, a normal
    /// is not of unit length, a name or a verdict is unknown, or a label does not follow from the verdicts.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let mut raw = proto::GraspTrials::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample.take())?;
        let (joints, links) = (raw.joints, raw.links);
        ranged(MESSAGE, "links", links.len() as f64, links.len() == joints as usize + 1, "one more than joints")?;
        named("mass_from", &raw.mass_from, &SOURCES)?;
        named("gravity", &raw.gravity, &GRAVITIES)?;
        named("tried", &raw.tried, &TriedStates::ALL.map(TriedStates::name))?;
        let tried = TriedStates::from_name(&raw.tried).expect("the name is known");
        ranged(MESSAGE, "mass", raw.mass, raw.mass > 0.0 && raw.mass.is_finite(), "positive and finite")?;
        let spreads = [raw.friction_spread, raw.mass_spread, raw.shift_spread, raw.turn_spread];
        for (field, value) in [("friction", raw.friction), ("torsion", raw.torsion)]
            .into_iter()
            .chain(spreads.map(|spread| ("spreads", spread)))
        {
            not_below_zero(field, value)?;
        }
        lengthy(MESSAGE, "table_friction", raw.table_friction.len().min(1), raw.table_friction.len())?;
        let table_friction = raw.table_friction.first().copied();
        not_below_zero("table_friction", table_friction.unwrap_or_default())?;
        lengthy(MESSAGE, "failed_per_held", raw.failed_per_held.len().min(1), raw.failed_per_held.len())?;
        let failed_per_held = raw.failed_per_held.first().copied();
        not_below_zero("failed_per_held", failed_per_held.unwrap_or_default())?;
        not_below_zero("series_interval", raw.series_interval)?;
        let series_interval = (raw.series_interval > 0.0).then_some(raw.series_interval);
        let (friction, torsion, mass) = (raw.friction, raw.torsion, raw.mass);
        let (mass_from, mass_source, gravity) = (raw.mass_from, raw.mass_source, raw.gravity);
        let (variants, confirm_held, confirm_failed) = (raw.variants, raw.confirm_held, raw.confirm_failed);
        let method = TrialMethod {
            friction,
            torsion,
            mass,
            mass_from,
            mass_source,
            gravity,
            spreads,
            tried,
            variants,
            table_friction,
            series_interval,
            confirm_held,
            confirm_failed,
            failed_per_held,
        };
        let mut read: Vec<GraspTrial> = Vec::with_capacity(raw.trials.len());
        for trial in &raw.trials {
            let ascends = read.last().is_none_or(|before| before.grasp < trial.grasp);
            ranged(MESSAGE, "trials.grasp", f64::from(trial.grasp), ascends, "ascending")?;
            let on_table = u32::from(trial.table.is_some());
            let may_be = on_table == 0 || table_friction.is_some();
            ranged(MESSAGE, "trials.table", f64::from(on_table), may_be, "none without a table_friction")?;
            let of_table = trial.table.as_ref().and_then(|table| table.series.as_ref());
            let with_series = u32::from(trial.series.is_some() || of_table.is_some());
            let may_be = with_series == 0 || series_interval.is_some();
            ranged(MESSAGE, "trials.series", f64::from(with_series), may_be, "none without a series_interval")?;
            read.push(GraspTrial::of(trial, joints as usize, &method)?);
        }
        Ok(Self { sample, hand: raw.hand, links, joints, method, trials: read })
    }
}

/// A message within a message.
pub(super) fn nested(out: &mut Vec<u8>, field: u32, encode: impl FnOnce(&mut Vec<u8>)) {
    let mut message = Vec::new();
    encode(&mut message);
    wire::element(out, field, &message);
}

fn triple(field: &'static str, values: &[f64]) -> Result<[f64; 3], RecordError> {
    lengthy(MESSAGE, field, 3, values.len())?;
    finite(field, values)?;
    Ok([values[0], values[1], values[2]])
}

impl GraspTrial {
    fn encode(&self, out: &mut Vec<u8>) {
        wire::uint32(out, 1, self.grasp);
        nested(out, 2, |out| self.outcome.encode(out));
        self.closed.iter().for_each(|closed| closed.encode(out, 3));
        for trial in &self.perturbed {
            nested(out, 10, |out| {
                wire::double(out, 1, trial.friction);
                wire::double(out, 2, trial.mass);
                wire::doubles(out, 3, &trial.shift);
                wire::doubles(out, 4, &trial.turn);
                nested(out, 5, |out| trial.outcome.encode(out));
            });
        }
        wire::uint32(out, 11, self.roll_outs[0]);
        wire::uint32(out, 12, self.roll_outs[1]);
        wire::uint32s(out, 13, self.variants.iter().map(|verdict| *verdict as u32));
        if let Some(TableTrial { resting_pose, outcome, series }) = &self.table {
            nested(out, 14, |out| {
                wire::uint32(out, 1, *resting_pose);
                nested(out, 2, |out| outcome.encode(out));
                series.iter().for_each(|series| nested(out, 30, |out| series.encode(out)));
            });
        }
        wire::uint32s(out, 15, self.confirmed.iter().map(|verdict| *verdict as u32));
        wire::uint32(out, 16, self.label().number());
        wire::uint32(out, 17, u32::from(self.is_unconfirmed));
        self.series.iter().for_each(|series| nested(out, 30, |out| series.encode(out)));
    }

    fn of(trial: &proto::GraspTrial, joints: usize, method: &TrialMethod) -> Result<Self, RecordError> {
        let [count, held] = [trial.roll_outs, trial.roll_outs_held];
        ranged(MESSAGE, "trials.roll_outs_held", f64::from(held), held <= count, "at most roll_outs")?;
        if !trial.variants.is_empty() {
            lengthy(MESSAGE, "trials.variants", method.variants.len(), trial.variants.len())?;
        }
        let perturbed = trial.perturbed.iter().map(|trial| {
            for (field, value) in [("perturbed.friction", trial.friction), ("perturbed.mass", trial.mass)] {
                not_below_zero(field, value)?;
            }
            Ok(PerturbedTrial {
                friction: trial.friction,
                mass: trial.mass,
                shift: triple("perturbed.shift", &trial.shift)?,
                turn: triple("perturbed.turn", &trial.turn)?,
                outcome: TrialOutcome::of(trial.outcome.as_ref())?,
            })
        });
        let verdicts = |field: &'static str, numbers: &[u32]| {
            numbers.iter().map(|number| verdict_of(field, *number)).collect::<Result<Vec<_>, RecordError>>()
        };
        let stored = StoredHand {
            joints: &trial.joints,
            object_from_base: &trial.object_from_base,
            links: &trial.links,
            points: &trial.points,
            normals: &trial.normals,
            distances: &trial.distances,
            forces: &trial.forces,
        };
        let read = Self {
            grasp: trial.grasp,
            outcome: TrialOutcome::of(trial.outcome.as_ref())?,
            closed: ClosedHand::of(&stored, joints)?,
            perturbed: perturbed.collect::<Result<_, RecordError>>()?,
            roll_outs: [count, held],
            variants: verdicts("trials.variants", &trial.variants)?,
            table: trial.table.as_ref().map(|trial| TableTrial::of(trial, joints + 1)).transpose()?,
            confirmed: verdicts("trials.confirmed", &trial.confirmed)?,
            is_unconfirmed: trial.unconfirmed,
            series: TrialSeries::of(trial.series.as_ref(), &method.gravity, joints + 1)?,
        };
        let may_be = !read.is_unconfirmed || (read.agreed() == Some(false) && method.failed_per_held.is_some());
        let unconfirmed = f64::from(u8::from(read.is_unconfirmed));
        ranged(
            MESSAGE,
            "trials.unconfirmed",
            unconfirmed,
            may_be,
            "false where a trial held, or negatives are not limited",
        )?;
        let held = read.outcome.verdict.is_held();
        let asked = method.confirmations(&read);
        let ends = read.confirmed.iter().position(|verdict| verdict.is_held() != held);
        lengthy(MESSAGE, "trials.confirmed", ends.map_or(asked, |last| asked.min(last + 1)), read.confirmed.len())?;
        // Datasets of earlier versions state none.
        let is_so = [0, read.label().number()].contains(&trial.label);
        ranged(MESSAGE, "trials.label", f64::from(trial.label), is_so, "the label that follows from the verdicts")?;
        Ok(read)
    }
}

impl TableTrial {
    /// Reads the trial of a hand with this number of links.
    fn of(trial: &proto::TableTrial, links: usize) -> Result<Self, RecordError> {
        let outcome = TrialOutcome::of(trial.outcome.as_ref())?;
        // An object on a table is always lifted off it, regardless of the gravity in the air.
        let series = TrialSeries::of(trial.series.as_ref(), GRAVITIES[0], links)?;
        Ok(Self { resting_pose: trial.resting_pose, outcome, series })
    }
}

/// A closed hand as a message stores it.
pub(super) struct StoredHand<'a> {
    pub joints: &'a [f64],
    pub object_from_base: &'a [f64],
    pub links: &'a [u32],
    pub points: &'a [f64],
    pub normals: &'a [f64],
    pub distances: &'a [f64],
    pub forces: &'a [f64],
}

impl ClosedHand {
    /// Appends seven fields, the first of this number.
    pub(super) fn encode(&self, out: &mut Vec<u8>, first: u32) {
        let Self { joints, object_from_base, contacts } = self;
        wire::doubles(out, first, joints);
        wire::doubles(out, first + 1, &object_from_base.to_rows());
        wire::uint32s(out, first + 2, contacts.iter().map(|contact| contact.link));
        wire::doubles_of(out, first + 3, contacts.iter().flat_map(|contact| contact.point));
        wire::doubles_of(out, first + 4, contacts.iter().flat_map(|contact| contact.normal));
        wire::doubles_of(out, first + 5, contacts.iter().map(|contact| contact.distance));
        wire::doubles_of(out, first + 6, contacts.iter().map(|contact| contact.force));
    }

    /// Reads the closed hand, if one is stored, of a hand with this number of joints.
    pub(super) fn of(stored: &StoredHand<'_>, joints: usize) -> Result<Option<Self>, RecordError> {
        let &StoredHand { joints: values, object_from_base, links, points, normals, distances, forces } = stored;
        let count = links.len();
        if object_from_base.is_empty() && values.is_empty() && count == 0 {
            return Ok(None);
        }
        for (field, expected, values) in [
            ("trials.joints", joints, values),
            ("trials.points", 3 * count, points),
            ("trials.normals", 3 * count, normals),
            ("trials.distances", count, distances),
            ("trials.forces", count, forces),
        ] {
            lengthy(MESSAGE, field, expected, values.len())?;
            finite(field, values)?;
        }
        let mut contacts = Vec::with_capacity(count);
        for (index, link) in links.iter().copied().enumerate() {
            ranged(MESSAGE, "trials.links", f64::from(link), link as usize <= joints, "an index into links")?;
            let of = |field, values: &[f64]| triple(field, &values[3 * index..][..3]);
            let (point, normal) = (of("trials.points", points)?, of("trials.normals", normals)?);
            let length = Vector3::from(normal).norm();
            ranged(MESSAGE, "trials.normals", length, (length - 1.0).abs() < 1e-9, "of unit length")?;
            contacts.push(PressedContact { link, point, normal, distance: distances[index], force: forces[index] });
        }
        let object_from_base = pose(MESSAGE, "trials.object_from_base", object_from_base)?;
        Ok(Some(Self { joints: values.to_vec(), object_from_base, contacts }))
    }
}

/// `Err` unless the text is one of these.
fn named(field: &'static str, found: &str, known: &[&str]) -> Result<(), RecordError> {
    if known.contains(&found) {
        return Ok(());
    }
    let (found, expected) = (found.to_owned(), known.join(" or "));
    Err(RecordError::Name { message: MESSAGE, field, found, expected })
}
