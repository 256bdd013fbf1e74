//! A view's depth image and grids, one thread, per view (an average over 44 views, and over eight scans at 16k triangles).
//!
//! The larger meshes are scans with every triangle cut into 4, 16 and 64: the same silhouettes with more triangles.

mod scans;
#[path = "../tests/support/mod.rs"]
mod support;

use std::{collections::HashMap, hint::black_box, time::Duration};

use criterion::{Criterion, criterion_group, criterion_main};
use graspmill::{
    factory::products::pair::touch::{RandomRays, RayTarget, SeenSurface, TouchObstacles, TouchSurface},
    format::TactileContacts,
    geom::{
        CameraCv, DepthCrop, GridPlacement, Intrinsics, Object, OccupancyGrid, Pose, SimdLevel, TriMesh, ViewSet,
        Volume,
    },
    ids::{Digest, ItemId, ObjectId, SampleId},
    render::{Rasteriser, SensorModel, SensorScratch},
    seed::Stream,
    voxel::{InsideTest, SolidObject, Truth, ViewGrids, VolumeFusion, VolumeGrid, solid_occupancy},
};
use nalgebra::{Point3, Rotation3, Vector3};
use scans::{average, scans};
use support::pairs::{default_camera, empty_pair};

const VIEWS: u32 = 44;

/// Every triangle cut into four by the middles of its edges.
fn cut(mesh: &TriMesh) -> TriMesh {
    let mut fine = TriMesh { vertices: mesh.vertices.clone(), triangles: Vec::with_capacity(4 * mesh.triangles.len()) };
    let mut middles = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
            *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                let [p, q] = [p, q].map(|vertex| mesh.vertices[vertex as usize]);
                fine.vertices.push(std::array::from_fn(|axis| 0.5 * (p[axis] + q[axis])));
                fine.vertices.len() as u32 - 1
            })
        });
        fine.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    fine
}

/// An object and its poses 1 m in front of the camera.
struct Subject {
    object: SolidObject,
    poses: Vec<Pose<CameraCv, Object>>,
}

impl Subject {
    fn new(mesh: &TriMesh, truth: Truth) -> Self {
        let solid = solid_occupancy(mesh, InsideTest::Crossings, truth == Truth::LowerCorners);
        let centre = mesh.aabb().expect("vertices").centre();
        let views = ViewSet::Even { count: VIEWS };
        let poses = (0..VIEWS as usize)
            .map(|view| {
                let rotation = views.rotation(view);
                Pose::new(rotation, Vector3::new(0.0, 0.0, 1.0) - rotation * centre.coords)
            })
            .collect();
        Self { object: SolidObject::new(mesh, solid, true, true, truth), poses }
    }
}

/// The stages of a view, each with its own memory.
struct Bench {
    camera: Intrinsics,
    raster: Rasteriser,
    grids: ViewGrids,
    grid: OccupancyGrid,
}

impl Bench {
    fn new() -> Self {
        let level = SimdLevel::detect();
        Self {
            camera: default_camera(),
            raster: Rasteriser::new(level),
            grids: ViewGrids::new(level),
            grid: OccupancyGrid::default(),
        }
    }

    fn place_grid(&mut self) -> GridPlacement {
        self.grids.place_grid(self.raster.crop(), &self.camera, 40).expect("a view with returns")
    }

    fn pair(&mut self, object: &SolidObject, pose: &Pose<CameraCv, Object>, truth: Truth) {
        self.raster.render(&object.render, &self.camera, pose);
        let placement = self.place_grid();
        self.grids.partial(self.raster.crop(), &self.camera, &placement, false, &mut self.grid);
        black_box(&self.grid);
        self.grids.complete(object, pose, &placement, truth, false, &mut self.grid);
        black_box(&self.grid);
        black_box(self.grids.solid_share(object, pose, &placement));
    }
}

fn flat(subjects: &[Subject]) -> Vec<(&SolidObject, &Pose<CameraCv, Object>)> {
    subjects.iter().flat_map(|subject| subject.poses.iter().map(|pose| (&subject.object, pose))).collect()
}

fn scans_of_16k(criterion: &mut Criterion) {
    let meshes = scans();
    let mut bench = Bench::new();
    let mut group = criterion.benchmark_group("view_16k");
    group.sample_size(10).measurement_time(Duration::from_secs(3));

    let subjects: Vec<Subject> = meshes.iter().map(|mesh| Subject::new(mesh, Truth::AnyOverlap)).collect();
    let views = flat(&subjects);
    group.bench_function("depth", |bencher| {
        average(bencher, &views, |(object, pose)| {
            black_box(bench.raster.render(&object.render, &bench.camera, pose));
        });
    });
    group.bench_function("pair", |bencher| {
        average(bencher, &views, |(object, pose)| bench.pair(object, pose, Truth::AnyOverlap));
    });

    // Stage by stage, each from the depth image of its own view.
    let crops: Vec<_> = views
        .iter()
        .map(|(object, pose)| {
            bench.raster.render(&object.render, &bench.camera, pose);
            (bench.raster.crop().clone(), bench.place_grid(), *object, *pose)
        })
        .collect();
    group.bench_function("placement", |bencher| {
        average(bencher, &crops, |(crop, ..)| {
            black_box(bench.grids.place_grid(crop, &bench.camera, 40).expect("a view with returns"));
        });
    });
    group.bench_function("partial", |bencher| {
        average(bencher, &crops, |(crop, placement, ..)| {
            bench.grids.partial(crop, &bench.camera, placement, false, &mut bench.grid);
        });
    });
    group.bench_function("complete", |bencher| {
        average(bencher, &crops, |(_, placement, object, pose)| {
            bench.grids.complete(object, pose, placement, Truth::AnyOverlap, false, &mut bench.grid);
        });
    });
    group.bench_function("solid_share", |bencher| {
        average(bencher, &crops, |(_, placement, object, pose)| {
            black_box(bench.grids.solid_share(object, pose, placement));
        });
    });
    let partial = OccupancyGrid::new(40);
    group.bench_function("free", |bencher| {
        average(bencher, &crops, |(crop, placement, ..)| {
            bench.grids.free(crop, &bench.camera, placement, &partial, &mut bench.grid);
        });
    });
    for profile in SensorModel::profiles() {
        let model = SensorModel::profile(profile).expect("a profile by its own name");
        let mut crop = crops[0].0.clone();
        group.bench_function(format!("sensor/{profile}"), |bencher| {
            average(bencher, &crops, |(clean, ..)| {
                crop.clone_from(clean);
                model.apply(&bench.camera, &mut crop, &mut Stream::of_job(1, b"bench", "sensor"));
            });
        });
    }
    drop(crops);
    drop(views);

    let subjects: Vec<Subject> = meshes.iter().map(|mesh| Subject::new(mesh, Truth::LowerCorners)).collect();
    group.bench_function("pair_of_the_thesis", |bencher| {
        average(bencher, &flat(&subjects), |(object, pose)| bench.pair(object, pose, Truth::LowerCorners));
    });
    group.finish();
}

fn larger_meshes(criterion: &mut Criterion) {
    let mut mesh = scans().swap_remove(2);
    let mut bench = Bench::new();
    for (times, name) in ["16k", "64k", "256k", "1m"].into_iter().enumerate() {
        if times > 0 {
            mesh = cut(&mesh);
        }
        let subject = Subject::new(&mesh, Truth::AnyOverlap);
        let mut group = criterion.benchmark_group(format!("view_one_scan_{name}"));
        group.sample_size(10).measurement_time(Duration::from_secs(3));
        group.bench_function("depth", |bencher| {
            average(bencher, &subject.poses, |pose| {
                black_box(bench.raster.render(&subject.object.render, &bench.camera, pose));
            });
        });
        group.bench_function("pair", |bencher| {
            average(bencher, &subject.poses, |pose| bench.pair(&subject.object, pose, Truth::AnyOverlap));
        });
        group.finish();
    }
}

/// Forty rays of touch, their lines of sight and their record.
fn touch(criterion: &mut Criterion) {
    let sample = SampleId::of_object(ObjectId(Digest([1; 32])), ItemId(0));
    let grid = GridPlacement { resolution: 40, centre: Point3::new(0.0, 0.0, 1.0), cell_size: 0.004 };
    let camera = Bench::new().camera;
    let meshes = scans();
    let surfaces: Vec<TouchSurface> = meshes.iter().map(|mesh| TouchSurface::new(mesh, SimdLevel::detect())).collect();
    let subjects: Vec<Subject> = meshes.iter().map(|mesh| Subject::new(mesh, Truth::AnyOverlap)).collect();
    let views: Vec<_> = subjects
        .iter()
        .zip(&surfaces)
        .flat_map(|(subject, surface)| {
            subject
                .poses
                .iter()
                .map(move |pose| (&subject.object.render, surface, empty_pair(sample, grid, camera, *pose)))
        })
        .collect();
    let rays = RandomRays { count: 40, target: RayTarget::Mesh };
    let alone = TouchObstacles::default();
    let (mut touch, mut payload) = (TactileContacts::none(sample), Vec::new());
    let mut group = criterion.benchmark_group("view_16k");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    group.bench_function("touch_40_rays", |bencher| {
        average(bencher, &views, |(render, surface, pair)| {
            let mut stream = Stream::of_sample(1, &sample, "touch");
            let seen = SeenSurface::new(surface, render, &pair.camera_from_object, &alone);
            seen.random_rays(rays, pair, false, &mut stream, &mut touch);
            payload.clear();
            touch.encode(&mut payload);
            black_box(&payload);
        });
    });
    group.bench_function("touch_surface_of_a_scan", |bencher| {
        average(bencher, &meshes, |mesh| drop(black_box(TouchSurface::new(mesh, SimdLevel::detect()))));
    });
    group.finish();
}

/// Six images of 640 x 480 of a ball on a table, from all round, with the camera's pose among the voxels.
fn images(camera: &Intrinsics) -> Vec<(DepthCrop, Pose<CameraCv, Volume>)> {
    let (ball, radius, table) = (Point3::new(0.15, 0.15, 0.11), 0.06, 0.05);
    let image = |view: u32| {
        let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::TAU * f64::from(view) / 6.0)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI - 0.6);
        let eye = Point3::new(0.15, 0.15, 0.1) - rotation * Vector3::new(0.0, 0.0, 0.6);
        let pose: Pose<CameraCv, Volume> = Pose::new(rotation, eye.coords).inverse();
        let pixels = (0..camera.height).flat_map(|row| (0..camera.width).map(move |column| (column, row)));
        let depth = pixels.map(|(column, row)| {
            let ray = rotation * camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, 1.0).coords;
            let (to_ball, square) = (ball - eye, ray.norm_squared());
            let along = ray.dot(&to_ball);
            let root = along * along - square * (to_ball.norm_squared() - radius * radius);
            let to_table = (table - eye.z) / ray.z;
            if root > 0.0 { ((along - root.sqrt()) / square) as f32 } else { to_table as f32 }
        });
        (DepthCrop { left: 0, top: 0, width: camera.width, height: camera.height, depth: depth.collect() }, pose)
    };
    (0..6).map(image).collect()
}

/// Six images into 40^3 voxels.
fn fusion(criterion: &mut Criterion) {
    let camera = default_camera();
    let grid = VolumeGrid { resolution: 40, size: 0.3 };
    let images = images(&camera);
    let (mut fusion, mut steps) = (VolumeFusion::new(grid, 4.0), Vec::new());
    let mut group = criterion.benchmark_group("volume_40");
    group.sample_size(20).measurement_time(Duration::from_secs(3));
    group.bench_function("fuse_6_images", |bencher| {
        bencher.iter(|| {
            fusion.begin(grid, 4.0);
            images.iter().for_each(|(depth, pose)| fusion.add(black_box(depth), &camera, pose));
            fusion.steps(&mut steps);
            black_box(&steps);
        });
    });
    // Nothing was fused if only other benches were selected.
    let in_sight = fusion.weights().iter().filter(|weight| **weight == 6).count();
    assert!(steps.is_empty() || in_sight > 30_000, "most of the cube is in sight");
    group.finish();
}

/// The noise of a whole image.
fn whole_images(criterion: &mut Criterion) {
    let camera = default_camera();
    let images = images(&camera);
    let mut group = criterion.benchmark_group("image_640x480");
    for profile in SensorModel::profiles() {
        let model = SensorModel::profile(profile).expect("a profile by its own name");
        let (mut noisy, mut scratch) = (images[0].0.clone(), SensorScratch::new(SimdLevel::detect()));
        group.bench_function(format!("sensor/{profile}"), |bencher| {
            average(bencher, &images, |(depth, _)| {
                noisy.clone_from(depth);
                model.apply_with(&mut scratch, &camera, &mut noisy, &mut Stream::of_job(1, b"bench", "sensor"));
            });
        });
    }
    group.finish();
}

criterion_group!(benches, scans_of_16k, larger_meshes, touch, fusion, whole_images);
criterion_main!(benches);
