//! Planning of grasps and motions on a robot: exact, deterministic, and bounded by counted work; no simulator and no clock.

pub mod energy;
pub mod motion;
pub mod plan;
