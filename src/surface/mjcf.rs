//! Completed objects as a scene for MuJoCo.

use std::fmt::Write as _;

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

/// A scene with each mesh as a free body where it was seen: the meshes' frame is the scene's. Gravity pulls against the
/// table's normal; without a table there is none.
///
/// # Panics
/// If a name or a file has another character than it may.
pub fn write_mjcf(bodies: &[MeshBody], table: Option<&TablePlane>) -> String {
    let is_plain =
        |text: &str| !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c));
    assert!(bodies.iter().all(|body| is_plain(&body.name) && is_plain(&body.file)), "names that XML takes as they are");
    let gravity = table.map_or([0.0; 3], |table| table.normal.map(|value| -9.81 * value));
    let [x, y, z] = gravity;
    let mut text = format!(
        "<mujoco model=\"completed scene\">\n  \
         <!-- Metres, in the camera's frame: x right, y down, z forward. For contacts MuJoCo takes each mesh's convex hull. -->\n  \
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
            "    <body name=\"{name}\">\n      <freejoint/>\n      \
             <geom type=\"mesh\" mesh=\"{name}\" density=\"{density}\"/>\n    </body>"
        );
    }
    text.push_str("  </worldbody>\n</mujoco>\n");
    text
}
