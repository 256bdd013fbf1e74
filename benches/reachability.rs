//! Labels of the thesis's grid (12 x 22 x 20 x 2 x 8 x 8 poses) and signed distance fields over it, one thread.
//!
//! `labels/kinematic`: all poses without collisions. `labels/meshes`, `labels/primitives`: with collisions, every 22nd
//! position. `collision/...`: random configurations, all pairs; the meshes need `make robots`.
//! `field/query`: value and gradient at 100,000 poses. `field/obstacle`: an obstacle in, to the new field, and out again.
//! The fields are those of a few balls of poses.

use std::{
    collections::BTreeMap,
    f64::consts::{PI, TAU},
    hint::black_box,
    time::Duration,
};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use graspmill::{
    collision::{Bodies, CollisionChecker},
    factory::products::reachability::{IkSolver, LabelledPosition, PoseLabeller, Scratch},
    geom::{
        Axis, AxisGrid, AxisUnit, EndEffector, FieldLookup, FieldMetric, HealPix, METRES_PER_RADIAN, OccupancyGrid,
        Pose, PoseGrid, PoseLabel, SimdLevel, World, rotation_from_rpy, signed_distance_standard,
        signed_distance_thesis,
    },
    kinematics::PlanningGroup,
    runtime::{EndEffectorVolume, Obstacle, ReachabilityMap, ReachabilityParts, RobotFacts},
    seed::Stream,
};
use nalgebra::IsometryMatrix3;
use support::robots::{FETCH, FETCH_ARM, FETCH_MESHES, FETCH_SITE, open_robot, random_values};

#[path = "../tests/support/mod.rs"]
mod support;

/// The Fetch's grid, or one with each step divided into `split`; roll keeps its two.
fn grid(split: usize) -> AxisGrid {
    let (names, count) = (["x", "y", "z", "roll", "pitch", "yaw"], [12, 22, 20, 2, 8, 8]);
    let axis = |k: usize| {
        let count = if k == 3 { count[k] } else { split * count[k] };
        let (unit, first, step) = if k < 3 {
            (AxisUnit::Metre, [0.0, -1.1, 0.0][k], 0.1 / split as f64)
        } else {
            (AxisUnit::Radian, -PI, TAU / count as f64)
        };
        Axis { name: names[k], unit, first, step, count, periodic: k > 2 }
    };
    AxisGrid::new(std::array::from_fn(axis)).expect("a sound grid")
}

/// About a quarter of the cells, as balls of some steps.
fn labels(grid: &AxisGrid, radius: f64) -> Vec<bool> {
    let mut draw = Stream::of_job(1, b"", "labels");
    let centres: Vec<[usize; 6]> = (0..8).map(|_| grid.coordinates(draw.below(grid.cells() as u64) as usize)).collect();
    let near = |cell: [usize; 6], centre: &[usize; 6]| {
        let steps = |k: usize| grid.axes()[k].steps_between(cell[k], centre[k]) as f64;
        (0..6).map(|k| steps(k).powi(2)).sum::<f64>() <= radius * radius
    };
    (0..grid.cells()).map(|cell| centres.iter().any(|centre| near(grid.coordinates(cell), centre))).collect()
}

/// The grid of jobs/fetch-reachability-sphere.toml, and about a quarter of its cells: those in a ball, not from behind.
fn on_sphere() -> (PoseGrid, Vec<bool>) {
    let axes = *grid(1).axes();
    let position_axes = *axes.first_chunk().expect("six axes");
    let grid = PoseGrid::on_sphere(position_axes, HealPix::new(2).expect("a resolution"), 8).expect("a sound grid");
    let inside = |cell: usize| {
        let pose = Pose::<World, EndEffector>::from_xyz_rpy(grid.pose(cell));
        let away = (pose.translation() - nalgebra::Vector3::new(0.5, 0.0, 0.8)).norm();
        away < 0.9 && pose.rotation().matrix()[(0, 0)] > -0.3
    };
    let inside = (0..grid.cells()).map(inside).collect();
    (grid, inside)
}

/// Poses all over the box of the grid.
fn random_poses(grid: &AxisGrid, count: usize) -> Vec<[f64; 6]> {
    let mut draw = Stream::of_job(2, b"", "poses");
    let coordinate = |axis: &Axis, unit: f64| {
        let cells = if axis.periodic { axis.count } else { axis.count - 1 };
        axis.first + unit * cells as f64 * axis.step
    };
    (0..count).map(|_| std::array::from_fn(|k| coordinate(&grid.axes()[k], draw.unit()))).collect()
}

fn queries(criterion: &mut Criterion) {
    let grid = grid(1);
    let field = signed_distance_standard(&labels(&grid, 5.0), &grid, METRES_PER_RADIAN);
    let random = random_poses(&grid, 100_000);
    let path: Vec<[f64; 6]> =
        (0..100_000).map(|step| std::array::from_fn(|k| random[0][k] * 0.9 + 1e-6 * f64::from(step))).collect();
    let turned: Vec<[f64; 6]> = random
        .iter()
        .map(|pose| std::array::from_fn(|k| if k < 3 { 1.5 * pose[k] - 0.4 } else { 3.0 * pose[k] }))
        .collect();
    let mut group = criterion.benchmark_group("field/query");
    group.throughput(Throughput::Elements(100_000)).measurement_time(Duration::from_secs(3)).sample_size(30);
    let lookup = FieldLookup::new(&grid.into(), FieldMetric::Metres { rho: METRES_PER_RADIAN });
    let mut bench = |name: &str, lookup: &FieldLookup, poses: &[[f64; 6]]| {
        group.bench_function(name, |bench| {
            bench.iter(|| {
                poses.iter().for_each(|pose| {
                    black_box(lookup.value_and_gradient(&field, black_box(pose)));
                });
            });
        });
    };
    bench("random", &lookup, &random);
    bench("along_a_path", &lookup, &path);
    bench("half_outside_and_turned", &lookup, &turned);
    for level in SimdLevel::available() {
        bench(&format!("random_{level}"), &lookup.clone().with_simd(level), &random);
    }
    let (grid, inside) = on_sphere();
    let metric = FieldMetric::Metres { rho: METRES_PER_RADIAN };
    let (field, lookup) = (metric.signed_distance(&inside, &grid), FieldLookup::new(&grid, metric));
    group.bench_function("random_of_directions", |bench| {
        bench.iter(|| {
            random.iter().for_each(|pose| {
                black_box(lookup.value_and_gradient(&field, black_box(pose)));
            });
        });
    });
    group.bench_function("nearest_of_directions", |bench| {
        bench.iter(|| random.iter().map(|pose| grid.nearest(*black_box(pose))).sum::<usize>());
    });
    group.finish();
}

fn fields(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("field/standard");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    for (name, split, radius) in [("fetch", 1, 5.0), ("fetch_halfstep", 2, 9.0)] {
        let grid = grid(split);
        let labels = labels(&grid, radius);
        group.bench_function(name, |bench| {
            bench.iter(|| black_box(signed_distance_standard(black_box(&labels), &grid, METRES_PER_RADIAN)));
        });
    }
    let (directed, inside) = on_sphere();
    let metric = FieldMetric::Metres { rho: METRES_PER_RADIAN };
    group.bench_function("fetch_directions", |bench| {
        bench.iter(|| black_box(metric.signed_distance(black_box(&inside), &directed)));
    });
    group.finish();
    let mut group = criterion.benchmark_group("field/thesis");
    group.sample_size(10);
    let (grid, labels) = (grid(1), labels(&grid(1), 5.0));
    group.bench_function("fetch", |bench| bench.iter(|| black_box(signed_distance_thesis(black_box(&labels), &grid))));
    group.finish();
}

/// A map without witnesses and a hand of the Fetch's size, 0.17 m in front of the wrist.
fn map_and_hand() -> (ReachabilityMap, EndEffectorVolume) {
    let (grid, metric) = (grid(1), FieldMetric::Metres { rho: METRES_PER_RADIAN });
    let inside = labels(&grid, 5.0);
    let distances = signed_distance_standard(&inside, &grid, METRES_PER_RADIAN);
    let label = |inside: &bool| if *inside { PoseLabel::Reachable } else { PoseLabel::NoSolution };
    let labels = inside.iter().map(label).collect();
    let robot = RobotFacts::default();
    let grid = grid.into();
    let map = ReachabilityMap::new(ReachabilityParts { grid, metric, labels, distances, witnesses: None, robot })
        .expect("parts that fit");
    let palm = Pose::from_xyz_rpy([0.07, 0.0, 0.0, 0.0, 0.0, 0.0]);
    (map, EndEffectorVolume::default().with_box(&palm, [0.06, 0.065, 0.04], 0.05))
}

fn obstacles(criterion: &mut Criterion) {
    let (mut map, hand) = map_and_hand();
    let pose = Pose::from_xyz_rpy([0.8, 0.1, 0.7, 0.1, 0.2, 0.3]);
    let mut shelf = OccupancyGrid::new(40);
    for cell in 0..64_000 {
        let index = [cell / 1600, cell / 40 % 40, cell % 40];
        if index[2] % 10 < 2 || index[1] == 0 {
            shelf.set(index);
        }
    }
    let kinds = [
        ("box", Obstacle::cuboid(&pose, [0.15, 0.2, 0.1])),
        ("table", Obstacle::cuboid(&pose, [0.5, 0.8, 0.02])),
        ("occupancy_40", Obstacle::occupancy(&pose, &shelf, 0.01)),
    ];
    let mut group = criterion.benchmark_group("field/obstacle");
    group.sample_size(20);
    for (name, obstacle) in kinds {
        let obstacle = obstacle.expect("a sound obstacle");
        group.bench_function(name, |bench| {
            bench.iter(|| {
                map.add_obstacle(black_box(&obstacle), &hand);
                map.undo()
            });
        });
    }
    group.finish();
}

const SCENES: [(&str, &str); 2] = [("meshes", FETCH_MESHES), ("primitives", FETCH)];

fn fetch(scene: &str) -> (PlanningGroup, Bodies) {
    let (model, none) = (open_robot(scene), BTreeMap::new());
    let arm = model.planning_group(&FETCH_ARM, FETCH_SITE, &none).expect("the arm");
    (arm, model.bodies(&FETCH_ARM, &none).expect("bodies"))
}

fn labels_of_poses(criterion: &mut Criterion) {
    let grid = grid(1);
    let orientations = grid.shape()[3..].iter().product::<usize>();
    let rotations: Vec<_> = (0..orientations)
        .map(|cell| {
            let [_, _, _, roll, pitch, yaw] = grid.pose(cell);
            rotation_from_rpy(roll, pitch, yaw)
        })
        .collect();
    let positions: Vec<[f64; 3]> = (0..grid.cells())
        .step_by(orientations)
        .map(|cell| {
            let [x, y, z, ..] = grid.pose(cell);
            [x, y, z]
        })
        .collect();
    let mut group = criterion.benchmark_group("labels");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    let mut bench = |name: &str, labeller: &PoseLabeller, step: usize| {
        let (mut scratch, mut out) = (Scratch::default(), LabelledPosition::default());
        group.throughput(Throughput::Elements((positions.len().div_ceil(step) * orientations) as u64));
        group.bench_function(name, |bench| {
            bench.iter(|| {
                for position in positions.iter().step_by(step) {
                    labeller.label(&mut scratch, black_box(*position), &mut out);
                }
            });
        });
    };
    for (name, scene) in SCENES {
        let (arm, bodies) = fetch(scene);
        if name == "primitives" {
            bench(
                "kinematic",
                &PoseLabeller::of_parts(&arm, None, &rotations, IkSolver::Auto, 1).expect("a closed form"),
                1,
            );
        }
        bench(
            name,
            &PoseLabeller::of_parts(&arm, Some((&bodies, SimdLevel::detect())), &rotations, IkSolver::Auto, 1)
                .expect("shapes"),
            22,
        );
    }
    group.finish();
}

fn collisions(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("collision");
    group.sample_size(10).measurement_time(Duration::from_secs(3)).throughput(Throughput::Elements(10_000));
    for (name, scene) in SCENES {
        let (arm, bodies) = fetch(scene);
        let checker = CollisionChecker::new(&bodies).expect("shapes");
        let mut draw = Stream::of_job(3, b"", "configurations");
        let configurations: Vec<[IsometryMatrix3<f64>; 8]> = (0..10_000)
            .map(|_| {
                let mut links = [IsometryMatrix3::identity(); 8];
                arm.link_frames(&random_values(&arm, &mut draw), &mut links[1..]);
                links
            })
            .collect();
        group.bench_function(name, |bench| {
            bench.iter(|| {
                for links in &configurations {
                    black_box(checker.check(0..bodies.pairs.len(), black_box(links)));
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, labels_of_poses, collisions, queries, fields, obstacles);
criterion_main!(benches);
