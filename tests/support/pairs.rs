//! The default camera, and pairs of grids that nothing has been put into.

use graspmill::{
    format::VoxelPair,
    geom::{CameraCv, GridPlacement, Intrinsics, Object, OccupancyGrid, Pose},
    ids::SampleId,
};

/// The camera of jobs that name none: 640 x 480 px, 1.047 rad wide.
pub fn default_camera() -> Intrinsics {
    Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).expect("a camera")
}

/// A pair without an occupied cell, expressed in a world that is the camera's frame.
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
