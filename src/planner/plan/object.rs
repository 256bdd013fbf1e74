//! Objects as a plan sees them: from an occupancy grid without a mesh, or from a closed mesh.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use kernel::{
    contact::ContactSurface,
    geom::{Axis, AxisGrid, AxisUnit, GridPlacement, OccupancyGrid, TriMesh, signed_distance_standard},
};
use robot::grasp::{DistanceField, ObjectSearch};
use surface::{CubeField, marching_cubes};

/// Free cells around a grid on each side: the lattice of a grid of 40^3 has 64^3 points.
const PADDING: usize = 12;

/// Cells along the longest side of the lattice of a mesh.
const MESH_CELLS: u32 = 64;

/// Largest resolution of a grid [cells].
const MAX_RESOLUTION: u32 = 128;

/// Why an object cannot be planned for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnplannableObject {
    /// A grid without an occupied cell.
    #[error("no cell of the grid of {resolution}^3 cells is occupied: complete the object first")]
    Empty {
        /// Cells along each axis.
        resolution: u32,
    },
    /// A grid of more cells than planned for, or whose placement has another resolution or no cell size.
    #[error(
        "a grid of {resolution}^3 cells, placed with {placed} cells of {cell_size} m along each axis: both must be the same, 1 to 128, and the size above 0"
    )]
    Placement {
        /// Cells along each axis of the grid.
        resolution: u32,
        /// Cells along each axis of the placement.
        placed: u32,
        /// Side of a cell [m].
        cell_size: f64,
    },
    /// A grid of seen cells with another resolution than the object's.
    #[error("{seen} seen cells along each axis of a grid of {resolution}: both grids must have the same placement")]
    Seen {
        /// Cells along each axis of the grid of seen cells.
        seen: u32,
        /// Cells along each axis of the object's grid.
        resolution: u32,
    },
    /// A mesh without a surface.
    #[error("a mesh of {triangles} triangles has no surface: {reason}")]
    NoSurface {
        /// Triangles of the mesh.
        triangles: usize,
        /// Missing property.
        reason: String,
    },
}

/// Cells of an object that the camera saw.
#[derive(Clone, Debug, PartialEq)]
struct SeenCells {
    cells: OccupancyGrid,
    placement: GridPlacement,
}

/// An object, prepared for plans: to grasp, or as a neighbour through its [surface](Self::surface).
///
/// A completed grid is prepared in milliseconds: an exact distance transform serves the searches, and the surface with exact
/// distances, which ratings need, is made on first use.
///
/// ```
/// use graspmill_planner::plan::PlanObject;
/// use kernel::geom::{GridPlacement, OccupancyGrid};
/// use nalgebra::Point3;
///
/// // A box of 12 x 12 x 20 cells of 4 mm.
/// let mut cells = OccupancyGrid::new(40);
/// (0..12 * 12 * 20).for_each(|cell| cells.set([14 + cell % 12, 14 + cell / 12 % 12, 10 + cell / 144]));
/// let placement = GridPlacement { resolution: 40, centre: Point3::origin(), cell_size: 0.004 };
/// let object = PlanObject::from_grid(&cells, &placement)?;
/// let inside = placement.lower_corner().coords.add_scalar(20.0 * 0.004);
/// assert!(object.surface().signed_distance(&inside.into()) < -0.02, "24 mm from the nearest side");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct PlanObject {
    search: ObjectSearch,
    seen: Option<SeenCells>,
}

impl PlanObject {
    /// An object from its occupied cells, completed or true. Its frame is that of the placement (`CameraCv` of a completed grid).
    ///
    /// # Errors
    /// When no cell is occupied, or the placement does not fit the grid.
    pub fn from_grid(cells: &OccupancyGrid, placement: &GridPlacement) -> Result<Self, UnplannableObject> {
        let (resolution, cell_size) = (cells.resolution(), placement.cell_size);
        let fits = resolution == placement.resolution && (1..=MAX_RESOLUTION).contains(&resolution);
        let has_size = cell_size.is_finite() && cell_size > 0.0;
        if !fits || !has_size {
            return Err(UnplannableObject::Placement { resolution, placed: placement.resolution, cell_size });
        }
        // Middle of the solid: every cell weighs the same.
        let (mut sum, mut count) = ([0u64; 3], 0u64);
        for cell in cells.cells() {
            sum = std::array::from_fn(|axis| sum[axis] + u64::from(cell[axis]));
            count += 1;
        }
        if count == 0 {
            return Err(UnplannableObject::Empty { resolution });
        }
        let corner = placement.lower_corner();
        let centre = corner + Vector3::from(sum).map(|sum| sum as f64 / count as f64 + 0.5) * cell_size;
        // Points of the lattice are middles of cells.
        let side = resolution as usize + 2 * PADDING;
        let first = corner + Vector3::repeat((0.5 - PADDING as f64) * cell_size);
        let distances = signed_distances(cells, cell_size, side);
        let mesh = zero_surface(&distances, &first, cell_size, side);
        let distances: Vec<f64> = distances.iter().map(|distance| f64::from(*distance)).collect();
        let field = DistanceField::from_lattice(&first, cell_size, [side; 3], &distances);
        let search = ObjectSearch::of_field(field, mesh, &centre).expect("an occupied cell has a surface");
        Ok(Self { search, seen: None })
    }

    /// An object from a closed mesh, wound outward, with its prepared surface; its frame is that of the mesh. Its mass is spread evenly
    /// over the inside.
    ///
    /// # Errors
    /// When the mesh encloses nothing.
    pub fn from_mesh(mesh: &TriMesh, surface: &Arc<ContactSurface>) -> Result<Self, UnplannableObject> {
        let refuse =
            |reason: &str| UnplannableObject::NoSurface { triangles: mesh.triangles.len(), reason: reason.to_owned() };
        let centre = centre_of_mass(mesh).ok_or_else(|| refuse("its volume is not above 0"))?;
        let field = DistanceField::with_cells(surface, MESH_CELLS);
        let search = ObjectSearch::of_field(field, mesh.clone(), &centre).ok_or_else(|| refuse("it has no extent"))?;
        Ok(Self { search: search.with_surface(surface), seen: None })
    }

    /// Marks the cells of a grid with the object's placement that the camera saw.
    ///
    /// # Errors
    /// When the placement does not fit the grid.
    pub fn with_seen_cells(self, cells: OccupancyGrid, placement: &GridPlacement) -> Result<Self, UnplannableObject> {
        let (seen, resolution) = (cells.resolution(), placement.resolution);
        if seen != resolution {
            return Err(UnplannableObject::Seen { seen, resolution });
        }
        Ok(Self { seen: Some(SeenCells { cells, placement: *placement }), ..self })
    }

    /// The surface with exact distances: an obstacle for the grasps of other objects.
    pub fn surface(&self) -> &Arc<ContactSurface> {
        self.search.surface()
    }

    /// The object as searches read it.
    pub fn search(&self) -> &ObjectSearch {
        &self.search
    }

    /// Whether the camera saw the cell of a point in `Object` [m], or one next to it; `None` where seen cells are not known.
    pub(super) fn is_seen(&self, point: &Point3<f64>) -> Option<bool> {
        let SeenCells { cells, placement } = self.seen.as_ref()?;
        let at = placement.coordinates_of([point.x, point.y, point.z]).map(|at| at.floor() as i64);
        let range = 0..i64::from(cells.resolution());
        let is_seen = |step: i64| {
            let cell = [at[0] + step % 3 - 1, at[1] + step / 3 % 3 - 1, at[2] + step / 9 - 1];
            cell.iter().all(|index| range.contains(index)) && cells.get(cell.map(|index| index as u32))
        };
        Some((0..27).any(is_seen))
    }
}

/// Exact signed distances [m] from the middles of a padded grid's cells to the border of the occupied ones, negative inside, in C order.
fn signed_distances(cells: &OccupancyGrid, cell_size: f64, side: usize) -> Vec<f32> {
    let along = |name| Axis { name, unit: AxisUnit::Metre, first: 0.0, step: cell_size, count: side, periodic: false };
    let single = |name| Axis { name, unit: AxisUnit::Radian, first: 0.0, step: 1.0, count: 1, periodic: false };
    let axes = [along("x"), along("y"), along("z"), single("roll"), single("pitch"), single("yaw")];
    let grid = AxisGrid::new(axes).expect("a grid of positions");
    let mut inside = vec![false; side.pow(3)];
    for cell in cells.cells() {
        let [x, y, z] = cell.map(|index| index as usize + PADDING);
        inside[(x * side + y) * side + z] = true;
    }
    signed_distance_standard(&inside, &grid, 1.0)
}

/// The surface on which the distances between the points of a lattice are 0: closed, wound outward.
fn zero_surface(distances: &[f32], first: &Point3<f64>, cell_size: f64, side: usize) -> TriMesh {
    let depths = distances.iter().map(|distance| -distance).collect();
    let field = CubeField::from_values(side, depths).expect("one value per point");
    marching_cubes(&field, 0.0, -1.0, |at| {
        std::array::from_fn(|axis| (first[axis] + (at[axis] - 0.5) * cell_size) as f32)
    })
}

/// Centre of mass of the inside of a closed mesh (divergence theorem); `None` where its volume is not above 0.
fn centre_of_mass(mesh: &TriMesh) -> Option<Point3<f64>> {
    let (mut volume, mut moment) = (0.0, Vector3::zeros());
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner.coords);
        let part = a.dot(&b.cross(&c)) / 6.0;
        volume += part;
        moment += (a + b + c) * (part / 4.0);
    }
    (volume > 0.0).then(|| Point3::from(moment / volume))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACEMENT: GridPlacement =
        GridPlacement { resolution: 40, centre: Point3::new(0.1, -0.2, 0.8), cell_size: 0.003 };

    /// Cells whose middles lie in a ball about the middle of the grid [cells].
    fn ball(radius: f64) -> OccupancyGrid {
        let mut cells = OccupancyGrid::new(40);
        for index in 0..40u32.pow(3) {
            let cell = [index / 1600, index / 40 % 40, index % 40];
            let squares = cell.map(|index| (f64::from(index) - 19.5).powi(2));
            if squares.iter().sum::<f64>() < radius * radius {
                cells.set(cell);
            }
        }
        cells
    }

    #[test]
    fn the_surface_of_a_grid_is_within_a_cell_of_the_truth() {
        let object = PlanObject::from_grid(&ball(14.0), &PLACEMENT).expect("occupied cells");
        let middle = PLACEMENT.lower_corner() + Vector3::repeat(20.0 * PLACEMENT.cell_size);
        assert!((object.search().middle() - middle).norm() < 1e-6);
        let mut worst = 0.0f64;
        for step in 0..500 {
            let z = 1.0 - (2.0 * f64::from(step) + 1.0) / 500.0;
            let (sin, cos) = libm::sincos(f64::from(step) * 2.4);
            let across = (1.0 - z * z).sqrt();
            let point = middle + Vector3::new(across * cos, across * sin, z) * 14.0 * PLACEMENT.cell_size;
            worst = worst.max(object.surface().signed_distance(&point).abs());
        }
        assert!(worst < 0.8 * PLACEMENT.cell_size, "{worst} m");
    }

    #[test]
    fn mass_is_in_the_middle_and_seen_cells_are_found() {
        let seen = |z: u32| {
            let mut cells = OccupancyGrid::new(40);
            cells.set([20, 20, z]);
            cells
        };
        let object = PlanObject::from_grid(&ball(10.0), &PLACEMENT).expect("occupied cells");
        let at = |z: f64| PLACEMENT.lower_corner() + Vector3::new(20.5, 20.5, z) * PLACEMENT.cell_size;
        assert_eq!(object.is_seen(&at(10.5)), None);
        let object = object.with_seen_cells(seen(10), &PLACEMENT).expect("the same placement");
        assert_eq!(
            [9.5, 10.5, 11.5, 12.5, -4.0].map(|z| object.is_seen(&at(z))),
            [true, true, true, false, false].map(Some)
        );
    }

    #[test]
    fn grids_and_meshes_without_an_object_are_refused() {
        let refused = |cells: &OccupancyGrid, placement: &GridPlacement| {
            PlanObject::from_grid(cells, placement).err().expect("nothing to plan for")
        };
        assert_eq!(refused(&OccupancyGrid::new(40), &PLACEMENT), UnplannableObject::Empty { resolution: 40 });
        let placement = GridPlacement { cell_size: f64::NAN, ..PLACEMENT };
        assert!(matches!(refused(&ball(5.0), &placement), UnplannableObject::Placement { .. }));
        assert!(matches!(refused(&OccupancyGrid::new(39), &PLACEMENT), UnplannableObject::Placement { .. }));
        assert_eq!(centre_of_mass(&TriMesh::default()), None);
    }

    #[test]
    fn a_full_grid_has_a_surface() {
        let mut cells = OccupancyGrid::new(4);
        cells.bytes_mut().fill(0xff);
        let placement = GridPlacement { resolution: 4, ..PLACEMENT };
        let object = PlanObject::from_grid(&cells, &placement).expect("occupied cells");
        assert!((object.search().radius() - 6.0 * 3f64.sqrt() * 1e-3).abs() < 0.3e-3, "{}", object.search().radius());
    }
}
