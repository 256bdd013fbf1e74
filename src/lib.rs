//! graspmill: a simulation-driven synthetic data factory for robotic grasping.
//!
//! Data flows one way, and so do the modules' dependencies (`tests/architecture.rs` holds them to it):
//!
//! ```text
//! jobs/*.toml -> job -> plan -> run( produce x sim x render ) -> record -> dataset -> runtime
//! ```
//!
//! [`geom`] is pure maths; [`assets`] reads and mends meshes; [`voxel`] and [`render`] hold the kernels;
//! `produce` makes samples of them; `run` schedules; [`record`] and [`dataset`] are the format; [`runtime`] reads it
//! back without a simulator. [`kinematics`], [`collision`] and [`hand`] know robots and hands without one,
//! `contact` where solids touch a true mesh, `grasp` what makes a grasp good.
//! ARCHITECTURE.md says more.

pub mod collision;
pub mod dataset;
pub mod geom;
pub mod hand;
pub mod ids;
pub mod kinematics;
pub mod record;
pub mod runtime;

#[cfg(feature = "factory")]
pub mod assets;
#[cfg(feature = "factory")]
pub mod cli;
#[cfg(feature = "factory")]
pub mod cluster;
#[cfg(feature = "factory")]
pub mod contact;
#[cfg(feature = "factory")]
pub mod export;
#[cfg(feature = "factory")]
pub mod grasp;
#[cfg(feature = "factory")]
pub mod job;
#[cfg(feature = "factory")]
pub mod plan;
#[cfg(feature = "factory")]
pub mod produce;
#[cfg(feature = "factory")]
pub mod release;
#[cfg(feature = "factory")]
pub mod render;
#[cfg(feature = "factory")]
pub mod run;
#[cfg(feature = "factory")]
pub mod seed;
#[cfg(feature = "factory")]
pub mod voxel;

#[cfg(feature = "sim")]
pub mod sim;
