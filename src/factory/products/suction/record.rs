//! The record of poses of a cup on one body.

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{loaded::LoadedScene, settings::SuctionJob};
use crate::products::settled::recorded_passage;
use format::{CupMeasures, SealedSurface, SuctionDraws, SuctionHold, SuctionPose, SuctionPoses, SuctionRules};
use kernel::{geom::Pose, ids::SampleId};
use robot::suction::{
    HoldLimit, SampledSuction, SampledSuctions, SealLimit, SealShape, SuctionCounts, SuctionCup, suctionnet_wrench,
};

const _: () = assert!(
    SealLimit::ALL.len() == SuctionPoses::SEAL_LIMITS.len() && HoldLimit::ALL.len() == SuctionPoses::STRENGTHS.len(),
    "records have a number for every limit"
);

/// The record of the poses on a body, each with its robustness. `centre` is the body's centre of mass, in `Object` [m].
pub(super) fn recorded(
    job: &SuctionJob,
    sample: SampleId,
    scene: &LoadedScene,
    centre: &Point3<f64>,
    (found, robustness): (&SampledSuctions, &[Option<f64>]),
) -> SuctionPoses {
    let sampling = job.settings.sampling();
    let body = &scene.record.bodies[sample.item.0 as usize];
    let pose = |(suction, robustness): (&SampledSuction, &Option<f64>)| SuctionPose {
        robustness: *robustness,
        ..recorded_pose(suction, &job.cup, (centre, body.world_from_object.isometry()))
    };
    SuctionPoses {
        sample,
        container: scene.record.container.clone(),
        bodies: scene.record.bodies.iter().map(|body| (body.object, body.world_from_object)).collect(),
        mass: body.mass,
        centre_of_mass: centre.coords.into(),
        cup: measures(&job.cup),
        rules: SuctionRules {
            margin: job.settings.margin,
            half_angle: sampling.half_angle,
            tilt: sampling.tilt,
            safety: sampling.safety,
            any_direction: sampling.any_direction,
            budget: sampling.poses,
            wanted: sampling.free,
        },
        draws: counted(&found.counts),
        poses: found.suctions.iter().zip(robustness).map(pose).collect(),
    }
}

fn measures(cup: &SuctionCup) -> CupMeasures {
    let settings = cup.settings();
    CupMeasures {
        radius: settings.radius,
        outer_radius: cup.outer_radius(),
        height: settings.height,
        tube_radius: settings.tube_radius,
        tube_length: settings.tube_length,
    }
}

fn counted(counts: &SuctionCounts) -> SuctionDraws {
    let &SuctionCounts { poses, tilted, leaking, weak, alike, blocked, free } = counts;
    SuctionDraws { drawn: poses, tilted, leaking, weak, alike, blocked, free }
}

/// A pose, but for its robustness. The body's centre of mass is in `Object` [m].
fn recorded_pose(
    suction: &SampledSuction,
    cup: &SuctionCup,
    (centre, world_from_object): (&Point3<f64>, &IsometryMatrix3<f64>),
) -> SuctionPose {
    let SampledSuction { seal, object_from_cup, .. } = suction;
    let approach = object_from_cup.rotation * Vector3::z();
    // The middle of the lip, where its plane meets the axis; the point on the axis where a ray misses.
    let along = seal.shape.map_or(0.0, |shape| shape.seat - shape.compression);
    let middle = object_from_cup.translation.vector + approach * along;
    // SuctionNet's axes depend on the world's vertical.
    let in_world = |vector: Vector3<f64>| world_from_object.rotation * vector;
    let lever = in_world(centre.coords - middle);
    let wrench = suctionnet_wrench(&in_world(-approach), &lever, &-Vector3::z(), cup.settings().radius);
    SuctionPose {
        number: suction.pose,
        scheme: suction.scheme,
        object_from_cup: Pose::from_isometry(*object_from_cup),
        seal_limit: seal.weakest as u8,
        seal_margin: seal.margin,
        missed: seal.missed,
        surface: seal.shape.as_ref().map(measured),
        suctionnet: [seal.shape.map_or(0.0, |shape| shape.suctionnet), wrench],
        hold: suction.hold.map(|hold| SuctionHold {
            strength: hold.weakest as u8,
            margin: hold.margin,
            used: hold.used,
            force: cup.force(seal.shape.map_or(0.0, |shape| shape.compression)),
        }),
        passage: recorded_passage(&suction.passage),
        robustness: None,
    }
}

fn measured(shape: &SealShape) -> SealedSurface {
    let &SealShape { seat, compression, spread, slope, flex, stretch, bulge, hole, curvatures, suctionnet: _ } = shape;
    SealedSurface { seat, compression, spread, slope, flex, stretch, bulge, hole, curvatures }
}
