//! The occluder in front of the object in one view, and the depth image that is left.

use super::settings::CompletionSettings;
use format::Occlusion;
use kernel::{
    geom::DepthCrop,
    ids::SampleId,
    render::{Occluder, OccluderKind, Rasteriser, SensorModel, SensorScratch},
    seed::Stream,
};

/// The occluder of the view that was made last.
#[derive(Default)]
pub(super) struct ViewOcclusion {
    /// The occluder; `None` without one.
    occluder: Option<Occluder>,
    /// Depth at which each line of sight ends, where there is an occluder.
    sight: DepthCrop,
}

impl ViewOcclusion {
    /// Draws the occluder in front of the object, if the job has occlusion.
    pub(super) fn draw(
        &mut self,
        settings: &CompletionSettings,
        rasteriser: &mut Rasteriser,
        object: &DepthCrop,
        stream: impl FnOnce() -> Stream,
    ) {
        let model = settings.occlusion.as_ref();
        self.occluder = model.and_then(|model| model.draw(rasteriser, &settings.camera, object, &mut stream()));
    }

    /// The occluder of an occluded view.
    pub(super) fn occluder(&self) -> Option<&Occluder> {
        self.occluder.as_ref()
    }

    /// Depth at which each line of sight ends: `crop` itself without an occluder.
    pub(super) fn sight<'a>(&'a self, crop: &'a DepthCrop) -> &'a DepthCrop {
        if self.occluder.is_some() { &self.sight } else { crop }
    }

    /// From a perfect depth image of the object alone to what the camera measures of it. The sensor sees the occluder
    /// too, whose shadow and edges fall on the object; then what is nearer than half way to the object is removed.
    pub(super) fn measure(
        &mut self,
        settings: &CompletionSettings,
        scratch: &mut SensorScratch,
        crop: &mut DepthCrop,
        stream: impl FnOnce() -> Stream,
    ) {
        let camera = &settings.camera;
        let Some(occluder) = &self.occluder else {
            if let Some(sensor) = &settings.sensor {
                sensor.apply_with(scratch, camera, crop, &mut stream());
            }
            return;
        };
        let farthest = crop.depth.iter().fold(0.0_f32, |far, depth| far.max(*depth));
        let reach = |sensor: &SensorModel| sensor.reach(camera, occluder.nearest, f64::from(farthest));
        let mut scene = occluder.scene(camera, crop, settings.sensor.as_ref().map_or(0, reach));
        if let Some(sensor) = &settings.sensor {
            sensor.apply_with(scratch, camera, &mut scene, &mut stream());
        }
        *crop = occluder.without_occluder(&scene);
        self.sight = occluder.sight(&scene);
    }

    /// The record of the view.
    pub(super) fn record(&self, sample: SampleId) -> Occlusion {
        let mut record = Occlusion::none(sample);
        if let Some(occluder) = &self.occluder {
            record.kind = match occluder.kind {
                OccluderKind::Neighbour => Occlusion::KINDS[1],
                OccluderKind::HalfSpace => Occlusion::KINDS[2],
            };
            (record.object_pixels, record.hidden_pixels) = (occluder.object_pixels, occluder.hidden_pixels);
            record.corners.clone_from(&occluder.corners);
            record.mask.set(&occluder.depth);
        }
        record
    }
}
