//! A job for views, checked, with everything that it takes from the dataset of scenes but the meshes.

use std::path::PathBuf;

use crate::{
    products::{appearance::Colours, settled::FoundScenes},
    sections::JobObjects,
};
use kernel::{
    geom::{CameraCv, Intrinsics, Pose, World},
    render::SensorModel,
};

/// Scenes, objects and settings of a job for views.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewJob {
    /// The folder of the dataset of scenes.
    pub dataset: PathBuf,
    /// Scenes of that dataset.
    pub scenes: FoundScenes,
    /// Objects of that dataset, by its own job.
    pub objects: JobObjects,
    /// Settings of the images.
    pub settings: ViewSettings,
}

/// Settings of the images of scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewSettings {
    /// The cameras.
    pub cameras: Vec<ViewCamera>,
    /// Nothing is nearer to a camera than this [m].
    pub clearance: f64,
    /// Some body is visible in this number of pixels.
    pub min_pixels: u32,
    /// Sides of the table along x and y [m].
    pub table: [f64; 2],
    /// Step of stored depth [m]; 0: floats.
    pub depth_step: f64,
    /// The sensor; `None` for a perfect one.
    pub sensor: Option<SensorModel>,
    /// Colours in addition to depth; `None` without.
    pub colour: Option<Colours>,
}

/// A camera, and its poses.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewCamera {
    /// The camera.
    pub intrinsics: Intrinsics,
    /// Rule of its poses.
    pub placement: ViewPlacement,
    /// Views of each scene.
    pub views: u32,
}

/// Rule of a camera's poses.
#[derive(Clone, Debug, PartialEq)]
pub enum ViewPlacement {
    /// Drawn on a shell around a point.
    Shell {
        /// Distance from the point [m], from and to.
        radius: [f64; 2],
        /// Angle from straight above [deg], from and to.
        polar_deg: [f64; 2],
        /// Rotation about the optical axis [deg], from and to.
        roll_deg: [f64; 2],
        /// The point.
        aim: Aim,
    },
    /// Straight down from this height [m].
    Overhead(f64),
    /// One pose after the other: x, y, z [m], qw, qx, qy, qz.
    Poses(Vec<[f64; 7]>),
}

/// A point at which cameras point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// The mean of the centres of the bodies' boxes.
    Bodies,
    /// The world's origin.
    Origin,
}

impl ViewSettings {
    /// Views of each scene.
    pub fn views(&self) -> u32 {
        self.cameras.iter().map(|camera| camera.views).sum()
    }

    /// The camera that makes a view of a scene, with its index, and the number of the view among those of the camera.
    ///
    /// # Panics
    /// When there are fewer views.
    pub fn camera_of(&self, mut view: u32) -> (u32, &ViewCamera, u32) {
        for (index, camera) in (0..).zip(&self.cameras) {
            if view < camera.views {
                return (index, camera, view);
            }
            view -= camera.views;
        }
        panic!("a view past the last camera")
    }
}

/// The pose of a rigid body from position and quaternion of unit length.
pub(super) fn pose_of([x, y, z, qw, qx, qy, qz]: &[f64; 7]) -> Pose<World, CameraCv> {
    Pose::new(kernel::geom::rotation_from_quaternion([*qw, *qx, *qy, *qz]), nalgebra::Vector3::new(*x, *y, *z))
}
