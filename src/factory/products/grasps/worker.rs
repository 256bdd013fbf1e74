//! The producer of grasps for one thread: loads an object, then makes its runs one by one.

use std::sync::Arc;

use nalgebra::IsometryMatrix3;

use super::{
    hand::GraspHand,
    ladders::Ladders,
    recorded::{method, names, recorded},
    settings::{GraspJob, GraspSettings, Labels, Physics},
    trials::Trials,
};
use crate::{ProduceError, SampleWriter, objects::prepared, work::Producer};
use format::{Channel, GraspRun, RunInterval};
use kernel::{
    cancel::Cancel,
    contact::ContactSurface,
    geom::{Pose, SimdLevel},
    ids::{Digest, ItemId, ObjectId, SampleId},
    seed::Stream,
    words::{GraspVerdict, STRETCHES},
};
use robot::grasp::{
    Annealer, Antipodal, ApproachDraws, GraspSampler, HandPassage, ObjectSearch, Sampler, SearchRun, Uniform, axes,
    seeds,
};

/// Reason why a run makes no sample: no neighbour of the seed was legal.
const NO_LEGAL_STATE: &str = "no_legal_state";

/// The producer of one thread; its memory is reused from run to run.
pub struct GraspWorker<'j> {
    job: &'j GraspJob,
    seed: u64,
    hand: &'j GraspHand,
    search: Search,
    passage: HandPassage,
    /// The object that was loaded last, with its index in the job.
    loaded: Option<(usize, LoadedObject)>,
    record: GraspRun,
    /// With `[physics]`.
    trials: Option<Labeller>,
}

/// Physical trials, by the method of their labels.
enum Labeller {
    Agreement(Box<Trials>),
    Ladder(Box<Ladders>),
}

impl Labeller {
    fn new(job: &GraspJob, settings: Physics, seed: u64, run: &GraspRun) -> Result<Self, ProduceError> {
        Ok(match settings.labels {
            Labels::Agreement => Self::Agreement(Box::new(Trials::new(job, settings, seed, run)?)),
            Labels::Ladder => Self::Ladder(Box::new(Ladders::new(job, settings, run)?)),
        })
    }
}

/// Source of states of the hand.
enum Search {
    Annealing(Box<Annealer>),
    Uniform(Box<GraspSampler>, Uniform),
    Antipodal(Box<GraspSampler>, Antipodal),
    Approach(Box<GraspSampler>, ApproachDraws),
}

/// An object ready for its runs.
struct LoadedObject {
    id: ObjectId,
    seeds: Vec<IsometryMatrix3<f64>>,
    search: ObjectSearch,
    surface: Arc<ContactSurface>,
}

impl<'j> GraspWorker<'j> {
    /// A producer for one thread.
    ///
    /// # Errors
    /// When the job has `[physics]` and the hand cannot be read.
    pub fn new(job: &'j GraspJob, seed: u64, hand: &'j GraspHand, level: SimdLevel) -> Result<Self, ProduceError> {
        let GraspSettings { sampler, annealing, keeping, .. } = &job.settings;
        let record = GraspRun {
            sample: SampleId::of_object(ObjectId(Digest([0; 32])), ItemId(0)),
            hand: names(&hand.hand, job.hand.id),
            object_from_seed: Pose::identity(),
            asked_steps: job.settings.steps(),
            steps: 0,
            failed: 0,
            tries: 0,
            potentials: 0,
            course: [RunInterval::default(); STRETCHES],
            method: method(&job.settings),
            grasps: Vec::new(),
            resting_poses: 0,
            budget_spent: false,
        };
        let sampling = || Box::new(GraspSampler::new(&hand.search, annealing, keeping, level));
        let search = match sampler {
            Sampler::Annealing => Search::Annealing(Box::new(Annealer::new(&hand.search, annealing, keeping, level))),
            Sampler::Uniform(uniform) => Search::Uniform(sampling(), uniform.clone()),
            Sampler::Antipodal(antipodal) => Search::Antipodal(sampling(), *antipodal),
            Sampler::Approach(approach) => Search::Approach(sampling(), *approach),
        };
        Ok(Self {
            job,
            seed,
            hand,
            search,
            passage: HandPassage::new(&hand.search, 0.0),
            loaded: None,
            trials: job.settings.physics.map(|physics| Labeller::new(job, physics, seed, &record)).transpose()?,
            record,
        })
    }

    fn prepare(&mut self, index: usize, cancel: &Cancel) -> Result<LoadedObject, ProduceError> {
        let object = &self.job.objects.list[index];
        let prepared = prepared(object)?;
        let name = || object.source.name.clone();
        prepared.make_contact_surface(cancel)?;
        let surface = prepared.contact_surface().map_err(|error| ProduceError::unusable(name(), error))?;
        let id = object.id();
        let mut stream = Stream::of_job(self.seed, &id.0.0, "grasp seeds");
        let GraspSettings { sampler, seeds: runs, .. } = &self.job.settings;
        let seeds = match sampler {
            Sampler::Uniform(uniform) => axes(surface, uniform, *runs, &mut stream),
            _ => seeds(surface, *runs, &mut stream),
        };
        cancel.check()?;
        let search = ObjectSearch::of_object(&prepared).map_err(|error| ProduceError::unusable(name(), error))?;
        // A job refuses such an object when it is opened.
        let search = search.ok_or_else(|| ProduceError::unusable(name(), "it has no solid inside"))?;
        cancel.check()?;
        let weight = object.weight(&prepared);
        match &mut self.trials {
            Some(Labeller::Agreement(trials)) => trials.load(&prepared, surface, search.resting(), &weight)?,
            Some(Labeller::Ladder(ladders)) => ladders.load(&prepared, surface, search.resting(), &weight)?,
            None => {}
        }
        Ok(LoadedObject { id, seeds, search, surface: Arc::clone(surface) })
    }
}

impl Producer for GraspWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        let trials = self.job.settings.physics.map(|physics| physics.labels.channel());
        std::iter::once(Channel::GRASP_RUN).chain(trials).collect()
    }

    fn load(&mut self, subject: usize, cancel: &Cancel) -> Result<(), ProduceError> {
        if self.loaded.as_ref().is_none_or(|(index, _)| *index != subject) {
            // The memory of the object before goes first.
            self.loaded = None;
            self.loaded = Some((subject, self.prepare(subject, cancel)?));
        }
        Ok(())
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let (_, object) = self.loaded.as_mut().expect("an object is loaded before its runs are made");
        let sample = SampleId::of_object(object.id, item);
        let mut stream = Stream::of_sample(self.seed, &sample, "annealing");
        let seed = &object.seeds[item.0 as usize];
        let run = match &mut self.search {
            Search::Annealing(annealer) => annealer.run(&object.search, seed, &mut stream),
            Search::Uniform(search, uniform) => search.uniform(&object.search, seed, uniform),
            Search::Antipodal(search, antipodal) => search.antipodal(&object.search, antipodal, &mut stream),
            Search::Approach(search, approach) => search.approaches(&object.search, approach, &mut stream),
        };
        recorded(&run, sample, &self.hand.hand, &mut self.record);
        for grasp in self.record.grasps.iter_mut().filter(|grasp| grasp.verdict != GraspVerdict::Penetrates) {
            let base = grasp.object_from_base.isometry();
            grasp.object_in_way = Some(self.passage.past_object(&object.surface, base, &grasp.posture));
        }
        // A run over pairs or approaches ends once it has its states: it takes no more than it has drawn.
        let spent = run.is_budget_spent();
        self.record.asked_steps = if spent.is_some() { run.steps } else { self.job.settings.steps() };
        self.record.budget_spent = spent.unwrap_or(false);
        self.record.resting_poses = object.search.resting().poses.len() as u32;
        let mut facts = self.record.facts();
        if run.grasps.is_empty() {
            let detail = no_state(&run, self.hand);
            return out.reject(sample, facts, NO_LEGAL_STATE, &detail);
        }
        if let Some(payload) = out.payload(Channel::GRASP_RUN) {
            self.record.encode(payload);
        }
        match &mut self.trials {
            Some(Labeller::Agreement(trials)) => {
                if let Some(payload) = out.payload(Channel::GRASP_TRIALS) {
                    facts.trials = trials.run(&self.record, payload)?;
                }
            }
            Some(Labeller::Ladder(ladders)) => {
                if let Some(payload) = out.payload(Channel::GRASP_LADDERS) {
                    facts.ladder = ladders.run(&self.record, payload)?;
                }
            }
            None => {}
        }
        out.keep(sample, facts)
    }
}

/// Cause and remedy of a run without a legal state, for the ledger.
fn no_state(run: &SearchRun, hand: &GraspHand) -> String {
    let own = hand.own_obstacle();
    match run.explained_losses() {
        // These counts have their own causes.
        Some(losses) => own.map_or_else(|| losses.clone(), |own| format!("{losses}; {own}")),
        None => {
            let in_the_way = "the object is in the hand's way: check its unit and size, or raise grasps.seeds";
            let cause = own.unwrap_or_else(|| in_the_way.to_owned());
            format!("{} of {} steps had no legal neighbour; {cause}", run.failed, run.steps)
        }
    }
}
