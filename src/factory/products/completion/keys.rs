//! A resolved completion job as keys of a job file.

use std::path::Path;

use super::{
    check_occlusion::occlusion_keys,
    settings::{CompletionJob, CompletionSettings, Distance},
    spec::{
        AnglesSpec, CameraSpec, CompletionSpec, DistanceRange, DistanceSpec, EvenViews, FitDistance, GridViews,
        MatrixViews, RotationsSpec,
    },
};
use crate::{
    products::pair::TruthSpec,
    sections::{keys_of, spec::SensorSpec, without},
};
use kernel::geom::ViewSet;

impl CompletionJob {
    /// Keys of the job file other than objects, split and shards. Keys that do not matter have the standard values.
    /// With a folder the hand's file is named relative to it, otherwise by content alone.
    pub(super) fn keys(&self, folder: Option<&Path>) -> toml::Table {
        let spec = spec(&self.settings, folder);
        let keys = without(keys_of(&spec), &["objects", "split", "shards"]);
        if folder.is_some() { keys } else { without(keys, &["touch.hand.model"]) }
    }
}

fn spec(settings: &CompletionSettings, folder: Option<&Path>) -> CompletionSpec {
    let CompletionSettings {
        views,
        views_per_object,
        pivot,
        camera,
        scene: _,
        distance,
        renderer,
        sensor,
        occlusion,
        resolution,
        drop_index_zero,
        solid_with_surface,
        truth,
        gate,
        channels,
        touch,
    } = settings;
    let mut spec = CompletionSpec::standard();
    (spec.views, spec.pivot, spec.renderer) = (views_spec(views, *views_per_object), *pivot, *renderer);
    spec.distance = match *distance {
        Distance::Fixed(distance) => DistanceSpec::Fixed(distance),
        Distance::Range { min, max } => DistanceSpec::Range(DistanceRange { min, max }),
        Distance::Fit { share } => DistanceSpec::Fit(FitDistance { fit: share }),
    };
    spec.camera = CameraSpec {
        preset: None,
        width: camera.width,
        height: camera.height,
        horizontal_fov: None,
        fx: Some(camera.fx),
        fy: Some(camera.fy),
        cx: Some(camera.cx),
        cy: Some(camera.cy),
        near: camera.near,
        scene: None,
        camera: None,
    };
    if let Some(sensor) = sensor {
        spec.sensor = SensorSpec::from_model(sensor);
    }
    spec.occlusion = occlusion.as_ref().map(occlusion_keys);
    (spec.grid.resolution, spec.grid.drop_index_zero) = (*resolution, *drop_index_zero);
    spec.truth = TruthSpec::from_truth(*truth, *solid_with_surface);
    (spec.gate.min_partial_cells, spec.gate.min_overlap) = (gate.min_partial_cells, gate.min_overlap);
    channels.write_keys(&mut spec.channels);
    spec.touch.write(touch, folder);
    spec
}

/// The rotations one by one, or by a rule that a job file can state.
fn views_spec(views: &ViewSet, per_object: bool) -> RotationsSpec {
    match views {
        ViewSet::RollPitchYaw { roll, pitch, yaw } => {
            let [roll, pitch, yaw] = [roll, pitch, yaw].map(|angles| AnglesSpec::List(angles.clone()));
            RotationsSpec::Grid(GridViews { roll, pitch, yaw, unit: None })
        }
        ViewSet::Even { count } => RotationsSpec::Even(EvenViews { even: *count, per_object }),
        ViewSet::List(rotations) => {
            let rows = rotations.iter().map(|rotation| {
                let matrix = rotation.matrix();
                std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
            });
            RotationsSpec::Matrices(MatrixViews { matrices: rows.collect() })
        }
    }
}
