//! Robots and hands without a simulator: kinematics, collisions, hands and their tables, what makes a grasp good, and suction cups.

// Tests compare with what the C library computes.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod collision;
pub mod grasp;
pub mod hand;
pub mod kinematics;
pub mod suction;
