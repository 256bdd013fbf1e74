//! Exact Euclidean clusters of the points above a plane.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::{frame::DepthFrame, plane::Plane};

/// Thresholds by which clusters are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusterRule {
    /// Points up to this far apart belong together [m].
    pub tolerance: f64,
    /// Points up to this height belong to the plane [m].
    pub min_height: f64,
    /// Smaller clusters are left out.
    pub min_points: usize,
}

impl Default for ClusterRule {
    fn default() -> Self {
        Self { tolerance: 0.02, min_height: 0.008, min_points: 100 }
    }
}

/// Pixels that belong together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cluster {
    /// Pixels by index in the picture without distortion, in order.
    pub pixels: Vec<u32>,
    /// Whether the picture's border cuts it.
    pub touches_border: bool,
}

impl Cluster {
    /// Creates a cluster of pixels that belong together, in order.
    pub fn of_pixels(frame: &DepthFrame, pixels: Vec<u32>) -> Self {
        Self { touches_border: pixels.iter().any(|pixel| frame.is_at_border(*pixel)), pixels }
    }
}

/// Clusters of the points above a plane, or of all points without one: two points are of one cluster exactly when a chain of
/// steps of at most the tolerance leads from one to the other. The largest comes first, then the one whose first pixel does.
///
/// # Panics
/// If the tolerance is not positive.
pub fn find_clusters(frame: &DepthFrame, plane: Option<&Plane>, rule: &ClusterRule) -> Vec<Cluster> {
    assert!(rule.tolerance > 0.0, "a tolerance");
    clusters_of(frame, &frame.points(), plane, rule)
}

/// [`find_clusters`] with the picture's points.
pub(crate) fn clusters_of(
    frame: &DepthFrame,
    points: &[(u32, Point3<f64>)],
    plane: Option<&Plane>,
    rule: &ClusterRule,
) -> Vec<Cluster> {
    let is_above = |point: &Point3<f64>| plane.is_none_or(|plane| plane.height(point) > rule.min_height);
    let above: Vec<(u32, Point3<f64>)> = points.iter().filter(|(_, point)| is_above(point)).copied().collect();
    largest_first(frame, joined(&above, rule.tolerance), rule.min_points)
}

/// Clusters of the sets with at least the smallest count of pixels: the largest first; of equal ones, the one that begins first.
pub(crate) fn largest_first(frame: &DepthFrame, sets: Vec<Vec<u32>>, min_points: usize) -> Vec<Cluster> {
    let large = sets.into_iter().filter(|pixels| !pixels.is_empty() && pixels.len() >= min_points);
    let mut clusters: Vec<Cluster> = large.map(|pixels| Cluster::of_pixels(frame, pixels)).collect();
    clusters.sort_by(|a, b| b.pixels.len().cmp(&a.pixels.len()).then(a.pixels[0].cmp(&b.pixels[0])));
    clusters
}

/// Pixels of each connected set, in order.
fn joined(points: &[(u32, Point3<f64>)], tolerance: f64) -> Vec<Vec<u32>> {
    // Points of one cell are within reach of each other; cells further apart than two never are.
    const REACH: i32 = 2;
    let cells = cells_of(points, tolerance / 3.0_f64.sqrt() * (1.0 - 1e-12));
    let mut parents: Vec<usize> = (0..cells.len()).collect();
    let square = tolerance * tolerance;
    // Each pair of cells once. Cells are in order, and so are those that lie at one offset from them in x and y: a cursor finds
    // the first of these.
    let columns = (0..=REACH).flat_map(|x| (-REACH..=REACH).map(move |y| [x, y])).filter(|column| *column >= [0; 2]);
    for [x, y] in columns {
        let mut cursor = 0;
        for (index, (cell, members)) in cells.iter().enumerate() {
            let lowest = if [x, y] == [0; 2] { 1 } else { -REACH };
            let at = |z: i32| [cell[0].saturating_add(x), cell[1].saturating_add(y), cell[2].saturating_add(z)];
            cursor += cells[cursor..].iter().take_while(|(other, _)| *other < at(lowest)).count();
            let near = cells[cursor..].iter().take_while(|(other, _)| *other <= at(REACH)).enumerate();
            for (offset, (_, others)) in near {
                let (a, b) = (root(&mut parents, index), root(&mut parents, cursor + offset));
                let touches = |a: &usize| others.iter().any(|b| (points[*a].1 - points[*b].1).norm_squared() <= square);
                if a != b && members.iter().any(touches) {
                    parents[a.max(b)] = a.min(b);
                }
            }
        }
    }
    let mut sets: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    for (index, (_, members)) in cells.iter().enumerate() {
        sets.entry(root(&mut parents, index)).or_default().extend(members.iter().map(|member| points[*member].0));
    }
    sets.into_values()
        .map(|mut pixels| {
            pixels.sort_unstable();
            pixels
        })
        .collect()
}

/// Cells of a side that hold points, in order, with the indices of these.
fn cells_of(points: &[(u32, Point3<f64>)], side: f64) -> Vec<([i32; 3], Vec<usize>)> {
    let mut index_of: BTreeMap<[i32; 3], usize> = BTreeMap::new();
    let mut cells: Vec<([i32; 3], Vec<usize>)> = Vec::new();
    // Points of pixels side by side are mostly in one cell.
    let mut last = 0;
    for (index, (_, point)) in points.iter().enumerate() {
        let cell = std::array::from_fn(|axis| (point[axis] / side).floor() as i32);
        if cells.get(last).is_none_or(|(known, _)| *known != cell) {
            last = *index_of.entry(cell).or_insert(cells.len());
            if last == cells.len() {
                cells.push((cell, Vec::new()));
            }
        }
        cells[last].1.push(index);
    }
    cells.sort_unstable_by_key(|(cell, _)| *cell);
    cells
}

fn root(parents: &mut [usize], mut at: usize) -> usize {
    while parents[at] != at {
        parents[at] = parents[parents[at]];
        at = parents[at];
    }
    at
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn clusters_are_the_chains_of_the_definition(
            points in prop::collection::vec(prop::array::uniform3(-0.1..0.1_f64), 0..120),
            tolerance in 0.005..0.06_f64,
        ) {
            let points: Vec<(u32, Point3<f64>)> =
                points.iter().enumerate().map(|(index, point)| (index as u32, Point3::from(*point))).collect();
            // Flood fill over all pairs.
            let mut sets: BTreeSet<Vec<u32>> = BTreeSet::new();
            let mut left: BTreeSet<usize> = (0..points.len()).collect();
            while let Some(first) = left.pop_first() {
                let (mut set, mut front) = (vec![first as u32], vec![first]);
                while let Some(at) = front.pop() {
                    let near = |other: &usize| (points[at].1 - points[*other].1).norm_squared() <= tolerance * tolerance;
                    let reached: Vec<usize> = left.iter().copied().filter(near).collect();
                    reached.iter().for_each(|other| _ = left.remove(other));
                    set.extend(reached.iter().map(|other| *other as u32));
                    front.extend(reached);
                }
                set.sort_unstable();
                sets.insert(set);
            }
            prop_assert_eq!(joined(&points, tolerance).into_iter().collect::<BTreeSet<_>>(), sets);
        }
    }
}
