//! From the keys of a job for grasps to settings that make sense: every mistake that the schema cannot see.

use std::path::Path as FilePath;

use super::{
    hand::can_grasp,
    keys::{AGREEMENT_KEYS, SEARCH_KEYS},
    settings::{Confirm, GraspSettings, Labels, Physics},
    spec::{
        AmplitudesSpec, AnnealingSpec, AntipodalSpec, ApproachSpec, AxisSpec, ConfirmSpec, EnergySpec, FrameSpec,
        GraspsSpec, GravitySpec, KeepSpec, LabelsSpec, MassSpec, PairDepthSpec, PhysicsSpec, RestingSpec, SamplerSpec,
        SpaceSpec, SupportSpec, TriedSpec, UniformSpec,
    },
};
use crate::sections::{JobHand, read_hand};
use form::Checker;
use format::TriedStates;
use robot::grasp::{
    AmplitudeRange, Annealing, Antipodal, ApproachDraws, EnergyKind, Keeping, PairHold, RestingChoice, Rolls, Sampler,
    SearchFrame, Support, Uniform, WrenchSpace,
};
use sim::HandModel;

/// The product's settings, and the hand; `None` when that has a fault, which is reported.
pub(super) fn settings(
    checker: &mut Checker,
    spec: &GraspsSpec,
    folder: &FilePath,
) -> (GraspSettings, Option<JobHand>) {
    let (sampler, hand) = (sampler(checker, spec), spec.hand.as_ref());
    let can = |model: &HandModel| can_grasp(model, &sampler, spec.physics.is_some());
    let hand = hand.and_then(|hand| read_hand(checker, "hand", hand, folder, can));
    let settings = GraspSettings {
        seeds: spec.grasps.seeds,
        sampler,
        annealing: annealing(checker, &spec.annealing),
        keeping: keeping(&spec.keep),
        physics: spec.physics.as_ref().map(|spec| physics(checker, spec)),
    };
    (settings, hand)
}

fn sampler(checker: &mut Checker, spec: &GraspsSpec) -> Sampler {
    let chosen = match spec.grasps.sampler {
        SamplerSpec::Annealing => "annealing",
        SamplerSpec::Uniform => "uniform",
        SamplerSpec::Antipodal => "antipodal",
        SamplerSpec::Approach => "approach",
    };
    let other = format!("grasps.sampler = \"{chosen}\"");
    for section in ["uniform", "antipodal", "approach"].into_iter().filter(|section| *section != chosen) {
        if checker.has(section) {
            checker.contradiction(section, &other, "these are settings of another sampler");
        }
    }
    for key in SEARCH_KEYS.into_iter().filter(|_| chosen != "annealing") {
        if checker.has(key) {
            checker.contradiction(key, &other, "there is no search: only the energy of the annealing is used");
        }
    }
    match spec.grasps.sampler {
        SamplerSpec::Annealing => Sampler::Annealing,
        SamplerSpec::Uniform => {
            let UniformSpec { grasps, poses, rolls } = &spec.uniform;
            Sampler::Uniform(Uniform {
                grasps: *grasps,
                rolls: Rolls(rolls.clone()),
                upright: *poses == AxisSpec::Upright,
            })
        }
        SamplerSpec::Antipodal => {
            let &AntipodalSpec { pairs, friction, best, .. } = &spec.antipodal;
            Sampler::Antipodal(Antipodal { pairs, friction, best, hold: pair_hold(checker, &spec.antipodal) })
        }
        SamplerSpec::Approach => {
            if checker.has("keep.advance") {
                checker.contradiction("keep.advance", &other, "the hand has come as far as it can");
            }
            let &ApproachSpec { draws, cone, friction, best } = &spec.approach;
            Sampler::Approach(ApproachDraws { draws, cone, friction, best })
        }
    }
}

fn pair_hold(checker: &mut Checker, spec: &AntipodalSpec) -> PairHold {
    let &AntipodalSpec { depth, support, margin, resting_pose, .. } = spec;
    let of_tables = [
        ("antipodal.margin", "there is no table to keep away from"),
        ("antipodal.resting_pose", "there is no table to rest on"),
    ];
    for (key, because) in of_tables {
        if support == SupportSpec::None && checker.has(key) {
            checker.contradiction(key, "antipodal.support = \"none\"", because);
        }
    }
    match (depth, support) {
        (PairDepthSpec::Middle, support) => {
            if support == SupportSpec::Table {
                let because = "with the object half way along its pads, a gripper's tips would be below the table";
                let remedy = "antipodal.depth = \"middle\"; a table needs \"any\"";
                checker.contradiction("antipodal.support", remedy, because);
            }
            PairHold::Middle
        }
        (PairDepthSpec::Any, support) => {
            if checker.has("keep.advance") {
                let because = "the hand stays at its drawn depth";
                checker.contradiction("keep.advance", "antipodal.depth = \"any\"", because);
            }
            PairHold::Along(match support {
                SupportSpec::None => Support::Air,
                SupportSpec::Table => Support::Table {
                    margin,
                    resting: match resting_pose {
                        RestingSpec::Sampled => RestingChoice::Drawn,
                        RestingSpec::MostLikely => RestingChoice::Likeliest,
                    },
                },
            })
        }
    }
}

fn annealing(checker: &mut Checker, spec: &AnnealingSpec) -> Annealing {
    if spec.energy == EnergySpec::Contact && checker.has("annealing.potential_scale") {
        let other = "annealing.energy = \"contact\"";
        checker.contradiction("annealing.potential_scale", other, "the contact energy has no potential");
    }
    if spec.max_failures > spec.steps && checker.has("annealing.max_failures") {
        let expected = format!("at most as many as annealing.steps = {}", spec.steps);
        checker.invalid(
            "annealing.max_failures",
            expected,
            format!("{}: no seed is ever abandoned", spec.max_failures),
        );
    }
    let &AnnealingSpec { steps, friction, potential_scale, whole_schedule, descent, best, max_failures, .. } = spec;
    Annealing {
        steps,
        energy: match spec.energy {
            EnergySpec::Contact => EnergyKind::Contact,
            EnergySpec::ContactAndPotential => EnergyKind::ContactAndPotential,
        },
        space: space(spec.space),
        friction,
        potential_scale,
        whole_schedule,
        descent,
        frame: match spec.frame {
            FrameSpec::Seed => SearchFrame::Seed,
            FrameSpec::Object => SearchFrame::Object,
        },
        amplitudes: match spec.amplitudes {
            AmplitudesSpec::Named(_) => AmplitudeRange::Joints,
            AmplitudesSpec::Clamped(range) => AmplitudeRange::Clamped(range.clamped),
        },
        best,
        max_failures,
    }
}

fn keeping(spec: &KeepSpec) -> Keeping {
    let &KeepSpec { friction, cone_edges, torsion, min_epsilon, advance, max_penetration, table, .. } = spec;
    Keeping {
        friction,
        edges: cone_edges,
        torsion,
        space: space(spec.space),
        min_epsilon,
        advance,
        max_penetration,
        table,
    }
}

fn physics(checker: &mut Checker, spec: &PhysicsSpec) -> Physics {
    let &PhysicsSpec {
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
        gravity,
        table,
        table_friction,
        labels,
    } = spec;
    for key in AGREEMENT_KEYS.into_iter().filter(|_| labels == LabelsSpec::Ladder) {
        if checker.has(key) {
            checker.contradiction(key, "physics.labels = \"ladder\"", "it is a setting of labels by agreement");
        }
    }
    if rollout_share == 0.0 && checker.has("physics.rollouts") {
        let because = "no grasp is rolled out";
        checker.contradiction("physics.rollouts", "physics.rollout_share = 0", because);
    }
    if !table && checker.has("physics.table_friction") {
        let because = "no grasp is tried on a table";
        checker.contradiction("physics.table_friction", "physics.table = false", because);
    }
    Physics {
        tried: match tried {
            TriedSpec::Closed => TriedStates::Closed,
            TriedSpec::Kept => TriedStates::Kept,
        },
        friction,
        mass: match mass {
            MassSpec::Auto(_) => None,
            MassSpec::Kilograms(mass) => Some(mass),
        },
        perturbed_runs,
        rollout_share,
        rollouts,
        variant_share,
        series_share,
        confirm: match confirm {
            ConfirmSpec::Strict => Confirm::Strict,
            ConfirmSpec::Both => Confirm::Both,
            ConfirmSpec::Failed => Confirm::Failed,
            ConfirmSpec::None => Confirm::None,
        },
        failed_per_held,
        six_directions: gravity == GravitySpec::SixDirections,
        table_friction: table.then_some(table_friction),
        labels: match labels {
            LabelsSpec::Agreement => Labels::Agreement,
            LabelsSpec::Ladder => Labels::Ladder,
        },
    }
}

fn space(spec: SpaceSpec) -> WrenchSpace {
    match spec {
        SpaceSpec::Force => WrenchSpace::Force,
        SpaceSpec::Wrench => WrenchSpace::Wrench,
    }
}
