//! A cluster as a completion network's input.

use kernel::{
    geom::{GridPlacement, OccupancyGrid, SimdLevel},
    voxel::{NoGrid, ViewGrids},
};
use nalgebra::Point3;

use crate::{clusters::Cluster, frame::DepthFrame, plane::Plane};

/// A pixel with fewer neighbours than this nearby flies between two surfaces.
const MIN_NEIGHBOURS: usize = 4;
/// Neighbours are looked for this many pixels around, and lie within as many footprints of a pixel.
const NEIGHBOURHOOD: u32 = 3;

/// Why a cluster is no input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InputError {
    /// All its pixels are outliers, or see one point.
    #[error("{0}")]
    NoGrid(#[from] NoGrid),
}

/// Grids of one object in the camera's frame, as completion pairs have them.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkInput {
    /// Where the grids lie.
    pub placement: GridPlacement,
    /// Cells that hold a seen point of the object.
    pub partial: OccupancyGrid,
    /// Cells that the camera sees through, and those below the plane; what is neither free nor partial is unseen.
    pub free: OccupancyGrid,
    /// Pixels that the grids were made of, in order.
    pub pixels: Vec<u32>,
    /// Pixels of the cluster that were left out.
    pub outliers: Vec<u32>,
}

impl NetworkInput {
    /// The grids of a cluster. Cells behind a neighbour are unseen. As in completion pairs, pixels without a return see
    /// through.
    ///
    /// # Errors
    /// When too little of the cluster is left to place a grid by.
    pub fn new(
        frame: &DepthFrame,
        cluster: &Cluster,
        plane: Option<&Plane>,
        resolution: u32,
        level: SimdLevel,
    ) -> Result<Self, InputError> {
        let pixels = without_outliers(frame, &cluster.pixels);
        let crop = frame.crop_of(&pixels);
        let mut grids = ViewGrids::new(level);
        let placement = grids.place_grid(&crop, &frame.camera, resolution)?;
        let (mut partial, mut free) = (OccupancyGrid::new(resolution), OccupancyGrid::new(resolution));
        grids.partial(&crop, &frame.camera, &placement, false, &mut partial);
        grids.free(&frame.whole(), &frame.camera, &placement, &partial, &mut free);
        if let Some(plane) = plane {
            // Objects are single in training, with free space all around.
            let corner = placement.lower_corner();
            let centre = |index: u32| (f64::from(index) + 0.5) * placement.cell_size;
            for cell in (0..resolution.pow(3))
                .map(|at| [at / resolution / resolution, at / resolution % resolution, at % resolution])
            {
                let point = Point3::from(corner.coords + nalgebra::Vector3::from(cell.map(centre)));
                if plane.height(&point) < 0.0 && !partial.get(cell) {
                    free.set(cell);
                }
            }
        }
        let is_outlier = |pixel: &u32| pixels.binary_search(pixel).is_err();
        let outliers = cluster.pixels.iter().copied().filter(is_outlier).collect();
        Ok(Self { placement, partial, free, pixels, outliers })
    }
}

/// Pixels that have at least four neighbours among these within three pixels and three footprints: one flying pixel would
/// stretch the box that the grid is placed by.
pub fn without_outliers(frame: &DepthFrame, pixels: &[u32]) -> Vec<u32> {
    let mut is_member = vec![false; frame.depth.len()];
    pixels.iter().for_each(|pixel| is_member[*pixel as usize] = true);
    let (width, height) = (frame.camera.width, frame.camera.height);
    let is_held = |pixel: &u32| {
        let (column, row) = frame.column_and_row(*pixel);
        let (point, reach) = (frame.point(*pixel), f64::from(NEIGHBOURHOOD) * frame.footprint(*pixel));
        let rows = row.saturating_sub(NEIGHBOURHOOD)..=(row + NEIGHBOURHOOD).min(height - 1);
        let columns = column.saturating_sub(NEIGHBOURHOOD)..=(column + NEIGHBOURHOOD).min(width - 1);
        let around = rows.flat_map(|row| columns.clone().map(move |column| row * width + column));
        let is_near =
            |other: &u32| other != pixel && is_member[*other as usize] && (frame.point(*other) - point).norm() <= reach;
        around.filter(is_near).take(MIN_NEIGHBOURS).count() == MIN_NEIGHBOURS
    };
    pixels.iter().copied().filter(is_held).collect()
}
