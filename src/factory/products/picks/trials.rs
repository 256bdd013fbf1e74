//! Physical trials of free grasps among the neighbours.

use std::{collections::BTreeMap, sync::Arc};

use super::{loaded::ClosedGrasp, scene::LoadedScene};
use crate::{ProduceError, sections::JobHand};
use format::{
    AwakeBodies, AwakeNeighbour, PickPhase, PickProtocol, PickTrial, PickTrials, PickVerdict, PressedContact,
    PressedThing,
};
use kernel::{geom::Pose, ids::SampleId};
use robot::grasp::HandPassage;
use sim::{
    ClutterOutcome, ClutterPhase, ClutterProtocol, ClutterSim, ClutterVerdict, ClutterWorker, HandError, HandModel,
};

const PROTOCOL: ClutterProtocol = ClutterProtocol::STANDARD;

/// Bodies that the hand comes so near on its path are awake [m].
const NEAR: f64 = 0.05;

/// A neighbour that is so far up in the end was carried along [m].
const CARRIED: f64 = 0.04;

/// One thread's trials of one hand.
pub(super) struct Trials {
    model: HandModel,
    name: String,
    awake: AwakeBodies,
}

impl Trials {
    /// Reads the hand.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn new(hand: &JobHand, awake: AwakeBodies) -> Result<Self, ProduceError> {
        let name = hand.file.display().to_string();
        let model = HandModel::open(&hand.file).map_err(|error| ProduceError::unusable(&name, error))?;
        Ok(Self { model, name, awake })
    }

    /// Tries grasps of a body of a scene, each with its index in the candidates.
    ///
    /// # Errors
    /// When MuJoCo refuses the hand, or a grasp does not fit it.
    pub fn run(
        &self,
        sample: SampleId,
        scene: &LoadedScene,
        chosen: &[(u32, &ClosedGrasp)],
        passage: &mut HandPassage,
    ) -> Result<PickTrials, ProduceError> {
        let target = sample.item.0 as usize;
        let body = &scene.record.bodies[target];
        let mut workers: BTreeMap<Vec<bool>, ClutterWorker> = BTreeMap::new();
        let mut trials = Vec::with_capacity(chosen.len());
        for (candidate, closed) in chosen {
            // A grasp's own neighbours are awake: what else is tried changes no trial.
            let awake = self.awake_beside(scene, target, closed, passage);
            let worker = match workers.entry(awake) {
                std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
                std::collections::btree_map::Entry::Vacant(entry) => {
                    let sim = ClutterSim::new(&self.model, &scene.clutter, target, entry.key());
                    let sim = Arc::new(sim.map_err(|error| self.unusable(error))?);
                    entry.insert(ClutterWorker::new(&sim, PROTOCOL))
                }
            };
            let scene_from_base =
                scene.surroundings.objects[target].scene_from_obstacle * closed.grasp.object_from_base;
            let outcome = worker.run(&closed.grasp.posture, &scene_from_base.inverse());
            trials.push(recorded(*candidate, &outcome.map_err(|error| self.unusable(error))?));
        }
        let sim::ClutterProtocol {
            stand_off,
            approach_time,
            start_depth,
            closing,
            effort: _,
            lift,
            lift_time,
            hold_time,
            raised,
            lost_distance,
            lost_angle,
        } = PROTOCOL;
        Ok(PickTrials {
            sample,
            links: self.model.hand().links().to_vec(),
            mass: body.mass,
            friction: body.friction,
            torsion: scene.clutter.torsion,
            rolling: scene.clutter.rolling,
            awake: self.awake,
            protocol: PickProtocol {
                approach: [stand_off, approach_time],
                start_depth,
                closing_time: closing,
                lift: [lift, lift_time],
                hold_time,
                least_raised: raised,
                lost: [lost_distance, lost_angle],
                carried_height: CARRIED,
            },
            trials,
        })
    }

    /// Whether each body can move, in addition to the target.
    fn awake_beside(
        &self,
        scene: &LoadedScene,
        target: usize,
        closed: &ClosedGrasp,
        passage: &mut HandPassage,
    ) -> Vec<bool> {
        if self.awake == AwakeBodies::All {
            return (0..scene.record.bodies.len()).map(|body| body != target).collect();
        }
        let mut awake = scene.two_contacts_away(target);
        for near in passage.near(&scene.surroundings, target, &closed.grasp, NEAR) {
            awake[near] = true;
        }
        awake
    }

    fn unusable(&self, error: HandError) -> ProduceError {
        ProduceError::unusable(&self.name, error)
    }
}

/// The record of an outcome. Where the simulation diverged, it contains no positions.
fn recorded(candidate: u32, outcome: &ClutterOutcome) -> PickTrial {
    let is_sound = !matches!(outcome.verdict, ClutterVerdict::Unstable { .. });
    let sound = |value: f64| if is_sound { value } else { 0.0 };
    let contact = |touch: &sim::LinkTouch| PressedContact {
        link: touch.link as u32,
        point: touch.point.into(),
        normal: touch.normal.into_inner().into(),
        distance: touch.distance,
        force: touch.force,
    };
    let thing = |touched: &sim::ClutterTouch| PressedThing {
        thing: touched.body.map_or(0, |body| body as u32 + 1),
        phase: phase(touched.phase),
        time: touched.time,
        force: sound(touched.force),
    };
    let neighbour = |motion: &sim::NeighbourMotion| AwakeNeighbour {
        body: motion.body as u32 + 1,
        moved: sound(motion.moved),
        lifted: sound(motion.raised),
    };
    PickTrial {
        candidate,
        verdict: verdict(&outcome.verdict),
        time: match outcome.verdict {
            ClutterVerdict::Lost { time, .. } => time,
            _ => outcome.time(),
        },
        steps: outcome.steps,
        raised: sound(outcome.raised),
        penetration: match outcome.verdict {
            ClutterVerdict::Refused { penetration } => penetration,
            _ => sound(outcome.penetration),
        },
        object_from_base: outcome.closed.map(|base_from_object| Pose::from_isometry(base_from_object.inverse())),
        contacts: outcome.touches.iter().map(contact).collect(),
        touched: outcome.touched.iter().map(thing).collect(),
        awake: outcome.neighbours.iter().map(neighbour).collect(),
    }
}

fn phase(phase: ClutterPhase) -> PickPhase {
    match phase {
        ClutterPhase::Approach => PickPhase::Approach,
        ClutterPhase::Closing => PickPhase::Closing,
        ClutterPhase::Lift => PickPhase::Lift,
        ClutterPhase::Hold => PickPhase::Hold,
    }
}

fn verdict(verdict: &ClutterVerdict) -> PickVerdict {
    match verdict {
        ClutterVerdict::Held => PickVerdict::Held,
        ClutterVerdict::Refused { .. } => PickVerdict::StartsTooDeep,
        ClutterVerdict::NotTouching => PickVerdict::NotTouching,
        ClutterVerdict::OneLink => PickVerdict::OneLink,
        ClutterVerdict::Lost { phase: ClutterPhase::Approach, .. } => PickVerdict::LostApproaching,
        ClutterVerdict::Lost { phase: ClutterPhase::Closing, .. } => PickVerdict::LostClosing,
        ClutterVerdict::Lost { phase: ClutterPhase::Lift, .. } => PickVerdict::LostLifting,
        ClutterVerdict::Lost { phase: ClutterPhase::Hold, .. } => PickVerdict::LostHolding,
        ClutterVerdict::LetGo { .. } => PickVerdict::LetGo,
        ClutterVerdict::NotLifted { .. } => PickVerdict::NotLifted,
        ClutterVerdict::Unstable { .. } => PickVerdict::Unstable,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::{Instability, Unstable};

    #[test]
    fn verdicts_have_the_names_of_the_simulator() {
        let what = Unstable { step: 1, kind: Instability::Depth };
        let lost = |phase| ClutterVerdict::Lost { phase, time: 0.1 };
        for known in [
            ClutterVerdict::Held,
            ClutterVerdict::Refused { penetration: 0.1 },
            ClutterVerdict::NotTouching,
            ClutterVerdict::OneLink,
            lost(ClutterPhase::Approach),
            lost(ClutterPhase::Closing),
            lost(ClutterPhase::Lift),
            lost(ClutterPhase::Hold),
            ClutterVerdict::LetGo { links: 1 },
            ClutterVerdict::NotLifted { height: 0.0 },
            ClutterVerdict::Unstable { phase: ClutterPhase::Lift, what },
        ] {
            assert_eq!(verdict(&known).name(), known.reason());
        }
    }
}
