//! The points of a closed hand at which patches are centred.

use std::sync::Arc;

use nalgebra::Point3;

use super::settings::{ChosenGrasp, PatchJob};
use crate::{Cause, ProduceError, objects::check_hand};
use format::PATCH_POINTS;
use kernel::geom::{Frame, HandBase, Pose};
use robot::hand::Hand;
use sim::HandModel;

/// Name of the palm among the points of a hand: the approach frame's.
pub const PALM: &str = "approach";

/// Contacts of a hand that represent its fingertips.
#[derive(Clone, Debug, PartialEq)]
pub struct Fingertips {
    hand: Arc<Hand>,
    /// Indices of the contacts.
    contacts: Vec<usize>,
}

/// A job's hand, read once for all threads.
pub struct PatchHand {
    hand: Arc<Hand>,
    /// Points of F0, F1 and F2.
    tips: Fingertips,
    /// Names of the points in its description.
    names: [String; PATCH_POINTS],
}

/// A fingertip that a hand does not have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("it has no contact `{tip}` that could be a fingertip; it has {}", present.join(", "))]
pub struct NoFingertip {
    /// Contact that the job names.
    pub tip: String,
    /// Contacts of the hand.
    pub present: Vec<String>,
}

impl Fingertips {
    /// The contacts of these names.
    ///
    /// # Errors
    /// When the hand has no such contact.
    pub fn new(hand: &Arc<Hand>, tips: &[String]) -> Result<Self, NoFingertip> {
        let contact = |tip: &String| {
            let found = hand.contacts().iter().position(|contact| contact.name == *tip);
            found.ok_or_else(|| {
                let present = hand.contacts().iter().map(|contact| contact.name.clone()).collect();
                NoFingertip { tip: tip.clone(), present }
            })
        };
        Ok(Self { hand: Arc::clone(hand), contacts: tips.iter().map(contact).collect::<Result<_, _>>()? })
    }

    /// Their positions in the frame in which the hand's base is given, at values of all joints [m].
    ///
    /// # Panics
    /// When the hand has another count of joints.
    pub fn points<To: Frame>(&self, base: &Pose<To, HandBase>, joints: &[f64]) -> Vec<Point3<f64>> {
        let frames = self.hand.link_frames(joints);
        let point = |contact: &usize| base.point(&self.hand.contact_in_base(*contact, &frames).0);
        self.contacts.iter().map(point).collect()
    }
}

impl PatchHand {
    /// Reads the hand and checks that it is still the one of the job.
    ///
    /// # Errors
    /// When it is gone, another one, or lacks a fingertip that the job names.
    pub fn open(job: &PatchJob) -> Result<Self, ProduceError> {
        check_hand(&job.hand)?;
        let unusable = |cause: Cause| ProduceError::unusable(job.hand.file.display().to_string(), cause);
        let model = HandModel::open(&job.hand.file).map_err(|error| unusable(error.into()))?;
        Self::new(model.hand(), &job.settings.tips).map_err(|error| unusable(error.into()))
    }

    /// The points of a hand whose fingertips are these contacts.
    ///
    /// # Errors
    /// When it has no such contact.
    pub fn new(hand: &Arc<Hand>, tips: &[String; PATCH_POINTS - 1]) -> Result<Self, NoFingertip> {
        let [a, b, c] = tips.clone();
        let names = [PALM.to_owned(), a, b, c];
        Ok(Self { hand: Arc::clone(hand), tips: Fingertips::new(hand, tips)?, names })
    }

    /// The hand's name.
    pub fn name(&self) -> &str {
        self.hand.name()
    }

    /// Names of the points in the hand's description: palm, F0, F1, F2.
    pub fn names(&self) -> &[String; PATCH_POINTS] {
        &self.names
    }

    /// Where the points of a closed hand are, in `Object` [m].
    ///
    /// # Panics
    /// When the grasp is of a hand with another count of joints.
    pub fn points(&self, grasp: &ChosenGrasp) -> [Point3<f64>; PATCH_POINTS] {
        let tips = self.tips.points(&grasp.object_from_base, &grasp.joints);
        let palm = Point3::from(*grasp.object_from_approach.translation());
        [palm, tips[0], tips[1], tips[2]]
    }

    /// Joints of the hand.
    pub fn joints(&self) -> usize {
        self.hand.tree().joints().len()
    }
}
