//! Objects and containers of scenes as shapes that can be drawn.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3};

use format::SceneContainer;
use kernel::geom::{NoSurface, Shape, TouchShape, TriMesh, Triangles};

/// Thickness of a drawn table [m].
const TABLE_THICKNESS: f64 = 0.002;

/// A mesh as a shape that can be drawn.
pub(super) fn mesh_shape(mesh: &TriMesh) -> Result<TouchShape, NoSurface> {
    let triangles = Triangles {
        corners: mesh.vertices.iter().map(|corner| Point3::from(corner.map(f64::from))).collect(),
        triangles: mesh.triangles.clone(),
    };
    TouchShape::new(&Shape::Mesh(Arc::new(triangles)))
}

/// The container and its pose; a piece of the plane if there is no container.
pub(super) fn container_shape(container: &SceneContainer) -> Option<(TouchShape, IsometryMatrix3<f64>)> {
    match *container {
        SceneContainer::Bin { .. } | SceneContainer::Mesh { .. } => {
            Some((mesh_shape(&container.mesh()?).ok()?, IsometryMatrix3::identity()))
        }
        SceneContainer::Plane { size: [x, y] } => {
            let half = [x / 2.0, y / 2.0, TABLE_THICKNESS / 2.0];
            let shape = TouchShape::new(&Shape::Box { half }).ok()?;
            Some((shape, IsometryMatrix3::translation(0.0, 0.0, -TABLE_THICKNESS / 2.0)))
        }
    }
}
