//! Marks stored with the patches of a grasp: its trials, which points are hidden, and patches of one size in metres.

use super::{
    settings::{ChosenGrasp, GraspTable, PatchSettings},
    viewpoint::corner,
};
use crate::SampleWriter;
use format::{
    Channel, HeatmapPatch, PATCH_POINTS, PatchMetric, PatchTable, PatchTrial, PatchVisibility, is_visible, window_side,
};
use kernel::{geom::DepthCrop, ids::Digest};

/// Marks of one thread; their memory is reused from grasp to grasp.
pub(super) struct PatchMarks {
    /// Digest of the trials, where labels are those of trials.
    trials: Option<Digest>,
    visibility: Option<PatchVisibility>,
    table: Option<PatchTable>,
    metric: Option<PatchMetric>,
}

impl PatchMarks {
    /// The marks that a job makes.
    pub fn new(settings: &PatchSettings, trials: Option<Digest>, record: &HeatmapPatch) -> Self {
        let visibility = || PatchVisibility {
            sample: record.sample,
            surfaces: [f32::NAN; PATCH_POINTS],
            visible: [true; PATCH_POINTS],
            heatmap_visible: Vec::new(),
        };
        let metric = |size| PatchMetric {
            sample: record.sample,
            size,
            side: settings.side,
            windows: [1; PATCH_POINTS],
            corners: [[0; 2]; PATCH_POINTS],
            depth: Vec::new(),
        };
        Self {
            trials,
            visibility: settings.visibility.then(visibility),
            table: None,
            metric: settings.metric.map(metric),
        }
    }

    /// The squares of patches in metres, if the job has them.
    pub fn metric(&self) -> Option<&PatchMetric> {
        self.metric.as_ref()
    }

    /// The table under the object, if it rests on one.
    pub fn table(&self) -> Option<&PatchTable> {
        self.table.as_ref()
    }

    /// Puts the object of some patches on its table; returns the height of the camera above it [m].
    pub fn stand_on(&mut self, table: &GraspTable, patch: &HeatmapPatch) -> f64 {
        let camera_from_table = patch.camera_from_object * table.world_from_object.inverse();
        self.table = Some(PatchTable { sample: patch.sample, resting_pose: table.pose, camera_from_table });
        camera_from_table.inverse().translation().z
    }

    /// Square in metres around a point at this depth [m] and pixel; `None` where it exceeds the image.
    pub fn place(&mut self, index: usize, depth: f64, pixel: [f64; 2], settings: &PatchSettings) -> Option<()> {
        let Some(metric) = &mut self.metric else { return Some(()) };
        let camera = &settings.camera;
        let window = window_side(metric.size, camera.fx, depth);
        metric.corners[index] = [corner(pixel[0], window, camera.width)?, corner(pixel[1], window, camera.height)?];
        metric.windows[index] = window;
        Some(())
    }

    /// Writes the marks of a grasp that the image shows, all but its visible points.
    pub fn write(&mut self, patch: &HeatmapPatch, grasp: &ChosenGrasp, image: &DepthCrop, out: &mut SampleWriter<'_>) {
        if let (Some(trials), Some(end)) = (self.trials, &grasp.trial)
            && let Some(payload) = out.payload(Channel::PATCH_TRIAL)
        {
            let tested = PatchTrial::mask(end.outcome, patch.type_index, patch.types.len());
            let (sample, verdict) = (patch.sample, grasp.verdict);
            PatchTrial { sample, trials, outcome: end.outcome, trial: end.trial, verdict, tested }.encode(payload);
        }
        if let (Some(table), Some(payload)) = (&self.table, out.payload(Channel::PATCH_TABLE)) {
            table.encode(payload);
        }
        if let (Some(metric), Some(payload)) = (&mut self.metric, out.payload(Channel::PATCH_METRIC)) {
            metric.sample = patch.sample;
            metric.depth.clear();
            let side = metric.side;
            for point in 0..PATCH_POINTS {
                for (row, column) in (0..side).flat_map(|row| (0..side).map(move |column| (row, column))) {
                    let [x, y] = metric.pixel(point, column, row);
                    metric.depth.push(image.at(x, y));
                }
            }
            metric.encode(payload);
        }
    }

    /// Writes which points the image hides, `heatmap` for the points of a heatmap; returns how many of the grasp are visible.
    pub fn write_visible(
        &mut self,
        patch: &HeatmapPatch,
        image: &DepthCrop,
        heatmap: &[bool],
        out: &mut SampleWriter<'_>,
    ) -> u32 {
        let Some(visibility) = &mut self.visibility else { return 0 };
        visibility.sample = patch.sample;
        for (index, point) in patch.points.iter().enumerate() {
            let depth = patch.camera_from_object.point(&point.point.into()).z;
            visibility.surfaces[index] = surface(image, point.pixel);
            visibility.visible[index] = is_visible(depth, visibility.surfaces[index]);
        }
        visibility.heatmap_visible.clear();
        visibility.heatmap_visible.extend_from_slice(heatmap);
        if let Some(payload) = out.payload(Channel::PATCH_VISIBILITY) {
            visibility.encode(payload);
        }
        visibility.count()
    }
}

/// Depth of the image in the pixel that holds a projection [m], NaN = no return.
pub(super) fn surface(image: &DepthCrop, pixel: [f64; 2]) -> f32 {
    let [column, row] = pixel.map(|pixel| pixel.floor() as u32);
    image.at(column, row)
}
