//! The producer of views for one thread.

use std::{collections::BTreeMap, sync::Arc};

use super::{
    cameras::world_from_camera,
    colour::ColourView,
    image::{ImageMaker, SceneMeshes, most_seen, sees_enough},
    loaded::LoadedMeshes,
    settings::{Aim, ViewJob, ViewPlacement},
};
use crate::{ProduceError, SampleWriter, work::Producer};
use format::{Channel, Depth, DepthCoding, ViewFacts};
use kernel::{
    cancel::Cancel,
    geom::SimdLevel,
    ids::{ItemId, ObjectId, SampleId},
    seed::Stream,
};
use nalgebra::Point3;

/// Draws of a camera, at most.
const MAX_DRAWS: u32 = 100;

/// Reason of a view whose camera is inside or next to something.
const CAMERA_BLOCKED: &str = "camera_blocked";

/// Reason of a view that sees too little of every body.
const NOTHING_SEEN: &str = "nothing_seen";

/// Parts that all threads share.
pub(super) struct Shared<'j> {
    pub job: &'j ViewJob,
    pub seed: u64,
    pub level: SimdLevel,
    /// Index of each object in the job.
    pub objects: BTreeMap<ObjectId, usize>,
    pub meshes: LoadedMeshes,
}

/// The producer of one thread.
pub struct ViewWorker<'s> {
    shared: &'s Shared<'s>,
    maker: ImageMaker,
    /// With colours.
    colours: Option<ColourView>,
    /// Index of the scene that was loaded last, and its meshes.
    loaded: Option<(usize, SceneMeshes)>,
}

impl<'s> ViewWorker<'s> {
    /// A producer for one thread.
    pub(super) fn new(shared: &'s Shared<'s>) -> Self {
        let ViewJob { scenes, settings, .. } = shared.job;
        let (camera, scene) = (settings.cameras[0].intrinsics, &scenes.list[0]);
        let maker = ImageMaker::new(camera, settings.table, scene, shared.level);
        Self { shared, maker, colours: settings.colour.map(ColourView::new), loaded: None }
    }

    fn make(
        &mut self,
        index: usize,
        meshes: &SceneMeshes,
        item: ItemId,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        let Self { shared: Shared { job, seed, level, .. }, maker, colours, .. } = self;
        let (scene, settings) = (&job.scenes.list[index], &job.settings);
        let (number, camera, view) = settings.camera_of(item.0);
        let sample = SampleId { camera: number, ..SampleId::of_object(scene.id, item) };
        // Keyed by camera and view, so that one more camera changes no draw of the others.
        let key = SampleId { item: ItemId(view), ..sample };
        let mut stream = Stream::of_sample(*seed, &key, "view camera");
        let (aim, draws) = match camera.placement {
            ViewPlacement::Shell { aim: Aim::Bodies, .. } => (meshes.middle(scene), MAX_DRAWS),
            ViewPlacement::Shell { aim: Aim::Origin, .. } => (Point3::origin(), MAX_DRAWS),
            ViewPlacement::Overhead(_) | ViewPlacement::Poses(_) => (Point3::origin(), 1),
        };
        let (mut near_draws, mut unseen_draws, mut last) = (0, 0, NOTHING_SEEN);
        let found = (0..draws).any(|_| {
            let pose = world_from_camera(&camera.placement, view, &aim, &mut stream);
            if meshes.is_near(scene, &Point3::from(*pose.translation()), settings.clearance, *level) {
                (near_draws, last) = (near_draws + 1, CAMERA_BLOCKED);
                return false;
            }
            maker.render(scene, meshes, &camera.intrinsics, &pose);
            let sees = sees_enough(&maker.record, settings);
            if !sees {
                (unseen_draws, last) = (unseen_draws + 1, NOTHING_SEEN);
            }
            sees
        });
        if !found {
            let facts = ViewFacts { near_draws, unseen_draws, ..ViewFacts::default() };
            let detail = match last {
                CAMERA_BLOCKED => format!("of {draws} cameras {near_draws} were inside or next to something"),
                _ => {
                    let most = most_seen(&maker.record);
                    format!(
                        "of {draws} cameras {unseen_draws} saw too little, the last {most} px of {}",
                        settings.min_pixels
                    )
                }
            };
            return out.reject(sample, facts, last, &detail);
        }
        if let Some(sensor) = &settings.sensor {
            maker.measure(sensor, &mut Stream::of_sample(*seed, &key, "view sensor"));
        }
        let record = &mut maker.record;
        (record.sample, record.near_draws, record.unseen_draws) = (sample, near_draws, unseen_draws);
        if let Some(payload) = out.payload(Channel::VIEW_IMAGE) {
            record.encode(payload);
        }
        if let Some(payload) = out.payload(Channel::VIEW_DEPTH) {
            let coding = match settings.depth_step {
                0.0 => DepthCoding::F32,
                step => DepthCoding::U16 { step },
            };
            Depth::encode_parts(&sample, &maker.depth, coding, payload);
        }
        if let (Some(colours), Some(payload)) = (colours, out.payload(Channel::VIEW_COLOUR)) {
            colours.render(&maker.record, &mut Stream::of_sample(*seed, &key, "view colours"))?.encode(payload);
        }
        out.keep(sample, maker.record.facts())
    }
}

impl Producer for ViewWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        let colour = self.colours.is_some().then_some(Channel::VIEW_COLOUR);
        [Channel::VIEW_IMAGE, Channel::VIEW_DEPTH].into_iter().chain(colour).collect()
    }

    fn load(&mut self, subject: usize, _: &Cancel) -> Result<(), ProduceError> {
        if self.loaded.as_ref().is_some_and(|(index, _)| *index == subject) {
            return Ok(());
        }
        let Shared { job, objects, meshes: loaded, .. } = self.shared;
        let scene = &job.scenes.list[subject];
        let bodies: Result<Vec<Arc<_>>, ProduceError> =
            scene.bodies.iter().map(|(object, _)| loaded.get(&job.objects, objects[object])).collect();
        let meshes = SceneMeshes::new(bodies?, &scene.container, job.settings.table);
        if let Some(colours) = &mut self.colours {
            colours.use_scene(scene, &meshes)?;
        }
        self.loaded = Some((subject, meshes));
        Ok(())
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let (index, meshes) = self.loaded.take().expect("a scene is loaded before its views are made");
        let made = self.make(index, &meshes, item, out);
        self.loaded = Some((index, meshes));
        made
    }
}
