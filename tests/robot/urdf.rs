//! Robots in URDF: read unchanged, with files of packages, links as targets, limits and followers.

use std::collections::BTreeMap;

use graspmill::{
    seed::Stream,
    sim::{RobotError, RobotModel},
};

use crate::support::{
    jobs::NO_SPLIT,
    meshes::{centred_block, off_of},
    program::Program,
    robots::{max_difference, open_robot, random_values},
    workspace::Workspace,
};

/// An arm of three joints whose meshes are files of its package; `MORE` is part of its second joint.
const ARM: &str = r#"<?xml version="1.0"?>
<robot name="arm">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="base_link">
    <visual><geometry><mesh filename="package://arm_description/meshes/base.dae"/></geometry><material name="grey"/></visual>
    <collision><geometry><mesh filename="package://arm_description/meshes/block.obj"/></geometry></collision>
  </link>
  <joint name="j1" type="continuous"><parent link="base_link"/><child link="l1"/><origin xyz="0 0 0.12"/><axis xyz="0 0 1"/></joint>
  <link name="l1">INERTIA<collision><origin xyz="0 0 0.1"/><geometry><cylinder radius="0.02" length="0.18"/></geometry></collision></link>
  <joint name="j2" type="revolute">
    <parent link="l1"/><child link="l2"/><origin xyz="0 0 0.26"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/>MORE
  </joint>
  <link name="l2">INERTIA<collision><origin xyz="0 0 0.1"/><geometry><box size="0.03 0.03 0.18"/></geometry></collision></link>
  <joint name="j3" type="revolute">
    <parent link="l2"/><child link="l3"/><origin xyz="0 0 0.26" rpy="0.1 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>FOLLOWS
  </joint>
  <link name="l3">INERTIA<collision><origin xyz="0 0 0.1"/><geometry><sphere radius="0.03"/></geometry></collision></link>
  <joint name="tool" type="fixed"><parent link="l3"/><child link="tool0"/><origin xyz="0 0 0.25" rpy="0 -1.5707963267948966 0"/></joint>
  <link name="tool0"/>
  <transmission name="t"><joint name="j1"/></transmission>
</robot>"#;

const INERTIA: &str = "<inertial><mass value=\"1\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";

const BLOCK: &str = "v -0.1 -0.1 0\nv 0.1 -0.1 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

/// The package in a workspace; the path of its URDF.
fn write_arm(workspace: &Workspace, more: &str, follows: &str) -> std::path::PathBuf {
    workspace.write("src/arm_description/meshes/block.obj", BLOCK);
    let text = ARM.replace("INERTIA", INERTIA).replace("MORE", more).replace("FOLLOWS", follows);
    workspace.write("src/arm_description/urdf/arm.urdf", text)
}

const JOINTS: [&str; 3] = ["j1", "j2", "j3"];

#[test]
fn a_urdf_of_a_package_is_checked_and_mapped_as_it_is() {
    let workspace = Workspace::new();
    let path = write_arm(&workspace, "", "");
    let check =
        Program::new("robot").arg("check").arg(&path).option("--joints", "j1,j2,j3").option("--target", "tool0");
    let report = check.option("--samples", "500").read_json();
    let bodies: Vec<&str> =
        report["bodies"].as_array().expect("bodies").iter().filter_map(|body| body["name"].as_str()).collect();
    assert_eq!(bodies, ["base_link", "l1", "l2", "l3"]);
    assert_eq!(report["joints"][0]["limits"], serde_json::Value::Null);
    // By its bare name, from its own folder.
    let bare = Program::new("robot").current_dir(path.parent().expect("a folder")).arg("check").arg("arm.urdf");
    bare.option("--joints", "j1,j2,j3").option("--target", "tool0").option("--samples", "10").succeed();
    workspace.write(
        "map.toml",
        "product = \"reachability\"\n[robot]\nmodel = \"src/arm_description/urdf/arm.urdf\"\njoints = [\"j1\", \"j2\", \"j3\"]\n\
         target = \"tool0\"\n[poses]\nx = { from = 0.0, to = 0.6, step = 0.2 }\ny = { from = 0.0, to = 0.2, step = 0.2 }\n\
         z = { from = 0.4, to = 0.8, step = 0.2 }\nroll = 2\npitch = 2\nyaw = 2\n",
    );
    let map = workspace.run_job("map", "map").read_json();
    assert_eq!(map["samples"], 6, "{map}");
    Program::on("verify", workspace.path("map")).option("--regenerate", "2").succeed();
}

#[test]
fn links_are_targets_and_stand_where_mujoco_has_them() {
    let workspace = Workspace::new();
    let robot = open_robot(write_arm(&workspace, "", ""));
    let none = BTreeMap::new();
    let mut stream = Stream::of_job(1, b"urdf", "links");
    for target in ["tool0", "l3", "l2"] {
        let joints = if target == "l2" { &JOINTS[..2] } else { &JOINTS };
        let group = robot.planning_group(joints, target, &none).expect("a group");
        for _ in 0..50 {
            let q = random_values(&group, &mut stream);
            let values: Vec<(&str, f64)> = joints.iter().copied().zip(q.iter().copied()).collect();
            let theirs = robot.target_pose(target, &values).expect("a pose");
            assert!(max_difference(&group.forward(&q), &theirs) < 1e-12, "{target}");
        }
    }
    let error = robot.planning_group(&JOINTS, "tool1", &none).expect_err("no such link");
    let RobotError::NoTarget { present, .. } = &error else { panic!("{error}") };
    assert!(present.contains(&"tool0".to_owned()) && error.to_string().contains("name one of them"), "{error}");
    // The remedy works: each name that is listed is a target.
    for name in present.iter().filter(|name| *name != "world") {
        robot.resting_frame(name, &[], &none).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

#[test]
fn soft_limits_narrow_a_joint() {
    let workspace = Workspace::new();
    let limits = |more: &str| {
        let robot = open_robot(write_arm(&workspace, more, ""));
        let group = robot.planning_group(&JOINTS, "tool0", &BTreeMap::new()).expect("a group");
        let limits = group.joints()[1].limits.expect("limits");
        [limits.low, limits.high]
    };
    let safety = |low: &str, high: &str| {
        format!("<safety_controller soft_lower_limit=\"{low}\" soft_upper_limit=\"{high}\" k_velocity=\"1\"/>")
    };
    assert_eq!(limits(""), [-2.0, 2.0]);
    assert_eq!(limits(&safety("-1.5", "1.2")), [-1.5, 1.2]);
    assert_eq!(limits(&safety("-3", "1.2")), [-2.0, 1.2]);
    assert_eq!(limits("<safety_controller k_velocity=\"1\"/>"), [-2.0, 2.0]);
}

#[test]
fn a_joint_that_mimics_another_follows_it_where_both_stand_still() {
    let workspace = Workspace::new();
    let path = write_arm(&workspace, "", "<mimic joint=\"j2\" multiplier=\"0.5\" offset=\"0.1\"/>");
    let robot = open_robot(&path);
    // Part of a planning group it cannot be, nor what it follows.
    for joints in [&["j1", "j2"][..], &["j1", "j3"], &JOINTS] {
        let error = robot.planning_group(joints, "tool0", &BTreeMap::new()).expect_err("tied").to_string();
        assert!(
            error.contains("a joint of the planning group is one of the two")
                && error.contains("arm.urdf:16: <mimic joint=\"j2\""),
            "{error}"
        );
    }
    let fixed = BTreeMap::from([("j2".to_owned(), 0.6)]);
    let group = robot.planning_group(&["j1"], "tool0", &fixed).expect("a group");
    let theirs = robot.target_pose("tool0", &[("j1", 0.3), ("j2", 0.6), ("j3", 0.4)]).expect("a pose");
    assert!(max_difference(&group.forward(&[0.3]), &theirs) < 1e-12);
    let both = BTreeMap::from([("j2".to_owned(), 0.6), ("j3".to_owned(), 0.0)]);
    let error = robot.planning_group(&["j1"], "tool0", &both).expect_err("a contradiction").to_string();
    assert!(error.contains("joint \"j3\" is set to 0") && error.contains("sets it to 0.4"), "{error}");
}

/// A URDF has no place for `<exclude>`.
#[test]
fn pairs_of_a_urdf_are_excluded_in_its_mjcf() {
    let workspace = Workspace::new();
    let path = write_arm(&workspace, "", "");
    let text = workspace.read("src/arm_description/urdf/arm.urdf");
    let low = text.replacen(
        "<origin xyz=\"0 0 0.1\"/><geometry><cylinder",
        "<origin xyz=\"0 0 0.05\"/><geometry><cylinder",
        1,
    );
    assert_ne!(low, text);
    workspace.write("src/arm_description/urdf/arm.urdf", low);
    let check =
        Program::new("robot").arg("check").arg(&path).option("--joints", "j1,j2,j3").option("--target", "tool0");
    let told = check.option("--samples", "50").succeed().stdout;
    for words in ["after saving it as MJCF (docs/faq.md)", "<exclude body1=\"base_link\" body2=\"l1\"/>"] {
        assert!(told.contains(words), "{words} is not in\n{told}");
    }
}

#[test]
fn what_a_urdf_does_not_find_or_understand_is_named() {
    let workspace = Workspace::new();
    let path = write_arm(&workspace, "", "");
    let text = workspace.read("src/arm_description/urdf/arm.urdf");
    let refused = |from: &str, to: &str| {
        workspace.write("src/arm_description/urdf/arm.urdf", text.replacen(from, to, 1));
        RobotModel::open(&path).err().unwrap_or_else(|| panic!("{to} is taken")).to_string()
    };
    let gone = refused("package://arm_description/meshes/block.obj", "package://other_arm/meshes/block.obj");
    let place = "arm.urdf:6";
    assert!(
        gone.contains(place) && gone.contains("the package \"other_arm\"") && gone.contains("src/arm_description/urdf"),
        "{gone}"
    );
    // The remedy works: a path relative to the URDF's folder.
    workspace.write(
        "src/arm_description/urdf/arm.urdf",
        text.replacen("package://arm_description/meshes/block.obj", "../meshes/block.obj", 1),
    );
    open_robot(&path);
    for (unknown, element) in [
        ("<xacro:property name=\"a\" value=\"1\"/>", "<xacro:property name=\"a\" value=\"1\">"),
        ("<loop_joint link1=\"l1\" link2=\"l3\"/>", "<loop_joint"),
    ] {
        let error = refused("<transmission", &format!("{unknown}<transmission"));
        assert!(error.contains("arm.urdf:21") && error.contains(element) && error.contains("take it out"), "{error}");
    }
}

/// A gripper whose second finger follows the first.
const GRIPPER: &str = r#"<robot name="gripper">
  <link name="palm"><inertial><mass value="0.3"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 0.02"/><geometry><box size="0.06 0.1 0.04"/></geometry></collision></link>
  <link name="left"><inertial><mass value="0.05"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0.006 0.035"/><geometry><box size="0.02 0.012 0.06"/></geometry></collision></link>
  <link name="right"><inertial><mass value="0.05"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 -0.006 0.035"/><geometry><box size="0.02 0.012 0.06"/></geometry></collision></link>
  <joint name="left" type="prismatic"><parent link="palm"/><child link="left"/><origin xyz="0 0 0.042"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="20" velocity="0.1"/></joint>
  <joint name="right" type="prismatic"><parent link="palm"/><child link="right"/><origin xyz="0 0 0.042"/>
    <axis xyz="0 -1 0"/><limit lower="0" upper="0.04" effort="20" velocity="0.1"/><mimic joint="left"/></joint>
</robot>"#;

const GRIPPER_TABLE: &str = r#"approach = { body = "palm", position = [0.0, 0.0, 0.07], z = [0.0, 0.0, 1.0], x = [1.0, 0.0, 0.0] }
contacts = [
  { name = "left", body = "left", position = [0.0, 0.0, 0.05], normal = [0.0, -1.0, 0.0] },
  { name = "right", body = "right", position = [0.0, 0.0, 0.05], normal = [0.0, 1.0, 0.0] },
  { name = "root", body = "right", position = [0.0, 0.0, 0.03], normal = [0.0, 1.0, 0.0] },
]
width = ["left", "right"]
[[driven]]
joint = "left"
opened = 0.04
closed = 0.0
speed = 0.1
torque = 20
[eigengrasps]
origin = [0.02]
directions = [[1.0]]
"#;

/// The table is in body frames, which a URDF's links have; trials hold the object.
#[test]
fn a_hand_in_urdf_grasps() {
    let workspace = Workspace::new();
    let hand = workspace.write("gripper.urdf", GRIPPER);
    let table = workspace.write("gripper.toml", GRIPPER_TABLE);
    for path in [&hand, &table] {
        let report = Program::new("hand").arg("check").arg(path).option("--samples", "200").read_json();
        let uses = report["uses"].as_array().expect("uses");
        assert!(!uses.is_empty() && uses.iter().all(|usage| usage["refusal"].is_null()), "{report}");
        let followers = &report["driven"][0]["followers"];
        assert!(followers.to_string().contains("right"), "{report}");
    }
    workspace.write("meshes/box.off", off_of(&centred_block([0.02, 0.02, 0.03])));
    workspace.write(
        "job.toml",
        format!(
            "product = \"grasps\"\n[hand]\nmodel = \"gripper.urdf\"\n[[objects]]\nfolder = \"meshes\"\n[grasps]\nseeds = 1\n\
             sampler = \"antipodal\"\n[antipodal]\ndepth = \"any\"\npairs = 20\nbest = 1\n[physics]\n{NO_SPLIT}"
        ),
    );
    let run = workspace.run_job("job", "out").read_json();
    assert_eq!((&run["kept"], &run["facts"]["grasps_held"]), (&1.into(), &1.into()), "{run}");
}
