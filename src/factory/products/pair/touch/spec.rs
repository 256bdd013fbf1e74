//! The keys of touch stored with pairs.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::settings::{Exploration, ExplorationTarget, RandomRays, RayTarget, Touch, TouchByHand};
use crate::sections::spec::HandSpec;

/// Tactile contacts on the hidden surface, stored with each pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TouchSpec {
    /// Rays from the object's far side towards the camera, along its optical axis, at random positions of the object's
    /// box: the first contact of each with the object.
    #[schemars(extend("examples" = [true]))]
    pub random_rays: bool,
    /// With `random_rays`: number of rays per view.
    #[schemars(range(min = 1, max = 100_000), extend("x-unit" = "rays"))]
    pub rays: u32,
    /// With `random_rays`: geometry that rays meet.
    #[schemars(extend("examples" = ["mesh"]))]
    pub ray_target: RayTarget,
    /// A hand explores the hidden surface by guarded moves, each of which ends when the hand rests on the object, or
    /// has missed it.
    #[schemars(extend("examples" = [true]))]
    pub exploration: bool,
    /// With `exploration`: number of guarded moves per view.
    #[schemars(range(min = 1, max = 1000), extend("x-unit" = "approaches"))]
    pub approaches: u32,
    /// With `exploration`: targets of the hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("examples" = ["unseen_cells"]))]
    pub exploration_target: Option<ExplorationTarget>,
    /// A hand grasps the object once.
    #[schemars(extend("examples" = [true]))]
    pub grasp: bool,
    /// With `exploration` or `grasp`: the hand.
    #[schemars(extend("examples" = [{ "model": "../scenes/barrett_bh8_280.xml" }]))]
    pub hand: Option<HandSpec>,
}

impl TouchSpec {
    /// Writes the kinds of touch into keys that hold the defaults; those of other kinds stay. With a folder the hand's
    /// file is named relative to it, otherwise by content alone.
    pub fn write(&mut self, touch: &Touch, folder: Option<&Path>) {
        // Digests of jobs without an exploration do not contain the key.
        self.exploration_target = None;
        if let Some(RandomRays { count, target }) = touch.random_rays {
            (self.random_rays, self.rays, self.ray_target) = (true, count, target);
        }
        if let Some(TouchByHand { hand, exploration, grasp }) = &touch.by_hand {
            (self.exploration, self.grasp) = (exploration.is_some(), *grasp);
            if let Some(Exploration { approaches, target }) = exploration {
                (self.approaches, self.exploration_target) = (*approaches, Some(*target));
            }
            self.hand = Some(hand.spec(folder));
        }
    }
}
