//! The mirror of Bohg et al. ("Mind the gap", 2011): an object is completed by its image in an upright plane.

use std::collections::BTreeSet;

use kernel::geom::OccupancyGrid;
use nalgebra::{Matrix2, Rotation3, Unit, Vector3};

use crate::seen_cells::SeenCells;

/// Planes are turned about the vertical by up to this much in either sense [degrees], in steps.
const MAX_TURN: i32 = 30;
const TURN_STEP: i32 = 5;
/// Number of steps by which planes are shifted away from the camera, up to the observed depth.
const SHIFTS: u32 = 10;

/// Rule by which seen cells and their images become a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Union {
    /// Cells and images alone.
    Shell,
    /// Each stack along z from its first cell to its last.
    Filled,
}

/// Cells joined to their images in the best plane.
pub(crate) fn mirrored_by_plane(seen: &SeenCells<'_>, union: Union) -> OccupancyGrid {
    let mut complete = seen.partial.clone();
    let Some(images) = best_images(seen) else { return complete };
    let n = seen.partial.resolution();
    images.into_iter().filter_map(|image| cell_of(image, n)).for_each(|cell| complete.set(cell));
    if union == Union::Filled {
        for (x, y) in (0..n).flat_map(|x| (0..n).map(move |y| (x, y))) {
            let first = (0..n).find(|z| complete.get([x, y, *z]));
            let last = (0..n).rev().find(|z| complete.get([x, y, *z]));
            if let (Some(first), Some(last)) = (first, last) {
                (first..=last).for_each(|z| complete.set([x, y, z]));
            }
        }
    }
    complete
}

/// Images of the seen cells' centres [cells] in the plane with the best score: the share of images that lie neither in a
/// cell that the camera sees through nor beside the silhouette. Among equal ones the smallest shift wins, then the smallest
/// turn.
fn best_images(seen: &SeenCells<'_>) -> Option<Vec<Vector3<f64>>> {
    let points: Vec<Vector3<f64>> =
        seen.partial.cells().map(|cell| Vector3::from(cell.map(|index| f64::from(index) + 0.5))).collect();
    let up = Unit::try_new(seen.up(), 1e-9)?;
    if points.is_empty() {
        return None;
    }
    let silhouette = Silhouette::new(seen, &points);
    let centroid = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let across = smaller_axis(&points, &centroid, &up)?;
    let depths = points.iter().map(|point| point.z);
    let extent = depths.clone().fold(f64::MIN, f64::max) - depths.fold(f64::MAX, f64::min) + 1.0;
    let turns = (0..=MAX_TURN / TURN_STEP).flat_map(|step| [step * TURN_STEP, -step * TURN_STEP]);
    let turns: Vec<i32> = turns.skip(1).collect();
    let mut best: Option<(usize, Vec<Vector3<f64>>)> = None;
    for shift in 0..=SHIFTS {
        for turn in &turns {
            let normal = Rotation3::from_axis_angle(&up, f64::from(*turn).to_radians()) * across;
            let offset = normal.dot(&centroid) + extent * f64::from(shift) / f64::from(SHIFTS);
            let image = |point: &Vector3<f64>| point + normal * (2.0 * (offset - normal.dot(point)));
            let images: Vec<Vector3<f64>> = points.iter().map(image).collect();
            let score = images.iter().filter(|image| silhouette.allows(image)).count();
            if best.as_ref().is_none_or(|(most, _)| score > *most) {
                best = Some((score, images));
            }
        }
    }
    best.map(|(_, images)| images)
}

/// The horizontal direction in which points spread least, away from the camera.
fn smaller_axis(points: &[Vector3<f64>], centroid: &Vector3<f64>, up: &Unit<Vector3<f64>>) -> Option<Vector3<f64>> {
    // Away from the camera, as far as that is horizontal; a camera that looks straight down has its picture's up.
    let horizontal = |direction: Vector3<f64>| direction - up.into_inner() * up.dot(&direction);
    let away =
        horizontal(Vector3::z()).try_normalize(1e-6).or_else(|| horizontal(-Vector3::y()).try_normalize(1e-6))?;
    let beside = up.cross(&away);
    let mut scatter = Matrix2::zeros();
    for point in points {
        let offset = nalgebra::Vector2::new((point - centroid).dot(&away), (point - centroid).dot(&beside));
        scatter += offset * offset.transpose();
    }
    let eigen = scatter.symmetric_eigen();
    // Points that spread alike in all directions have no axis of their own.
    let [one, other] = [eigen.eigenvalues[0], eigen.eigenvalues[1]];
    if (one - other).abs() <= 1e-9 * (one + other) {
        return Some(away);
    }
    let axis = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let direction = away * axis[0] + beside * axis[1];
    Some(if direction.dot(&away) < 0.0 { -direction } else { direction })
}

/// Directions from the eye in which something of the object was seen, and cells known to be free.
struct Silhouette<'a> {
    free: Option<&'a OccupancyGrid>,
    resolution: u32,
    eye: Vector3<f64>,
    /// Depth from the eye at which the bins of directions are a cell wide [cells].
    depth: f64,
    bins: BTreeSet<[i64; 2]>,
}

impl<'a> Silhouette<'a> {
    fn new(seen: &SeenCells<'a>, points: &[Vector3<f64>]) -> Self {
        let eye = Vector3::from(seen.placement.coordinates_of([0.0; 3]));
        // By the nearest point, so that no bin is narrower than a cell looks.
        let depth = points.iter().map(|point| point.z - eye.z).fold(f64::MAX, f64::min);
        let empty = Self { free: seen.free, resolution: seen.partial.resolution(), eye, depth, bins: BTreeSet::new() };
        let bins = points.iter().flat_map(|point| {
            let [u, v] = empty.bin(point);
            (-1..=1).flat_map(move |du| (-1..=1).map(move |dv| [u + du, v + dv]))
        });
        let bins = bins.collect();
        Self { bins, ..empty }
    }

    fn bin(&self, point: &Vector3<f64>) -> [i64; 2] {
        let ray = (point - self.eye) * (self.depth / (point.z - self.eye.z));
        [ray.x, ray.y].map(|value| value.floor() as i64)
    }

    fn allows(&self, image: &Vector3<f64>) -> bool {
        let is_free = || {
            let cell = cell_of(*image, self.resolution);
            self.free.zip(cell).is_some_and(|(free, cell)| free.get(cell))
        };
        self.bins.contains(&self.bin(image)) && !is_free()
    }
}

/// The cell that holds a point; `None` outside of the grid.
fn cell_of(point: Vector3<f64>, n: u32) -> Option<[u32; 3]> {
    let cell: [f64; 3] = point.map(f64::floor).into();
    cell.iter().all(|index| (0.0..f64::from(n)).contains(index)).then(|| cell.map(|index| index as u32))
}

#[cfg(test)]
mod tests {
    use kernel::geom::GridPlacement;

    use super::*;
    use crate::seen_cells::SupportPlane;

    /// The front and the left wall of a box 8 wide and 6 deep, from an eye far away.
    fn two_walls() -> (OccupancyGrid, OccupancyGrid, GridPlacement) {
        let n = 24;
        let placement = GridPlacement { resolution: n, centre: [0.0, 0.0, 1e4].into(), cell_size: 0.01 };
        let (mut partial, mut free) = (OccupancyGrid::new(n), OccupancyGrid::new(n));
        for [x, y, z] in (0..n.pow(3)).map(|at| [at / n / n, at / n % n, at % n]) {
            let is_inside = (8..16).contains(&x) && (9..15).contains(&y);
            if is_inside && z == 7 {
                partial.set([x, y, z]);
            }
            // All of what is beside the box, and before it.
            if !is_inside || z < 7 {
                free.set([x, y, z]);
            }
        }
        (partial, free, placement)
    }

    #[test]
    fn a_wall_across_the_view_is_doubled_and_nothing_is_seen_through() {
        let (partial, free, placement) = two_walls();
        let seen =
            SeenCells { partial: &partial, free: Some(&free), points: &[], placement: &placement, support: None };
        let shell = mirrored_by_plane(&seen, Union::Shell);
        // The wall is flat: its image in itself contradicts nothing, and the smallest shift wins.
        assert_eq!(shell, partial);
        // A camera that looks straight down finds a plane, too.
        let from_above = SupportPlane { normal: -Vector3::z(), offset: 0.5 };
        let above = SeenCells { support: Some(from_above), ..seen };
        assert!(mirrored_by_plane(&above, Union::Shell).count() >= partial.count());
        let empty = OccupancyGrid::new(24);
        assert_eq!(mirrored_by_plane(&SeenCells { partial: &empty, ..seen }, Union::Filled).count(), 0);
    }

    #[test]
    fn the_seen_half_of_a_round_column_becomes_a_whole_one() {
        let (n, middle, radius) = (40, 19.5_f64, 9.0);
        let placement = GridPlacement { resolution: n, centre: [0.0, 0.0, 1e4].into(), cell_size: 0.01 };
        let (mut partial, mut free, mut truth) = (OccupancyGrid::new(n), OccupancyGrid::new(n), OccupancyGrid::new(n));
        for [x, y, z] in (0..n.pow(3)).map(|at| [at / n / n, at / n % n, at % n]) {
            let (across, along) = (f64::from(x) - middle, f64::from(z) - middle);
            let distance = (across * across + along * along).sqrt();
            let is_tall = (10..30).contains(&y);
            if is_tall && distance < radius + 0.5 {
                truth.set([x, y, z]);
                if distance > radius - 0.7 && along < 0.0 {
                    partial.set([x, y, z]);
                }
            } else if !is_tall || across.abs() > radius + 0.5 || along < 0.0 {
                free.set([x, y, z]);
            }
        }
        let seen =
            SeenCells { partial: &partial, free: Some(&free), points: &[], placement: &placement, support: None };
        let filled = mirrored_by_plane(&seen, Union::Filled);
        let shell = mirrored_by_plane(&seen, Union::Shell);
        assert!(shell.count() < filled.count() && shell.count() > partial.count());
        let overlap = |found: &OccupancyGrid| {
            let both = f64::from(found.count_both(&truth));
            both / (f64::from(found.count()) + f64::from(truth.count()) - both)
        };
        assert!(overlap(&filled) > overlap(&partial) + 0.3, "{} {}", overlap(&filled), overlap(&partial));
        assert_eq!(filled.count_both(&free), 0, "nothing of it was seen through");
    }
}
