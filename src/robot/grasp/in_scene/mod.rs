//! Grasps sampled on a body of a scene: contact pairs between two pads, with container and neighbours as obstacles from the start.
//!
//! A pose is drawn in four steps (`draw`): two opposite points of the body, a roll about the line between them near straight down,
//! how far the hand opens, and how far its tips reach past the pair. Tests that only answer yes or no reject nearly all poses before
//! a distance is computed (`sweep`, `rejections`); each is looser than the exact path ([`HandPassage`](super::HandPassage)), which
//! alone decides. Of the free poses those are kept that are unlike each other, by the definition that all samplers share.

mod draw;
mod rejections;
mod sampler;
mod sweep;

pub use rejections::OpenBox;
pub use sampler::{PoseCounts, RejectedPose, SampledGrasp, SampledGrasps, SceneSampler, SceneSampling, SceneTarget};
