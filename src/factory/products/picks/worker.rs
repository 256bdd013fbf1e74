//! The producer of picks for one thread.

use std::{collections::BTreeMap, sync::Arc};

use super::{
    loaded::{ClosedGrasp, LoadedObject, LoadedObjects},
    sampled::{SampledBody, Sampling},
    scene::LoadedScene,
    settings::{PickJob, PickSource},
    transferred::Transfer,
    trials::Trials,
};
use crate::{ProduceError, SampleWriter, products::grasps::GraspHand, work::Producer};
use format::{
    Channel, PickCandidate, PickCandidates, PickFacts, PickSampling, Scene, SceneContainer, TakenGrasps,
    dataset::DatasetReader,
};
use kernel::{
    cancel::Cancel,
    geom::SimdLevel,
    ids::{ItemId, ObjectId, SampleId},
    seed::Stream,
};
use robot::{
    grasp::{HandPassage, Passage},
    hand::Hand,
};
use sim::Container;

/// Reason of a body whose object has no stored grasp that is taken.
const NO_STORED_GRASP: &str = "no_stored_grasp";

const _: () = assert!(Passage::FAR == PickCandidates::FAR, "clearances are told as far as they are computed");

/// Parts that all threads share.
pub(super) struct Shared<'j> {
    pub job: &'j PickJob,
    pub seed: u64,
    pub level: SimdLevel,
    /// The dataset of scenes.
    pub scenes: DatasetReader,
    pub hand: GraspHand,
    /// Containers of the scenes, ready for contacts.
    pub containers: Vec<(SceneContainer, Container)>,
    /// Index of each object in the job.
    pub objects: BTreeMap<ObjectId, usize>,
    pub loaded: LoadedObjects,
}

/// The producer of one thread.
pub struct PickWorker<'s> {
    shared: &'s Shared<'s>,
    passage: HandPassage,
    /// Where grasps are sampled in the scene.
    sampling: Option<Sampling>,
    trials: Option<Trials>,
    /// The scene that was loaded last.
    scene: Option<LoadedScene>,
}

impl<'s> PickWorker<'s> {
    /// A producer for one thread.
    ///
    /// # Errors
    /// When the hand cannot be read.
    pub(super) fn new(shared: &'s Shared<'s>) -> Result<Self, ProduceError> {
        let settings = &shared.job.settings;
        let trials = (settings.trials > 0).then(|| Trials::new(&shared.job.hand, settings.awake)).transpose()?;
        let search = &shared.hand.search;
        let sampling = match shared.job.source {
            PickSource::Scene(poses) => {
                Some(Sampling::new(search, settings, poses, shared.level).ok_or_else(|| {
                    let cause = "its two pads do not slide towards each other";
                    ProduceError::unusable(&shared.job.hand.name, cause)
                })?)
            }
            PickSource::Transferred { .. } => None,
        };
        Ok(Self { shared, passage: HandPassage::new(search, settings.margin), sampling, trials, scene: None })
    }

    /// Free candidates that are tried, ascending.
    fn draw_trials(&self, sample: &SampleId, free: impl Iterator<Item = usize>) -> Vec<usize> {
        let mut drawn: Vec<usize> = free.collect();
        Stream::of_sample(self.shared.seed, sample, "pick trials").shuffle(&mut drawn);
        drawn.truncate(self.shared.job.settings.trials as usize);
        drawn.sort_unstable();
        drawn
    }

    fn make(&mut self, scene: &LoadedScene, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let Shared { job, hand, seed, .. } = self.shared;
        let sample = SampleId::of_object(job.scenes.list[scene.index].id, item);
        let body = item.0 as usize;
        if let Some(sampling) = &mut self.sampling {
            let sampled = sampling.sample(sample, scene, (&mut self.passage, &hand.hand), *seed);
            let SampledBody { candidates, closed, record } = sampled;
            let closed: Vec<Option<&ClosedGrasp>> = closed.iter().map(Option::as_ref).collect();
            let candidates = self.record(sample, scene, (TakenGrasps::Sampled, 0), candidates);
            return self.store(scene, &candidates, &closed, Some(&record), out);
        }
        let Some((_, grasps)) = job.source.transferred() else { return Ok(()) };
        let stored = grasps.grasps_of(scene.record.bodies[body].object);
        if stored.is_empty() {
            let take = grasps.take.name();
            let detail = format!("the dataset of grasps has none of its object that is {take}");
            return out.reject(sample, PickFacts::default(), NO_STORED_GRASP, &detail);
        }
        let line = hand.hand.closing_line();
        let transfer = Transfer { hand: &hand.hand, line, stored, settings: job.settings };
        let mut stream = Stream::of_sample(*seed, &sample, "pick candidates");
        let evaluated = transfer.evaluate(scene, body, &mut self.passage, &mut stream);
        let (candidates, closed): (Vec<PickCandidate>, Vec<Option<&ClosedGrasp>>) = evaluated.into_iter().unzip();
        let candidates = self.record(sample, scene, (grasps.take, stored.len() as u32), candidates);
        self.store(scene, &candidates, &closed, None, out)
    }

    /// The record of the candidates of a body, of which the job takes this many stored grasps.
    fn record(
        &self,
        sample: SampleId,
        scene: &LoadedScene,
        (take, stored): (TakenGrasps, u32),
        candidates: Vec<PickCandidate>,
    ) -> PickCandidates {
        let job = self.shared.job;
        PickCandidates {
            sample,
            container: scene.record.container.clone(),
            bodies: scene.record.bodies.iter().map(|body| (body.object, body.world_from_object)).collect(),
            hand: self.shared.hand.hand.name().to_owned(),
            hand_id: job.hand.id,
            joints: joint_names(&self.shared.hand.hand),
            take,
            stored,
            rolls: job.settings.rolls,
            margin: job.settings.margin,
            candidates,
        }
    }

    /// Stores candidates, tries some of the free ones, and stores how they were sampled.
    fn store(
        &mut self,
        scene: &LoadedScene,
        record: &PickCandidates,
        closed: &[Option<&ClosedGrasp>],
        sampling: Option<&PickSampling>,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        let sample = record.sample;
        if let Some(payload) = out.payload(Channel::PICK_CANDIDATES) {
            record.encode(payload);
        }
        let mut tried = None;
        if self.trials.is_some() && out.stores(Channel::PICK_TRIALS) {
            let chosen = self.draw_trials(&sample, record.free());
            let chosen = chosen.into_iter().filter_map(|index| Some((index as u32, closed[index]?)));
            let chosen: Vec<(u32, &ClosedGrasp)> = chosen.collect();
            let Self { trials, passage, .. } = self;
            let trials = trials.as_ref().expect("there are trials").run(sample, scene, &chosen, passage)?;
            if let Some(payload) = out.payload(Channel::PICK_TRIALS) {
                trials.encode(payload);
            }
            tried = Some(trials);
        }
        if let Some((sampling, payload)) = sampling.zip(out.payload(Channel::PICK_SAMPLING)) {
            sampling.encode(payload);
        }
        out.keep(sample, PickFacts::from_candidates(record, tried.as_ref(), sampling))
    }
}

fn joint_names(hand: &Hand) -> Vec<String> {
    hand.tree().joints().iter().map(|joint| joint.joint.name.clone()).collect()
}

impl Producer for PickWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        let tried = self.trials.is_some().then_some(Channel::PICK_TRIALS);
        let sampled = self.sampling.is_some().then_some(Channel::PICK_SAMPLING);
        std::iter::once(Channel::PICK_CANDIDATES).chain(tried).chain(sampled).collect()
    }

    fn load(&mut self, subject: usize, _: &Cancel) -> Result<(), ProduceError> {
        if self.scene.as_ref().is_some_and(|scene| scene.index == subject) {
            return Ok(());
        }
        let Shared { job, scenes, containers, objects, loaded, .. } = self.shared;
        let scene = &job.scenes.list[subject];
        let gone = || {
            let cause = "it has changed; `verify` the dataset of scenes, and make it again with this version";
            ProduceError::unusable(format!("scene {}", scene.name()), cause)
        };
        let record = scenes.sample_of(&scene.sample)?.ok_or_else(gone)?.read::<Scene>()?;
        if record.id() != scene.id {
            return Err(gone());
        }
        let object = |(object, _): &(ObjectId, _)| {
            let grasps = job.source.stored(*object).len() * job.settings.rolls as usize;
            loaded.get(&job.objects, objects[object], grasps)
        };
        let bodies: Vec<Arc<LoadedObject>> = scene.bodies.iter().map(object).collect::<Result<_, ProduceError>>()?;
        let container = containers.iter().find(|(known, _)| *known == scene.container).map(|(_, container)| container);
        let container = container.ok_or_else(gone)?;
        self.scene = Some(LoadedScene::new(subject, record, bodies, container, job.rolling));
        Ok(())
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let scene = self.scene.take().expect("a scene is loaded before grasps of its bodies are evaluated");
        let made = self.make(&scene, item, out);
        self.scene = Some(scene);
        made
    }
}
