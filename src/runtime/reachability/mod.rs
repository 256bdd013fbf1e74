//! Queries of a grasp planner: how far inside the reachable set a pose is, which direction leads deeper, and what an obstacle
//! changes.

mod energy;
mod map;
mod obstacle;
mod open;
#[cfg(test)]
mod tests;

pub use energy::{EnergyForm, grasp_energy};
pub use map::{ArmCover, InvalidMap, NearestCell, ObstacleId, Ranked, ReachabilityMap, ReachabilityParts, RobotFacts};
pub use obstacle::{Ball, EndEffectorVolume, InvalidObstacle, Obstacle};
