//! Robots and hands without a simulator: kinematics, collisions, hands and their tables, and what makes a grasp good.

pub mod collision;
pub mod grasp;
pub mod hand;
pub mod kinematics;
