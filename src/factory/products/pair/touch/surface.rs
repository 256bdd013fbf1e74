//! An object's surface for rays.

use std::sync::Arc;

use nalgebra::{Unit, Vector3};

use kernel::geom::{Ray, SimdLevel, TriMesh, TriangleTree};

/// An object's surface for rays.
pub struct TouchSurface {
    tree: Arc<TriangleTree>,
    level: SimdLevel,
}

impl TouchSurface {
    /// Kernels at this level, or at the best one that the machine has.
    pub fn new(mesh: &TriMesh, level: SimdLevel) -> Self {
        Self::of_tree(&Arc::new(TriangleTree::new(mesh)), level)
    }

    /// The surface of a mesh whose tree has been built already.
    pub fn of_tree(tree: &Arc<TriangleTree>, level: SimdLevel) -> Self {
        Self { tree: Arc::clone(tree), level: level.usable() }
    }

    /// Level of the kernels.
    pub(super) fn level(&self) -> SimdLevel {
        self.level
    }

    /// Where a ray meets the surface first: distance [m], and the triangle's normal by the order of its corners. A triangle
    /// without area is never met.
    pub(super) fn first_hit(&self, ray: &Ray) -> Option<(f64, Unit<Vector3<f64>>)> {
        let hit = self.tree.first_hit(self.level, ray, f64::INFINITY)?;
        Some((hit.distance, self.tree.normal(&hit)?))
    }

    /// Whether a ray meets the surface at most `reach` [m] away.
    pub(super) fn blocks(&self, ray: &Ray, reach: f64) -> bool {
        self.tree.blocks(self.level, ray, reach)
    }
}
