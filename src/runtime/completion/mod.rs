//! Completion of what a depth camera saw: a picture becomes objects, an object's visible part a closed mesh.

mod answer;
mod completer;
mod error;

pub use answer::{Answer, Detail};
pub use completer::{Completed, Completer, Timings, seen_points};
pub use error::CompletionError;
pub use infer::{
    CompletionModel, GoldenCheck, InputName, Inputs, ModelError, ModelFacts, ModelProblem, PredictError, Prediction,
    Thresholds,
};
pub use measure::{Baseline, SeenCells, SeenPoint};
pub use perception::{
    CameraDescription, CameraError, Cluster, ClusterRule, DepthFrame, FrameError, FrameRule, Plane, PlaneChoice,
    PlaneRule, Refusal, Scene, SceneRule, read_frame,
};
pub use surface::{LaplacianRule, NeighbourWeights};
