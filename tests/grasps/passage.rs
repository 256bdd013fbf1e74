//! Hands that come and close among other objects: free or not, against coal and closed forms.

use std::{collections::BTreeMap, fs, sync::Arc};

use graspmill::{
    collision::{Body, Geometry},
    contact::ContactSurface,
    geom::{Shape, TriMesh},
    grasp::{ClosingGrasp, HandPassage, HandSearch, Passage, PathObstacle, SceneObstacle, Surroundings},
    hand::{Driven, Hand, Motor},
    seed::Stream,
    sim::HandModel,
    voxel::InsideTest,
    words::{BothWays, PathStage},
};
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde_json::json;

use crate::support::{
    measures::thread_seconds,
    meshes::{prepare_scan, scan_file},
    program::Program,
    robots::{BARRETT, GRIPPER, open_hand},
    workspace::Workspace,
};

/// Distance to everything but the target [m].
const MARGIN: f64 = 0.002;

/// Samples of an approach of 10 cm, and of a hand whose motors move.
const SAMPLES: u32 = 40;

fn obstacle(mesh: &TriMesh, scene_from_obstacle: IsometryMatrix3<f64>) -> SceneObstacle {
    let surface = ContactSurface::new(mesh, InsideTest::WindingNumber).expect("a surface");
    SceneObstacle { surface: Arc::new(surface), scene_from_obstacle }
}

fn passage(model: &HandModel) -> HandPassage {
    let (bodies, _) = model.bodies().expect("its bodies");
    HandPassage::new(&HandSearch::new(model.hand(), &bodies).expect("eigengrasps"), MARGIN)
}

/// A box about the origin, by its half sides.
fn block(half: [f64; 3]) -> TriMesh {
    let corner = |index: usize| {
        std::array::from_fn(|axis| (if index >> axis & 1 == 1 { half[axis] } else { -half[axis] }) as f32)
    };
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    TriMesh { vertices: (0..8).map(corner).collect(), triangles }
}

/// A scene of two blocks on a plane: the target at the origin, and one beside it along y.
fn two_blocks(beside: f64) -> Surroundings {
    let at = |y: f64| obstacle(&block([0.02, 0.02, 0.04]), IsometryMatrix3::translation(0.0, y, 0.04));
    Surroundings { container: None, ground: 0.0, objects: vec![at(0.0), at(beside)] }
}

/// The parallel gripper, opened, from above: its pads about the target's middle, its fingers along y.
fn from_above(watch: &mut HandPassage, model: &HandModel, scene: &Surroundings) -> ClosingGrasp {
    let down = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let base = IsometryMatrix3::from_parts(Translation3::new(0.0, 0.0, 0.106), down);
    watch.close(&scene.objects[0].surface, &base, &model.hand().opened())
}

/// The fingers of the opened gripper are from 40 to 52 mm to either side, 15 mm beneath the pads.
#[test]
fn clearances_of_a_gripper_among_blocks_are_those_of_its_measures() {
    let model = open_hand(GRIPPER);
    let mut watch = passage(&model);
    let free = |clearance: f64| Passage { blocked: None, clearance };
    let blocked = |stage, thing, clearance| Passage { blocked: Some((stage, thing)), clearance };
    for (beside, ground, expected) in [
        // From the palm's edge, 5 mm next to the neighbour's and 6 mm above it; beyond the largest clearance; too near
        // a finger.
        (0.080, 0.0, free(0.005_f64.hypot(0.006))),
        (0.200, 0.0, free(Passage::FAR)),
        (0.073, 0.0, blocked(PathStage::Pregrasp, PathObstacle::Neighbour(1), 0.001)),
        // The plane under the fingertips, which are 25 mm above the bottom of the target.
        (0.200, 0.020, free(0.005)),
        (0.200, 0.024, blocked(PathStage::Pregrasp, PathObstacle::Ground, 0.001)),
    ] {
        let scene = Surroundings { ground, ..two_blocks(beside) };
        let grasp = from_above(&mut watch, &model, &scene);
        let found = in_one_way(watch.follow(&scene, 0, &grasp));
        assert_eq!(found.blocked, expected.blocked, "{beside} {ground}: {found:?}");
        assert!((found.clearance - expected.clearance).abs() < 1.5e-4, "{beside} {ground}: {found:?}");
    }
    // An object above the target blocks a hand that approaches from above, not one that is already there.
    let mut scene = two_blocks(0.2);
    scene.objects.push(obstacle(&block([0.1, 0.1, 0.005]), IsometryMatrix3::translation(0.0, 0.0, 0.3)));
    let grasp = from_above(&mut watch, &model, &scene);
    assert_eq!(in_one_way(watch.follow(&scene, 0, &grasp)).blocked, None);
    scene.objects[2].scene_from_obstacle = IsometryMatrix3::translation(0.0, 0.0, 0.2);
    let found = in_one_way(watch.follow(&scene, 0, &grasp));
    assert_eq!(found.blocked, Some((PathStage::Approach, PathObstacle::Neighbour(2))), "{found:?}");
    // A post between finger and target blocks the closing finger.
    scene.objects[2] = obstacle(&block([0.002, 0.002, 0.04]), IsometryMatrix3::translation(0.0, 0.03, 0.04));
    let found = in_one_way(watch.follow(&scene, 0, &grasp));
    assert_eq!(found.blocked, Some((PathStage::Closing, PathObstacle::Neighbour(2))), "{found:?}");
    // A container is a separate obstacle.
    let mut binned = two_blocks(0.2);
    binned.container = Some(obstacle(&TriMesh::open_box([0.4, 0.1, 0.2], 0.02), IsometryMatrix3::identity()));
    let found = in_one_way(watch.follow(&binned, 0, &grasp));
    assert_eq!(found.blocked, Some((PathStage::Pregrasp, PathObstacle::Container)), "{found:?}");
}

/// The passage of a hand whose posture is opened: both ways are one.
fn in_one_way(BothWays { shaped, opened }: BothWays<Passage>) -> Passage {
    assert_eq!(shaped, opened);
    shaped
}

/// The gripper from above with its pads so far from the middle [m].
fn from_above_in(watch: &mut HandPassage, model: &HandModel, scene: &Surroundings, pad: f64) -> ClosingGrasp {
    let ClosingGrasp { object_from_base, .. } = from_above(watch, model, scene);
    watch.close(&scene.objects[0].surface, &object_from_base, &[pad])
}

/// A block between the pads with a wall next to it, whose faces have these distances from the middle along y [m].
fn block_and_wall(wall: [f64; 2]) -> TriMesh {
    let [near, far] = wall;
    let mut mesh = block([0.02, 0.02, 0.04]);
    let beside = block([0.02, (far - near) / 2.0, 0.03]);
    let first = mesh.vertices.len() as u32;
    let middle = f64::midpoint(near, far) as f32;
    mesh.vertices.extend(beside.vertices.iter().map(|[x, y, z]| [*x, y + middle, z - 0.01]));
    mesh.triangles.extend(beside.triangles.iter().map(|triangle| triangle.map(|corner| corner + first)));
    mesh
}

/// Fingers in their posture reach from 25 to 37 mm, opened ones from 40 to 52 mm: each way names what is in it.
#[test]
fn each_of_the_two_ways_names_what_is_in_it() {
    let model = open_hand(GRIPPER);
    let mut watch = passage(&model);
    let mut ways = |wall: Option<[f64; 2]>, neighbour: f64| {
        let mut scene = two_blocks(neighbour);
        if let Some(wall) = wall {
            scene.objects[0] = obstacle(&block_and_wall(wall), scene.objects[0].scene_from_obstacle);
        }
        let grasp = from_above_in(&mut watch, &model, &scene, 0.025);
        let ways = watch.follow(&scene, 0, &grasp);
        let past = watch.past_object(&scene.objects[0].surface, &grasp.object_from_base, &grasp.posture);
        (ways.map(|passage| passage.blocked), past)
    };
    assert_eq!(ways(None, 0.2), (BothWays::default(), BothWays::default()));
    // A neighbour next to the opened fingers.
    let by = Some((PathStage::Approach, PathObstacle::Neighbour(1)));
    assert_eq!(ways(None, 0.066), (BothWays { shaped: None, opened: by }, BothWays::default()));
    // A wall of the object, where the opened fingers come, where they pass as they take on their posture, and where they then are.
    for (wall, [shaped, opened]) in [
        ([0.045, 0.047], [None, Some(PathStage::Approach)]),
        ([0.038, 0.039], [None, Some(PathStage::Shaping)]),
        ([0.030, 0.032], [Some(PathStage::Pregrasp); 2]),
    ] {
        let past = BothWays { shaped, opened };
        let named = past.map(|stage| stage.map(|stage| (stage, PathObstacle::Target)));
        assert_eq!(ways(Some(wall), 0.2), (named, past), "{wall:?}");
    }
}

/// Edges of the hand are where its description has them: the distance between the finger's outer edge, along z at (10,
/// 52) mm, and the edge of a block that is rotated diagonally next to it agrees with plane geometry.
#[test]
fn edges_of_the_hand_are_not_rounded() {
    let model = open_hand(GRIPPER);
    let mut watch = passage(&model);
    for (across, along) in [(0.003, 0.003_f64), (0.002, 0.004), (0.006, 0.001)] {
        let mut scene = two_blocks(0.2);
        let place = IsometryMatrix3::translation(0.010 + across + 0.02, 0.052 + along + 0.02, 0.04);
        scene.objects[1] = obstacle(&block([0.02, 0.02, 0.04]), place);
        let grasp = from_above(&mut watch, &model, &scene);
        let found = in_one_way(watch.follow(&scene, 0, &grasp));
        let expected = across.hypot(along);
        assert_eq!(found.blocked, None, "{found:?}");
        assert!((found.clearance - expected).abs() < 1e-4, "{expected} {found:?}");
    }
}

/// A hand over a scene: all its solids at many moments of its two ways.
struct Sampled {
    /// Poses of the solids at each moment, by rows.
    poses: Vec<f64>,
    /// Moments of each part: the pregrasp, the approach in the posture and opened, shaping, closing.
    moments: [usize; 5],
}

impl Sampled {
    fn new(
        model: &HandModel,
        solids: &[(usize, Geometry)],
        scene_from_object: &IsometryMatrix3<f64>,
        grasp: &ClosingGrasp,
    ) -> Self {
        let hand = model.hand();
        let scene_from_base = scene_from_object * grasp.object_from_base;
        let engaged = |values: &[f64]| values.iter().copied().map(Motor::engaged).collect::<Vec<_>>();
        let (opened, shaped) = (engaged(&hand.opening(&grasp.posture)), engaged(&grasp.posture));
        let mut joints = vec![0.0; hand.tree().len()];
        let mut frames = |motors: &[Motor]| {
            hand.joint_values(motors, &mut joints);
            hand.link_frames(&joints)
        };
        let approach = scene_from_base.rotation * hand.approach_direction(&frames(&shaped));
        let mut poses = Vec::new();
        let mut add = |base: &IsometryMatrix3<f64>, frames: &[IsometryMatrix3<f64>]| {
            for (link, geometry) in solids {
                let base_from_link = if *link == 0 { IsometryMatrix3::identity() } else { frames[link - 1] };
                let pose = (base * base_from_link * geometry.link_from_shape).to_homogeneous();
                poses.extend((0..3).flat_map(|row| (0..4).map(move |column| pose[(row, column)])));
            }
        };
        add(&scene_from_base, &frames(&shaped));
        for motors in [&shaped, &opened] {
            let frames = frames(motors);
            for sample in 0..=SAMPLES {
                let back = approach * (-0.1 * f64::from(sample) / f64::from(SAMPLES));
                add(&(Translation3::from(back) * scene_from_base), &frames);
            }
        }
        // Motors move at their speeds; those with a clutch are checked only at the end, where it may open.
        let has_clutch = hand.driven().iter().any(|driven| driven.breakaway.is_some());
        let closing = if has_clutch { 1 } else { SAMPLES };
        for (from, to, samples) in [(&opened, &shaped, SAMPLES), (&shaped, &grasp.closed().to_vec(), closing)] {
            for sample in 1..=samples {
                let share = f64::from(sample) / f64::from(samples);
                add(&scene_from_base, &frames(&motors_between(hand, from, to, share)));
            }
        }
        let along = SAMPLES as usize + 1;
        Self { poses, moments: [1, along, along, SAMPLES as usize, closing as usize] }
    }
}

/// The motors after a share of the time in which all go from one posture to another at their speeds.
fn motors_between(hand: &Hand, from: &[Motor], to: &[Motor], share: f64) -> Vec<Motor> {
    let ways = || hand.driven().iter().zip(from.iter().zip(to));
    let times: Vec<f64> = ways().map(|(driven, (from, to))| (to.angle - from.angle).abs() / driven.speed).collect();
    let time = share * times.iter().copied().fold(0.0, f64::max);
    let at = |((from, to), own): ((&Motor, &Motor), &f64)| {
        let share = if *own > 0.0 { (time / own).min(1.0) } else { 1.0 };
        if share == 1.0 { *to } else { Motor { angle: from.angle + share * (to.angle - from.angle), ..*to } }
    };
    from.iter().zip(to).zip(&times).map(at).collect()
}

/// Solids drawn in by a length [m]: half sides, whether it is round, and the radius of a ball or a capsule.
fn solid_of(shape: &Shape, by: f64) -> serde_json::Value {
    let (half, is_round, thickness) = match shape {
        Shape::Sphere { radius } => ([0.0; 3], false, radius - by),
        Shape::Capsule { radius, half } => ([0.0, 0.0, *half], false, radius - by),
        Shape::Box { half } => (half.map(|side| side - by), false, 0.0),
        Shape::Cylinder { radius, half } => ([radius - by, radius - by, half - by], true, 0.0),
        Shape::Mesh(_) => panic!("no mesh is a solid of a hand"),
    };
    json!({ "half": half, "round": is_round, "thickness": thickness })
}

const SCANS: [&str; 4] = ["025_mug", "006_mustard", "011_banana", "024_bowl"];

/// Scans in the air over a low bin, each turned by chance.
fn scans_in_a_bin(meshes: &[TriMesh], bin: &TriMesh, draw: &mut Stream) -> Surroundings {
    let mut objects: Vec<SceneObstacle> = Vec::new();
    for (index, mesh) in meshes.iter().enumerate() {
        let at = Vector3::new(0.13 * (index % 2) as f64, 0.13 * (index / 2) as f64, 0.1);
        objects.push(obstacle(mesh, IsometryMatrix3::from_parts(at.into(), turned(draw))));
    }
    let container = obstacle(bin, IsometryMatrix3::translation(0.06, 0.06, 0.0));
    Surroundings { container: Some(container), ground: -0.02, objects }
}

fn turned(draw: &mut Stream) -> Rotation3<f64> {
    let parts = [(); 4].map(|()| draw.normal());
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(parts)).to_rotation_matrix()
}

/// Distances of the solids, drawn in by a length [m], at each moment that `rows` has, from each mesh: a row a moment.
fn ask_coal(
    things: &[(&TriMesh, &SceneObstacle)],
    solids: &[(usize, Geometry)],
    by: f64,
    rows: &[u8],
) -> Vec<Vec<f64>> {
    let folder = Workspace::new();
    let pose = |pose: &IsometryMatrix3<f64>| {
        let pose = pose.to_homogeneous();
        (0..3).flat_map(|row| (0..4).map(move |column| pose[(row, column)])).collect::<Vec<f64>>()
    };
    let mesh = |(mesh, placed): &(&TriMesh, &SceneObstacle)| {
        let pose = pose(&placed.scene_from_obstacle);
        json!({ "vertices": mesh.vertices, "triangles": mesh.triangles, "pose": pose })
    };
    let question = json!({
        "meshes": things.iter().map(mesh).collect::<Vec<_>>(),
        "solids": solids.iter().map(|(_, geometry)| solid_of(&geometry.shape, by)).collect::<Vec<_>>(),
    });
    folder.write("question.json", question.to_string());
    folder.write("poses", rows);
    Program::peer("peers/bin/python").arg("tests/peers/passage.py").arg(folder.folder()).succeed();
    let answer = fs::read(folder.path("distances")).expect("an answer");
    let distances: Vec<f64> = answer.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    distances.chunks_exact(things.len()).map(<[f64]>::to_vec).collect()
}

/// A hand that was followed, with the moments of its ways that coal has seen: of each part in turn.
struct Followed {
    target: usize,
    found: BothWays<Passage>,
    moments: [usize; 5],
}

/// Distances of the moments of a part of a way: of the solids as they are, and drawn in by what may overlap the target and a tolerance.
struct Part<'n> {
    stage: PathStage,
    near: &'n [Vec<f64>],
    drawn_in: &'n [Vec<f64>],
}

impl Part<'_> {
    /// The least distances from a thing.
    fn least(&self, column: usize) -> [f64; 2] {
        [self.near, self.drawn_in].map(|rows| rows.iter().map(|row| row[column]).fold(f64::INFINITY, f64::min))
    }
}

impl Followed {
    /// Compares with coal's distances at these moments; `says` tells which grasp it is.
    fn check(&self, [near, drawn_in]: [&[Vec<f64>]; 2], says: &str) {
        use PathStage::{Approach, Closing, Pregrasp, Shaping};
        let mut first = 0;
        let [pregrasp, coming, coming_opened, shaping, closing] = self.moments.map(|count| {
            first += count;
            first - count..first
        });
        let part = |stage, moments: &std::ops::Range<usize>| {
            let (near, drawn_in) = (&near[moments.clone()], &drawn_in[moments.clone()]);
            Part { stage, near, drawn_in }
        };
        let shaped = [part(Pregrasp, &pregrasp), part(Approach, &coming), part(Closing, &closing)];
        let opened = [
            part(Pregrasp, &pregrasp),
            part(Approach, &coming_opened),
            part(Shaping, &shaping),
            part(Closing, &closing),
        ];
        self.check_way(&shaped, &self.found.shaped, &format!("{says} in its posture"));
        self.check_way(&opened, &self.found.opened, &format!("{says} opened"));
    }

    fn check_way(&self, parts: &[Part<'_>], found: &Passage, says: &str) {
        let (target, bin) = (self.target, SCANS.len());
        let (mut first, mut least) = (None, f64::INFINITY);
        for part in parts {
            // In the order in which things are looked at; the target is what the hand closes on.
            let own = (part.stage != PathStage::Closing).then_some((PathObstacle::Target, target));
            let others = (0..bin).filter(|index| *index != target).map(|index| (PathObstacle::Neighbour(index), index));
            for (thing, column) in std::iter::once((PathObstacle::Container, bin)).chain(own).chain(others) {
                let [distance, drawn_in] = part.least(column);
                let is_target = thing == PathObstacle::Target;
                let is_hit = if is_target { drawn_in <= 0.0 } else { distance < MARGIN - Passage::TOLERANCE };
                if first.is_none() && is_hit {
                    first = Some((part.stage, thing));
                }
                if Some((part.stage, thing)) == found.blocked {
                    first = first.or(found.blocked);
                    // The two measure the depth of an overlap differently.
                    let is_told = part.stage == PathStage::Pregrasp && distance > 0.0;
                    let is_same = (distance - found.clearance).abs() < Passage::TOLERANCE;
                    assert!(!is_told || is_same, "{says}: {distance} {found:?}");
                    // Between two samples the hand may come nearer than at either; one with clutches is seen closed alone.
                    let is_seen = part.near.len() > 1 || part.stage == PathStage::Pregrasp;
                    let margin = if is_target { 0.0 } else { MARGIN };
                    assert!(!is_seen || distance < margin + 0.0025, "{says}: {distance} {found:?}");
                }
                if !is_target {
                    least = least.min(distance);
                }
            }
        }
        match found.blocked {
            // Coal does not have the plane.
            Some((stage, PathObstacle::Ground)) => {
                assert!(first.is_none_or(|(other, _)| other >= stage), "{says}: {first:?} {found:?}");
            }
            blocked => assert_eq!(first, blocked, "{says}"),
        }
        assert!(found.blocked.is_some() || least > found.clearance - Passage::TOLERANCE, "{says}: {least} {found:?}");
    }
}

/// The opened hand with its motors a share of the way to the closed one.
fn partly_closed(hand: &Hand, share: f64) -> Vec<f64> {
    let value = |driven: &Driven| {
        driven.closed.map_or(driven.opened, |closed| driven.opened + share * (closed - driven.opened))
    };
    hand.driven().iter().map(value).collect()
}

/// Twenty thousand poses of hands among scans: coal finds the same obstacles, at the same distances.
#[test]
#[ignore = "slow: make test-all"]
fn coal_finds_the_same_in_the_way() {
    const GRASPS: usize = 170;
    let meshes: Vec<TriMesh> = SCANS.iter().map(|name| prepare_scan(&scan_file(name))).collect();
    let bin = TriMesh::open_box([0.5, 0.5, 0.05], 0.02);
    let (mut poses, mut all_poses, mut counts) = (0, 0, BTreeMap::new());
    for hand in [GRIPPER, BARRETT] {
        let model = open_hand(hand);
        let (bodies, _) = model.bodies().expect("its bodies");
        let of_body = |body: &Body| body.geometries.iter().map(|geometry| (body.link, geometry.clone())).collect();
        let solids: Vec<(usize, Geometry)> =
            bodies.bodies.iter().flat_map(|body| -> Vec<_> { of_body(body) }).collect();
        let mut watch = passage(&model);
        let mut draw = Stream::of_job(1, hand.as_bytes(), "hands among scans");
        let scene = scans_in_a_bin(&meshes, &bin, &mut draw);
        let (mut followed, mut rows, mut seconds) = (Vec::new(), Vec::new(), 0.0);
        for _ in 0..GRASPS {
            let target = (draw.unit() * SCANS.len() as f64) as usize;
            // From outside towards the middle of the object's box, nearly.
            let rotation = turned(&mut draw);
            let middle = scene.objects[target].surface.bounds().centre();
            let palm = middle - rotation * Vector3::z() * draw.uniform(0.1, 0.2);
            let base = IsometryMatrix3::from_parts(palm.coords.into(), rotation);
            let began = thread_seconds();
            let posture = partly_closed(model.hand(), draw.uniform(0.0, 0.5));
            let grasp = watch.close(&scene.objects[target].surface, &base, &posture);
            let found = watch.follow(&scene, target, &grasp);
            seconds += thread_seconds() - began;
            let path = Sampled::new(&model, &solids, &scene.objects[target].scene_from_obstacle, &grasp);
            rows.extend(path.poses.iter().flat_map(|number| number.to_le_bytes()));
            for passage in [found.shaped, found.opened] {
                *counts.entry(passage.blocked.map(|(stage, _)| stage)).or_insert(0) += 1;
            }
            followed.push(Followed { target, found, moments: path.moments });
        }
        let container = scene.container.as_ref().expect("a bin");
        let things: Vec<_> = meshes.iter().zip(&scene.objects).chain([(&bin, container)]).collect();
        // The target may be overlapped by a tenth of a millimetre, with that tolerance.
        let distances = [0.0, 2e-4].map(|by| ask_coal(&things, &solids, by, &rows));
        for (number, grasp) in followed.iter().enumerate() {
            let count: usize = grasp.moments.iter().sum();
            let moments = poses..poses + count;
            grasp.check(distances.each_ref().map(|rows| &rows[moments.clone()]), &format!("{hand} {number}"));
            poses = moments.end;
        }
        all_poses += std::mem::take(&mut poses);
        println!("{hand}: {:.0} us a grasp with its closing", 1e6 * seconds / GRASPS as f64);
    }
    println!("{all_poses} poses of hands, {counts:?}");
    assert!(all_poses > 20_000, "{all_poses}");
    assert!(counts.len() == 5 && counts.values().all(|count| *count >= 5), "{counts:?}");
}
