//! The record of a grasp whose hand was followed through a scene.

use nalgebra::IsometryMatrix3;

use super::{loaded::ClosedGrasp, scene::LoadedScene};
use crate::products::settled::recorded_passage;
use format::PickCandidate;
use kernel::{geom::Pose, words::BothWays};
use robot::grasp::Passage;

/// The record of a grasp that was followed through a scene.
pub(super) fn recorded(
    scene: &LoadedScene,
    body: usize,
    [run, rank, direction]: [u32; 3],
    object_from_base: &IsometryMatrix3<f64>,
    ways: BothWays<Passage>,
    closed: Option<&ClosedGrasp>,
) -> PickCandidate {
    let world_from_base = scene.surroundings.objects[body].scene_from_obstacle * object_from_base;
    PickCandidate {
        run,
        rank,
        direction,
        world_from_base: Pose::from_isometry(world_from_base),
        ways: ways.map(|passage| recorded_passage(&passage)),
        // It was closed where one way is free up to there.
        closed: closed
            .filter(|_| ways.shaped.blocked.is_none() || ways.opened.blocked.is_none())
            .map(|closed| closed.joints.clone())
            .unwrap_or_default(),
    }
}
