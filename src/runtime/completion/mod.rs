//! Shape completion for depth cameras: from a picture to objects, and from an object's visible part to a closed mesh.

mod answer;
mod completer;
mod error;

use format::{Channel, Product};

pub use answer::{Answer, Detail};
pub use completer::{Completed, Completer, Timings, seen_points};
pub use error::CompletionError;
pub use infer::{
    CompletionModel, GoldenCheck, InputName, Inputs, ModelError, ModelFacts, ModelProblem, PredictError, Prediction,
    Thresholds,
};
pub use measure::{Baseline, SeenCells, SeenPoint, SupportPlane};
pub use perception::{
    CameraDescription, CameraError, CameraRule, Cluster, ClusterRule, DepthFrame, Distortion, FrameError, FrameRule,
    LabelImage, PartitionRule, Plane, PlaneChoice, PlaneRule, Refusal, RosImage, SceneRule, SegmentedScene, read_frame,
};
pub use surface::{LaplacianRule, LooseBodies, NeighbourWeights};

/// Products whose samples can be completed: those with pairs.
pub fn completable_products() -> Vec<Product> {
    Channel::PAIR.products().collect()
}
