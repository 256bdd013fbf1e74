//! What a robot or a trainer links: dataset readers and reachability maps; no simulator, no job, no plan.
//!
//! Builds with `--no-default-features`.

mod reachability;

pub use crate::dataset::{DatasetReader, Manifest, Sample, Samples, Selection, Split, SplitTable, TouchedPair};
pub use reachability::{
    ArmCover, Ball, EndEffectorVolume, EnergyForm, InvalidMap, InvalidObstacle, NearestCell, Obstacle, ObstacleId,
    Ranked, ReachabilityMap, ReachabilityParts, RobotFacts, grasp_energy,
};
