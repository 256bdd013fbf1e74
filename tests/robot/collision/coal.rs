//! coal (an independent collision library) and MuJoCo's forward kinematics, applied to configurations of the Fetch.

use std::fs;

use graspmill::collision::Bodies;
use serde_json::{Value, json};

use crate::support::{
    files::repository_path,
    program::Program,
    robots::{FETCH_ARM, FETCH_MESHES, FETCH_SITE},
    workspace::Workspace,
};

/// The peers' answer.
pub struct Answer {
    /// Whether a pair touches, per configuration.
    pub collides: Vec<bool>,
    /// Pose of the site by MuJoCo, per configuration: its origin [m], then its rotation by rows.
    pub poses: Vec<[f64; 12]>,
    /// Counts and times, as documented in tests/peers/collision.py.
    pub facts: Value,
}

/// Checks configurations of the mesh Fetch's arm, the torso down.
pub fn ask_coal(bodies: &Bodies, configurations: &[[f64; 7]]) -> Answer {
    let folder = Workspace::new();
    let file = |name: &str| folder.path(name);
    let pairs: Vec<_> = bodies.pairs.iter().map(|pair| pair.map(|body| &bodies.bodies[body].name)).collect();
    let (scene, fixed) = (repository_path(FETCH_MESHES), json!({ "torso_lift_joint": 0.0 }));
    let question = json!({ "scene": scene, "site": FETCH_SITE, "joints": FETCH_ARM, "fixed": fixed, "pairs": pairs });
    folder.write("question.json", question.to_string());
    let values: Vec<u8> = configurations.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    folder.write("values", values);
    let peer = Program::peer("peers/bin/python").arg("tests/peers/collision.py").arg(folder.folder());
    let facts = peer.succeed().json();
    let collides = fs::read(file("collides")).expect("an answer").into_iter().map(|byte| byte != 0).collect();
    let poses = fs::read(file("poses")).expect("an answer");
    let poses: Vec<f64> = poses.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    Answer { collides, poses: poses.as_chunks::<12>().0.to_vec(), facts }
}
