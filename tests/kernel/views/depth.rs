//! Depth images against rays in double precision and closed forms.

use graspmill::{
    geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose, SimdLevel, TriMesh},
    render::{Rasteriser, RenderMesh},
};
use nalgebra::{Point3, Vector3};

use super::{pose, read_scans};
use crate::support::{
    meshes::{block, bumpy, round},
    pairs::default_camera,
};

/// Depth by rays through the pixel centres (Moeller and Trumbore 1997) in double precision, both sides of every face.
/// Each triangle is tried at the pixels of its box, widened by two.
fn by_rays(mesh: &TriMesh, camera: &Intrinsics, pose: &Pose<CameraCv, Object>) -> Vec<f64> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let mut image = vec![f64::NAN; width * height];
    let vertices: Vec<Point3<f64>> =
        mesh.vertices.iter().map(|vertex| pose.point(&Point3::from(vertex.map(f64::from)))).collect();
    for triangle in &mesh.triangles {
        let corners = triangle.map(|vertex| vertices[vertex as usize]);
        let pixels = corners.map(|corner| camera.project(&corner));
        let reach = |pick: fn(&(f64, f64)) -> f64, count: usize| {
            let values = pixels.each_ref().map(pick);
            let (low, high) =
                (values.iter().copied().fold(f64::MAX, f64::min), values.iter().copied().fold(f64::MIN, f64::max));
            (low - 2.0).max(0.0) as usize..(high + 2.0).clamp(0.0, count as f64) as usize
        };
        for row in reach(|pixel| pixel.1, height) {
            for column in reach(|pixel| pixel.0, width) {
                let ray = camera.unproject(column as f64 + 0.5, row as f64 + 0.5, 1.0).coords;
                if let Some(depth) = hit(&ray, &corners) {
                    let seen = &mut image[row * width + column];
                    if seen.is_nan() || *seen > depth {
                        *seen = depth;
                    }
                }
            }
        }
    }
    image
}

fn hit(ray: &Vector3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> Option<f64> {
    let (p, q) = (b - a, c - a);
    let h = ray.cross(&q);
    let det = p.dot(&h);
    if det == 0.0 {
        return None;
    }
    let s = -a.coords;
    let u = s.dot(&h) / det;
    let v = ray.dot(&s.cross(&p)) / det;
    let t = q.dot(&s.cross(&p)) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

struct Differences {
    shared: Vec<f64>,
    silhouette: usize,
}

fn compare(crop: &DepthCrop, rays: &[f64], camera: &Intrinsics) -> Differences {
    let mut differences = Differences { shared: Vec::new(), silhouette: 0 };
    for row in 0..camera.height {
        for column in 0..camera.width {
            let (ours, theirs) = (crop.at(column, row), rays[(row * camera.width + column) as usize]);
            match (ours.is_nan(), theirs.is_nan()) {
                (false, false) => differences.shared.push((f64::from(ours) - theirs).abs()),
                (true, true) => {}
                _ => differences.silhouette += 1,
            }
        }
    }
    differences.shared.sort_by(f64::total_cmp);
    differences
}

#[test]
fn scans_agree_with_rays_in_double_precision() {
    let camera = default_camera();
    let mut raster = Rasteriser::new(SimdLevel::detect());
    let (mut all, mut silhouette, mut views) = (Vec::new(), 0, 0);
    for (_, mesh) in read_scans(4) {
        let centre = mesh.aabb().expect("vertices").centre();
        for cull in [false, true] {
            let render = RenderMesh::new(&mesh, cull);
            for view in [0, 1, 6, 7, 8, 9, 10, 11] {
                let pose = pose(view, centre, 1.0);
                let crop = raster.render(&render, &camera, &pose).clone();
                let differences = compare(&crop, &by_rays(&mesh, &camera, &pose), &camera);
                silhouette += differences.silhouette;
                all.extend(differences.shared);
                views += 1;
            }
        }
    }
    all.sort_by(f64::total_cmp);
    let quantile = |share: f64| all[((all.len() - 1) as f64 * share) as usize];
    let each_view = silhouette as f64 / f64::from(views);
    println!(
        "{views} views, {} pixels: median {:.2e}, p99 {:.2e}, p99.9 {:.2e}, max {:.2e} m; {each_view:.3} silhouette pixels per view",
        all.len(),
        quantile(0.5),
        quantile(0.99),
        quantile(0.999),
        quantile(1.0)
    );
    assert!(quantile(0.5) <= 1e-7 && quantile(0.99) <= 1e-6 && each_view <= 0.1);
}

#[test]
fn every_level_gives_the_same_bits() {
    let camera = default_camera();
    let mut shapes = read_scans(6);
    shapes.push(("block".into(), block([-0.1, -0.05, -0.02], [0.1, 0.07, 0.02])));
    shapes.push(("coarse".into(), bumpy(12)));
    shapes.push(("fine".into(), bumpy(160)));
    for (name, mesh) in shapes {
        let centre = mesh.aabb().expect("vertices").centre();
        for cull in [false, true] {
            let render = RenderMesh::new(&mesh, cull);
            for view in 0..16 {
                // At 0.15 m the near plane cuts most objects.
                let pose = pose(view, centre, if view % 5 == 4 { 0.15 } else { 0.6 });
                let bits = |level| {
                    let crop = Rasteriser::new(level).render(&render, &camera, &pose).clone();
                    let depth: Vec<u32> = crop.depth.iter().map(|depth| depth.to_bits()).collect();
                    ([crop.left, crop.top, crop.width, crop.height], depth)
                };
                let scalar = bits(SimdLevel::Scalar);
                assert!(scalar.1.len() > 20 || view % 5 == 4, "{name} view {view}: nothing seen");
                for level in SimdLevel::available() {
                    assert!(bits(level) == scalar, "{name}, view {view}, {level}, culling {cull}");
                }
            }
        }
    }
}

#[test]
fn a_plane_a_block_and_a_sphere_have_their_closed_forms() {
    let camera = default_camera();
    let mut raster = Rasteriser::new(SimdLevel::detect());
    // A block seen head-on: its front face lies in the plane z = 1.0 - 0.02.
    let front = RenderMesh::new(&block([-0.1, -0.05, -0.02], [0.1, 0.07, 0.02]), true);
    let ahead = Pose::new(nalgebra::Rotation3::identity(), Vector3::new(0.0, 0.0, 1.0));
    let crop = raster.render(&front, &camera, &ahead);
    assert!(crop.depth.iter().all(|depth| (depth - 0.98).abs() < 1e-6), "a flat face");
    // Pixel centres between the projected sides.
    let count = |low: f64, high: f64, f: f64, c: f64| {
        (0..1000).filter(|i| (low..=high).contains(&((f64::from(*i) + 0.5 - c) / f * 0.98))).count() as u32
    };
    assert_eq!(crop.width, count(-0.1, 0.1, camera.fx, camera.cx));
    assert_eq!(crop.height, count(-0.05, 0.07, camera.fy, camera.cy));
    assert_eq!(crop.returns() as u32, crop.width * crop.height);

    // A sphere: a mesh inside it, its facets at most r (1 - cos(pi / rings)) ~ 1.4e-6 m deep.
    let (rings, radius) = (600, 0.1);
    let sphere = RenderMesh::new(&round(rings, |_, _| radius), true);
    let crop = raster.render(&sphere, &camera, &ahead);
    let mut missed = 0;
    for row in 0..camera.height {
        for column in 0..camera.width {
            let ray = camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, 1.0).coords;
            // |t ray - (0, 0, 1)| = radius
            let (a, b, c) = (ray.norm_squared(), -2.0 * ray.z, 1.0 - radius * radius);
            let inside = b * b - 4.0 * a * c;
            let depth = crop.at(column, row);
            if inside < 0.0 {
                assert!(depth.is_nan(), "({column}, {row}) is outside");
            } else if depth.is_nan() {
                missed += 1;
            } else {
                let exact = (-b - inside.sqrt()) / (2.0 * a);
                let grazing = (exact - 1.0).abs() / radius;
                assert!(
                    (f64::from(depth) - exact).abs() < 6e-6 / grazing.max(0.02),
                    "({column}, {row}): {depth} {exact}"
                );
            }
        }
    }
    assert!(missed <= 4, "{missed} pixels on the rim");
}

#[test]
fn what_reaches_behind_the_near_plane_is_cut_there() {
    let camera = default_camera();
    let mesh = bumpy(60);
    for cull in [false, true] {
        let render = RenderMesh::new(&mesh, cull);
        for view in 0..12 {
            let pose = pose(view, Point3::origin(), 0.12 + 0.01 * view as f64);
            let crop = Rasteriser::new(SimdLevel::detect()).render(&render, &camera, &pose).clone();
            assert!(crop.depth.iter().all(|depth| depth.is_nan() || *depth >= 0.1 - 1e-7));
        }
    }
    // From the middle of a sphere, both sides drawn: the inner wall, everywhere.
    let sphere = RenderMesh::new(&round(200, |_, _| 0.5), false);
    let centred = Pose::<CameraCv, Object>::identity();
    let crop = Rasteriser::new(SimdLevel::detect()).render(&sphere, &camera, &centred).clone();
    assert_eq!((crop.width, crop.height, crop.returns()), (640, 480, 640 * 480));
    for (column, row) in [(0, 0), (320, 240), (639, 479), (100, 300)] {
        let range = camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, 1.0).coords.norm();
        assert!((f64::from(crop.at(column, row)) * range - 0.5).abs() < 1e-4);
    }
}

#[test]
fn what_lies_outside_the_image_is_clipped_and_nothing_seen_is_empty() {
    let camera = default_camera();
    let mesh = bumpy(40);
    let render = RenderMesh::new(&mesh, true);
    let mut raster = Rasteriser::new(SimdLevel::detect());
    for offset in [[0.55, 0.0], [-0.55, 0.4], [0.0, 0.42], [0.56, -0.42]] {
        let pose = Pose::new(nalgebra::Rotation3::identity(), Vector3::new(offset[0], offset[1], 1.0));
        let crop = raster.render(&render, &camera, &pose).clone();
        assert!(crop.left + crop.width <= 640 && crop.top + crop.height <= 480 && crop.returns() > 10);
        let differences = compare(&crop, &by_rays(&mesh, &camera, &pose), &camera);
        assert!(differences.silhouette <= 1 && differences.shared.last().is_some_and(|worst| *worst < 1e-4));
    }
    let away = Pose::new(nalgebra::Rotation3::identity(), Vector3::new(3.0, 0.0, 1.0));
    assert_eq!(*raster.render(&render, &camera, &away), DepthCrop::default());
    let behind = Pose::new(nalgebra::Rotation3::identity(), Vector3::new(0.0, 0.0, -1.0));
    assert_eq!(*raster.render(&render, &camera, &behind), DepthCrop::default());
    let nothing = RenderMesh::new(&TriMesh::default(), false);
    assert_eq!(*raster.render(&nothing, &camera, &away), DepthCrop::default());
}
