//! A tree of boxes over triangles, sixteen at a time: which come near a box, and which is nearest to a point.

use nalgebra::Point3;

use super::{
    near::lanes,
    parts::{Bounds, around, part_size, parted},
    triangle::{self, Triangle, may_cross, squared_distance},
};
use kernel::geom::{
    SimdLevel,
    lanes::{Lanes, each_of},
    simd_kernel,
};

/// Boxes of a block: the lanes of a kernel.
const LANES: usize = 16;

/// Blocks of boxes, each around those below it.
#[derive(Clone, Debug)]
pub(super) struct BoxTree {
    /// The first is the root; none of no triangles.
    blocks: Vec<Block>,
    /// In the tree's order.
    triangles: Vec<Triangle>,
    level: SimdLevel,
}

/// Boxes side by side, rounded outward [m]; a lane without one is empty.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Block {
    low: [[f32; LANES]; 3],
    high: [[f32; LANES]; 3],
    /// Indices of blocks, or of triangles.
    below: [u32; LANES],
    holds_triangles: bool,
}

impl BoxTree {
    pub fn new(triangles: &[Triangle], level: SimdLevel) -> Self {
        let mut tree = Self { blocks: Vec::new(), triangles: Vec::with_capacity(triangles.len()), level };
        if !triangles.is_empty() {
            tree.hang(&mut triangles.to_vec());
        }
        tree
    }

    /// Makes a block over triangles, with all that hangs below; its index.
    fn hang(&mut self, triangles: &mut [Triangle]) -> u32 {
        let index = self.blocks.len();
        let size = part_size(triangles.len(), LANES);
        let (low, high) = ([[f32::INFINITY; LANES]; 3], [[f32::NEG_INFINITY; LANES]; 3]);
        self.blocks.push(Block { low, high, below: [0; LANES], holds_triangles: size == 1 });
        for (lane, part) in parted(triangles, size, &triangle::bounds).into_iter().enumerate() {
            let bounds = around(part, &triangle::bounds);
            let below = if size == 1 {
                self.triangles.push(part[0]);
                self.triangles.len() as u32 - 1
            } else {
                self.hang(part)
            };
            let block = &mut self.blocks[index];
            for axis in 0..3 {
                block.low[axis][lane] = below_or_at(bounds.low[axis]);
                block.high[axis][lane] = -below_or_at(-bounds.high[axis]);
            }
            block.below[lane] = below;
        }
        index as u32
    }

    /// Squared distance from a point to the nearest of the triangles [m^2] where that is less than `limit`, else `limit`: the
    /// sooner found the smaller that is.
    pub fn squared_distance_within(&self, point: &Point3<f64>, limit: f64) -> f64 {
        let mut best = limit;
        if !self.blocks.is_empty() {
            self.approach(0, point, &mut best);
        }
        best
    }

    fn approach(&self, at: u32, point: &Point3<f64>, best: &mut f64) {
        let block = &self.blocks[at as usize];
        let mut apart = [0.0; LANES];
        let rounded = [0, 1, 2].map(|axis| point[axis] as f32);
        // Rounding must make no box farther than it is.
        let slack = 2e-7 * rounded.map(f32::abs).into_iter().fold(0.0, f32::max);
        let limit = (*best * (1.0 + 1e-6)) as f32;
        let mut open = nearer(self.level, block, rounded, slack, limit, &mut apart);
        while let Some(lane) = lanes(open).min_by(|a, b| apart[*a].total_cmp(&apart[*b])) {
            if f64::from(apart[lane]) * (1.0 - 1e-6) >= *best {
                return;
            }
            open &= !(1 << lane);
            let below = block.below[lane];
            if block.holds_triangles {
                *best = best.min(squared_distance(point, &self.triangles[below as usize]));
            } else {
                self.approach(below, point, best);
            }
        }
    }

    /// Whether one of the triangles is between two points, or just next to the line.
    pub fn crosses(&self, from: &Point3<f64>, to: &Point3<f64>) -> bool {
        let around = Bounds { low: from.inf(to), high: from.sup(to) };
        self.any_near(&around, |triangle| may_cross(from, to, triangle))
    }

    /// Whether `found` is true for a triangle whose box meets or nearly meets the given one.
    pub fn any_near(&self, bounds: &Bounds, mut found: impl FnMut(&Triangle) -> bool) -> bool {
        let low = [0, 1, 2].map(|axis| below_or_at(bounds.low[axis]));
        let high = [0, 1, 2].map(|axis| -below_or_at(-bounds.high[axis]));
        !self.blocks.is_empty() && self.any_below(0, &(low, high), &mut found)
    }

    fn any_below(&self, at: u32, bounds: &([f32; 3], [f32; 3]), found: &mut impl FnMut(&Triangle) -> bool) -> bool {
        let block = &self.blocks[at as usize];
        lanes(met(self.level, block, bounds)).any(|lane| {
            let below = block.below[lane];
            if block.holds_triangles {
                found(&self.triangles[below as usize])
            } else {
                self.any_below(below, bounds, found)
            }
        })
    }
}

/// Rounds down.
fn below_or_at(value: f64) -> f32 {
    let rounded = value as f32;
    if f64::from(rounded) > value { rounded.next_down() } else { rounded }
}

simd_kernel! {
    /// Boxes that meet one from a low to a high corner, a bit each.
    fn met(block: &Block, bounds: &([f32; 3], [f32; 3])) -> u32 = meeting;
}

#[inline(always)]
fn meeting<L: Lanes>(l: L, block: &Block, (low, high): &([f32; 3], [f32; 3])) -> u32 {
    let [x, y, z] = each_of!([0, 1, 2], axis => {
        let starts = l.ge(l.splat(high[axis]), l.load(&block.low[axis]));
        let ends = l.ge(l.load(&block.high[axis]), l.splat(low[axis]));
        l.both(starts, ends)
    });
    l.bits(l.both(l.both(x, y), z))
}

simd_kernel! {
    /// Boxes that are nearer to a point than the root of `limit`, a bit each, and every one's squared distance; each side of
    /// a box counts as nearer by `slack`.
    fn nearer(block: &Block, point: [f32; 3], slack: f32, limit: f32, out: &mut [f32; LANES]) -> u32 = gaps;
}

#[inline(always)]
fn gaps<L: Lanes>(l: L, block: &Block, point: [f32; 3], slack: f32, limit: f32, out: &mut [f32; LANES]) -> u32 {
    let [x, y, z] = each_of!([0, 1, 2], axis => {
        let at = l.splat(point[axis]);
        let (before, after) = (l.sub(l.load(&block.low[axis]), at), l.sub(at, l.load(&block.high[axis])));
        let gap = l.max(l.sub(l.max(before, after), l.splat(slack)), l.splat(0.0));
        l.mul(gap, gap)
    });
    let squared = l.add(l.add(x, y), z);
    l.store(squared, out);
    l.bits(l.lt(squared, l.splat(limit)))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use kernel::seed::Stream;

    fn soup(draw: &mut Stream, count: usize) -> Vec<Triangle> {
        let mut point = |spread: f64| Vector3::from([0; 3].map(|_: i32| draw.uniform(-spread, spread)));
        let triangle = |_| {
            let centre = Point3::from(point(1.0));
            [0; 3].map(|_: i32| centre + point(0.1))
        };
        (0..count).map(triangle).collect()
    }

    #[test]
    fn the_tree_finds_what_a_look_at_every_triangle_finds_at_every_level() {
        let mut draw = Stream::of_job(1, b"", "triangles");
        for count in [1, 15, 16, 17, 256, 300] {
            let triangles = soup(&mut draw, count);
            let trees: Vec<_> = SimdLevel::available().map(|level| BoxTree::new(&triangles, level)).collect();
            for _ in 0..200 {
                let point = Point3::from([0; 3].map(|_: i32| draw.uniform(-1.5, 1.5)));
                let nearest = triangles.iter().map(|triangle| squared_distance(&point, triangle));
                let nearest = nearest.fold(f64::INFINITY, f64::min);
                let bounds = Bounds { low: point, high: point + Vector3::repeat(draw.uniform(0.0, 0.4)) };
                let sorted = |mut met: Vec<[u64; 9]>| {
                    met.sort_unstable();
                    met
                };
                let key = |triangle: &Triangle| {
                    let [a, b, c] = triangle.map(|corner| [corner.x, corner.y, corner.z].map(f64::to_bits));
                    [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
                };
                let meeting = triangles.iter().filter(|triangle| triangle::bounds(triangle).meets(&bounds));
                let meeting = sorted(meeting.map(key).collect());
                for tree in &trees {
                    assert_eq!(tree.squared_distance_within(&point, f64::INFINITY), nearest);
                    assert_eq!(tree.squared_distance_within(&point, 1.5 * nearest), nearest);
                    assert_eq!(tree.squared_distance_within(&point, 0.5 * nearest), 0.5 * nearest);
                    let mut met = Vec::new();
                    tree.any_near(&bounds, |triangle| {
                        if triangle::bounds(triangle).meets(&bounds) {
                            met.push(key(triangle));
                        }
                        false
                    });
                    assert_eq!(sorted(met), meeting);
                }
            }
        }
    }
}
