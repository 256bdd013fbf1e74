//! Baselines that complete a shape without learning, which a network must beat.

use std::fmt;

use kernel::geom::{GridPlacement, OccupancyGrid, convex_hull_planes};
use nalgebra::Point3;

use crate::{
    mirror::{Union, mirrored_by_plane},
    primitive::filled_primitive,
    seen_cells::{SeenCells, SupportPlane},
};

/// Cells this far outside of a facet still count as inside: the facets are rounded [cells].
const ON_FACET: f64 = 1e-4;

/// A baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Baseline {
    /// Observed cells only.
    Partial,
    /// Each observed cell extended along its ray to the last layer with an observed cell.
    Extrude,
    /// The convex hull of the observed cells' centres.
    Hull,
    /// The convex hull of the observed cells' centres and of their feet on the table.
    HullToTable,
    /// Each observed cell extended straight down to the table.
    ExtrudeToTable,
    /// Each observed cell joined to its mirror image behind the last layer with an observed cell.
    MirrorFar,
    /// Seen cells and their images in the upright plane that contradicts least of what was seen (Bohg et al. 2011), filled
    /// between the first and the last of each stack.
    Mirror,
    /// `thesis`: these cells and images as they are.
    MirrorShell,
    /// Observed cells and those of the ball, cylinder or box that explains the most observed points; no cells if none does.
    Primitive,
}

impl Baseline {
    /// All baselines.
    pub const ALL: [Self; 9] = [
        Self::Partial,
        Self::Extrude,
        Self::Hull,
        Self::HullToTable,
        Self::ExtrudeToTable,
        Self::MirrorFar,
        Self::Mirror,
        Self::MirrorShell,
        Self::Primitive,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Partial => "partial",
            Self::Extrude => "extrude",
            Self::Hull => "hull",
            Self::HullToTable => "hull-to-table",
            Self::ExtrudeToTable => "extrude-to-table",
            Self::MirrorFar => "mirror-far",
            Self::Mirror => "mirror",
            Self::MirrorShell => "mirror-shell",
            Self::Primitive => "primitive",
        }
    }

    /// The baseline of a name; `None` for any other text.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|baseline| baseline.name() == name)
    }

    /// Whether the baseline requires observed points in addition to cells.
    pub fn needs_points(self) -> bool {
        self == Self::Primitive
    }

    /// Whether the baseline requires a known table below the object.
    pub fn needs_table(self) -> bool {
        matches!(self, Self::HullToTable | Self::ExtrudeToTable)
    }

    /// Completes the observed cells.
    ///
    /// # Panics
    /// If the grids' resolutions are not the placement's, or a baseline that [needs a table](Self::needs_table) gets none.
    pub fn complete(self, seen: &SeenCells<'_>) -> OccupancyGrid {
        let SeenCells { partial, free, placement, .. } = *seen;
        assert!(free.is_none_or(|free| free.resolution() == placement.resolution), "grids match the placement");
        assert_eq!(partial.resolution(), placement.resolution, "the grid matches its placement");
        let table = || seen.support.expect("a table below the object");
        match self {
            Self::Partial => partial.clone(),
            Self::Extrude => extruded(partial, placement),
            Self::Hull => hull(partial, &[]),
            Self::HullToTable => hull(partial, &feet(partial, placement, &table())),
            Self::ExtrudeToTable => extruded_to_table(partial, placement, &table()),
            Self::MirrorFar => mirrored(partial),
            Self::Mirror => mirrored_by_plane(seen, Union::Filled),
            Self::MirrorShell => mirrored_by_plane(seen, Union::Shell),
            Self::Primitive => filled_primitive(seen),
        }
    }
}

impl fmt::Display for Baseline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Last layer along z that holds a seen cell.
fn last_layer(partial: &OccupancyGrid) -> u32 {
    partial.cells().map(|[_, _, z]| z).max().unwrap_or(0)
}

fn extruded(partial: &OccupancyGrid, placement: &GridPlacement) -> OccupancyGrid {
    let n = partial.resolution();
    let eye = placement.coordinates_of([0.0; 3]);
    let end = f64::from(last_layer(partial)) + 0.5;
    let mut complete = partial.clone();
    for cell in partial.cells() {
        let seen = cell.map(|index| f64::from(index) + 0.5);
        // Half a layer at a time.
        for step in 0..2 * n {
            let depth = (seen[2] + f64::from(step) / 2.0).min(end);
            let along = (depth - eye[2]) / (seen[2] - eye[2]);
            let point: [f64; 3] = std::array::from_fn(|axis| eye[axis] + (seen[axis] - eye[axis]) * along);
            if point.iter().all(|value| (0.0..f64::from(n)).contains(value)) {
                complete.set(point.map(|value| value as u32));
            }
            if depth >= end {
                break;
            }
        }
    }
    complete
}

fn mirrored(partial: &OccupancyGrid) -> OccupancyGrid {
    let (n, end) = (partial.resolution(), last_layer(partial));
    let mut complete = partial.clone();
    for (x, y) in (0..n).flat_map(|x| (0..n).map(move |y| (x, y))) {
        if let Some(first) = (0..n).find(|z| partial.get([x, y, *z])) {
            (first..=(2 * end - first).min(n - 1)).for_each(|z| complete.set([x, y, z]));
        }
    }
    complete
}

/// Centre of a cell in cells.
fn centre(cell: [u32; 3]) -> Point3<f64> {
    Point3::from(cell.map(|index| f64::from(index) + 0.5))
}

/// Points of the table straight below the observed cells' centres, in cells; none for centres that are not above it.
fn feet(partial: &OccupancyGrid, placement: &GridPlacement, table: &SupportPlane) -> Vec<Point3<f64>> {
    partial.cells().filter_map(|cell| Some(centre(cell) - table.normal * height_of(cell, placement, table)?)).collect()
}

/// Height of a cell's centre above the table, in cells; `None` below it.
fn height_of(cell: [u32; 3], placement: &GridPlacement, table: &SupportPlane) -> Option<f64> {
    let point = placement.lower_corner() + centre(cell).coords * placement.cell_size;
    let height = table.height(&point) / placement.cell_size;
    (height > 0.0).then_some(height)
}

/// Each observed cell and the cells straight below it, to the last whose centre is above the table.
fn extruded_to_table(partial: &OccupancyGrid, placement: &GridPlacement, table: &SupportPlane) -> OccupancyGrid {
    let n = partial.resolution();
    let mut complete = partial.clone();
    for cell in partial.cells() {
        let Some(height) = height_of(cell, placement, table) else { continue };
        // Half a cell at a time.
        for step in 1..=(2.0 * height) as u32 {
            let point = centre(cell) - table.normal * (0.5 * f64::from(step));
            if point.iter().all(|value| (0.0..f64::from(n)).contains(value)) {
                let below: [u32; 3] = [point.x as u32, point.y as u32, point.z as u32];
                if height_of(below, placement, table).is_some() {
                    complete.set(below);
                }
            }
        }
    }
    complete
}

fn hull(partial: &OccupancyGrid, further: &[Point3<f64>]) -> OccupancyGrid {
    let centres: Vec<Point3<f64>> = partial.cells().map(centre).chain(further.iter().copied()).collect();
    let mut complete = partial.clone();
    // What is flat stays as it is.
    let Some(planes) = convex_hull_planes(&centres) else { return complete };
    let n = partial.resolution();
    for cell in (0..n.pow(3)).map(|at| [at / n / n, at / n % n, at % n]) {
        let centre = centre(cell);
        if planes.iter().all(|(normal, offset)| normal.dot(&centre.coords) <= offset + ON_FACET) {
            complete.set(cell);
        }
    }
    complete
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placement(n: u32, distance: f64) -> GridPlacement {
        GridPlacement { resolution: n, centre: [0.0, 0.0, distance].into(), cell_size: 0.01 }
    }

    fn grid(n: u32, cells: &[[u32; 3]]) -> OccupancyGrid {
        let mut grid = OccupancyGrid::new(n);
        cells.iter().for_each(|cell| grid.set(*cell));
        grid
    }

    fn completed(baseline: Baseline, partial: &OccupancyGrid, placement: &GridPlacement) -> OccupancyGrid {
        baseline.complete(&SeenCells { partial, free: None, points: &[], placement, support: None })
    }

    #[test]
    fn names_are_read_back() {
        for baseline in Baseline::ALL {
            assert_eq!(Baseline::from_name(&baseline.to_string()), Some(baseline));
        }
        assert_eq!(Baseline::from_name("magic"), None);
    }

    #[test]
    fn each_does_what_it_says_on_a_step() {
        // Two columns, seen at different depths, far from the eye so that rays are parallel to z.
        let (partial, placement) = (grid(10, &[[5, 5, 2], [4, 5, 6]]), placement(10, 1e6));
        let column =
            |complete: &OccupancyGrid, x: u32| -> Vec<u32> { (0..10).filter(|z| complete.get([x, 5, *z])).collect() };
        assert_eq!(completed(Baseline::Partial, &partial, &placement), partial);
        let complete = completed(Baseline::Extrude, &partial, &placement);
        assert_eq!((column(&complete, 5), column(&complete, 4)), ((2..=6).collect(), vec![6]));
        assert_eq!(complete.count(), 6);
        let complete = completed(Baseline::MirrorFar, &partial, &placement);
        assert_eq!((column(&complete, 5), column(&complete, 4)), ((2..10).collect(), vec![6]));
        assert_eq!(completed(Baseline::Hull, &partial, &placement), partial, "two cells have no hull with a volume");
        for baseline in Baseline::ALL.into_iter().filter(|baseline| !baseline.needs_table()) {
            assert_eq!(completed(baseline, &grid(10, &[]), &placement).count(), 0, "{baseline}");
        }
    }

    #[test]
    fn a_lid_above_a_table_becomes_a_solid_that_ends_at_it() {
        // A lid of 5 x 5 cells seen from above; the table is a plane across z = 0.5 m + 3 cells.
        let n = 20;
        let placement = placement(n, 0.5);
        let lid: Vec<[u32; 3]> = (0..25).map(|at| [8 + at / 5, 8 + at % 5, 5]).collect();
        let partial = grid(n, &lid);
        let table = SupportPlane { normal: -nalgebra::Vector3::z(), offset: 0.5 + 0.03 };
        let seen =
            SeenCells { partial: &partial, free: None, points: &[], placement: &placement, support: Some(table) };
        // The grid's centre is 9 cells deep, so the table is at 12 cells: layers 5 to 11 are above it.
        for baseline in [Baseline::HullToTable, Baseline::ExtrudeToTable] {
            let complete = baseline.complete(&seen);
            assert_eq!(complete.count(), 25 * 7, "{baseline}");
            assert!(
                complete.cells().all(|[x, y, z]| (8..13).contains(&x) && (8..13).contains(&y) && (5..12).contains(&z))
            );
            assert_eq!(baseline.complete(&SeenCells { partial: &grid(n, &[]), ..seen }).count(), 0, "{baseline}");
        }
    }

    #[test]
    fn extrusion_follows_rays_that_spread() {
        // An eye 20 cells before the grid's middle: cells at the side move outward with depth.
        let (partial, placement) = (grid(40, &[[28, 20, 10], [20, 20, 20]]), placement(40, 0.2));
        let complete = completed(Baseline::Extrude, &partial, &placement);
        let eye = placement.coordinates_of([0.0; 3]);
        let at = eye[0] + (28.5 - eye[0]) * (20.5 - eye[2]) / (10.5 - eye[2]);
        let last: Vec<u32> = (0..40).filter(|x| *x != 20 && complete.get([*x, 20, 20])).collect();
        // By half layers, so that the ray passes a cell on its way.
        assert_eq!(last, [34, 35]);
        assert_eq!(at as u32, 35, "outward");
    }

    #[test]
    fn the_hull_of_a_box_s_corners_is_the_box() {
        let corners: Vec<[u32; 3]> =
            (0..8).map(|index| [0, 1, 2].map(|axis| if index >> axis & 1 == 1 { 7 } else { 3 })).collect();
        let complete = completed(Baseline::Hull, &grid(12, &corners), &placement(12, 1.0));
        assert_eq!(complete.count(), 125);
        assert!(complete.cells().all(|cell| cell.iter().all(|index| (3..=7).contains(index))));
    }
}
