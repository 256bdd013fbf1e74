//! Three ways to the same depth image, on real scans: our rasteriser, MuJoCo's rays, MuJoCo's OpenGL renderer.
//!
//! A single pixel on an edge of the object may fall on either side of it, so agreement is judged by quantiles of the
//! difference on shared pixels and by the count of pixels that only one of two images sees.
#![cfg(feature = "sim")]

use std::{collections::HashMap, fs, path::PathBuf, sync::Arc, time::Instant};

use graspmill::{
    geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose, RenderMesh, SimdLevel, TriMesh, rotation_from_rpy},
    render::Rasteriser,
    sim::{Inertia, SimModel, SimWorker},
};
use nalgebra::Vector3;

/// Every third of the 78 scans.
const STEP: usize = 3;
const VIEWS: usize = 8;

fn scans() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = fs::read_dir(".deps/ycb")
        .expect("the YCB scans are missing: make setup")
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "stl"))
        .collect();
    found.sort();
    assert!(found.len() >= 78, "{} YCB scans: make setup", found.len());
    found.into_iter().step_by(STEP).collect()
}

/// Binary STL, equal positions merged. Read here, so that no reader is compared with itself.
fn read_stl(path: &PathBuf) -> TriMesh {
    let bytes = fs::read(path).expect("readable");
    let mut mesh = TriMesh::default();
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    for facet in bytes[84..].chunks_exact(50) {
        let corner = |k: usize| -> [f32; 3] {
            std::array::from_fn(|axis| {
                let at = 12 + 12 * k + 4 * axis;
                f32::from_le_bytes(facet[at..at + 4].try_into().expect("four bytes"))
            })
        };
        mesh.triangles.push([corner(0), corner(1), corner(2)].map(|position| {
            *known.entry(position.map(f32::to_bits)).or_insert_with(|| {
                mesh.vertices.push(position);
                mesh.vertices.len() as u32 - 1
            })
        }));
    }
    mesh
}

/// Turned about the middle of its box, by turns: 1 m and half a metre away.
fn view(mesh: &TriMesh, scan: usize, number: usize) -> Pose<CameraCv, Object> {
    let k = (scan * VIEWS + number) as f64;
    let turn = rotation_from_rpy(1.7 * k, 0.9 * k + 0.4, 2.3 * k + 0.1);
    let centre = mesh.aabb().expect("vertices").centre();
    let distance = if number.is_multiple_of(2) { 1.0 } else { 0.5 };
    Pose::new(turn, Vector3::new(0.0, 0.0, distance) - turn * centre.coords)
}

#[derive(Default)]
struct Agreement {
    differences: Vec<f64>,
    lone: usize,
    views: usize,
}

impl Agreement {
    fn add(&mut self, camera: &Intrinsics, a: &DepthCrop, b: &DepthCrop) {
        self.views += 1;
        for row in 0..camera.height {
            for column in 0..camera.width {
                let (a, b) = (a.at(column, row), b.at(column, row));
                match (a.is_nan(), b.is_nan()) {
                    (false, false) => self.differences.push((f64::from(a) - f64::from(b)).abs()),
                    (true, true) => {}
                    _ => self.lone += 1,
                }
            }
        }
    }

    /// In words, then median [m], 99th percentile [m], silhouette pixels a view.
    fn figures(&mut self, name: &str) -> (String, [f64; 3]) {
        self.differences.sort_by(f64::total_cmp);
        let at = |share: f64| self.differences[((self.differences.len() - 1) as f64 * share) as usize];
        let lone = self.lone as f64 / self.views as f64;
        let words = format!(
            "{name}: {} views, {} shared pixels: median {:.1e} m, p99 {:.1e}, p99.99 {:.1e}, max {:.1e}; {lone:.2} silhouette px a view",
            self.views,
            self.differences.len(),
            at(0.5),
            at(0.99),
            at(0.9999),
            at(1.0)
        );
        (words, [at(0.5), at(0.99), lone])
    }
}

#[test]
fn three_ways_to_depth_agree() {
    let camera = Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).expect("the default camera");
    let mut rasteriser = Rasteriser::new(SimdLevel::detect());
    let mut worker: Option<SimWorker> = None;
    let [mut raster_rays, mut raster_gl, mut gl_rays] = [(); 3].map(|()| Agreement::default());
    let mut seconds = [0.0; 4];
    let scans = scans();
    for (number, path) in scans.iter().enumerate() {
        let mesh = read_stl(path);
        let mut timed = |way: usize, start: Instant| seconds[way] += start.elapsed().as_secs_f64();
        let start = Instant::now();
        let model = Arc::new(SimModel::new(&mesh, Inertia::Shell).unwrap_or_else(|error| panic!("{path:?}: {error}")));
        timed(0, start);
        let worker = worker.get_or_insert_with(|| SimWorker::new(&model));
        worker.turn_to(&model);
        let prepared = RenderMesh::new(&mesh, false);
        for view_number in 0..VIEWS {
            let pose = view(&mesh, number, view_number);
            let start = Instant::now();
            let raster = rasteriser.render(&prepared, &camera, &pose).clone();
            timed(1, start);
            let start = Instant::now();
            let rays = worker.ray_depth(&camera, &pose).expect("rays").clone();
            timed(2, start);
            let start = Instant::now();
            let drawn = worker.gl_depth(&camera, &pose).unwrap_or_else(|error| panic!("{error}")).clone();
            timed(3, start);
            raster_rays.add(&camera, &raster, &rays);
            raster_gl.add(&camera, &raster, &drawn);
            gl_rays.add(&camera, &drawn, &rays);
        }
    }
    let views = (scans.len() * VIEWS) as f64;
    println!(
        "{} scans: compile {:.1} ms each; a view: raster {:.2} ms, rays {:.1} ms, renderer {:.1} ms (upload included)",
        scans.len(),
        seconds[0] * 1e3 / scans.len() as f64,
        seconds[1] * 1e3 / views,
        seconds[2] * 1e3 / views,
        seconds[3] * 1e3 / views
    );
    for (agreement, name) in [
        (&mut raster_rays, "raster - mj_multiRay"),
        (&mut raster_gl, "raster - mjr_render"),
        (&mut gl_rays, "mjr_render - mj_multiRay"),
    ] {
        let (words, [median, p99, lone]) = agreement.figures(name);
        println!("{words}");
        assert!(median <= 1e-6 && p99 <= 1e-5 && lone <= 1.0, "{name}");
    }
}
