//! Queries for grasp planners: the distance of a pose from the border of the reachable set, the direction that leads deeper
//! inside, and the effect of obstacles.

mod map;
mod obstacle;
mod open;
#[cfg(test)]
mod tests;

pub use map::{ArmCover, InvalidMap, NearestCell, ObstacleId, Ranked, ReachabilityMap, ReachabilityParts, RobotFacts};
pub use obstacle::{Ball, EndEffectorVolume, InvalidObstacle, Obstacle};
