//! Meshes of scenes as views are drawn: the objects of the views, kept by all threads, and container and table of a scene.

use std::sync::Arc;

use crate::{
    ProduceError,
    products::{surroundings::SceneFixtures, viewed::ViewMeshes},
    recent::Recent,
};
use format::SceneContainer;
use kernel::{geom::RenderMesh, ids::ObjectId};

/// Objects that are kept, at most: about 1 MB each.
const KEPT: usize = 256;

/// Objects of the views.
pub(super) struct LoadedMeshes {
    meshes: ViewMeshes,
    recent: Recent<RenderMesh>,
}

impl LoadedMeshes {
    /// The meshes of the views.
    pub fn new(meshes: ViewMeshes) -> Self {
        Self { meshes, recent: Recent::new(KEPT) }
    }

    /// An object.
    ///
    /// # Errors
    /// When it is not among the meshes, or the mesh has another content.
    pub fn get(&self, object: ObjectId) -> Result<Arc<RenderMesh>, ProduceError> {
        let make = || Ok(RenderMesh::new(self.meshes.prepared(object)?.mesh(), false));
        self.recent.get(self.meshes.index_of(object)?, make)
    }
}

/// Container and table of a scene.
pub(super) struct StillMeshes {
    /// Container and sides of the table that they are of.
    made_of: (SceneContainer, [f64; 2]),
    /// The container; `None` for a plane.
    pub container: Option<RenderMesh>,
    /// The table.
    pub table: RenderMesh,
}

impl StillMeshes {
    /// A container on a table of these sides [m].
    pub fn new(container: &SceneContainer, size: [f64; 2]) -> Self {
        let SceneFixtures { container: mesh, table, .. } = SceneFixtures::new(container, size);
        let container_mesh = mesh.as_ref().map(|mesh| RenderMesh::new(mesh, false));
        Self { made_of: (container.clone(), size), container: container_mesh, table: RenderMesh::new(&table, false) }
    }

    /// Whether they are of this container on this table.
    pub fn is_of(&self, container: &SceneContainer, size: [f64; 2]) -> bool {
        self.made_of.0 == *container && self.made_of.1 == size
    }
}
