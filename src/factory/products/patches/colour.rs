//! Patches in colour, drawn by MuJoCo.

use std::{f64::consts::PI, sync::Arc};

use nalgebra::{Unit, Vector3};

use super::{resample::area_mean, settings::PatchColours};
use crate::{Cause, ProduceError, SampleWriter};
use format::{Channel, HeatmapPatch, PatchColour, PatchImageColour, PatchMetric, PatchPoint};
use kernel::{geom::TriMesh, seed::Stream};
use sim::{Appearance, Inertia, Light, SimModel, SimWorker, gl_facts};

/// Whether colours can be drawn here.
///
/// # Errors
/// When OpenGL does not work without a window, with the remedy.
pub fn check_colours() -> Result<(), ProduceError> {
    gl_facts().map(drop).map_err(failed)
}

/// Colour renderer of one thread.
pub(super) struct ColourView {
    settings: PatchColours,
    seed: u64,
    /// The object and its renderer: made with the first object, reused for the others.
    worker: Option<Box<SimWorker>>,
    window: Vec<[u8; 3]>,
    record: PatchColour,
    /// The whole image, where the job asks for it.
    image: Option<PatchImageColour>,
}

impl ColourView {
    /// `with_image`: whether whole images are drawn besides the patches.
    pub fn new(settings: PatchColours, with_image: bool, seed: u64, record: &HeatmapPatch) -> Self {
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
        Self { settings, seed, worker: None, window: Vec::new(), record, image }
    }

    /// Switches to an object.
    pub fn use_mesh(&mut self, mesh: &TriMesh) -> Result<(), ProduceError> {
        let model = Arc::new(SimModel::with_lights(mesh, Inertia::Shell).map_err(failed)?);
        self.worker.get_or_insert_with(|| Box::new(SimWorker::new(&model))).use_model(&model);
        Ok(())
    }

    /// Draws the smallest window that holds all patches, in pixels and in metres, and cuts them out.
    pub fn render(
        &mut self,
        patch: &HeatmapPatch,
        metric: Option<&PatchMetric>,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        let worker = self.worker.as_mut().expect("an object is loaded before it is rendered");
        let in_metres = metric.iter().flat_map(|metric| metric.corners.iter().copied().zip(metric.windows));
        let squares = || patch.points.iter().map(|point| (point.corner, patch.side)).chain(in_metres.clone());
        let low = |axis: usize| squares().map(|(corner, _)| corner[axis]).min().unwrap_or(0);
        let high = |axis: usize| squares().map(|(corner, side)| corner[axis] + side).max().unwrap_or(0);
        let (left, top) = (low(0), low(1));
        let (width, height) = (high(0) - left, high(1) - top);
        let appearance = match self.settings.randomise {
            true => random_appearance(&mut Stream::of_sample(self.seed, &patch.sample, "colours")),
            false => Appearance::default(),
        };
        worker
            .gl_colours(
                &patch.camera,
                &patch.camera_from_object,
                [left, top, width, height],
                &appearance,
                &mut self.window,
            )
            .map_err(failed)?;
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
        if let (Some(image), Some(payload)) = (&mut self.image, out.payload(Channel::PATCH_IMAGE_COLOUR)) {
            let whole = [0, 0, patch.camera.width, patch.camera.height];
            worker
                .gl_colours(&patch.camera, &patch.camera_from_object, whole, &appearance, &mut self.window)
                .map_err(failed)?;
            (image.sample, image.background) = (patch.sample, appearance.background);
            image.take(&self.window, patch.camera.width);
            image.encode(payload);
        }
        Ok(())
    }
}

fn failed(cause: impl Into<Cause>) -> ProduceError {
    ProduceError::NoRenderer { renderer: "colours cannot be drawn", cause: cause.into() }
}

/// Lights from above, of any brightness, and colours of object and background.
fn random_appearance(stream: &mut Stream) -> Appearance {
    let mut colour = |low: f64, high: f64| [(); 3].map(|()| stream.uniform(low, high) as f32);
    let object = colour(0.15, 0.95);
    let background = colour(0.0, 255.0).map(|level| level as u8);
    let (ambient, headlight) = (stream.uniform(0.1, 0.4), stream.uniform(0.05, 0.4));
    let mut light = || {
        // Uniform over the directions that point down.
        let (down, turn) = (stream.uniform(0.05, 1.0), stream.uniform(-PI, PI));
        let (sin, cos) = libm::sincos(turn);
        let level = libm::sqrt(1.0 - down * down);
        let brightness = stream.uniform(0.0, 0.6);
        let colour = [(); 3].map(|()| (brightness * stream.uniform(0.85, 1.0)) as f32);
        Light { direction: Unit::new_normalize(Vector3::new(level * cos, level * sin, -down)), colour }
    };
    let lights = [light(), light()];
    Appearance { object, background, ambient: [ambient as f32; 3], headlight: [headlight as f32; 3], lights }
}
