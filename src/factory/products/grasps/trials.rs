//! Physical trials of the states that a run found.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Unit, Vector3};

use super::{
    series::recorded_series,
    settings::{GraspJob, Physics},
};
use crate::{
    ProduceError,
    job::{JobHand, Weight},
};
use format::{
    ClosedHand, Grasp, GraspRun, GraspTrial, GraspTrials, PerturbedTrial, PressedContact, TableTrial, TrialFacts,
    TrialMethod, TrialOutcome, TrialVerdict,
};
use kernel::{
    contact::ContactSurface,
    geom::{MassProperties, Pose, RestingPoses, TriMesh},
    ids::SampleId,
    object::PreparedObject,
    seed::Stream,
    words::MassSource,
};
use sim::{
    Gravity, Grip, HandError, HandModel, NativeContacts, Outcome, Series, TableSupport, TrialConditions, TrialSim,
    TrialSpread, TrialWorker, Variant, Verdict,
};

const SPREAD: TrialSpread = TrialSpread::STANDARD;

/// One thread's trials of one hand.
pub(super) struct Trials {
    model: HandModel,
    scene: String,
    settings: Physics,
    seed: u64,
    /// The object that was loaded last.
    object: Option<TriedObject>,
    record: GraspTrials,
}

struct TriedObject {
    worker: TrialWorker,
    native: NativeTrials,
    conditions: TrialConditions,
    /// Easier conditions that confirm a failure of a grasp of the object.
    easier: Vec<Variant>,
    /// Tables under the resting poses of the object, the most likely first; none where grasps are not tried on one.
    tables: Vec<TableSupport>,
}

/// Trials of the object by MuJoCo's own contacts: compiled at the first failure that comes so far.
struct NativeTrials {
    mesh: TriMesh,
    properties: MassProperties,
    worker: Option<TrialWorker>,
}

impl NativeTrials {
    fn worker(&mut self, model: &HandModel) -> Result<&mut TrialWorker, HandError> {
        let Self { mesh, properties, worker } = self;
        if worker.is_none() {
            let sim = TrialSim::with_native_mesh(model, mesh, properties, NativeContacts::Triangles)?;
            *worker = Some(TrialWorker::new(&sim));
        }
        Ok(worker.as_mut().expect("made above"))
    }
}

impl Trials {
    /// Reads the hand; `run` is a record of it without grasps.
    ///
    /// # Errors
    /// When the hand cannot be read.
    pub fn new(job: &GraspJob, settings: Physics, seed: u64, run: &GraspRun) -> Result<Self, ProduceError> {
        let JobHand { scene, .. } = &job.hand;
        let name = scene.display().to_string();
        let model = HandModel::open(scene).map_err(|error| ProduceError::unusable(&name, error))?;
        let TrialSpread { friction, mass, shift, turn } = SPREAD;
        let names = |variants: &[Variant]| variants.iter().map(|variant| variant.name().to_owned()).collect();
        let [confirms_held, _] = settings.confirm;
        let record = GraspTrials {
            sample: run.sample,
            hand: run.hand.name.clone(),
            links: run.hand.links.clone(),
            joints: run.hand.joints.len() as u32,
            method: TrialMethod {
                friction: settings.friction,
                torsion: TrialConditions::TORSION,
                mass: 1.0,
                mass_from: String::new(),
                mass_source: String::new(),
                gravity: if settings.six_directions { "six" } else { "lifted" }.to_owned(),
                spreads: [friction, mass, shift, turn],
                tried: settings.tried,
                variants: if settings.variant_share > 0.0 { names(&Variant::ALL) } else { Vec::new() },
                table_friction: settings.table_friction,
                series_interval: (settings.series_share > 0.0).then_some(Series::INTERVAL),
                confirm_held: if confirms_held { names(&Variant::HARDER) } else { Vec::new() },
                confirm_failed: Vec::new(),
            },
            trials: Vec::new(),
        };
        Ok(Self { model, scene: name, settings, seed, object: None, record })
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
        let properties = MassProperties::of_solid(surface.solid()).ok_or_else(no_solid)?;
        let compile = if self.settings.table_friction.is_some() { TrialSim::on_table } else { TrialSim::new };
        let sim =
            compile(&self.model, surface, &properties).map_err(|error| ProduceError::unusable(&self.scene, error))?;
        let tables = self.settings.table_friction.map(|friction| {
            resting.poses.iter().map(|pose| TableSupport { friction, ..TableSupport::under(pose) }).collect()
        });
        let given = self.settings.mass.map(|mass| (mass, MassSource::Job.name(), ""));
        let (mass, from, source) = given.unwrap_or((weight.kilograms, weight.from.name(), weight.source.as_str()));
        let gravity = if self.settings.six_directions { Gravity::Six } else { Gravity::Lifted };
        let conditions = TrialConditions { friction: self.settings.friction, gravity, ..TrialConditions::new(mass) };
        let method = &mut self.record.method;
        (method.mass, method.mass_from, method.mass_source) = (mass, from.to_owned(), source.to_owned());
        let has_native = TrialSim::can_touch_triangles(&self.model, object.mesh());
        let easier = Variant::EASIER.into_iter().filter(|easier| *easier != Variant::NativeContacts || has_native);
        let easier: Vec<Variant> = if self.settings.confirm[1] { easier.collect() } else { Vec::new() };
        method.confirm_failed = easier.iter().map(|easier| easier.name().to_owned()).collect();
        let (worker, tables) = (TrialWorker::new(&sim), tables.unwrap_or_default());
        let native = NativeTrials { mesh: object.mesh().clone(), properties, worker: None };
        self.object = Some(TriedObject { worker, native, conditions, tables, easier });
        Ok(())
    }

    /// Tries the states of a run that the job asks for and appends the payload.
    ///
    /// # Errors
    /// When a grasp does not fit the hand.
    pub fn run(&mut self, run: &GraspRun, payload: &mut Vec<u8>) -> Result<TrialFacts, ProduceError> {
        let Self { model, scene, settings, seed, object, record } = self;
        let object = object.as_mut().expect("an object is loaded before its grasps are tried");
        record.sample = run.sample;
        record.trials.clear();
        for (index, grasp) in (0..).zip(&run.grasps) {
            if settings.tried.includes(grasp.verdict) {
                let mut draws = Draws::new(*seed, &run.sample, index);
                let trial = object
                    .grasp(model, index, grasp, settings, &mut draws)
                    .map_err(|error| ProduceError::unusable(scene.as_str(), error))?;
                record.trials.push(trial);
            }
        }
        record.encode(payload);
        Ok(record.facts())
    }
}

/// A grasp's own streams: what one setting asks for, or which other grasps are tried, moves no draw.
struct Draws {
    perturbed: Stream,
    chosen: Stream,
    rolled_out: Stream,
    chosen_for_variants: Stream,
    chosen_for_series: Stream,
}

impl Draws {
    fn new(seed: u64, sample: &SampleId, grasp: u32) -> Self {
        let stream = |purpose: &str| Stream::of_sample(seed, sample, &format!("{purpose} of grasp {grasp}"));
        Self {
            perturbed: stream("perturbed trials"),
            chosen: stream("chosen for roll-outs"),
            rolled_out: stream("roll-outs"),
            chosen_for_variants: stream("chosen for variants"),
            chosen_for_series: stream("chosen for series"),
        }
    }
}

impl TriedObject {
    fn grasp(
        &mut self,
        model: &HandModel,
        index: u32,
        grasp: &Grasp,
        settings: &Physics,
        draws: &mut Draws,
    ) -> Result<GraspTrial, HandError> {
        let base_from_object = grasp.object_from_base.isometry().inverse();
        let conditions = self.conditions;
        let mut run = |conditions: &TrialConditions| self.worker.run(&grasp.posture, &base_from_object, conditions);
        // What is stored over time moves no trial.
        let has_series = draws.chosen_for_series.unit() < settings.series_share;
        let outcome = run(&TrialConditions { has_series, ..conditions })?;
        let mut perturbed = Vec::with_capacity(settings.perturbed as usize);
        for _ in 0..settings.perturbed {
            let off = conditions.perturbed(&SPREAD, &mut draws.perturbed);
            perturbed.push(PerturbedTrial {
                friction: off.friction,
                mass: off.mass,
                shift: off.shift.into(),
                turn: off.turn.into(),
                outcome: recorded(&run(&off)?),
            });
        }
        let mut roll_outs = [0; 2];
        if draws.chosen.unit() < settings.roll_out_share {
            for _ in 0..settings.roll_outs {
                let held = run(&conditions.perturbed(&SPREAD, &mut draws.rolled_out))?.verdict.is_held();
                roll_outs = [roll_outs[0] + 1, roll_outs[1] + u32::from(held)];
            }
        }
        let mut variants = Vec::new();
        if draws.chosen_for_variants.unit() < settings.variant_share && outcome.verdict.is_held() {
            for variant in Variant::ALL {
                variants.push(verdict(&run(&variant.of(&conditions))?.verdict));
            }
        }
        // The most likely pose of the object in which the hand stays above the table.
        let mut table = None;
        if let Some((pose, support)) = grasp.likeliest_table().and_then(|pose| Some((pose, *self.tables.get(pose)?))) {
            let on_table = TrialConditions { table: Some(support), gravity: Gravity::Lifted, has_series, ..conditions };
            let outcome = run(&on_table)?;
            let series = outcome.series.as_ref().map(|series| recorded_series(series, on_table.gravity));
            table = Some(TableTrial { resting_pose: pose as u32, outcome: recorded(&outcome), series });
        }
        let closed = outcome.closed.as_ref().map(closed_hand);
        let series = outcome.series.as_ref().map(|series| recorded_series(series, conditions.gravity));
        let (outcome, confirmed) = (recorded(&outcome), Vec::new());
        let mut trial =
            GraspTrial { grasp: index, outcome, closed, perturbed, roll_outs, variants, table, confirmed, series };
        // Trials that agree are made again where it is harder to hold, or easier: what ends otherwise there is no sure label,
        // and asks no further.
        let agreed = trial.agreed();
        let confirms = match (agreed, settings.confirm) {
            (Some(true), [true, _]) => &Variant::HARDER[..],
            (Some(false), [_, true]) => &self.easier[..],
            _ => &[],
        };
        for variant in confirms {
            let changed = variant.of(&conditions);
            let outcome = match variant {
                Variant::NativeContacts => {
                    self.native.worker(model)?.run(&grasp.posture, &base_from_object, &changed)?
                }
                _ => run(&changed)?,
            };
            let confirmed = verdict(&outcome.verdict);
            trial.confirmed.push(confirmed);
            if Some(confirmed.is_held()) != agreed {
                break;
            }
        }
        Ok(trial)
    }
}

fn recorded(outcome: &Outcome) -> TrialOutcome {
    let closed = outcome.closed.as_ref();
    TrialOutcome {
        verdict: verdict(&outcome.verdict),
        time: outcome.time(),
        closing_time: outcome.closing_time,
        closed_at_rest: outcome.closed_at_rest,
        penetration: [outcome.start.penetration, closed.map_or(0.0, Grip::penetration), outcome.shaken_penetration],
        farthest: outcome.farthest,
        slips: outcome.slips.iter().map(|slip| [slip.moved, slip.turned]).collect(),
        force: closed.map_or(0.0, Grip::force),
        links: outcome.end.as_ref().map_or(0, |end| end.links().len() as u32),
        opened_by: outcome.start.opened_by,
        drawn_back: outcome.start.drawn_back,
        warnings: outcome.warnings,
    }
}

fn verdict(verdict: &Verdict) -> TrialVerdict {
    TrialVerdict::from_name(verdict.reason()).expect("records know every verdict (a test compares them)")
}

/// The closed hand as the object sees it.
fn closed_hand(grip: &Grip) -> ClosedHand {
    let object_from_base: IsometryMatrix3<f64> = grip.base_from_object.inverse();
    let contacts = grip.touches.iter().map(|touch| {
        let normal: Vector3<f64> = object_from_base.rotation * touch.normal.into_inner();
        PressedContact {
            link: touch.link as u32,
            point: (object_from_base * touch.point).coords.into(),
            normal: Unit::new_normalize(normal).into_inner().into(),
            distance: touch.distance,
            force: touch.force,
        }
    });
    ClosedHand {
        joints: grip.joints.clone(),
        object_from_base: Pose::from_isometry(object_from_base),
        contacts: contacts.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::{Phase, Verdict};

    #[test]
    fn records_know_every_verdict() {
        let lost = |phase| Verdict::Lost { phase, time: 1.0 };
        let verdicts = [
            Verdict::Held,
            Verdict::Refused { penetration: 0.1 },
            Verdict::NotTouching,
            Verdict::OneLink,
            lost(Phase::Closing),
            lost(Phase::Lift),
            lost(Phase::Shake),
            lost(Phase::Turned(3)),
            Verdict::LetGo { links: 1 },
        ];
        assert_eq!(verdicts.map(|known| verdict(&known)), TrialVerdict::ALL[..9]);
        assert_eq!(TrialVerdict::from_name("unstable"), Some(TrialVerdict::Unstable));
    }
}
