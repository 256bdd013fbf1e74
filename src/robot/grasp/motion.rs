//! Motion of a hand's links by its motors, and the posture that it comes in.

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use crate::{
    hand::{Driven, Hand, Motor},
    kinematics::JointKind,
};

/// The opened hand, in the shape from which the eigengrasps start.
pub(super) fn preshape(hand: &Hand) -> Vec<f64> {
    let shape = hand.eigengrasps().map_or_else(|| hand.opened(), |grasps| grasps.origin.clone());
    let of = |(driven, shape): (&Driven, f64)| match driven.closing_sign() {
        0.0 => shape.max(driven.range()[0]).min(driven.range()[1]),
        _ => driven.opened,
    };
    hand.driven().iter().zip(shape).map(of).collect()
}

/// A motor between start and end, after it has moved by an angle.
pub(super) fn motor_at(start: Motor, end: Motor, driven: &Driven, distance: f64) -> Motor {
    let whole = end.angle - start.angle;
    if distance >= whole.abs() {
        return end;
    }
    let angle = start.angle + distance * whole.signum();
    let opened = end.released.filter(|left| (angle - left) * driven.closing_sign() > 0.0);
    Motor { angle, released: opened }
}

/// Whether a driven joint or one of its followers carries a link.
pub(super) fn moves(hand: &Hand, link: usize, driven: &Driven) -> bool {
    let mut link = link;
    while link > 0 {
        let joint = link - 1;
        if joint == driven.joint || driven.followers.iter().any(|follower| follower.joint == joint) {
            return true;
        }
        link = hand.tree().joints()[joint].carried_by;
    }
    false
}

/// Joints that a motor moves, with how far each goes for a unit of it.
fn rates(driven: &Driven, released: bool) -> Vec<(usize, f64)> {
    match driven.breakaway {
        Some(breakaway) if released => vec![(driven.followers[breakaway.follower].joint, breakaway.ratio)],
        _ => {
            let followers = driven.followers.iter().map(|follower| (follower.joint, follower.ratio));
            std::iter::once((driven.joint, 1.0)).chain(followers).collect()
        }
    }
}

/// Largest motion of any point of a solid per unit of a motor [m], before and after the motor's clutch has opened.
pub(super) fn reach(hand: &Hand, link: usize, centre: Point3<f64>, radius: f64, driven: &Driven) -> [f64; 2] {
    [false, true].map(|released| {
        let rates = rates(driven, released);
        let (mut link, mut arm, mut sum) = (link, centre.coords.norm() + radius, 0.0);
        while link > 0 {
            let joint = &hand.tree().joints()[link - 1];
            let slides = joint.joint.kind == JointKind::Prismatic;
            let rate: f64 = rates.iter().filter(|(moved, _)| *moved == link - 1).map(|(_, rate)| rate.abs()).sum();
            sum += rate * if slides { 1.0 } else { arm };
            // A slide carries what hangs on it farther away, by its range at most.
            let slid =
                joint.joint.limits.filter(|_| slides).map_or(0.0, |limits| limits.low.abs().max(limits.high.abs()));
            arm += joint.joint.origin.translation.vector.norm() + slid;
            link = joint.carried_by;
        }
        sum
    })
}

/// Joints that a motor moves: each with its index in the tree, an axis times the rate, a point of the axis, and whether it
/// slides; expressed in the base.
pub(super) fn velocities(
    hand: &Hand,
    frames: &[IsometryMatrix3<f64>],
    motor: Motor,
    driven: &Driven,
) -> Vec<(usize, Vector3<f64>, Point3<f64>, bool)> {
    let sign = driven.closing_sign();
    let of = |(joint, rate): (usize, f64)| {
        let frame = &frames[joint];
        let kind = &hand.tree().joints()[joint].joint;
        let axis = frame.rotation * kind.axis.into_inner() * (rate * sign);
        (joint, axis, Point3::from(frame.translation.vector), kind.kind == JointKind::Prismatic)
    };
    rates(driven, motor.released.is_some()).into_iter().map(of).collect()
}

/// Velocity of a point of a link, expressed in the base.
pub(super) fn velocity(
    velocities: &[(usize, Vector3<f64>, Point3<f64>, bool)],
    hand: &Hand,
    link: usize,
    at: &Point3<f64>,
) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    let mut link = link;
    while link > 0 {
        for (_, axis, point, slides) in velocities.iter().filter(|(joint, ..)| *joint == link - 1) {
            sum += if *slides { *axis } else { axis.cross(&(at - point)) };
        }
        link = hand.tree().joints()[link - 1].carried_by;
    }
    sum
}
