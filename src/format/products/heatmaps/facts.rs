//! Facts of a heatmap of a scene.

use super::SceneHeatmap;
use crate::{FactFormat, FactKind, Facts, PickState};

/// Counts of the grasps in one image, for tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HeatmapFacts {
    /// Bodies of the scene; 0 of a rejected image.
    pub bodies: u32,
    /// Bodies whose grasps were evaluated.
    pub evaluated: u32,
    /// Free grasps of each of [`PickState::ALL`].
    pub states: [u32; 3],
    /// Grasps that collide with each of [`PickObstacle::NAMES`](crate::PickObstacle::NAMES).
    pub forbidden: [u32; 4],
    /// Free grasps of other types.
    pub other_types: u32,
    /// Points of the free grasps in the image.
    pub points: u32,
    /// Visible points among them.
    pub visible_points: u32,
    /// Grasps with patches.
    pub patches: u32,
}

const fn fact(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: None, meaning }
}

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; 13] = [
    fact("bodies", "Bodies of the scene."),
    fact("evaluated_bodies", "Bodies whose grasps were evaluated."),
    fact("untried", "Free grasps from the camera's side without a conclusive trial."),
    fact("held", "Free grasps from the camera's side that held in a trial."),
    fact("failed", "Free grasps from the camera's side that failed in a trial."),
    fact("forbidden_by_ground", "Grasps from the camera's side whose hand comes below the ground plane."),
    fact("forbidden_by_container", "Grasps from the camera's side that the container obstructs."),
    fact("forbidden_by_own_object", "Grasps from the camera's side whose hand collides with the body itself."),
    fact("forbidden_by_neighbour", "Grasps from the camera's side that another body obstructs."),
    fact("other_types", "Free grasps from the camera's side of other types, or without a type."),
    fact("points", "Points of palm and fingertips in the image."),
    fact("visible_points", "Points that the image does not hide."),
    fact("patches", "Grasps with a patch around each of their points."),
];

impl HeatmapFacts {
    /// Facts of an image.
    pub fn from_heatmap(heatmap: &SceneHeatmap) -> Self {
        let mut facts = Self {
            bodies: heatmap.evaluated.len() as u32,
            evaluated: heatmap.evaluated.iter().map(|known| u32::from(*known)).sum(),
            other_types: heatmap.other_types,
            patches: heatmap.grasps.iter().filter(|grasp| !grasp.patches.is_empty()).count() as u32,
            ..Self::default()
        };
        for grasp in &heatmap.grasps {
            facts.states[grasp.state as usize] += 1;
            facts.points += grasp.points.iter().filter(|point| point.is_in(&heatmap.camera)).count() as u32;
            facts.visible_points += grasp.points.iter().filter(|point| point.visible).count() as u32;
        }
        heatmap.forbidden.iter().for_each(|grasp| facts.forbidden[usize::from(grasp.obstacle) - 1] += 1);
        facts
    }

    /// Free grasps in all.
    pub fn grasps(&self) -> u32 {
        self.states.iter().fold(0, |sum, count| sum.saturating_add(*count))
    }

    /// Free grasps of a state.
    pub fn of_state(&self, state: PickState) -> u32 {
        self.states[state as usize]
    }

    fn values(self) -> [u32; FACTS.len()] {
        let Self {
            bodies,
            evaluated,
            states: [untried, held, failed],
            forbidden: [ground, container, own, neighbour],
            other_types,
            points,
            visible_points,
            patches,
        } = self;
        [
            bodies,
            evaluated,
            untried,
            held,
            failed,
            ground,
            container,
            own,
            neighbour,
            other_types,
            points,
            visible_points,
            patches,
        ]
    }
}

impl From<HeatmapFacts> for Facts {
    fn from(facts: HeatmapFacts) -> Self {
        Self::new(facts.values().map(f64::from))
    }
}

impl From<&Facts> for HeatmapFacts {
    fn from(facts: &Facts) -> Self {
        let of = |index: usize| facts.integer(index);
        Self {
            bodies: of(0),
            evaluated: of(1),
            states: std::array::from_fn(|index| of(2 + index)),
            forbidden: std::array::from_fn(|index| of(5 + index)),
            other_types: of(9),
            points: of(10),
            visible_points: of(11),
            patches: of(12),
        }
    }
}
