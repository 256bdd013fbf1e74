//! Three ways to the same depth image, on real scans: our rasteriser, MuJoCo's rays, MuJoCo's OpenGL renderer.
//!
//! A single pixel on an edge of the object may fall on either side of it, so agreement is judged by quantiles of the
//! difference on shared pixels and by the count of pixels that only one of two images sees.

use std::{path::PathBuf, sync::Arc, time::Instant};

use graspmill::{
    geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose, RenderMesh, SimdLevel, TriMesh, rotation_from_rpy},
    render::Rasteriser,
    sim::{Inertia, SimModel, SimWorker},
};
use nalgebra::Vector3;

use crate::support::{
    meshes::{read_stl, scan_files},
    pairs::default_camera,
};

/// Every third of the 78 scans.
const STEP: usize = 3;
const VIEWS: usize = 8;

/// The mesh rotated about the middle of its box, 1 m and half a metre away in alternation.
fn view(mesh: &TriMesh, scan: usize, number: usize) -> Pose<CameraCv, Object> {
    let k = (scan * VIEWS + number) as f64;
    let rotation = rotation_from_rpy(1.7 * k, 0.9 * k + 0.4, 2.3 * k + 0.1);
    let centre = mesh.aabb().expect("vertices").centre();
    let distance = if number.is_multiple_of(2) { 1.0 } else { 0.5 };
    Pose::new(rotation, Vector3::new(0.0, 0.0, distance) - rotation * centre.coords)
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

    /// Words, then median [m], 99th percentile [m], silhouette pixels per view.
    fn figures(&mut self, name: &str) -> (String, [f64; 3]) {
        self.differences.sort_by(f64::total_cmp);
        let at = |share: f64| self.differences[((self.differences.len() - 1) as f64 * share) as usize];
        let lone = self.lone as f64 / self.views as f64;
        let words = format!(
            "{name}: {} views, {} shared pixels: median {:.1e} m, p99 {:.1e}, p99.99 {:.1e}, max {:.1e}; {lone:.2} silhouette px per view",
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
    let camera = default_camera();
    let mut rasteriser = Rasteriser::new(SimdLevel::detect());
    let mut worker: Option<SimWorker> = None;
    let [mut raster_rays, mut raster_gl, mut gl_rays] = [(); 3].map(|()| Agreement::default());
    let mut seconds = [0.0; 4];
    let scans: Vec<PathBuf> = scan_files().into_iter().step_by(STEP).collect();
    for (number, path) in scans.iter().enumerate() {
        let mesh = read_stl(path);
        let mut timed = |method: usize, start: Instant| seconds[method] += start.elapsed().as_secs_f64();
        let start = Instant::now();
        let model = Arc::new(SimModel::new(&mesh, Inertia::Shell).unwrap_or_else(|error| panic!("{path:?}: {error}")));
        timed(0, start);
        let worker = worker.get_or_insert_with(|| SimWorker::new(&model));
        worker.use_model(&model);
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
        "{} scans: compile {:.1} ms each; per view: raster {:.2} ms, rays {:.1} ms, renderer {:.1} ms (upload included)",
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
