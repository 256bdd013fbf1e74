//! The hand that grasps.

use std::sync::Arc;

use crate::{ProduceError, job::JobHand, objects::check_hand};
use robot::{collision::Bodies, grasp::HandSearch, hand::Hand};
use sim::HandModel;

/// A job's hand, read once for all threads.
pub struct GraspHand {
    /// Joints, motors, contacts and eigengrasps.
    pub hand: Arc<Hand>,
    /// Bodies that can touch.
    pub bodies: Arc<Bodies>,
    /// Prepared for annealing.
    pub search: Arc<HandSearch>,
}

impl GraspHand {
    /// Reads the hand and checks that it is still the one of the job.
    ///
    /// # Errors
    /// When it is gone, another one, or cannot grasp.
    pub fn open(hand: &JobHand) -> Result<Self, ProduceError> {
        check_hand(hand)?;
        let name = || hand.scene.display().to_string();
        let model = HandModel::open(&hand.scene).map_err(|error| ProduceError::unusable(name(), error))?;
        model.check_grasping().map_err(|error| ProduceError::unusable(name(), error))?;
        let (bodies, _) = model.bodies().map_err(|error| ProduceError::unusable(name(), error))?;
        let search = HandSearch::new(model.hand(), &bodies).map_err(|error| ProduceError::unusable(name(), error))?;
        Ok(Self { hand: Arc::clone(model.hand()), bodies: Arc::new(bodies), search: Arc::new(search) })
    }
}
