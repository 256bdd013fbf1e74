//! The producer of picks for one thread.

use std::{collections::BTreeMap, sync::Arc};

use nalgebra::{IsometryMatrix3, Vector3};

use super::{
    loaded::{ClosedGrasp, LoadedObject, LoadedObjects},
    rotated::rotated_about_line,
    scene::LoadedScene,
    settings::{PickJob, PickSettings},
    trials::Trials,
};
use crate::{ProduceError, SampleWriter, products::grasps::GraspHand, work::Producer};
use format::{
    Blocked, Channel, PickCandidate, PickCandidates, PickFacts, PickObstacle, PickPassage, Scene, SceneContainer,
    dataset::DatasetReader,
};
use kernel::{
    cancel::Cancel,
    geom::Pose,
    ids::{ItemId, ObjectId, SampleId},
    seed::Stream,
    words::BothWays,
};
use robot::{
    grasp::{HandPassage, Passage, PathObstacle},
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
    /// Direction along which the hand closes, in its base frame, of a hand with such a line.
    line: Option<Vector3<f64>>,
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
        let PickSettings { margin, trials, awake, .. } = shared.job.settings;
        let trials = (trials > 0).then(|| Trials::new(&shared.job.hand, awake)).transpose()?;
        let passage = HandPassage::new(&shared.hand.search, margin);
        Ok(Self { shared, passage, line: shared.hand.hand.closing_line(), trials, scene: None })
    }

    /// Grasps of a body that are evaluated: numbers of stored grasps times directions, ascending.
    fn draw(&self, sample: &SampleId, stored: usize) -> Vec<u32> {
        let PickSettings { rolls, candidates, .. } = self.shared.job.settings;
        let mut drawn: Vec<u32> = (0..stored as u32 * rolls).collect();
        Stream::of_sample(self.shared.seed, sample, "pick candidates").shuffle(&mut drawn);
        drawn.truncate(candidates as usize);
        drawn.sort_unstable();
        drawn
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
        let job = self.shared.job;
        let sample = SampleId::of_object(job.scenes.list[scene.index].id, item);
        let body = item.0 as usize;
        let stored = job.grasps.grasps_of(scene.record.bodies[body].object);
        if stored.is_empty() {
            let take = job.grasps.take.name();
            let detail = format!("the dataset of grasps has none of its object that is {take}");
            return out.reject(sample, PickFacts::default(), NO_STORED_GRASP, &detail);
        }
        let object = &scene.objects[body];
        let numbers = self.draw(&sample, stored.len());
        let mut closed: Vec<Option<&ClosedGrasp>> = Vec::with_capacity(numbers.len());
        let mut candidates = Vec::with_capacity(numbers.len());
        let hand = &self.shared.hand.hand;
        for number in numbers {
            let (grasp, direction) = (&stored[(number / job.settings.rolls) as usize], number % job.settings.rolls);
            let base = rotated_about_line(grasp, self.line, direction, job.settings.rolls);
            let mut found = None;
            let ways = self.passage.follow_and_close(&scene.surroundings, body, &base, &grasp.posture, |passage| {
                let close = || ClosedGrasp::new(passage, hand, object, &base, &grasp.posture);
                &found.insert(object.closed(number as usize, close)).grasp
            });
            let key = [grasp.run, grasp.rank, direction];
            candidates.push(recorded(scene, body, key, &base, ways, found));
            closed.push(found);
        }
        let record = PickCandidates {
            sample,
            container: scene.record.container.clone(),
            bodies: scene.record.bodies.iter().map(|body| (body.object, body.world_from_object)).collect(),
            hand: self.shared.hand.hand.name().to_owned(),
            hand_id: job.hand.id,
            joints: joint_names(&self.shared.hand.hand),
            take: job.grasps.take,
            stored: stored.len() as u32,
            rolls: job.settings.rolls,
            margin: job.settings.margin,
            candidates,
        };
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
        out.keep(sample, PickFacts::from_candidates(&record, tried.as_ref()))
    }
}

fn joint_names(hand: &Hand) -> Vec<String> {
    hand.tree().joints().iter().map(|joint| joint.joint.name.clone()).collect()
}

/// The record of a grasp that was followed through a scene.
fn recorded(
    scene: &LoadedScene,
    body: usize,
    [run, rank, direction]: [u32; 3],
    object_from_base: &IsometryMatrix3<f64>,
    ways: BothWays<Passage>,
    closed: Option<&ClosedGrasp>,
) -> PickCandidate {
    let world_from_base = scene.surroundings.objects[body].scene_from_obstacle * object_from_base;
    PickCandidate {
        run,
        rank,
        direction,
        world_from_base: Pose::from_isometry(world_from_base),
        ways: ways.map(|passage| recorded_passage(&passage)),
        // It was closed where one way is free up to there.
        closed: closed
            .filter(|_| ways.shaped.blocked.is_none() || ways.opened.blocked.is_none())
            .map(|closed| closed.joints.clone())
            .unwrap_or_default(),
    }
}

fn recorded_passage(passage: &Passage) -> PickPassage {
    let obstacle = |by: PathObstacle| match by {
        PathObstacle::Ground => PickObstacle::Ground,
        PathObstacle::Container => PickObstacle::Container,
        PathObstacle::Target => PickObstacle::Own,
        PathObstacle::Neighbour(index) => PickObstacle::Neighbour(index as u32 + 1),
    };
    PickPassage {
        blocked: passage.blocked.map(|(stage, by)| Blocked { stage, by: obstacle(by) }),
        clearance: passage.clearance,
    }
}

impl Producer for PickWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        let tried = self.trials.is_some().then_some(Channel::PICK_TRIALS);
        std::iter::once(Channel::PICK_CANDIDATES).chain(tried).collect()
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
            let grasps = job.grasps.grasps_of(*object).len() * job.settings.rolls as usize;
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
