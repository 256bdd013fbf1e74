//! The record of a path through a settled scene.

use format::{Blocked, PickObstacle, PickPassage};
use robot::grasp::{Passage, PathObstacle};

/// The record of a path of a hand or a cup; neighbours are numbered from 1.
pub fn recorded_passage(passage: &Passage) -> PickPassage {
    let obstacle = |by: PathObstacle| match by {
        PathObstacle::Ground => PickObstacle::Ground,
        PathObstacle::Container => PickObstacle::Container,
        PathObstacle::Target => PickObstacle::Own,
        PathObstacle::Neighbour(index) => PickObstacle::Neighbour(index as u32 + 1),
    };
    PickPassage {
        blocked: passage.blocked.map(|(stage, by)| Blocked { stage, by: obstacle(by) }),
        clearance: passage.clearance,
    }
}
