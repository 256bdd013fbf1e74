//! Truth for heatmaps over whole images: all grasps from about one side, as one camera would see them.

use nalgebra::{Point3, Vector3};

use super::{
    hand::PatchHand,
    marks::surface,
    settings::{GraspedObject, PatchJob, PatchSettings},
};
use format::{HeatmapPatch, HeatmapPoint, PATCH_POINTS, PatchHeatmap, is_visible, pixel_in_image, projection};
use kernel::{
    geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose},
    ids::SampleId,
};

/// Heatmap maker of one thread.
pub(super) struct HeatView {
    /// Cosine of the largest angle between an approach and the camera's axis.
    min: f64,
    /// The grasps of the object that was loaded last.
    grasps: Vec<SeenGrasp>,
    record: PatchHeatmap,
    /// Whether each point of the record is visible.
    visible: Vec<bool>,
}

/// A grasp, as far as heatmaps need it; points in `Object` [m].
struct SeenGrasp {
    run: u32,
    rank: u32,
    type_index: u32,
    value: f32,
    /// Index of the resting pose of the object on the grasp's table.
    table: Option<u32>,
    approach: Vector3<f64>,
    points: [Point3<f64>; PATCH_POINTS],
}

impl HeatView {
    /// `angle` [rad]: largest angle between an approach and the camera's axis.
    pub fn new(angle: f64, sample: SampleId, job: &PatchJob) -> Self {
        let Intrinsics { width, height, .. } = job.settings.camera;
        let types = job.grasps.types.chosen.len() as u32;
        let record = PatchHeatmap { sample, width, height, types, angle, points: Vec::new() };
        Self { min: libm::cos(angle), grasps: Vec::new(), record, visible: Vec::new() }
    }

    /// Switches to an object.
    pub fn use_object(&mut self, object: &GraspedObject, job: &PatchJob, hand: &PatchHand) {
        let seen = object.grasps.iter().map(|grasp| SeenGrasp {
            run: grasp.run,
            rank: grasp.rank,
            type_index: job.grasps.types.index_of(grasp.kind).unwrap_or_default() as u32,
            value: job.settings.label_of(grasp),
            table: grasp.table.map(|table| table.pose),
            approach: grasp.object_from_approach.rotation().matrix().column(2).into_owned(),
            points: hand.points(grasp),
        });
        self.grasps.clear();
        self.grasps.extend(seen);
    }

    /// Which points of the last record the image does not hide.
    pub fn visible(&self) -> &[bool] {
        &self.visible
    }

    /// The points in the image of a grasp, the `own` one of the object's.
    pub fn evaluate(
        &mut self,
        patch: &HeatmapPatch,
        own: usize,
        settings: &PatchSettings,
        image: &DepthCrop,
        payload: &mut Vec<u8>,
    ) {
        let (axis, table) = (self.grasps[own].approach, self.grasps[own].table);
        let camera = settings.projection();
        self.record.sample = patch.sample;
        self.record.points.clear();
        self.visible.clear();
        for (index, grasp) in self.grasps.iter().enumerate() {
            // Rounding must not lose the patch's own grasp.
            // Another table is another scene.
            if index != own && (grasp.approach.dot(&axis) < self.min || grasp.table != table) {
                continue;
            }
            for (point, at) in (0..).zip(&grasp.points) {
                if let Some((pixel, depth)) = inside(&camera, &patch.camera_from_object, at) {
                    let SeenGrasp { run, rank, type_index, value, .. } = *grasp;
                    self.visible.push(is_visible(depth, surface(image, pixel)));
                    self.record.points.push(HeatmapPoint { run, rank, type_index, point, pixel, value });
                }
            }
        }
        self.record.encode(payload);
    }
}

/// Where a point is in the image [px], and its depth [m]; `None` outside and before the near plane.
fn inside(camera: &Intrinsics, pose: &Pose<CameraCv, Object>, point: &Point3<f64>) -> Option<([f64; 2], f64)> {
    let seen = pose.point(point);
    let pixel = projection(camera, &seen)?;
    pixel_in_image(camera, pixel).map(|_| (pixel, seen.z))
}
