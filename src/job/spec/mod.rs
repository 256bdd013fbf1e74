//! The job file as written: the one source of its keys, from which the decoder, the JSON Schema and the reference in
//! docs/jobs.md are all derived (see `schema`). What every job has stands here, the rest in one file a product.
//!
//! Keys with a default are plain values here, since the profile's file fills them in before a job is read; an `Option`
//! is a key without a default. `x-unit` is the unit of a number.

pub mod built_in;
pub mod completion;
pub mod grasp;
pub mod patches;
pub mod reachability;
pub mod set;
pub mod touch;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::checked::Profile;
use crate::ids::Product;

/// The keys that every job has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeadSpec {
    /// What the job makes. Decides which of the other keys there are.
    #[schemars(extend("examples" = ["reachability"]))]
    pub product: Product,
    /// Name of the job, for people. Without it, the file's name.
    #[schemars(extend("examples" = ["ycb-completion"]))]
    pub name: Option<String>,
    /// Seed of every random stream: split, distances, sensor noise, starts of a search. Each is keyed by what it is for,
    /// so that adding a mesh or storing one more channel changes no other sample.
    #[schemars(range(min = 0), extend("examples" = [7]))]
    pub seed: i64,
    /// Which defaults the other keys have. A profile sets nothing that cannot be set on its own.
    #[schemars(extend("examples" = ["thesis"]))]
    pub profile: Profile,
    /// What `--set` changed when this file was written. Already applied; only for the record.
    pub overrides: Vec<String>,
}

/// The keys of one product.
#[derive(Clone, Debug, PartialEq)]
pub enum BodySpec {
    /// `product = "completion"`.
    Completion(Box<completion::CompletionSpec>),
    /// `product = "reachability"`.
    Reachability(Box<reachability::ReachabilitySpec>),
    /// `product = "grasps"`.
    Grasps(Box<grasp::GraspsSpec>),
    /// `product = "patches"`.
    Patches(Box<patches::PatchesSpec>),
}
