//! The grasp planner on one thread: hands search and rank grasps of a mug that was completed on a grid of 40^3.
//!
//! `planner/steps/HAND`: 10,000 steps of contact and potential over forces, in five searches without rating, from the grid.
//! `planner/list/HAND`: a ranked list of 20, rated, on a table, from a prepared object. `planner/grid` and `planner/mesh`: preparation
//! of an object before the first step of a search, from the grid and from a mesh of 16,000 triangles.

#![expect(clippy::print_stdout, reason = "prints what the plans kept and lost")]

use std::{hint::black_box, sync::Arc, time::Duration};

use criterion::{Criterion, criterion_group, criterion_main};
use graspmill::{
    contact::ContactSurface,
    geom::{GridPlacement, OccupancyGrid, SimdLevel},
    grasp::{Annealer, Annealing, EnergyKind, HandSearch, SearchFrom, WrenchSpace, seeds},
    runtime::planner::plan::{PlanInputs, PlanObject, PlanSettings, plan_grasps},
    seed::Stream,
    voxel::InsideTest,
};
use nalgebra::{IsometryMatrix3, Point3};
use support::{
    annealing,
    meshes::built_in_mesh,
    robots::{BARRETT, GRIPPER, open_hand},
};

#[path = "../tests/support/mod.rs"]
mod support;

const STEPS: u32 = 2_000;
const SEARCHES: u32 = 5;

const HANDS: [(&str, &str); 3] =
    [("barrett", BARRETT), ("parallel_gripper", GRIPPER), ("fetch_gripper", "scenes/fetch_gripper.xml")];

/// The mug as a completed grid: cells whose middles lie inside.
fn grid(surface: &ContactSurface) -> (OccupancyGrid, GridPlacement) {
    let bounds = surface.bounds();
    let placement =
        GridPlacement { resolution: 40, centre: bounds.centre(), cell_size: bounds.longest_side() / (0.8 * 40.0) };
    let mut cells = OccupancyGrid::new(40);
    for index in 0..40u32.pow(3) {
        let cell = [index / 1600, index / 40 % 40, index % 40];
        let corner = placement.lower_corner();
        let middle = Point3::from(std::array::from_fn::<f64, 3, _>(|axis| {
            corner[axis] + (f64::from(cell[axis]) + 0.5) * placement.cell_size
        }));
        if surface.signed_distance(&middle) < 0.0 {
            cells.set(cell);
        }
    }
    (cells, placement)
}

fn searches(criterion: &mut Criterion) {
    let mesh = built_in_mesh("mug-01@16k");
    let surface = Arc::new(ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface"));
    let (cells, placement) = grid(&surface);
    let object = PlanObject::from_grid(&cells, &placement).expect("occupied cells");
    let seeds = seeds(object.surface(), SEARCHES, &mut Stream::of_job(1, b"", "seeds"));
    let settings = Annealing {
        steps: STEPS,
        energy: EnergyKind::ContactAndPotential,
        space: WrenchSpace::Force,
        ..annealing::ANNEALING
    };
    let mut group = criterion.benchmark_group("planner");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    for (name, scene) in HANDS {
        let model = open_hand(scene);
        let hand = Arc::new(HandSearch::new(model.hand(), &model.bodies().expect("bodies").0).expect("eigengrasps"));
        let mut annealer = Annealer::new(&hand, &settings, &annealing::KEEPING, SimdLevel::detect());
        group.bench_function(format!("steps/{name}"), |bench| {
            bench.iter(|| {
                for (number, seed) in (0..).zip(&seeds) {
                    let mut stream = Stream::of_job(number, b"", "planner");
                    let from = SearchFrom::Seed(*black_box(seed));
                    let found = annealer.explore(object.search(), &from, &mut stream, |state| {
                        state.energy(EnergyKind::ContactAndPotential)
                    });
                    assert_eq!(found.steps, STEPS, "a search that is given up is none to be timed");
                }
            });
        });
        let lowest = surface.bounds().min.z;
        let inputs = PlanInputs {
            hand: &hand,
            target: &object,
            scene_from_target: IsometryMatrix3::identity(),
            neighbours: &[],
            table: Some(lowest - placement.cell_size),
            camera: None,
            heatmaps: None,
            reach: None,
            motion: None,
            settings: PlanSettings::STANDARD,
            seed: 1,
        };
        let plan = plan_grasps(&inputs).expect("a plan");
        println!("{name}: {} of 20 grasps, {} states, work {}", plan.grasps.len(), plan.funnel.proposed(), plan.work);
        for (end, count) in plan.funnel.counts().filter(|(_, count)| *count > 0) {
            println!("  {}: {count}", end.name());
        }
        plan.rounds.iter().for_each(|round| println!("  {round:?}"));
        group.bench_function(format!("list/{name}"), |bench| {
            bench.iter(|| plan_grasps(black_box(&inputs)).expect("a plan"));
        });
    }
    group.bench_function("grid", |bench| {
        bench.iter(|| PlanObject::from_grid(black_box(&cells), &placement).expect("occupied cells"));
    });
    group.bench_function("mesh", |bench| {
        bench.iter(|| {
            let surface = Arc::new(ContactSurface::new(black_box(&mesh), InsideTest::Crossings).expect("a surface"));
            PlanObject::from_mesh(&mesh, &surface).expect("a closed mesh")
        });
    });
    group.finish();
}

criterion_group!(benches, searches);
criterion_main!(benches);
