//! The producer of patches for one thread: loads an object's mesh, then renders its grasps one by one.

use nalgebra::Point3;

use super::{
    colour::ColourView,
    hand::PatchHand,
    heat::HeatView,
    marks::PatchMarks,
    settings::{ChosenGrasp, GraspedObject, PatchJob},
    tabletop::Tabletop,
    viewpoint::{camera_from_object, camera_over_table, corner},
};
use crate::{ProduceError, SampleWriter, work::Producer};
use assets::object_id;
use format::{Channel, Depth, DepthCoding, HeatmapPatch, PATCH_POINTS, PatchFacts, PatchPoint, extras::Shapes};
use kernel::{
    cancel::Cancel,
    geom::{DepthCrop, Pose, RenderMesh, SimdLevel},
    ids::{ItemId, SampleId},
    render::Rasteriser,
};

/// Reason why a grasp makes no sample: the patch of this point exceeds the image.
const OUT_OF_FRAME: [&str; PATCH_POINTS] =
    ["palm_out_of_frame", "f0_out_of_frame", "f1_out_of_frame", "f2_out_of_frame"];

/// Reasons why a grasp makes no sample on a table: no table allows it, or the camera would not see its top.
const NO_TABLE: &str = "no_table";
const BELOW_TABLE: &str = "camera_below_table";
/// Lowest camera above a table [m].
const MIN_HEIGHT: f64 = 0.01;

/// The producer of one thread; its memory is reused from grasp to grasp.
pub struct PatchWorker<'j> {
    job: &'j PatchJob,
    hand: &'j PatchHand,
    shapes: &'j Shapes,
    /// The object that was loaded last, by its index in the job.
    loaded: Option<(usize, RenderMesh)>,
    rasteriser: Rasteriser,
    /// The image of the last object on its table.
    on_table: DepthCrop,
    record: HeatmapPatch,
    marks: PatchMarks,
    /// With heatmaps.
    heat: Option<HeatView>,
    /// With colours.
    colours: Option<ColourView>,
}

impl<'j> PatchWorker<'j> {
    /// A producer for one thread.
    pub fn new(job: &'j PatchJob, seed: u64, hand: &'j PatchHand, shapes: &'j Shapes, level: SimdLevel) -> Self {
        let settings = &job.settings;
        let point = |name: &String| PatchPoint { name: name.clone(), point: [0.0; 3], pixel: [0.0; 2], corner: [0; 2] };
        let record = HeatmapPatch {
            sample: SampleId::of_object(job.hand.id, ItemId(0)),
            grasps: job.grasps.root,
            run: 0,
            rank: 0,
            type_index: 0,
            types: job.grasps.types.chosen.clone(),
            energy: 0.0,
            epsilon: 0.0,
            space: job.grasps.space.clone(),
            hand: hand.name().to_owned(),
            hand_id: job.hand.id,
            camera: settings.camera,
            point_focal_length: settings.point_focal_length,
            camera_from_object: Pose::identity(),
            object_from_approach: Pose::identity(),
            points: hand.names().each_ref().map(point),
            side: settings.side,
            depth: Vec::new(),
            label: settings.label.name().to_owned(),
            value: 0.0,
        };
        let rasteriser = Rasteriser::new(level);
        Self {
            colours: settings.colour.map(|colour| ColourView::new(colour, settings.image, (seed, level), &record)),
            marks: PatchMarks::new(settings, job.grasps.trials, &record),
            heat: settings.heatmap_angle.map(|angle| HeatView::new(angle, record.sample, job)),
            job,
            hand,
            shapes,
            loaded: None,
            rasteriser,
            on_table: DepthCrop::default(),
            record,
        }
    }

    fn prepare(&mut self, index: usize) -> Result<RenderMesh, ProduceError> {
        let object = &self.job.grasps.objects[index];
        let unusable = |problem: String| ProduceError::unusable(&object.name, problem);
        // Objects of the job are sorted by content, as those of the shapes are.
        if index >= self.shapes.objects() {
            return Err(unusable(format!("shapes.mcap of the grasps has {} objects", self.shapes.objects())));
        }
        let mesh = self.shapes.object(index)?.mesh;
        let (found, expected) = (object_id(&mesh), object.id);
        if found != expected {
            return Err(ProduceError::Changed { name: object.name.clone(), found, expected });
        }
        if object.grasps.iter().any(|grasp| grasp.joints.len() != self.hand.joints()) {
            return Err(unusable(format!("its grasps are not of a hand with {} joints", self.hand.joints())));
        }
        if let Some(colours) = &mut self.colours {
            colours.use_mesh(&mesh, self.job.settings.table)?;
        }
        if let Some(heat) = &mut self.heat {
            heat.use_object(object, self.job, self.hand);
        }
        // Both sides of a face are visible: it is not known here whether the mesh is closed.
        Ok(RenderMesh::new(&mesh, false))
    }

    /// Fills the record except for depth; `Err` is why there is none.
    fn fill(
        &mut self,
        object: &GraspedObject,
        view: ItemId,
        middle: &Point3<f64>,
    ) -> Result<(), (&'static str, String)> {
        let settings = &self.job.settings;
        let grasp = &object.grasps[view.0 as usize];
        let record = &mut self.record;
        record.sample = SampleId::of_object(object.id, view);
        (record.run, record.rank) = (grasp.run, grasp.rank);
        record.type_index = self.job.grasps.types.index_of(grasp.kind).unwrap_or_default() as u32;
        (record.energy, record.epsilon) = (grasp.energy, grasp.epsilon);
        record.value = settings.label_of(grasp);
        record.object_from_approach = grasp.object_from_approach;
        let approach = &grasp.object_from_approach;
        let pose = match grasp.table {
            Some(table) => camera_over_table(approach, &table.world_from_object, middle, settings.distance),
            None => camera_from_object(approach, middle, settings.distance),
        };
        record.camera_from_object = pose;
        if settings.table {
            let because =
                || (NO_TABLE, "the hand comes below the table in every resting pose of the object".to_owned());
            let height = self.marks.stand_on(&grasp.table.ok_or_else(because)?, record);
            if height <= MIN_HEIGHT {
                return Err((BELOW_TABLE, format!("{height:.3} m above the table")));
            }
        }
        let points = self.hand.points(grasp);
        let projection = settings.projection();
        for (index, (point, record)) in points.iter().zip(&mut record.points).enumerate() {
            let seen = pose.point(point);
            if seen.z < settings.camera.near {
                return Err((OUT_OF_FRAME[index], format!("{:.3} m before the camera", seen.z)));
            }
            let (u, v) = projection.project(&seen);
            let corners =
                (corner(u, settings.side, settings.camera.width), corner(v, settings.side, settings.camera.height));
            let placed = self.marks.place(index, seen.z, [u, v], settings);
            let (Some(left), Some(top), Some(())) = (corners.0, corners.1, placed) else {
                return Err((OUT_OF_FRAME[index], format!("at ({u:.1}, {v:.1}) px")));
            };
            (record.point, record.pixel, record.corner) = (point.coords.into(), [u, v], [left, top]);
        }
        Ok(())
    }

    /// The depth of the patches, cut from the image.
    fn render(&mut self, mesh: &RenderMesh, image: Option<&mut Vec<u8>>) {
        let record = &mut self.record;
        let alone = self.rasteriser.render(mesh, &record.camera, &record.camera_from_object);
        let crop = match self.marks.table() {
            Some(table) => {
                Tabletop::new(table, &record.camera).put_under(alone, &mut self.on_table);
                &self.on_table
            }
            None => alone,
        };
        record.depth.clear();
        for PatchPoint { corner: [left, top], .. } in &record.points {
            for row in *top..top + record.side {
                record.depth.extend((*left..left + record.side).map(|column| crop.at(column, row)));
            }
        }
        if let Some(image) = image {
            Depth::encode_parts(&record.sample, crop, DepthCoding::F32, image);
        }
    }

    fn make(
        &mut self,
        index: usize,
        mesh: &RenderMesh,
        item: ItemId,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        let object = &self.job.grasps.objects[index];
        if let Err((reason, detail)) = self.fill(object, item, &mesh.centre()) {
            let facts = self.facts(&object.grasps[item.0 as usize]);
            return out.reject(self.record.sample, facts, reason, &detail);
        }
        self.render(mesh, out.payload(Channel::PATCH_IMAGE));
        if let Some(payload) = out.payload(Channel::PATCH) {
            self.record.encode(payload);
        }
        let grasp = &object.grasps[item.0 as usize];
        let image = if self.job.settings.table { &self.on_table } else { self.rasteriser.crop() };
        if let (Some(heat), Some(payload)) = (&mut self.heat, out.payload(Channel::PATCH_HEATMAP)) {
            heat.evaluate(&self.record, item.0 as usize, &self.job.settings, image, payload);
        }
        self.marks.write(&self.record, grasp, image, out);
        let heatmap = self.heat.as_ref().map_or(&[][..], HeatView::visible);
        let visible = self.marks.write_visible(&self.record, image, heatmap, out);
        if let Some(colours) = &mut self.colours {
            colours.render(&self.record, self.marks.metric(), self.marks.table(), out)?;
        }
        out.keep(self.record.sample, PatchFacts { visible, ..self.facts(grasp) })
    }

    fn facts(&self, grasp: &ChosenGrasp) -> PatchFacts {
        PatchFacts {
            kind: grasp.kind,
            type_index: self.record.type_index,
            energy: grasp.energy,
            epsilon: grasp.epsilon,
            outcome: grasp.trial.map(|trial| trial.outcome),
            visible: 0,
        }
    }
}

impl Producer for PatchWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        let settings = &self.job.settings;
        let has_colour = settings.colour.is_some();
        let channels = [
            (Channel::PATCH, true),
            (Channel::PATCH_COLOUR, has_colour),
            (Channel::PATCH_IMAGE, settings.image),
            (Channel::PATCH_IMAGE_COLOUR, has_colour && settings.image),
            (Channel::PATCH_HEATMAP, settings.heatmap_angle.is_some()),
            (Channel::PATCH_TRIAL, self.job.grasps.trials.is_some()),
            (Channel::PATCH_VISIBILITY, settings.visibility),
            (Channel::PATCH_METRIC, settings.metric.is_some()),
            (Channel::PATCH_METRIC_COLOUR, has_colour && settings.metric.is_some()),
            (Channel::PATCH_TABLE, settings.table),
        ];
        channels.into_iter().filter_map(|(channel, is_stored)| is_stored.then_some(channel)).collect()
    }

    fn load(&mut self, subject: usize, _cancel: &Cancel) -> Result<(), ProduceError> {
        if self.loaded.as_ref().is_none_or(|(index, _)| *index != subject) {
            // The memory of the one before goes first.
            self.loaded = None;
            self.loaded = Some((subject, self.prepare(subject)?));
        }
        Ok(())
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let (index, mesh) = self.loaded.take().expect("an object is loaded before its grasps are rendered");
        let made = self.make(index, &mesh, item, out);
        self.loaded = Some((index, mesh));
        made
    }
}
