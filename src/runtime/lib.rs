//! Runtime of a robot or a trainer: dataset readers, reachability maps and completion; no simulator, no job, no plan.

pub mod completion;
mod reachability;

pub use format::{
    TouchedPair,
    dataset::{DatasetReader, Manifest, Sample, Samples, Selection},
};
pub use kernel::words::{Split, SplitTable};
pub use reachability::{
    ArmCover, Ball, EndEffectorVolume, InvalidMap, InvalidObstacle, NearestCell, Obstacle, ObstacleId, Ranked,
    ReachabilityMap, ReachabilityParts, RobotFacts,
};
