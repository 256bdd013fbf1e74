//! Quality of grasps in wrench space, one thread: contacts of three fingers around an ellipsoid, as many as the Barrett hand
//! has virtual ones. A time is of 100 grasps in force closure.

use std::{f64::consts::TAU, hint::black_box, time::Duration};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use graspmill::{
    geom::SimdLevel,
    grasp::wrench::{Contact, EpsilonLimits, EpsilonSolver, FrictionCone, HullSolver, MassFrame, WrenchSet},
    seed::Stream,
};
use nalgebra::{Point3, Unit, Vector3};

const MASS: MassFrame = MassFrame { centre: Point3::new(0.0, 0.0, 0.0), radius: 0.06 };
const GRASPS: usize = 100;

fn contact(stream: &mut Stream, finger: usize) -> Contact {
    let (sin, cos) = libm::sincos(TAU * finger as f64 / 3.0 + stream.uniform(-0.5, 0.5));
    let outward = Vector3::new(cos, sin, stream.uniform(-0.8, 0.8)).normalize();
    let lean = Vector3::from_fn(|_, _| stream.normal()).normalize();
    let point = outward.component_mul(&Vector3::new(0.04, 0.03, 0.06));
    Contact::new(Point3::from(point), Unit::new_normalize(0.3 * lean - outward))
}

fn grasps(contacts: usize, cone: &FrictionCone) -> Vec<Vec<Contact>> {
    let mut stream = Stream::of_job(2, b"", "grasps");
    let mut solver = EpsilonSolver::new(SimdLevel::detect());
    std::iter::repeat_with(|| (0..contacts).map(|index| contact(&mut stream, index % 3)).collect::<Vec<_>>())
        .filter(|contacts| solver.wrenches_enclose(&WrenchSet::new(contacts, cone, &MASS)))
        .take(GRASPS)
        .collect()
}

fn epsilons(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("wrench");
    group.throughput(Throughput::Elements(GRASPS as u64)).sample_size(20).measurement_time(Duration::from_secs(2));
    for (friction, contacts, edges) in
        [(0.2, 4, 8), (0.2, 8, 8), (0.2, 16, 8), (0.2, 16, 20), (0.8, 4, 8), (0.8, 8, 8), (0.8, 16, 8), (0.8, 16, 20)]
    {
        let cone = FrictionCone::hard(friction, edges);
        let grasps = grasps(contacts, &cone);
        let sets: Vec<WrenchSet> = grasps.iter().map(|contacts| WrenchSet::new(contacts, &cone, &MASS)).collect();
        let name = |kind: &str| format!("{kind}/{contacts}x{edges}_friction_{friction}");
        let mut solver = EpsilonSolver::new(SimdLevel::detect());
        let mut bench = |kind: &str, of: &dyn Fn(&mut EpsilonSolver, &WrenchSet) -> f64| {
            group.bench_function(name(kind), |bench| {
                bench.iter(|| {
                    sets.iter().for_each(|set| {
                        solver.forget();
                        black_box(of(&mut solver, black_box(set)));
                    });
                });
            });
        };
        let within = EpsilonLimits { above: 0.15, below: 0.1, tolerance: 0.0 };
        bench("forces", &|solver, set| solver.of_forces(set, &EpsilonLimits::EXACT).upper);
        bench("enclosed", &|solver, set| f64::from(u8::from(solver.wrenches_enclose(set))));
        bench("wrenches", &|solver, set| solver.of_wrenches(set, &EpsilonLimits::EXACT).upper);
        bench("wrenches_within", &|solver, set| solver.of_wrenches_within(set, &within).upper);
        let mut set = WrenchSet::default();
        group.bench_function(name("fill"), |bench| {
            bench.iter(|| {
                grasps.iter().for_each(|contacts| set.fill(black_box(contacts), &cone, &MASS));
            });
        });
    }
    group.finish();
}

fn volumes(criterion: &mut Criterion) {
    let cone = FrictionCone::hard(0.5, 8);
    let sets: Vec<WrenchSet> =
        grasps(12, &cone).iter().map(|contacts| WrenchSet::new(contacts, &cone, &MASS)).collect();
    let mut group = criterion.benchmark_group("wrench");
    group.throughput(Throughput::Elements(GRASPS as u64)).sample_size(10).measurement_time(Duration::from_secs(3));
    let mut hulls = HullSolver::default();
    group.bench_function("volume/12x8_friction_0.5", |bench| {
        bench.iter(|| {
            sets.iter().for_each(|set| {
                black_box(hulls.of_wrenches(black_box(set)));
            });
        });
    });
    group.finish();
}

criterion_group!(benches, epsilons, volumes);
criterion_main!(benches);
