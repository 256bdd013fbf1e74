//! Camera files of every kind against an independent projection: a slanted table, whose distance shows half a pixel.

use std::path::Path;

use serde_json::Value;

use crate::support::{
    files::{number_at, read_json},
    program::Program,
    workspace::Workspace,
};

/// Depths of a slanted plane by its definition, for rays through whole columns and rows, with the lens of the second argument
/// inverted by SciPy; as metres and in 16 bits of 0.1 mm. Prints the plane's distance.
const RENDER: &str = "
import json, sys
import numpy as np
from scipy.optimize import root

out, (k1, k2, p1, p2, k3, k4, k5, k6) = sys.argv[1], json.loads(sys.argv[2])
W, H, FX, FY, CX, CY = 160, 120, 131.0, 132.5, 78.0, 61.25
normal = np.array([0.1, -0.75, -0.65]); normal /= np.linalg.norm(normal)
u, v = np.meshgrid(np.arange(W), np.arange(H))
xd, yd = (u - CX).ravel() / FX, (v - CY).ravel() / FY

def residual(rays):
    x, y = rays.reshape(2, -1)
    r2 = x * x + y * y
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    return np.concatenate([x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) - xd,
                           y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y - yd])

found = root(residual, np.concatenate([xd, yd]), method='krylov', options={'fatol': 1e-12})
assert found.success, found.message
x, y = found.x.reshape(2, -1)
depth = (-0.6 / (normal @ np.stack([x, y, np.ones_like(x)]))).reshape(H, W)
assert (depth > 0.1).all() and (depth < 5).all(), (depth.min(), depth.max())
np.save(f'{out}/metres.npy', depth.astype(np.float32))
np.save(f'{out}/units.npy', np.round(depth * 1e4).astype(np.uint16))
print(0.6)
";

/// Distance of the plane that `segment` finds.
fn offset(workspace: &Workspace, picture: &str, intrinsics: &Path, options: &[&str]) -> f64 {
    let out = workspace.path(format!("scene-{}", intrinsics.file_name().expect("a name").display()));
    _ = std::fs::remove_dir_all(&out);
    let run = Program::on("segment", workspace.path(picture)).option("--intrinsics", intrinsics).args(options);
    // The table is empty.
    let said = run.option("--out", &out).expect_code(3);
    assert!(said.stdout.contains("no objects found"), "{}", said.text());
    number_at(&read_json(out.join("scene.json")), "/plane/offset")
}

#[test]
fn every_kind_of_file_gives_the_plane_of_an_independent_projection() {
    let workspace = Workspace::new();
    let render = |coefficients: [f64; 8]| -> f64 {
        let run = Program::python_lines(RENDER).arg(workspace.folder()).arg(format!("{coefficients:?}"));
        run.succeed().json()
    };
    let wanted = render([0.0; 8]);
    let k = "[131.0, 0.0, 78.0, 0.0, 132.5, 61.25, 0.0, 0.0, 1.0]";
    let size = "\"width\": 160, \"height\": 120";
    let focal = "\"fx\": 131.0, \"fy\": 132.5";
    for (name, text, is_in_units, options) in [
        ("own.json", format!("{{{size}, {focal}, \"cx\": 78.5, \"cy\": 61.75, \"pixel_centre\": 0.5}}"), false, &[][..]),
        ("own0.json", format!("{{{size}, {focal}, \"cx\": 78.0, \"cy\": 61.25, \"pixel_centre\": 0}}"), false, &[]),
        ("without.json", format!("{{{size}, {focal}, \"cx\": 78.0, \"cy\": 61.25}}"), false, &["--pixel-centre", "0"]),
        ("open3d.json", format!("{{{size}, \"intrinsic_matrix\": [131.0, 0, 0, 0, 132.5, 0, 78.0, 61.25, 1]}}"), false, &[]),
        ("recorder.json", format!("{{{size}, \"intrinsic_matrix\": [131.0, 0, 0, 0, 132.5, 0, 78.0, 61.25, 1], \"depth_scale\": 10000.0}}"), true, &[]),
        ("camera.json", format!("{{\"cx\": 78.0, \"cy\": 61.25, \"depth_scale\": 0.1, {focal}, {size}}}"), true, &[]),
        ("scene_camera.json", format!("{{\"7\": {{\"cam_K\": {k}, \"depth_scale\": 0.1}}, \"8\": {{\"cam_K\": [99, 0, 9, 0, 99, 9, 0, 0, 1]}}}}"), true, &["--camera", "7"]),
        ("realsense.json", format!("{{{size}, {focal}, \"ppx\": 78.0, \"ppy\": 61.25, \"model\": \"distortion.brown_conrady\", \"coeffs\": [0, 0, 0, 0, 0]}}"), false, &[]),
        ("viewer.json", "{\"rectified.0.width\": \"160\", \"rectified.0.height\": \"120\", \"rectified.0.fx\": \"131.0\", \"rectified.0.fy\": \"132.5\", \"rectified.0.ppx\": \"78.0\", \"rectified.0.ppy\": \"61.25\"}".to_owned(), false, &[]),
        ("kalibr.yaml", "cam0:\n  camera_model: pinhole\n  intrinsics: [131.0, 132.5, 78.0, 61.25]\n  distortion_model: radtan\n  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]\n  resolution: [160, 120]\n".to_owned(), false, &[]),
        ("opencv.yaml", format!("%YAML:1.0\n---\nimage_width: 160\nimage_height: 120\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: {k}\n"), false, &[]),
        ("ros.yaml", format!("height: 120\nwidth: 160\ndistortion_model: plumb_bob\nD: []\nK: {k}\n"), false, &[]),
    ] {
        let file = workspace.write(name, text);
        let (picture, tolerance) = if is_in_units { ("units.npy", 2e-5) } else { ("metres.npy", 2e-6) };
        let found = offset(&workspace, picture, &file, options);
        assert!((found - wanted).abs() < tolerance, "{name}: {found}, not {wanted}");
        // Half a pixel off is 0.6 mm or more: smaller differences are not tested.
        let other = if options.contains(&"--pixel-centre") { "0.5" } else if name == "own.json" { "0" } else { "0.5" };
        let kept: Vec<&str> = options.iter().copied().filter(|word| !["--pixel-centre", "0"].contains(word)).collect();
        let mixed = offset(&workspace, picture, &file, &[&kept[..], &["--pixel-centre", other]].concat());
        assert!((mixed - wanted).abs() > 6e-4, "{name}: {mixed} beside {wanted}");
    }
}

#[test]
fn distortion_of_every_kind_of_file_is_undone_as_an_independent_projection_has_it() {
    let brown = [-0.2, 0.05, 0.003, -0.002, 0.01, 0.0, 0.0, 0.0];
    let rational = [0.3, -0.1, 0.001, 0.002, 0.02, 0.5, -0.2, 0.05];
    let k = "[131.0, 0.0, 78.0, 0.0, 132.5, 61.25, 0.0, 0.0, 1.0]";
    let short = [-0.2, 0.05, 0.003, -0.002, 0.0, 0.0, 0.0, 0.0];
    for (name, text, coefficients) in [
        ("own.json", "{\"width\": 160, \"height\": 120, \"fx\": 131.0, \"fy\": 132.5, \"cx\": 78.5, \"cy\": 61.75, \"pixel_centre\": 0.5, \"distortion\": [-0.2, 0.05, 0.003, -0.002, 0.01]}".to_owned(), brown),
        ("realsense.json", "{\"width\": 160, \"height\": 120, \"fx\": 131.0, \"fy\": 132.5, \"ppx\": 78.0, \"ppy\": 61.25, \"model\": 4, \"coeffs\": [-0.2, 0.05, 0.003, -0.002, 0.01]}".to_owned(), brown),
        ("kalibr.yaml", "cam0:\n  camera_model: pinhole\n  intrinsics: [131.0, 132.5, 78.0, 61.25]\n  distortion_model: radtan\n  distortion_coeffs: [-0.2, 0.05, 0.003, -0.002]\n  resolution: [160, 120]\n".to_owned(), short),
        ("plumb_bob.yaml", format!("height: 120\nwidth: 160\ndistortion_model: plumb_bob\nD: [-0.2, 0.05, 0.003, -0.002, 0.01]\nK: {k}\n"), brown),
        ("rational.yaml", format!("height: 120\nwidth: 160\ndistortion_model: rational_polynomial\nD: [0.3, -0.1, 0.001, 0.002, 0.02, 0.5, -0.2, 0.05]\nK: {k}\n"), rational),
        ("zeros.yaml", format!("height: 120\nwidth: 160\ndistortion_model: rational_polynomial\nD: [-0.2, 0.05, 0.003, -0.002, 0.01, 0, 0, 0]\nK: {k}\n"), brown),
    ] {
        let workspace = Workspace::new();
        let run = Program::python_lines(RENDER).arg(workspace.folder()).arg(format!("{coefficients:?}"));
        let wanted: f64 = run.succeed().json();
        let file = workspace.write(name, text);
        // A pixel takes its nearest neighbour's depth: errors of half a pixel either way, which a fitted plane evens out.
        let found = offset(&workspace, "metres.npy", &file, &[]);
        assert!((found - wanted).abs() < 4e-4, "{name}: {found}, not {wanted}");
    }
}

/// Columns from 100 on of the table: the principal point is 22 columns left of them.
#[test]
fn a_part_of_a_picture_is_read_by_a_file_of_its_own() {
    const CUT: &str = "
import sys
import numpy as np
np.save(f'{sys.argv[1]}/part.npy', np.load(f'{sys.argv[1]}/metres.npy')[:, 100:])
";
    let workspace = Workspace::new();
    let wanted: f64 =
        Program::python_lines(RENDER).arg(workspace.folder()).arg("[0, 0, 0, 0, 0, 0, 0, 0]").succeed().json();
    Program::python_lines(CUT).arg(workspace.folder()).succeed();
    let refused = |intrinsics: &Path| {
        let run = Program::on("segment", workspace.path("part.npy")).option("--intrinsics", intrinsics);
        run.option("--out", workspace.path("refused")).expect_code(2).stderr
    };
    let whole = "height: 120\nwidth: 160\nK: [131.0, 0.0, 78.0, 0.0, 132.5, 61.25, 0.0, 0.0, 1.0]\nroi:\n  x_offset: 100\n  \
                 y_offset: 0\n  width: 60\n  height: 120\n";
    let said = refused(&workspace.write("whole.yaml", whole));
    let remedy = "give a file of graspmill with its own width and height, and cx and cy less the offset";
    assert!(said.contains("at roi.x_offset: 100") && said.contains(remedy), "{said}");
    let said = refused(Path::new("131,132.5,-22,61.25"));
    assert!(said.contains("for a part of a larger picture, give a file with this width and height"), "{said}");
    let own =
        "{\"width\": 60, \"height\": 120, \"fx\": 131, \"fy\": 132.5, \"cx\": -22, \"cy\": 61.25, \"pixel_centre\": 0}";
    let found = offset(&workspace, "part.npy", &workspace.write("part.json", own), &[]);
    assert!((found - wanted).abs() < 2e-6, "{found}, not {wanted}");
}

#[test]
fn cameras_that_are_not_understood_mean_two_and_name_what_is_not() {
    let workspace = Workspace::new();
    Program::python_lines(RENDER).arg(workspace.folder()).arg("[0, 0, 0, 0, 0, 0, 0, 0]").succeed();
    let k = "[131.0, 0.0, 78.0, 0.0, 132.5, 61.25, 0.0, 0.0, 1.0]";
    let info = |rest: &str| format!("height: 120\nwidth: 160\nK: {k}\n{rest}");
    let out = workspace.path("scene");
    let segment = |file: &Path, options: &[&str]| {
        let run = Program::on("segment", workspace.path("metres.npy")).option("--intrinsics", file).args(options);
        run.option("--out", &out)
    };
    for (name, text, words, remedy) in [
        ("fisheye.yaml", info("distortion_model: equidistant\nD: [0.0, 0.0, 0.0, 0.0]\n"), "equidistant", &["131,132.5,78,61.25"][..]),
        ("binned.yaml", info("binning_x: 2\n"), "binning_x: 2", &["131,132.5,78,61.25"]),
        ("moved.yaml", info("P: [130.0, 0, 78.0, 0, 0, 132.5, 61.25, 0, 0, 0, 1, 0]\n"), "--image raw", &["--image", "raw"]),
        ("rectified.yaml", info("P: [130.0, 0, 78.0, 0, 0, 132.5, 61.25, 0, 0, 0, 1, 0]\n"), "--image rectified", &["--image", "rectified"]),
        ("zoomed.yaml", info("zoom: 2\n"), "at zoom (line 4)", &["131,132.5,78,61.25"]),
        ("other.yaml", info("").replace("160", "320").replace("120", "240"), "belong to one of 320 x 240 px", &["131,132.5,78,61.25"]),
        ("several.json", format!("{{\"1\": {{\"cam_K\": {k}}}, \"2\": {{\"cam_K\": [99, 0, 9, 0, 99, 9, 0, 0, 1]}}}}"), "choose one by --camera: 1, 2", &["--camera", "1"]),
        ("named.yaml", info(""), "leave --camera out", &[]),
        ("tiny.json", "{\"width\": 160, \"height\": 120, \"fx\": 1e-320, \"fy\": 132.5, \"cx\": 78, \"cy\": 61, \"pixel_centre\": 0}".to_owned(), "fx = 1e-320 px: must lie between 1.6 and 16000 px", &["131,132.5,78,61.25"]),
    ] {
        let file = workspace.write(name, text);
        let wrong = if name == "named.yaml" { &["--camera", "0"][..] } else { &[] };
        let said = segment(&file, wrong).expect_code(2).stderr;
        // The file that is wrong is named: the camera's, or the picture of another size.
        assert!(said.contains(words) && (said.contains(name) || said.contains("metres.npy")), "{words}: {said}");
        assert!(!out.exists());
        // The remedy, followed.
        let done = match remedy {
            [numbers] => segment(Path::new(numbers), &[]),
            options => segment(&file, options),
        };
        done.expect_code(3);
        std::fs::remove_dir_all(&out).expect("a scene");
    }
    for (numbers, words) in [
        ("1e-320,1e-320,78,61", "fx = 1e-320 px: must lie between 1.6 and 16000 px for an image of 160 x 120 px"),
        ("131,1e300,78,61", "fy = 1e300 px"),
        ("131,132,1e300,61", "the principal point (1e300, 61.5) lies outside"),
    ] {
        let said = segment(Path::new(numbers), &[]).expect_code(2).stderr;
        assert!(said.contains(words) && said.len() < 400, "{words}: {said}");
    }
    // The camera that a scene was made with is in it.
    let file = workspace.write("lens.yaml", info("distortion_model: plumb_bob\nD: [0.1, 0.02, 0, 0, 0]\n"));
    segment(&file, &[]).expect_code(3);
    let report: Value = read_json(out.join("scene.json"));
    assert_eq!(report["picture"]["distortion"], serde_json::json!([0.1, 0.02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    assert!(report["picture"]["pixels"].as_str().expect("words").contains("the given picture"));
}
