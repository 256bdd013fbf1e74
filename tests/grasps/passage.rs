//! Hands that come and close among other objects: free or not, against coal and closed forms.

use std::{collections::BTreeMap, fs, sync::Arc};

use graspmill::{
    collision::{Body, Geometry},
    contact::ContactSurface,
    geom::{Shape, TriMesh},
    grasp::{ClosingGrasp, HandPassage, HandSearch, InTheWay, Obstacle, Passage, PathStage, Surroundings},
    hand::Motor,
    seed::Stream,
    sim::HandModel,
    voxel::InsideTest,
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

/// Samples of an approach of 10 cm, and of a hand that closes.
const SAMPLES: u32 = 40;

fn obstacle(mesh: &TriMesh, scene_from_obstacle: IsometryMatrix3<f64>) -> Obstacle {
    let surface = ContactSurface::new(mesh, InsideTest::WindingNumber).expect("a surface");
    Obstacle { surface: Arc::new(surface), scene_from_obstacle }
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
        // From finger to neighbour; beyond what is told; too near.
        (0.080, 0.0, free(0.008)),
        (0.200, 0.0, free(Passage::FAR)),
        (0.073, 0.0, blocked(PathStage::Pregrasp, InTheWay::Neighbour(1), 0.001)),
        // The plane under the fingertips, which are 25 mm above the bottom of the target.
        (0.200, 0.020, free(0.005)),
        (0.200, 0.024, blocked(PathStage::Pregrasp, InTheWay::Ground, 0.001)),
    ] {
        let scene = Surroundings { ground, ..two_blocks(beside) };
        let grasp = from_above(&mut watch, &model, &scene);
        let found = watch.follow(&scene, 0, &grasp);
        assert_eq!(found.blocked, expected.blocked, "{beside} {ground}: {found:?}");
        assert!((found.clearance - expected.clearance).abs() < 1.5e-4, "{beside} {ground}: {found:?}");
    }
    // What hangs over the target is in the way of a hand that comes from above, not of one that is there.
    let mut scene = two_blocks(0.2);
    scene.objects.push(obstacle(&block([0.1, 0.1, 0.005]), IsometryMatrix3::translation(0.0, 0.0, 0.3)));
    let grasp = from_above(&mut watch, &model, &scene);
    assert_eq!(watch.follow(&scene, 0, &grasp).blocked, None);
    scene.objects[2].scene_from_obstacle = IsometryMatrix3::translation(0.0, 0.0, 0.2);
    let found = watch.follow(&scene, 0, &grasp);
    assert_eq!(found.blocked, Some((PathStage::Approach, InTheWay::Neighbour(2))), "{found:?}");
    // A post between finger and target is in the way of the finger that closes.
    scene.objects[2] = obstacle(&block([0.002, 0.002, 0.04]), IsometryMatrix3::translation(0.0, 0.03, 0.04));
    let found = watch.follow(&scene, 0, &grasp);
    assert_eq!(found.blocked, Some((PathStage::Closing, InTheWay::Neighbour(2))), "{found:?}");
    // A container is a thing of its own.
    let mut binned = two_blocks(0.2);
    binned.container = Some(obstacle(&TriMesh::open_box([0.4, 0.1, 0.2], 0.02), IsometryMatrix3::identity()));
    let found = watch.follow(&binned, 0, &grasp);
    assert_eq!(found.blocked, Some((PathStage::Pregrasp, InTheWay::Container)), "{found:?}");
}

/// A hand over a scene: all its solids at many moments of its path.
struct Sampled {
    /// Poses of the solids at each moment, by rows.
    poses: Vec<f64>,
    /// Moments of each part: the pregrasp, the approach, closing.
    moments: [usize; 3],
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
        let frames = hand.link_frames(&hand.posture_values(&grasp.posture));
        let approach = scene_from_base.rotation * hand.approach_direction(&frames);
        let mut poses = Vec::new();
        let mut add = |base: &IsometryMatrix3<f64>, frames: &[IsometryMatrix3<f64>]| {
            for (link, geometry) in solids {
                let base_from_link = if *link == 0 { IsometryMatrix3::identity() } else { frames[link - 1] };
                let pose = (base * base_from_link * geometry.link_from_shape).to_homogeneous();
                poses.extend((0..3).flat_map(|row| (0..4).map(move |column| pose[(row, column)])));
            }
        };
        add(&scene_from_base, &frames);
        for sample in 1..=SAMPLES {
            let back = approach * (-0.1 * f64::from(sample) / f64::from(SAMPLES));
            add(&(Translation3::from(back) * scene_from_base), &frames);
        }
        // Motors without a clutch go on at their speeds.
        let start: Vec<Motor> = grasp.posture.iter().copied().map(Motor::engaged).collect();
        let has_clutch = hand.driven().iter().any(|driven| driven.breakaway.is_some());
        let samples = if has_clutch { 1 } else { SAMPLES };
        let ways = hand.driven().iter().zip(start.iter().zip(grasp.closed()));
        let times: Vec<f64> = ways.map(|(driven, (from, to))| (to.angle - from.angle).abs() / driven.speed).collect();
        let longest = times.iter().copied().fold(0.0, f64::max);
        let mut joints = vec![0.0; hand.tree().len()];
        for sample in 1..=samples {
            let time = longest * f64::from(sample) / f64::from(samples);
            let at = |((from, to), own): ((&Motor, &Motor), &f64)| {
                let share = if *own > 0.0 { (time / own).min(1.0) } else { 1.0 };
                if share == 1.0 { *to } else { Motor { angle: from.angle + share * (to.angle - from.angle), ..*to } }
            };
            let motors: Vec<Motor> = start.iter().zip(grasp.closed()).zip(&times).map(at).collect();
            hand.joint_values(&motors, &mut joints);
            add(&scene_from_base, &hand.link_frames(&joints));
        }
        Self { poses, moments: [1, SAMPLES as usize, samples as usize] }
    }
}

/// Solids as this house rounds them: half sides of a core, whether it is round, and its thickness.
fn rounded(shape: &Shape) -> serde_json::Value {
    let thin = |sides: &[f64]| sides.iter().fold(0.001, |least: f64, side| least.min(side / 2.0));
    let (half, is_round, thickness) = match shape {
        Shape::Sphere { radius } => ([0.0; 3], false, *radius),
        Shape::Capsule { radius, half } => ([0.0, 0.0, *half], false, *radius),
        Shape::Box { half } => (half.map(|side| side - thin(half)), false, thin(half)),
        Shape::Cylinder { radius, half } => {
            let thickness = thin(&[*radius, *half]);
            ([radius - thickness, radius - thickness, half - thickness], true, thickness)
        }
        Shape::Mesh(_) => panic!("no mesh is a solid of a hand"),
    };
    json!({ "half": half, "round": is_round, "thickness": thickness })
}

const SCANS: [&str; 4] = ["025_mug", "006_mustard", "011_banana", "024_bowl"];

/// Scans in the air over a low bin, each turned by chance.
fn scans_in_a_bin(meshes: &[TriMesh], bin: &TriMesh, draw: &mut Stream) -> Surroundings {
    let mut objects: Vec<Obstacle> = Vec::new();
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

/// Distances of the solids, at each moment that `rows` has, from each mesh: a row a moment.
fn ask_coal(things: &[(&TriMesh, &Obstacle)], solids: &[(usize, Geometry)], rows: Vec<u8>) -> Vec<Vec<f64>> {
    let folder = Workspace::new();
    let pose = |pose: &IsometryMatrix3<f64>| {
        let pose = pose.to_homogeneous();
        (0..3).flat_map(|row| (0..4).map(move |column| pose[(row, column)])).collect::<Vec<f64>>()
    };
    let mesh = |(mesh, placed): &(&TriMesh, &Obstacle)| {
        let pose = pose(&placed.scene_from_obstacle);
        json!({ "vertices": mesh.vertices, "triangles": mesh.triangles, "pose": pose })
    };
    let question = json!({
        "meshes": things.iter().map(mesh).collect::<Vec<_>>(),
        "solids": solids.iter().map(|(_, geometry)| rounded(&geometry.shape)).collect::<Vec<_>>(),
    });
    folder.write("question.json", question.to_string());
    folder.write("poses", rows);
    Program::peer("peers/bin/python").arg("tests/peers/passage.py").arg(folder.folder()).succeed();
    let answer = fs::read(folder.path("distances")).expect("an answer");
    let distances: Vec<f64> = answer.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    distances.chunks_exact(things.len()).map(<[f64]>::to_vec).collect()
}

/// A hand that was followed, with the moments of its path that coal has seen: of each stage in turn.
struct Followed {
    target: usize,
    found: Passage,
    moments: [usize; 3],
}

impl Followed {
    /// Compares with coal's distances at these moments; `says` tells which grasp it is.
    fn check(&self, near: &[Vec<f64>], says: &str) {
        let Self { target, found, moments } = self;
        let bin = SCANS.len();
        let (mut first, mut least, mut at) = (None, f64::INFINITY, 0);
        for (stage, count) in [PathStage::Pregrasp, PathStage::Approach, PathStage::Closing].into_iter().zip(moments) {
            let near = &near[at..at + count];
            at += count;
            // In the order in which things are looked at; the target is what the hand closes on.
            let own = (stage != PathStage::Closing).then_some((InTheWay::Target, *target));
            let others = (0..bin).filter(|index| index != target).map(|index| (InTheWay::Neighbour(index), index));
            for (thing, column) in std::iter::once((InTheWay::Container, bin)).chain(own).chain(others) {
                let distance = near.iter().map(|row| row[column]).fold(f64::INFINITY, f64::min);
                let margin = if thing == InTheWay::Target { -1e-4 } else { MARGIN };
                if first.is_none() && distance < margin - Passage::TOLERANCE {
                    first = Some((stage, thing));
                }
                if Some((stage, thing)) == found.blocked {
                    first = first.or(found.blocked);
                    // Deep in something the two measure depth in ways of their own.
                    let is_told = stage != PathStage::Pregrasp || distance <= 0.0;
                    assert!(is_told || (distance - found.clearance).abs() < 1e-4, "{says}: {distance} {found:?}");
                    // Between two samples the hand may come nearer than at either; one with clutches is seen closed alone.
                    let is_seen = *count > 1 || stage == PathStage::Pregrasp;
                    assert!(!is_seen || distance < margin + 0.0025, "{says}: {distance} {found:?}");
                }
                if thing != InTheWay::Target {
                    least = least.min(distance);
                }
            }
        }
        match found.blocked {
            // Coal knows nothing of the plane.
            Some((stage, InTheWay::Ground)) => {
                assert!(first.is_none_or(|(other, _)| other >= stage), "{says}: {first:?} {found:?}");
            }
            blocked => assert_eq!(first, blocked, "{says}"),
        }
        assert!(found.blocked.is_some() || least > found.clearance - Passage::TOLERANCE, "{says}: {least} {found:?}");
    }
}

/// Twenty thousand poses of hands among scans: coal finds the same things in the way, at the same distances.
#[test]
#[ignore = "slow: make test-slow"]
fn coal_finds_the_same_in_the_way() {
    const GRASPS: usize = 170;
    let meshes: Vec<TriMesh> = SCANS.iter().map(|name| prepare_scan(&scan_file(name))).collect();
    let bin = TriMesh::open_box([0.5, 0.5, 0.05], 0.02);
    let (mut poses, mut counts) = (0, BTreeMap::new());
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
            let grasp = watch.close(&scene.objects[target].surface, &base, &model.hand().opened());
            let found = watch.follow(&scene, target, &grasp);
            seconds += thread_seconds() - began;
            let path = Sampled::new(&model, &solids, &scene.objects[target].scene_from_obstacle, &grasp);
            rows.extend(path.poses.iter().flat_map(|number| number.to_le_bytes()));
            *counts.entry(format!("{:?}", found.blocked.map(|(stage, _)| stage))).or_insert(0) += 1;
            followed.push(Followed { target, found, moments: path.moments });
        }
        let container = scene.container.as_ref().expect("a bin");
        let things: Vec<_> = meshes.iter().zip(&scene.objects).chain([(&bin, container)]).collect();
        let mut near = &ask_coal(&things, &solids, rows)[..];
        for (number, grasp) in followed.iter().enumerate() {
            let (own, rest) = near.split_at(grasp.moments.iter().sum());
            grasp.check(own, &format!("{hand} {number}"));
            (near, poses) = (rest, poses + own.len());
        }
        println!("{hand}: {:.0} us a grasp with its closing", 1e6 * seconds / GRASPS as f64);
    }
    println!("{poses} poses of hands, {counts:?}");
    assert!(poses > 20_000, "{poses}");
    assert!(counts.len() == 4 && counts.values().all(|count| *count >= 5), "{counts:?}");
}
