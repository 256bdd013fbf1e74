//! Signed distance fields over the thesis's grid (12 x 22 x 20 x 2 x 8 x 8 poses), one thread.
//!
//! `field/query`: value and gradient at one pose, the mean of 100,000. The field is that of a few balls of poses.

use std::{
    f64::consts::{PI, TAU},
    hint::black_box,
    time::Duration,
};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use graspmill::{
    geom::{
        Axis, AxisUnit, FieldLookup, FieldMetric, METRES_PER_RADIAN, PoseGrid, SimdLevel, signed_distance_standard,
        signed_distance_thesis,
    },
    seed::Stream,
};

/// The Fetch's grid, or one with so many steps in each of its own; roll keeps its two.
fn grid(split: usize) -> PoseGrid {
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
    PoseGrid::new(std::array::from_fn(axis)).expect("a sound grid")
}

/// About a quarter of the cells, as balls of some steps.
fn labels(grid: &PoseGrid, radius: f64) -> Vec<bool> {
    let mut draw = Stream::of_job(1, b"", "labels");
    let centres: Vec<[usize; 6]> = (0..8).map(|_| grid.coordinates(draw.below(grid.cells() as u64) as usize)).collect();
    let near = |cell: [usize; 6], centre: &[usize; 6]| {
        let steps = |k: usize| grid.axes()[k].steps_between(cell[k], centre[k]) as f64;
        (0..6).map(|k| steps(k).powi(2)).sum::<f64>() <= radius * radius
    };
    (0..grid.cells()).map(|cell| centres.iter().any(|centre| near(grid.coordinates(cell), centre))).collect()
}

/// Poses all over the box of the grid.
fn random_poses(grid: &PoseGrid, count: usize) -> Vec<[f64; 6]> {
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
    let lookup = FieldLookup::new(&grid, FieldMetric::Metres { rho: METRES_PER_RADIAN });
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
    group.finish();
    let mut group = criterion.benchmark_group("field/thesis");
    group.sample_size(10);
    let (grid, labels) = (grid(1), labels(&grid(1), 5.0));
    group.bench_function("fetch", |bench| bench.iter(|| black_box(signed_distance_thesis(black_box(&labels), &grid))));
    group.finish();
}

criterion_group!(benches, queries, fields);
criterion_main!(benches);
