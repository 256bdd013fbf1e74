//! Scenes: bodies that fall, are put down, and come to rest on true meshes.
//!
//! A [`SettleWorker`] is what one thread needs. Contacts between bodies, and between bodies and their container, are those of
//! [`kernel::contact`], found at their boxes by MuJoCo. Stepping is of class `physics`. A scene is settled, then put back at the
//! poses that are stored and stepped again from rest: what moves then was no equilibrium.

mod collider;
mod model;
mod outcome;
mod patch;
mod settings;
mod walls;
mod worker;

pub(super) use collider::{SceneCollider, SceneLoan, with_scene};
pub use outcome::{Fault, SceneTouch, SettledBody, SettledScene};
pub(super) use patch::BodyPatch;
pub use settings::{Container, Placement, SceneBody, SettleSettings, Vessel};
pub use walls::Walls;
pub use worker::SettleWorker;
