//! The grids of one view: placement, partial, complete, visibility.

use std::sync::Arc;

use super::{
    cells::{Cells, pack_rows},
    complete::Surface,
    corners::CornerShell,
    interior::{FineFromGrid, fill_interior, holds},
    lookup::add_solid,
    partial::mark_points,
    placement::{NoGrid, Slopes, place_grid},
    share::Blocks,
    visibility::{FreeTables, free_rows},
};
use crate::geom::{
    CameraCv, DepthCrop, GridPlacement, Intrinsics, Object, OccupancyGrid, Pose, RenderMesh, SimdLevel, SolidGrid,
    TriMesh,
};

/// When a cell of the complete grid is occupied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Truth {
    /// A cell is occupied where its closed box meets the solid: the surface passes through it or its centre is inside.
    AnyOverlap,
    /// A cell is occupied where its centre is inside the solid.
    Centre,
    /// At least this share of it is solid.
    Fraction(f64),
    /// `thesis`: the lower corner of an occupied fine cell falls into it.
    LowerCorners,
}

/// An object in the form that the kernels of a view need; made once per object, shared by its views.
pub struct SolidObject {
    /// The surface.
    pub render: RenderMesh,
    /// The inside.
    pub solid: Arc<SolidGrid>,
    closed: bool,
    blocks: Blocks,
    shell: Option<CornerShell>,
}

impl SolidObject {
    /// `closed` means that the mesh is watertight: its winding number is constant wherever no surface is crossed. With
    /// `outward` its faces are also wound outward, so that back faces need not be drawn. `truth` is the rule that
    /// [`ViewGrids::complete`] will use; `LowerCorners` needs its own list.
    pub fn new(mesh: &TriMesh, solid: impl Into<Arc<SolidGrid>>, closed: bool, outward: bool, truth: Truth) -> Self {
        let solid = solid.into();
        Self {
            render: RenderMesh::new(mesh, closed && outward),
            closed,
            blocks: Blocks::new(&solid),
            shell: (truth == Truth::LowerCorners).then(|| CornerShell::new(&solid)),
            solid,
        }
    }
}

/// Makes the grids of a view; one a worker, its memory is used again for every view.
pub struct ViewGrids {
    level: SimdLevel,
    slopes: Slopes,
    cells: Cells,
    surface: Surface,
    rows: Vec<u128>,
    free: FreeTables,
}

impl ViewGrids {
    /// Kernels at this level, or at the best one that the machine has.
    pub fn new(level: SimdLevel) -> Self {
        Self {
            level: level.usable(),
            slopes: Slopes::default(),
            cells: Cells::default(),
            surface: Surface::default(),
            rows: Vec::new(),
            free: FreeTables::default(),
        }
    }

    /// The grid that a depth image requires: see [`GridPlacement`].
    ///
    /// # Errors
    /// When nothing is seen, or one point only.
    pub fn place_grid(
        &mut self,
        crop: &DepthCrop,
        camera: &Intrinsics,
        resolution: u32,
    ) -> Result<GridPlacement, NoGrid> {
        place_grid(self.level, crop, camera, &mut self.slopes, resolution)
    }

    /// Cells that contain a visible point: floor((p - centre) / cell_size + anchor), in double precision from the
    /// unmodified depth. Points outside the grid are dropped, with `drop_index_zero` also those whose cell has index 0
    /// on any axis.
    pub fn partial(
        &mut self,
        crop: &DepthCrop,
        camera: &Intrinsics,
        placement: &GridPlacement,
        drop_index_zero: bool,
        grid: &mut OccupancyGrid,
    ) {
        self.cells.reset(placement.resolution);
        self.slopes.set(crop, camera);
        if crop.width > 0 {
            mark_points(self.level, crop, &self.slopes, placement, &mut self.cells);
        }
        self.pack_cells(placement.resolution, drop_index_zero, grid);
    }

    /// Cells that the object occupies under a rule.
    ///
    /// - `AnyOverlap`: the closed cell box, widened by 1e-6 of the distance (the rounding of depth), meets a triangle, or
    ///   the cell's centre is inside. Every depth point of [`crate::render::Rasteriser`] lies in such a cell.
    /// - `Centre`: the fine cell of [`SolidGrid`] that holds the cell's centre is solid.
    /// - `Fraction`: of 4 x 4 x 4 evenly spaced points of the cell at least this share lies in solid fine cells; cells
    ///   that the surface does not meet are all or nothing.
    /// - `LowerCorners`: the lower corner of a solid fine cell falls into the cell, floor((p - centre) / cell_size +
    ///   anchor), in single precision.
    ///
    /// With `drop_index_zero` cells with index 0 on any axis stay empty.
    ///
    /// # Panics If `LowerCorners` is requested for an object that was not made for it.
    pub fn complete(
        &mut self,
        object: &SolidObject,
        camera_from_object: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
        truth: Truth,
        drop_index_zero: bool,
        grid: &mut OccupancyGrid,
    ) {
        self.cells.reset(placement.resolution);
        match truth {
            Truth::AnyOverlap => self.overlap_rows(object, camera_from_object, placement),
            Truth::Fraction(share) => self.fraction_rows(object, camera_from_object, placement, share),
            Truth::Centre => self.centre_rows(object, camera_from_object, placement),
            Truth::LowerCorners => {
                let shell = object.shell.as_ref().expect("the object was made for another truth");
                shell.mark(self.level, &object.solid, camera_from_object, placement, &mut self.cells);
                self.cells.rows(self.level, &mut self.rows);
                shell.fill(self.level, &object.solid, camera_from_object, placement, &mut self.rows);
            }
        }
        if drop_index_zero {
            let n = placement.resolution as usize;
            for (index, row) in self.rows.iter_mut().enumerate() {
                *row = if index < n || index % n == 0 { 0 } else { *row & !1 };
            }
        }
        pack_rows(&self.rows, placement.resolution, grid);
    }

    /// Cells that the camera sees to be free: the pixel that the centre falls into has a larger depth than the centre,
    /// or no return. Cells of `partial` are surface, so they are left out; all remaining cells are unseen.
    pub fn free(
        &mut self,
        crop: &DepthCrop,
        camera: &Intrinsics,
        placement: &GridPlacement,
        partial: &OccupancyGrid,
        grid: &mut OccupancyGrid,
    ) {
        let n = placement.resolution as usize;
        self.free.set(self.level, crop, camera, placement);
        self.rows.clear();
        self.rows.resize(n * n, 0);
        free_rows(self.level, &self.free, n, &mut self.rows);
        pack_rows(&self.rows, placement.resolution, grid);
        for (free, surface) in grid.bytes_mut().iter_mut().zip(partial.bytes()) {
            *free &= !surface;
        }
    }

    /// Empties the cells whose centre falls into no pixel of the image: no line of sight leads there.
    pub fn drop_outside_image(&self, camera: &Intrinsics, placement: &GridPlacement, grid: &mut OccupancyGrid) {
        let n = placement.resolution as usize;
        let (corner, all) = (placement.lower_corner(), u128::MAX >> (128 - n));
        let centre = |axis: usize, index: usize| corner[axis] + (index as f64 + 0.5) * placement.cell_size;
        // For each index along an axis of the image: bits of the layers along z in which the centre falls between its borders.
        let lines = |axis: usize, focal: f64, principal: f64, side: u32| -> Vec<u128> {
            let is_inside = |index: usize, z: usize| {
                let pixel = focal * centre(axis, index) * (1.0 / centre(2, z)) + principal;
                centre(2, z) > 0.0 && pixel >= 0.0 && pixel < f64::from(side)
            };
            let bits = |index: usize| (0..n).filter(|z| is_inside(index, *z)).fold(0, |bits, z| bits | 1u128 << z);
            (0..n).map(bits).collect()
        };
        let columns = lines(0, camera.fx, camera.cx, camera.width);
        let rows = lines(1, camera.fy, camera.cy, camera.height);
        for (x, column) in columns.iter().enumerate() {
            for (y, row) in rows.iter().enumerate() {
                let mut outside = !(column & row) & all;
                while outside != 0 {
                    let bit = (x * n + y) * n + outside.trailing_zeros() as usize;
                    grid.bytes_mut()[bit / 8] &= !(1 << (bit % 8));
                    outside &= outside - 1;
                }
            }
        }
    }

    /// Share of the solid's fine cells whose centre lies inside the grid, 0 to 1.
    pub fn solid_share(
        &self,
        object: &SolidObject,
        camera_from_object: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
    ) -> f64 {
        object.blocks.share(self.level, &object.solid, camera_from_object, placement)
    }

    fn pack_cells(&mut self, resolution: u32, drop_index_zero: bool, grid: &mut OccupancyGrid) {
        if drop_index_zero {
            self.cells.drop_index_zero();
        }
        self.cells.rows(self.level, &mut self.rows);
        pack_rows(&self.rows, resolution, grid);
    }

    fn overlap_rows(&mut self, object: &SolidObject, pose: &Pose<CameraCv, Object>, placement: &GridPlacement) {
        self.surface.mark(self.level, &object.render, pose, placement, &mut self.cells);
        self.cells.rows(self.level, &mut self.rows);
        fill_interior(&mut self.rows, &object.solid, object.closed, &object.render, &self.surface, pose, placement);
    }

    fn fraction_rows(
        &mut self,
        object: &SolidObject,
        pose: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
        share: f64,
    ) {
        const POINTS: usize = 4;
        self.overlap_rows(object, pose, placement);
        let n = placement.resolution as usize;
        let side = self.cells.side();
        let fine = FineFromGrid::new(&object.solid, pose, placement);
        let inside = |cell: [usize; 3]| {
            let points = (0..POINTS.pow(3)).map(|point| {
                let offset = [point / POINTS / POINTS, point / POINTS % POINTS, point % POINTS];
                std::array::from_fn(|axis| cell[axis] as f64 + (offset[axis] as f64 + 0.5) / POINTS as f64)
            });
            points.filter(|point| holds(&object.solid, &fine.at(*point))).count()
        };
        for (index, row) in self.rows.iter_mut().enumerate() {
            let (x, y) = (index / n, index % n);
            for z in 0..n {
                if self.cells.bytes[((x + 1) * side + y + 1) * side + z + 1] != 0
                    && (inside([x, y, z]) as f64) < share * POINTS.pow(3) as f64
                {
                    *row &= !(1 << z);
                }
            }
        }
    }

    fn centre_rows(&mut self, object: &SolidObject, pose: &Pose<CameraCv, Object>, placement: &GridPlacement) {
        let n = placement.resolution as usize;
        let fine = FineFromGrid::new(&object.solid, pose, placement);
        self.rows.clear();
        self.rows.resize(n * n, 0);
        add_solid(self.level, &object.solid, &fine, 0.0, n, &mut self.rows);
    }
}
