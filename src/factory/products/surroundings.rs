//! Container and table of a scene, as meshes, and the container ready for contacts.

use std::sync::Arc;

use crate::ProduceError;
use format::SceneContainer;
use kernel::{
    contact::{ContactBody, ContactSurface, Sampled},
    geom::TriMesh,
    voxel::InsideTest,
};
use sim::{Container, OpenBox};

/// The container of a scene, and the table below it, in the scene's frame.
pub struct Surroundings {
    /// The container; `None` for a plane.
    pub container: Option<TriMesh>,
    /// The table's top.
    pub table: TriMesh,
    /// Height of the table [m].
    pub table_z: f64,
}

impl Surroundings {
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
    match *container {
        SceneContainer::Plane { size } => Ok(Container::Plane { size }),
        SceneContainer::Bin { inner, wall, .. } => {
            let mesh = container.mesh().expect("a bin has walls");
            let outer = TriMesh::open_box(inner, wall).aabb().expect("a bin has walls");
            let body = flat_sided("container", &mesh)?;
            Ok(Container::Bin(OpenBox { body, inner, outer, world_from_box: container.world_from_container() }))
        }
    }
}

/// A mesh of flat sides, which touch with their edges alone, ready for contacts; `name` is for people.
///
/// # Errors
/// When it has no surface.
pub fn flat_sided(name: &str, mesh: &TriMesh) -> Result<Arc<ContactBody>, ProduceError> {
    let surface = ContactSurface::new(mesh, InsideTest::WindingNumber);
    let surface = surface.map_err(|error| ProduceError::unusable(name, error))?;
    Ok(Arc::new(ContactBody::new(mesh, Arc::new(surface), Sampled::Edges)))
}
