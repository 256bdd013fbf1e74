//! Grasps of the Barrett hand on a mug that the program makes itself, one thread.
//!
//! `annealing/contact`, `annealing/forces`, `annealing/wrenches`: runs of 2,000 steps from four seeds, rated; a time is of
//! all their steps. Potentials come late: of short runs they are a larger share than of long ones. `annealing/surface`,
//! `annealing/field`: what an object costs before. `trials/lifted`: grasps that were kept, closed, lifted and shaken in MuJoCo,
//! undisturbed; a time is of all of them, held or not.

use std::{hint::black_box, sync::Arc, time::Duration};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use graspmill::{
    contact::ContactSurface,
    factory::products::grasps::seeds,
    geom::{MassProperties, SimdLevel, TriMesh},
    grasp::{
        Annealer, Annealing, DistanceField, EnergyKind, HandSearch, Keeping, ObjectSearch, RatedGrasp, WrenchSpace,
    },
    seed::Stream,
    sim::{HandModel, TrialConditions, TrialSim, TrialWorker, mass_of_volume},
    voxel::InsideTest,
    words::GraspVerdict,
};
use nalgebra::IsometryMatrix3;
use support::{
    annealing,
    meshes::built_in_mesh,
    robots::{BARRETT, open_hand},
};

#[path = "../tests/support/mod.rs"]
mod support;

const STEPS: u32 = 2_000;
const SEEDS: u32 = 4;

/// Seeds of `trials/lifted`, enough that some of their grasps are kept, and the number of those that are tried.
const SEEDS_OF_TRIALS: u32 = 12;
const TRIED: usize = 12;

/// The settings of jobs, but for the length.
const ANNEALING: Annealing = Annealing { steps: STEPS, ..annealing::ANNEALING };
const KEEPING: Keeping = Keeping { advance: 0.1, ..annealing::KEEPING };

fn mug() -> (TriMesh, Arc<ContactSurface>) {
    let mesh = built_in_mesh("mug-01@16k");
    let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
    (mesh, Arc::new(surface))
}

fn annealer(model: &HandModel, energy: EnergyKind, space: WrenchSpace) -> Annealer {
    let (bodies, _) = model.bodies().expect("what of it can collide");
    let search = Arc::new(HandSearch::new(model.hand(), &bodies).expect("a hand with eigengrasps"));
    Annealer::new(&search, &Annealing { energy, space, ..ANNEALING }, &KEEPING, SimdLevel::detect())
}

fn poses(surface: &ContactSurface, count: u32) -> Vec<IsometryMatrix3<f64>> {
    seeds(surface, count, &mut Stream::of_job(1, b"", "seeds"))
}

fn runs(criterion: &mut Criterion) {
    let (model, (mesh, surface)) = (open_hand(BARRETT), mug());
    let object = ObjectSearch::new(&surface, &mesh).expect("a solid inside");
    let seeds = poses(&surface, SEEDS);
    let mut group = criterion.benchmark_group("annealing");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    group.throughput(Throughput::Elements(u64::from(STEPS * SEEDS)));
    for (name, energy, space) in [
        ("contact", EnergyKind::Contact, WrenchSpace::Force),
        ("forces", EnergyKind::ContactAndPotential, WrenchSpace::Force),
        ("wrenches", EnergyKind::ContactAndPotential, WrenchSpace::Wrench),
    ] {
        let mut annealer = annealer(&model, energy, space);
        group.bench_function(name, |bench| {
            bench.iter(|| {
                for (number, seed) in (0..).zip(&seeds) {
                    let run = annealer.run(&object, black_box(seed), &mut Stream::of_job(number, b"", "annealing"));
                    assert_eq!(run.steps, STEPS, "a run that is given up is none to be timed");
                    black_box(run);
                }
            });
        });
    }
    group.throughput(Throughput::Elements(1));
    group.bench_function("surface", |bench| {
        bench.iter(|| ContactSurface::new(black_box(&mesh), InsideTest::Crossings).expect("a surface"));
    });
    group.bench_function("field", |bench| bench.iter(|| DistanceField::new(black_box(&surface))));
    group.finish();
}

/// A grasp's posture before it closes, and the object expressed in the hand's base frame.
fn started(model: &HandModel, grasp: &RatedGrasp) -> (Vec<f64>, IsometryMatrix3<f64>) {
    let hand = model.hand();
    let base_from_approach = hand.approach_pose(&hand.link_frames(&hand.posture_values(&grasp.posture)));
    (grasp.posture.clone(), base_from_approach.isometry() * grasp.object_from_approach.inverse())
}

fn trials(criterion: &mut Criterion) {
    let (model, (mesh, surface)) = (open_hand(BARRETT), mug());
    let object = ObjectSearch::new(&surface, &mesh).expect("a solid inside");
    let mut annealer = annealer(&model, EnergyKind::ContactAndPotential, WrenchSpace::Force);
    let kept: Vec<_> = (0..)
        .zip(poses(&surface, SEEDS_OF_TRIALS))
        .flat_map(|(number, seed)| annealer.run(&object, &seed, &mut Stream::of_job(number, b"", "annealing")).grasps)
        .filter(|grasp| grasp.verdict == GraspVerdict::Kept)
        .take(TRIED)
        .map(|grasp| started(&model, &grasp))
        .collect();
    assert!(!kept.is_empty(), "something to be tried");
    let mass = MassProperties::of_solid(&surface.solid()).expect("a solid");
    let sim = TrialSim::new(&model, &surface, &mass).expect("MuJoCo takes it");
    let (mut worker, conditions) = (TrialWorker::new(&sim), TrialConditions::new(mass_of_volume(mass.volume)));
    let mut group = criterion.benchmark_group("trials");
    group.sample_size(10).measurement_time(Duration::from_secs(5)).throughput(Throughput::Elements(kept.len() as u64));
    group.bench_function("lifted", |bench| {
        bench.iter(|| {
            for (posture, pose) in &kept {
                black_box(worker.run(posture, black_box(pose), &conditions).expect("a posture of the hand"));
            }
        });
    });
    group.finish();
}

criterion_group!(benches, runs, trials);
criterion_main!(benches);
