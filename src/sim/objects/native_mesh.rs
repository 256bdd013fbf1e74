//! A mesh as MuJoCo itself touches it.

use mujoco_rs::wrappers::{
    mj_editing::{MjSpec, SpecItem},
    mj_model::{MjtFlexSelf, MjtGeomBase},
};

use super::{
    added_geom::drop_defaults,
    mesh::{Inertia, add_mesh},
};
use crate::error::HandError;
use kernel::geom::{TOUCHED_EDGE, TriMesh};

/// Thickness that a flex has to have at least [m].
const FLEX_RADIUS: f64 = 1e-5;

/// Memory that MuJoCo takes per pair of a geom and a triangle that may touch, at most: 50 contacts [bytes].
const BYTES_PER_PAIR: usize = 7_000;

/// Memory for all else [bytes], and the largest that a simulation with triangles may need. It is allocated on demand.
const BASE_MEMORY: usize = 32 << 20;
const MAX_MEMORY: usize = 1 << 30;

/// Depth of MuJoCo's octree of distances to a mesh.
const OCTREE_DEPTH: i32 = 8;

/// Method by which MuJoCo itself touches a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NativeContacts {
    /// By an octree of distances, from 40 starts per pair: milliseconds per step.
    Sdf,
    /// Contacts of the convex hull.
    Hull,
    /// Contacts of the triangles, a flex without a thickness whose vertices are of one rigid body: tenths of a
    /// millisecond per step. Triangles wider than the solid that touches them may be missed, so that long edges are halved.
    Triangles,
}

impl NativeContacts {
    /// Whether a mesh has few enough triangles for [contacts of each](Self::Triangles) with a hand, of which no body has more than
    /// `hand_geoms` geoms.
    pub(crate) fn can_touch_triangles(hand_geoms: usize, object: &TriMesh) -> bool {
        triangles_memory(hand_geoms, object) <= MAX_MEMORY
    }

    /// Refuses a mesh for which MuJoCo would run out of memory, since it ends the process then.
    pub(crate) fn check(self, hand_geoms: usize, object: &TriMesh) -> Result<(), HandError> {
        if self != Self::Triangles || Self::can_touch_triangles(hand_geoms, object) {
            return Ok(());
        }
        let (count, bytes) = (object.triangles.len(), triangles_memory(hand_geoms, object));
        let reason = format!("{count} triangles, for whose contacts MuJoCo may need {bytes} bytes");
        Err(HandError::Object { reason })
    }

    /// Adds a mesh to a body, under the body's name.
    pub(crate) fn add(self, spec: &mut MjSpec, body: &str, hand_geoms: usize, object: &TriMesh) {
        let kind = match self {
            Self::Sdf => MjtGeomBase::mjGEOM_SDF,
            Self::Hull => MjtGeomBase::mjGEOM_MESH,
            Self::Triangles => {
                let fine = object.with_short_edges(TOUCHED_EDGE, max_triangles(hand_geoms));
                spec.set_memory(triangles_memory(hand_geoms, &fine) as _);
                return add_triangles(spec, body, &fine);
            }
        };
        add_mesh(spec, body, object, Inertia::Shell).set_octree_maxdepth(OCTREE_DEPTH);
        let geom = spec.body_mut(body).expect("the body was added").add_geom();
        drop_defaults(geom);
        geom.set_type(kind);
        geom.set_meshname(body);
    }
}

/// Memory that MuJoCo may need to search contacts of a hand with triangles [bytes]: it handles one body of the hand
/// after another.
fn triangles_memory(hand_geoms: usize, object: &TriMesh) -> usize {
    BASE_MEMORY + bytes_per_triangle(hand_geoms) * object.triangles.len()
}

/// Memory that MuJoCo may need per triangle [bytes].
fn bytes_per_triangle(hand_geoms: usize) -> usize {
    BYTES_PER_PAIR * hand_geoms
}

/// Triangles for which that memory is enough.
fn max_triangles(hand_geoms: usize) -> usize {
    (MAX_MEMORY - BASE_MEMORY) / bytes_per_triangle(hand_geoms).max(1)
}

/// A mesh as a flex of triangles, all of whose vertices are of one body.
fn add_triangles(spec: &mut MjSpec, body: &str, object: &TriMesh) {
    let flex = spec.add_flex();
    flex.with_name(body);
    flex.set_dim(2);
    flex.set_radius(FLEX_RADIUS);
    flex.set_priority(1);
    flex.set_selfcollide(MjtFlexSelf::mjFLEXSELF_NONE);
    flex.append_vertbody(body);
    let vertices: Vec<f64> = object.vertices.as_flattened().iter().map(|part| f64::from(*part)).collect();
    flex.set_vert(&vertices);
    let triangles: Vec<i32> = object.triangles.as_flattened().iter().map(|vertex| *vertex as i32).collect();
    flex.set_elem(&triangles);
}
