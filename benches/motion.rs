//! Certified paths of the mesh Fetch, arm with torso, for the problems that `benches/motion.py` writes; one thread.
//!
//!     cargo bench --bench motion -- PROBLEMS.json PATHS.json
//!
//! PROBLEMS.json: a list of {family, name, start, goal, obstacles: [{kind, size, position, rotation}]}, rotations by rows. PATHS.json
//! gets one row per problem, with the path. Without arguments nothing is run.

use std::{collections::BTreeMap, env, fs, time::Instant};

use graspmill::{
    collision::{CollisionChecker, Geometry, Obstacle, PlacedObstacle, Shape},
    runtime::planner::motion::{ArmScene, PathKey, PathSettings, PathVerdict, plan_path},
};
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Vector3};
use serde_json::{Value, json};
use support::robots::{FETCH_ARM, FETCH_MESHES, FETCH_SITE, open_robot};

#[path = "../tests/support/mod.rs"]
mod support;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
}

fn obstacle(value: &Value) -> PlacedObstacle {
    let size = numbers(&value["size"]);
    let shape = match value["kind"].as_str() {
        Some("box") => Shape::Box { half: [0, 1, 2].map(|axis| 0.5 * size[axis]) },
        Some("cylinder") => Shape::Cylinder { half: 0.5 * size[0], radius: size[1] },
        Some("sphere") => Shape::Sphere { radius: size[0] },
        kind => panic!("a shape of kind {kind:?}"),
    };
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&numbers(&value["rotation"])));
    let position = Vector3::from_row_slice(&numbers(&value["position"]));
    let pose = IsometryMatrix3::from_parts(position.into(), rotation);
    let geometry = Geometry { shape, link_from_shape: IsometryMatrix3::identity() };
    Obstacle::new(&[geometry]).expect("a shape").at(pose)
}

fn solve(robot: &ArmScene, problem: &Value) -> Value {
    let began = Instant::now();
    let obstacles = problem["obstacles"].as_array().expect("obstacles");
    let obstacles: Vec<PlacedObstacle> = obstacles.iter().map(obstacle).collect();
    let scene = robot.among(&obstacles, |_| true);
    let built = began.elapsed();
    let (family, name) = (&problem["family"], &problem["name"]);
    let subject = format!("{family} {name}");
    let (start, goal) = (numbers(&problem["start"]), numbers(&problem["goal"]));
    let (key, settings) = (PathKey::new(1, subject.as_bytes()), PathSettings::default());
    let began = Instant::now();
    let (verdict, work) = plan_path(&scene, &start, &[goal], &key, &settings);
    let planned = began.elapsed();
    let (path, length) = match &verdict {
        PathVerdict::Found(path) => (path.waypoints.clone(), path.length),
        _ => (Vec::new(), 0.0),
    };
    let began = Instant::now();
    let certified = scene.certify_path(&path, &mut Default::default()).is_ok();
    let verdict = format!("{verdict:?}");
    json!({
        "family": family,
        "name": name,
        "verdict": verdict.split(['(', ' ']).next(),
        "certified": certified && !path.is_empty(),
        "path": path,
        "length": length,
        "build_ms": built.as_secs_f64() * 1e3,
        "plan_ms": planned.as_secs_f64() * 1e3,
        "certify_ms": began.elapsed().as_secs_f64() * 1e3,
        "iterations": work.iterations,
        "checks": work.checks,
        "repairs": work.repairs,
        "restarts": work.restarts,
        "certificate_configurations": work.certificate.configurations,
        "certificate_distances": work.certificate.distances,
    })
}

fn main() {
    let arguments: Vec<String> = env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    let [problems, paths] = &arguments[..] else {
        return;
    };
    let mut joints = vec!["torso_lift_joint"];
    joints.extend(FETCH_ARM);
    let fixed = ["l_gripper_finger_joint", "r_gripper_finger_joint"].map(|joint| (joint.to_owned(), 0.05));
    let (model, fixed) = (open_robot(FETCH_MESHES), BTreeMap::from(fixed));
    let group = model.planning_group(&joints, FETCH_SITE, &fixed).expect("the arm with the torso");
    let bodies = model.bodies(&joints, &fixed).expect("bodies");
    let robot = ArmScene::new(&group, CollisionChecker::for_obstacles(&bodies).expect("shapes"));
    let problems: Value = serde_json::from_slice(&fs::read(problems).expect("problems")).expect("JSON");
    let rows: Vec<Value> = problems.as_array().expect("a list").iter().map(|problem| solve(&robot, problem)).collect();
    let pairs: Vec<_> = bodies.pairs.iter().map(|pair| pair.map(|body| &bodies.bodies[body].name)).collect();
    let moving = bodies.bodies.iter().filter(|body| body.link > 0).map(|body| &body.name);
    let answer = json!({ "joints": joints, "pairs": pairs, "moving": moving.collect::<Vec<_>>(), "rows": rows });
    fs::write(paths, answer.to_string()).expect("written");
}
