//! A resolved job for views as keys of a job file.

use std::path::Path;

use super::{
    settings::{Aim, ViewCamera, ViewJob, ViewPlacement, ViewSettings},
    spec::{AimSpec, ImagesSpec, OverheadSpec, ShellSpec, ViewCameraSpec, ViewsSpec},
};
use crate::{
    products::appearance::RenderSpec,
    sections::{keys_of, relative_to, spec::SensorSpec, with_slashes, without},
};

impl ViewJob {
    /// Keys of the job file other than shards. With a folder the dataset is named relative to it, otherwise by content
    /// alone.
    pub(super) fn keys(&self, folder: Option<&Path>) -> toml::Table {
        let ViewSettings { cameras, clearance, min_pixels, table, depth_step, sensor, colour } = &self.settings;
        let mut spec = ViewsSpec::standard();
        spec.scenes.dataset = folder.map(|folder| with_slashes(&relative_to(&self.dataset, folder)).into());
        spec.scenes.root = Some(self.scenes.root.hex());
        spec.views = ImagesSpec {
            cameras: cameras.iter().map(camera_spec).collect(),
            clearance: *clearance,
            min_pixels: *min_pixels,
            table: *table,
            depth_step: *depth_step,
        };
        if let Some(sensor) = sensor {
            spec.sensor = SensorSpec::from_model(sensor);
        }
        spec.render = RenderSpec::of(*colour);
        // A job without colours is named as it was before there were any.
        let idle = colour.is_none().then_some("render");
        let idle: Vec<&str> = ["shards"].into_iter().chain(idle).collect();
        without(keys_of(&spec), &idle)
    }
}

fn camera_spec(camera: &ViewCamera) -> ViewCameraSpec {
    let ViewCamera { intrinsics, placement, views } = camera;
    let mut spec = ViewCameraSpec {
        width: Some(intrinsics.width),
        height: Some(intrinsics.height),
        fx: Some(intrinsics.fx),
        fy: Some(intrinsics.fy),
        cx: Some(intrinsics.cx),
        cy: Some(intrinsics.cy),
        near: Some(intrinsics.near),
        ..ViewCameraSpec::default()
    };
    match placement {
        ViewPlacement::Shell { radius, polar_deg, roll_deg, aim } => {
            let aim = match aim {
                Aim::Bodies => AimSpec::Bodies,
                Aim::Origin => AimSpec::Origin,
            };
            let (roll_deg, aim) = (Some(*roll_deg), Some(aim));
            spec.shell = Some(ShellSpec { radius: *radius, polar_deg: *polar_deg, roll_deg, aim });
            spec.views = Some(*views);
        }
        ViewPlacement::Overhead(height) => spec.overhead = Some(OverheadSpec { height: *height }),
        ViewPlacement::Poses(poses) => spec.poses = Some(poses.clone()),
    }
    spec
}
