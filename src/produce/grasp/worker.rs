//! One thread's workshop: loads an object, then makes its runs one by one.

use std::sync::Arc;

use nalgebra::IsometryMatrix3;

#[cfg(feature = "sim")]
use super::trials::Trials;
use super::{
    hand::GraspHand,
    recorded::{method, names, recorded},
    seeds::seeds,
};
use crate::{
    contact::ContactSurface,
    geom::{Pose, RestingPoses, SimdLevel},
    grasp::{Annealer, Antipodal, GraspSampler, ObjectSearch, Sampler, Uniform, axes},
    ids::{Digest, ObjectId, SampleId, ViewId},
    job::{GraspJob, GraspSettings},
    produce::{
        Outcome, ProduceError, Producer,
        objects::{inside_test, prepared},
    },
    record::{Channel, GraspRun, RunStretch, STRETCHES},
    seed::Stream,
};

/// Why a run makes no sample: no neighbour of the seed was legal.
const NO_LEGAL_STATE: &str = "no_legal_state";

/// One thread's workshop; its memory is reused from run to run.
pub struct GraspWorker<'j> {
    job: &'j GraspJob,
    seed: u64,
    hand: &'j GraspHand,
    search: Search,
    /// The object that was loaded last, and its place in the job.
    loaded: Option<(usize, LoadedObject)>,
    record: GraspRun,
    payload: Vec<u8>,
    /// Where the job asks for physics.
    #[cfg(feature = "sim")]
    trials: Option<Trials>,
    trials_payload: Vec<u8>,
}

/// What comes by states of the hand.
enum Search {
    Annealing(Box<Annealer>),
    Uniform(Box<GraspSampler>, Uniform),
    Antipodal(Box<GraspSampler>, Antipodal),
}

/// An object ready for its runs.
struct LoadedObject {
    id: ObjectId,
    seeds: Vec<IsometryMatrix3<f64>>,
    search: ObjectSearch,
}

impl<'j> GraspWorker<'j> {
    /// A workshop for one thread.
    ///
    /// # Errors
    /// When the job asks for physics and the hand cannot be read.
    pub fn new(job: &'j GraspJob, seed: u64, hand: &'j GraspHand, level: SimdLevel) -> Result<Self, ProduceError> {
        let GraspSettings { sampler, annealing, keeping, .. } = &job.settings;
        let record = GraspRun {
            sample: SampleId::of_object(ObjectId(Digest([0; 32])), ViewId(0)),
            hand: names(&hand.hand, job.hand.id),
            object_from_seed: Pose::identity(),
            asked_steps: job.settings.steps(),
            steps: 0,
            failed: 0,
            tries: 0,
            potentials: 0,
            course: [RunStretch::default(); STRETCHES],
            method: method(&job.settings),
            grasps: Vec::new(),
            resting: RestingPoses::default(),
        };
        if matches!(sampler, Sampler::Antipodal(_)) && hand.hand.closing_line().is_none() {
            let why = "grasps.sampler = \"antipodal\" needs a gripper: a `width` in its table, its pads slid towards each other \
                       by one motor";
            return Err(ProduceError::NoGrasps { name: job.hand.scene.display().to_string(), why: why.to_owned() });
        }
        let sampling = || Box::new(GraspSampler::new(&hand.search, annealing, keeping, level));
        let search = match sampler {
            Sampler::Annealing => Search::Annealing(Box::new(Annealer::new(&hand.search, annealing, keeping, level))),
            Sampler::Uniform(uniform) => Search::Uniform(sampling(), uniform.clone()),
            Sampler::Antipodal(antipodal) => Search::Antipodal(sampling(), *antipodal),
        };
        Ok(Self {
            job,
            seed,
            hand,
            search,
            loaded: None,
            payload: Vec::new(),
            #[cfg(feature = "sim")]
            trials: job.settings.physics.map(|physics| Trials::new(job, physics, seed, &record)).transpose()?,
            trials_payload: Vec::new(),
            record,
        })
    }

    fn prepare(&mut self, place: usize) -> Result<LoadedObject, ProduceError> {
        let object = &self.job.objects[place];
        let prepared = prepared(object)?;
        let surface = ContactSurface::new(&prepared.mesh, inside_test(&prepared.record));
        let no_surface = |why: String| ProduceError::NoGrasps { name: object.source.name.clone(), why };
        let surface = Arc::new(surface.map_err(|error| no_surface(error.to_string()))?);
        let id = object.id();
        let mut stream = Stream::of_job(self.seed, &id.0.0, "grasp seeds");
        let GraspSettings { sampler, seeds: runs, .. } = &self.job.settings;
        let seeds = match sampler {
            Sampler::Uniform(uniform) => axes(&surface, uniform, *runs, &mut stream),
            _ => seeds(&surface, *runs, &mut stream),
        };
        let search = ObjectSearch::new(&surface, &prepared.mesh);
        let search = search.ok_or_else(|| no_surface("it has no solid inside".to_owned()))?;
        #[cfg(feature = "sim")]
        if let Some(trials) = &mut self.trials {
            trials.load(&surface, object.mass.as_ref())?;
        }
        Ok(LoadedObject { id, seeds, search })
    }
}

impl Producer for GraspWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        let trials = self.job.settings.physics.map(|_| Channel::GraspTrials);
        std::iter::once(Channel::GraspRun).chain(trials).collect()
    }

    fn load(&mut self, subject: usize) -> Result<(), ProduceError> {
        if self.loaded.as_ref().is_none_or(|(place, _)| *place != subject) {
            // The memory of the one before goes first.
            self.loaded = None;
            self.loaded = Some((subject, self.prepare(subject)?));
        }
        Ok(())
    }

    fn produce(&mut self, view: ViewId) -> Result<(SampleId, Outcome), ProduceError> {
        let (_, object) = self.loaded.as_mut().expect("an object is loaded before its runs are made");
        let sample = SampleId::of_object(object.id, view);
        let mut stream = Stream::of_sample(self.seed, &sample, "annealing");
        let seed = &object.seeds[view.0 as usize];
        let run = match &mut self.search {
            Search::Annealing(annealer) => annealer.run(&object.search, seed, &mut stream),
            Search::Uniform(search, uniform) => search.uniform(&object.search, seed, uniform),
            Search::Antipodal(search, antipodal) => search.antipodal(&object.search, antipodal, &mut stream),
        };
        recorded(&run, sample, &self.hand.hand, &mut self.record);
        self.record.resting.clone_from(object.search.resting());
        self.payload.clear();
        self.trials_payload.clear();
        #[cfg_attr(not(feature = "sim"), expect(unused_mut, reason = "nothing is tried"))]
        let mut facts = self.record.facts();
        if run.grasps.is_empty() {
            let detail = format!("{} of {} steps had no legal neighbour", run.failed, run.steps);
            return Ok((sample, Outcome::Rejected { reason: NO_LEGAL_STATE, detail, facts: facts.into() }));
        }
        self.record.encode(&mut self.payload);
        #[cfg(feature = "sim")]
        if let Some(trials) = &mut self.trials {
            facts.trials = trials.run(&self.record, &mut self.trials_payload)?;
        }
        Ok((sample, Outcome::Kept(facts.into())))
    }

    fn payloads(&self) -> Vec<(Channel, &[u8])> {
        let payloads = [self.payload.as_slice(), &self.trials_payload];
        let kept = payloads.into_iter().filter(|payload| !payload.is_empty());
        self.channels().into_iter().zip(kept).collect()
    }
}
