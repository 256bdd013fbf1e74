//! Grasps of the bodies of one scene, with the outcomes of their trials.

use crate::ProduceError;
use format::{PickCandidates, PickState, PickTrials, dataset::DatasetReader};
use kernel::ids::{ItemId, ObjectId, SampleId};

/// Grasps of one body.
pub struct BodyPicks {
    /// Number of the body in its scene, from 1.
    pub body: u32,
    /// The candidates.
    pub candidates: PickCandidates,
    /// Trials of some of them; `None` where nothing was tried.
    pub trials: Option<PickTrials>,
}

/// Grasps of the bodies of one scene.
pub struct ScenePicks {
    /// Whether the dataset has grasps of each body.
    pub evaluated: Vec<bool>,
    /// Bodies with grasps, by their number.
    pub bodies: Vec<BodyPicks>,
}

impl BodyPicks {
    /// State of each candidate, meaningful for the free ones only.
    pub fn states(&self) -> Vec<PickState> {
        let mut states = vec![PickState::Untried; self.candidates.candidates.len()];
        for trial in self.trials.iter().flat_map(|trials| &trials.trials) {
            if let Some(state) = states.get_mut(trial.candidate as usize) {
                *state = trial.verdict.state();
            }
        }
        states
    }
}

impl ScenePicks {
    /// Reads the grasps of a scene with this number of bodies, which are these objects; bodies without stored grasps
    /// were rejected.
    ///
    /// # Errors
    /// When a sample cannot be read, or is of another scene.
    pub fn read(picks: &DatasetReader, scene: ObjectId, objects: &[ObjectId]) -> Result<Self, ProduceError> {
        let mut found = Self { evaluated: Vec::with_capacity(objects.len()), bodies: Vec::new() };
        for item in 0..objects.len() as u32 {
            let stored = picks.sample_of(&SampleId::of_object(scene, ItemId(item)))?;
            found.evaluated.push(stored.is_some());
            let Some(stored) = stored else { continue };
            let (candidates, trials) = (stored.read::<PickCandidates>()?, stored.find::<PickTrials>()?);
            if !candidates.bodies.iter().map(|(object, _)| object).eq(objects) {
                let cause = "the dataset of picks has other bodies for it; `verify` that dataset, and make it again";
                return Err(ProduceError::unusable(format!("scene {}", scene.0.short()), cause));
            }
            found.bodies.push(BodyPicks { body: item + 1, candidates, trials });
        }
        Ok(found)
    }
}
