//! One notion of touching: `robot check`, the check at rest, maps and MuJoCo agree on solids.

use std::{collections::BTreeMap, f64::consts::PI};

use graspmill::{
    collision::CollisionChecker,
    kinematics::Joint,
    seed::Stream,
    sim::{Collidable, PairRule},
};
use nalgebra::IsometryMatrix3;
use serde_json::Value;

use crate::support::{
    program::Program,
    robots::{FETCH, FETCH_ARM, FETCH_MESHES, FETCH_SITE, TX60L, TX60L_JOINTS, TX60L_SITE, open_robot},
    workspace::Workspace,
};

/// A ball on three slides next to or inside of a block that is a mesh; `START` is its first position, `RANGE` its
/// range.
const GANTRY: &str = r#"<mujoco model="gantry">
  <asset><mesh name="block" file="block.obj"/></asset>
  <worldbody>
    <geom type="mesh" mesh="block"/>
    <body name="x" pos="START">
      <inertial pos="0 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/>
      <joint name="x" type="slide" axis="1 0 0" range="RANGE" limited="true"/>
      <body name="y">
        <inertial pos="0 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/>
        <joint name="y" type="slide" axis="0 1 0" range="RANGE" limited="true"/>
        <body name="z">
          <joint name="z" type="slide" axis="0 0 1" range="RANGE" limited="true"/>
          <geom type="sphere" size="0.01" mass="1"/>
          <site name="tip"/>
        </body>
      </body>
    </body>
  </worldbody>EXCLUDE
</mujoco>"#;

/// A block of 0.2 x 0.2 x 0.2 m around (0.2, 0, 0).
const BLOCK: &str = "v 0.1 -0.1 -0.1\nv 0.3 -0.1 -0.1\nv 0.1 0.1 -0.1\nv 0.3 0.1 -0.1\nv 0.1 -0.1 0.1\nv 0.3 -0.1 0.1\nv 0.1 0.1 0.1\n\
                     v 0.3 0.1 0.1\nf 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";

/// The ball begins deep inside and stays there, begins inside and comes out, or begins outside.
const GANTRIES: [(&str, &str, &str); 3] =
    [("always", "0.2 0 0", "-0.03 0.03"), ("inside", "0.2 0 0", "-0.5 0.5"), ("outside", "0.2 0 0.4", "-0.5 0.5")];

fn write_gantry(workspace: &Workspace, name: &str, start: &str, range: &str, exclude: &str) -> String {
    workspace.write("block.obj", BLOCK);
    let text = GANTRY.replace("START", start).replace("RANGE", range).replace("EXCLUDE", exclude);
    workspace.write(format!("{name}.xml"), text).display().to_string()
}

const SAMPLES: u64 = 3000;

fn check(scene: &str, joints: &[&str], target: &str) -> Value {
    let program =
        Program::new("robot").arg("check").arg(scene).option("--joints", joints.join(",")).option("--target", target);
    program.option("--samples", SAMPLES.to_string()).read_json()
}

/// Compares what `robot check` counts with the test of maps at the same joint values, pair by pair; pairs that touch at all.
fn compare_with_map(scene: &str, joints: &[&str], target: &str) -> usize {
    let report = check(scene, joints, target);
    let (robot, none) = (open_robot(scene), BTreeMap::new());
    let group = robot.planning_group(joints, target, &none).expect("a group");
    let Collidable { bodies, rules, rest } = robot.collidable(joints, &none).expect("bodies");
    let checker = CollisionChecker::new(&bodies).expect("shapes");
    let links = |values: &[f64]| {
        let mut links = vec![IsometryMatrix3::identity(); group.len() + 1];
        group.link_frames(values, &mut links[1..]);
        links
    };
    // The command's own stream of joint values.
    let mut stream = Stream::of_job(0, b"", "robot check");
    let range = |joint: &Joint| joint.limits.map_or([-PI, PI], |limits| [limits.low, limits.high]);
    let mut counts = vec![0u64; bodies.pairs.len()];
    for _ in 0..SAMPLES {
        let values: Vec<f64> = group.joints().iter().map(range).map(|[low, high]| stream.uniform(low, high)).collect();
        let links = links(&values);
        for (pair, count) in counts.iter_mut().enumerate() {
            *count += u64::from(checker.pair(pair, &links));
        }
    }
    let names = |pair: &[usize; 2]| pair.map(|body| bodies.bodies[body].name.clone());
    let rows: BTreeMap<[String; 2], u64> = report["pairs"]
        .as_array()
        .expect("pairs")
        .iter()
        .map(|row| {
            (serde_json::from_value(row["bodies"].clone()).expect("names"), row["touches"].as_u64().expect("a count"))
        })
        .collect();
    for (pair, count) in bodies.pairs.iter().zip(&counts) {
        assert_eq!(rows[&names(pair)], *count, "{scene}: {:?}", names(pair));
    }
    let at_rest = bodies.pairs.iter().enumerate().filter(|(pair, _)| checker.pair(*pair, &links(&rest)));
    let at_rest: Vec<[String; 2]> = at_rest.map(|(_, pair)| names(pair)).collect();
    let reported: Vec<[String; 2]> = serde_json::from_value(report["touch_at_rest"].clone()).expect("names");
    assert_eq!(reported, at_rest, "{scene}");
    assert!(rules.iter().any(|(_, rule)| *rule == PairRule::Checked));
    counts.iter().filter(|count| **count > 0).count()
}

#[test]
fn robot_check_counts_what_maps_count() {
    let workspace = Workspace::new();
    for (name, start, range) in GANTRIES {
        let scene = write_gantry(&workspace, name, start, range, "");
        assert_eq!(compare_with_map(&scene, &["x", "y", "z"], "tip"), 1, "{name}");
    }
    assert!(compare_with_map(FETCH, &FETCH_ARM, FETCH_SITE) > 20);
    assert!(compare_with_map(FETCH_MESHES, &FETCH_ARM, FETCH_SITE) > 20);
    assert!(compare_with_map(TX60L, &TX60L_JOINTS, TX60L_SITE) > 3);
}

/// The block is convex: MuJoCo's hull of it is the solid, so that its contacts are a second opinion on every sample.
#[test]
fn a_ball_in_a_block_touches_where_mujoco_has_a_contact() {
    let workspace = Workspace::new();
    for (name, start, range) in GANTRIES {
        let scene = write_gantry(&workspace, name, start, range, "");
        let report = check(&scene, &["x", "y", "z"], "tip");
        let touches = report["pairs"][0]["touches"].as_u64().expect("a count");
        let (robot, none) = (open_robot(&scene), BTreeMap::new());
        let mut worker = robot.contact_worker(&["x", "y", "z"], &none).expect("a worker");
        let mut stream = Stream::of_job(0, b"", "robot check");
        let [low, high] =
            [0, 1].map(|index| range.split(' ').nth(index).expect("two").parse::<f64>().expect("a number"));
        let theirs =
            (0..SAMPLES).filter(|_| !worker.is_free(&[0; 3].map(|_| stream.uniform(low, high)))).count() as u64;
        println!("{name}: {touches} of {SAMPLES}, MuJoCo {theirs}");
        // Nothing within rounding of the surface.
        assert_eq!(touches, theirs, "{name}");
        assert!(
            if name == "always" { touches == SAMPLES } else { touches > 0 && touches < SAMPLES / 2 },
            "{name}: {touches}"
        );
        let excludes = report["exclude"].as_array().expect("lines").len();
        assert_eq!(excludes, usize::from(name == "always"), "{name}");
    }
}

#[test]
fn maps_and_their_check_at_rest_agree_with_robot_check() {
    let workspace = Workspace::new();
    let job = |name: &str, x: &str, yz: &str| {
        format!(
            "product = \"reachability\"\nname = \"gantry\"\n[robot]\nmodel = \"{name}.xml\"\njoints = [\"x\", \"y\", \"z\"]\n\
             target = \"tip\"\n[poses]\nx = {x}\ny = {yz}\nz = {yz}\nroll = 1\npitch = 1\nyaw = 1\n"
        )
    };
    let near = "{ from = -0.02, to = 0.03, step = 0.02 }";
    // At rest the ball is in the block: the job is refused, names the pair, and nothing is begun.
    write_gantry(&workspace, "always", "0.2 0 0", "-0.03 0.03", "");
    workspace.write("always.toml", job("always", "{ from = 0.18, to = 0.23, step = 0.02 }", near));
    let refused = workspace.run_job("always", "never").expect_code(2).stderr;
    assert!(!workspace.path("never").exists() && refused.contains("\"world\" touches \"z\" at rest"), "{refused}");
    // Its remedy works: with the line that it names all poses are free.
    let line =
        refused.split_once("put ").and_then(|(_, rest)| rest.split_once(" into")).expect("a remedy").0.to_owned();
    write_gantry(&workspace, "always", "0.2 0 0", "-0.03 0.03", &line);
    let map = workspace.run_job("always", "free").read_json();
    assert_eq!((&map["kept"], &map["facts"]["reachable"]), (&27.into(), &27.into()), "{map}");
    // Outside the block: poses whose ball is in it collide, all others are reached.
    write_gantry(&workspace, "outside", "0.2 0 0.4", "-0.5 0.5", "");
    let wide = "{ from = -0.12, to = 0.13, step = 0.04 }";
    workspace.write("outside.toml", job("outside", "{ from = 0.08, to = 0.33, step = 0.04 }", wide));
    let map = workspace.run_job("outside", "outside").read_json();
    let steps = |from: f64| (0..7).map(move |step| from + 0.04 * f64::from(step));
    // Distance of the ball's centre from the block, in closed form.
    let apart = |x: f64, y: f64, z: f64| {
        [x - 0.2, y, z].map(|at| (at.abs() - 0.1).max(0.0)).iter().map(|part| part * part).sum::<f64>().sqrt()
    };
    let free = steps(0.08)
        .flat_map(|x| steps(-0.12).flat_map(move |y| steps(-0.12).map(move |z| (x, y, z))))
        // The slide of z reaches from -0.1 m upward.
        .filter(|(x, y, z)| *z > -0.1 && apart(*x, *y, *z) > 0.01)
        .count();
    assert_eq!(map["facts"]["reachable"], serde_json::json!(free), "{map}");
}
