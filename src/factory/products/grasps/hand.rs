//! The hand that grasps.

use std::sync::Arc;

use crate::{ProduceError, objects::check_hand, product::HandUse, sections::JobHand};
use kernel::description::Format;
use robot::{
    collision::Bodies,
    grasp::{HandSearch, OwnOverlaps, PairHold, Sampler},
    hand::Hand,
};
use sim::{HandError, HandModel, exclude_line, place_of_excludes};

/// Samplers, each with whether grasps can be found for a hand by it.
pub const HAND_USES: &[HandUse] = &[
    HandUse { setting: "grasps.sampler = \"annealing\"", check: HandModel::check_grasping },
    HandUse { setting: "grasps.sampler = \"uniform\"", check: HandModel::check_grasping },
    HandUse { setting: "grasps.sampler = \"antipodal\"", check: can_take_pairs },
    HandUse { setting: "grasps.sampler = \"approach\"", check: can_be_preshaped },
    HandUse { setting: "[physics]", check: can_be_tried },
];

/// Whether a hand supports a job for grasps: its sampler, and its trials if it has some.
pub fn can_grasp(model: &HandModel, sampler: &Sampler, with_trials: bool) -> Result<(), HandError> {
    match sampler {
        Sampler::Antipodal(antipodal) => {
            can_take_pairs(model)?;
            if antipodal.hold == PairHold::Middle {
                model.check_gripper()?;
            }
        }
        Sampler::Approach(_) => can_be_preshaped(model)?,
        Sampler::Annealing | Sampler::Uniform(_) => model.check_grasping()?,
    }
    if with_trials { model.check_trials() } else { Ok(()) }
}

fn can_be_tried(model: &HandModel) -> Result<(), HandError> {
    model.check_grasping()?;
    model.check_trials()
}

fn can_take_pairs(model: &HandModel) -> Result<(), HandError> {
    model.check_grasping()?;
    // A gripper takes them between its pads.
    model.check_gripper().or_else(|_| model.check_opposition())
}

fn can_be_preshaped(model: &HandModel) -> Result<(), HandError> {
    model.check_grasping()?;
    model.check_opposition()
}

/// A job's hand, read once for all threads.
pub struct GraspHand {
    /// Joints, motors, contacts and eigengrasps.
    pub hand: Arc<Hand>,
    /// Bodies that can touch.
    pub bodies: Arc<Bodies>,
    /// Prepared for annealing.
    pub search: Arc<HandSearch>,
    /// Postures in which the hand overlaps itself.
    overlaps: OwnOverlaps,
    /// Format of its description.
    format: Format,
}

impl GraspHand {
    /// Share of postures in which the hand overlaps itself, and the pair of bodies that does so most often with the remedy, for the ledger;
    /// `None` for a hand that never does.
    pub fn own_obstacle(&self) -> Option<String> {
        let OwnOverlaps { postures, clear, pairs } = &self.overlaps;
        let ([one, other], _) = pairs.first()?;
        let pair = [one, other].map(|body| self.bodies.bodies[*body].name.clone());
        let share = 100.0 * f64::from(postures - clear) / f64::from(*postures);
        Some(format!(
            "the hand overlaps itself in {share:.0} % of its postures, {} and {} most often: if these may overlap, \
             put <contact>{}</contact> into {}, otherwise move the origin of its eigengrasps",
            pair[0],
            pair[1],
            exclude_line(&pair),
            place_of_excludes(self.format)
        ))
    }

    /// Reads the hand and checks that it is still the one of the job, and that it supports the job.
    ///
    /// # Errors
    /// When it is gone, another one, or cannot do that.
    pub fn open(hand: &JobHand, can: impl Fn(&HandModel) -> Result<(), HandError>) -> Result<Self, ProduceError> {
        check_hand(hand)?;
        let name = || hand.file.display().to_string();
        let model = HandModel::open(&hand.file).map_err(|error| ProduceError::unusable(name(), error))?;
        can(&model).map_err(|error| ProduceError::unusable(name(), error))?;
        let (bodies, _) = model.bodies().map_err(|error| ProduceError::unusable(name(), error))?;
        let (search, overlaps) = model.search().map_err(|error| ProduceError::unusable(name(), error))?;
        Ok(Self {
            hand: Arc::clone(model.hand()),
            bodies: Arc::new(bodies),
            search: Arc::new(search),
            overlaps,
            format: model.format(),
        })
    }
}
