//! Surroundings of a body on the grid of its pair: cells that are seen of anything else, and cells where something else is solid.

use nalgebra::{Point3, Vector3};

use super::{image::ViewImage, scene::LoadedScene};
use format::VoxelPair;
use kernel::{
    geom::{CameraCv, DepthCrop, GridPlacement, Intrinsics, Object, OccupancyGrid, Pose, RenderMesh, World},
    voxel::{SolidObject, Truth, ViewGrids},
};

/// Fills the grids of what surrounds a body; its memory is used again.
#[derive(Default)]
pub(super) struct Neighbours {
    /// The depth of everything else.
    others: DepthCrop,
    cells: OccupancyGrid,
}

impl Neighbours {
    /// Cells of a pair's grid that hold a depth of anything but its body.
    pub fn fill_seen(
        &mut self,
        grids: &mut ViewGrids,
        image: &ViewImage,
        pair: &VoxelPair,
        drop_index_zero: bool,
        out: &mut OccupancyGrid,
    ) {
        let number = pair.sample.instance as u8;
        image.others(number, window_of(&pair.grid, &pair.camera), &mut self.others);
        grids.partial(&self.others, &pair.camera, &pair.grid, drop_index_zero, out);
    }

    /// Cells of a pair's grid that meet another body, the container or what is below the table.
    pub fn fill_solid(
        &mut self,
        grids: &mut ViewGrids,
        image: &ViewImage,
        LoadedScene { bodies, still }: &LoadedScene<'_>,
        pair: &VoxelPair,
        drop_index_zero: bool,
        out: &mut OccupancyGrid,
    ) {
        out.reset(pair.grid.resolution);
        let mut add = |solid: &SolidObject, pose: &Pose<CameraCv, Object>| {
            if reaches(&solid.render, pose, &pair.grid) {
                grids.complete(solid, pose, &pair.grid, Truth::AnyOverlap, drop_index_zero, &mut self.cells);
                out.bytes_mut().iter_mut().zip(self.cells.bytes()).for_each(|(out, cells)| *out |= cells);
            }
        };
        for (number, (body, object)) in (1..).zip(image.record.bodies.iter().zip(bodies)) {
            if number != pair.sample.instance {
                add(&object.pair.kernel, &image.camera_from_object(body));
            }
        }
        if let Some(container) = &still.container {
            let camera_from_world = pair.world_from_camera.inverse();
            add(container, &Pose::from_isometry(*camera_from_world.isometry()));
        }
        add_below(still.table_z, &pair.world_from_camera, &pair.grid, drop_index_zero, out);
    }
}

/// The pixels through which a grid is visible: first column and row, past-the-end column and row; the whole image where
/// the grid extends nearer than `near`.
pub(super) fn window_of(grid: &GridPlacement, camera: &Intrinsics) -> [u32; 4] {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let side = f64::from(grid.resolution) * grid.cell_size;
    for corner in 0..8u32 {
        let offset = Vector3::from_fn(|axis, _| if corner >> axis & 1 == 0 { 0.0 } else { side });
        let corner = grid.lower_corner() + offset;
        if corner.z <= camera.near {
            return [0, 0, camera.width, camera.height];
        }
        let (u, v) = camera.project(&corner);
        for (axis, value) in [u, v].into_iter().enumerate() {
            (low[axis], high[axis]) = (low[axis].min(value), high[axis].max(value));
        }
    }
    // One pixel more on each side for what rounding makes of the borders.
    let sides = [camera.width, camera.height].map(f64::from);
    let first = |axis: usize| (low[axis].floor() - 1.0).clamp(0.0, sides[axis]) as u32;
    let end = |axis: usize| (high[axis].ceil() + 1.0).clamp(0.0, sides[axis]) as u32;
    [first(0), first(1), end(0).max(first(0)), end(1).max(first(1))]
}

/// Whether the box of a mesh can reach into a grid: no axis of either separates the two.
fn reaches(mesh: &RenderMesh, pose: &Pose<CameraCv, Object>, grid: &GridPlacement) -> bool {
    let corners = |centre: Point3<f64>, half: Vector3<f64>| {
        (0..8u32).map(move |corner| {
            let signs = Vector3::from_fn(|axis, _| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 });
            centre + half.component_mul(&signs)
        })
    };
    // A cell of tolerance: the complete grid widens its cells by the rounding of depths.
    let side = (f64::from(grid.resolution) / 2.0 + 1.0) * grid.cell_size;
    let half_grid = Vector3::repeat(side);
    let middle = grid.lower_corner() + Vector3::repeat(side - grid.cell_size);
    let overlap = |points: &mut dyn Iterator<Item = Vector3<f64>>, half: &Vector3<f64>| {
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        points.for_each(|point| (low, high) = (low.inf(&point), high.sup(&point)));
        (0..3).all(|axis| low[axis] <= half[axis] && high[axis] >= -half[axis])
    };
    let half = mesh.half_extents();
    let mut of_mesh = corners(mesh.centre(), half).map(|corner| pose.point(&corner) - middle);
    let object_from_camera = pose.inverse();
    let mut of_grid = corners(middle, half_grid).map(|corner| object_from_camera.point(&corner) - mesh.centre());
    overlap(&mut of_mesh, &half_grid) && overlap(&mut of_grid, &half)
}

/// Adds the cells that reach down to a height in the world [m].
fn add_below(
    height: f64,
    world_from_camera: &Pose<World, CameraCv>,
    grid: &GridPlacement,
    drop_index_zero: bool,
    out: &mut OccupancyGrid,
) {
    // Height of a point of the camera's frame: up . point + shift. The lowest corner of a cell is half its height below its centre.
    let rows = world_from_camera.to_rows();
    let (up, shift) = (Vector3::new(rows[8], rows[9], rows[10]), rows[11]);
    let half = up.abs().sum() * grid.cell_size / 2.0;
    let corner: Point3<f64> = grid.lower_corner();
    let (n, first) = (grid.resolution, u32::from(drop_index_zero));
    let part = |axis: usize, index: u32| up[axis] * (corner[axis] + (f64::from(index) + 0.5) * grid.cell_size);
    for x in first..n {
        for y in first..n {
            let column = part(0, x) + part(1, y) + shift - half;
            (first..n).filter(|z| column + part(2, *z) <= height).for_each(|z| out.set([x, y, z]));
        }
    }
}
