//! A resolved job for grasps as keys of a job file.

use std::path::Path;

use super::{
    settings::{Confirm, GraspJob, GraspSettings, Labels, Physics},
    spec::{
        AmplitudesSpec, AnnealingSpec, AntipodalSpec, ApproachSpec, AutoMass, AxisSpec, ClampedAmplitudes, ConfirmSpec,
        EnergySpec, FrameSpec, GraspsSpec, GravitySpec, KeepSpec, LabelsSpec, MassSpec, NamedAmplitudes, PairDepthSpec,
        PhysicsSpec, RestingSpec, SamplerSpec, SpaceSpec, SupportSpec, TriedSpec, UniformSpec,
    },
};
use crate::sections::{keys_of, without};
use format::TriedStates;
use robot::grasp::{
    AmplitudeRange, Annealing, Antipodal, ApproachDraws, EnergyKind, Keeping, PairHold, RestingChoice, Sampler,
    SearchFrame, Support, WrenchSpace,
};

/// Keys of the annealing search; the others rate the states of any sampler.
pub(super) const SEARCH_KEYS: [&str; 7] = [
    "annealing.steps",
    "annealing.whole_schedule",
    "annealing.descent",
    "annealing.frame",
    "annealing.amplitudes",
    "annealing.best",
    "annealing.max_failures",
];

/// Keys of labels by agreement; graded labels have no use for them.
pub(super) const AGREEMENT_KEYS: [&str; 8] = [
    "physics.perturbed_runs",
    "physics.rollout_share",
    "physics.rollouts",
    "physics.variant_share",
    "physics.series_share",
    "physics.confirm",
    "physics.failed_per_held",
    "physics.gravity",
];

impl GraspJob {
    /// Keys of the job file other than objects, split and shards, without those that the other keys make idle. With a
    /// folder the hand's file is named relative to it, otherwise by content alone.
    pub(super) fn keys(&self, folder: Option<&Path>) -> toml::Table {
        let GraspSettings { sampler, annealing, physics, .. } = &self.settings;
        let mut spec = spec(&self.settings);
        spec.hand = Some(self.hand.spec(folder));
        let mut idle = vec!["objects", "split", "shards"];
        if folder.is_none() {
            idle.push("hand.model");
        }
        match sampler {
            Sampler::Annealing => idle.extend(["uniform", "antipodal", "approach"]),
            Sampler::Uniform(_) => idle.extend(["antipodal", "approach"]),
            Sampler::Approach(_) => idle.extend(["uniform", "antipodal", "keep.advance"]),
            Sampler::Antipodal(antipodal) => {
                idle.extend(["uniform", "approach"]);
                match antipodal.hold {
                    PairHold::Middle | PairHold::Along(Support::Air) => {
                        idle.extend(["antipodal.margin", "antipodal.resting_pose"]);
                    }
                    PairHold::Along(Support::Table { .. }) => {}
                }
                if antipodal.hold != PairHold::Middle {
                    idle.push("keep.advance");
                }
            }
        }
        if *sampler != Sampler::Annealing {
            idle.extend(SEARCH_KEYS);
        }
        if annealing.energy == EnergyKind::Contact {
            idle.push("annealing.potential_scale");
        }
        if physics.is_some_and(|physics| physics.rollout_share == 0.0) {
            idle.push("physics.rollouts");
        }
        if physics.is_some_and(|physics| physics.table_friction.is_none()) {
            idle.push("physics.table_friction");
        }
        match physics.map(|physics| physics.labels) {
            Some(Labels::Ladder) => idle.extend(AGREEMENT_KEYS),
            // Not written, so that jobs of earlier versions keep their digests.
            Some(Labels::Agreement) => idle.push("physics.labels"),
            None => {}
        }
        without(keys_of(&spec), &idle)
    }
}

fn spec(settings: &GraspSettings) -> GraspsSpec {
    let GraspSettings { seeds, sampler, annealing, keeping, physics } = settings;
    let mut spec = GraspsSpec::standard();
    spec.grasps.seeds = *seeds;
    spec.grasps.sampler = match sampler {
        Sampler::Annealing => SamplerSpec::Annealing,
        Sampler::Uniform(uniform) => {
            let poses = if uniform.upright { AxisSpec::Upright } else { AxisSpec::Any };
            spec.uniform = UniformSpec { grasps: uniform.grasps, poses, rolls: uniform.rolls.0.clone() };
            SamplerSpec::Uniform
        }
        Sampler::Antipodal(antipodal) => {
            let &Antipodal { pairs, friction, best, hold } = antipodal;
            let AntipodalSpec { margin, resting_pose: resting, .. } = spec.antipodal;
            let (depth, support, margin, resting) = match hold {
                PairHold::Middle => (PairDepthSpec::Middle, SupportSpec::None, margin, resting),
                PairHold::Along(Support::Air) => (PairDepthSpec::Any, SupportSpec::None, margin, resting),
                PairHold::Along(Support::Table { margin, resting }) => {
                    (PairDepthSpec::Any, SupportSpec::Table, margin, resting_spec(resting))
                }
            };
            spec.antipodal = AntipodalSpec { pairs, friction, best, depth, support, margin, resting_pose: resting };
            SamplerSpec::Antipodal
        }
        Sampler::Approach(ApproachDraws { draws, cone, friction, best }) => {
            spec.approach = ApproachSpec { draws: *draws, cone: *cone, friction: *friction, best: *best };
            SamplerSpec::Approach
        }
    };
    spec.annealing = annealing_spec(annealing);
    let &Keeping { friction, edges, torsion, space, min_epsilon, advance, max_penetration, table } = keeping;
    let space = space_spec(space);
    spec.keep = KeepSpec { friction, cone_edges: edges, torsion, space, min_epsilon, advance, max_penetration, table };
    spec.physics = physics.map(|physics| {
        let Physics {
            tried,
            friction,
            mass,
            perturbed_runs,
            rollout_share,
            rollouts,
            variant_share,
            series_share,
            confirm,
            failed_per_held,
            six_directions,
            table_friction,
            labels,
        } = physics;
        PhysicsSpec {
            tried: match tried {
                TriedStates::Closed => TriedSpec::Closed,
                TriedStates::Kept => TriedSpec::Kept,
            },
            friction,
            mass: mass.map_or(MassSpec::Auto(AutoMass::Auto), MassSpec::Kilograms),
            perturbed_runs,
            rollout_share,
            rollouts,
            variant_share,
            series_share,
            confirm: match confirm {
                Confirm::Strict => ConfirmSpec::Strict,
                Confirm::Both => ConfirmSpec::Both,
                Confirm::Failed => ConfirmSpec::Failed,
                Confirm::None => ConfirmSpec::None,
            },
            failed_per_held,
            gravity: if six_directions { GravitySpec::SixDirections } else { GravitySpec::Lifted },
            table: table_friction.is_some(),
            table_friction: table_friction.unwrap_or_default(),
            labels: match labels {
                Labels::Agreement => LabelsSpec::Agreement,
                Labels::Ladder => LabelsSpec::Ladder,
            },
        }
    });
    spec
}

fn resting_spec(resting: RestingChoice) -> RestingSpec {
    match resting {
        RestingChoice::Drawn => RestingSpec::Sampled,
        RestingChoice::Likeliest => RestingSpec::MostLikely,
    }
}

fn annealing_spec(annealing: &Annealing) -> AnnealingSpec {
    let &Annealing {
        steps,
        energy,
        space,
        friction,
        potential_scale,
        whole_schedule,
        descent,
        frame,
        amplitudes,
        best,
        max_failures,
    } = annealing;
    AnnealingSpec {
        steps,
        energy: match energy {
            EnergyKind::Contact => EnergySpec::Contact,
            EnergyKind::ContactAndPotential => EnergySpec::ContactAndPotential,
        },
        space: space_spec(space),
        friction,
        potential_scale,
        whole_schedule,
        descent,
        frame: match frame {
            SearchFrame::Seed => FrameSpec::Seed,
            SearchFrame::Object => FrameSpec::Object,
        },
        amplitudes: match amplitudes {
            AmplitudeRange::Joints => AmplitudesSpec::Named(NamedAmplitudes::Joints),
            AmplitudeRange::Clamped(clamped) => AmplitudesSpec::Clamped(ClampedAmplitudes { clamped }),
        },
        best,
        max_failures,
    }
}

fn space_spec(space: WrenchSpace) -> SpaceSpec {
    match space {
        WrenchSpace::Force => SpaceSpec::Force,
        WrenchSpace::Wrench => SpaceSpec::Wrench,
    }
}
