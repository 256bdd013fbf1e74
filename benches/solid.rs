//! Solid grids at 256^3 and shape descriptors, one thread; parry's voxeliser beside them.
//!
//! The mesh is a bumpy ball of about 16,000 triangles, as many as a YCB scan has; `holes` lacks every tenth triangle. The
//! scans are eight, and the time is one's.

mod scans;
#[path = "../tests/support/mod.rs"]
mod support;

use std::{f64::consts::PI, hint::black_box, time::Duration};

use criterion::{Criterion, criterion_group, criterion_main};
use graspmill::{
    geom::TriMesh,
    voxel::{InsideTest, ShapeDescriptor, solid_occupancy, solid_to_binvox, twins},
};
use parry3d_f64::{
    math::Vector,
    transformation::voxelization::{FillMode, VoxelizedVolume},
};
use scans::{average, scans};

fn bumpy_ball(rings: usize) -> TriMesh {
    let around = 2 * rings;
    let mut mesh = TriMesh::default();
    for (ring, step) in (0..=rings).flat_map(|ring| (0..around).map(move |step| (ring, step))) {
        let (polar, azimuth) = (PI * ring as f64 / rings as f64, 2.0 * PI * step as f64 / around as f64);
        let radius = 0.05 * (1.0 + 0.2 * polar.sin().powi(2) * (3.0 * azimuth).sin() * (2.0 * polar).cos());
        let point = [polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), 1.5 * polar.cos()];
        mesh.vertices.push(point.map(|value| (value * radius) as f32));
    }
    let at = |ring: usize, step: usize| (ring * around + step % around) as u32;
    for (ring, step) in (0..rings).flat_map(|ring| (0..around).map(move |step| (ring, step))) {
        let [a, b, c, d] = [at(ring, step), at(ring + 1, step), at(ring + 1, step + 1), at(ring, step + 1)];
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

fn solids(criterion: &mut Criterion) {
    let mesh = bumpy_ball(64);
    let mut holes = mesh.clone();
    let mut face = 0;
    holes.triangles.retain(|_| {
        face += 1;
        face % 10 != 0
    });
    let mut group = criterion.benchmark_group(format!("solid_256_of_{}_triangles", mesh.triangles.len()));
    group.sample_size(20).measurement_time(Duration::from_secs(4));
    let solid = |mesh: &TriMesh, test, with_surface| black_box(solid_occupancy(black_box(mesh), test, with_surface));
    group.bench_function("crossings", |bench| bench.iter(|| solid(&mesh, InsideTest::Crossings, false)));
    group.bench_function("crossings_with_surface", |bench| bench.iter(|| solid(&mesh, InsideTest::Crossings, true)));
    group.bench_function("winding_closed", |bench| bench.iter(|| solid(&mesh, InsideTest::WindingNumber, false)));
    group.bench_function("winding_holes", |bench| bench.iter(|| solid(&holes, InsideTest::WindingNumber, false)));
    let grid = solid_occupancy(&mesh, InsideTest::Crossings, false);
    group.bench_function("binvox_bytes", |bench| bench.iter(|| black_box(solid_to_binvox(black_box(&grid)))));
    group.finish();
}

fn solids_of_scans(criterion: &mut Criterion) {
    let scans = scans();
    let mut group = criterion.benchmark_group("solid_256_of_scans");
    group.sample_size(10).measurement_time(Duration::from_secs(4));
    group.bench_function("crossings", |bench| {
        average(bench, &scans, |mesh| {
            black_box(solid_occupancy(black_box(mesh), InsideTest::Crossings, false));
        });
    });
    let points: Vec<(Vec<Vector>, &TriMesh)> = scans
        .iter()
        .map(|mesh| (mesh.vertices.iter().map(|vertex| Vector::from(vertex.map(f64::from))).collect(), mesh))
        .collect();
    let fill = FillMode::FloodFill { detect_cavities: false };
    group.bench_function("parry_flood_fill", |bench| {
        average(bench, &points, |(points, mesh)| {
            black_box(VoxelizedVolume::voxelize(black_box(points), &mesh.triangles, 256, fill, false));
        });
    });
    group.finish();
}

fn shapes(criterion: &mut Criterion) {
    let mesh = bumpy_ball(64);
    let descriptor = |mesh: &TriMesh| ShapeDescriptor::from_mesh(black_box(mesh), InsideTest::Crossings);
    criterion.bench_function("shape_descriptor", |bench| bench.iter(|| black_box(descriptor(&mesh))));
    // Stretched in 608 ways, so that few are alike and many have to be compared.
    let shapes: Vec<ShapeDescriptor> = (0..608)
        .map(|index| {
            let mut mesh = bumpy_ball(12);
            let (x, y) = (1.0 + (index % 32) as f32 / 20.0, 1.0 + (index / 32) as f32 / 20.0);
            mesh.vertices.iter_mut().for_each(|vertex| *vertex = [vertex[0] * x, vertex[1] * y, vertex[2]]);
            descriptor(&mesh)
        })
        .collect();
    let mut group = criterion.benchmark_group("twins");
    group.sample_size(10);
    group.bench_function("608_shapes", |bench| bench.iter(|| black_box(twins(black_box(&shapes), 0.85))));
    group.finish();
}

criterion_group!(benches, solids, solids_of_scans, shapes);
criterion_main!(benches);
