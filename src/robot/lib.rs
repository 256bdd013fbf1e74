//! Robots and hands without a simulator: kinematics, collisions, hands and their tables, and what makes a grasp good.

// Tests compare with what the C library computes.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod collision;
pub mod grasp;
pub mod hand;
pub mod kinematics;
