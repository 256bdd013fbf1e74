//! A mesh as MuJoCo is given one.

use mujoco_rs::{
    mujoco_c::mjtMeshInertia,
    wrappers::mj_editing::{MjSpec, MjsMesh, SpecItem},
};

use kernel::geom::TriMesh;

/// Method by which MuJoCo finds the inertial frame that it moves a mesh into. Depth does not depend on it; mass does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Inertia {
    /// Mass on the surface: works for open and badly wound meshes.
    #[default]
    Shell,
    /// Mass in the volume: refuses meshes whose faces disagree.
    Exact,
}

/// Gives MuJoCo a mesh, with all its triangles.
pub(crate) fn add_mesh<'a>(spec: &'a mut MjSpec, name: &str, mesh: &TriMesh, inertia: Inertia) -> &'a mut MjsMesh {
    let asset = spec.add_mesh();
    asset.with_name(name).set_inertia(match inertia {
        Inertia::Shell => mjtMeshInertia::mjMESH_INERTIA_SHELL,
        Inertia::Exact => mjtMeshInertia::mjMESH_INERTIA_EXACT,
    });
    asset.set_uservert(mesh.vertices.as_flattened());
    let faces: Vec<i32> = mesh.triangles.as_flattened().iter().map(|&vertex| vertex as i32).collect();
    asset.set_userface(&faces);
    asset
}
