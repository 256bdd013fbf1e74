//! States that a run has, compared in the frame in which grasps of the hand are alike.

use nalgebra::{IsometryMatrix3, Point3, Translation3};

use super::{alike::KnownGrasps, frame::Frame, pads::Pads, state::HandSearch};

/// States that a run has.
pub(super) struct KnownStates {
    grasps: KnownGrasps,
    /// Middle between the pads of a gripper, else the origin, expressed in the approach frame [m].
    middle: Point3<f64>,
}

impl KnownStates {
    /// No states yet, of a hand with its symmetry.
    pub(super) fn new(search: &HandSearch) -> Self {
        let hand = &search.hand;
        let middle = match Pads::new(hand) {
            Some(pads) => {
                let frames = hand.link_frames(&hand.posture_values(&hand.opened()));
                let approach_from_base = hand.approach_pose(&frames).isometry().inverse();
                approach_from_base * Point3::from(pads.base_from_pads(hand, &frames).translation.vector)
            }
            None => Point3::origin(),
        };
        Self { grasps: KnownGrasps::new(search.is_half_turn_symmetric()), middle }
    }

    /// Frame that is compared: the approach frame, moved to between the pads.
    fn compared(&self, object_from_approach: &IsometryMatrix3<f64>) -> Frame {
        Frame::of(&(object_from_approach * Translation3::from(self.middle)))
    }

    pub(super) fn has(&self, object_from_approach: &IsometryMatrix3<f64>) -> bool {
        self.grasps.has(&self.compared(object_from_approach))
    }

    pub(super) fn add(&mut self, object_from_approach: &IsometryMatrix3<f64>) {
        let frame = self.compared(object_from_approach);
        self.grasps.add(frame);
    }
}
