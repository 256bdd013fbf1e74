//! A hand for trials in an independent MuJoCo: MJCF with the servos, and their drives.

use serde::Serialize;

use super::TrialProtocol;
use crate::{
    error::HandError,
    ffi::drop_meshes,
    hand::{
        closing::{HOLDS, STANDING, START, STEPS_AT_REST, STEPS_TO_OPEN},
        model::HandModel,
        sim::{hand_spec, refused_by, servo_of, set_option},
    },
    physics::{CONTACT_SOLIMP, CONTACT_SOLREF},
};
use robot::hand::{Breakaway, Driven, Follower, Hand};

/// Bytes written before more memory is reserved, at most.
const ROOM: usize = 1 << 16;

/// A hand for plain MuJoCo.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlainHand {
    /// The hand as trials compile it, without an object: MJCF with a servo for each joint.
    pub mjcf: String,
    /// JSON: the motors' control of the servos, and the protocol of a trial.
    pub drive: String,
}

/// Control of the servos, and the protocol of a trial. docs/format.md explains the numbers.
#[derive(Serialize)]
struct Drive<'h> {
    hand: &'h str,
    motors: Vec<MotorText<'h>>,
    law: Law,
    protocol: Protocol,
}

#[derive(Serialize)]
struct MotorText<'h> {
    name: &'h str,
    joint: &'h str,
    servo: String,
    opened: f64,
    closed: Option<f64>,
    speed: f64,
    torque: f64,
    holding_torque: f64,
    followers: Vec<FollowerText<'h>>,
}

#[derive(Serialize)]
struct FollowerText<'h> {
    joint: &'h str,
    servo: String,
    ratio: f64,
    offset: f64,
    limits: [f64; 2],
    /// Once the clutch has opened.
    alone: Option<Alone>,
}

#[derive(Serialize)]
struct Alone {
    ratio: f64,
    torque: f64,
    holding_torque: f64,
}

#[derive(Serialize)]
struct Law {
    start: f64,
    holds: f64,
    steps_to_open: u32,
    steps_at_rest: u32,
    standing: f64,
}

#[derive(Serialize)]
struct Protocol {
    start_depth: f64,
    closing: f64,
    settling: f64,
    speed: f64,
    torque: f64,
    lift: f64,
    lift_time: f64,
    shake: f64,
    frequencies: [f64; 3],
    shake_time: f64,
    turned_time: f64,
    lost_distance: f64,
    lost_angle: f64,
}

/// The hand alone as trials compile it, and its drives; `None` if the description names mesh files, which plain MuJoCo
/// would need to read it, and bodies without a name. Meshes touch nothing in trials: they are left out. Trials on a
/// table cannot be replayed from it: it does not contain the table.
///
/// # Errors
/// When MuJoCo refuses the hand.
pub fn plain_hand(model: &HandModel, protocol: &TrialProtocol) -> Result<Option<PlainHand>, HandError> {
    let refused = refused_by(model);
    let (mut spec, _) = hand_spec(model)?;
    if spec.mesh_iter().next().is_some() {
        let model = spec.compile().map_err(refused)?;
        if !drop_meshes(&mut spec, &model).map_err(refused)? {
            return Ok(None);
        }
    }
    // The object's file is in another folder.
    spec.compiler_mut().set_meshdir("");
    set_option(spec.option_mut());
    for geom in spec.geom_iter_mut() {
        *geom.solref_mut() = CONTACT_SOLREF;
        *geom.solimp_mut() = CONTACT_SOLIMP;
    }
    spec.compile().map_err(refused)?;
    let mjcf = match spec.save_xml_string(ROOM) {
        Err(mujoco_rs::error::MjEditError::XmlBufferTooSmall { required_size }) => {
            spec.save_xml_string(required_size + 1)
        }
        saved => saved,
    };
    let hand = &model.hand;
    let drive = Drive {
        hand: hand.name(),
        motors: hand.driven().iter().map(|driven| motor(hand, driven)).collect(),
        law: Law {
            start: START,
            holds: HOLDS,
            steps_to_open: STEPS_TO_OPEN,
            steps_at_rest: STEPS_AT_REST,
            standing: STANDING,
        },
        protocol: stated(protocol),
    };
    let drive = serde_json::to_string_pretty(&drive).expect("plain data with text keys") + "\n";
    Ok(Some(PlainHand { mjcf: mjcf.map_err(refused)?, drive }))
}

fn motor<'h>(hand: &'h Hand, driven: &'h Driven) -> MotorText<'h> {
    let name_of = |joint: usize| hand.tree().joints()[joint].joint.name.as_str();
    let follower = |(index, Follower { joint, ratio, offset, limits }): (usize, &Follower)| {
        let alone = driven.breakaway.filter(|breakaway| breakaway.follower == index);
        FollowerText {
            joint: name_of(*joint),
            servo: servo_of(name_of(*joint)),
            ratio: *ratio,
            offset: *offset,
            limits: *limits,
            alone: alone.map(|Breakaway { ratio, torque, holding_torque, .. }| Alone { ratio, torque, holding_torque }),
        }
    };
    MotorText {
        name: &driven.name,
        joint: name_of(driven.joint),
        servo: servo_of(name_of(driven.joint)),
        opened: driven.opened,
        closed: driven.closed,
        speed: driven.speed,
        torque: driven.torque,
        holding_torque: driven.holding_torque,
        followers: driven.followers.iter().enumerate().map(follower).collect(),
    }
}

fn stated(protocol: &TrialProtocol) -> Protocol {
    let TrialProtocol { start_depth, closing, settling, effort, lift, lift_time, shake, .. } = *protocol;
    let TrialProtocol { frequencies, shake_time, turned_time, lost_distance, lost_angle, .. } = *protocol;
    Protocol {
        start_depth,
        closing,
        settling,
        speed: effort.speed,
        torque: effort.torque,
        lift,
        lift_time,
        shake,
        frequencies,
        shake_time,
        turned_time,
        lost_distance,
        lost_angle,
    }
}
