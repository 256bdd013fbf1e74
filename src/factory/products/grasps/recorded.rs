//! From the result of a search to a self-contained record.

use super::settings::GraspSettings;
use format::{FORCE, Grasp, GraspMethod, GraspRun, HandNames, HeldContact, RunInterval, WRENCH};
use kernel::{
    geom::Pose,
    ids::{ObjectId, SampleId},
};
use robot::{
    grasp::{self, EnergyKind, PairHold, STAND_OFF, Sampler, WrenchSpace},
    hand::Hand,
};

/// Method record: settings that energies and quality are computed with.
pub(super) fn method(settings: &GraspSettings) -> GraspMethod {
    let GraspSettings { sampler, annealing, keeping, .. } = settings;
    let stays = match sampler {
        Sampler::Annealing | Sampler::Uniform(_) => false,
        Sampler::Antipodal(antipodal) => antipodal.hold != PairHold::Middle,
        Sampler::Approach(_) => true,
    };
    let sampler = match sampler {
        Sampler::Annealing => "annealing",
        Sampler::Uniform(_) => "uniform",
        Sampler::Antipodal(_) => "antipodal",
        Sampler::Approach(_) => "approach",
    };
    let energy = match annealing.energy {
        EnergyKind::Contact => "contact",
        EnergyKind::ContactAndPotential => "contact_and_potential",
    };
    GraspMethod {
        sampler: sampler.to_owned(),
        energy: energy.to_owned(),
        energy_space: space(annealing.space),
        energy_friction: annealing.friction,
        potential_scale: annealing.potential_scale,
        contact_model: if keeping.torsion.is_some() { "soft_finger" } else { "hard_point" }.to_owned(),
        friction: keeping.friction,
        edges: keeping.edges,
        torsion: keeping.torsion.unwrap_or(0.0),
        space: space(keeping.space),
        min_epsilon: keeping.min_epsilon,
        max_penetration: keeping.max_penetration,
        max_advance: if stays { 0.0 } else { keeping.advance },
        stand_off: STAND_OFF,
    }
}

fn space(space: WrenchSpace) -> String {
    match space {
        WrenchSpace::Force => FORCE,
        WrenchSpace::Wrench => WRENCH,
    }
    .to_owned()
}

/// Names of the hand whose content is `id`.
pub(super) fn names(hand: &Hand, id: ObjectId) -> HandNames {
    HandNames {
        name: hand.name().to_owned(),
        id,
        links: hand.links().to_vec(),
        joints: hand.tree().joints().iter().map(|joint| joint.joint.name.clone()).collect(),
        driven: hand.driven().iter().map(|driven| driven.name.clone()).collect(),
    }
}

/// The record of a run except for the obstacles of its grasps; `record` is one of the same hand and settings, to be
/// filled.
pub(super) fn recorded(run: &grasp::SearchRun, sample: SampleId, hand: &Hand, record: &mut GraspRun) {
    record.sample = sample;
    record.object_from_seed = Pose::from_isometry(run.object_from_seed);
    (record.steps, record.failed, record.tries, record.potentials) = (run.steps, run.failed, run.tries, run.potentials);
    record.course =
        run.course.map(|stretch| RunInterval { accepted: stretch.accepted, mean_energy: stretch.mean_energy });
    record.grasps = run.grasps.iter().map(|grasp| of_grasp(grasp, hand)).collect();
}

fn of_grasp(grasp: &grasp::RatedGrasp, hand: &Hand) -> Grasp {
    let joints_before = hand.posture_values(&grasp.posture);
    let base_from_approach = hand.approach_pose(&hand.link_frames(&joints_before));
    let object_from_approach = Pose::from_isometry(grasp.object_from_approach);
    let contacts = grasp.contacts.iter().map(|contact| HeldContact {
        link: contact.link as u32,
        point: contact.point.coords.into(),
        normal: contact.normal.into_inner().into(),
        distance: contact.distance,
    });
    Grasp {
        object_from_approach,
        object_from_base: object_from_approach * base_from_approach.inverse(),
        opening: hand.opening(&grasp.posture),
        posture: grasp.posture.clone(),
        amplitudes: grasp.amplitudes.clone(),
        joints_before,
        joints: grasp.joints.clone(),
        advance: grasp.advance,
        shift: grasp.shift.map(Into::into),
        turn: grasp.turn.map(Into::into),
        penetration: grasp.penetration,
        energy: grasp.energies.total,
        contact_energy: grasp.energies.contact,
        potential: grasp.energies.potential,
        contacts: contacts.collect(),
        epsilon_force: grasp.quality.epsilon_force,
        epsilon_wrench: grasp.quality.epsilon_wrench,
        volume: grasp.quality.volume,
        kind: grasp.kind,
        width: hand.width(&hand.link_frames(&grasp.joints)),
        verdict: grasp.verdict,
        clearances: grasp.clearances.iter().map(|lowest| [lowest.shaped, lowest.opened]).collect(),
        object_in_way: None,
        point_scheme: grasp.point_scheme,
    }
}
