//! Robots: planning groups out of MJCF against MuJoCo's own forward kinematics, and the numeric solver on reachable poses.
#![cfg(feature = "sim")]

use std::{
    collections::{BTreeMap, BTreeSet},
    f64::consts::PI,
    fs,
    path::Path,
};

use graspmill::{
    assets::Description,
    collision::{Bodies, TouchTest},
    geom::{EndEffector, Pose, Shape, Triangles, World, rotation_from_rpy},
    kinematics::{Joint, PlanningGroup, SelfMotion, SixJointArm, SolverSettings, SphericalWristArm, solve_numeric},
    seed::Stream,
    sim::{RobotError, RobotModel},
};

use mujoco_rs::wrappers::{
    mj_data::MjData,
    mj_model::{MjModel, MjtObjBase, MjtSameFrame},
};
use nalgebra::{IsometryMatrix3, Rotation3};

mod fetch;

use fetch::ARM;

const SITE: &str = "wrist_roll_link";

fn fetch() -> RobotModel {
    RobotModel::open(Path::new("scenes/fetch.xml")).expect("the robot")
}

fn random_values(group: &PlanningGroup, stream: &mut Stream) -> Vec<f64> {
    let range = |joint: &Joint| joint.limits.map_or((-PI, PI), |limits| (limits.low, limits.high));
    group.joints().iter().map(range).map(|(low, high)| stream.uniform(low, high)).collect()
}

fn difference(a: &Pose<World, EndEffector>, b: &Pose<World, EndEffector>) -> f64 {
    a.to_rows().into_iter().zip(b.to_rows()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn fetch_has_the_numbers_of_its_public_description() {
    let group = fetch().planning_group(&ARM, SITE, &BTreeMap::new()).expect("the arm");
    let limits: Vec<_> =
        group.joints().iter().map(|joint| joint.limits.map(|limits| (limits.low, limits.high))).collect();
    let lift = Some((-1.221, 1.518));
    let (elbow, wrist) = (Some((-2.251, 2.251)), Some((-2.16, 2.16)));
    assert_eq!(limits, [Some((-1.6056, 1.6056)), lift, None, elbow, None, wrist, None]);
    // Stretched out along x: the sum of all offsets.
    let out = group.forward(&[0.0; 7]);
    let x = -0.086875 + 0.119525 + 0.117 + 0.219 + 0.133 + 0.197 + 0.1245 + 0.1385;
    let z = 0.37743 + 0.34858 + 0.06;
    assert!((out.translation() - nalgebra::Vector3::new(x, 0.0, z)).norm() < 1e-15, "{out:?}");
    // Lifting the torso lifts the arm and nothing else.
    let lifted = BTreeMap::from([("torso_lift_joint".to_owned(), 0.3)]);
    let lifted = fetch().planning_group(&ARM, SITE, &lifted).expect("the arm").forward(&[0.0; 7]);
    assert!((lifted.translation() - out.translation() - nalgebra::Vector3::z() * 0.3).norm() < 1e-15);
}

#[test]
fn forward_kinematics_is_mujocos() {
    let robot = fetch();
    let with_torso: Vec<&str> = ["torso_lift_joint"].into_iter().chain(ARM).collect();
    for joints in [&ARM[..], &with_torso] {
        let group = robot.planning_group(joints, SITE, &BTreeMap::new()).expect("a group");
        let mut stream = Stream::of_job(1, b"robots", "forward");
        let mut worst = 0.0f64;
        for _ in 0..500 {
            let q = random_values(&group, &mut stream);
            let values: Vec<_> = joints.iter().copied().zip(q.iter().copied()).collect();
            worst = worst.max(difference(&group.forward(&q), &robot.site_pose(SITE, &values).expect("a pose")));
        }
        println!("{} joints: at most {worst:.1e} from MuJoCo's", joints.len());
        assert!(worst <= 1e-12);
    }
}

/// Where MuJoCo has each geom at these joint values, beside where the links' frames put it: the largest difference of an
/// entry of the placements, and of a mesh's corners (which MuJoCo keeps in single precision).
fn geoms_against_mujoco(scene: &str, joints: &[&str], site: &str, fixed: &[(&str, f64)]) -> (f64, f64) {
    let robot = RobotModel::open(Path::new(scene)).expect("the robot");
    let still: BTreeMap<String, f64> = fixed.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let group = robot.planning_group(joints, site, &still).expect("a group");
    let bodies = robot.bodies(joints, &still).expect("bodies").bodies;
    let model = MjModel::from_xml(scene).expect("the robot");
    let mut data = MjData::new(&model);
    let mut frames = vec![IsometryMatrix3::identity(); joints.len()];
    let mut stream = Stream::of_job(1, scene.as_bytes(), "geoms");
    let (mut worst, mut worst_corner) = (0.0f64, 0.0f64);
    for _ in 0..50 {
        let q = random_values(&group, &mut stream);
        group.link_frames(&q, &mut frames);
        for (name, value) in joints.iter().copied().zip(q.iter().copied()).chain(fixed.iter().copied()) {
            let joint = model.name_to_id(MjtObjBase::mjOBJ_JOINT, name).expect("a joint");
            data.qpos_mut()[model.jnt_qposadr()[joint] as usize] = value;
        }
        data.forward();
        let mut seen = 0;
        for body in &bodies {
            let id = model.name_to_id(MjtObjBase::mjOBJ_BODY, &body.name).expect("a body");
            let geoms = (0..model.geom_bodyid().len()).filter(|geom| {
                model.geom_bodyid()[*geom] == id as i32
                    && model.geom_contype()[*geom] | model.geom_conaffinity()[*geom] != 0
            });
            let world_from_link = if body.link == 0 { IsometryMatrix3::identity() } else { frames[body.link - 1] };
            assert_eq!(geoms.clone().count(), body.geometries.len(), "{}", body.name);
            for (geom, geometry) in geoms.zip(&body.geometries) {
                seen += 1;
                let mut theirs = geom_in_world(&model, &data, geom);
                let ours = world_from_link * geometry.link_from_shape;
                if let Shape::Mesh(triangles) = &geometry.shape {
                    let mesh = model.geom_dataid()[geom] as usize;
                    let file_from_mesh = isometry(&model.mesh_pos()[mesh], turn(&model.mesh_quat()[mesh]));
                    theirs *= file_from_mesh.inverse();
                    worst_corner = worst_corner.max(corners_apart(&model, mesh, &file_from_mesh, triangles));
                }
                let apart = (ours.to_homogeneous() - theirs.to_homogeneous()).abs().max();
                assert!(apart <= 1e-12, "{}: {apart:e} apart: {ours:?} {theirs:?}", body.name);
                worst = worst.max(apart);
            }
        }
        assert!(seen > 0);
    }
    (worst, worst_corner)
}

fn isometry(place: &[f64; 3], turn: Rotation3<f64>) -> IsometryMatrix3<f64> {
    IsometryMatrix3::from_parts(nalgebra::Vector3::from(*place).into(), turn)
}

fn turn(quaternion: &[f64; 4]) -> Rotation3<f64> {
    let [w, x, y, z] = *quaternion;
    nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z)).to_rotation_matrix()
}

/// MuJoCo's own placement of a geom. Where the geom lies within a millionth of its body's frame of inertia, as meshes
/// do, MuJoCo takes that frame for it; then the body's placement and the geom's in it are what it compiled.
fn geom_in_world(model: &MjModel, data: &MjData<&MjModel>, geom: usize) -> IsometryMatrix3<f64> {
    let rows = |rows: &[f64; 9]| Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_row_slice(rows));
    let shortcut = isometry(&data.geom_xpos()[geom], rows(&data.geom_xmat()[geom]));
    let body = model.geom_bodyid()[geom] as usize;
    let whole = isometry(&data.xpos()[body], rows(&data.xmat()[body]))
        * isometry(&model.geom_pos()[geom], turn(&model.geom_quat()[geom]));
    let apart = (shortcut.to_homogeneous() - whole.to_homogeneous()).abs().max();
    let is_exact =
        [MjtSameFrame::mjSAMEFRAME_NONE, MjtSameFrame::mjSAMEFRAME_BODY].contains(&model.geom_sameframe()[geom]);
    assert!(apart <= if is_exact { 1e-12 } else { 2e-6 }, "{apart:e}");
    if is_exact { shortcut } else { whole }
}

/// The largest distance of a corner of a mesh's file from the nearest that MuJoCo has.
fn corners_apart(model: &MjModel, mesh: usize, file_from_mesh: &IsometryMatrix3<f64>, triangles: &Triangles) -> f64 {
    let first = model.mesh_vertadr()[mesh] as usize;
    let theirs: Vec<_> = model.mesh_vert()[first..first + model.mesh_vertnum()[mesh] as usize]
        .iter()
        .map(|corner| file_from_mesh * nalgebra::Point3::from(corner.map(f64::from)))
        .collect();
    let nearest = |corner: &nalgebra::Point3<f64>| {
        theirs.iter().map(|their| (corner - their).norm()).fold(f64::INFINITY, f64::min)
    };
    triangles.corners.iter().step_by(37).map(nearest).fold(0.0, f64::max)
}

#[test]
fn geoms_stand_where_mujoco_has_them() {
    let with_torso: Vec<&str> = ["torso_lift_joint"].into_iter().chain(ARM).collect();
    let tx60l = ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6"];
    let (worst, _) = geoms_against_mujoco("scenes/tx60l_table.xml", &tx60l, "hand", &[]);
    println!("scenes/tx60l_table.xml: placements {worst:.1e}");
    for scene in ["scenes/fetch.xml", "scenes/fetch_meshes.xml"] {
        for (joints, fixed) in [
            (&ARM[..], &[("torso_lift_joint", 0.3), ("r_gripper_finger_joint", 0.04), ("head_pan_joint", -0.7)][..]),
            (&with_torso, &[]),
        ] {
            let (worst, corner) = geoms_against_mujoco(scene, joints, SITE, fixed);
            println!("{scene}, {} joints: placements {worst:.1e}, corners {corner:.1e} m", joints.len());
            assert!(worst <= 1e-12 && corner <= 1e-7);
        }
    }
}

/// Pairs that the mesh Fetch checks (its maker's description, without those that are adjacent or can't meet).
const CHECKED: [(&str, &str); 13] = [
    ("base", "elbow_flex forearm_roll wrist_flex wrist_roll gripper r_gripper_finger l_gripper_finger"),
    ("bellows", "forearm_roll wrist_flex wrist_roll gripper r_gripper_finger l_gripper_finger"),
    ("bellows2", "elbow_flex forearm_roll wrist_flex wrist_roll gripper r_gripper_finger l_gripper_finger"),
    ("estop", "wrist_flex gripper l_gripper_finger"),
    ("laser", "elbow_flex forearm_roll wrist_flex wrist_roll gripper l_gripper_finger"),
    (
        "head_pan",
        "upperarm_roll elbow_flex forearm_roll wrist_flex wrist_roll gripper r_gripper_finger l_gripper_finger",
    ),
    (
        "head_tilt",
        "upperarm_roll elbow_flex forearm_roll wrist_flex wrist_roll gripper r_gripper_finger l_gripper_finger",
    ),
    (
        "torso_fixed",
        "upperarm_roll elbow_flex forearm_roll wrist_flex wrist_roll gripper r_gripper_finger l_gripper_finger",
    ),
    (
        "torso_lift",
        "shoulder_lift upperarm_roll elbow_flex forearm_roll wrist_flex wrist_roll gripper r_gripper_finger l_gripper_finger",
    ),
    ("l_wheel", "gripper"),
    ("r_wheel", "wrist_flex gripper r_gripper_finger l_gripper_finger"),
    ("shoulder_pan", "upperarm_roll wrist_roll gripper r_gripper_finger l_gripper_finger"),
    ("shoulder_lift", "gripper r_gripper_finger l_gripper_finger"),
];

fn pair_names(bodies: &Bodies) -> BTreeSet<[String; 2]> {
    let sorted = |pair: &[usize; 2]| {
        let mut names = pair.map(|place| bodies.bodies[place].name.replace("_link", ""));
        names.sort();
        names
    };
    bodies.pairs.iter().map(sorted).collect()
}

#[test]
fn the_fetch_checks_the_pairs_of_its_makers_description() {
    let none = BTreeMap::new();
    let primitives = open("scenes/fetch.xml").bodies(&ARM, &none).expect("bodies");
    assert_eq!(
        pair_names(&primitives),
        pair_names(&open("scenes/fetch_meshes.xml").bodies(&ARM, &none).expect("bodies"))
    );
    let bodies = open("scenes/fetch_meshes.xml").bodies(&ARM, &BTreeMap::new()).expect("bodies");
    let listed = CHECKED.iter().flat_map(|(one, others)| {
        others.split_whitespace().map(|other| {
            let mut names = [(*one).to_owned(), other.to_owned()];
            names.sort();
            names
        })
    });
    assert_eq!(pair_names(&bodies), listed.collect());
    assert_eq!(bodies.pairs.len(), 75);
    assert_eq!(bodies.bodies.len(), 21);
    let triangles = bodies.bodies.iter().flat_map(|body| &body.geometries).map(|geometry| match &geometry.shape {
        Shape::Mesh(mesh) => mesh.triangles.len(),
        _ => 0,
    });
    assert_eq!(triangles.sum::<usize>(), 34_504);
}

/// MuJoCo's rules for which bodies meet, one by one.
#[test]
fn pairs_follow_mujocos_rules() {
    let text = |options: &str, extra: &str| {
        format!(
            r#"<mujoco>{options}<worldbody><geom name="floor" type="box" size="1 1 0.1"/>
            <body name="seen"><geom size="0.1" contype="0" conaffinity="0"/></body>
            <body name="table"><geom size="0.1"/></body>
            <body name="a"><joint name="a" range="-1 1"/><geom size="0.1"/><geom size="0.1" contype="2" conaffinity="2"/>
              <body name="welded"><geom size="0.1"/>
              <body name="b"><joint name="b" range="-1 1"/><geom size="0.1"/>
              <body name="c"><joint name="c" range="-1 1"/><geom size="0.1"/></body></body></body></body>
            <body name="other"><joint name="other" range="-1 1"/><geom size="0.1" contype="4" conaffinity="2"/></body>
            </worldbody>{extra}</mujoco>"#
        )
    };
    let pairs = |joints: &[&str], options: &str, extra: &str| {
        let file = written(&text(options, extra));
        let bodies = open(file.path().to_str().expect("a path")).bodies(joints, &BTreeMap::new()).expect("bodies");
        let named = |place: usize| bodies.bodies[place].name.as_str();
        bodies.pairs.iter().map(|[a, b]| format!("{}-{}", named(*a), named(*b))).collect::<Vec<_>>().join(" ")
    };
    let world = "world-a world-welded world-b world-c table-a table-welded table-b table-c";
    let second = "a (contype 2, conaffinity 2)-other";
    assert_eq!(pairs(&["a", "b", "c"], "", ""), format!("{world} a-c {second} welded-c"));
    assert_eq!(pairs(&["b", "c"], "", ""), "world-b world-c table-b table-c a-c welded-c");
    let exclude = r#"<contact><exclude body1="c" body2="a"/><exclude body1="world" body2="b"/></contact>"#;
    assert_eq!(pairs(&["b", "c"], "", exclude), "world-c table-b table-c welded-c");
    let unfiltered = r#"<option><flag filterparent="disable"/></option>"#;
    assert_eq!(pairs(&["b", "c"], unfiltered, ""), "world-b world-c table-b table-c a-b a-c welded-b welded-c b-c");
}

#[test]
fn what_gives_no_bodies_says_why() {
    let none = BTreeMap::new();
    let refusal = |text: &str, joints: &[&str]| {
        let file = written(text);
        match RobotModel::open(file.path()) {
            Ok(robot) => robot.bodies(joints, &none).expect_err("refused"),
            Err(error) => error,
        }
    };
    let with = |geom: &str| {
        format!(
            r#"<mujoco><worldbody>{geom}<body name="b"><joint name="j" range="-1 1"/><geom size="0.1"/></body>
            <body><joint name="k" range="-1 1"/><geom size="0.1"/></body></worldbody></mujoco>"#
        )
    };
    let plane = refusal(&with(r#"<geom name="floor" type="plane" size="1 1 1"/>"#), &["j"]).to_string();
    assert!(plane.contains("geom \"floor\" of body \"world\" is a plane; use a box"), "{plane}");
    let ellipsoid = refusal(&with(r#"<geom type="ellipsoid" size="1 1 2"/>"#), &["j"]).to_string();
    assert!(ellipsoid.contains("geom 0, which has no name, of body \"world\" is an ellipsoid"), "{ellipsoid}");
    let branches = refusal(&with(""), &["j", "k"]).to_string();
    assert!(branches.contains("joint \"k\" does not hang on joint \"j\""), "{branches}");
    let pair = with(r#"<geom name="g" size="1"/><geom name="h" size="1"/>"#);
    let pair = pair.replace("</mujoco>", r#"<contact><pair geom1="g" geom2="h"/></contact></mujoco>"#);
    assert!(refusal(&pair, &["j"]).to_string().contains("<contact><exclude>"));
    let asset = |mesh: &str| {
        format!(
            r#"<mujoco><asset><mesh name="m" {mesh}/></asset><worldbody><body><joint name="j" range="-1 1"/>
            <geom name="part" type="mesh" mesh="m"/></body></worldbody></mujoco>"#
        )
    };
    let absent = refusal(&asset(r#"file="nowhere.stl""#), &["j"]);
    assert!(matches!(&absent, RobotError::Missing { file, .. } if file.ends_with("nowhere.stl")), "{absent}");
    assert!(absent.to_string().contains("check meshdir"), "{absent}");
    let fetched = refusal(&asset(r#"file=".deps/fetch/none.stl""#), &["j"]).to_string();
    assert!(fetched.contains(".deps/fetch/none.stl is not there; run `make robots`"), "{fetched}");
    let inline = refusal(&asset(r#"vertex="0 0 0 1 0 0 0 1 0 0 0 1""#), &["j"]).to_string();
    assert!(inline.contains("mesh \"m\" is in no file"), "{inline}");
    let fetch = fetch();
    let error = fetch.bodies(&["elbow"], &none).expect_err("no such joint").to_string();
    assert!(error.contains("elbow_flex_joint"), "{error}");
    // What hangs loose stands where it is put, unless it is asked to move.
    let loose = with(r#"<body name="cup" pos="1 2 3"><freejoint name="free"/><geom size="0.1"/></body>"#);
    let file = written(&loose);
    let bodies = open(file.path().to_str().expect("a path")).bodies(&["j"], &none).expect("bodies").bodies;
    assert_eq!((bodies[0].name.as_str(), bodies[0].link), ("cup", 0));
    assert_eq!(bodies[0].geometries[0].link_from_shape.translation.vector, nalgebra::Vector3::new(1.0, 2.0, 3.0));
    assert!(refusal(&loose, &["free"]).to_string().contains("is a free joint"));
}

/// MuJoCo's contacts between primitives, and ours: the same but where they are within a hair of touching.
#[test]
fn primitives_touch_where_mujoco_says() {
    let none = BTreeMap::new();
    let robot = fetch();
    let group = robot.planning_group(&ARM, SITE, &none).expect("a group");
    let bodies = robot.bodies(&ARM, &none).expect("bodies");
    let test = TouchTest::new(&bodies).expect("shapes");
    let mut worker = robot.contact_worker(&ARM, &none).expect("a worker");
    let mut frames = vec![IsometryMatrix3::identity(); 7];
    let mut stream = Stream::of_job(1, b"robots", "contacts");
    let (mut touching, mut doubtful) = (0, 0);
    for _ in 0..1000 {
        let q = random_values(&group, &mut stream);
        group.link_frames(&q, &mut frames);
        let theirs = worker.contacts(&q);
        for pair in &bodies.pairs {
            let their = theirs.iter().find(|contact| contact.bodies == *pair);
            let ours = test.touches(*pair, &frames);
            touching += u32::from(ours);
            if ours != their.is_some() {
                assert!(their.is_none_or(|contact| contact.distance > -1e-4), "{pair:?} {q:?} {their:?}");
                doubtful += 1;
            }
        }
    }
    println!("{touching} touch; {doubtful} differ");
    assert!(touching > 1000 && doubtful * 500 < touching);
}

#[test]
fn what_rests_is_free_or_named() {
    let none = BTreeMap::new();
    for scene in ["scenes/fetch.xml", "scenes/fetch_meshes.xml"] {
        open(scene).check_rest(&ARM, &none).unwrap_or_else(|error| panic!("{error}"));
    }
    let text = r#"<mujoco><worldbody><body name="post"><geom size="0.3" pos="0.4 0 0"/></body>
        <body name="a"><joint name="j" range="RANGE"/><geom size="0.2"/></body></worldbody>KEY</mujoco>"#;
    let rest = |range: &str, key: &str| {
        let file = written(
            &text.replace("RANGE", range).replace("KEY", key).replace("<joint", "<joint axis=\"0 0 1\" pos=\"0 1 0\""),
        );
        open(file.path().to_str().expect("a path")).check_rest(&["j"], &none)
    };
    let error = rest("-60 60", "").expect_err("it touches").to_string();
    assert!(
        error.contains("\"post\" touches \"a\" at rest") && error.contains("<exclude body1=\"post\" body2=\"a\"/>"),
        "{error}"
    );
    // Brought within its limits, or to where the keyframe `home` has it.
    rest("-60 -50", "").expect("free");
    rest("-60 60", r#"<keyframe><key name="home" qpos="-1"/></keyframe>"#).expect("free");
}

#[test]
fn a_robots_digest_is_its_content() {
    let folder = tempfile::tempdir().expect("a folder");
    let digest = |place: &str, arm: &str, corner: &str, seen: &str| {
        let folder = folder.path().join(place);
        fs::create_dir_all(folder.join("parts")).expect("a folder");
        let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
        write(
            "arm.xml",
            &format!(
                "<mujoco><worldbody><body><joint name='j' range='-1 1'/><site name='s'/>{arm}</body></worldbody></mujoco>"
            ),
        );
        let obj = |corner: &str| format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv {corner}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
        write("parts/hit.obj", &obj(corner));
        write("parts/seen.obj", &obj(seen));
        write(
            "robot.xml",
            r#"<mujoco><compiler meshdir="parts"/><asset><mesh file="hit.obj"/><mesh file="seen.obj"/></asset>
            <include file="arm.xml"/></mujoco>"#,
        );
        let path = folder.join("robot.xml");
        let done = std::process::Command::new(env!("CARGO_BIN_EXE_graspmill"))
            .args(["robot", "check", "--json", "--joints", "j", "--target", "s", "--samples", "10"])
            .arg(&path)
            .output()
            .expect("graspmill starts");
        let report: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
        let printed = report["digest"].as_str().expect("a digest").to_owned();
        // What a dataset calls the robot.
        assert_eq!(printed, Description::read(&path).expect("the description").digest.to_string());
        printed
    };
    let arm = "<geom type='mesh' mesh='hit'/><geom type='mesh' mesh='seen' contype='0' conaffinity='0'/>";
    let one = digest("one", arm, "0 0 1", "0 0 1");
    assert_eq!(digest("two", arm, "0 0 1", "0 0 1"), one);
    assert_ne!(digest("seen", arm, "0 0 1", "0 0 2"), one);
    assert_ne!(digest("mesh", arm, "0 0 1.5", "0 0 1"), one);
    assert_ne!(digest("arm", &format!("{arm}<geom size='0.1'/>"), "0 0 1", "0 0 1"), one);
}

/// The command, on a robot with a pair of each sort.
#[test]
fn robot_check_sorts_the_pairs() {
    let text = r#"<mujoco><worldbody><geom name="far" type="box" pos="0 0 9" size="1 1 1"/>
        <body name="post"><geom size="0.1" pos="0.5 0 0"/></body>
        <body name="a"><joint name="j" axis="0 0 1" range="-170 170"/><geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.05"/>
          <body name="b" pos="0.3 0 0"><joint name="k" axis="0 0 1" range="-90 90"/>
          <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.05"/><site name="tip" pos="0.2 0 0"/>
            <body name="c"><joint name="l" axis="0 0 1" range="-1 1"/><geom size="0.06"/></body></body></body>
        <body name="collar"><geom size="0.06"/></body></worldbody></mujoco>"#;
    let file = written(text);
    let path = file.path().to_str().expect("a path");
    let run = |arguments: &[&str]| {
        let program = env!("CARGO_BIN_EXE_graspmill");
        std::process::Command::new(program).args(["robot", "check"]).args(arguments).output().expect("graspmill starts")
    };
    let output = run(&[path, "--joints", "j,k", "--target", "tip", "--samples", "500", "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let of = |one: &str, other: &str| {
        let pairs = report["pairs"].as_array().expect("pairs");
        let pair = pairs.iter().find(|pair| pair["bodies"] == serde_json::json!([one, other])).expect("the pair");
        (pair["rule"].as_str().expect("a rule").to_owned(), pair["touches"].as_u64().expect("a count"))
    };
    assert_eq!(of("a", "b").0, "adjacent");
    assert_eq!(of("a", "collar"), ("checked".to_owned(), 500));
    assert_eq!(of("world", "a"), ("checked".to_owned(), 0));
    assert!((1..500).contains(&of("post", "b").1));
    let exclude = report["exclude"].as_array().expect("lines");
    assert!(exclude.contains(&r#"<exclude body1="a" body2="collar"/>"#.into()), "{exclude:?}");
    assert!(!exclude.iter().any(|line| line.as_str().expect("a line").contains("post\" body2=\"b")));
    assert!(report["no_closed_form"].as_str().expect("a reason").contains("2 joints"));
    assert_eq!(report["touch_at_rest"][0], serde_json::json!(["post", "b"]));
    // The same for people, and the same again.
    let plain = |_| run(&[path, "--joints", "j,k", "--target", "tip", "--samples", "500"]).stdout;
    let [once, again] = [0, 1].map(plain);
    assert_eq!(once, again);
    let plain = String::from_utf8(once).expect("text");
    for words in ["always touch: 2", "a - collar", "touch sometimes", "at rest these touch", "moved by j"] {
        assert!(plain.contains(words), "{words}: {plain}");
    }
    for (arguments, words) in [
        ([path, "--joints", "j,k", "--target", "top"], "no site is named"),
        ([path, "--joints", "j,m", "--target", "tip"], "no joint is named"),
        ([path, "--joints", "j", "--target=tip", "--fixed=k"], "--fixed k: give a joint and its value"),
    ] {
        let output = run(&arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && said.contains(words), "{said}");
    }
}

/// A description in a file of its own.
fn written(text: &str) -> tempfile::NamedTempFile {
    let file = tempfile::NamedTempFile::with_suffix(".xml").expect("a file");
    fs::write(file.path(), text).expect("written");
    file
}

fn open(scene: &str) -> RobotModel {
    RobotModel::open(Path::new(scene)).unwrap_or_else(|error| panic!("{error}"))
}

/// Anchors off the origin, several joints in a body, a reference angle, turned bodies and sites, slides.
#[test]
fn odd_descriptions_are_read_as_mujoco_reads_them() {
    let file = tempfile::NamedTempFile::with_suffix(".xml").expect("a file");
    let text = r#"<mujoco><compiler angle="radian"/><worldbody><body name="a" pos="0.1 0.2 0.3" euler="0.3 -0.2 0.9">
        <joint name="one" axis="0.2 1 0.3" pos="0.05 0 0.1" range="-2 2" ref="0.4"/><geom size="0.1"/>
        <joint name="two" type="slide" axis="1 1 0" pos="0 0.3 0" range="-0.2 0.5"/>
        <body pos="0 0 0.4" quat="0.9 0.1 -0.3 0.2"><joint name="three" axis="1 0 0.5" pos="-0.1 0.1 0"/><geom size="0.1"/>
        <body pos="0.2 0 0"><joint name="still" axis="0 1 0" ref="0.1"/><geom size="0.1"/>
        <site name="tool" pos="0.1 0 -0.2" euler="1 2 3"/></body></body></body></worldbody></mujoco>"#;
    fs::write(file.path(), text).expect("written");
    let robot = RobotModel::open(file.path()).expect("a robot");
    let joints = ["one", "two", "three"];
    let fixed = BTreeMap::from([("still".to_owned(), 0.7)]);
    let group = robot.planning_group(&joints, "tool", &fixed).expect("a group");
    let mut stream = Stream::of_job(1, b"robots", "odd");
    for _ in 0..100 {
        let q = random_values(&group, &mut stream);
        let values: Vec<_> = joints.iter().copied().zip(q.iter().copied()).chain([("still", 0.7)]).collect();
        let theirs = robot.site_pose("tool", &values).expect("a pose");
        assert!(difference(&group.forward(&q), &theirs) <= 1e-12);
    }
}

#[test]
fn the_jacobian_is_the_slope_of_forward_kinematics() {
    let with_torso: Vec<&str> = ["torso_lift_joint"].into_iter().chain(ARM).collect();
    let group = fetch().planning_group(&with_torso, SITE, &BTreeMap::new()).expect("a group");
    let mut stream = Stream::of_job(1, b"robots", "jacobian");
    for _ in 0..20 {
        let q = random_values(&group, &mut stream);
        let (pose, jacobian) = group.forward_and_jacobian(&q);
        assert!(difference(&pose, &group.forward(&q)) == 0.0);
        for joint in 0..group.len() {
            let step = 1e-6;
            let at = |offset: f64| {
                let mut q = q.clone();
                q[joint] += offset;
                group.forward(&q)
            };
            let (before, after) = (at(-step), at(step));
            let moves = (after.translation() - before.translation()) / (2.0 * step);
            let spin = (after.rotation().matrix() - before.rotation().matrix()) / (2.0 * step)
                * pose.rotation().matrix().transpose();
            let turns = nalgebra::Vector3::new(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]);
            assert!((moves - jacobian.fixed_view::<3, 1>(0, joint)).norm() < 1e-8);
            assert!((turns - jacobian.fixed_view::<3, 1>(3, joint)).norm() < 1e-8);
        }
    }
}

/// Poses that the arm can have: twenty starts find joint values for nearly all, and what is found is right.
#[test]
fn the_numeric_solver_finds_poses_that_the_arm_has() {
    let group = fetch().planning_group(&ARM, SITE, &BTreeMap::new()).expect("a group");
    let mut stream = Stream::of_job(1, b"robots", "numeric");
    let settings = SolverSettings::default();
    let (mut found, mut starts) = (0, 0);
    for _ in 0..200 {
        let target = group.forward(&random_values(&group, &mut stream));
        let solution = (0..20).find_map(|_| {
            starts += 1;
            solve_numeric(&group, &target, &random_values(&group, &mut stream), &settings)
        });
        if let Some(solution) = solution {
            assert!(group.within_limits(&solution.q));
            assert!(difference(&group.forward(&solution.q), &target) < 1e-8);
            found += 1;
        }
    }
    println!("{found} of 200 found, {:.1} starts each", f64::from(starts) / 200.0);
    assert!(found >= 195, "{found} of 200");
}

/// Given the first joint of a pose that the arm has, the values that made the pose are among those found, and every set
/// found makes the pose.
#[test]
fn the_closed_form_finds_every_way_to_a_pose() {
    let group = fetch().planning_group(&ARM, SITE, &BTreeMap::new()).expect("a group");
    let arm = SphericalWristArm::recognise(&group).expect("a closed form");
    let mut stream = Stream::of_job(1, b"robots", "closed form");
    let (mut worst, mut ways) = (0.0f64, [0; 9]);
    for _ in 0..20_000 {
        let q = random_values(&group, &mut stream);
        let target = group.forward(&q);
        let found: Vec<_> = arm.branches(&target, q[0]).into_iter().flatten().collect();
        ways[found.len()] += 1;
        let away = |way: &[f64; 7]| way.iter().zip(&q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let nearest = found.iter().map(away).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-5, "{q:?} is {nearest} from the nearest of {found:?}");
        for way in &found {
            assert!(group.within_limits(way));
            worst = worst.max(difference(&group.forward(way), &target));
        }
    }
    println!("{ways:?} poses with 0 to 8 ways; at most {worst:.1e} off");
    assert!(worst < 1e-6 && ways[0] == 0 && ways[8] > 0);
}

/// What the numeric solver finds, the closed form finds too: nothing is missed.
#[test]
fn the_closed_form_misses_nothing_that_the_numeric_solver_finds() {
    let group = fetch().planning_group(&ARM, SITE, &BTreeMap::new()).expect("a group");
    let arm = SphericalWristArm::recognise(&group).expect("a closed form");
    let mut stream = Stream::of_job(1, b"robots", "against numeric");
    let mut solved = 0;
    for _ in 0..400 {
        let target = group.forward(&random_values(&group, &mut stream));
        let start = random_values(&group, &mut stream);
        let Some(solution) = solve_numeric(&group, &target, &start, &SolverSettings::default()) else { continue };
        // On a limit the numeric solution's own error decides on which side the exact one lies.
        let limits = group.joints().iter().zip(&solution.q);
        let inside = |(joint, value): (&Joint, &f64)| {
            joint.limits.is_none_or(|limits| *value > limits.low + 1e-6 && *value < limits.high - 1e-6)
        };
        if limits.into_iter().all(inside) {
            assert!(arm.branches(&target, solution.q[0]).iter().any(Option::is_some), "{:?}", solution.q);
            solved += 1;
        }
    }
    println!("{solved} poses");
    assert!(solved > 100, "{solved}");
}

/// A pose of the thesis's grid (section 7.2): 12 x 22 x 20 places, step 0.1 m, and 2 x 8 x 8 orientations.
fn grid_pose(cell: usize) -> Pose<World, EndEffector> {
    let (x, y, z) = (cell / 56_320, cell / 2_560 % 22, cell / 128 % 20);
    let (roll, pitch, yaw) = (cell / 64 % 2, cell / 8 % 8, cell % 8);
    let place = nalgebra::Vector3::new(0.1 * x as f64, -1.1 + 0.1 * y as f64, 0.1 * z as f64);
    let angle = |index: usize, step: f64| -PI + step * index as f64;
    let turn = rotation_from_rpy(angle(roll, PI), angle(pitch, PI / 4.0), angle(yaw, PI / 4.0));
    Pose::new(turn, place)
}

/// Poses of the grid by end points and by ten thousand values of the first joint: the dense search finds nothing that the
/// end points have missed, and every way is one.
#[test]
fn the_exact_test_misses_nothing_that_a_dense_search_finds() {
    let group = fetch().planning_group(&ARM, SITE, &BTreeMap::new()).expect("a group");
    let test = SelfMotion::new(&group).expect("the Fetch's arm");
    let mut stream = Stream::of_job(1, b"robots", "reach");
    let (mut both, mut exact_only) = (0, 0);
    for _ in 0..600 {
        let target = grid_pose(stream.below(675_840) as usize);
        let way = test.find(&target);
        if let Some(way) = &way {
            assert!(group.within_limits(way));
            assert!(difference(&group.forward(way), &target) < 1e-6);
        }
        let dense = (0..10_000).any(|step| {
            let first = -1.6056 + 3.2112 * (f64::from(step) + 0.5) / 10_000.0;
            test.arm().branches(&target, first).iter().any(Option::is_some)
        });
        assert!(way.is_some() || !dense, "{target:?}");
        both += u32::from(dense);
        exact_only += u32::from(way.is_some() && !dense);
    }
    println!("{both} of 600 reachable, {exact_only} by the exact test alone");
    assert!(both > 60);
}

/// The whole grid without collisions. An independent recount gave about 119,100.
#[test]
fn the_grid_of_the_thesis_without_collisions() {
    let group = fetch().planning_group(&ARM, SITE, &BTreeMap::new()).expect("a group");
    let test = SelfMotion::new(&group).expect("the Fetch's arm");
    let began = std::time::Instant::now();
    let reachable = (0..675_840).filter(|cell| test.find(&grid_pose(*cell)).is_some()).count();
    println!("{reachable} of 675,840 in {:.1} s", began.elapsed().as_secs_f64());
    assert!((119_050..119_150).contains(&reachable), "{reachable}");
    // The same by what they ask of the wrist: 26 directions, each of several rotations.
    let mut directions: Vec<(nalgebra::Vector3<f64>, Vec<usize>)> = Vec::new();
    for turn in 0..128 {
        let ahead = test.wrist(&grid_pose(turn)).ahead;
        match directions.iter_mut().find(|(other, _)| (other - ahead).norm() < 1e-9) {
            Some((_, turns)) => turns.push(turn),
            None => directions.push((ahead, vec![turn])),
        }
    }
    assert_eq!(directions.len(), 26);
    let began = std::time::Instant::now();
    let mut ends = Vec::new();
    let mut by_direction = 0;
    for place in 0..5280 {
        for (_, turns) in &directions {
            let wrist = test.wrist(&grid_pose(128 * place + turns[0]));
            by_direction += usize::from(test.first_value(&wrist, &mut ends).is_some()) * turns.len();
        }
    }
    println!("{by_direction} of 675,840 in {:.3} s", began.elapsed().as_secs_f64());
    assert_eq!(by_direction, reachable);
}

#[test]
fn arms_without_a_closed_form_are_told_why() {
    let with_torso: Vec<&str> = ["torso_lift_joint"].into_iter().chain(ARM[1..].iter().copied()).collect();
    let none = BTreeMap::new();
    let group = |joints: &[&str]| fetch().planning_group(joints, SITE, &none).expect("a group");
    let why = |joints: &[&str]| SphericalWristArm::recognise(&group(joints)).expect_err("none").to_string();
    assert!(why(&ARM[1..]).contains("6 joints"));
    assert!(why(&with_torso).contains("\"torso_lift_joint\" slides"));
    let text = fs::read_to_string("scenes/fetch.xml").expect("the robot");
    let file = tempfile::NamedTempFile::with_suffix(".xml").expect("a file");
    let moved = r#"<body name="wrist_flex_link" pos="0.1245 0 0.01">"#;
    fs::write(file.path(), text.replace(r#"<body name="wrist_flex_link" pos="0.1245 0 0">"#, moved)).expect("written");
    let offset = RobotModel::open(file.path()).expect("a robot").planning_group(&ARM, SITE, &none).expect("a group");
    let error = SphericalWristArm::recognise(&offset).expect_err("an offset wrist").to_string();
    assert!(error.contains("wrist_flex_joint") && error.contains("meet at the wrist"), "{error}");
}

#[test]
fn what_gives_no_group_says_why() {
    let robot = fetch();
    let none = BTreeMap::new();
    let error = robot.planning_group(&ARM, "tool", &none).expect_err("no such site");
    assert!(matches!(&error, RobotError::NoSite { present, .. } if present == &[SITE]), "{error}");
    assert!(error.to_string().contains("<site name=\"tool\"/>"), "{error}");
    let error = robot.planning_group(&["elbow"], SITE, &none).expect_err("no such joint").to_string();
    assert!(error.contains("elbow_flex_joint"), "{error}");
    let error = robot.planning_group(&["head_pan_joint"], SITE, &none).expect_err("not on the way").to_string();
    assert!(error.contains("does not move") && error.contains("shoulder_pan_joint"), "{error}");
    let error = robot.planning_group(&[], SITE, &none).expect_err("no joints").to_string();
    assert!(error.contains("needs a joint"), "{error}");
    let error = RobotModel::open(Path::new("scenes/none.xml")).err().expect("no such file");
    assert!(matches!(error, RobotError::Refused { .. }), "{error}");
    let file = tempfile::NamedTempFile::with_suffix(".xml").expect("a file");
    let text = r#"<mujoco><worldbody><body><joint name="s" type="slide"/><geom size="0.1"/><site name="t"/></body>
        <body><freejoint name="f"/><geom size="0.1"/><site name="u"/></body></worldbody></mujoco>"#;
    fs::write(file.path(), text).expect("written");
    let robot = RobotModel::open(file.path()).expect("a robot");
    let error = robot.planning_group(&["s"], "t", &none).expect_err("no range").to_string();
    assert!(error.contains("range=\"LOW HIGH\""), "{error}");
    let error = robot.planning_group(&["f"], "u", &none).expect_err("a free joint").to_string();
    assert!(error.contains("is a free joint"), "{error}");
}

/// The six-joint arm: of random configurations every one's own joint values are found again, up to whole turns, and every
/// way found makes the pose.
#[test]
fn six_joints_have_every_way_in_closed_form() {
    let robot = RobotModel::open(Path::new("scenes/tx60l_table.xml")).expect("the cell");
    let joints: Vec<String> = (1..=6).map(|joint| format!("joint_{joint}")).collect();
    let joints: Vec<&str> = joints.iter().map(String::as_str).collect();
    let group = robot.planning_group(&joints, "hand", &BTreeMap::new()).expect("a group");
    let arm = SixJointArm::recognise(&group).expect("a closed form");
    let mut stream = Stream::of_job(1, b"robots", "six joints");
    let (mut worst, mut counts) = (0.0f64, [0; 9]);
    for _ in 0..20_000 {
        let q = random_values(&group, &mut stream);
        let target = group.forward(&q);
        let found = arm.ways(&target);
        counts[found.ways.len()] += 1;
        let turned = |a: f64, b: f64| (a - b - 2.0 * PI * ((a - b) / (2.0 * PI)).round()).abs();
        let away = |way: &[f64; 6]| way.iter().zip(&q).map(|(a, b)| turned(*a, *b)).fold(0.0, f64::max);
        let nearest = found.ways.iter().map(away).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-5, "{q:?} is {nearest} from the nearest of {:?}", found.ways);
        for way in &found.ways {
            assert!(group.within_limits(way));
            worst = worst.max(difference(&group.forward(way), &target));
        }
    }
    println!("{counts:?} poses with 0 to 8 ways; at most {worst:.1e} off");
    assert!(worst < 1e-6 && counts[0] == 0 && counts[8] > 0);
}
