//! Physical trials of the states that a run found.

use std::sync::Arc;

use super::{
    recorded_trial::{closed_hand, recorded, verdict},
    series::recorded_series,
    settings::{GraspJob, Physics},
};
use crate::{
    ProduceError,
    sections::{JobHand, Weight},
};
use assets::object::PreparedObject;
use format::{
    Grasp, GraspLabel, GraspRun, GraspTrial, GraspTrials, PerturbedTrial, TableTrial, TrialFacts, TrialMethod,
};
use kernel::{
    contact::ContactSurface,
    geom::{MassProperties, RestingPoses, TriMesh},
    ids::SampleId,
    seed::Stream,
    words::MassSource,
};
use sim::{
    Gravity, HandError, HandModel, NativeContacts, Outcome, Series, TableSupport, TrialConditions, TrialSim,
    TrialSpread, TrialWorker, Variant,
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
        let JobHand { file, .. } = &job.hand;
        let name = file.display().to_string();
        let model = HandModel::open(file).map_err(|error| ProduceError::unusable(&name, error))?;
        let TrialSpread { friction, mass, shift, turn } = SPREAD;
        let names = |variants: &[Variant]| variants.iter().map(|variant| variant.name().to_owned()).collect();
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
                confirm_held: names(settings.confirm.harder()),
                confirm_failed: Vec::new(),
                failed_per_held: Some(settings.failed_per_held),
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
        let properties = *object.mass().ok_or_else(no_solid)?;
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
        let easier = self.settings.confirm.easier().iter().copied();
        let easier: Vec<_> = easier.filter(|easier| *easier != Variant::NativeContacts || has_native).collect();
        method.confirm_failed = easier.iter().map(|easier| easier.name().to_owned()).collect();
        let (worker, tables) = (TrialWorker::new(&sim), tables.unwrap_or_default());
        let native = NativeTrials { mesh: object.mesh().clone(), properties, worker: None };
        self.object = Some(TriedObject { worker, native, conditions, tables, easier });
        Ok(())
    }

    /// Tries the selected states of a run and appends the payload.
    ///
    /// A label needs several trials, and the first one that differs makes the others unnecessary. So positives come
    /// first, each as long as it holds. The job sets how many of the remaining grasps, in their order, are then tried
    /// to the end.
    ///
    /// # Errors
    /// When a grasp does not fit the hand.
    pub fn run(&mut self, run: &GraspRun, payload: &mut Vec<u8>) -> Result<TrialFacts, ProduceError> {
        let Self { model, scene, settings, seed, object, record } = self;
        let object = object.as_mut().expect("an object is loaded before its grasps are tried");
        record.sample = run.sample;
        record.trials.clear();
        let unusable = |error: HandError| ProduceError::unusable(scene.as_str(), error);
        let mut tries = Tries { model, settings, object };
        for (index, grasp) in (0..).zip(&run.grasps) {
            if settings.tried.includes(grasp.verdict) {
                let mut draws = Draws::new(*seed, &run.sample, index);
                record.trials.push(tries.first(index, grasp, &mut draws).map_err(unusable)?);
            }
        }
        let held = record.trials.iter().filter(|trial| trial.label() == GraspLabel::Held).count();
        let mut wanted = settings.negatives(held);
        for trial in record.trials.iter_mut().filter(|trial| trial.is_unconfirmed) {
            if wanted == 0 {
                break;
            }
            let mut draws = Draws::new(*seed, &run.sample, trial.grasp);
            tries.finish(&run.grasps[trial.grasp as usize], trial, &mut draws).map_err(unusable)?;
            wanted -= usize::from(trial.label() == GraspLabel::Failed);
        }
        record.encode(payload);
        Ok(record.facts())
    }
}

/// A grasp's own streams: a setting, or the choice of other grasps, changes no draw.
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

/// Trials of the grasps of one run.
struct Tries<'a> {
    model: &'a HandModel,
    settings: &'a Physics,
    object: &'a mut TriedObject,
}

impl Tries<'_> {
    /// Tries a grasp in the air, and further as long as it holds; one whose probability of success is measured is also
    /// tried on the table and perturbed, regardless of the outcome.
    fn first(&mut self, index: u32, grasp: &Grasp, draws: &mut Draws) -> Result<GraspTrial, HandError> {
        let (settings, conditions) = (self.settings, self.object.conditions);
        let has_series = draws.chosen_for_series.unit() < settings.series_share;
        let outcome = self.one(grasp, &TrialConditions { has_series, ..conditions })?;
        let mut trial = GraspTrial {
            grasp: index,
            outcome: recorded(&outcome),
            closed: outcome.closed.as_ref().map(closed_hand),
            perturbed: Vec::new(),
            roll_outs: [0; 2],
            variants: Vec::new(),
            table: None,
            confirmed: Vec::new(),
            is_unconfirmed: false,
            series: outcome.series.as_ref().map(|series| recorded_series(series, conditions.gravity)),
        };
        let is_rolled_out = draws.chosen.unit() < settings.rollout_share;
        if is_rolled_out || trial.settled() == Some(true) {
            trial.table = self.on_table(grasp, has_series)?;
        }
        if trial.settled() == Some(true) {
            self.confirm(grasp, &mut trial, settings.confirm.harder())?;
        }
        if is_rolled_out || trial.label() == GraspLabel::Held {
            self.perturb(grasp, &mut trial, draws, is_rolled_out)?;
        }
        if is_rolled_out {
            for _ in 0..settings.rollouts {
                let off = conditions.perturbed(&SPREAD, &mut draws.rolled_out);
                let held = self.one(grasp, &off)?.verdict.is_held();
                trial.roll_outs = [trial.roll_outs[0] + 1, trial.roll_outs[1] + u32::from(held)];
            }
        }
        if draws.chosen_for_variants.unit() < settings.variant_share && outcome.verdict.is_held() {
            for variant in Variant::ALL {
                trial.variants.push(verdict(&self.one(grasp, &variant.apply_to(&conditions))?.verdict));
            }
        }
        trial.is_unconfirmed = trial.agreed() == Some(false);
        Ok(trial)
    }

    /// Makes the trials that a grasp which has not held so far lacks of a negative, up to the first that holds.
    fn finish(&mut self, grasp: &Grasp, trial: &mut GraspTrial, draws: &mut Draws) -> Result<(), HandError> {
        trial.is_unconfirmed = false;
        if trial.table.is_none() {
            let has_series = draws.chosen_for_series.unit() < self.settings.series_share;
            trial.table = self.on_table(grasp, has_series)?;
        }
        if trial.perturbed.is_empty() && trial.agreed() == Some(false) {
            self.perturb(grasp, trial, draws, false)?;
        }
        if trial.agreed() == Some(false) {
            let easier = self.object.easier.clone();
            self.confirm(grasp, trial, &easier)?;
        }
        Ok(())
    }

    /// One trial of a grasp.
    fn one(&mut self, grasp: &Grasp, conditions: &TrialConditions) -> Result<Outcome, HandError> {
        self.object.worker.run(&grasp.posture, &grasp.object_from_base.isometry().inverse(), conditions)
    }

    /// The trial on the table of the most likely pose of the object in which the hand stays above it; `None` without
    /// such a pose.
    fn on_table(&mut self, grasp: &Grasp, has_series: bool) -> Result<Option<TableTrial>, HandError> {
        let support = |pose: usize| Some((pose, *self.object.tables.get(pose)?));
        let Some((pose, support)) = grasp.likeliest_table().and_then(support) else { return Ok(None) };
        let conditions = self.object.conditions;
        let on_table = TrialConditions { table: Some(support), gravity: Gravity::Lifted, has_series, ..conditions };
        let outcome = self.one(grasp, &on_table)?;
        let series = outcome.series.as_ref().map(|series| recorded_series(series, on_table.gravity));
        Ok(Some(TableTrial { resting_pose: pose as u32, outcome: recorded(&outcome), series }))
    }

    /// Tries a grasp under perturbed conditions, up to the first trial that ends otherwise, or all of them.
    fn perturb(
        &mut self,
        grasp: &Grasp,
        trial: &mut GraspTrial,
        draws: &mut Draws,
        all: bool,
    ) -> Result<(), HandError> {
        for _ in 0..self.settings.perturbed_runs {
            let off = self.object.conditions.perturbed(&SPREAD, &mut draws.perturbed);
            let outcome = recorded(&self.one(grasp, &off)?);
            let (shift, turn) = (off.shift.into(), off.turn.into());
            trial.perturbed.push(PerturbedTrial { friction: off.friction, mass: off.mass, shift, turn, outcome });
            if !all && trial.agreed().is_none() {
                break;
            }
        }
        Ok(())
    }

    /// Tries a grasp again where it is harder to hold, or easier, up to the first trial that ends otherwise: what does is no
    /// sure label.
    fn confirm(&mut self, grasp: &Grasp, trial: &mut GraspTrial, variants: &[Variant]) -> Result<(), HandError> {
        let held = trial.outcome.verdict.is_held();
        for variant in variants {
            let changed = variant.apply_to(&self.object.conditions);
            let outcome = match variant {
                Variant::NativeContacts => {
                    let base_from_object = grasp.object_from_base.isometry().inverse();
                    self.object.native.worker(self.model)?.run(&grasp.posture, &base_from_object, &changed)?
                }
                _ => self.one(grasp, &changed)?,
            };
            let confirmed = verdict(&outcome.verdict);
            trial.confirmed.push(confirmed);
            if confirmed.is_held() != held {
                break;
            }
        }
        Ok(())
    }
}
