//! Signed distance by fast marching, as the thesis's code had it from scikit-fmm.
//!
//! Sethian, "A fast marching level set method for monotonically advancing fronts" (1996); second-order one-sided
//! differences after Sethian, "Level Set Methods and Fast Marching Methods" (1999), ch. 8. What these leave open was
//! found by comparing values with scikit-fmm 2025.6.23:
//! - a cell next to the contour has the value `1 / sqrt(sum of 1 / crossing^2)` over its axes with a neighbour across;
//! - cells of exactly equal value are accepted together;
//! - a trial value is computed again, and may rise, whenever a cell one or two steps away is accepted;
//! - quirk: on each axis the lower neighbour is tried first, and where the upper one is nearer but has no second cell
//!   behind it, the cell behind the lower neighbour is used.
//!
//! Because equal values are accepted together, sums are in a fixed order: last bits decide what is equal.

use std::{cmp::Ordering, collections::BinaryHeap};

use super::AxisGrid;

/// Signed distance [cells] to the contour half-way between cells of different labels, by second-order fast marching.
///
/// `inside` and the result have one value per cell, in the order of the grid; the result is negative inside. All six axes
/// count in cells, and periodic axes wrap. This is `skfmm.distance(0.5 - inside, dx=1, order=2, periodic=...)` of
/// scikit-fmm, rounded to `f32`; the thesis's files hold the opposite sign. Where no cell has the other label the
/// distance is infinite (scikit-fmm refuses): +inf everywhere when nothing is inside, -inf when everything is.
///
/// # Panics
/// When `inside` has not one value per cell.
pub fn signed_distance_thesis(inside: &[bool], grid: &AxisGrid) -> Vec<f32> {
    assert_eq!(inside.len(), grid.cells(), "one label per cell");
    let mut march = March::next_to_contour(inside, grid);
    march.run();
    march.distance.iter().map(|distance| *distance as f32).collect()
}

/// No such cell: beyond the end of an axis.
const NONE: u32 = u32::MAX;

/// Cells one and two steps away.
type Line = [u32; 2];

/// A cell with a tentative distance; the heap's greatest is the nearest.
struct Trial {
    distance: f64,
    cell: u32,
}

impl Ord for Trial {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.cell.cmp(&self.cell))
    }
}

impl PartialOrd for Trial {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Trial {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Trial {}

/// An axis as the march sees it.
struct Ring {
    stride: u32,
    count: u32,
    periodic: bool,
}

struct March<'a> {
    inside: &'a [bool],
    rings: [Ring; 6],
    /// Signed; of use where accepted.
    distance: Vec<f64>,
    accepted: Vec<bool>,
    /// Tentative, not signed; infinite where none.
    tentative: Vec<f64>,
    trials: BinaryHeap<Trial>,
}

impl<'a> March<'a> {
    /// Accepts the cells with a neighbour of the other label.
    fn next_to_contour(inside: &'a [bool], grid: &AxisGrid) -> Self {
        let rings = std::array::from_fn(|k| {
            let axis = &grid.axes()[k];
            Ring { stride: grid.strides()[k] as u32, count: axis.count as u32, periodic: axis.periodic }
        });
        let sign = |inside: &bool| if *inside { -1.0 } else { 1.0 };
        let mut march = Self {
            inside,
            rings,
            distance: inside.iter().map(|inside| sign(inside) * f64::INFINITY).collect(),
            accepted: vec![false; inside.len()],
            tentative: vec![f64::INFINITY; inside.len()],
            trials: BinaryHeap::new(),
        };
        for (cell, label) in inside.iter().enumerate() {
            let across = |line: &Line| line[0] != NONE && inside[line[0] as usize] != *label;
            let axes = march.lines(cell).iter().filter(|lines| lines.iter().any(across)).count();
            if axes > 0 {
                // Each crossing is half a cell away.
                march.distance[cell] = sign(label) * (1.0 / (4.0 * axes as f64)).sqrt();
                march.accepted[cell] = true;
            }
        }
        march
    }

    /// For each axis the cells below and above.
    fn lines(&self, cell: usize) -> [[Line; 2]; 6] {
        let cell = cell as u32;
        self.rings.each_ref().map(|&Ring { stride, count, periodic }| {
            let index = cell / stride % count;
            let first = cell - index * stride;
            let down = |steps: u32| match index.checked_sub(steps) {
                Some(to) => first + to * stride,
                None if periodic => first + (index + steps * count - steps) % count * stride,
                None => NONE,
            };
            let up = |steps: u32| match index + steps {
                to if to < count => first + to * stride,
                to if periodic => first + to % count * stride,
                _ => NONE,
            };
            [[down(1), down(2)], [up(1), up(2)]]
        })
    }

    fn run(&mut self) {
        for cell in 0..self.inside.len() {
            let by_accepted = |line: &Line| line[0] != NONE && self.accepted[line[0] as usize];
            if !self.accepted[cell] && self.lines(cell).iter().flatten().any(by_accepted) {
                self.try_cell(cell);
            }
        }
        let mut equal = Vec::new();
        // The last round in which a cell was tried: once a round is enough.
        let (mut tried, mut round) = (vec![0_u32; self.inside.len()], 0);
        while self.accept_nearest(&mut equal) {
            round += 1;
            for cell in &equal {
                for [near, far] in self.lines(*cell).into_iter().flatten() {
                    if near == NONE {
                        continue;
                    }
                    // Behind an accepted cell, its other neighbour has a new second cell.
                    let next = if self.accepted[near as usize] { far } else { near };
                    if next != NONE && !self.accepted[next as usize] && tried[next as usize] != round {
                        tried[next as usize] = round;
                        self.try_cell(next as usize);
                    }
                }
            }
        }
    }

    /// Accepts all trial cells of the smallest distance; false when there is none.
    fn accept_nearest(&mut self, equal: &mut Vec<usize>) -> bool {
        equal.clear();
        let mut min = None;
        while let Some(Trial { distance, cell }) = self.trials.peek() {
            let (distance, cell) = (*distance, *cell as usize);
            if min.is_some_and(|min| distance > min) {
                break;
            }
            self.trials.pop();
            // Left behind by a later trial of the cell, or a second entry.
            if self.accepted[cell] || self.tentative[cell] != distance {
                continue;
            }
            min = Some(distance);
            self.accepted[cell] = true;
            self.distance[cell] = if self.inside[cell] { -distance } else { distance };
            equal.push(cell);
        }
        min.is_some()
    }

    fn try_cell(&mut self, cell: usize) {
        let distance = self.upwind(cell);
        if distance != self.tentative[cell] {
            self.tentative[cell] = distance;
            self.trials.push(Trial { distance, cell: cell as u32 });
        }
    }

    /// Distance of a cell from its accepted neighbours, at least one.
    fn upwind(&self, cell: usize) -> f64 {
        let side = |distance: f64| if self.inside[cell] { -distance } else { distance };
        let value = |cell: u32| {
            let accepted = cell != NONE && self.accepted[cell as usize];
            accepted.then(|| side(self.distance[cell as usize]))
        };
        let (mut upwind, mut axes) = ([(0.0, None); 6], 0);
        for lines in self.lines(cell) {
            let mut nearest = f64::INFINITY;
            let mut behind = None;
            for [near, far] in lines {
                if let Some(near) = value(near).filter(|near| *near < nearest) {
                    nearest = near;
                    // The quirk: `behind` keeps what the lower neighbour left there.
                    behind = value(far).filter(|far| *far <= near).or(behind);
                }
            }
            if nearest < f64::INFINITY {
                upwind[axes] = (nearest, behind);
                axes += 1;
            }
        }
        let upwind = &mut upwind[..axes];
        if let Some(distance) = eikonal(upwind) {
            return distance;
        }
        for (_, behind) in upwind.iter_mut() {
            *behind = None;
        }
        if let Some(distance) = eikonal(upwind) {
            return distance;
        }
        // First order with the nearest axes only; one axis always has a root.
        upwind.sort_by(|a, b| a.0.total_cmp(&b.0));
        (1..axes).rev().find_map(|axes| eikonal(&upwind[..axes])).unwrap_or(upwind[0].0 + 1.0)
    }
}

/// The greater root T of `sum of (difference of T along an axis)^2 = 1`; one-sided, of second order where a second value
/// is given.
fn eikonal(upwind: &[(f64, Option<f64>)]) -> Option<f64> {
    let (mut a, mut b, mut c) = (0.0, 0.0, 0.0);
    for (near, behind) in upwind {
        let (weight, from) = match behind {
            // (3 T - 4 near + behind) / 2 = 3/2 (T - from).
            Some(behind) => (9.0 / 4.0, 1.0 / 3.0 * (4.0 * near - behind)),
            None => (1.0, *near),
        };
        a += weight;
        b -= 2.0 * weight * from;
        c += weight * (from * from);
    }
    c -= 1.0;
    let discriminant = b * b - 4.0 * a * c;
    (discriminant >= 0.0).then(|| (-b + discriminant.sqrt()) / (2.0 * a))
}

#[cfg(test)]
mod tests {
    use super::{super::fixtures::*, *};
    use std::time::Instant;

    /// A field over x and y only, as rows.
    fn plane(rows: &[&[u8]]) -> Vec<f32> {
        let shape = [rows.len(), rows[0].len(), 1, 1, 1, 1];
        let labels: Vec<bool> = rows.concat().iter().map(|label| *label == 1).collect();
        signed_distance_thesis(&labels, &grid([0.0; 6], [0.1; 6], shape, [false; 6]))
    }

    fn assert_near(field: &[f32], expected: &[f64]) {
        for (value, expected) in field.iter().zip(expected) {
            assert!((f64::from(*value) - expected).abs() < 1e-5, "{field:?} {expected:?}");
        }
    }

    #[test]
    fn a_line_counts_its_cells() {
        let field = plane(&[&[0, 0, 0, 0, 1, 1, 1, 0, 0, 0]]);
        assert_near(&field, &[3.5, 2.5, 1.5, 0.5, -0.5, -1.5, -0.5, 0.5, 1.5, 2.5]);
    }

    #[test]
    fn the_first_cells_are_worked_by_hand() {
        let field = plane(&[&[1, 0, 0], &[0, 0, 0], &[0, 0, 0]]);
        let corner = -1.0 / 8.0_f64.sqrt();
        // From 1/2 and the corner behind it; diagonally from two halves.
        let along = (2.0 + 4.0 * 0.5 - corner) / 3.0;
        let diagonal = 0.5 + 0.5_f64.sqrt();
        assert_near(&field[..5], &[corner, 0.5, along, 0.5, diagonal]);
        assert_eq!([field[3], field[6]], [field[1], field[2]]);
    }

    #[test]
    fn without_the_other_label_it_is_infinite() {
        let grid = small_grid();
        let field = |label| signed_distance_thesis(&vec![label; grid.cells()], &grid);
        assert!(field(false).iter().all(|value| *value == f32::INFINITY));
        assert!(field(true).iter().all(|value| *value == f32::NEG_INFINITY));
    }

    #[test]
    fn the_other_label_has_the_other_sign() {
        for grid in grids() {
            let labels = random_labels(&grid, 0.02, 8);
            let others: Vec<bool> = labels.iter().map(|label| !label).collect();
            let [field, other] = [labels, others].map(|labels| signed_distance_thesis(&labels, &grid));
            assert!(field.iter().zip(other).all(|(a, b)| *a == -b));
        }
    }

    #[test]
    #[should_panic(expected = "one label per cell")]
    fn a_missing_label_is_refused() {
        signed_distance_thesis(&[true], &small_grid());
    }

    #[test]
    fn the_fetch_grid_takes_a_second() {
        let grid = fetch_grid();
        let labels = blob_labels(&grid, 8, 5.0, 7);
        let start = Instant::now();
        let field = signed_distance_thesis(&labels, &grid);
        println!("{:?}", start.elapsed());
        assert!(field.iter().zip(&labels).all(|(value, label)| value.is_finite() && (*value < 0.0) == *label));
    }
}
