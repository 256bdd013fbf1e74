//! Container and table of a scene, as meshes, and the container ready for contacts.

use std::sync::Arc;

use crate::ProduceError;
use format::SceneContainer;
use kernel::{
    contact::{ContactBody, ContactSurface, Sampled},
    geom::TriMesh,
    voxel::InsideTest,
};
use sim::{Container, Vessel};

/// The container of a scene, and the table below it, in the scene's frame.
pub struct SceneFixtures {
    /// The container; `None` for a plane.
    pub container: Option<TriMesh>,
    /// The table's top.
    pub table: TriMesh,
    /// Height of the table [m].
    pub table_z: f64,
}

impl SceneFixtures {
    /// A container on a table of these sides [m]; without a container the table is the plane on which the bodies stand.
    pub fn new(container: &SceneContainer, table: [f64; 2]) -> Self {
        let (container, table_z) = (container.mesh(), container.table_z());
        let [x, y] = table.map(|side| (side / 2.0) as f32);
        let z = table_z as f32;
        let vertices = vec![[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]];
        Self { container, table: TriMesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] }, table_z }
    }
}

/// The container of settled bodies, ready for contacts.
///
/// # Errors
/// When its mesh has no surface.
pub fn settled_container(container: &SceneContainer) -> Result<Container, ProduceError> {
    let pose = container.world_from_container();
    let body = |sampled| contact_body("container", &container.mesh().expect("all but a plane have walls"), sampled);
    Ok(match container {
        SceneContainer::Plane { size } => Container::Plane { size: *size },
        SceneContainer::Bin { inner, wall, .. } => {
            Container::Bin(Vessel::open_box(body(Sampled::Edges)?, *inner, *wall, pose))
        }
        SceneContainer::Mesh { shape, .. } => {
            Container::Bin(Vessel::of_mesh(shape.mesh(), body(Sampled::Everywhere)?, shape.inner(), pose))
        }
    })
}

/// A mesh ready for contacts, with points of this part of its surface: flat sides touch with their edges alone. `name` is for
/// people.
///
/// # Errors
/// When it has no surface.
pub fn contact_body(name: &str, mesh: &TriMesh, sampled: Sampled) -> Result<Arc<ContactBody>, ProduceError> {
    let surface = ContactSurface::new(mesh, InsideTest::WindingNumber);
    let surface = surface.map_err(|error| ProduceError::unusable(name, error))?;
    Ok(Arc::new(ContactBody::new(mesh, Arc::new(surface), sampled)))
}
