//! Descriptions of robots: geoms and pairs against MuJoCo's own, what is refused, and `robot check`.

use std::collections::{BTreeMap, BTreeSet};

use graspmill::{
    collision::{Bodies, CollisionChecker},
    description::Description,
    geom::{Shape, Triangles},
    seed::Stream,
    sim::{Collidable, RobotError, RobotModel},
};
use mujoco_rs::wrappers::{
    mj_data::MjData,
    mj_model::{MjModel, MjtObjBase, MjtSameFrame},
};
use nalgebra::{IsometryMatrix3, Matrix3, Point3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use serde_json::json;

use crate::robot::write_scene;
use crate::support::{
    program::Program,
    robots::{FETCH, FETCH_ARM, FETCH_MESHES, FETCH_SITE, TX60L, TX60L_JOINTS, TX60L_SITE, open_robot, random_values},
    touch_test::TouchTest,
    workspace::Workspace,
};

/// Compares where MuJoCo has each geom at random joint values with where the links' frames put it: the largest difference of
/// an entry of the poses, and of a mesh's corners (which MuJoCo keeps in single precision).
fn compare_geoms(scene: &str, joints: &[&str], site: &str, fixed: &[(&str, f64)]) -> (f64, f64) {
    let robot = open_robot(scene);
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
                    let file_from_mesh = isometry(&model.mesh_pos()[mesh], rotation(&model.mesh_quat()[mesh]));
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

fn isometry(position: &[f64; 3], rotation: Rotation3<f64>) -> IsometryMatrix3<f64> {
    IsometryMatrix3::from_parts(Vector3::from(*position).into(), rotation)
}

fn rotation(quaternion: &[f64; 4]) -> Rotation3<f64> {
    let [w, x, y, z] = *quaternion;
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)).to_rotation_matrix()
}

/// MuJoCo's own placement of a geom. Where the geom lies within a millionth of its body's frame of inertia, as meshes
/// do, MuJoCo takes that frame for it; then the body's placement and the geom's in it are what it compiled.
fn geom_in_world(model: &MjModel, data: &MjData<&MjModel>, geom: usize) -> IsometryMatrix3<f64> {
    let rows = |rows: &[f64; 9]| Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(rows));
    let shortcut = isometry(&data.geom_xpos()[geom], rows(&data.geom_xmat()[geom]));
    let body = model.geom_bodyid()[geom] as usize;
    let whole = isometry(&data.xpos()[body], rows(&data.xmat()[body]))
        * isometry(&model.geom_pos()[geom], rotation(&model.geom_quat()[geom]));
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
        .map(|corner| file_from_mesh * Point3::from(corner.map(f64::from)))
        .collect();
    let nearest =
        |corner: &Point3<f64>| theirs.iter().map(|their| (corner - their).norm()).fold(f64::INFINITY, f64::min);
    triangles.corners.iter().step_by(37).map(nearest).fold(0.0, f64::max)
}

#[test]
fn geoms_stand_where_mujoco_has_them() {
    let with_torso: Vec<&str> = ["torso_lift_joint"].into_iter().chain(FETCH_ARM).collect();
    let (worst, _) = compare_geoms(TX60L, &TX60L_JOINTS, TX60L_SITE, &[]);
    println!("{TX60L}: poses {worst:.1e}");
    for scene in [FETCH, FETCH_MESHES] {
        for (joints, fixed) in [
            (
                &FETCH_ARM[..],
                &[("torso_lift_joint", 0.3), ("r_gripper_finger_joint", 0.04), ("head_pan_joint", -0.7)][..],
            ),
            (&with_torso, &[]),
        ] {
            let (worst, corner) = compare_geoms(scene, joints, FETCH_SITE, fixed);
            println!("{scene}, {} joints: poses {worst:.1e}, corners {corner:.1e} m", joints.len());
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
        let mut names = pair.map(|body| bodies.bodies[body].name.replace("_link", ""));
        names.sort();
        names
    };
    bodies.pairs.iter().map(sorted).collect()
}

#[test]
fn the_fetch_checks_the_pairs_of_its_makers_description() {
    let none = BTreeMap::new();
    let primitives = open_robot(FETCH).bodies(&FETCH_ARM, &none).expect("bodies");
    assert_eq!(
        pair_names(&primitives),
        pair_names(&open_robot(FETCH_MESHES).bodies(&FETCH_ARM, &none).expect("bodies"))
    );
    let bodies = open_robot(FETCH_MESHES).bodies(&FETCH_ARM, &BTreeMap::new()).expect("bodies");
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
        let file = write_scene(&text(options, extra));
        let bodies = open_robot(file.path()).bodies(joints, &BTreeMap::new()).expect("bodies");
        let named = |body: usize| bodies.bodies[body].name.as_str();
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
        let file = write_scene(text);
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
    let fetch = open_robot(FETCH);
    let error = fetch.bodies(&["elbow"], &none).expect_err("no such joint").to_string();
    assert!(error.contains("elbow_flex_joint"), "{error}");
    // Loose bodies keep their pose, unless they are requested to move.
    let loose = with(r#"<body name="cup" pos="1 2 3"><freejoint name="free"/><geom size="0.1"/></body>"#);
    let file = write_scene(&loose);
    let bodies = open_robot(file.path()).bodies(&["j"], &none).expect("bodies").bodies;
    assert_eq!((bodies[0].name.as_str(), bodies[0].link), ("cup", 0));
    assert_eq!(bodies[0].geometries[0].link_from_shape.translation.vector, Vector3::new(1.0, 2.0, 3.0));
    assert!(refusal(&loose, &["free"]).to_string().contains("is a free joint"));
}

/// MuJoCo's contacts between primitives, and ours: the same but where they are within a hair of touching.
#[test]
fn primitives_touch_where_mujoco_says() {
    let none = BTreeMap::new();
    let robot = open_robot(FETCH);
    let group = robot.planning_group(&FETCH_ARM, FETCH_SITE, &none).expect("a group");
    let bodies = robot.bodies(&FETCH_ARM, &none).expect("bodies");
    let test = TouchTest::new(&bodies).expect("shapes");
    let mut worker = robot.contact_worker(&FETCH_ARM, &none).expect("a worker");
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

/// Whether the robot is free of contacts at rest, by the test of maps.
fn check_rest(robot: &RobotModel, joints: &[&str]) -> Result<(), RobotError> {
    let Collidable { bodies, rest, .. } = robot.collidable(joints, &BTreeMap::new()).expect("bodies");
    let group = robot.planning_group(joints, "s", &BTreeMap::new());
    let group = group.or_else(|_| robot.planning_group(joints, FETCH_SITE, &BTreeMap::new())).expect("a group");
    let mut links = vec![IsometryMatrix3::identity(); joints.len() + 1];
    group.link_frames(&rest, &mut links[1..]);
    let checker = CollisionChecker::new(&bodies).expect("shapes");
    match bodies.pairs.iter().enumerate().find(|(index, _)| checker.pair(*index, &links)) {
        Some((_, pair)) => Err(robot.touching_at_rest(&bodies, *pair)),
        None => Ok(()),
    }
}

#[test]
fn what_rests_is_free_or_named() {
    for scene in [FETCH, FETCH_MESHES] {
        check_rest(&open_robot(scene), &FETCH_ARM).unwrap_or_else(|error| panic!("{error}"));
    }
    let text = r#"<mujoco><worldbody><body name="post"><geom size="0.3" pos="0.4 0 0"/></body>
        <body name="a"><joint name="j" range="RANGE"/><geom size="0.2"/><site name="s"/></body></worldbody>KEY</mujoco>"#;
    let rest = |range: &str, key: &str| {
        let text = text.replace("<joint", "<joint axis=\"0 0 1\" pos=\"0 1 0\"");
        let file = write_scene(&text.replace("RANGE", range).replace("KEY", key));
        check_rest(&open_robot(file.path()), &["j"])
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
    let workspace = Workspace::new();
    let digest = |folder: &str, arm: &str, corner: &str, seen: &str| {
        let write = |name: &str, text: &str| workspace.write(format!("{folder}/{name}"), text);
        let joint = "<joint name='j' range='-1 1'/><site name='s'/>";
        write("arm.xml", &format!("<mujoco><worldbody><body>{joint}{arm}</body></worldbody></mujoco>"));
        let obj = |corner: &str| format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv {corner}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
        write("parts/hit.obj", &obj(corner));
        write("parts/seen.obj", &obj(seen));
        let path = write(
            "robot.xml",
            r#"<mujoco><compiler meshdir="parts"/><asset><mesh file="hit.obj"/><mesh file="seen.obj"/></asset>
            <include file="arm.xml"/></mujoco>"#,
        );
        let check = Program::new("robot").args(["check", "--joints", "j", "--target", "s", "--samples", "10"]);
        let report = check.arg(&path).read_json();
        let printed = report["digest"].as_str().expect("a digest").to_owned();
        // A dataset names the robot by it.
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
    let file = write_scene(text);
    let check = |arguments: &[&str]| Program::new("robot").arg("check").arg(file.path()).args(arguments);
    let asked = ["--joints", "j,k", "--target", "tip", "--samples", "500"];
    let report = check(&asked).read_json();
    let of = |one: &str, other: &str| {
        let pairs = report["pairs"].as_array().expect("pairs");
        let pair = pairs.iter().find(|pair| pair["bodies"] == json!([one, other])).expect("the pair");
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
    assert_eq!(report["touch_at_rest"][0], json!(["post", "b"]));
    // The same for people, and the same again.
    let [plain, again] = [0, 1].map(|_| check(&asked).finish().stdout);
    assert_eq!(plain, again);
    for words in ["always touch: 2", "a - collar", "sometimes touch", "at rest, these bodies touch", "moved by j"] {
        assert!(plain.contains(words), "{words}: {plain}");
    }
    for (arguments, words) in [
        (["--joints", "j,k", "--target", "top"], "no site or body is named"),
        (["--joints", "j,m", "--target", "tip"], "no joint is named"),
        (["--joints", "j", "--target=tip", "--fixed=k"], "--fixed k: give a joint and its value"),
    ] {
        let said = check(&arguments).expect_code(2).stderr;
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn what_gives_no_group_says_why() {
    let robot = open_robot(FETCH);
    let none = BTreeMap::new();
    let error = robot.planning_group(&FETCH_ARM, "tool", &none).expect_err("no such site");
    assert!(matches!(&error, RobotError::NoTarget { present, .. } if present[..2] == [FETCH_SITE, "world"]), "{error}");
    assert!(error.to_string().contains("<site name=\"tool\"/>"), "{error}");
    let error = robot.planning_group(&["elbow"], FETCH_SITE, &none).expect_err("no such joint").to_string();
    assert!(error.contains("elbow_flex_joint"), "{error}");
    let error = robot.planning_group(&["head_pan_joint"], FETCH_SITE, &none).expect_err("not on the way").to_string();
    assert!(error.contains("does not move") && error.contains("shoulder_pan_joint"), "{error}");
    let error = robot.planning_group(&[], FETCH_SITE, &none).expect_err("no joints").to_string();
    assert!(error.contains("needs a joint"), "{error}");
    let error = RobotModel::open("scenes/none.xml".as_ref()).err().expect("no such file");
    assert!(matches!(error, RobotError::Text { .. }) && error.to_string().contains("check the path"), "{error}");
    let text = r#"<mujoco><worldbody><body><joint name="s" type="slide"/><geom size="0.1"/><site name="t"/></body>
        <body><freejoint name="f"/><geom size="0.1"/><site name="u"/></body></worldbody></mujoco>"#;
    let file = write_scene(text);
    let robot = open_robot(file.path());
    let error = robot.planning_group(&["s"], "t", &none).expect_err("no range").to_string();
    assert!(error.contains("range=\"LOW HIGH\""), "{error}");
    let error = robot.planning_group(&["f"], "u", &none).expect_err("a free joint").to_string();
    assert!(error.contains("is a free joint"), "{error}");
}
