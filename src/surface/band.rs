//! The variables of a smoothing problem, sixteen voxels at a time, and one step of its solver.

use std::ops::Range;

use kernel::geom::{
    SimdLevel,
    lanes::{Lanes, each_of},
    simd_kernel,
};

/// Voxels one after the other along z that are taken at once.
const LANES: usize = 16;

/// Bounds and length of a step of a voxel; the length is 0 for one that is no variable.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Variable {
    pub(crate) lower: f32,
    pub(crate) upper: f32,
    pub(crate) rate: f32,
}

/// The way that a step made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Progress {
    /// Largest change of a variable [voxels].
    pub(crate) largest: f32,
    /// Whether the momentum leads up again: the slope at the point ahead is against the way that the step made. Summed lane by
    /// lane in the order of the blocks, so that it is the same at every level of vector instructions.
    pub(crate) overshoots: bool,
}

/// Variables in a padded volume, with the solver's state: two points, the one that it has reached and the one ahead.
pub(crate) struct Band {
    side: usize,
    /// By slab of voxels with one x.
    rows: Vec<Range<usize>>,
    variables: Vec<Range<usize>>,
    row_blocks: Vec<RowBlock>,
    variable_blocks: Vec<VariableBlock>,
    /// The point ahead, per voxel of the volume.
    ahead: Vec<f32>,
    bends: Bends,
}

/// Voxels from an index on, some of which are the middles of rows: 1, the others 0.
struct RowBlock {
    at: usize,
    is_row: [f32; LANES],
}

/// Voxels from an index on, some of which are variables.
struct VariableBlock {
    at: usize,
    rates: [f32; LANES],
    lower: [f32; LANES],
    upper: [f32; LANES],
    current: [f32; LANES],
}

/// Second differences of the point ahead, 0 if there is no row: of one slab along y and z, of three slabs along x. A line of
/// voxels is before each slab, and one behind it.
struct Bends {
    along_x: [Vec<f32>; 3],
    along_y: Vec<f32>,
    along_z: Vec<f32>,
}

impl Band {
    /// From runs of voxels along z, in order: the middles of rows, and the variables. `start` is a value per voxel.
    pub(crate) fn new(
        side: usize,
        rows: &[Range<usize>],
        variables: &[Range<usize>],
        start: &[f32],
        variable: impl Fn(usize) -> Variable,
    ) -> Self {
        let blocks = |runs: &[Range<usize>]| -> Vec<Range<usize>> {
            let chunks = |run: &Range<usize>| {
                let end = run.end;
                run.clone().step_by(LANES).map(move |at| at..end.min(at + LANES))
            };
            runs.iter().flat_map(chunks).collect()
        };
        let (rows, variables) = (blocks(rows), blocks(variables));
        let row_block = |block: &Range<usize>| {
            let is_row = std::array::from_fn(|lane| f32::from(lane < block.len()));
            RowBlock { at: block.start, is_row }
        };
        let variable_block = |block: &Range<usize>| {
            let lane = |lane: usize| block.clone().nth(lane).map(&variable).unwrap_or_default();
            VariableBlock {
                at: block.start,
                rates: std::array::from_fn(|index| lane(index).rate),
                lower: std::array::from_fn(|index| lane(index).lower),
                upper: std::array::from_fn(|index| lane(index).upper),
                current: std::array::from_fn(|index| block.clone().nth(index).map_or(0.0, |index| start[index])),
            }
        };
        // A block may reach beyond the last voxel, or a slab's.
        let mut ahead = start.to_vec();
        ahead.resize(start.len() + LANES, 0.0);
        let slab = || vec![0.0; side * side + 2 * side + LANES];
        Self {
            side,
            rows: by_slab(&rows, side),
            variables: by_slab(&variables, side),
            row_blocks: rows.iter().map(row_block).collect(),
            variable_blocks: variables.iter().map(variable_block).collect(),
            ahead,
            bends: Bends { along_x: [slab(), slab(), slab()], along_y: slab(), along_z: slab() },
        }
    }

    /// One projected step from the point ahead, and on from there by a share of the way that was made.
    pub(crate) fn step(&mut self, momentum: f32, level: SimdLevel) {
        step_at(level, self, momentum);
    }

    /// [`Band::step`], and the way that it made.
    pub(crate) fn watched_step(&mut self, momentum: f32, level: SimdLevel) -> Progress {
        watched_step_at(level, self, momentum)
    }

    /// Lets the point ahead be the one that is reached.
    pub(crate) fn forget_momentum(&mut self) {
        for block in &self.variable_blocks {
            let lanes = block.current.iter().zip(&block.rates).enumerate();
            let lanes = lanes.filter(|(_, (_, rate))| **rate > 0.0);
            lanes.for_each(|(lane, (value, _))| self.ahead[block.at + lane] = *value);
        }
    }

    /// Writes the variables' values into a field over the volume.
    pub(crate) fn write(&self, field: &mut [f32]) {
        for block in &self.variable_blocks {
            let lanes = block.current.iter().zip(&block.rates).enumerate();
            lanes.filter(|(_, (_, rate))| **rate > 0.0).for_each(|(lane, (value, _))| field[block.at + lane] = *value);
        }
    }
}

simd_kernel! {
    fn step_at(band: &mut Band, momentum: f32) = step_in_lanes;
}

simd_kernel! {
    fn watched_step_at(band: &mut Band, momentum: f32) -> Progress = watched_step_in_lanes;
}

/// Variables of a block in one step: the point that they had reached before, the one ahead of it, where the step began, and the one
/// that they reached.
struct Stepped<L: Lanes> {
    rates: L::F,
    ahead: L::F,
    before: L::F,
    after: L::F,
}

#[inline(always)]
fn step_in_lanes<L: Lanes>(l: L, band: &mut Band, momentum: f32) {
    step_slabs(l, band, momentum, |_| {});
}

#[inline(always)]
fn watched_step_in_lanes<L: Lanes>(l: L, band: &mut Band, momentum: f32) -> Progress {
    let mut ways = l.splat(0.0);
    let mut against = [0.0_f64; LANES];
    step_slabs(l, band, momentum, |Stepped { rates, ahead, before, after }| {
        let way = l.sub(after, before);
        ways = l.max(ways, l.abs(way));
        // A lane that is no variable goes no way, whatever its rate is taken for.
        let rates = l.max(rates, l.splat(f32::MIN_POSITIVE));
        let mut lanes = [0.0; LANES];
        l.store(l.div(l.mul(l.sub(ahead, after), way), rates), &mut lanes);
        against.iter_mut().zip(lanes).for_each(|(sum, lane)| *sum += f64::from(lane));
    });
    let mut lanes = [0.0; LANES];
    l.store(ways, &mut lanes);
    Progress { largest: lanes.into_iter().fold(0.0, f32::max), overshoots: against.iter().sum::<f64>() > 0.0 }
}

/// Slab by slab: the rows along x of the next one still find the point ahead there as it was, and so do all rows that reach
/// beyond.
#[inline(always)]
fn step_slabs<L: Lanes>(l: L, band: &mut Band, momentum: f32, mut watch: impl FnMut(Stepped<L>)) {
    let Band { side, rows, variables, row_blocks, variable_blocks, ahead, bends } = band;
    let (side, area) = (*side, *side * *side);
    let (zero, momentum) = (l.splat(0.0), l.splat(momentum));
    for slab in 0..side {
        let start = slab * area;
        if slab + 1 < side {
            let along_x = &mut bends.along_x[(slab + 1) % 3];
            for RowBlock { at, is_row } in &row_blocks[rows[slab + 1].clone()] {
                let bend = l.mul(second_difference(l, ahead, *at, area), l.load(is_row));
                l.store(bend, sixteen_mut(along_x, at + side - start - area));
            }
        }
        for RowBlock { at, is_row } in &row_blocks[rows[slab].clone()] {
            let is_row = l.load(is_row);
            let [along_y, along_z] = each_of!([side, 1], step => l.mul(second_difference(l, ahead, *at, step), is_row));
            l.store(along_y, sixteen_mut(&mut bends.along_y, at + side - start));
            l.store(along_z, sixteen_mut(&mut bends.along_z, at + side - start));
        }
        let [before, here, after] = each_of!([2, 0, 1], shift => &bends.along_x[(slab + shift) % 3]);
        for block in &mut variable_blocks[variables[slab].clone()] {
            let at = block.at + side - start;
            // The gradient: second differences of second differences.
            let [before, here, after] = each_of!([before, here, after], bends => l.load(sixteen(bends, at)));
            let along_x = bend(l, before, here, after);
            let along_y = second_difference(l, &bends.along_y, at, side);
            let along_z = second_difference(l, &bends.along_z, at, 1);
            let slope = l.add(l.add(along_x, along_y), along_z);
            let (rates, old, current) =
                (l.load(&block.rates), l.load(sixteen(ahead, block.at)), l.load(&block.current));
            let stepped = l.sub(old, l.mul(slope, rates));
            let stepped = l.min(l.max(stepped, l.load(&block.lower)), l.load(&block.upper));
            watch(Stepped { rates, ahead: old, before: current, after: stepped });
            let next = l.add(stepped, l.mul(momentum, l.sub(stepped, current)));
            // Lanes behind a run are another one's voxels, or none's.
            l.store(l.select(l.lt(zero, rates), next, old), sixteen_mut(ahead, block.at));
            l.store(stepped, &mut block.current);
        }
        for RowBlock { at, .. } in &row_blocks[rows[slab].clone()] {
            l.store(zero, sixteen_mut(&mut bends.along_y, at + side - start));
            l.store(zero, sixteen_mut(&mut bends.along_z, at + side - start));
        }
        // The slab after the next one takes its place.
        if slab > 0 {
            let along_x = &mut bends.along_x[(slab + 2) % 3];
            for RowBlock { at, .. } in &row_blocks[rows[slab - 1].clone()] {
                l.store(zero, sixteen_mut(along_x, at + side + area - start));
            }
        }
    }
}

/// Before - 2 at + after, of voxels from an index on.
#[inline(always)]
fn second_difference<L: Lanes>(l: L, values: &[f32], at: usize, step: usize) -> L::F {
    let [before, here, after] = each_of!([at - step, at, at + step], at => l.load(sixteen(values, at)));
    bend(l, before, here, after)
}

#[inline(always)]
fn bend<L: Lanes>(l: L, before: L::F, here: L::F, after: L::F) -> L::F {
    l.add(l.sub(before, l.mul(l.splat(2.0), here)), after)
}

#[inline(always)]
fn sixteen(values: &[f32], at: usize) -> &[f32; LANES] {
    values[at..at + LANES].try_into().expect("sixteen numbers")
}

#[inline(always)]
fn sixteen_mut(values: &mut [f32], at: usize) -> &mut [f32; LANES] {
    (&mut values[at..at + LANES]).try_into().expect("sixteen numbers")
}

/// Ranges of blocks, which are in order, by the slab that they lie in.
fn by_slab(blocks: &[Range<usize>], side: usize) -> Vec<Range<usize>> {
    let end = |slab: usize| blocks.partition_point(|block| block.start < slab * side * side);
    (0..side).map(|slab| end(slab)..end(slab + 1)).collect()
}
