//! Objects that touch: the points above a plane are cut at concave edges, and parts of one object are joined again.
//!
//! Two convex objects that touch meet in a concave edge, so that edges at which the surface turns towards the camera divide a
//! picture into objects: local convexity (Stein, Schoeler, Papon and Woergoetter 2014, "Object partitioning using local
//! convexity"), here on the pixels instead of supervoxels. What is left between the edges grows over them (region growing). A
//! single concave object, such as a mug, is cut as well; how its parts rest, how long their border is and where it lies tell
//! which of them belong together.

mod cut;
mod grid;
mod join;
mod relation;

use nalgebra::{Point3, Vector3};

use self::{
    cut::{Links, NONE, concave_cells, divide},
    grid::Grid,
    join::join_parts,
    relation::{Relations, Seen},
};
use crate::{
    clusters::{Cluster, ClusterRule, largest_first},
    frame::DepthFrame,
    plane::Plane,
};

/// Smallest count of cells of a seed, at the focal length of a Kinect.
const SEED: f64 = 250.0;

/// Threshold by which touching objects are told apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartitionRule {
    /// Smallest angle between the normals on both sides of a concave edge that divides parts [degree].
    pub concavity: f64,
}

impl PartitionRule {
    /// Largest distance of neighbouring pixels' points in one part [m], for [`ClusterRule::tolerance`].
    pub const GAP: f64 = 0.012;
}

impl Default for PartitionRule {
    fn default() -> Self {
        Self { concavity: 30.0 }
    }
}

/// Objects among the points above a plane, or among all points without one: parts of the picture between concave edges, in which
/// neighbouring pixels, also across holes of a few pixels, lie at most the tolerance apart. The largest comes first, then the one
/// whose first pixel does. Every pixel belongs to at most one.
///
/// Sources: Stein et al. 2014, "Object partitioning using local convexity", for the cut.
///
/// # Panics
/// If the tolerance is not positive.
pub fn find_parts(
    frame: &DepthFrame,
    plane: Option<&Plane>,
    clusters: &ClusterRule,
    rule: &PartitionRule,
) -> Vec<Cluster> {
    assert!(clusters.tolerance > 0.0, "a tolerance");
    parts_of(frame, &frame.points(), plane, clusters, rule)
}

/// [`find_parts`] with the picture's points.
pub(crate) fn parts_of(
    frame: &DepthFrame,
    points: &[(u32, Point3<f64>)],
    plane: Option<&Plane>,
    clusters: &ClusterRule,
    rule: &PartitionRule,
) -> Vec<Cluster> {
    let is_above = |point: &Point3<f64>| plane.is_none_or(|plane| plane.height(point) > clusters.min_height);
    let above: Vec<(u32, Point3<f64>)> = points.iter().filter(|(_, point)| is_above(point)).copied().collect();
    let Some(grid) = Grid::new(frame, &above) else { return Vec::new() };
    let surface = grid.surface(frame);
    let cosine = nalgebra::ComplexField::cos(rule.concavity.to_radians()) as f32;
    let cuts = concave_cells(&grid, &surface, cosine);
    let links = Links::new(&grid, clusters.tolerance as f32);
    let (parts, count) = divide(&grid, &links, &cuts, (SEED * grid.area).ceil() as usize);
    // Without a plane, a camera is held upright.
    let up = plane.map_or(-Vector3::y(), |plane| plane.normal.map(|value| value as f32));
    let seen = Seen { frame, plane, grid: &grid, surface: &surface, links: &links, up };
    let mut relations = Relations::new(&seen, &cuts, &parts, count);
    let owners = join_parts(&mut relations, clusters.min_points);
    let mut sets = vec![Vec::new(); count as usize];
    for cell in grid.objects.iter().map(|cell| *cell as usize).filter(|cell| parts[*cell] != NONE) {
        sets[owners[parts[cell] as usize] as usize].push(grid.pixels[cell]);
    }
    largest_first(frame, sets, clusters.min_points)
}

#[cfg(test)]
mod tests;
