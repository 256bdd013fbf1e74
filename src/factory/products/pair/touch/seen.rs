//! An object's surface as a view has it, with what surrounds it.

use nalgebra::{Point3, Unit, Vector3};

use super::{obstacles::TouchObstacles, surface::TouchSurface};
use kernel::geom::{CameraCv, Object, Pose, Ray, RenderMesh};

/// Surface nearer than this to a contact does not hide it [m]: the triangle itself, and what rounding makes of its
/// neighbours.
const CLEARANCE: f64 = 1e-6;

/// An object's surface as a view has it, with what surrounds it.
pub struct SeenSurface<'a> {
    pub(super) surface: &'a TouchSurface,
    pub(super) render: &'a RenderMesh,
    pub(super) around: &'a TouchObstacles<'a>,
    pub(super) camera_from_object: &'a Pose<CameraCv, Object>,
    pub(super) object_from_camera: Pose<Object, CameraCv>,
}

impl<'a> SeenSurface<'a> {
    /// The surface as a view has it; `render` is the same mesh.
    pub fn new(
        surface: &'a TouchSurface,
        render: &'a RenderMesh,
        camera_from_object: &'a Pose<CameraCv, Object>,
        around: &'a TouchObstacles<'a>,
    ) -> Self {
        Self { surface, render, around, camera_from_object, object_from_camera: camera_from_object.inverse() }
    }

    /// Whether the camera sees a point of the surface, both in `CameraCv`: it does not see what faces away on a closed surface.
    pub(super) fn sees(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> bool {
        // A ray that enters a closed surface has to leave it before it reaches the camera.
        let faces_away = self.render.culls_back_faces() && normal.dot(&point.coords) > 0.0;
        !faces_away && self.is_visible(point)
    }

    /// Whether no surface is between the camera and a point in `CameraCv`.
    pub(super) fn is_visible(&self, point: &Point3<f64>) -> bool {
        let towards_camera = self.object_from_camera.rotation() * -point.coords;
        let length = towards_camera.norm();
        let start = self.object_from_camera.point(point) + towards_camera * (CLEARANCE / length);
        let ray = Ray::new(&start, &Unit::new_unchecked(towards_camera / length));
        let reach = length - CLEARANCE;
        if self.surface.blocks(&ray, reach) {
            return false;
        }
        let towards_camera = Unit::new_normalize(-point.coords);
        !self.around.hides(&(point + towards_camera.into_inner() * CLEARANCE), &towards_camera, reach)
    }
}
