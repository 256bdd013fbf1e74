//! Coverage: which share of each cell is solid.
#![expect(unsafe_code, reason = "gathers without bounds checks: the hot path of every view")]

use nalgebra::{Point3, Vector3};

use crate::geom::{CameraCv, GridPlacement, Lanes, Object, Pose, SimdLevel, SolidGrid, each_of, simd_kernel};

/// Fine cells along each side of a block.
const BLOCK: usize = 2;
/// Blocks along each side of the solid: two words of bits.
const SIDE: usize = SolidGrid::SIDE / BLOCK;
/// Largest known distance of a block from a change of the solid [blocks].
const FARTHEST: usize = 16;
/// Cells along each side of a group that is looked at as a whole first.
const GROUP: usize = 4;
/// Points a cell is tested at: a lattice whose every axis is hit at 256 evenly spaced positions. Against exact half-space
/// cuts of a cube its error is 0.005 (root mean square) and at most 0.011, found by search over its generator.
const POINTS: usize = 256;
const GENERATOR: [usize; 3] = [1, 15, 39];
/// Points that are tested at once.
const LANES: usize = 16;
/// Rounding of points, and room to spare [fine cells].
const SLACK: f64 = 0.01;

/// A solid with maps of how far each part of it is from the next change: what lies in a uniform region is answered at
/// once. Build it once per object (4 MB).
pub struct CoverageBlocks {
    level: SimdLevel,
    /// Blocks within uniform surroundings of 1, 2, ... blocks in every direction, all full or all empty like the block
    /// itself.
    uniform: Vec<Bits>,
}

impl CoverageBlocks {
    /// Reads a solid; kernels at this level, or at the best one that the machine has.
    pub fn new(level: SimdLevel, solid: &SolidGrid) -> Self {
        let [mut empty, mut full] = states(solid);
        let mut uniform = Vec::with_capacity(FARTHEST);
        for _ in 0..FARTHEST {
            // Outside of the grid everything is empty.
            empty = empty.eroded(true);
            full = full.eroded(false);
            uniform.push(empty.either(&full));
        }
        Self { level: level.usable(), uniform }
    }

    /// Writes the share of every cell that is solid to `out`: 0 = empty, 255 = full, 255 * share rounded to nearest.
    /// Shape (resolution, resolution, resolution), C order, indexed (x, y, z) as in [`GridPlacement`].
    ///
    /// The error of a cell has two parts: the lattice's 0.011 at most, and that of the solid's own fine cells, whose
    /// surface is off by at most half the diagonal of one: sqrt(3)/2 * pitch / cell size of a cell cut by one plane
    /// (0.11 where eight fine cells make one), and on average a tenth of that.
    pub fn coverage(
        &self,
        solid: &SolidGrid,
        camera_from_object: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
        out: &mut Vec<u8>,
    ) {
        let object_from_camera = camera_from_object.inverse();
        let rotation = object_from_camera.rotation().matrix();
        // Everything in fine cells from here on.
        let corner = (object_from_camera.point(&placement.lower_corner()) - solid.origin) / solid.pitch;
        let scale = placement.cell_size / solid.pitch;
        let steps: [Vector3<f64>; 3] = std::array::from_fn(|axis| rotation.column(axis) * scale);
        let offset = |point: [f64; 3]| steps[0] * point[0] + steps[1] * point[1] + steps[2] * point[2];
        // Points of a rank-1 lattice in a unit cell, as offsets in fine cells: by axis, then in groups of lanes.
        // By axis, then in groups of lanes.
        let mut lattice = [[[0.0; LANES]; POINTS / LANES]; 3];
        for i in 0..POINTS {
            let point = GENERATOR.map(|g| ((i * g % POINTS) as f64 + 0.5) / POINTS as f64 - 0.5);
            for (axis, value) in offset(point).iter().enumerate() {
                lattice[axis][i / LANES][i % LANES] = *value as f32;
            }
        }
        let n = placement.resolution as usize;
        out.clear();
        out.resize(n.pow(3), 0);
        // What lies in a uniform region is decided here, the other cells point by point: with care at the solid's sides.
        let (mut inner, mut border) = (Vec::new(), Vec::new());
        let (group_reach, reach) = (Reach::new(&steps, GROUP as f64), Reach::new(&steps, 1.0));
        let groups = n.div_ceil(GROUP);
        // Whole groups of cells first, then the cells of those that are not uniform.
        for group in 0..groups.pow(3) {
            let first = [group / groups / groups, group / groups % groups, group % groups].map(|v| v * GROUP);
            let middle = Point3::from(corner + offset(first.map(|v| (v + GROUP / 2) as f64)));
            let share = self.uniform_share(solid, &middle, &group_reach);
            if share == Some(0) {
                continue;
            }
            let ends = first.map(|v| (v + GROUP).min(n));
            for x in first[0]..ends[0] {
                for y in first[1]..ends[1] {
                    for z in first[2]..ends[2] {
                        let index = (x * n + y) * n + z;
                        let middle = Point3::from(corner + offset([x, y, z].map(|v| v as f64 + 0.5)));
                        match share.or_else(|| self.uniform_share(solid, &middle, &reach)) {
                            Some(share) => out[index] = share,
                            None if reach.is_inner(&middle) => {
                                inner.push((index as u32, middle.map(|v| v as f32).into()))
                            }
                            None => border.push((index as u32, middle.map(|v| v as f32).into())),
                        }
                    }
                }
            }
        }
        // Count the solid points of the remaining cells.
        count_inner_points(self.level, &solid.words, &lattice, &inner, out);
        count_points(self.level, &solid.words, &lattice, &border, out);
    }

    /// Share of a cell, or of a group of cells, that lies in a uniform region, times 255.
    fn uniform_share(&self, solid: &SolidGrid, middle: &Point3<f64>, reach: &Reach) -> Option<u8> {
        let side = SolidGrid::SIDE as f64;
        if middle.iter().any(|v| *v < -reach.half || *v > side + reach.half) {
            return Some(0);
        }
        let block = middle.map(|v| (v.clamp(0.0, side - 1.0) / BLOCK as f64) as usize);
        let is_outside = middle.iter().any(|v| *v < 0.0 || *v > side);
        let uniform = self.uniform.get(reach.blocks[usize::from(is_outside)] - 1)?;
        if uniform.get([block.x, block.y, block.z]) {
            return Some(if solid.get(block.x * BLOCK, block.y * BLOCK, block.z * BLOCK) { 255 } else { 0 });
        }
        None
    }
}

/// Reach of a cell, or of a group of cells, from its middle.
struct Reach {
    /// To its sides along the solid's axes, at most [fine cells].
    half: f64,
    /// Blocks from the block of a middle inside of the grid, and from the one nearest to a middle outside, which is as far from
    /// it as from its sides at most.
    blocks: [usize; 2],
}

impl Reach {
    /// Reach of `cells` cells in a row, whose steps are these [fine cells].
    fn new(steps: &[Vector3<f64>; 3], cells: f64) -> Self {
        let half = cells * (steps[0].abs() + steps[1].abs() + steps[2].abs()).max() / 2.0 + SLACK;
        let blocks = [half, 2.0 * half].map(|reach| (reach / BLOCK as f64).ceil() as usize);
        Self { half, blocks }
    }

    /// Whether it lies within the solid's grid.
    fn is_inner(&self, middle: &Point3<f64>) -> bool {
        middle.iter().all(|v| (self.half..SolidGrid::SIDE as f64 - self.half).contains(v))
    }
}

/// A bit per block: rows along z of two words, in C order.
#[derive(Clone)]
struct Bits(Vec<[u64; 2]>);

impl Bits {
    fn get(&self, [x, y, z]: [usize; 3]) -> bool {
        self.0[x * SIDE + y][z / 64] >> (z % 64) & 1 == 1
    }

    fn either(&self, other: &Self) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| [a[0] | b[0], a[1] | b[1]]).collect())
    }

    /// Blocks whose neighbours, also across edges and corners, are all set; blocks outside the grid have the value
    /// `beyond`.
    fn eroded(&self, beyond: bool) -> Self {
        let edge = if beyond { u64::MAX } else { 0 };
        let and = |a: [u64; 2], b: [u64; 2]| [a[0] & b[0], a[1] & b[1]];
        let along_z = |[low, high]: [u64; 2]| {
            let before = [low << 1 | edge & 1, high << 1 | low >> 63];
            let after = [low >> 1 | high << 63, high >> 1 | edge & 1 << 63];
            and(and([low, high], before), after)
        };
        let rows: Vec<[u64; 2]> = self.0.iter().map(|row| along_z(*row)).collect();
        let between = |rows: &[[u64; 2]], step: usize, at: fn(usize) -> usize| {
            let row = |index: usize| {
                let before = if at(index) > 0 { rows[index - step] } else { [edge; 2] };
                let after = if at(index) + 1 < SIDE { rows[index + step] } else { [edge; 2] };
                and(and(rows[index], before), after)
            };
            (0..rows.len()).map(row).collect::<Vec<_>>()
        };
        let planes = between(&rows, 1, |index| index % SIDE);
        Self(between(&planes, SIDE, |index| index / SIDE))
    }
}

/// Blocks that are empty, and blocks that are full.
fn states(solid: &SolidGrid) -> [Bits; 2] {
    let mut states = [Bits(Vec::with_capacity(SIDE * SIDE)), Bits(Vec::with_capacity(SIDE * SIDE))];
    for index in 0..SIDE * SIDE {
        let (x, y) = (index / SIDE * BLOCK, index % SIDE * BLOCK);
        let rows = [[x, y], [x, y + 1], [x + 1, y], [x + 1, y + 1]].map(|[x, y]| (x * SolidGrid::SIDE + y) * 4);
        let [mut empty, mut full] = [[0; 2]; 2];
        for word in 0..4 {
            let [any, all] = rows.iter().fold([0, u64::MAX], |[any, all], row| {
                let bits = solid.words[row + word];
                [any | bits, all & bits]
            });
            empty[word / 2] |= even_bits(!(any | any >> 1)) << (32 * (word % 2));
            full[word / 2] |= even_bits(all & all >> 1) << (32 * (word % 2));
        }
        states[0].0.push(empty);
        states[1].0.push(full);
    }
    states
}

/// The 32 bits at even positions of a word, next to each other.
fn even_bits(word: u64) -> u64 {
    const MASKS: [u64; 5] =
        [0x3333_3333_3333_3333, 0x0f0f_0f0f_0f0f_0f0f, 0x00ff_00ff_00ff_00ff, 0x0000_ffff_0000_ffff, 0xffff_ffff];
    let even = word & 0x5555_5555_5555_5555;
    (0..5).fold(even, |bits, step| (bits | bits >> (1 << step)) & MASKS[step])
}

/// Points of a cell relative to its middle [fine cells], by axis.
type Lattice = [[[f32; LANES]; POINTS / LANES]; 3];

/// The words of a whole solid as halves, the lower one first.
fn halves_of(words: &[u64]) -> &[u32] {
    const { assert!(cfg!(target_endian = "little"), "halves of words are counted from the lowest") };
    // SAFETY: any bits make a u32.
    let (_, halves, _) = unsafe { words.align_to::<u32>() };
    assert_eq!(halves.len(), SolidGrid::SIDE.pow(3) / 32, "a whole solid");
    halves
}

/// 1 where the fine cell of a lane is solid, else 0.
///
/// # Safety
/// Every coordinate is 0 to 255, and `halves` is a whole solid.
#[inline(always)]
unsafe fn solid_bits<L: Lanes>(l: L, halves: &[u32], [x, y, z]: [L::I; 3]) -> L::I {
    // Index of the 32-bit word: (256 x + y) 8 + z / 32.
    let word = l.add_i(l.shl_i::<3>(l.add_i(l.shl_i::<8>(x), y)), l.shr_i::<5>(z));
    // SAFETY: the index is below 256 * 256 * 8, the length.
    let word = unsafe { l.gather_i(halves, word) };
    // Bit z mod 32 of the word.
    l.and_i(l.shr_each(word, l.and_i(z, l.splat_i(31))), l.splat_i(1))
}

simd_kernel! {
    /// Writes the share of each of these cells, given by index and middle [fine cells], whose points lie in solid fine
    /// cells, times 255.
    fn count_points(words: &[u64], lattice: &Lattice, cells: &[(u32, [f32; 3])], out: &mut [u8]) = count_points_body;
}

#[inline(always)]
fn count_points_body<L: Lanes>(l: L, words: &[u64], lattice: &Lattice, cells: &[(u32, [f32; 3])], out: &mut [u8]) {
    let halves = halves_of(words);
    let (zero, side) = (l.splat(0.0), l.splat(SolidGrid::SIDE as f32));
    let last = l.splat(SolidGrid::SIDE as f32 - 1.0);
    for (index, middle) in cells {
        let [mx, my, mz] = each_of!([0, 1, 2], axis => l.splat(middle[axis]));
        let mut count = 0;
        for ((x, y), z) in lattice[0].iter().zip(&lattice[1]).zip(&lattice[2]) {
            let [x, y, z] = each_of!([(mx, x), (my, y), (mz, z)], (middle, offset) => l.add(middle, l.load(offset)));
            let [in_x, in_y, in_z] = each_of!([x, y, z], value => l.both(l.ge(value, zero), l.lt(value, side)));
            let inside = l.both(l.both(in_x, in_y), in_z);
            // Not negative once clamped, so truncation is floor.
            let [x, y, z] = each_of!([x, y, z], value => l.truncate(l.max(l.min(value, last), zero)));
            // SAFETY: x, y and z are 0 to 255, and `halves` is a whole solid.
            let solid = unsafe { solid_bits(l, halves, [x, y, z]) };
            count += l.bits(l.both(inside, l.gt_i(solid, l.splat_i(0)))).count_ones() as usize;
        }
        out[*index as usize] = ((count * 255 + POINTS / 2) / POINTS) as u8;
    }
}

simd_kernel! {
    /// Does what [`count_points`] does, for cells that lie inside the solid's grid.
    fn count_inner_points(words: &[u64], lattice: &Lattice, cells: &[(u32, [f32; 3])], out: &mut [u8]) = count_inner_body;
}

#[inline(always)]
fn count_inner_body<L: Lanes>(l: L, words: &[u64], lattice: &Lattice, cells: &[(u32, [f32; 3])], out: &mut [u8]) {
    let halves = halves_of(words);
    let mut counts = [0; LANES];
    for (index, middle) in cells {
        let [mx, my, mz] = each_of!([0, 1, 2], axis => l.splat(middle[axis]));
        let mut count = l.splat_i(0);
        for ((x, y), z) in lattice[0].iter().zip(&lattice[1]).zip(&lattice[2]) {
            let [x, y, z] =
                each_of!([(mx, x), (my, y), (mz, z)], (middle, offset) => l.truncate(l.add(middle, l.load(offset))));
            // SAFETY: these cells lie with all their points inside the grid (`coverage` passes no others): x, y and z are 0 to
            // 255. `halves` is a whole solid.
            count = l.add_i(count, unsafe { solid_bits(l, halves, [x, y, z]) });
        }
        l.store_i(count, &mut counts);
        let count = counts.iter().sum::<u32>() as usize;
        out[*index as usize] = ((count * 255 + POINTS / 2) / POINTS) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::channels::surface::shapes;

    fn volume(placement: &GridPlacement, coverage: &[u8]) -> f64 {
        coverage.iter().map(|v| f64::from(*v) / 255.0).sum::<f64>() * placement.cell_size.powi(3)
    }

    #[test]
    fn coverage_adds_up_to_the_volume() {
        let ball_volume = 4.0 / 3.0 * std::f64::consts::PI * 0.05f64.powi(3);
        let cuboid = || shapes::cuboid([0.1, 0.06, 0.03]);
        let rotated_box = shapes::turned(&cuboid(), [0.3, 0.8, -0.5]);
        // The fine cells of a box along the axes end up to half a pitch off each face: 77 of 76.8 cells and 154 of 153.6.
        let along_axes = cuboid();
        let fine_volume = along_axes.solid.volume();
        for (shape, truth, tolerance) in [
            (shapes::sphere(0.05), ball_volume, 0.002),
            (rotated_box, 0.1 * 0.06 * 0.03, 0.005),
            (along_axes, fine_volume, 0.002),
        ] {
            let mut out = Vec::new();
            for (pose, placement) in shapes::views(&shape) {
                CoverageBlocks::new(SimdLevel::detect(), &shape.solid).coverage(
                    &shape.solid,
                    &pose,
                    &placement,
                    &mut out,
                );
                let ratio = volume(&placement, &out) / truth;
                assert!((ratio - 1.0).abs() < tolerance, "volume off by a factor {ratio}");
            }
        }
    }

    #[test]
    fn coverage_of_a_ball_is_that_of_a_dense_sample() {
        let shape = shapes::sphere(0.05);
        let (mut out, mut worst, mut sum, mut cut) = (Vec::new(), 0.0f64, 0.0, 0.0);
        for (pose, placement) in shapes::views(&shape) {
            CoverageBlocks::new(SimdLevel::detect(), &shape.solid).coverage(&shape.solid, &pose, &placement, &mut out);
            let inverse = pose.inverse();
            for (i, value) in out.iter().enumerate() {
                let cell = [i / 1600, i / 40 % 40, i % 40].map(|v| v as f64 + 0.5);
                let middle = inverse.point(&(placement.lower_corner() + Vector3::from(cell) * placement.cell_size));
                let distance = (shape.distance)(&middle);
                let half = 0.5 * 3f64.sqrt() * placement.cell_size;
                if distance > half {
                    assert_eq!(*value, 0);
                } else if distance < -half {
                    assert_eq!(*value, 255);
                } else {
                    let points =
                        (0..1000).map(|k| [k / 100, k / 10 % 10, k % 10].map(|v| (v as f64 + 0.5) / 10.0 - 0.5));
                    let inside = points.filter(|p| {
                        let p = inverse.rotation() * (Vector3::from(*p) * placement.cell_size);
                        (shape.distance)(&(middle + p)) < 0.0
                    });
                    let error = (f64::from(*value) / 255.0 - inside.count() as f64 / 1000.0).abs();
                    (worst, sum, cut) = (worst.max(error), sum + error * error, cut + 1.0);
                }
            }
        }
        let spread = (sum / cut).sqrt();
        assert!(worst < 0.12 && spread < 0.02, "worst {worst}, root mean square {spread} over {cut} cut cells");
    }

    #[test]
    fn fast_answers_are_the_slow_ones() {
        // Without the map of uniform regions every cell is tested point by point.
        let shape = shapes::cuboid([0.1, 0.06, 0.03]);
        let fast = CoverageBlocks::new(SimdLevel::detect(), &shape.solid);
        let slow = CoverageBlocks { level: SimdLevel::detect(), uniform: Vec::new() };
        for (pose, placement) in shapes::views(&shape) {
            let (mut a, mut b) = (Vec::new(), Vec::new());
            fast.coverage(&shape.solid, &pose, &placement, &mut a);
            slow.coverage(&shape.solid, &pose, &placement, &mut b);
            assert_eq!(a, b);
        }
    }

    #[test]
    fn levels_count_what_the_definition_counts() {
        let shape = shapes::turned(&shapes::cuboid([0.1, 0.06, 0.03]), [0.3, 0.8, -0.5]);
        for (pose, placement) in shapes::views(&shape) {
            let all: Vec<Vec<u8>> = SimdLevel::available()
                .map(|level| {
                    let mut out = Vec::new();
                    CoverageBlocks::new(level, &shape.solid).coverage(&shape.solid, &pose, &placement, &mut out);
                    out
                })
                .collect();
            assert!(all.windows(2).all(|pair| pair[0] == pair[1]));
            // Point by point in plain code: a point more or less where a coordinate is whole to rounding.
            let inverse = pose.inverse();
            for (index, value) in all[0].iter().enumerate().step_by(97) {
                let cell = [index / 1600, index / 40 % 40, index % 40].map(|v| v as f64);
                let inside = (0..POINTS).filter(|i| {
                    let offset = GENERATOR.map(|g| ((i * g % POINTS) as f64 + 0.5) / POINTS as f64);
                    let at: [f64; 3] = std::array::from_fn(|axis| cell[axis] + offset[axis]);
                    let point = inverse.point(&(placement.lower_corner() + Vector3::from(at) * placement.cell_size));
                    let fine = (point - shape.solid.origin) / shape.solid.pitch;
                    let within = fine.iter().all(|v| (0.0..SolidGrid::SIDE as f64).contains(v));
                    within && shape.solid.get(fine.x as usize, fine.y as usize, fine.z as usize)
                });
                let expected = inside.count() as f64 * 255.0 / POINTS as f64;
                assert!((f64::from(*value) - expected).abs() <= 2.6, "cell {index}: {value}, {expected}");
            }
        }
    }
}
