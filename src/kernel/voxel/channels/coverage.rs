//! Coverage: which share of each cell is solid.
#![expect(unsafe_code, reason = "gathers without bounds checks: the hot path of every view")]

use nalgebra::{Point3, Vector3};

use crate::geom::{CameraCv, GridPlacement, Lanes, Object, Pose, SimdLevel, SolidGrid, each_of, simd_kernel};

/// Fine cells along each side of a block.
const BLOCK: usize = 4;
/// Blocks along each side of the solid.
const SIDE: usize = SolidGrid::SIDE / BLOCK;
/// Points a cell is tested at: a lattice whose every axis is hit at 256 evenly spaced positions. Against exact half-space
/// cuts of a cube its error is 0.005 (root mean square) and at most 0.011, found by search over its generator.
const POINTS: usize = 256;
const GENERATOR: [usize; 3] = [1, 15, 39];
/// Points that are tested at once.
const LANES: usize = 16;

/// A solid with a map of how far each part of it is from the next change: what lies in a uniform region is answered at
/// once. Build it once per object (262 kB).
pub struct CoverageBlocks {
    level: SimdLevel,
    /// Blocks around each block, itself counted, that are all full or all empty as it is; 0 for a mixed block.
    uniform: Vec<u8>,
}

impl CoverageBlocks {
    /// Reads a solid; kernels at this level, or at the best one that the machine has.
    pub fn new(level: SimdLevel, solid: &SolidGrid) -> Self {
        let mut uniform = vec![0u8; SIDE * SIDE * SIDE];
        let states: Vec<u8> = (0..uniform.len()).map(|block| state(solid, block)).collect();
        for (value, state) in uniform.iter_mut().zip(&states) {
            *value = if *state == MIXED { 0 } else { u8::MAX };
        }
        // Chessboard distance to a block of another state, in two sweeps (Rosenfeld and Pfaltz 1968).
        let mut sweep = |forward: bool| {
            for i in 0..uniform.len() {
                let block = if forward { i } else { uniform.len() - 1 - i };
                if uniform[block] == 0 {
                    continue;
                }
                let at = [block / SIDE / SIDE, block / SIDE % SIDE, block % SIDE].map(|v| v as isize);
                let mut min = uniform[block];
                for step in 0..13 {
                    // The 13 neighbours that precede a block in C order; the others are their mirror images.
                    let step = [step / 9, step / 3 % 3, step % 3].map(|v| v as isize - 1);
                    let there: [isize; 3] =
                        std::array::from_fn(|axis| if forward { at[axis] + step[axis] } else { at[axis] - step[axis] });
                    let outside = there.iter().any(|v| !(0..SIDE as isize).contains(v));
                    let other = (there[0] * SIDE as isize + there[1]) * SIDE as isize + there[2];
                    let reach = match outside {
                        // Outside of the grid everything is empty.
                        true if states[block] == EMPTY => u8::MAX,
                        true => 0,
                        false if states[other as usize] != states[block] => 0,
                        false => uniform[other as usize],
                    };
                    min = min.min(reach.saturating_add(1));
                }
                uniform[block] = min;
            }
        };
        sweep(true);
        sweep(false);
        Self { level: level.usable(), uniform }
    }

    /// Writes the share of every cell that is solid to `out`: 0 = empty, 255 = full, 255 * share rounded to nearest.
    /// Shape (resolution, resolution, resolution), C order, indexed (x, y, z) as [`GridPlacement`] says.
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
        // By axis, then in groups of lanes.
        let mut lattice = [[[0.0; LANES]; POINTS / LANES]; 3];
        for i in 0..POINTS {
            let point = GENERATOR.map(|g| ((i * g % POINTS) as f64 + 0.5) / POINTS as f64 - 0.5);
            for (axis, value) in offset(point).iter().enumerate() {
                lattice[axis][i / LANES][i % LANES] = *value as f32;
            }
        }
        let radius = 0.5 * 3f64.sqrt() * scale;
        let n = placement.resolution as usize;
        out.clear();
        out.resize(n.pow(3), 0);
        // What lies in a uniform region is decided here, the other cells point by point.
        let mut mixed = Vec::new();
        for (index, value) in out.iter_mut().enumerate() {
            let cell = [index / n / n, index / n % n, index % n];
            let middle = Point3::from(corner + offset(cell.map(|v| v as f64 + 0.5)));
            match self.uniform_share(solid, &middle, radius) {
                Some(share) => *value = share,
                None => mixed.push((index as u32, middle.map(|v| v as f32).into())),
            }
        }
        count_points(self.level, &solid.words, &lattice, &mixed, out);
    }

    /// The share of a cell with this middle and half-diagonal [fine cells] that lies in a uniform region, times 255.
    fn uniform_share(&self, solid: &SolidGrid, middle: &Point3<f64>, radius: f64) -> Option<u8> {
        let side = SolidGrid::SIDE as f64;
        if middle.iter().any(|v| *v < -radius || *v > side + radius) {
            return Some(0);
        }
        let block = middle.map(|v| (v.clamp(0.0, side - 1.0) / BLOCK as f64) as usize);
        let block = (block.x * SIDE + block.y) * SIDE + block.z;
        // A middle outside of the grid is at most sqrt(3) radii away from its block.
        let outside = middle.iter().any(|v| *v < 0.0 || *v > side);
        let reach = if outside { 3.0 * radius } else { radius };
        if (f64::from(self.uniform[block]) - 1.0) * BLOCK as f64 >= reach {
            let first = [block / SIDE / SIDE, block / SIDE % SIDE, block % SIDE].map(|v| v * BLOCK);
            return Some(if solid.get(first[0], first[1], first[2]) { 255 } else { 0 });
        }
        None
    }
}

/// Points of a cell relative to its middle [fine cells], by axis.
type Lattice = [[[f32; LANES]; POINTS / LANES]; 3];

simd_kernel! {
    /// Writes the share of each of these cells, given by index and middle [fine cells], whose points lie in solid fine
    /// cells, times 255.
    fn count_points(words: &[u64], lattice: &Lattice, cells: &[(u32, [f32; 3])], out: &mut [u8]) = count_points_body;
}

#[inline(always)]
fn count_points_body<L: Lanes>(l: L, words: &[u64], lattice: &Lattice, cells: &[(u32, [f32; 3])], out: &mut [u8]) {
    const { assert!(cfg!(target_endian = "little"), "halves of words are counted from the lowest") };
    // SAFETY: any bits make a u32.
    let (_, halves, _) = unsafe { words.align_to::<u32>() };
    assert_eq!(halves.len(), SolidGrid::SIDE.pow(3) / 32, "a whole solid");
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
            // Index of the 32-bit word: (256 x + y) 8 + z / 32.
            let word = l.add_i(l.shl_i::<3>(l.add_i(l.shl_i::<8>(x), y)), l.shr_i::<5>(z));
            // SAFETY: x, y and z are at most 255, so the index is below 256 * 256 * 8, the length.
            let word = unsafe { l.gather_i(halves, word) };
            // Bit z mod 32 of the word.
            let solid = l.and_i(l.shr_each(word, l.and_i(z, l.splat_i(31))), l.splat_i(1));
            count += l.bits(l.both(inside, l.gt_i(solid, l.splat_i(0)))).count_ones() as usize;
        }
        out[*index as usize] = ((count * 255 + POINTS / 2) / POINTS) as u8;
    }
}

const EMPTY: u8 = 0;
const FULL: u8 = 1;
const MIXED: u8 = 2;

/// Whether a block of the solid is empty, full or neither.
fn state(solid: &SolidGrid, block: usize) -> u8 {
    let [x, y, z] = [block / SIDE / SIDE, block / SIDE % SIDE, block % SIDE].map(|v| v * BLOCK);
    let (mut any, mut all) = (0, 0xf);
    for x in x..x + BLOCK {
        for y in y..y + BLOCK {
            let nibble = solid.words[(x * SolidGrid::SIDE + y) * 4 + z / 64] >> (z % 64) & 0xf;
            any |= nibble;
            all &= nibble;
        }
    }
    match (any, all) {
        (0, _) => EMPTY,
        (_, 0xf) => FULL,
        _ => MIXED,
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
        let slow = CoverageBlocks { level: SimdLevel::detect(), uniform: vec![0; fast.uniform.len()] };
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
