//! Rows of a heatmap of a scene: grasps, their points and patches, and the grasps that are not free.

use nalgebra::Point3;

use crate::products::{
    patches::{is_visible, pixel_in_image, projection},
    picks::PickState,
};
use kernel::geom::{CameraCv, HandBase, Intrinsics, Pose, World};

/// A free grasp of one of the chosen types.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenGrasp {
    /// Number of the body, from 1.
    pub body: u32,
    /// Index of the candidate in the body's sample of picks.
    pub candidate: u32,
    /// Number of the run of the stored grasp.
    pub run: u32,
    /// Index of the stored grasp in its run.
    pub rank: u32,
    /// Number of its direction; 0 is the stored grasp.
    pub direction: u32,
    /// Index of its type among the chosen types; 0 for a hand without types.
    pub type_index: u32,
    /// State by trials.
    pub state: PickState,
    /// The label; lower is better.
    pub value: f32,
    /// The hand's base where it closes.
    pub world_from_base: Pose<World, HandBase>,
    /// Palm and fingertips of the closed hand.
    pub points: Vec<ProjectedPoint>,
    /// The patch around each point; empty if a square of one of them extends beyond the image.
    pub patches: Vec<PatchSquare>,
}

/// A point of a hand in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedPoint {
    /// Where it is, in `World` [m].
    pub point: [f64; 3],
    /// Projection [px], inside the image or not; `None` if nearer than the camera's near limit.
    pub pixel: Option<[f64; 2]>,
    /// Depth of the image in its pixel [m], NaN = no return, or outside the image.
    pub surface: f32,
    /// Whether it is in the image, and nothing is in front of it.
    pub visible: bool,
}

/// The patch around a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PatchSquare {
    /// The left and top pixel of the patch in pixels of the image.
    pub corner: [u32; 2],
    /// Side [px] and left and top pixel of the square of one size in metres; zeros without one.
    pub window: u32,
    /// The left and top pixel of that square.
    pub window_corner: [u32; 2],
}

/// A grasp that is not free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForbiddenGrasp {
    /// Number of the body, from 1.
    pub body: u32,
    /// Index of the candidate in the body's sample of picks.
    pub candidate: u32,
    /// Number of its obstacle ([`PickObstacle::number`](crate::PickObstacle::number)).
    pub obstacle: u8,
    /// Projection of the palm [px], inside the image or not; `None` if nearer than the camera's near limit.
    pub pixel: Option<[f64; 2]>,
}

impl ProjectedPoint {
    /// A point as a camera sees it; `surface` gives the depth of the image in a pixel [m].
    pub fn new(
        point: Point3<f64>,
        camera: &Intrinsics,
        camera_from_world: &Pose<CameraCv, World>,
        surface: impl Fn([u32; 2]) -> f32,
    ) -> Self {
        let seen = camera_from_world.point(&point);
        let pixel = projection(camera, &seen);
        let mut own = Self { point: point.coords.into(), pixel, surface: f32::NAN, visible: false };
        if let Some(at) = own.pixel_in(camera) {
            own.surface = surface(at);
            own.visible = is_visible(seen.z, own.surface);
        }
        own
    }

    /// Whether it is in the image of a camera.
    pub fn is_in(&self, camera: &Intrinsics) -> bool {
        self.pixel_in(camera).is_some()
    }

    /// Column and row of the pixel that holds it; `None` outside the image.
    pub fn pixel_in(&self, camera: &Intrinsics) -> Option<[u32; 2]> {
        self.pixel.and_then(|pixel| pixel_in_image(camera, pixel))
    }
}

impl ForbiddenGrasp {
    /// Column and row of the pixel that holds the palm; `None` outside the image.
    pub fn pixel_in(&self, camera: &Intrinsics) -> Option<[u32; 2]> {
        self.pixel.and_then(|pixel| pixel_in_image(camera, pixel))
    }
}
