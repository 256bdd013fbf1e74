//! A pair without a cell, to touch an object beside.

use graspmill::{
    geom::{CameraCv, GridPlacement, Intrinsics, Object, OccupancyGrid, Pose},
    ids::SampleId,
    record::VoxelPair,
};

/// Seen by this camera, from a world that is the camera's.
pub fn empty_pair(
    sample: SampleId,
    grid: GridPlacement,
    camera: Intrinsics,
    camera_from_object: Pose<CameraCv, Object>,
) -> VoxelPair {
    VoxelPair {
        sample,
        grid,
        camera,
        camera_from_object,
        world_from_object: Pose::identity(),
        world_from_camera: Pose::identity(),
        partial: OccupancyGrid::new(grid.resolution),
        complete: OccupancyGrid::new(grid.resolution),
        partial_cells: 0,
        complete_cells: 0,
        both_cells: 0,
        solid_share: 1.0,
    }
}
