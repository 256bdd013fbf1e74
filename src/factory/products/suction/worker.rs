//! The producer of suction for one thread.

use std::{collections::BTreeMap, sync::Arc};

use nalgebra::Point3;

use super::{
    loaded::{LoadedObject, LoadedObjects, LoadedScene},
    record::recorded,
    settings::SuctionJob,
};
use crate::{ProduceError, SampleWriter, work::Producer};
use format::{Channel, PickCandidates, Scene, SceneContainer, SuctionFacts, dataset::DatasetReader};
use kernel::{
    cancel::Cancel,
    geom::SimdLevel,
    ids::{ItemId, ObjectId, SampleId},
    seed::Stream,
};
use robot::{
    grasp::{Passage, SceneObstacle},
    suction::{SampledSuction, SampledSuctions, SuctionSampler, SuctionTarget},
};

const _: () = assert!(Passage::FAR == PickCandidates::FAR, "clearances are stored as far as they are computed");

/// Parts that all threads share.
pub(super) struct Shared<'j> {
    pub job: &'j SuctionJob,
    pub seed: u64,
    pub level: SimdLevel,
    /// The dataset of scenes.
    pub scenes: DatasetReader,
    /// Walls of the containers of the scenes.
    pub containers: Vec<(SceneContainer, Option<SceneObstacle>)>,
    /// Index of each object in the job.
    pub objects: BTreeMap<ObjectId, usize>,
    pub loaded: LoadedObjects,
}

/// The producer of one thread.
pub struct SuctionWorker<'s> {
    shared: &'s Shared<'s>,
    sampler: SuctionSampler,
    /// The scene that was loaded last.
    scene: Option<LoadedScene>,
}

impl<'s> SuctionWorker<'s> {
    /// A producer for one thread.
    pub(super) fn new(shared: &'s Shared<'s>) -> Self {
        let sampler = SuctionSampler::new(&shared.job.cup, shared.job.settings.margin, shared.level);
        Self { shared, sampler, scene: None }
    }

    /// Poses on a body, from the stream `suction poses` of its sample, and their robustness, from the stream `suction errors`.
    fn make(&mut self, scene: &LoadedScene, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let Shared { job, seed, level, .. } = self.shared;
        let sample = SampleId::of_object(job.scenes.list[scene.index].id, item);
        let target = item.0 as usize;
        let body = &scene.record.bodies[target];
        let object_from_world = body.world_from_object.isometry().inverse();
        let target = SuctionTarget {
            scene: &scene.surroundings,
            target,
            points: scene.objects[target].points(body.object, *level),
            mass: body.mass,
            centre: object_from_world * Point3::from(body.centre_of_mass),
        };
        let sampling = job.settings.sampling();
        let mut stream = Stream::of_sample(*seed, &sample, "suction poses");
        let found = self.sampler.sample(&target, &sampling, &mut stream);
        let robustness = self.robustness(&target, &found, &mut Stream::of_sample(*seed, &sample, "suction errors"));
        let record = recorded(job, sample, scene, &target.centre, (&found, &robustness));
        if let Some(payload) = out.payload(Channel::SUCTION_POSES) {
            record.encode(payload);
        }
        out.keep(sample, SuctionFacts::from_poses(&record))
    }

    /// Robustness of each free pose, in order; `None` for the others.
    fn robustness(
        &mut self,
        target: &SuctionTarget<'_>,
        found: &SampledSuctions,
        stream: &mut Stream,
    ) -> Vec<Option<f64>> {
        let settings = &self.shared.job.settings;
        let (sampling, errors) = (settings.sampling(), settings.errors());
        let share = |suction: &SampledSuction| {
            let errors = errors.as_ref().filter(|_| is_free(suction))?;
            Some(self.sampler.robustness(target, &sampling, &suction.object_from_cup, errors, stream))
        };
        found.suctions.iter().map(share).collect()
    }
}

fn is_free(suction: &SampledSuction) -> bool {
    suction.hold.is_some_and(|hold| hold.holds()) && suction.passage.blocked.is_none()
}

impl Producer for SuctionWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        vec![Channel::SUCTION_POSES]
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
        let object = |(object, _): &(ObjectId, _)| loaded.get(&job.objects, objects[object]);
        let bodies: Vec<Arc<LoadedObject>> = scene.bodies.iter().map(object).collect::<Result<_, ProduceError>>()?;
        let (_, walls) = containers.iter().find(|(known, _)| *known == scene.container).ok_or_else(gone)?;
        self.scene = Some(LoadedScene::new(subject, record, bodies, walls.clone()));
        Ok(())
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let scene = self.scene.take().expect("a scene is loaded before poses on its bodies are drawn");
        let made = self.make(&scene, item, out);
        self.scene = Some(scene);
        made
    }
}
