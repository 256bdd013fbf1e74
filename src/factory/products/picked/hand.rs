//! The hand of picks: its approach, its type in a grasp, and where its contacts are.

use std::sync::Arc;

use crate::{Cause, ProduceError, objects::check_hand, sections::JobHand};
use format::PickCandidate;
use kernel::geom::{Approach, HandBase, Pose, World};
use robot::{grasp::KindDigits, hand::Hand};
use sim::HandModel;

/// A hand whose grasps were evaluated in scenes.
#[derive(Clone, Debug)]
pub struct PickedHand {
    hand: Arc<Hand>,
    /// The approach frame of the opened hand.
    base_from_approach: Pose<HandBase, Approach>,
    /// Joints that make a grasp type, of a hand that has types.
    digits: Option<KindDigits>,
}

impl PickedHand {
    /// Reads the hand of a job and checks that it is still that one.
    ///
    /// # Errors
    /// When it is gone or another one.
    pub fn open(hand: &JobHand) -> Result<Self, ProduceError> {
        check_hand(hand)?;
        let unusable = |cause: Cause| ProduceError::unusable(hand.file.display().to_string(), cause);
        let model = HandModel::open(&hand.file).map_err(|error| unusable(error.into()))?;
        Ok(Self::new(model.hand()))
    }

    /// From its description.
    pub fn new(hand: &Arc<Hand>) -> Self {
        let frames = hand.link_frames(&hand.posture_values(&hand.opened()));
        let (base_from_approach, digits) = (hand.approach_pose(&frames), KindDigits::new(hand));
        Self { hand: Arc::clone(hand), base_from_approach, digits }
    }

    /// The description.
    pub fn hand(&self) -> &Arc<Hand> {
        &self.hand
    }

    /// Whether its grasps have types.
    pub fn has_types(&self) -> bool {
        self.digits.is_some()
    }

    /// The approach frame of a candidate; its origin is the palm.
    pub fn world_from_approach(&self, candidate: &PickCandidate) -> Pose<World, Approach> {
        candidate.world_from_base * self.base_from_approach
    }

    /// Type of a free candidate, the wrist rolled against an upright camera that points along its approach; `None` of a hand without
    /// types.
    pub fn kind(&self, candidate: &PickCandidate) -> Option<u32> {
        let rotation = self.world_from_approach(candidate);
        Some(self.digits.as_ref()?.kind(&candidate.closed, rotation.rotation().matrix()))
    }
}
