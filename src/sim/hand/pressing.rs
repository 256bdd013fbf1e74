//! Motors that press with a torque ([`MotorLaw::Torque`](super::effort::MotorLaw)).

use crate::hand::{
    effort::Effort,
    moved::{Moved, moved},
    sim::Servo,
};
use crate::physics::STEP;
use robot::hand::{Driven, Motor};

/// Sets the servos of the joints that a motor moves so that they press towards the closed hand with its torque, one step
/// later; those of a joint that does not close the hand stay. `values` and `wanted` are values of all joints and the
/// targets of their servos [rad or m], in the order of the hand's tree.
///
/// A servo is a spring, so its target is put where the springs of all joints that the motor moves bear its torque
/// together: coupled joints, as the pads of a gripper, keep their ratio. Returns the motor's angle.
pub(crate) fn press(driven: &Driven, effort: Effort, servos: &[Servo], values: &[f64], wanted: &mut [f64]) -> f64 {
    let (sign, engaged) = (driven.closing_sign(), Motor::engaged(wanted[driven.joint]));
    if sign == 0.0 {
        return engaged.angle;
    }
    let alone = driven.breakaway.map(|breakaway| driven.followers[breakaway.follower].joint);
    let joints: Vec<Moved> = moved(driven, engaged).collect();
    // Joints in fixed ratios to the motor.
    let coupled = joints.iter().filter(|moved| alone != Some(moved.joint));
    let (mut pushes, mut stiffness, mut most) = (0.0, 0.0, 0.0);
    for Moved { joint, rate, torque, .. } in coupled.clone() {
        let spring = servos[*joint].stiffness;
        pushes += sign * rate * spring * (wanted[*joint] - values[*joint]);
        stiffness += rate * rate * spring;
        most += rate.abs() * effort.torque * torque;
    }
    let travel = (effort.speed * driven.speed * STEP).min((most - pushes) / stiffness);
    let end = driven.closed.unwrap_or(engaged.angle);
    let left = sign * (end - engaged.angle);
    let travel = sign * travel.min(left);
    for Moved { joint, rate, .. } in coupled {
        wanted[*joint] += rate * travel;
    }
    // The follower with a clutch, on to the limit of its joint.
    for Moved { joint, rate, torque, .. } in joints.iter().filter(|moved| alone == Some(moved.joint)) {
        let ratio = driven.breakaway.map_or(*rate, |breakaway| breakaway.ratio);
        let (towards, spring) = (sign * ratio.signum(), servos[*joint].stiffness);
        let pushes = towards * spring * (wanted[*joint] - values[*joint]);
        let travel = (effort.speed * driven.speed * ratio.abs() * STEP).min((effort.torque * torque - pushes) / spring);
        let [low, high] = driven
            .followers
            .iter()
            .find(|follower| follower.joint == *joint)
            .map_or([f64::NEG_INFINITY, f64::INFINITY], |follower| follower.limits);
        let end = if towards > 0.0 { high } else { low };
        wanted[*joint] += towards * travel.min(towards * (end - wanted[*joint]));
    }
    engaged.angle + travel
}
