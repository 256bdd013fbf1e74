//! The built-in shapes for unit tests. They come from a build of this crate without tests, so that types are converted.

use crate::geom::TriMesh;

/// The mesh of a built-in shape.
pub(crate) fn built_in(name: &str) -> TriMesh {
    let mesh = assets::prepare(&assets::built_in_source(name)).expect("a sound shape").mesh;
    TriMesh { vertices: mesh.vertices, triangles: mesh.triangles }
}
