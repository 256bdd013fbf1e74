//! Closed meshes for unit tests.

use nalgebra::Vector3;

use crate::geom::{TriMesh, rotation_from_rpy};

/// A container with flat walls, the same container tilted, and a ring.
pub(crate) fn test_shapes() -> [(&'static str, TriMesh); 3] {
    let container = TriMesh::open_box([0.1, 0.06, 0.05], 0.004);
    let rotation = rotation_from_rpy(0.4, -0.7, 1.9);
    let rotate = |vertex: &[f32; 3]| (rotation * Vector3::from(vertex.map(f64::from))).map(|v| v as f32).into();
    let tilted = container.vertices.iter().map(rotate).collect();
    let tilted = TriMesh { vertices: tilted, triangles: container.triangles.clone() };
    [("container", container), ("tilted container", tilted), ("ring", ring(0.035, 0.015))]
}

/// A torus about the z axis, by the radii of its centre line and of its tube [m].
fn ring(radius: f64, tube: f64) -> TriMesh {
    const AROUND: u32 = 96;
    const ALONG: u32 = 48;
    let angle = |step: u32, steps: u32| f64::from(step) * std::f64::consts::TAU / f64::from(steps);
    let vertex = |i: u32, j: u32| {
        let (around, along) = (angle(i, AROUND), angle(j, ALONG));
        let distance = radius + tube * libm::cos(along);
        let point = [distance * libm::cos(around), distance * libm::sin(around), tube * libm::sin(along)];
        point.map(|coordinate| coordinate as f32)
    };
    let cells = || (0..AROUND).flat_map(|i| (0..ALONG).map(move |j| (i, j)));
    let index = |i: u32, j: u32| i % AROUND * ALONG + j % ALONG;
    let triangles = cells().flat_map(|(i, j)| {
        let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh { vertices: cells().map(|(i, j)| vertex(i, j)).collect(), triangles: triangles.collect() }
}
