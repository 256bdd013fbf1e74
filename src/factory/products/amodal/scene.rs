//! A scene as its pairs need it: meshes of the bodies, container and table.

use std::sync::Arc;

use super::meshes::LoadedObject;
use crate::products::{pair::touch::TouchSurface, surroundings::SceneFixtures};
use format::SceneContainer;
use kernel::{
    geom::{RenderMesh, SimdLevel},
    voxel::{InsideTest, SolidObject, Truth, solid_occupancy},
};

/// Container and table of a scene.
pub(super) struct StillSolid {
    /// Container and sides of the table of the shapes.
    made_of: (SceneContainer, [f64; 2]),
    /// The container's walls and floor; `None` for a plane.
    pub container: Option<SolidObject>,
    /// The container as views are drawn.
    pub container_surface: Option<RenderMesh>,
    /// The table as views are drawn.
    pub table: RenderMesh,
    /// The container for touch.
    pub container_touch: Option<TouchSurface>,
    /// The table for touch.
    pub table_touch: TouchSurface,
    /// All below this height is solid [m].
    pub table_z: f64,
}

impl StillSolid {
    /// The solids of a container on a table.
    pub fn new(container: &SceneContainer, table_size: [f64; 2], level: SimdLevel) -> Self {
        let SceneFixtures { container: mesh, table, table_z } = SceneFixtures::new(container, table_size);
        let solid = |mesh| {
            let solid = solid_occupancy(mesh, InsideTest::Crossings, false);
            SolidObject::new(mesh, solid, true, true, Truth::AnyOverlap)
        };
        Self {
            made_of: (container.clone(), table_size),
            container: mesh.as_ref().map(solid),
            container_surface: mesh.as_ref().map(|mesh| RenderMesh::new(mesh, false)),
            table: RenderMesh::new(&table, false),
            container_touch: mesh.as_ref().map(|mesh| TouchSurface::new(mesh, level)),
            table_touch: TouchSurface::new(&table, level),
            table_z,
        }
    }

    /// Whether the shapes are those of this container on this table.
    pub fn is_of(&self, container: &SceneContainer, table_size: [f64; 2]) -> bool {
        self.made_of.0 == *container && self.made_of.1 == table_size
    }
}

/// The meshes of a scene, one per body in order, with container and table.
pub(super) struct LoadedScene<'w> {
    pub bodies: Vec<Arc<LoadedObject>>,
    pub still: &'w StillSolid,
}
