//! Who searches: one run from one seed. The annealing of `crate::grasp` goes here; this one stays where it begins.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Translation3};

use super::hand::GraspHand;
use crate::{
    contact::ContactSurface,
    grasp::{Annealing, Energies, Grasp, GraspRun, GraspVerdict, Keeping, Quality, Stretch},
    hand::Hand,
    seed::Stream,
};

/// How far the hand stands back from the seed at first [m].
const STAND_BACK: f64 = 0.15;

/// Searches grasps of one hand on one object; its memory is reused from run to run.
pub(super) struct Searcher {
    hand: Arc<Hand>,
    object: Arc<ContactSurface>,
    annealing: Annealing,
}

impl Searcher {
    pub(super) fn new(hand: &GraspHand, object: &Arc<ContactSurface>, settings: &(Annealing, Keeping)) -> Self {
        Self { hand: Arc::clone(&hand.hand), object: Arc::clone(object), annealing: settings.0 }
    }

    /// One run; `stream` is the sample's own.
    pub(super) fn run(&mut self, object_from_seed: IsometryMatrix3<f64>, _stream: Stream) -> GraspRun {
        let hand = &self.hand;
        let amplitudes = vec![0.0; hand.eigengrasps().map_or(0, |grasps| grasps.directions.len())];
        let posture = if amplitudes.is_empty() { hand.opened() } else { hand.posture_of(&amplitudes) };
        let joints = hand.posture_values(&posture);
        let frames = hand.link_frames(&joints);
        let object_from_approach = object_from_seed * Translation3::new(0.0, 0.0, -STAND_BACK);
        let object_from_base = object_from_approach * hand.approach_pose(&frames).isometry().inverse();
        let distance = |contact| {
            let (point, _) = hand.contact_in_base(contact, &frames);
            self.object.signed_distance(&(object_from_base * point)).abs() * 1e3
        };
        let contacts = hand.contacts().len();
        let contact = (0..contacts).map(distance).sum::<f64>() / contacts.max(1) as f64;
        let energies = Energies { total: contact, contact, potential: 1.0 };
        let mut course = [Stretch { accepted: 0, mean_energy: contact }; 10];
        course[0].accepted = 1;
        let grasp = Grasp {
            object_from_approach,
            amplitudes,
            posture,
            penetration: 0.0,
            energies,
            joints,
            contacts: Vec::new(),
            quality: Quality::default(),
            kind: None,
            verdict: GraspVerdict::OpenHand,
        };
        let steps = self.annealing.steps;
        GraspRun { object_from_seed, steps, failed: 0, tries: 1, potentials: 0, course, grasps: vec![grasp] }
    }
}
