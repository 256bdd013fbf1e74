//! Whether links of a hand meet each other.

use nalgebra::{Point3, Vector3};

use super::{
    frame::Frame,
    links::{Links, MAX_JOINTS},
    motion::reach,
    solids::{ALLOWED_OVERLAP, Balls, HandSolids, LANES, SPACING, Solid, distance_to},
};
use crate::hand::{Driven, Hand};
use kernel::geom::Shape;

/// Cells along each amplitude, a power of two: 65,536 in all for one or two eigengrasps; of more there is no table.
const SIDES: [usize; 3] = [0, 65_536, 256];

/// In which cells of the amplitudes' ranges no two links meet that may not.
pub(super) struct ClearPostures {
    ranges: Vec<[f64; 2]>,
    /// Cells along each amplitude.
    side: usize,
    clear: Vec<bool>,
}

/// Inputs that fill the table.
struct Filling<'a> {
    links: &'a Links,
    solids: &'a HandSolids,
    /// Largest motion of each solid per unit of each amplitude [m].
    speeds: Vec<Vec<f64>>,
    values: [f64; MAX_JOINTS],
    frames: Vec<Frame>,
}

impl ClearPostures {
    /// Clear is a cell in whose middle the links are farther from each other than they move within it.
    pub(super) fn new(hand: &Hand, links: &Links, solids: &HandSolids) -> Self {
        let directions = hand.eigengrasps().map_or(&[][..], |grasps| &grasps.directions);
        let ranges: Vec<[f64; 2]> = (0..directions.len()).map(|direction| hand.amplitude_range(direction)).collect();
        let side = SIDES.get(ranges.len()).copied().unwrap_or(0);
        let count = if side == 0 { 0 } else { side.pow(ranges.len() as u32) };
        let mut table = Self { ranges, side, clear: vec![false; count] };
        if count > 0 {
            let speed = |solid: &Solid, direction: &Vec<f64>| {
                let of = |(driven, step): (&Driven, &f64)| {
                    step.abs() * reach(hand, solid.link, solid.centre, solid.reach, driven)[0]
                };
                hand.driven().iter().zip(direction).map(of).sum::<f64>()
            };
            let speeds =
                solids.solids.iter().map(|solid| directions.iter().map(|direction| speed(solid, direction)).collect());
            let mut filling = Filling {
                links,
                solids,
                speeds: speeds.collect(),
                values: [0.0; MAX_JOINTS],
                frames: vec![Frame::identity(); links.count()],
            };
            let first = vec![0; table.ranges.len()];
            table.fill(&mut filling, &solids.pairs, &first, side);
        }
        table
    }

    /// Fills a block of cells, `side` along each amplitude, in which other pairs than these are known to be clear.
    fn fill(&mut self, filling: &mut Filling<'_>, pairs: &[[usize; 2]], first: &[usize], side: usize) {
        let width = |[low, high]: &[f64; 2]| (high - low) / self.side as f64;
        let middle =
            |(range, first): (&[f64; 2], &usize)| range[0] + width(range) * (*first as f64 + side as f64 / 2.0);
        let amplitudes: Vec<f64> = self.ranges.iter().zip(first).map(middle).collect();
        let halves: Vec<f64> = self.ranges.iter().map(|range| width(range) * side as f64 / 2.0).collect();
        let near: Vec<[usize; 2]> = filling.near(pairs, &amplitudes, &halves);
        let parts = 1 << first.len();
        if near.is_empty() {
            self.mark(first, side);
        } else if side > 1 {
            for part in 0..parts {
                let first: Vec<usize> =
                    first.iter().enumerate().map(|(axis, first)| first + (part >> axis & 1) * side / 2).collect();
                self.fill(filling, &near, &first, side / 2);
            }
        }
    }

    /// Notes that a block of cells is clear.
    fn mark(&mut self, first: &[usize], side: usize) {
        for number in 0..side.pow(first.len() as u32) {
            let cell = first
                .iter()
                .enumerate()
                .rev()
                .fold(0, |cell, (axis, first)| cell * self.side + first + number / side.pow(axis as u32) % side);
            self.clear[cell] = true;
        }
    }

    /// Whether no two links meet for sure.
    #[inline(always)]
    pub(super) fn holds(&self, amplitudes: &[f64]) -> bool {
        if self.side == 0 {
            return false;
        }
        let mut cell = 0;
        for (amplitude, [low, high]) in amplitudes.iter().zip(&self.ranges).rev() {
            let share = (amplitude - low) / (high - low);
            if !(0.0..=1.0).contains(&share) {
                return false;
            }
            cell = cell * self.side + ((share * self.side as f64) as usize).min(self.side - 1);
        }
        self.clear[cell]
    }
}

impl Filling<'_> {
    /// Pairs that may meet if each amplitude is off by up to its value in `halves`.
    fn near(&mut self, pairs: &[[usize; 2]], amplitudes: &[f64], halves: &[f64]) -> Vec<[usize; 2]> {
        self.links.values(amplitudes, &mut self.values);
        self.links.link_frames(&Frame::identity(), &self.values, &mut self.frames);
        let moves = |solid: usize| self.speeds[solid].iter().zip(halves).map(|(speed, half)| speed * half).sum::<f64>();
        let may_meet = |[one, other]: &&[usize; 2]| {
            let solids = &self.solids.solids;
            apart_at_least(&solids[*one], &solids[*other], &self.frames) <= moves(*one) + moves(*other)
        };
        pairs.iter().filter(may_meet).copied().collect()
    }
}

/// A lower bound of how far two solids are from each other [m].
fn apart_at_least(one: &Solid, other: &Solid, frames: &[Frame]) -> f64 {
    let [a, b] = [one, other].map(|solid| frames[solid.link].point(&solid.centre.coords));
    let around = (a - b).norm() - one.reach - other.reach;
    if around > SPACING {
        return around;
    }
    if let (Some((p, q, r)), Some((s, t, u))) = (axis(one, frames), axis(other, frames)) {
        return segments_apart_squared(p, q, s, t).sqrt() - r - u;
    }
    // No point of a solid is farther from its balls than they from each other.
    let (balls, solid, solid_from_balls) = balls_against(one, other, frames);
    let each = balls.balls.iter().flat_map(|block| (0..LANES).map(move |lane| (block, lane)));
    let distances = each.map(|(block, lane)| ball_apart(solid, &solid_from_balls, block, lane));
    distances.fold(f64::INFINITY, f64::min) - SPACING
}

/// Distance of a ball of one solid from another solid [m].
#[inline(always)]
fn ball_apart(solid: &Solid, solid_from_balls: &Frame, block: &Balls, lane: usize) -> f64 {
    let centre = Vector3::new(block.x[lane], block.y[lane], block.z[lane]).map(f64::from);
    distance_to(&solid.shape, &Point3::from(solid_from_balls.point(&centre))) - f64::from(block.radius[lane])
}

/// Two solids in order: the one whose balls are evaluated, the other, and the frame of the balls' link expressed in the
/// other's own.
#[inline(always)]
fn balls_against<'a>(one: &'a Solid, other: &'a Solid, frames: &[Frame]) -> (&'a Solid, &'a Solid, Frame) {
    // Capsules are made of the fewest.
    let (balls, solid) = if one.balls.len() <= other.balls.len() { (one, other) } else { (other, one) };
    let shape_from_link = frames[solid.link].times(&Frame::of(&solid.link_from_shape)).inverse();
    (balls, solid, shape_from_link.times(&frames[balls.link]))
}

/// Whether two solids of the hand overlap by more than is allowed.
pub(super) fn overlap(one: &Solid, other: &Solid, frames: &[Frame]) -> bool {
    let [a, b] = [one, other].map(|solid| frames[solid.link].point(&solid.centre.coords));
    let max = one.reach + other.reach;
    if (a - b).norm_squared() > max * max {
        return false;
    }
    let [one_axis, other_axis] = [one, other].map(|solid| axis(solid, frames));
    if let (Some((p, q, r)), Some((s, t, u))) = (one_axis, other_axis) {
        let min = r + u - ALLOWED_OVERLAP;
        return segments_apart_squared(p, q, s, t) < min * min;
    }
    let (balls, solid, solid_from_balls) = balls_against(one, other, frames);
    let middle = Point3::from(solid_from_balls.point(&balls.centre.coords));
    if distance_to(&solid.shape, &middle) > balls.reach {
        return false;
    }
    // Only pieces whose cover reaches the other solid.
    balls.balls.iter().enumerate().any(|(piece, block)| {
        ball_apart(solid, &solid_from_balls, &balls.covers[piece / LANES], piece % LANES) < 0.0
            && (0..LANES).any(|lane| ball_apart(solid, &solid_from_balls, block, lane) < -ALLOWED_OVERLAP)
    })
}

/// Both ends and the radius of a capsule or ball.
fn axis(solid: &Solid, frames: &[Frame]) -> Option<(Vector3<f64>, Vector3<f64>, f64)> {
    let (half, radius) = match solid.shape {
        Shape::Capsule { radius, half } => (half, radius),
        Shape::Sphere { radius } => (0.0, radius),
        _ => return None,
    };
    let end = |z: f64| frames[solid.link].point(&(solid.link_from_shape * Point3::new(0.0, 0.0, z)).coords);
    Some((end(-half), end(half), radius))
}

/// Squared distance of two segments (Ericson 2005, "Real-Time Collision Detection", 5.1.9).
fn segments_apart_squared(p: Vector3<f64>, q: Vector3<f64>, s: Vector3<f64>, t: Vector3<f64>) -> f64 {
    let (one, other, between) = (q - p, t - s, p - s);
    let (a, e, f) = (one.norm_squared(), other.norm_squared(), other.dot(&between));
    let (c, b) = (one.dot(&between), one.dot(&other));
    let clamped = |value: f64| value.clamp(0.0, 1.0);
    let (along_one, along_other) = if a == 0.0 {
        (0.0, if e == 0.0 { 0.0 } else { clamped(f / e) })
    } else if e == 0.0 {
        (clamped(-c / a), 0.0)
    } else {
        let parallel = a * e - b * b;
        let along = if parallel > 0.0 { clamped((b * f - c * e) / parallel) } else { 0.0 };
        match (b * along + f) / e {
            other if other < 0.0 => (clamped(-c / a), 0.0),
            other if other > 1.0 => (clamped((b - c) / a), 1.0),
            other => (along, other),
        }
    };
    (between + one * along_one - other * along_other).norm_squared()
}
