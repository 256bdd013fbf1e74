//! MuJoCo: the only crate that uses it. For a scene, the camera, depth and colours of one object by MuJoCo's own rays
//! or renderer; for robots, planning groups, colliding geoms and MuJoCo's contacts; for hands, their description and
//! how they close.
//!
//! A [`SimModel`] is one object before the camera of `scenes/single_view.xml`, compiled once and shared; a [`SimWorker`]
//! is what one thread needs to render it. Both renderers agree with our rasteriser (`tests/depth_oracles.rs`),
//! and neither is of class `exact`: the compiler's choice of inertial frame and the rays run through the C library's
//! maths (class `physics`), the renderer's pixels are the driver's (class `colour`).
//!
//! A [`HandModel`] is a hand and its table; a [`HandSim`] is it with a fixed object, compiled once and shared, a
//! [`HandWorker`] the state that one thread needs to move it. The object may be a true mesh: MuJoCo itself collides the
//! convex hull of one. A [`TrialSim`] is a hand with an object that moves freely, a [`TrialWorker`] closes, lifts and
//! shakes: the physics label of a grasp. A [`SettleWorker`] lets bodies fall and come to rest in a container, and a
//! [`ClutterWorker`] tries a grasp of one of them. Stepping is of class `physics`.
//!
//! MuJoCo ends the process on an error inside its engine (`mju_error`). So names, sizes and finiteness are checked
//! before each call, and what still happens is reported by a handler that `ffi` installs before the first call.

// Tests compare with what the C library computes.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

/// An environment variable and its value that keep Mesa's software driver from starting its own threads in each of
/// ours: with all cores busy a view takes a quarter of the time (2.5 ms instead of 12), and no bit changes. It must be
/// set before the process starts: the command line runs itself again with it.
pub const GL_ENVIRONMENT: (&str, &str) = ("LP_NUM_THREADS", "0");

mod clutter;
mod convert;
mod description;
mod error;
mod ffi;
mod hand;
mod objects;
mod physics;
mod probe;
mod render;
mod settle;
#[cfg(test)]
mod statement_tests;
pub mod statements;
mod trial;

pub use clutter::{
    ClutterOutcome, ClutterPhase, ClutterProtocol, ClutterScene, ClutterSim, ClutterTouch, ClutterVerdict,
    ClutterWorker, NeighbourMotion,
};
pub use description::{
    bodies::{Collidable, PairRule},
    contacts::{BodyContact, ContactWorker},
    robot::RobotModel,
    scene::scene_camera,
};
pub use error::{
    GlError, HandError, RefusedStatement, RobotError, SceneError, SimError, exclude_line, place_of_excludes,
};
pub use hand::{
    closing::{HandWorker, Run, RunEnd},
    effort::{Effort, MotorCommand, MotorLaw},
    feeling::{ApproachOutcome, HandApproach, HandApproachEnd, MoveEnd, OVERLOAD},
    link_touch::LinkTouch,
    model::HandModel,
    sim::HandSim,
};
pub use objects::{
    container::{Container, Vessel},
    mesh::Inertia,
    native_mesh::NativeContacts,
    scene_body::SimBody,
    thing::{StillShape, StillThing, ThingTouch},
};
pub use physics::{Instability, Numerics, Unstable};
pub use probe::{GlFacts, SimFacts, gl_facts, sim_facts};
pub use render::{
    colour::{Appearance, Light, Window},
    depth::SimWorker,
    model::{LIGHTS, SimModel},
};
pub use settle::{Fault, Placement, SceneTouch, SettleOutcome, SettleSettings, SettleWorker, SettledBody, Walls};
pub use trial::{
    Climb, FOLLOWED, Gravity, Grip, Limit, Loss, Margins, Outcome, Peak, Phase, PlainHand, Rung, Series, SeriesSample,
    Slip, Start, TableSupport, TrialConditions, TrialFailure, TrialLevel, TrialProtocol, TrialSim, TrialSpread,
    TrialWorker, Variant, Verdict, WhileClosing, climb, conditions_at, failure_reason, mass_of_volume, plain_hand,
};
