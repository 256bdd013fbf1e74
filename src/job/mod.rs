//! Jobs: as written (TOML), then as meant (checked, every default filled in, assets by hash).
//!
//! ```text
//! JobText --read--> JobDraft --(the caller prepares its meshes)--> resolve --> Job
//! ```
//!
//! [`JobDraft::read`] decodes the file by its schema, checks it and lists its meshes, and reports every mistake of the
//! file at once. Reading meshes is the caller's, so that it may use threads. [`Job::to_toml`] writes the job back with
//! every default filled in and every mesh pinned by content; [`Job::digest`] names it.

mod built_in;
mod canonical;
mod check;
mod checked;
mod decode;
mod difference;
mod discover;
mod document;
mod draft;
mod errors;
mod estimate;
mod mesh_table;
mod packages;
mod pattern;
mod reference;
mod resolve;
mod schema;
mod set;
mod spec;
mod strict;

pub use check::{
    GraspsReader, HandReader, RobotFault, RobotKey, RobotReader, SceneReader, no_grasps, no_hands, no_robots, no_scenes,
};
pub use checked::{
    Channels, ChosenGrasp, Collisions, Completion, CompletionJob, DepthFormat, Distance, Divided, FoundGrasps, Gate,
    GraspJob, GraspSettings, GraspedObject, ImplicitSamples, Job, JobHand, JobObject, KnownMass, ModelChoice,
    ObjectSide, PackageFile, PatchColours, PatchJob, PatchLabel, PatchSettings, Physics, Pivot, Profile, RandomRays,
    RayTarget, ReachabilityJob, Renderer, Robot, SceneCamera, Solver, SplitSettings, SubsetSize, Touch, TouchByHand,
    Truth, TypeChoice, WORLD, Work,
};
pub use difference::{SettingDifference, setting_differences};
pub use document::Step;
pub use draft::{
    CompletionDraft, FoundMesh, GraspDraft, JobDraft, JobText, ObjectsDraft, Surroundings, WorkDraft,
    default_shard_samples,
};
pub use errors::{JobError, JobErrors, Place, Problem};
pub use estimate::{Estimate, GraspCosts, expected_bytes, grasp_costs, seconds_of_hands};
pub use packages::{MeshPackage, PACKAGES, package};
pub use reference::reference;
pub use schema::schema;
pub use set::{JobSet, SetMember};
pub use spec::completion::UnitSpec;
pub use strict::{StrictFile, fits, meant};
