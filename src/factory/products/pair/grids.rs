//! The grids of a pair, from the depth of its object.

use nalgebra::Point3;

use form::Checker;
use format::VoxelPair;
use kernel::{
    geom::{DepthCrop, GridPlacement, Intrinsics, OccupancyGrid, Pose},
    ids::{Digest, ItemId, ObjectId, SampleId},
    voxel::{NoGrid, SolidObject, Truth, ViewGrids},
};

/// Rules by which the grids of a pair are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairRules {
    /// Cells along each axis of the grids, 1 to 128.
    pub resolution: u32,
    /// `thesis` quirk: cells with index 0 on any axis are dropped from both grids.
    pub drop_index_zero: bool,
    /// Rule by which a cell of the complete grid is occupied.
    pub truth: Truth,
    /// Fewest occupied cells of the partial grid of a pair that is kept.
    pub min_partial_cells: u32,
}

impl PairRules {
    /// Reports a gate that no grid passes.
    pub fn check(&self, checker: &mut Checker) {
        let cells = u64::from(self.resolution).pow(3);
        if u64::from(self.min_partial_cells) > cells {
            let found = format!("{} of the grid's {cells}", self.min_partial_cells);
            checker.invalid("gate.min_partial_cells", "at most as many cells as the grid has", found);
        }
    }
}

/// A pair without a cell, to be filled.
pub fn empty_pair(resolution: u32, camera: Intrinsics) -> VoxelPair {
    VoxelPair {
        sample: SampleId::of_object(ObjectId(Digest([0; 32])), ItemId(0)),
        grid: GridPlacement { resolution, centre: Point3::origin(), cell_size: 1.0 },
        camera,
        camera_from_object: Pose::identity(),
        world_from_object: Pose::identity(),
        world_from_camera: Pose::identity(),
        partial: OccupancyGrid::new(resolution),
        complete: OccupancyGrid::new(resolution),
        partial_cells: 0,
        complete_cells: 0,
        both_cells: 0,
        solid_share: 0.0,
    }
}

/// Fills the grids and the counts of a pair, whose camera and poses are set, from the depth of its object alone. The
/// complete grid of a pair with too few partial cells is not made, and its counts are 0.
///
/// # Errors
/// When nothing is seen, or one point only; the counts are 0.
pub fn fill_grids(
    grids: &mut ViewGrids,
    rules: &PairRules,
    object: &SolidObject,
    crop: &DepthCrop,
    pair: &mut VoxelPair,
) -> Result<(), NoGrid> {
    (pair.partial_cells, pair.complete_cells, pair.both_cells, pair.solid_share) = (0, 0, 0, 0.0);
    pair.grid = grids.place_grid(crop, &pair.camera, rules.resolution)?;
    grids.partial(crop, &pair.camera, &pair.grid, rules.drop_index_zero, &mut pair.partial);
    pair.partial_cells = pair.partial.count();
    if pair.partial_cells < rules.min_partial_cells {
        return Ok(());
    }
    let pose = &pair.camera_from_object;
    grids.complete(object, pose, &pair.grid, rules.truth, rules.drop_index_zero, &mut pair.complete);
    pair.complete_cells = pair.complete.count();
    pair.both_cells = pair.partial.count_both(&pair.complete);
    pair.solid_share = grids.solid_share(object, pose, &pair.grid);
    Ok(())
}
