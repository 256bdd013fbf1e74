//! Objects of scenes prepared for images, kept by all threads.

use std::sync::Arc;

use nalgebra::{Point3, Unit, Vector3};

use crate::{
    ProduceError,
    objects::prepared,
    recent::Recent,
    sections::{JobObject, JobObjects},
};
use kernel::geom::{Ray, RenderMesh, SimdLevel, TriMesh, TriangleTree};

/// Objects that are kept, at most: about 2 MB each.
const KEPT: usize = 256;

/// A mesh, ready for images.
pub(super) struct LoadedMesh {
    /// Laid out for rendering.
    pub render: RenderMesh,
    /// Triangles in a tree, for distances.
    tree: Arc<TriangleTree>,
    /// The mesh as it is, where it is drawn in colour.
    mesh: Option<TriMesh>,
}

/// Objects that were loaded last.
pub(super) struct LoadedMeshes {
    recent: Recent<LoadedMesh>,
    in_colour: bool,
}

impl LoadedMeshes {
    /// Meshes to be drawn in colour, or not.
    pub fn new(in_colour: bool) -> Self {
        Self { recent: Recent::new(KEPT), in_colour }
    }

    /// An object of the job, by its index.
    ///
    /// # Errors
    /// When it is gone or another one than when the job was resolved.
    pub fn get(&self, objects: &JobObjects, index: usize) -> Result<Arc<LoadedMesh>, ProduceError> {
        self.recent.get(index, || LoadedMesh::prepare(&objects.list[index], self.in_colour))
    }
}

impl LoadedMesh {
    fn prepare(object: &JobObject, in_colour: bool) -> Result<Self, ProduceError> {
        let prepared = prepared(object)?;
        let render = RenderMesh::new(prepared.mesh(), false);
        Ok(Self { render, tree: Arc::clone(prepared.tree()), mesh: in_colour.then(|| prepared.mesh().clone()) })
    }

    /// A mesh that is no object.
    pub fn of_mesh(mesh: TriMesh) -> Self {
        let (render, tree) = (RenderMesh::new(&mesh, false), Arc::new(TriangleTree::new(&mesh)));
        Self { render, tree, mesh: Some(mesh) }
    }

    /// The mesh as it is.
    ///
    /// # Panics
    /// When it was loaded for images without colours.
    pub fn drawn(&self) -> &TriMesh {
        self.mesh.as_ref().expect("meshes are kept for colours")
    }

    /// Whether a point in the mesh's frame is nearer to its surface than `clearance` [m], or surrounded by it: rays along all six
    /// axes meet it.
    pub fn is_near(&self, point: &Point3<f64>, clearance: f64, level: SimdLevel) -> bool {
        let from_centre = point - self.render.centre();
        let reach = self.render.half_extents().add_scalar(clearance);
        if (0..3).any(|axis| from_centre[axis].abs() > reach[axis]) {
            return false;
        }
        let single = [point.x, point.y, point.z].map(|value| value as f32);
        let bound = (clearance * clearance) as f32;
        if self.tree.is_near(single, bound) {
            return true;
        }
        let far = 4.0 * self.render.half_extents().norm() + clearance;
        let is_blocked = |direction: Unit<Vector3<f64>>| self.tree.blocks(level, &Ray::new(point, &direction), far);
        [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()]
            .into_iter()
            .all(|axis| is_blocked(axis) && is_blocked(-axis))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_next_to_a_surface_or_surrounded_by_it() {
        let side = 0.2;
        let corner = |index: u32| [0, 1, 2].map(|axis| if index >> axis & 1 == 0 { -side } else { side } as f32);
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let cube = LoadedMesh::of_mesh(TriMesh { vertices: (0..8).map(corner).collect(), triangles });
        let level = SimdLevel::Scalar;
        for (point, expected) in [
            (Point3::new(0.0, 0.0, 0.0), true),
            (Point3::new(0.0, 0.0, 0.24), true),
            (Point3::new(0.0, 0.0, 0.26), false),
            (Point3::new(0.24, 0.24, 0.24), false),
            (Point3::new(0.0, 0.1, -0.19), true),
        ] {
            assert_eq!(cube.is_near(&point, 0.05, level), expected, "{point}");
        }
        // In an open box one is not surrounded.
        let bin = LoadedMesh::of_mesh(TriMesh::open_box([0.4, 0.3, 0.2], 0.02));
        assert!(!bin.is_near(&Point3::new(0.0, 0.0, 0.1), 0.05, level));
        assert!(bin.is_near(&Point3::new(0.0, 0.0, 0.04), 0.05, level));
    }
}
