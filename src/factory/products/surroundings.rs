//! Container and table of a scene, as meshes.

use format::SceneContainer;
use kernel::geom::TriMesh;

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
        let (container, table_z) = match *container {
            SceneContainer::Plane { .. } => (None, 0.0),
            SceneContainer::Bin { inner, wall } => (Some(TriMesh::open_box(inner, wall)), -wall),
        };
        let [x, y] = table.map(|side| (side / 2.0) as f32);
        let z = table_z as f32;
        let vertices = vec![[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]];
        Self { container, table: TriMesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] }, table_z }
    }
}
