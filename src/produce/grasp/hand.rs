//! The hand that grasps.

use std::sync::Arc;

use crate::{
    collision::Bodies,
    grasp::HandSearch,
    hand::Hand,
    job::JobHand,
    produce::{ProduceError, objects::check_hand},
};

/// A job's hand, read once for all threads.
pub struct GraspHand {
    /// Its joints, motors, contacts and eigengrasps.
    pub hand: Arc<Hand>,
    /// What of it can touch.
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
        let failed = |why: String| ProduceError::NoGrasps { name: hand.scene.display().to_string(), why };
        #[cfg(feature = "sim")]
        {
            let model = crate::sim::HandModel::open(&hand.scene).map_err(|error| failed(error.to_string()))?;
            model.check_grasping().map_err(|error| failed(error.to_string()))?;
            let (bodies, _) = model.bodies().map_err(|error| failed(error.to_string()))?;
            let search = HandSearch::new(model.hand(), &bodies).map_err(|error| failed(error.to_string()))?;
            Ok(Self { hand: Arc::clone(model.hand()), bodies: Arc::new(bodies), search: Arc::new(search) })
        }
        #[cfg(not(feature = "sim"))]
        Err(failed("this build has no simulator to read a hand with (feature `sim`)".to_owned()))
    }
}
