//! The producer of heatmaps for one thread.

use std::{iter, sync::Arc};

use super::{
    grasps::{MarkedHand, SceneGrasps},
    meshes::{LoadedMeshes, StillMeshes},
    settings::HeatmapJob,
};
use crate::{
    ProduceError, SampleWriter,
    products::{
        patches::PALM,
        picked::ScenePicks,
        viewed::{ViewedScene, changed_view, redraw},
    },
    work::Producer,
};
use format::{
    Channel, Depth, DepthCoding, HeatmapFacts, SceneHeatmap, SceneImage,
    dataset::{DatasetReader, Sample},
};
use kernel::{
    cancel::Cancel,
    geom::{DepthCrop, Intrinsics, Pose, RenderMesh, SimdLevel},
    ids::{ItemId, ObjectId, SampleId},
    render::LayeredImage,
};

/// Reason of an image whose view was rejected.
const NO_VIEW: &str = "no_view";

/// Parts that all threads share.
pub(super) struct Shared<'j> {
    pub job: &'j HeatmapJob,
    pub level: SimdLevel,
    /// The dataset of views.
    pub views: DatasetReader,
    /// The dataset of picks.
    pub picks: DatasetReader,
    pub meshes: LoadedMeshes,
    pub marked: MarkedHand,
}

/// The producer of one thread; its memory is reused from image to image.
pub struct HeatmapWorker<'s> {
    shared: &'s Shared<'s>,
    /// Index of the last requested scene.
    scene: usize,
    /// Index of the scene whose grasps these are, and the grasps.
    grasps: Option<(usize, SceneGrasps)>,
    /// Container and table of the scene that was drawn last.
    still: Option<StillMeshes>,
    image: LayeredImage,
    depth: DepthCrop,
    record: SceneHeatmap,
}

impl<'s> HeatmapWorker<'s> {
    /// A producer for one thread.
    pub(super) fn new(shared: &'s Shared<'s>) -> Self {
        let HeatmapJob { views, picks, hand, types, settings, .. } = shared.job;
        let camera = Intrinsics { width: 1, height: 1, fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, near: 0.01 };
        let names = iter::once(PALM.to_owned()).chain(settings.tips.iter().cloned());
        let record = SceneHeatmap {
            sample: SampleId::of_object(views.scenes[0].id, ItemId(0)),
            picks: picks.root,
            trials: picks.trials,
            hand: shared.marked.hand.hand().name().to_owned(),
            hand_id: hand.id,
            names: names.collect(),
            types: types.clone(),
            label: settings.label,
            angle: settings.max_angle,
            camera,
            world_from_camera: Pose::identity(),
            side: settings.side,
            size: settings.size,
            evaluated: Vec::new(),
            other_types: 0,
            grasps: Vec::new(),
            forbidden: Vec::new(),
        };
        let image = LayeredImage::new(camera, shared.level);
        Self { shared, scene: 0, grasps: None, still: None, image, depth: DepthCrop::default(), record }
    }

    /// Draws the depth of a view again.
    fn draw(&mut self, stored: &Sample, view: &SceneImage) -> Result<(), ProduceError> {
        let SceneImage { container, table, .. } = view;
        self.still.take_if(|still| !still.is_of(container, *table));
        let still = self.still.get_or_insert_with(|| StillMeshes::new(container, *table));
        let bodies = view.bodies.iter().map(|body| self.shared.meshes.get(body.object));
        let bodies: Vec<Arc<RenderMesh>> = bodies.collect::<Result<_, _>>()?;
        let around = (still.container.as_ref(), &still.table);
        let drawn = redraw(&mut self.image, view, bodies.iter().map(|mesh| &**mesh), around, &mut self.depth);
        if drawn { Ok(()) } else { Err(changed_view(stored, "its scene, drawn again, is another picture")) }
    }

    /// Reads the grasps of a scene with these bodies, unless they are loaded.
    fn load_grasps(&mut self, scene: ObjectId, view: &SceneImage) -> Result<(), ProduceError> {
        if self.grasps.as_ref().is_none_or(|(loaded, _)| *loaded != self.scene) {
            let objects: Vec<ObjectId> = view.bodies.iter().map(|body| body.object).collect();
            let picks = ScenePicks::read(&self.shared.picks, scene, &objects)?;
            self.grasps = Some((self.scene, SceneGrasps::new(&picks, &self.shared.marked)));
        }
        Ok(())
    }
}

impl Producer for HeatmapWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        vec![Channel::HEATMAP_GRASPS, Channel::HEATMAP_DEPTH]
    }

    fn load(&mut self, subject: usize, _: &Cancel) -> Result<(), ProduceError> {
        self.scene = subject;
        Ok(())
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let Shared { job, views, .. } = self.shared;
        let ViewedScene { id, cameras, .. } = &job.views.scenes[self.scene];
        let sample = SampleId { camera: cameras[item.0 as usize], ..SampleId::of_object(*id, item) };
        let Some(stored) = views.sample_of(&sample)? else {
            return out.reject(sample, HeatmapFacts::default(), NO_VIEW, "the view of its scene was rejected");
        };
        let view = stored.read::<SceneImage>()?;
        self.load_grasps(*id, &view)?;
        self.draw(&stored, &view)?;
        let Self { grasps, depth, record, .. } = self;
        (record.sample, record.camera, record.world_from_camera) = (sample, view.camera, view.world_from_camera);
        let (_, grasps) = grasps.as_ref().expect("they were loaded");
        grasps.mark(&job.settings, depth, record);
        if let Some(payload) = out.payload(Channel::HEATMAP_GRASPS) {
            record.encode(payload);
        }
        if let Some(payload) = out.payload(Channel::HEATMAP_DEPTH) {
            let coding = match job.settings.depth_step {
                0.0 => DepthCoding::F32,
                step => DepthCoding::U16 { step },
            };
            Depth::encode_parts(&sample, depth, coding, payload);
        }
        out.keep(sample, HeatmapFacts::from_heatmap(record))
    }
}
