//! The smoothest field whose sign is a volume's: step 5 of the thesis's algorithm 2.
//!
//! Lempitsky, "Surface extraction from binary volumes with higher-order smoothness" (2010): among all f whose sign is the
//! volume's, with a margin that grows with the distance to the border, the one with the smallest second differences. It is a
//! convex quadratic programme with a box for each voxel, solved by projected gradient descent with Nesterov's momentum. What is
//! summed over the volume is summed in one order, so the same bits come out on every processor.

use std::ops::Range;

use kernel::geom::SimdLevel;

use crate::{
    band::{Band, Variable},
    field::CubeField,
    volume::Volume,
};

/// Voxels up to this far from the border are variables [voxels].
const BAND: i32 = 4;
/// Voxels around the volume: what is empty outside takes part, with the neighbours of its neighbours.
pub(crate) const PADDING: usize = 6;
/// Value beyond the band, inside; negative outside.
const FAR: f32 = 5.0;
/// Largest value of a variable.
const LARGEST: f32 = 1000.0;
/// Squared distances above that of [`BAND`].
const BEYOND: u8 = u8::MAX;

/// Interval of the steps that are checked for convergence and for a restart of the momentum.
const WATCHED: u32 = 10;
/// A watched step that changes no variable by more is the last one [voxels].
const AT_REST: f32 = 2e-4;

/// A way to solve the programme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// Projected gradient steps with momentum, until nothing moves any more. The momentum starts anew where it leads up again
    /// (O'Donoghue and Candes 2015).
    Accelerated {
        /// Most steps.
        steps: u32,
    },
    /// `thesis`: damped, projected Jacobi sweeps, as the thesis's program has 500 of them; far from converged.
    DampedJacobi {
        /// Count of sweeps.
        sweeps: u32,
    },
}

/// A volume's quadratic programme: minimise the sum over rows of squared second differences along each axis, with each
/// variable between its bounds.
#[derive(Clone, Debug)]
pub struct SmoothingProblem {
    side: usize,
    /// Runs of voxels along z where the objective has a row per axis.
    rows: Vec<Range<usize>>,
    /// Runs of voxels along z that are variables: the rows' voxels and their neighbours.
    variables: Vec<Range<usize>>,
    lower: Vec<f32>,
    upper: Vec<f32>,
    /// Where the solver starts, and the field's values outside of the band.
    start: Vec<f32>,
}

/// A field and its bounds per voxel of a padded volume, in C order [voxels].
#[derive(Clone, Debug)]
pub(crate) struct Boxes {
    pub(crate) fields: Vec<f32>,
    pub(crate) lower: Vec<f32>,
    pub(crate) upper: Vec<f32>,
}

impl SmoothingProblem {
    /// The programme of a volume, padded by empty voxels.
    pub fn new(volume: &Volume) -> Self {
        let side = volume.side() + 2 * PADDING;
        Self::of_padded(&padded(volume, side), side)
    }

    /// The programme of voxels that are padded already.
    fn of_padded(occupied: &[bool], side: usize) -> Self {
        let squared = squared_distances(&border(occupied, side), side);
        let start = occupied.iter().map(|occupied| if *occupied { FAR } else { -FAR }).collect();
        let mut problem = Self::of_band(&squared, start, side);
        for index in problem.variables.iter().cloned().flatten() {
            let margin = f32::from(squared[index]).sqrt();
            let bounds = if occupied[index] { (margin, LARGEST) } else { (-LARGEST, -margin) };
            (problem.lower[index], problem.upper[index]) = bounds;
            problem.start[index] = if occupied[index] { margin } else { -margin };
        }
        problem
    }

    /// The programme of boxes in a padded volume; the border is where the fields in them change their sign.
    pub(crate) fn of_boxes(boxes: &Boxes, side: usize) -> Self {
        let occupied: Vec<bool> = boxes.fields.iter().map(|value| *value > 0.0).collect();
        let squared = squared_distances(&border(&occupied, side), side);
        let start = boxes.fields.iter().map(|value| if *value > 0.0 { FAR } else { -FAR }).collect();
        let mut problem = Self::of_band(&squared, start, side);
        for index in problem.variables.iter().cloned().flatten() {
            let (lower, upper) = (boxes.lower[index].max(-LARGEST), boxes.upper[index].min(LARGEST));
            (problem.lower[index], problem.upper[index]) = (lower, upper);
            problem.start[index] = boxes.fields[index].max(lower).min(upper);
        }
        problem
    }

    /// Rows and variables near a border, without bounds.
    fn of_band(squared: &[u8], start: Vec<f32>, side: usize) -> Self {
        // The band, opened by the cross of six neighbours, so that every row finds its neighbours among the variables.
        let near: Vec<u8> = squared.iter().map(|distance| u8::from(i32::from(*distance) <= BAND * BAND)).collect();
        let steps = strides(side);
        let mut is_row = vec![0; near.len()];
        for index in inner(side) {
            let neighbours = steps.iter().map(|step| near[index - step] & near[index + step]);
            is_row[index] = neighbours.fold(near[index], |all, both| all & both);
        }
        let mut is_variable = is_row.clone();
        for index in inner(side).filter(|index| is_row[*index] != 0) {
            steps.iter().for_each(|step| (is_variable[index - step], is_variable[index + step]) = (1, 1));
        }
        Self {
            side,
            rows: runs(&is_row, side),
            variables: runs(&is_variable, side),
            lower: vec![0.0; near.len()],
            upper: vec![0.0; near.len()],
            start,
        }
    }

    /// Voxels along each axis, with the padding.
    pub fn side(&self) -> usize {
        self.side
    }

    /// Indices of the variables in the padded volume, in C order.
    pub fn variables(&self) -> impl Iterator<Item = usize> + '_ {
        self.variables.iter().cloned().flatten()
    }

    /// Triples of indices in the padded volume, before, at and after: each is one row (1, -2, 1) of the objective.
    pub fn rows(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        let steps = strides(self.side);
        let rows = self.rows.iter().cloned().flatten();
        rows.flat_map(move |index| steps.map(|step| [index - step, index, index + step]))
    }

    /// Bounds of a variable by its index in the padded volume.
    pub fn bounds(&self, index: usize) -> (f32, f32) {
        (self.lower[index], self.upper[index])
    }

    /// Half the sum of squared second differences of a field over the padded volume.
    pub fn energy(&self, field: &CubeField) -> f64 {
        let value = |index: usize| f64::from(field.values()[index]);
        let squares = self.rows().map(|[before, at, after]| (value(before) - 2.0 * value(at) + value(after)).powi(2));
        0.5 * squares.sum::<f64>()
    }

    /// The solution over the padded volume; beyond the band it is 5 inside and -5 outside.
    pub fn solve(&self, solver: Solver) -> CubeField {
        self.solve_at(solver, SimdLevel::detect())
    }

    /// [`SmoothingProblem::solve`] by a usable level of vector instructions.
    fn solve_at(&self, solver: Solver, level: SimdLevel) -> CubeField {
        let (steps, accelerated) = match solver {
            Solver::Accelerated { steps } => (steps, true),
            Solver::DampedJacobi { sweeps } => (sweeps, false),
        };
        let rates = self.rates(accelerated);
        let variable =
            |index: usize| Variable { lower: self.lower[index], upper: self.upper[index], rate: rates[index] };
        let mut band = Band::new(self.side, &self.rows, &self.variables, &self.start, variable);
        let mut inertia = 1.0_f64;
        for step in 1..=steps {
            if !accelerated {
                band.step(0.0, level);
                continue;
            }
            let next = 0.5 * (1.0 + (1.0 + 4.0 * inertia * inertia).sqrt());
            let momentum = ((inertia - 1.0) / next) as f32;
            inertia = next;
            if step % WATCHED != 0 {
                band.step(momentum, level);
                continue;
            }
            let progress = band.watched_step(momentum, level);
            if progress.largest < AT_REST {
                break;
            }
            if progress.overshoots {
                band.forget_momentum();
                inertia = 1.0;
            }
        }
        let mut field = self.start.clone();
        band.write(&mut field);
        CubeField::from_values(self.side, field).expect("one value per voxel")
    }

    /// The length of a step by variable: one over a diagonal that bounds the objective's matrix from above, or `thesis`: over
    /// twice the matrix's own diagonal.
    fn rates(&self, accelerated: bool) -> Vec<f32> {
        // A row (1, -2, 1) adds to the diagonal its own squares, or, for the bound, each entry times the sum of all.
        let (centre, neighbour) = if accelerated { (8.0, 4.0) } else { (4.0, 1.0) };
        let mut diagonal = vec![0.0_f32; self.start.len()];
        for [before, at, after] in self.rows() {
            diagonal[before] += neighbour;
            diagonal[at] += centre;
            diagonal[after] += neighbour;
        }
        let damping = if accelerated { 1.0 } else { 2.0 };
        diagonal.iter().map(|sum| if *sum > 0.0 { 1.0 / (damping * sum) } else { 0.0 }).collect()
    }
}

/// From a voxel to the next along x, y and z.
fn strides(side: usize) -> [usize; 3] {
    [side * side, side, 1]
}

/// Voxels that have all their neighbours.
fn inner(side: usize) -> impl Iterator<Item = usize> {
    let range = 1..side - 1;
    let columns = range.clone().flat_map(move |x| (1..side - 1).map(move |y| (x * side + y) * side));
    columns.flat_map(move |column| range.clone().map(move |z| column + z))
}

fn padded(volume: &Volume, side: usize) -> Vec<bool> {
    let n = volume.side();
    let mut occupied = vec![false; side.pow(3)];
    for (index, row) in volume.voxels().chunks_exact(n).enumerate() {
        let (x, y) = (index / n + PADDING, index % n + PADDING);
        occupied[(x * side + y) * side + PADDING..][..n].copy_from_slice(row);
    }
    occupied
}

/// 1 for voxels that have a neighbour of the other kind among their 26.
fn border(occupied: &[bool], side: usize) -> Vec<u8> {
    let mut any: Vec<u8> = occupied.iter().map(|occupied| u8::from(*occupied)).collect();
    let mut all = any.clone();
    // The padding is empty, so what runs over a line's end changes nothing.
    for step in strides(side) {
        let around = |values: &[u8], join: fn(u8, u8) -> u8| {
            let mut joined = values.to_vec();
            for index in step..values.len() - step {
                joined[index] = join(join(values[index - step], values[index]), values[index + step]);
            }
            joined
        };
        (any, all) = (around(&any, |a, b| a | b), around(&all, |a, b| a & b));
    }
    any.iter().zip(&all).map(|(any, all)| any & (1 - all)).collect()
}

/// Squared distance [voxels^2] to the nearest marked voxel; [`BEYOND`] above the band.
fn squared_distances(marked: &[u8], side: usize) -> Vec<u8> {
    let mut squared: Vec<u8> = marked.iter().map(|marked| if *marked == 0 { BEYOND } else { 0 }).collect();
    for step in strides(side) {
        let before = squared.clone();
        for shift in 1..=BAND as usize {
            let (offset, cost) = (shift * step, (shift * shift) as u8);
            // Nothing is marked within the padding's outer voxels, so what runs over a line's end is beyond the band.
            for (value, other) in squared[offset..].iter_mut().zip(&before) {
                *value = (*value).min(other.saturating_add(cost));
            }
            for (value, other) in squared.iter_mut().zip(&before[offset..]) {
                *value = (*value).min(other.saturating_add(cost));
            }
        }
    }
    squared
}

/// Runs of marked voxels along z.
fn runs(marked: &[u8], side: usize) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    for (index, row) in marked.chunks_exact(side).enumerate() {
        let mut start = 0;
        for run in row.chunk_by(|a, b| a == b) {
            if run[0] != 0 {
                runs.push(index * side + start..index * side + start + run.len());
            }
            start += run.len();
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(side: usize, inside: impl Fn([f64; 3]) -> bool) -> Volume {
        let centre =
            |index: usize| [index / side / side, index / side % side, index % side].map(|value| value as f64 + 0.5);
        Volume::from_voxels(side, (0..side.pow(3)).map(|index| inside(centre(index))).collect()).expect("a cube")
    }

    fn ball(side: usize) -> Volume {
        let middle = side as f64 / 2.0 + 0.2;
        volume(side, |point| {
            point.map(|value| (value - middle).powi(2)).iter().sum::<f64>() < (0.34 * side as f64).powi(2)
        })
    }

    #[test]
    fn distances_and_borders_are_those_of_the_definition() {
        let volume = volume(9, |[x, y, z]| (x * 7.0 + y * 3.0 * z).sin() > 0.6 && x > 2.0);
        let side = 9 + 2 * PADDING;
        let occupied = padded(&volume, side);
        let marked = border(&occupied, side);
        let squared = squared_distances(&marked, side);
        let position =
            |index: usize| [index / side / side, index / side % side, index % side].map(|value| value as i32);
        let all: Vec<[i32; 3]> = (0..side.pow(3)).map(position).collect();
        let borders: Vec<[i32; 3]> =
            all.iter().zip(&marked).filter(|(_, marked)| **marked == 1).map(|(at, _)| *at).collect();
        for (index, at) in all.iter().enumerate() {
            let near = |other: &[i32; 3]| (0..3).all(|axis| (at[axis] - other[axis]).abs() <= 1);
            let differs = all.iter().zip(&occupied).any(|(other, kind)| near(other) && *kind != occupied[index]);
            assert_eq!(marked[index] == 1, differs, "{at:?}");
            let distance = borders.iter().map(|other| (0..3).map(|axis| (at[axis] - other[axis]).pow(2)).sum::<i32>());
            let distance = distance.min().expect("a border");
            assert!(if distance <= 16 { i32::from(squared[index]) == distance } else { squared[index] > 16 }, "{at:?}");
        }
    }

    #[test]
    fn signs_and_bounds_hold_and_energy_falls_with_the_steps() {
        let problem = SmoothingProblem::new(&ball(24));
        let solve = |steps| problem.solve(Solver::Accelerated { steps });
        let energies: Vec<f64> = [0, 50, 200, 800].map(|steps| problem.energy(&solve(steps))).to_vec();
        assert!(energies.windows(2).all(|pair| pair[1] < pair[0]), "{energies:?}");
        // The author's 500 sweeps are farther from the end than 200 steps.
        let sweeps = problem.energy(&problem.solve(Solver::DampedJacobi { sweeps: 500 }));
        assert!(energies[2] - energies[3] < 0.2 * (sweeps - energies[3]), "{energies:?} {sweeps}");
        let field = solve(200);
        for index in problem.variables() {
            let (lower, upper) = problem.bounds(index);
            assert!((lower..=upper).contains(&field.values()[index]), "{index}");
        }
        for [before, at, after] in problem.rows() {
            assert!(
                [before, at, after].iter().all(|index| problem.bounds(*index) != (0.0, 0.0)),
                "rows name variables"
            );
        }
    }

    #[test]
    fn the_solver_stops_where_more_steps_change_nothing() {
        let problem = SmoothingProblem::new(&ball(24));
        let [some, more] = [500, 5000].map(|steps| problem.solve(Solver::Accelerated { steps }));
        assert_eq!(some, more, "it has stopped before");
        // What is left to go: plain steps from there, which have no rest to stop at.
        let apart = |a: &CubeField, b: &CubeField| {
            problem.variables().map(|index| (a.values()[index] - b.values()[index]).abs()).fold(0.0, f32::max)
        };
        let start = problem.solve(Solver::Accelerated { steps: 0 });
        let mut further = problem.clone();
        further.start = some.values().to_vec();
        let end = further.solve(Solver::DampedJacobi { sweeps: 4000 });
        assert!(apart(&some, &end) < 0.02 && apart(&start, &end) > 0.3, "{}", apart(&some, &end));
    }

    #[test]
    fn every_level_of_instructions_gives_the_same_bits() {
        // Runs longer than sixteen voxels, and short ones side by side.
        let plates = volume(30, |[x, y, z]| (x * 1.7).sin() > 0.3 && y > 3.0 && (z > 20.0 || (z * 0.9).sin() > 0.2));
        for problem in [ball(24), plates].map(|volume| SmoothingProblem::new(&volume)) {
            for solver in [Solver::Accelerated { steps: 40 }, Solver::DampedJacobi { sweeps: 7 }] {
                let bits =
                    |level| problem.solve_at(solver, level).values().iter().map(|value| value.to_bits()).collect();
                let found: Vec<Vec<u32>> = SimdLevel::available().map(bits).collect();
                assert!(found.windows(2).all(|pair| pair[0] == pair[1]), "{solver:?}");
            }
        }
    }

    #[test]
    fn a_half_space_bends_nowhere_and_its_border_lies_midway() {
        // Through all voxels, padding and all: no rim.
        let side = 24_usize;
        let occupied: Vec<bool> = (0..side.pow(3)).map(|index| index / side / side < side / 2).collect();
        let problem = SmoothingProblem::of_padded(&occupied, side);
        let field = problem.solve(Solver::Accelerated { steps: 200 });
        let at = |x: usize| field.at([x, side / 2, side / 2]);
        let cut = 11.0 + at(11) / (at(11) - at(12));
        assert!((cut - 11.5).abs() < 1e-3, "{cut}");
        assert!(problem.energy(&field) < 1e-3 * problem.energy(&problem.solve(Solver::Accelerated { steps: 0 })));
        // A field that is linear already costs nothing.
        let slope = |index: usize| (index / side / side) as f32 * -2.0 + 23.0;
        let linear = CubeField::from_values(side, (0..side.pow(3)).map(slope).collect()).expect("a cube");
        assert_eq!(problem.energy(&linear), 0.0);
        assert!(problem.rows().count() > 0);
    }

    #[test]
    fn an_empty_volume_has_no_variable() {
        let problem = SmoothingProblem::new(&volume(4, |_| false));
        assert_eq!(problem.variables().count(), 0);
        assert!(problem.solve(Solver::Accelerated { steps: 3 }).values().iter().all(|value| *value == -FAR));
    }
}
