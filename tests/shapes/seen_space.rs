//! `free_space_violation` and loose bodies against NumPy and trimesh, which have the meshes, the picture and the camera alone.

use serde_json::Value;

use super::table::{CAMERA, scene_depth};
use crate::support::{
    files::{number_at, read_json, repository_path},
    jobs::NO_SPLIT,
    program::Program,
    workspace::Workspace,
};

/// The share of docs/completing.md, and bodies by trimesh, of each mesh of a scene.
const ORACLE: &str = "
import json, sys
import numpy as np, trimesh

picture, fx, fy, cx, cy, *meshes = sys.argv[1:]
depth = np.load(picture).astype(float)
fx, fy, cx, cy = map(float, (fx, fy, cx, cy))
height, width = depth.shape
padded = np.pad(depth, 3, constant_values=np.nan)
around = np.stack([padded[3 + dv:3 + dv + height, 3 + du:3 + du + width] for dv in range(-3, 4) for du in range(-3, 4)])
nearest = np.where(np.isnan(around), np.inf, around).min(0)
nearest[np.isnan(around).all(0)] = -np.inf
answers = []
for path in meshes:
    mesh = trimesh.load(path, process=False)
    centroids, areas = mesh.triangles.mean(1), mesh.area_faces
    x, y, z = centroids.T
    u, v = np.floor(fx * x / z + cx).astype(int), np.floor(fy * y / z + cy).astype(int)
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    front = np.zeros(len(z), bool)
    front[inside] = z[inside] + 0.008 < nearest[v[inside], u[inside]]
    bodies = [part for part in mesh.split(only_watertight=False) if part.volume > 0]
    largest = max(bodies, key=lambda part: part.volume)
    answers.append([(areas * front).sum() / areas.sum(), len(bodies),
                    1 - largest.area / sum(part.area for part in bodies),
                    1 - largest.volume / sum(part.volume for part in bodies)])
print(json.dumps(answers))
";

fn npy(depth: &[f32]) -> Vec<u8> {
    let head = "{'descr': '<f4', 'fortran_order': False, 'shape': (240, 320), }\n";
    let data: Vec<u8> = depth.iter().flat_map(|depth| depth.to_le_bytes()).collect();
    [b"\x93NUMPY\x01\x00", &(head.len() as u16).to_le_bytes()[..], head.as_bytes(), &data].concat()
}

#[test]
#[ignore = "slow: several evaluations"]
fn the_share_in_seen_space_and_loose_bodies_are_those_of_numpy() {
    let workspace = Workspace::new();
    // Returns are lost next to every jump of depth, as those of a camera.
    let exact = scene_depth();
    let is_jump = |a: f32, b: f32| (a - b).abs() > 0.02;
    let mut lost = exact.clone();
    for pixel in 0..exact.len() - 2 {
        if is_jump(exact[pixel], exact[pixel + 1]) && pixel % 3 != 0 {
            lost[pixel] = f32::NAN;
            lost[pixel + 2] = f32::NAN;
        }
    }
    let mut worst = std::collections::BTreeMap::new();
    let mut loose = 0;
    for (name, depth, methods) in [
        ("exact", &exact, &[("hull", "coverage"), ("extrude", "coverage"), ("mirror", "coverage")][..]),
        ("lost", &lost, &[("hull", "joined"), ("mirror", "joined")]),
    ] {
        let picture = workspace.write(format!("{name}.npy"), npy(depth));
        for (method, detail) in methods {
            let out = workspace.path(format!("{name}-{method}-{detail}"));
            let run = Program::on("complete", &picture).option("--intrinsics", "scenes/table.json");
            let run = run.args(["--method", method, "--detail", detail, "--target", "all"]).option("--out", &out);
            let said = run.succeed().stdout;
            let report = read_json(out.join("scene.json"));
            let objects = report["objects"].as_array().expect("objects");
            let camera = [CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy].map(|number| number.to_string());
            let oracle = Program::python_lines(ORACLE).arg(&picture).args(camera);
            let meshes = objects.iter().map(|object| out.join(object["completed"]["mesh"].as_str().expect("a mesh")));
            let wanted: Vec<[f64; 4]> = oracle.args(meshes).succeed().json();
            for (object, [front, bodies, area, volume]) in objects.iter().zip(wanted) {
                let completed = &object["completed"];
                for (key, wanted) in [
                    ("free_space_violation", front),
                    ("bodies", bodies),
                    ("loose_area", area),
                    ("loose_volume", volume),
                ] {
                    let found = number_at(completed, &format!("/{key}"));
                    assert!((found - wanted).abs() < 1e-6, "{name}, {method}, {detail}, {key}: {found}, not {wanted}");
                }
                let is_loose = bodies > 1.0;
                loose += usize::from(is_loose);
                let words = format!("{}: {bodies} disconnected bodies", object["name"].as_str().expect("a name"));
                assert_eq!(said.contains(&words), is_loose, "{words}: {said}");
                let largest = worst.entry((*method, *detail)).or_insert(0.0_f64);
                *largest = largest.max(front);
            }
        }
    }
    println!("{worst:?}, {loose} meshes in several bodies");
    // Hulls fill the bay between a mug and its handle, and mirror images leave crumbs: both have to show.
    assert!(worst[&("hull", "coverage")] > 0.02 && worst[&("extrude", "coverage")] < 0.01, "{worst:?}");
    assert!(loose > 0, "no mesh is in several bodies");
}

/// The mean share of the meshes that `complete` wrote of a dataset, by the package; a pixel without a return is infinitely far where
/// the third argument is `none`.
const ORACLE_OF_DATASET: &str = "
import json, sys
import graspmill, numpy as np, trimesh

data, folder, sensor = graspmill.Dataset(sys.argv[1]), sys.argv[2], sys.argv[3]
meshes = {int(row['sample'].split('.')[1]): row['mesh'] for row in json.load(open(f'{folder}/samples.json'))['samples']}
shares = []
for sample in data:
    if sample.id.item not in meshes:
        continue
    camera, crop = sample.pair.camera, np.asarray(sample.depth.metres, float)
    depth = np.full((camera.height, camera.width), np.nan)
    top, left = sample.depth.top, sample.depth.left
    depth[top:top + crop.shape[0], left:left + crop.shape[1]] = crop
    if sensor == 'none':
        depth[np.isnan(depth)] = np.inf
    padded = np.pad(depth, 3, constant_values=np.nan)
    around = np.stack([padded[3 + dv:3 + dv + camera.height, 3 + du:3 + du + camera.width]
                       for dv in range(-3, 4) for du in range(-3, 4)])
    nearest = np.where(np.isnan(around), np.inf, around).min(0)
    nearest[np.isnan(around).all(0)] = -np.inf
    mesh = trimesh.load(f'{folder}/{meshes[sample.id.item]}', process=False)
    x, y, z = mesh.triangles.mean(1).T
    u, v = np.floor(camera.fx * x / z + camera.cx).astype(int), np.floor(camera.fy * y / z + camera.cy).astype(int)
    shares.append((mesh.area_faces * (z + 0.008 < nearest[v, u])).sum() / mesh.area_faces.sum())
print(json.dumps([np.mean(shares), len(shares)]))
";

#[test]
#[ignore = "slow: several evaluations"]
fn evaluations_have_the_share_of_numpy_by_what_the_sensor_can_know() {
    let workspace = Workspace::new();
    for sensor in ["none", "kinect-v1"] {
        let job = format!(
            "views = {{ even = 6 }}\n[[objects]]\nbuilt_in = [\"bottle-01\"]\n[channels]\ndepth = \"f32\"\n[sensor]\nprofile = \"{sensor}\"\n{NO_SPLIT}"
        );
        let data = workspace.make_dataset(sensor, &job, &[]);
        let meshes = workspace.path(format!("{sensor}-meshes"));
        let run = Program::on("complete", &data).args(["--method", "hull", "--split", "training"]);
        run.option("--out", &meshes).succeed();
        let oracle = Program::python_lines(ORACLE_OF_DATASET).arg(&data).arg(&meshes).arg(sensor);
        let (wanted, count): (f64, u64) = oracle.env("PYTHONPATH", repository_path("python")).succeed().json();
        let run =
            Program::new("evaluate").arg("completion").arg(&data).args(["--method", "hull", "--split", "training"]);
        let report: Value = run.args(["--surface-samples", "100", "--json"]).succeed().json();
        assert_eq!(report["samples"].as_u64(), Some(count));
        let found = number_at(&report, "/rows/0/free_space_violation/mean");
        assert!((found - wanted).abs() < 1e-6 && found > 0.005, "{sensor}: {found}, not {wanted}");
    }
}

#[test]
fn evaluations_count_meshes_in_several_bodies() {
    let workspace = Workspace::new();
    let job = format!("views = {{ even = 12 }}\n[[objects]]\nbuilt_in = [\"mug-01\", \"box-01\"]\n{NO_SPLIT}");
    let data = workspace.make_dataset("data", &job, &[]);
    let run = || {
        let run = Program::new("evaluate").arg("completion").arg(&data).args([
            "--method",
            "mirror-shell",
            "--method",
            "truth",
        ]);
        run.args(["--split", "training", "--surface-samples", "100"])
    };
    let report: Value = run().arg("--json").succeed().json();
    let meshes = workspace.path("meshes");
    let complete = Program::on("complete", &data).args(["--method", "mirror-shell", "--split", "training"]);
    let said = complete.option("--out", &meshes).succeed().stdout;
    let samples = read_json(meshes.join("samples.json"));
    let samples = samples["samples"].as_array().expect("samples");
    let loose: Vec<&Value> = samples.iter().filter(|row| number_at(row, "/bodies") > 1.0).collect();
    assert!(!loose.is_empty() && loose.len() < samples.len(), "{} of {}", loose.len(), samples.len());
    assert!(loose.iter().all(|row| number_at(row, "/loose_area") > 0.0 && number_at(row, "/loose_volume") > 0.0));
    assert!(said.contains(&format!("{} meshes with disconnected bodies", loose.len())), "{said}");
    assert_eq!(number_at(&report, "/rows/0/in_bodies") as usize, loose.len());
    assert_eq!(number_at(&report, "/rows/1/in_bodies"), 0.0, "true shapes are whole");
    let words = format!("mirror-shell: {} of {} meshes have disconnected bodies", loose.len(), samples.len());
    assert!(run().succeed().stdout.contains(&words), "{words}");
}
