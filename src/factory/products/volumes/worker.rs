//! The producer of volumes for one thread.

use std::sync::Arc;

use super::{
    grasps::OpenGrasps,
    images::SceneImages,
    scene::fill_truth,
    settings::{VolumeJob, VolumeSettings},
};
use crate::{
    ProduceError, SampleWriter,
    products::viewed::{ViewMeshes, ViewedScene},
    recent::Recent,
    work::Producer,
};
use assets::object::PreparedObject;
use format::{Channel, FusedView, SceneVolume, VolumeAffordance, VolumeFacts, VolumeTruth, dataset::DatasetReader};
use kernel::{
    cancel::Cancel,
    ids::{Digest, ItemId, ObjectId, SampleId},
    seed::Stream,
    voxel::VolumeFusion,
};

/// Objects that are kept, at most: about 1 MB each, of meshes with holes 3 MB.
const KEPT: usize = 256;

/// Reason of a scene with fewer kept views than are to be fused.
const FEW_VIEWS: &str = "few_views";

/// Reason of a scene whose container extends beyond the cube.
const CONTAINER_OUTSIDE: &str = "container_outside";

/// Reason of a scene of which no body holds the centre of a voxel.
const NO_BODY_INSIDE: &str = "no_body_inside";

/// Parts that all threads share.
pub(super) struct Shared<'j> {
    job: &'j VolumeJob,
    seed: u64,
    /// The dataset of views.
    views: DatasetReader,
    meshes: ViewMeshes,
    objects: Recent<PreparedObject>,
    /// Grasps that go with each volume, where the job names some.
    grasps: Option<OpenGrasps<'j>>,
}

impl<'j> Shared<'j> {
    /// Views, meshes and grasps of a job.
    pub fn new(
        job: &'j VolumeJob,
        seed: u64,
        (views, meshes): (DatasetReader, ViewMeshes),
        grasps: Option<OpenGrasps<'j>>,
    ) -> Self {
        Self { job, seed, views, meshes, objects: Recent::new(KEPT), grasps }
    }

    /// The kept views of a scene, in order.
    fn kept_views(&self, scene: &ViewedScene) -> Vec<SampleId> {
        let view =
            |(item, camera): (u32, &u32)| SampleId { camera: *camera, ..SampleId::of_object(scene.id, ItemId(item)) };
        let is_kept = |view: &SampleId| self.views.find(view).is_some_and(|index| self.views.is_kept(index));
        (0..).zip(&scene.cameras).map(view).filter(is_kept).collect()
    }
}

/// The producer of one thread; its memory is reused from volume to volume.
pub struct VolumeWorker<'s> {
    shared: &'s Shared<'s>,
    /// Index of the last requested scene.
    scene: usize,
    /// Index of the scene whose truth and kept views these are.
    loaded: Option<usize>,
    /// Reason why none of its volumes is kept, with numbers, if so.
    refusal: Option<(&'static str, String)>,
    kept: Vec<SampleId>,
    images: SceneImages,
    fusion: VolumeFusion,
    volume: SceneVolume,
    truth: VolumeTruth,
    /// Grasps of the loaded scene, where the job names some.
    affordance: Option<VolumeAffordance>,
}

impl<'s> VolumeWorker<'s> {
    /// A producer for one thread.
    pub(super) fn new(shared: &'s Shared<'s>) -> Self {
        let VolumeSettings { grid, truncation_voxels, .. } = shared.job.settings;
        let sample = SampleId::of_object(ObjectId(Digest([0; 32])), ItemId(0));
        let truth = VolumeTruth { sample, resolution: grid.resolution, instances: Vec::new(), bodies: Vec::new() };
        Self {
            shared,
            scene: 0,
            loaded: None,
            refusal: None,
            kept: Vec::new(),
            images: SceneImages::default(),
            fusion: VolumeFusion::new(grid, truncation_voxels),
            volume: SceneVolume::empty(sample, grid, truncation_voxels * grid.voxel()),
            truth,
            affordance: shared.grasps.as_ref().map(|grasps| grasps.empty(sample, grid)),
        }
    }

    /// Loads the requested scene, if another one is loaded: its kept views and its truth, and why none of its volumes
    /// is kept.
    fn take_scene(&mut self) -> Result<(), ProduceError> {
        let Self { shared, scene, truth, images, kept, affordance, .. } = self;
        if self.loaded == Some(*scene) {
            return Ok(());
        }
        let settings = &shared.job.settings;
        self.loaded = None;
        images.clear();
        *kept = shared.kept_views(&shared.job.views.scenes[*scene]);
        let fewest = settings.views[0].max(1);
        self.refusal = if kept.len() < fewest as usize {
            Some((FEW_VIEWS, format!("{} kept views, {fewest} asked", kept.len())))
        } else {
            // Container and bodies have the same pose in every image of the scene.
            let image = images.get(&shared.views, &kept[0])?;
            let object = |id: ObjectId| -> Result<Arc<PreparedObject>, ProduceError> {
                shared.objects.get(shared.meshes.index_of(id)?, || shared.meshes.prepared(id))
            };
            let objects = image.record.bodies.iter().map(|body| object(body.object)).collect::<Result<Vec<_>, _>>()?;
            fill_truth(settings, &image.record, &objects, truth);
            if let (Some(grasps), Some(affordance)) = (&shared.grasps, affordance) {
                let volume_from_world = settings.world_from_volume().inverse();
                grasps.fill(shared.job.views.scenes[*scene].id, &image.record, &volume_from_world, affordance)?;
            }
            let outside = settings.too_small_for(&image.record.container);
            let no_body = || format!("no voxel's centre is in one of {} bodies", truth.bodies.len());
            let empty = (truth.occupied() == 0).then(|| (NO_BODY_INSIDE, no_body()));
            outside.map(|(_, what)| (CONTAINER_OUTSIDE, what)).or(empty)
        };
        self.loaded = Some(*scene);
        Ok(())
    }

    /// Draws the views that a volume fuses, in order.
    fn draw(&self, sample: &SampleId) -> Vec<SampleId> {
        let mut stream = Stream::of_sample(self.shared.seed, sample, "volume images");
        let [fewest, most] = self.shared.job.settings.views;
        let most = most.min(self.kept.len() as u32);
        let count = fewest + stream.below(u64::from(most - fewest) + 1) as u32;
        let mut drawn = self.kept.clone();
        stream.shuffle(&mut drawn);
        drawn.truncate(count as usize);
        drawn.sort_unstable_by_key(|view| view.item);
        drawn
    }
}

impl Producer for VolumeWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        let affordance = self.affordance.as_ref().map(|_| Channel::VOLUME_AFFORDANCE);
        [Channel::VOLUME_FUSION, Channel::VOLUME_TRUTH].into_iter().chain(affordance).collect()
    }

    fn load(&mut self, subject: usize, _: &Cancel) -> Result<(), ProduceError> {
        self.scene = subject;
        Ok(())
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let shared = self.shared;
        let settings = &shared.job.settings;
        let sample = SampleId::of_object(shared.job.views.scenes[self.scene].id, item);
        self.take_scene()?;
        if let Some((reason, detail)) = &self.refusal {
            return out.reject(sample, VolumeFacts::default(), reason, detail);
        }
        let drawn = self.draw(&sample);
        let Self { images, fusion, volume, truth, affordance, .. } = self;
        (volume.sample, truth.sample) = (sample, sample);
        volume.world_from_volume = settings.world_from_volume();
        volume.views.clear();
        fusion.begin(settings.grid, settings.truncation_voxels);
        for view in &drawn {
            let image = images.get(&shared.views, view)?;
            let (intrinsics, world_from_camera) = (image.record.camera, image.record.world_from_camera);
            fusion.add(&image.depth, &intrinsics, &(world_from_camera.inverse() * volume.world_from_volume));
            volume.views.push(FusedView { view: view.item.0, camera: view.camera, intrinsics, world_from_camera });
        }
        fusion.steps(&mut volume.steps);
        volume.weights.clear();
        volume.weights.extend_from_slice(fusion.weights());
        if let Some(payload) = out.payload(Channel::VOLUME_FUSION) {
            volume.encode(payload);
        }
        if let Some(payload) = out.payload(Channel::VOLUME_TRUTH) {
            truth.encode(payload);
        }
        if let Some(affordance) = affordance {
            affordance.sample = sample;
            if let Some(payload) = out.payload(Channel::VOLUME_AFFORDANCE) {
                affordance.encode(payload);
            }
        }
        out.keep(sample, VolumeFacts::from_volume(volume, truth, affordance.as_ref()))
    }
}
