//! coal (a collision library of its own) and MuJoCo's forward kinematics, asked about configurations of the Fetch.

use std::{fs, path::Path};

use graspmill::collision::Bodies;
use serde_json::{Value, json};

pub use crate::fetch::ARM;
use crate::python;

/// The Fetch out of its maker's meshes.
pub const SCENE: &str = "scenes/fetch_meshes.xml";
pub const SITE: &str = "wrist_roll_link";

/// What was answered.
pub struct Answer {
    /// Whether a pair touches, a configuration.
    pub collides: Vec<bool>,
    /// Where MuJoCo has the site, a configuration: its origin [m], then its rotation by rows.
    pub poses: Vec<[f64; 12]>,
    /// Counts and times, as tests/peers/collision.py says.
    pub facts: Value,
}

/// Asks about configurations of [`ARM`], seven values each, the torso down.
pub fn ask(bodies: &Bodies, configurations: &[[f64; 7]]) -> Answer {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name);
    let pairs: Vec<_> = bodies.pairs.iter().map(|pair| pair.map(|place| &bodies.bodies[place].name)).collect();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join(SCENE);
    let question =
        json!({ "scene": scene, "site": SITE, "joints": ARM, "fixed": { "torso_lift_joint": 0.0 }, "pairs": pairs });
    fs::write(file("question.json"), question.to_string()).expect("written");
    let values: Vec<u8> = configurations.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    fs::write(file("values"), values).expect("written");
    let facts = python::run("peers/bin/python", |command| command.arg("tests/peers/collision.py").arg(folder.path()));
    let collides = fs::read(file("collides")).expect("an answer").into_iter().map(|byte| byte != 0).collect();
    let poses = fs::read(file("poses")).expect("an answer");
    let poses: Vec<f64> = poses.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    Answer { collides, poses: poses.as_chunks::<12>().0.to_vec(), facts: serde_json::from_str(&facts).expect("JSON") }
}
