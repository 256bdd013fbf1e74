//! Meshes as files that others read: PLY, OBJ, STL. Metres, in the frame that the mesh is in.

use std::fmt::Write as _;

use kernel::geom::TriMesh;

/// A mesh as binary little-endian PLY; each comment is one line of its head.
///
/// # Panics
/// If a comment has a line break.
pub fn write_ply(mesh: &TriMesh, comments: &[String]) -> Vec<u8> {
    let mut head = "ply\nformat binary_little_endian 1.0\n".to_owned();
    for comment in comments {
        assert!(!comment.contains(['\n', '\r']), "a comment is one line");
        _ = writeln!(head, "comment {comment}");
    }
    _ = write!(
        head,
        "element vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    );
    let mut bytes = head.into_bytes();
    mesh.vertices.iter().flatten().for_each(|value| bytes.extend(value.to_le_bytes()));
    for triangle in &mesh.triangles {
        bytes.push(3);
        triangle.iter().for_each(|vertex| bytes.extend(vertex.to_le_bytes()));
    }
    bytes
}

/// A mesh as Wavefront OBJ. Numbers are the shortest that read back as the same bits.
///
/// # Panics
/// If a comment has a line break.
pub fn write_obj(mesh: &TriMesh, comments: &[String]) -> String {
    let mut text = String::new();
    for comment in comments {
        assert!(!comment.contains(['\n', '\r']), "a comment is one line");
        _ = writeln!(text, "# {comment}");
    }
    for [x, y, z] in &mesh.vertices {
        _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c] in mesh.triangles.iter().map(|triangle| triangle.map(|vertex| u64::from(vertex) + 1)) {
        _ = writeln!(text, "f {a} {b} {c}");
    }
    text
}

/// A mesh as binary STL, with the normal of each triangle.
pub fn write_stl(mesh: &TriMesh) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    // Text in the head must not begin with "solid", which marks the other kind of STL.
    bytes[..14].copy_from_slice(b"graspmill mesh");
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for index in 0..mesh.triangles.len() {
        let corners = mesh.corners(index);
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let length = normal.norm();
        let normal = if length > 0.0 { normal / length } else { normal };
        let rows = [normal, corners[0].coords, corners[1].coords, corners[2].coords];
        rows.iter().flat_map(|row| row.iter()).for_each(|value| bytes.extend((*value as f32).to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}
