//! Built-in shapes on a table, as a depth camera sees them: `scenes/table.png` with the camera of `scenes/table.json`.

use graspmill::{
    geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose, RenderMesh, SimdLevel, TriMesh},
    render::Rasteriser,
};
use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::support::meshes::built_in_mesh;

/// Shapes, and the position of each on the table [m].
pub const STANDING: [(&str, [f64; 2]); 5] = [
    ("mug-01", [-0.19, 0.02]),
    ("bottle-01", [-0.04, 0.12]),
    ("bowl-01", [0.17, 0.06]),
    ("can-01", [0.03, -0.08]),
    ("box-01", [-0.12, -0.13]),
];

/// The camera; pixel centres at +0.5.
pub const CAMERA: Intrinsics =
    Intrinsics { width: 320, height: 240, fx: 300.0, fy: 300.0, cx: 159.5, cy: 121.25, near: 0.01 };

/// Where the camera is above the table, z up [m].
const EYE: [f64; 3] = [0.0, -0.5, 0.55];
/// Point of the table at the middle of its image [m].
const AIM: [f64; 3] = [0.0, 0.03, 0.0];
/// Half of the side of the table [m].
const HALF_TABLE: f32 = 2.0;

/// The camera's pose: its frame from the table's, whose origin lies on the top, z up.
pub fn camera_from_table() -> Pose<CameraCv, Object> {
    let (eye, aim) = (Vector3::from(EYE), Vector3::from(AIM));
    let forward = (aim - eye).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let down = forward.cross(&right);
    let rows = Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
    Pose::new(Rotation3::from_matrix_unchecked(rows), -(rows * eye))
}

/// A shape of [`STANDING`] at its position, in the table's frame.
pub fn standing(index: usize) -> TriMesh {
    let (name, [x, y]) = STANDING[index];
    let mut mesh = built_in_mesh(name);
    let bounds = mesh.aabb().expect("a shape");
    let low = bounds.centre().z - 0.5 * bounds.extents()[2];
    let middle = bounds.centre();
    for vertex in &mut mesh.vertices {
        *vertex =
            [vertex[0] - middle.x as f32 + x as f32, vertex[1] - middle.y as f32 + y as f32, vertex[2] - low as f32];
    }
    mesh
}

/// The table's top alone.
pub fn table_top() -> TriMesh {
    let h = HALF_TABLE;
    TriMesh {
        vertices: vec![[-h, -h, 0.0], [h, -h, 0.0], [h, h, 0.0], [-h, h, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// Depth of meshes in the table's frame [m], NaN = no return. Shape (height, width).
pub fn render(meshes: &[TriMesh], camera: &Intrinsics) -> Vec<f32> {
    let mut whole = TriMesh::default();
    for mesh in meshes {
        let first = whole.vertices.len() as u32;
        whole.vertices.extend(&mesh.vertices);
        whole.triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
    }
    let mesh = RenderMesh::new(&whole, false);
    let mut rasteriser = Rasteriser::new(SimdLevel::detect());
    let DepthCrop { left, top, width, depth, .. } = rasteriser.render(&mesh, camera, &camera_from_table());
    let mut image = vec![f32::NAN; (camera.width * camera.height) as usize];
    for (index, value) in (0..).zip(depth) {
        let (column, row) = (left + index % width, top + index / width);
        image[(row * camera.width + column) as usize] = *value;
    }
    image
}

/// The whole scene's depth.
pub fn scene_depth() -> Vec<f32> {
    let mut meshes: Vec<TriMesh> = (0..STANDING.len()).map(standing).collect();
    meshes.push(table_top());
    render(&meshes, &CAMERA)
}

/// Depth in whole millimetres, 0 for no return, as a grey PNG of 16 bits.
pub fn png_of(depth: &[f32], camera: &Intrinsics) -> Vec<u8> {
    let millimetres = depth.iter().map(|depth| if depth.is_nan() { 0 } else { (1e3 * depth).round() as u16 });
    let data: Vec<u8> = millimetres.flat_map(u16::to_be_bytes).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, camera.width, camera.height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_filter(png::Filter::Adaptive);
    encoder.set_compression(png::Compression::High);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(&data)?;
        writer.finish()
    });
    written.expect("an image");
    bytes
}
