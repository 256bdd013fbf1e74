//! Completed objects as a scene for MuJoCo.

use std::fmt::Write as _;

use nalgebra::{Isometry3, Point3, Vector3};

/// One mesh of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshBody {
    /// Name of the body; letters, digits, `_` and `-`.
    pub name: String,
    /// File of its mesh beside the scene, OBJ or STL; letters, digits, `_`, `-` and `.`.
    pub file: String,
    /// Density [kg/m^3].
    pub density: f64,
}

/// A table's top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TablePlane {
    /// A point of it [m].
    pub point: [f64; 3],
    /// Unit normal, upward.
    pub normal: [f64; 3],
}

/// A scene with each mesh as a free body where it was seen. Without the camera's pose the meshes' frame is the scene's, and
/// gravity pulls against the table's normal, if there is one; with it the scene's frame is the world's, whose z points up, and
/// the bodies are placed by the camera's pose.
///
/// # Panics
/// If a name or a file has another character than it may.
pub fn write_mjcf(
    bodies: &[MeshBody],
    table: Option<&TablePlane>,
    world_from_camera: Option<&Isometry3<f64>>,
) -> String {
    let is_plain =
        |text: &str| !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c));
    assert!(bodies.iter().all(|body| is_plain(&body.name) && is_plain(&body.file)), "names that XML takes as they are");
    const GRAVITY: f64 = 9.81;
    let table = table.map(|table| match world_from_camera {
        Some(pose) => TablePlane {
            point: (pose * Point3::from(table.point)).into(),
            normal: (pose * Vector3::from(table.normal)).into(),
        },
        None => *table,
    });
    let [x, y, z] = match (world_from_camera, &table) {
        (Some(_), _) => [0.0, 0.0, -GRAVITY],
        (None, Some(table)) => table.normal.map(|value| -GRAVITY * value),
        (None, None) => [0.0; 3],
    };
    let frame = match world_from_camera {
        Some(_) => "the world's, z up",
        None => "the camera's: x right, y down, z forward",
    };
    let pose = world_from_camera.map_or(String::new(), |pose| {
        let ([x, y, z], [i, j, k, w]) =
            (<[f64; 3]>::from(pose.translation.vector), <[f64; 4]>::from(pose.rotation.coords));
        format!(" pos=\"{x} {y} {z}\" quat=\"{w} {i} {j} {k}\"")
    });
    let mut text = format!(
        "<mujoco model=\"completed scene\">\n  \
         <!-- Metres; the frame is {frame}. For contacts MuJoCo takes each mesh's convex hull. -->\n  \
         <option gravity=\"{x} {y} {z}\"/>\n  <asset>\n"
    );
    for MeshBody { name, file, .. } in bodies {
        _ = writeln!(text, "    <mesh name=\"{name}\" file=\"{file}\" inertia=\"exact\"/>");
    }
    text.push_str("  </asset>\n  <worldbody>\n    <light pos=\"0 -1 0\" dir=\"0 1 0\"/>\n");
    if let Some(TablePlane { point: [x, y, z], normal: [nx, ny, nz] }) = table {
        _ = writeln!(
            text,
            "    <geom name=\"table\" type=\"plane\" size=\"1 1 0.01\" pos=\"{x} {y} {z}\" zaxis=\"{nx} {ny} {nz}\"/>"
        );
    }
    for MeshBody { name, density, .. } in bodies {
        _ = writeln!(
            text,
            "    <body name=\"{name}\"{pose}>\n      <freejoint/>\n      \
             <geom type=\"mesh\" mesh=\"{name}\" density=\"{density}\"/>\n    </body>"
        );
    }
    text.push_str("  </worldbody>\n</mujoco>\n");
    text
}
