//! Joints that a motor moves, and the loads that they bear.

use robot::hand::{Driven, Motor};

/// A joint as a motor moves it now.
pub(crate) struct Moved {
    /// Index in the hand's tree of joints.
    pub(crate) joint: usize,
    /// Travel per unit of the motor.
    pub(crate) rate: f64,
    /// Torque or force that stops the motor [N m or N].
    pub(crate) torque: f64,
    /// Torque or force at which the joint gives way once the motor has stopped [N m or N].
    pub(crate) holding_torque: f64,
}

/// Joints that a motor moves now: with an open clutch only one follower.
pub(crate) fn moved(driven: &Driven, motor: Motor) -> impl Iterator<Item = Moved> {
    let Driven { joint, torque, holding_torque, .. } = *driven;
    let own = Moved { joint, rate: 1.0, torque, holding_torque };
    let followers = driven.followers.iter().enumerate().map(move |(index, follower)| {
        let alone = driven.breakaway.filter(|breakaway| breakaway.follower == index);
        let rate = match (alone, motor.released) {
            (Some(breakaway), Some(_)) => breakaway.ratio,
            _ => follower.ratio,
        };
        let (torque, holding_torque) =
            alone.map_or((torque, holding_torque), |breakaway| (breakaway.torque, breakaway.holding_torque));
        (Moved { joint: follower.joint, rate, torque, holding_torque }, alone.is_some())
    });
    let all = std::iter::once((own, false)).chain(followers);
    all.filter(move |(moved, alone)| moved.rate != 0.0 && (*alone || motor.released.is_none())).map(|(moved, _)| moved)
}
