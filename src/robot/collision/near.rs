//! Which balls of a block may hold a surface that meets another body's, by that body's distance lattice: the innermost
//! loop of all collision checks.
#![expect(unsafe_code, reason = "gathers without bounds checks: the hot path of every configuration")]

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Vector3};

use super::surface_tree::{Block, LANES};
use kernel::geom::{
    SimdLevel,
    lanes::{Affine, Lanes, each_of},
    simd_kernel,
};

/// A lattice of distances as a kernel reads it.
#[derive(Clone, Debug)]
pub(super) struct Points {
    low: Point3<f64>,
    inverse_spacing: f64,
    /// From the first point to the far corner of the mesh's box [steps].
    sides: [f32; 3],
    /// Points along each axis.
    counts: [u32; 3],
    /// Distances to the surface [steps], negative inside; at least one point an axis, C order.
    distances: Vec<f32>,
    /// Bound on rounding errors [steps].
    rounding: f32,
}

/// Where the balls of another body are, expressed in a lattice's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// Rows from the other body's coordinates [m] to steps.
    rows: [[f32; 4]; 3],
    /// From metres to steps.
    scale: f32,
    /// By how much a ball counts as larger [steps].
    slack: f32,
}

/// Lanes of a block, a bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Found {
    /// Balls that the surface may pass.
    pub near: u32,
    /// Balls that lie wholly inside the body.
    pub inside: u32,
    /// Balls that hold a point of the body's inside.
    pub reaching: u32,
}

/// Balls of a block by their distance from a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gaps {
    /// Balls that may be nearer than a bound, a bit each.
    pub near: u32,
    /// Balls whose farthest points are nearer than another bound for certain.
    pub nearer: u32,
    /// Lower bounds on the distance [steps].
    pub apart: [f32; LANES],
}

impl Points {
    /// Points of a lattice over a box (low, high): `distances` [m] at points that are `spacing` apart [m].
    pub fn new(
        low: Point3<f64>,
        high: Point3<f64>,
        spacing: f64,
        counts: [usize; 3],
        distances: Vec<f32>,
        rounding: f64,
    ) -> Self {
        let steps = |length: f64| (length / spacing) as f32;
        assert_eq!(distances.len(), counts.iter().product::<usize>(), "a lattice is full");
        assert!(counts.iter().all(|count| *count > 0) && distances.len() < 1 << 31);
        Self {
            low,
            inverse_spacing: 1.0 / spacing,
            sides: [0, 1, 2].map(|axis| steps(high[axis] - low[axis])),
            counts: counts.map(|count| count as u32),
            distances: distances.into_iter().map(|distance| steps(f64::from(distance))).collect(),
            rounding: steps(rounding),
        }
    }

    /// View of another body, all of whose balls lie in the given one (centre and radius [m], its own frame).
    pub fn view(&self, here_from_there: &IsometryMatrix3<f64>, ball: &(Point3<f64>, f64)) -> View {
        let shift = here_from_there.translation.vector - self.low.coords;
        let rows = rows(here_from_there.rotation.matrix(), &shift, self.inverse_spacing);
        // Six roundings of numbers no larger than these, each of less than 6e-8 of it.
        let largest = shift.amax() + ball.0.coords.norm() + ball.1;
        let scale = self.inverse_spacing as f32;
        View { rows, scale, slack: self.rounding + 2e-6 * (largest * self.inverse_spacing) as f32 }
    }

    /// Tests the balls of a block.
    pub fn test_block(&self, level: SimdLevel, view: &View, block: &Block) -> Found {
        let Found { near, inside, reaching } = test_block(level, self, view, block);
        let held = block.held();
        Found { near: near & held, inside: inside & held, reaching: reaching & held }
    }

    /// Which balls of a block may be nearer to the surface than `best`, and which are nearer than `enough` as a whole [m].
    pub fn gaps(&self, level: SimdLevel, view: &View, [best, enough]: [f64; 2], block: &Block) -> Gaps {
        let bounds = [best, enough].map(|bound| bound as f32 * view.scale);
        let found = gaps(level, self, view, bounds, block);
        let held = block.held();
        Gaps { near: found.near & held, nearer: found.nearer & held, ..found }
    }
}

/// Rows of a rotation with a shift at their ends, for a kernel in units of 1/`scale` metres.
fn rows(rotation: &Matrix3<f64>, shift: &Vector3<f64>, scale: f64) -> [[f32; 4]; 3] {
    [0, 1, 2].map(|axis| {
        [rotation[(axis, 0)], rotation[(axis, 1)], rotation[(axis, 2)], shift[axis]].map(|value| (value * scale) as f32)
    })
}

/// Indices of the bits that are set.
pub(super) fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < 32).then_some(lane)
    })
}

/// A part of a line, or a box, with all around it up to a radius.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    /// Rows from another body's coordinates [m] to the frame whose z is the line.
    rows: [[f32; 4]; 3],
    radius: f32,
    /// Half the sides of the core: 0 across a line.
    halves: [f32; 3],
    /// Half of all the shape's length along z.
    end: f32,
    /// Bound on rounding errors [m].
    slack: f32,
}

impl Axis {
    /// Around z from `-half` to `half` [m], with flat or round ends, in a frame that is expressed in another body's.
    pub fn new(shape_from_there: &IsometryMatrix3<f64>, radius: f64, half: f64, flat: bool) -> Self {
        let (rotation, shift) = (shape_from_there.rotation.matrix(), shape_from_there.translation.vector);
        let rows = rows(rotation, &shift, 1.0);
        // As in `Points::view`; a ball that matters is no farther than the shape is long.
        let slack = 2e-6 * (2.0 * shift.norm() + radius + half);
        let end = if flat { half } else { half + radius };
        // A flat end has no part of a ball around it: `end` decides outside of it.
        let half = if flat { f64::INFINITY } else { half };
        let halves = [0.0, 0.0, half as f32];
        Self { rows, radius: radius as f32, halves, end: end as f32, slack: slack as f32 }
    }

    /// A box by half its sides [m], in a frame that is expressed in another body's.
    pub fn of_box(shape_from_there: &IsometryMatrix3<f64>, half: [f64; 3]) -> Self {
        let (rotation, shift) = (shape_from_there.rotation.matrix(), shape_from_there.translation.vector);
        let slack = 2e-6 * (2.0 * shift.norm() + Vector3::from(half).norm());
        let halves = half.map(|half| half as f32);
        Self { rows: rows(rotation, &shift, 1.0), radius: 0.0, halves, end: f32::INFINITY, slack: slack as f32 }
    }

    /// With a margin of this length around all of it [m].
    pub fn widened(self, by: f64) -> Self {
        Self { slack: self.slack + (by * (1.0 + 1e-6)) as f32, ..self }
    }

    /// The balls of a block that reach into it, a bit each.
    pub fn near(&self, level: SimdLevel, block: &Block) -> u32 {
        around(level, self, block) & block.held()
    }
}

simd_kernel! {
    fn around(axis: &Axis, block: &Block) -> u32 = around_axis;
}

#[inline(always)]
fn around_axis<L: Lanes>(l: L, axis: &Axis, block: &Block) -> u32 {
    let [x, y, z] = each_of!([0, 1, 2], axis => l.load(&block.centres[axis]));
    let [x, y, z] = each_of!([0, 1, 2], row => Affine::new(l, axis.rows[row]).at(l, x, y, z));
    let point = [x, y, z];
    let [aside, across, up] = each_of!([0, 1, 2], row => {
        l.max(l.sub(l.abs(point[row]), l.splat(axis.halves[row])), l.splat(0.0))
    });
    let radius = l.add(l.load(&block.radii), l.splat(axis.slack));
    let reach = l.add(radius, l.splat(axis.radius));
    let squared = l.add(l.add(l.mul(aside, aside), l.mul(across, across)), l.mul(up, up));
    let beside = l.lt(l.mul(reach, reach), squared);
    let beyond = l.lt(l.add(radius, l.splat(axis.end)), l.abs(z));
    l.bits(l.not(l.either(beside, beyond)))
}

simd_kernel! {
    fn test_block(points: &Points, view: &View, block: &Block) -> Found = balls;
}

/// A ball is clear of the surface when the lattice point nearest to its centre has so large a distance that what lies
/// between the two points and the ball's radius do not use it up, or when all of it is outside of the mesh's box.
#[inline(always)]
fn balls<L: Lanes>(l: L, points: &Points, view: &View, block: &Block) -> Found {
    const { assert!(LANES == 16) };
    let [x, y, z] = each_of!([0, 1, 2], axis => l.load(&block.centres[axis]));
    let (zero, half) = (l.splat(0.0), l.splat(0.5));
    // Centres of the balls in lattice steps, and the nearest lattice point, clamped to the lattice.
    let point = each_of!([0, 1, 2], axis => Affine::new(l, view.rows[axis]).at(l, x, y, z));
    let cell = each_of!([0, 1, 2], axis => {
        let last = l.splat((points.counts[axis] - 1) as f32);
        l.truncate(l.min(l.max(l.add(point[axis], half), zero), last))
    });
    // Squared offset from the nearest lattice point to the centre, by axis.
    let beside = each_of!([0, 1, 2], axis => {
        let beside = l.sub(point[axis], l.to_float(cell[axis]));
        l.mul(beside, beside)
    });
    // Squared distance from the centre to the mesh's box, by axis; 0 within the box.
    let beyond = each_of!([0, 1, 2], axis => {
        let after = l.sub(point[axis], l.splat(points.sides[axis]));
        let beyond = l.max(l.max(l.sub(zero, point[axis]), after), zero);
        l.mul(beyond, beyond)
    });
    let [_, ny, nz] = points.counts.map(|count| l.splat_i(count as i32));
    let index = l.add_i(l.mul_i(l.add_i(l.mul_i(cell[0], ny), cell[1]), nz), cell[2]);
    // SAFETY: every cell lies between 0 and the last one of its axis, and `distances` holds all of them.
    let stored = unsafe { l.gather(&points.distances, index) };
    // Radius in steps, enlarged by the slack for rounding.
    let radius = l.add(l.mul(l.load(&block.radii), l.splat(view.scale)), l.splat(view.slack));
    // Distance fields are 1-Lipschitz: a ball is clear where |stored distance| minus radius exceeds the offset.
    let spare = l.sub(l.abs(stored), radius);
    let squared = |[a, b, c]: [L::F; 3]| l.add(l.add(a, b), c);
    let clear = l.both(l.lt(zero, spare), l.lt(squared(beside), l.mul(spare, spare)));
    // Balls farther from the mesh's box than their radius are outside as a whole.
    let outside = l.lt(l.mul(radius, radius), squared(beyond));
    // Less by twice the slack: here the ball must not count as larger than it is.
    let depth = l.sub(l.sub(radius, l.splat(2.0 * view.slack)), stored);
    let reaching = l.both(l.lt(zero, depth), l.lt(squared(beside), l.mul(depth, depth)));
    Found {
        near: l.bits(l.not(l.either(clear, outside))),
        inside: l.bits(l.both(clear, l.lt(stored, zero))),
        reaching: l.bits(reaching),
    }
}

simd_kernel! {
    fn gaps(points: &Points, view: &View, bounds: [f32; 2], block: &Block) -> Gaps = gaps_of;
}

/// The nearest point of the mesh's box is at a right angle or more between a point outside of it and any of the surface,
/// which is in the box: the squares of the distances to the box and from there to the surface add up to no more than that
/// of the whole.
#[inline(always)]
fn gaps_of<L: Lanes>(l: L, points: &Points, view: &View, [best, enough]: [f32; 2], block: &Block) -> Gaps {
    let [x, y, z] = each_of!([0, 1, 2], axis => l.load(&block.centres[axis]));
    let (zero, half) = (l.splat(0.0), l.splat(0.5));
    // Centres of the balls in lattice steps, the nearest points of the mesh's box, and the lattice points nearest to those.
    let point = each_of!([0, 1, 2], axis => Affine::new(l, view.rows[axis]).at(l, x, y, z));
    let boxed = each_of!([0, 1, 2], axis => l.min(l.max(point[axis], zero), l.splat(points.sides[axis])));
    let cell = each_of!([0, 1, 2], axis => {
        let last = l.splat((points.counts[axis] - 1) as f32);
        l.truncate(l.min(l.add(boxed[axis], half), last))
    });
    let squares = each_of!([0, 1, 2], axis => {
        let at = l.to_float(cell[axis]);
        let [beyond, beside, whole] =
            [l.sub(point[axis], boxed[axis]), l.sub(boxed[axis], at), l.sub(point[axis], at)];
        [l.mul(beyond, beyond), l.mul(beside, beside), l.mul(whole, whole)]
    });
    let squared = each_of!([0, 1, 2], kind => l.add(l.add(squares[0][kind], squares[1][kind]), squares[2][kind]));
    let [_, ny, nz] = points.counts.map(|count| l.splat_i(count as i32));
    let index = l.add_i(l.mul_i(l.add_i(l.mul_i(cell[0], ny), cell[1]), nz), cell[2]);
    // SAFETY: every cell lies between 0 and the last one of its axis, and `distances` holds all of them.
    let stored = l.abs(unsafe { l.gather(&points.distances, index) });
    // Radius in steps; the slack for rounding is used on both sides, twice for the roots.
    let slack = l.splat(2.0 * view.slack);
    let radius = l.add(l.mul(l.load(&block.radii), l.splat(view.scale)), slack);
    let spare = l.max(l.sub(l.sub(stored, l.sqrt(squared[1])), slack), zero);
    let apart = l.sub(l.sqrt(l.add(squared[0], l.mul(spare, spare))), radius);
    let within = l.add(l.add(stored, l.sqrt(squared[2])), radius);
    let mut found = Gaps {
        near: l.bits(l.lt(apart, l.splat(best))),
        nearer: l.bits(l.lt(within, l.splat(enough))),
        apart: [0.0; LANES],
    };
    l.store(apart, &mut found.apart);
    found
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use crate::collision::surface_tree::Below;
    use kernel::seed::Stream;

    const SIDES: [f64; 3] = [0.31, 0.22, 0.4];

    /// Signed distance to a box from the origin to `SIDES`.
    fn signed(point: &Point3<f64>) -> f64 {
        let out = Vector3::from([0, 1, 2].map(|axis| (point[axis] - 0.5 * SIDES[axis]).abs() - 0.5 * SIDES[axis]));
        out.sup(&Vector3::zeros()).norm() + out.max().min(0.0)
    }

    fn lattice(spacing: f64) -> Points {
        let counts = SIDES.map(|side| (side / spacing).ceil() as usize + 1);
        let mut distances = Vec::new();
        for x in 0..counts[0] {
            for y in 0..counts[1] {
                for z in 0..counts[2] {
                    distances.push(signed(&(Point3::from([x, y, z].map(|point| point as f64 * spacing)))) as f32);
                }
            }
        }
        Points::new(Point3::origin(), Point3::from(SIDES), spacing, counts, distances, 1e-6)
    }

    fn balls(draw: &mut Stream, spread: f64) -> Vec<(Point3<f64>, f64)> {
        let ball = |_| {
            let centre = Point3::from([0; 3].map(|_: i32| draw.uniform(-spread, spread)));
            (centre, draw.uniform(0.0005, 0.08))
        };
        (0..LANES).map(ball).collect()
    }

    #[test]
    fn balls_of_a_block_stand_to_a_box_as_their_distances_say_at_every_level() {
        let mut draw = Stream::of_job(1, b"", "balls");
        let (mut inside, mut reaching, mut clear) = (0, 0, 0);
        for spacing in [0.01, 0.04] {
            let points = lattice(spacing);
            for _ in 0..2000 {
                let balls = balls(&mut draw, 0.3);
                let block = &Block::of_balls(&balls)[0];
                let rotation = Rotation3::from_euler_angles(draw.uniform(-3.0, 3.0), draw.uniform(-1.5, 1.5), 0.4);
                let shift = Vector3::new(draw.uniform(-0.2, 0.5), draw.uniform(-0.2, 0.4), draw.uniform(-0.2, 0.6));
                let here_from_there = IsometryMatrix3::from_parts(shift.into(), rotation);
                let view = points.view(&here_from_there, &(Point3::origin(), 0.7));
                let found = points.test_block(SimdLevel::Scalar, &view, block);
                for level in SimdLevel::available() {
                    assert_eq!(points.test_block(level, &view, block), found, "{level}");
                }
                for (lane, (centre, radius)) in balls.iter().enumerate() {
                    let distance = signed(&(here_from_there * centre));
                    let has = |bits: u32| bits >> lane & 1 == 1;
                    let away = distance.abs() - radius;
                    // Unreported balls are clear, and balls clear by more than the lattice's coarseness are not reported.
                    assert!(has(found.near) || away > 0.0, "{distance} {radius}");
                    assert!(!has(found.near) || away < 1.8 * spacing, "{distance} {radius}");
                    assert!(!has(found.inside) || distance < -radius);
                    assert!(!has(found.reaching) || distance < *radius);
                    inside += u32::from(has(found.inside));
                    reaching += u32::from(has(found.reaching));
                    clear += u32::from(!has(found.near));
                }
            }
        }
        assert!(inside > 1000 && reaching > 5000 && clear > 20_000, "{inside} {reaching} {clear}");
    }

    #[test]
    fn gaps_bound_the_distances_of_balls_at_every_level() {
        let mut draw = Stream::of_job(3, b"", "balls");
        let (mut far, mut nearer) = (0, 0);
        for round in 0..2000 {
            let points = lattice(if round % 2 == 0 { 0.01 } else { 0.04 });
            let balls = balls(&mut draw, 0.6);
            let block = &Block::of_balls(&balls)[0];
            let rotation = Rotation3::from_euler_angles(draw.uniform(-3.0, 3.0), draw.uniform(-1.5, 1.5), 0.4);
            let shift = Vector3::new(draw.uniform(-0.5, 0.8), draw.uniform(-0.2, 0.4), draw.uniform(-0.2, 0.6));
            let view = points.view(&IsometryMatrix3::from_parts(shift.into(), rotation), &(Point3::origin(), 1.2));
            let (best, enough) = (draw.uniform(0.0, 0.5), draw.uniform(0.0, 0.5));
            let found = points.gaps(SimdLevel::Scalar, &view, [best, enough], block);
            for level in SimdLevel::available() {
                assert_eq!(points.gaps(level, &view, [best, enough], block), found, "{level}");
            }
            for (lane, (centre, radius)) in balls.iter().enumerate() {
                let distance = signed(&(rotation * centre + shift)).abs();
                let apart = distance - radius;
                assert!(f64::from(found.apart[lane]) / f64::from(view.scale) <= apart);
                let has = |bits: u32| bits >> lane & 1 == 1;
                assert!(has(found.near) || apart >= best);
                assert!(!has(found.nearer) || distance + radius < enough);
                far += u32::from(!has(found.near));
                nearer += u32::from(has(found.nearer));
            }
        }
        assert!(far > 5000 && nearer > 1000, "{far} {nearer}");
    }

    #[test]
    fn balls_reach_into_round_shapes_as_their_distances_say_at_every_level() {
        let mut draw = Stream::of_job(2, b"", "balls");
        for round in 0..2000 {
            let flat = round % 2 == 0;
            let (radius, half) = (draw.uniform(0.02, 0.2), draw.uniform(0.0, 0.3));
            let rotation = Rotation3::from_euler_angles(draw.uniform(-3.0, 3.0), draw.uniform(-1.5, 1.5), 0.4);
            let pose = IsometryMatrix3::from_parts(Vector3::new(0.1, draw.uniform(-0.2, 0.2), 0.0).into(), rotation);
            let (axis, balls) = (Axis::new(&pose, radius, half, flat), balls(&mut draw, 0.5));
            let block = &Block::of_balls(&balls)[0];
            let near = axis.near(SimdLevel::Scalar, block);
            for level in SimdLevel::available() {
                assert_eq!(axis.near(level, block), near, "{level}");
            }
            for (lane, (centre, own)) in balls.iter().enumerate() {
                let point = pose * centre;
                let (side, up) = (point.xy().coords.norm(), point.z.abs() - half);
                // Distance by which a ball misses the tested region: a round shape, or a slab and a cylinder around it.
                let missed = if flat { up.max(side - radius) } else { side.hypot(up.max(0.0)) - radius } - own;
                let found = near >> lane & 1 == 1;
                assert!(found || missed > 0.0, "{missed}");
                assert!(!found || missed < 1e-4, "{missed}");
            }
        }
    }

    #[test]
    fn a_block_that_is_not_full_has_no_other_balls() {
        let block = &Block::of_balls(&[(Point3::new(0.1, 0.1, 0.1), 0.01)])[0];
        assert!(matches!(block.below[0], Below::Leaf(_)) && block.count == 1);
        let points = lattice(0.01);
        let view = points.view(&IsometryMatrix3::identity(), &(Point3::origin(), 1.0));
        assert_eq!(points.test_block(SimdLevel::detect(), &view, block), Found { near: 0, inside: 1, reaching: 1 });
    }
}
