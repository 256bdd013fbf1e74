//! Trials of grasps that annealing kept on scans: verdicts, how sure they are, and their cost.

use std::{collections::BTreeMap, sync::Arc};

use graspmill::{
    contact::ContactSurface,
    factory::products::grasps::seeds,
    geom::{MassProperties, SimdLevel, TriMesh},
    grasp::{Annealer, Annealing, EnergyKind, HandSearch, ObjectSearch},
    seed::Stream,
    sim::{
        HandModel, NativeContacts, Outcome, TrialConditions, TrialProtocol, TrialSim, TrialSpread, TrialWorker,
        WhileClosing, mass_of_volume,
    },
    voxel::InsideTest,
    words::GraspVerdict,
};
use nalgebra::{IsometryMatrix3, Vector3};

use crate::support::{
    annealing::{ANNEALING, KEEPING},
    measures::{median, thread_seconds},
    meshes::{prepare_scan, scan_file},
    robots::{BARRETT, open_hand},
};

const SCANS: [&str; 9] = [
    "025_mug",
    "035_power",
    "024_bowl",
    "011_banana",
    "003_cracker",
    "006_mustard",
    "005_tomato",
    "048_ham",
    "037_scissors",
];

/// Grasps per object.
const GRASPS: usize = 20;

/// A grasp to try: the posture and the object in the hand.
type Task = (Vec<f64>, IsometryMatrix3<f64>);

/// The searches whose grasps are tried.
fn searches() -> [(&'static str, Annealing); 2] {
    [("contact_and_potential", ANNEALING), ("contact", Annealing { energy: EnergyKind::Contact, ..ANNEALING })]
}

/// A scan and grasps of it that annealing kept.
struct Kept {
    mesh: TriMesh,
    surface: Arc<ContactSurface>,
    mass: MassProperties,
    tasks: Vec<Task>,
    found: usize,
}

impl Kept {
    /// The first of the kept grasps of a few seeds, at most three per seed.
    fn new(model: &HandModel, annealing: &Annealing, name: &str) -> Self {
        let mesh = prepare_scan(&scan_file(name));
        let surface = Arc::new(ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface"));
        let mass = MassProperties::of_solid(&surface.solid()).expect("a solid");
        let (bodies, _) = model.bodies().expect("its bodies");
        let search = Arc::new(HandSearch::new(model.hand(), &bodies).expect("eigengrasps"));
        let object = ObjectSearch::new(&surface, &mesh).expect("a solid");
        let mut annealer = Annealer::new(&search, annealing, &KEEPING, SimdLevel::detect());
        let hand = Arc::clone(model.hand());
        let (mut tasks, mut found) = (Vec::new(), 0);
        let seeds = seeds(&surface, 40, &mut Stream::of_job(1, name.as_bytes(), "grasp seeds"));
        for (number, seed) in seeds.iter().enumerate() {
            let run = annealer.run(&object, seed, &mut Stream::of_job(number as u64, name.as_bytes(), "annealing"));
            found += run.grasps.len();
            let kept = run.grasps.iter().filter(|grasp| grasp.verdict == GraspVerdict::Kept).take(3);
            tasks.extend(kept.map(|grasp| {
                let frames = hand.link_frames(&hand.posture_values(&grasp.posture));
                let base_from_approach = hand.approach_pose(&frames);
                (grasp.posture.clone(), base_from_approach.isometry() * grasp.object_from_approach.inverse())
            }));
            if tasks.len() >= GRASPS {
                break;
            }
        }
        tasks.truncate(GRASPS);
        Self { mesh, surface, mass, tasks, found }
    }

    fn worker(&self, model: &HandModel, while_closing: WhileClosing) -> TrialWorker {
        let sim = TrialSim::new(model, &self.surface, &self.mass).expect("a simulation");
        let protocol = TrialProtocol { while_closing, ..TrialProtocol::STANDARD };
        TrialWorker::new(&sim.with_protocol(protocol).expect("a protocol"))
    }
}

/// All trials, with the processor time of each [s].
fn run(
    worker: &mut TrialWorker,
    tasks: &[Task],
    mut conditions: impl FnMut() -> TrialConditions,
) -> Vec<(Outcome, f64)> {
    let mut each = |(posture, pose): &Task| {
        let conditions = conditions();
        let began = thread_seconds();
        let outcome = worker.run(posture, pose, &conditions).expect("a pose");
        (outcome, thread_seconds() - began)
    };
    tasks.iter().map(&mut each).collect()
}

fn held(outcomes: &[(Outcome, f64)]) -> Vec<bool> {
    outcomes.iter().map(|(outcome, _)| outcome.verdict.is_held()).collect()
}

fn differ(one: &[bool], other: &[bool]) -> usize {
    one.iter().zip(other).filter(|(one, other)| one != other).count()
}

/// Sums over objects.
#[derive(Default)]
struct Sums {
    count: usize,
    held: BTreeMap<&'static str, usize>,
    flips: BTreeMap<&'static str, usize>,
    reasons: BTreeMap<&'static str, usize>,
    depths: [Vec<f64>; 3],
    slips: Vec<f64>,
    held_times: Vec<f64>,
    failed_times: Vec<f64>,
    closings: Vec<f64>,
    not_at_rest: usize,
}

impl Sums {
    fn add(&mut self, outcomes: &[(Outcome, f64)]) {
        self.count += outcomes.len();
        for (outcome, took) in outcomes {
            *self.reasons.entry(outcome.verdict.reason()).or_default() += 1;
            self.depths[0].push(1e6 * outcome.start.penetration);
            if !outcome.verdict.is_held() {
                self.failed_times.push(1e3 * took);
                continue;
            }
            self.depths[1].push(1e6 * outcome.closed.as_ref().expect("closed").penetration());
            self.depths[2].push(1e6 * outcome.shaken_penetration);
            self.slips.push(1e6 * outcome.slips[0].moved);
            self.held_times.push(1e3 * took);
            self.closings.push(1e3 * outcome.closing_time);
            self.not_at_rest += usize::from(!outcome.closed_at_rest);
        }
    }

    fn text(&self, name: &str) -> String {
        let spread = |values: &[f64]| {
            let worst = values.iter().copied().fold(0.0, f64::max);
            let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
            format!("{:.0} (mean {mean:.0}, worst {worst:.0})", median(values))
        };
        let Self { count, held, flips, reasons, not_at_rest, .. } = self;
        let [start, closed, shaken] = [0, 1, 2].map(|index| spread(&self.depths[index]));
        format!(
            "== {name}: {count} grasps, held {held:?}, flips {flips:?}, {reasons:?}\n   depth um: start {start}, closed {closed}, \
             shaken {shaken}; slip um {}; ms: held {}, failed {}; closing ms {}, not at rest {not_at_rest}",
            spread(&self.slips),
            spread(&self.held_times),
            spread(&self.failed_times),
            spread(&self.closings),
        )
    }
}

/// Ways to hold the object while the hand closes: grasps held, and verdicts that a micrometre turns.
#[test]
#[ignore = "a table; run by hand with --ignored --nocapture"]
fn what_holds_the_object_while_the_hand_closes() {
    let model = open_hand(BARRETT);
    let [(_, annealing), _] = searches();
    let modes = [WhileClosing::Free, WhileClosing::Damped, WhileClosing::Still];
    let mut sums = modes.map(|_| Sums::default());
    for name in SCANS {
        let kept = Kept::new(&model, &annealing, name);
        for (mode, sums) in modes.into_iter().zip(&mut sums) {
            let mut worker = kept.worker(&model, mode);
            let plain = TrialConditions::new(mass_of_volume(kept.mass.volume));
            let outcomes = run(&mut worker, &kept.tasks, || plain);
            let base = held(&outcomes);
            sums.add(&outcomes);
            *sums.held.entry("0.5").or_default() += base.iter().filter(|held| **held).count();
            for (name, shift) in [("1 nm", 1e-9), ("1 um", 1e-6), ("10 um", 1e-5)] {
                let moved = TrialConditions { shift: Vector3::repeat(shift), ..plain };
                let others = held(&run(&mut worker, &kept.tasks, || moved));
                *sums.flips.entry(name).or_default() += differ(&base, &others);
            }
            println!(
                "{name:14} {mode:?}: {} of {} ({} found)",
                base.iter().filter(|held| **held).count(),
                base.len(),
                kept.found
            );
        }
    }
    for (mode, sums) in modes.into_iter().zip(&sums) {
        println!("{}", sums.text(&format!("{mode:?}")));
    }
}

/// The table of the method without changes, for grasps of both energies.
#[test]
#[ignore = "a table; run by hand with --ignored --nocapture"]
fn trials_of_what_annealing_kept() {
    let model = open_hand(BARRETT);
    for (search, annealing) in searches() {
        let mut all = Sums::default();
        for name in SCANS {
            let kept = Kept::new(&model, &annealing, name);
            let mut worker = kept.worker(&model, TrialProtocol::STANDARD.while_closing);
            let plain = TrialConditions::new(mass_of_volume(kept.mass.volume));
            let outcomes = run(&mut worker, &kept.tasks, || plain);
            let base = held(&outcomes);
            let mut here = Sums::default();
            for sums in [&mut all, &mut here] {
                sums.add(&outcomes);
                *sums.held.entry("0.5").or_default() += base.iter().filter(|held| **held).count();
            }
            for (friction, name) in [(0.2, "0.2"), (0.9, "0.9")] {
                let others = held(&run(&mut worker, &kept.tasks, || TrialConditions { friction, ..plain }));
                *all.held.entry(name).or_default() += others.iter().filter(|held| **held).count();
            }
            let mut draw = Stream::of_job(1, name.as_bytes(), "perturbed");
            for name in ["first", "second"] {
                let conditions = || plain.perturbed(&TrialSpread::STANDARD, &mut draw);
                let others = held(&run(&mut worker, &kept.tasks, conditions));
                *all.flips.entry(name).or_default() += differ(&base, &others);
            }
            println!("{}", here.text(&format!("{search}, {name}, {:.2} kg", plain.mass)));
        }
        println!("{}", all.text(search));
    }
}

/// Verdicts compared with those by MuJoCo's own distance field: some ten seconds of processor each.
#[test]
#[ignore = "a table of ten minutes; run by hand with --ignored --nocapture"]
fn verdicts_of_kept_grasps_beside_mujocos_own_field() {
    let model = open_hand(BARRETT);
    let [(_, annealing), _] = searches();
    let protocol = TrialProtocol::STANDARD;
    let (mut agree, mut count) = (0, 0);
    for name in SCANS {
        let kept = Kept::new(&model, &annealing, name);
        let plain = TrialConditions::new(mass_of_volume(kept.mass.volume));
        let mut ours = kept.worker(&model, protocol.while_closing);
        let native = TrialSim::with_native_mesh(&model, &kept.mesh, &kept.mass, NativeContacts::Sdf);
        let mut native = TrialWorker::new(&native.expect("a simulation"));
        for task in kept.tasks.iter().step_by(4).take(5) {
            let began = thread_seconds();
            let [ours, theirs] =
                [&mut ours, &mut native].map(|worker| worker.run(&task.0, &task.1, &plain).expect("a pose"));
            agree += u32::from(ours.verdict.is_held() == theirs.verdict.is_held());
            count += 1;
            println!("{name}: native {:?}, ours {:?}, {:.1} s", theirs.verdict, ours.verdict, thread_seconds() - began);
        }
        println!("{agree} of {count} agree so far");
    }
}
