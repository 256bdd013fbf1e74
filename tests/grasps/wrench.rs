//! Epsilon and volume of wrench spaces against qhull, and their cost.

use std::{f64::consts::TAU, time::Instant};

use graspmill::{
    geom::SimdLevel,
    grasp::wrench::{
        Contact, Epsilon, EpsilonEnd, EpsilonLimits, EpsilonSolver, FrictionCone, HullSolver, MassFrame, WrenchSet,
    },
    seed::Stream,
};
use nalgebra::{Point3, Unit, Vector3};

use crate::support::{program::Program, workspace::Workspace};

const MASS: MassFrame = MassFrame { centre: Point3::new(0.0, 0.0, 0.0), radius: 0.06 };
const EXACT: EpsilonLimits = EpsilonLimits::EXACT;

fn direction(stream: &mut Stream) -> Vector3<f64> {
    Vector3::from_fn(|_, _| stream.normal()).normalize()
}

/// On an ellipsoid, its normal leaning by some share.
fn contact(stream: &mut Stream, outward: &Vector3<f64>, lean: f64) -> Contact {
    let inward = Unit::new_normalize(lean * direction(stream) - outward);
    Contact::new(Point3::from(outward.component_mul(&Vector3::new(0.04, 0.03, 0.06))), inward)
}

/// Contacts of three fingers around an object.
fn three_sided(stream: &mut Stream, count: usize) -> Vec<Contact> {
    let side = |index: usize| {
        let angle = TAU * (index % 3) as f64 / 3.0 + stream.uniform(-0.5, 0.5);
        let (sin, cos) = libm::sincos(angle);
        let outward = Vector3::new(cos, sin, stream.uniform(-0.8, 0.8)).normalize();
        contact(stream, &outward, 0.3)
    };
    (0..count).map(side).collect()
}

/// Contacts anywhere, of any weight.
fn scattered(stream: &mut Stream, count: usize) -> Vec<Contact> {
    let one = |_| {
        let outward = direction(stream);
        contact(stream, &outward, 0.7).with_weight(stream.uniform(0.3, 2.0))
    };
    (0..count).map(one).collect()
}

/// 2 to 16 contacts of many kinds, half of them in force closure.
fn sets(count: usize) -> Vec<WrenchSet> {
    let mut stream = Stream::of_job(1, b"", "wrench sets");
    let mut solver = EpsilonSolver::new(SimdLevel::detect());
    let (mut found, mut closed) = (Vec::new(), 0);
    for round in 0.. {
        if found.len() == count {
            break;
        }
        let contacts = 2 + found.len() % 15;
        let contacts =
            if round % 2 == 0 { three_sided(&mut stream, contacts) } else { scattered(&mut stream, contacts) };
        let friction = [0.1, 0.2, 0.5, 0.8][round % 4];
        let cone = match round % 3 {
            0 if contacts.len() < 7 => FrictionCone::soft(friction, 0.01),
            1 => FrictionCone::hard(friction, 6),
            _ => FrictionCone::hard(friction, 8),
        };
        let set = WrenchSet::new(&contacts, &cone, &MASS);
        // Few contacts seldom close and many seldom do not: after 200 tries any set is accepted.
        let closes = solver.wrenches_enclose(&set);
        if closes == (2 * closed < found.len()) || round % 200 == 199 {
            closed += usize::from(closes);
            found.push(set);
        }
    }
    assert!((count / 3..=count * 2 / 3).contains(&closed), "{closed} of {count} in force closure");
    found
}

/// Epsilon within 1e-6 and volume within 1e-6 of itself; the report has the largest difference.
fn agrees_with_qhull(count: usize) -> String {
    let sets = sets(count);
    let folder = Workspace::new();
    let bytes = |set: &WrenchSet| set.wrenches().flatten().flat_map(f64::to_le_bytes).collect::<Vec<u8>>();
    let lengths = sets.iter().flat_map(|set| (set.len() as u64).to_le_bytes());
    let counts = folder.write("counts", lengths.collect::<Vec<u8>>());
    let wrenches = folder.write("wrenches", sets.iter().flat_map(bytes).collect::<Vec<u8>>());
    let start = Instant::now();
    let answers = Program::python().arg("tests/peers/hulls.py").args([&counts, &wrenches]).succeed().stdout;
    let theirs = start.elapsed();
    let (mut solver, mut hulls) = (EpsilonSolver::new(SimdLevel::detect()), HullSolver::default());
    let (mut worst, mut ours) = ([0.0f64; 4], std::time::Duration::ZERO);
    assert_eq!(answers.lines().count(), count);
    for (name, (set, line)) in sets.iter().zip(answers.lines()).enumerate() {
        let expected: Vec<f64> = line.split_whitespace().map(|word| word.parse().expect("a number")).collect();
        let start = Instant::now();
        let epsilons = [solver.of_forces(set, &EXACT), solver.of_wrenches(set, &EXACT)];
        let volumes = [hulls.of_forces(set).volume, hulls.of_wrenches(set).volume];
        ours += start.elapsed();
        assert!(epsilons.iter().all(|epsilon| epsilon.end != EpsilonEnd::Capped), "{name}: {epsilons:?}");
        let off = [
            epsilons[0].upper - expected[0],
            volumes[0] - expected[1],
            epsilons[1].upper - expected[2],
            volumes[1] - expected[3],
        ];
        let off = [off[0], off[1] / (expected[1] + 1e-3), off[2], off[3] / (expected[3] + 1e-3)].map(f64::abs);
        assert!(off.iter().all(|off| *off < 1e-6), "{name}: {epsilons:?} {volumes:?} {expected:?}");
        worst = std::array::from_fn(|kind| worst[kind].max(off[kind]));
    }
    format!(
        "{count} sets, apart at most {worst:?} (3-D epsilon, share of volume, 6-D the same)\n\
         all four: {ours:.1?}; qhull, both hulls, with its start: {theirs:.1?}"
    )
}

#[test]
fn qhull_agrees() {
    println!("{}", agrees_with_qhull(100));
}

#[test]
#[ignore = "slow: make test-all"]
fn qhull_agrees_on_a_thousand_sets() {
    println!("{}", agrees_with_qhull(1000));
}

/// Median and 95th percentile of the least of three tries [us].
fn time<T>(sets: &[WrenchSet], mut of: impl FnMut(&WrenchSet) -> T) -> String {
    let once = |set: &WrenchSet, of: &mut dyn FnMut(&WrenchSet) -> T| {
        let start = Instant::now();
        std::hint::black_box(of(set));
        start.elapsed().as_secs_f64() * 1e6
    };
    let mut times: Vec<f64> =
        sets.iter().map(|set| (0..3).map(|_| once(set, &mut of)).fold(f64::INFINITY, f64::min)).collect();
    times.sort_by(f64::total_cmp);
    format!("{:.1} ({:.1})", times[times.len() / 2], times[times.len() * 19 / 20])
}

#[test]
#[ignore = "slow: times"]
fn what_epsilon_costs() {
    println!("us, median (95 %): 3-D; 6-D inside?, 6-D, 5 % tolerance, within median +-0.02; volume");
    for (friction, contacts, edges) in [0.2, 0.8]
        .into_iter()
        .flat_map(|friction| [(4, 8), (8, 8), (16, 8), (16, 20)].map(|(contacts, edges)| (friction, contacts, edges)))
    {
        let mut stream = Stream::of_job(2, b"", "times");
        let mut solver = EpsilonSolver::new(SimdLevel::detect());
        let cone = FrictionCone::hard(friction, edges);
        let grasps = std::iter::repeat_with(|| WrenchSet::new(&three_sided(&mut stream, contacts), &cone, &MASS));
        let sets: Vec<WrenchSet> = grasps.filter(|set| solver.wrenches_enclose(set)).take(200).collect();
        let mut exact: Vec<Epsilon> = sets.iter().map(|set| solver.of_wrenches(set, &EXACT)).collect();
        let open: Vec<_> = exact.iter().filter(|epsilon| epsilon.end != EpsilonEnd::Closed).collect();
        assert!(open.is_empty(), "{open:?}");
        exact.sort_by(|a, b| a.upper.total_cmp(&b.upper));
        let median = exact[exact.len() / 2].upper;
        let fresh = |solver: &mut EpsilonSolver| solver.forget();
        let mut cold = |of: &dyn Fn(&mut EpsilonSolver, &WrenchSet) -> bool| {
            time(&sets, |set| {
                fresh(&mut solver);
                of(&mut solver, set)
            })
        };
        let limits = |limits: EpsilonLimits| {
            move |solver: &mut EpsilonSolver, set: &WrenchSet| solver.of_wrenches_within(set, &limits).upper > 0.0
        };
        let columns = [
            cold(&|solver, set| solver.of_forces(set, &EXACT).upper > 0.0),
            cold(&|solver, set| solver.wrenches_enclose(set)),
            cold(&|solver, set| solver.of_wrenches(set, &EXACT).upper > 0.0),
            cold(&limits(EpsilonLimits { tolerance: 0.05 * median, ..EXACT })),
            cold(&limits(EpsilonLimits { above: median + 0.02, below: median - 0.02, tolerance: 0.0 })),
        ];
        let mut hulls = HullSolver::default();
        let few = if edges == 8 { &sets[..20] } else { &[] };
        let volume = if few.is_empty() { String::new() } else { time(few, |set| hulls.of_wrenches(set)) };
        println!("mu {friction} {contacts} x {edges}: {}; {volume}", columns.join("; "));
    }
}

#[test]
fn a_whole_hull_of_twelve_contacts_is_quick() {
    let mut stream = Stream::of_job(3, b"", "volumes");
    let set = WrenchSet::new(&three_sided(&mut stream, 12), &FrictionCone::hard(0.5, 8), &MASS);
    let mut hulls = HullSolver::default();
    let start = Instant::now();
    let volume = hulls.of_wrenches(&set);
    println!("{volume:?} in {:.1?}", start.elapsed());
    assert!(volume.volume > 0.0 && start.elapsed().as_millis() < 500);
}
