//! Completion of what a depth camera saw: a picture becomes objects, an object's visible part a closed mesh.

mod completer;
mod error;

pub use completer::{Completed, Completer, Detail, Timings};
pub use error::CompletionError;
pub use infer::{
    CompletionModel, GoldenCheck, InputName, Inputs, ModelError, ModelFacts, ModelProblem, PredictError, Prediction,
};
pub use measure::{Baseline, SeenCells};
pub use perception::{
    CameraDescription, CameraError, Cluster, ClusterRule, DepthFrame, FrameError, FrameRule, Plane, PlaneChoice,
    PlaneRule, Refusal, Scene, SceneRule, read_frame,
};
