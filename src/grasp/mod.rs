//! Grasps: what makes one good.

pub mod wrench;
