//! Pure maths: frames and poses, camera, images, grids, fields over poses, meshes. No I/O, no threads, no random numbers.

mod camera;
mod doubles;
mod field;
mod frames;
mod grid;
mod hull;
mod image;
pub mod lanes;
mod mass;
mod mesh;
mod near;
mod open_box;
mod packed_solid;
mod query;
mod render_mesh;
mod rest;
mod sets;
mod shape;
mod short_edges;
mod simd;
mod spread;
mod symmetry;
mod triangle_tree;
mod views;

pub use camera::{Intrinsics, InvalidIntrinsics};
pub use field::{
    Axis, AxisGrid, AxisUnit, Covering, FieldLookup, FieldMetric, HealPix, InvalidPoseGrid, METRES_PER_RADIAN,
    PoseGrid, PoseLabel, Proof, SphereGrid, approach_directions, signed_distance_sphere, signed_distance_standard,
    signed_distance_thesis,
};
pub use frames::{
    Approach, CameraCv, CameraGl, EndEffector, Frame, HandBase, Object, Pose, SourceWorld, Volume, World,
    rotation_from_rpy, rotation_towards,
};
pub use grid::{GridPlacement, OccupancyGrid, SolidGrid};
pub use hull::{convex_hull_area, convex_hull_corners, convex_hull_planes, convex_hull_vertices};
pub use image::DepthCrop;
pub use mass::MassProperties;
pub use mesh::{Aabb, TriMesh};
pub use near::near_groups;
pub use packed_solid::{PackedSolid, SolidCells};
pub use query::{MeshQuery, NoSurface, RayHit, TouchShape};
pub use render_mesh::RenderMesh;
pub use rest::{RestingPose, RestingPoses, every_resting_pose, upright};
pub use sets::Sets;
pub use shape::{Shape, Triangles};
pub use short_edges::TOUCHED_EDGE;
pub use simd::{SimdLevel, UnknownSimdLevel, simd_kernel};
pub use spread::farthest_first;
pub use symmetry::{Symmetries, SymmetryAxis};
pub use triangle_tree::{BoxCluster, Ray, TriangleTree};
pub use views::{ViewSet, closed_linspace, open_linspace, rotation_from_quaternion, super_fibonacci};
pub(crate) use {
    lanes::{Affine, Lanes, each_of},
    render_mesh::Facing,
};
