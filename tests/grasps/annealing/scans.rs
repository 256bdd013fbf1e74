//! Costs and finds of annealing on the YCB scans: tables to quote, not to assert more than that they could be made.

use graspmill::{
    geom::SimdLevel,
    grasp::{Annealer, Annealing, DistanceField, EnergyKind, Keeping, SearchRun, WrenchSpace},
    words::GraspVerdict,
};

use super::{QUICK, Searcher, stream};
use crate::support::{
    annealing::KEEPING,
    measures::{median, thread_seconds},
    meshes::scan_file,
};

const TEN: [&str; 10] = [
    "mug",
    "power_drill",
    "banana",
    "cracker_box",
    "bowl",
    "mustard_bottle",
    "pitcher_base",
    "scissors",
    "hammer",
    "master_chef_can",
];

fn energies() -> [(&'static str, Annealing); 3] {
    let contact = Annealing { steps: 10_000, ..QUICK };
    let force = Annealing { energy: EnergyKind::ContactAndPotential, space: WrenchSpace::Force, ..contact };
    [
        ("contact", contact),
        ("potential 3-D", force),
        ("potential 6-D", Annealing { space: WrenchSpace::Wrench, ..force }),
    ]
}

/// Runs of the first seeds and how long they took, without rating more than the best.
fn timed(searcher: &Searcher, settings: &Annealing, keeping: &Keeping, runs: u64) -> (Vec<SearchRun>, f64) {
    let mut annealer = Annealer::new(&searcher.search, settings, keeping, SimdLevel::detect());
    let began = thread_seconds();
    let found = (0..runs).map(|seed| annealer.run(&searcher.object, &searcher.seed(seed), &mut stream(seed))).collect();
    (found, thread_seconds() - began)
}

#[test]
#[ignore = "slow: make test-all"]
fn steps_a_second_on_ten_scans() {
    let mut speeds = [const { Vec::new() }; 3];
    let mut built = Vec::new();
    for name in TEN {
        let searcher = Searcher::with_scan(&scan_file(name));
        let began = thread_seconds();
        let field = DistanceField::new(&searcher.surface);
        built.push(thread_seconds() - began);
        for ((energy, settings), speeds) in energies().iter().zip(&mut speeds) {
            let alone = Annealing { best: 1, ..*settings };
            let runs = if settings.space == WrenchSpace::Wrench { 3 } else { 10 };
            let (found, time) = timed(&searcher, &alone, &KEEPING, runs);
            let steps: f64 = found.iter().map(|run| f64::from(run.steps)).sum();
            let tries: f64 = found.iter().map(|run| run.tries as f64).sum();
            let potentials: f64 = found.iter().map(|run| run.potentials as f64).sum();
            speeds.push(steps / time);
            println!(
                "{name}, {energy}: {:.0} steps/s, {:.2} tries per step, {:.0} % of steps evaluate the potential; field {:.1} MB in {:.2} s",
                steps / time,
                tries / steps,
                100.0 * potentials / steps,
                field.bytes() as f64 * 1e-6,
                built[built.len() - 1],
            );
        }
    }
    for ((energy, _), speeds) in energies().iter().zip(speeds) {
        println!("median of ten scans, {energy}: {:.0} steps/s of processor time", median(&speeds));
    }
    println!("median of ten scans: field in {:.2} s", median(&built));
}

#[test]
#[ignore = "slow: make test-all"]
fn best_energies_by_budget() {
    for name in ["mug", "power_drill", "cracker_box"] {
        let searcher = Searcher::with_scan(&scan_file(name));
        for (energy, settings) in energies() {
            let budgets: &[u32] =
                if settings.space == WrenchSpace::Wrench { &[2_500, 10_000] } else { &[2_500, 10_000, 40_000, 70_000] };
            for (budget, descent) in budgets.iter().flat_map(|budget| [(*budget, false), (*budget, true)]) {
                let (runs, _) = timed(&searcher, &Annealing { steps: budget, descent, ..settings }, &KEEPING, 8);
                let best = runs.iter().filter_map(|run| Some(run.grasps.first()?.energies.total));
                let best = median(&best.collect::<Vec<_>>());
                let mean = |of: &dyn Fn(&SearchRun) -> f64| runs.iter().map(of).sum::<f64>() / runs.len() as f64;
                let accepted =
                    |tenth: usize| mean(&|run| 10.0 * f64::from(run.course[tenth].accepted) / f64::from(budget));
                println!(
                    "{name}, {energy}, {budget} steps{}: best {best:.2} (median of 8); accepted {:.2} to {:.2}, mean energy {:.1} to {:.1}",
                    if descent { ", descent" } else { "" },
                    accepted(0),
                    accepted(9),
                    mean(&|run| run.course[0].mean_energy),
                    mean(&|run| run.course[9].mean_energy),
                );
            }
        }
    }
}

#[test]
#[ignore = "slow: make test-all"]
fn kept_grasps_an_hour_on_ten_scans() {
    let mut hours = [const { Vec::new() }; 3];
    for name in TEN {
        let searcher = Searcher::with_scan(&scan_file(name));
        for ((energy, settings), hours) in energies().iter().zip(&mut hours) {
            let (runs, time) = timed(&searcher, &Annealing { steps: 5_000, ..*settings }, &KEEPING, 10);
            let counts = GraspVerdict::ALL.map(|verdict| {
                runs.iter().flat_map(|run| &run.grasps).filter(|grasp| grasp.verdict == verdict).count()
            });
            let kept = runs.iter().flat_map(|run| &run.grasps).filter(|grasp| grasp.verdict == GraspVerdict::Kept);
            let epsilon = median(&kept.map(|grasp| grasp.quality.epsilon_wrench).collect::<Vec<_>>());
            hours.push(counts[0] as f64 * 3600.0 / time);
            println!(
                "{name}, {energy}: {counts:?} (kept, penetrates, open hand, no closure, low), epsilon {epsilon:.3}, {:.0} per hour",
                hours[hours.len() - 1]
            );
        }
    }
    for ((energy, _), hours) in energies().iter().zip(hours) {
        println!(
            "{energy}: {:.0} kept grasps per core-hour, mean of ten scans; median {:.0}",
            hours.iter().sum::<f64>() / 10.0,
            median(&hours)
        );
    }
}
