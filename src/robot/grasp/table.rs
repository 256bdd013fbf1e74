//! Whether a hand can take hold of an object that rests on a table: how far it stays above it on its approach and while it
//! closes.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Vector3};

use super::{motion::motor_at, solids::HandSolids};
use crate::{
    hand::{Driven, Hand, Motor},
    kinematics::JointKind,
};
use kernel::geom::{RestingPose, Shape};

/// The hand comes so far along its approach, from the pregrasp to where it closes [m].
pub const STAND_OFF: f64 = 0.1;

/// Between two evaluations the joints that carry a link rotate by at most this in sum [rad]: an arc of radius r goes below the
/// lower of its ends by r STEP^2 / 8, a quarter of a millimetre at the tip of a long finger.
const STEP: f64 = 0.1;

/// Slide that counts as much as a rotation of one radian [m].
const SLIDE: f64 = 0.1;

/// The lowest point of a hand over the table [m], below 0 under it, of one grasp with two postures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableClearance {
    /// The hand comes in the posture of the grasp, and closes.
    pub shaped: f64,
    /// The hand comes opened, takes on that posture, and closes.
    pub opened: f64,
}

/// A hand over tables.
pub(super) struct TableWatch {
    hand: Arc<Hand>,
    solids: HandSolids,
    /// Longest motion of a motor between two evaluations, as time [s].
    pause: f64,
}

/// A table expressed in the hand's base frame: the height of a point is `offset` and its share along `up`.
struct Table {
    up: Vector3<f64>,
    offset: f64,
    /// The lowest point so far [m].
    lowest: f64,
}

impl TableWatch {
    pub(super) fn new(hand: &Arc<Hand>, solids: &HandSolids) -> Self {
        let rate =
            |solid: &super::solids::Solid| hand.driven().iter().map(|driven| rate(hand, solid.link, driven)).sum();
        let fastest: f64 = solids.solids.iter().map(rate).fold(0.0, f64::max);
        Self { hand: Arc::clone(hand), solids: solids.clone(), pause: STEP / fastest }
    }

    /// For each pose of the object: the lowest point of the hand on its path along `direction`, in `Object` and of unit length,
    /// to where it closes, and until it is closed as `closed`.
    pub(super) fn clearances(
        &self,
        resting: &[RestingPose],
        object_from_base: &IsometryMatrix3<f64>,
        direction: &Vector3<f64>,
        posture: &[f64],
        closed: &[Motor],
    ) -> Vec<TableClearance> {
        let engaged = |values: &[f64]| values.iter().copied().map(Motor::engaged).collect::<Vec<_>>();
        let (opened, shaped) = (engaged(&self.hand.opening(posture)), engaged(posture));
        let tables = || -> Vec<Table> { resting.iter().map(|pose| Table::under(pose, object_from_base)).collect() };
        let [mut while_shaped, mut while_closing, mut while_shaping] = [(); 3].map(|()| tables());
        self.watch(&shaped, &shaped, &mut while_shaped);
        self.watch(&shaped, closed, &mut while_closing);
        self.watch(&opened, &shaped, &mut while_shaping);
        (0..resting.len())
            .map(|index| {
                // A straight path is lowest at one of its ends.
                let back = -STAND_OFF * (resting[index].world_from_object.rotation() * direction).z;
                let come = |lowest: f64| lowest + back.min(0.0);
                let closing = while_closing[index].lowest;
                TableClearance {
                    shaped: closing.min(come(while_shaped[index].lowest)),
                    opened: closing.min(come(while_shaping[index].lowest)),
                }
            })
            .collect()
    }

    /// The lowest point above the table of the hand at rest with its links in these frames [m].
    pub(super) fn height(
        &self,
        resting: &RestingPose,
        object_from_base: &IsometryMatrix3<f64>,
        frames: &[IsometryMatrix3<f64>],
    ) -> f64 {
        let mut table = Table::under(resting, object_from_base);
        for solid in &self.solids.solids {
            table.lower(&solid.shape, &solid.base_from_shape(frames));
        }
        table.lowest
    }

    /// The lowest point over the plane z = 0 of a hand that goes from one posture to another, all motors at their speeds [m].
    pub(super) fn lowest(&self, world_from_base: &IsometryMatrix3<f64>, start: &[Motor], end: &[Motor]) -> f64 {
        let mut tables = [Table::below(world_from_base)];
        self.watch(start, end, &mut tables);
        tables[0].lowest
    }

    /// Drives all motors from start to end at once, each at its speed, and measures how low the hand comes.
    fn watch(&self, start: &[Motor], end: &[Motor], tables: &mut [Table]) {
        let hand = &self.hand;
        let mut joints = vec![0.0; hand.tree().len()];
        let mut before: Option<Vec<IsometryMatrix3<f64>>> = None;
        for time in self.times(start, end) {
            let motors: Vec<Motor> = (hand.driven().iter().zip(start.iter().zip(end)))
                .map(|(driven, (start, end))| motor_at(*start, *end, driven, time * driven.speed))
                .collect();
            hand.joint_values(&motors, &mut joints);
            let frames = hand.link_frames(&joints);
            for solid in &self.solids.solids {
                let frame = |frames: &[IsometryMatrix3<f64>]| solid.link.checked_sub(1).map(|link| frames[link]);
                let stays = before.as_ref().is_some_and(|before| frame(before) == frame(&frames));
                if stays {
                    continue;
                }
                let base_from_shape = solid.base_from_shape(&frames);
                tables.iter_mut().for_each(|table| table.lower(&solid.shape, &base_from_shape));
            }
            before = Some(frames);
        }
    }

    /// Times of evaluation: at a regular interval, and wherever a motor stops or a clutch opens.
    fn times(&self, start: &[Motor], end: &[Motor]) -> Vec<f64> {
        let mut times = vec![0.0];
        for (driven, (start, end)) in self.hand.driven().iter().zip(start.iter().zip(end)) {
            let angles = std::iter::once(end.angle).chain(end.released);
            times.extend(angles.map(|angle| (angle - start.angle).abs() / driven.speed));
        }
        let last = times.iter().copied().fold(0.0, f64::max);
        let steps = (last / self.pause).ceil() as u32;
        times.extend((1..steps).map(|lower| last * f64::from(lower) / f64::from(steps)));
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }
}

impl Table {
    fn under(pose: &RestingPose, object_from_base: &IsometryMatrix3<f64>) -> Self {
        Self::below(&(pose.world_from_object.isometry() * object_from_base))
    }

    /// The plane z = 0 of the world.
    fn below(world_from_base: &IsometryMatrix3<f64>) -> Self {
        let up = world_from_base.rotation.inverse() * Vector3::z();
        Self { up, offset: world_from_base.translation.vector.z, lowest: f64::INFINITY }
    }

    fn lower(&mut self, shape: &Shape, base_from_shape: &IsometryMatrix3<f64>) {
        let down = base_from_shape.rotation.inverse() * -self.up;
        let middle = self.offset + self.up.dot(&base_from_shape.translation.vector);
        self.lowest = self.lowest.min(middle - shape.reach_along(&down));
    }
}

/// Summed speed of the joints that the motor moves and that carry a link [rad/s]; slides count by [`SLIDE`].
fn rate(hand: &Hand, link: usize, driven: &Driven) -> f64 {
    let after =
        |index: usize| driven.breakaway.filter(|breakaway| breakaway.follower == index).map(|known| known.ratio);
    let followers = (driven.followers.iter().enumerate())
        .map(|(index, follower)| (follower.joint, follower.ratio.abs().max(after(index).unwrap_or(0.0).abs())));
    let moved: Vec<(usize, f64)> = std::iter::once((driven.joint, 1.0)).chain(followers).collect();
    let (mut link, mut sum) = (link, 0.0);
    while link > 0 {
        let joint = &hand.tree().joints()[link - 1];
        let unit = if joint.joint.kind == JointKind::Prismatic { SLIDE } else { 1.0 };
        sum += moved.iter().filter(|(moved, _)| *moved == link - 1).map(|(_, ratio)| ratio / unit).sum::<f64>();
        link = joint.carried_by;
    }
    sum * driven.speed
}
