//! Patches in colour, drawn by MuJoCo.

use std::sync::Arc;

use super::{
    resample::area_mean,
    tabletop::{PaintedTabletop, ShadowCaster, TablePaint, Tabletop},
};
use crate::{
    ProduceError, SampleWriter,
    products::appearance::{Colours, no_renderer, random_appearance},
};
use format::{Channel, HeatmapPatch, PatchColour, PatchImageColour, PatchMetric, PatchPoint, PatchTable};
use kernel::{
    geom::{SimdLevel, TriMesh},
    seed::Stream,
};
use sim::{Appearance, Inertia, SimModel, SimWorker, Window};

/// Colour renderer of one thread.
pub(super) struct ColourView {
    settings: Colours,
    seed: u64,
    level: SimdLevel,
    /// The object as a caster of shadows, where it rests on a table.
    shadow: Option<ShadowCaster>,
    /// Colours behind the object in the window.
    behind: Vec<[u8; 3]>,
    /// The object and its renderer: made with the first object, reused for the others.
    worker: Option<Box<SimWorker>>,
    window: Vec<[u8; 3]>,
    record: PatchColour,
    /// The whole image, if the job stores it.
    image: Option<PatchImageColour>,
}

impl ColourView {
    /// `with_image`: whether whole images are drawn besides the patches.
    pub fn new(settings: Colours, with_image: bool, (seed, level): (u64, SimdLevel), record: &HeatmapPatch) -> Self {
        let image = PatchImageColour {
            sample: record.sample,
            left: 0,
            top: 0,
            width: 0,
            height: 0,
            background: [0; 3],
            rgb: Vec::new(),
        };
        let record = PatchColour { sample: record.sample, side: record.side, rgb: Vec::new() };
        let image = with_image.then_some(image);
        Self {
            settings,
            seed,
            level,
            shadow: None,
            behind: Vec::new(),
            worker: None,
            window: Vec::new(),
            record,
            image,
        }
    }

    /// Switches to an object.
    pub fn use_mesh(&mut self, mesh: &TriMesh, on_table: bool) -> Result<(), ProduceError> {
        self.shadow = on_table.then(|| ShadowCaster::new(mesh, self.level));
        let model = Arc::new(SimModel::with_lights(mesh, Inertia::Shell).map_err(no_renderer)?);
        self.worker.get_or_insert_with(|| Box::new(SimWorker::new(&model))).use_model(&model);
        Ok(())
    }

    /// Draws the smallest window that holds all patches, in pixels and in metres, and cuts them out.
    pub fn render(
        &mut self,
        patch: &HeatmapPatch,
        metric: Option<&PatchMetric>,
        table: Option<&PatchTable>,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        let in_metres = metric.iter().flat_map(|metric| metric.corners.iter().copied().zip(metric.windows));
        let squares = || patch.points.iter().map(|point| (point.corner, patch.side)).chain(in_metres.clone());
        let low = |axis: usize| squares().map(|(corner, _)| corner[axis]).min().unwrap_or(0);
        let high = |axis: usize| squares().map(|(corner, side)| corner[axis] + side).max().unwrap_or(0);
        let (left, top) = (low(0), low(1));
        let (width, height) = (high(0) - left, high(1) - top);
        let mut stream = Stream::of_sample(self.seed, &patch.sample, "colours");
        let mut appearance = match self.settings.randomise {
            true => random_appearance(&mut stream),
            false => Appearance::default(),
        };
        let paint = match self.settings.randomise && table.is_some() {
            true => TablePaint::random(&mut stream),
            false => TablePaint::default(),
        };
        if let Some(table) = table {
            // Lights shine down on the table and everything on it.
            let object_from_table = patch.camera_from_object.inverse() * table.camera_from_table;
            for light in &mut appearance.lights {
                light.direction = object_from_table.rotation() * light.direction;
            }
        }
        self.draw(patch, table, (&appearance, &paint), [left, top, width, height])?;
        self.record.sample = patch.sample;
        self.record.rgb.clear();
        for PatchPoint { corner, .. } in &patch.points {
            for row in corner[1] - top..corner[1] - top + patch.side {
                let first = (row * width + corner[0] - left) as usize;
                self.record.rgb.extend_from_slice(&self.window[first..first + patch.side as usize]);
            }
        }
        if let Some(payload) = out.payload(Channel::PATCH_COLOUR) {
            self.record.encode(payload);
        }
        if let (Some(metric), Some(payload)) = (metric, out.payload(Channel::PATCH_METRIC_COLOUR)) {
            self.record.rgb.clear();
            let side = metric.side;
            for ([x, y], window) in metric.corners.into_iter().zip(metric.windows) {
                let seen = |column, row| self.window[((row + y - top) * width + column + x - left) as usize];
                for (row, column) in (0..side).flat_map(|row| (0..side).map(move |column| (row, column))) {
                    self.record.rgb.push(area_mean([column, row], window, side, seen));
                }
            }
            self.record.encode(payload);
        }
        // Drawn once more: the patches stay what they are without it.
        if self.image.is_some() {
            self.draw(patch, table, (&appearance, &paint), [0, 0, patch.camera.width, patch.camera.height])?;
        }
        if let (Some(image), Some(payload)) = (&mut self.image, out.payload(Channel::PATCH_IMAGE_COLOUR)) {
            (image.sample, image.background) = (patch.sample, appearance.background);
            image.take(&self.window, patch.camera.width);
            image.encode(payload);
        }
        Ok(())
    }

    /// Draws a part of the image: the object before its table and the background.
    fn draw(
        &mut self,
        patch: &HeatmapPatch,
        table: Option<&PatchTable>,
        (appearance, paint): (&Appearance, &TablePaint),
        window: Window,
    ) -> Result<(), ProduceError> {
        let worker = self.worker.as_mut().expect("an object is loaded before it is rendered");
        let (camera, pose) = (&patch.camera, &patch.camera_from_object);
        let (Some(table), Some(shadow)) = (table, &self.shadow) else {
            return worker.gl_colours(camera, pose, window, appearance, &mut self.window).map_err(no_renderer);
        };
        let [left, top, width, height] = window;
        let tabletop = Tabletop::new(table, camera);
        let object_from_table = pose.inverse() * table.camera_from_table;
        let painted = PaintedTabletop { tabletop, object_from_table, appearance, paint, shadow };
        let pixels = (top..top + height).flat_map(|row| (left..left + width).map(move |column| [column, row]));
        self.behind.clear();
        self.behind.extend(pixels.map(|pixel| painted.colour_at(pixel)));
        let behind = |column: u32, row: u32| self.behind[((row - top) * width + column - left) as usize];
        worker.gl_colours_before(camera, pose, window, appearance, &behind, &mut self.window).map_err(no_renderer)
    }
}
