//! Scenes that settle, and what is checked of them.

use std::{path::Path, sync::Arc, time::Instant};

use nalgebra::{IsometryMatrix3, UnitQuaternion, Vector3};

use super::{
    Fault, Placement, SceneTouch, SettleOutcome, SettleSettings, SettleWorker, SettledBody, Walls, model::SceneModel,
    run::LOOK_EVERY,
};
use crate::{
    objects::{
        collider::{SceneCollider, SceneLoan},
        container::{Container, Vessel},
        patch::BodyPatch,
        scene_body::SimBody,
    },
    physics::GRAVITY,
};
use assets::{MeshSource, built_in_source, list_folder, object::PreparedObject};
use kernel::{
    contact::{ContactBody, ContactSurface, Sampled},
    geom::{SimdLevel, TriMesh},
    seed::Stream,
    voxel::InsideTest,
};

const SETTINGS: SettleSettings = SettleSettings {
    timestep: 0.002,
    rolling: 0.002,
    release_every: 0.3,
    release_height: 0.03,
    rest_speed: 0.002,
    rest_time: 0.25,
    cap: 4.0,
    recheck: 2.0,
    finer: 1,
    put_back: 0,
};

fn bin() -> Container {
    let inner = [0.4, 0.3, 0.2];
    let mesh = TriMesh::open_box(inner, 0.02);
    let surface = ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface");
    let body = Arc::new(ContactBody::new(&mesh, Arc::new(surface), Sampled::Edges));
    Container::Bin(Vessel::open_box(body, inner, 0.02, IsometryMatrix3::identity()))
}

fn scene_body(source: &MeshSource) -> SimBody {
    let object = PreparedObject::prepare(source).expect("a sound mesh");
    let surface = Arc::clone(object.contact_surface().expect("a surface"));
    let body = Arc::new(ContactBody::new(object.mesh(), surface, Sampled::Everywhere));
    let solid = *object.mass().expect("a solid");
    SimBody { body, solid, mass: (400.0 * solid.volume).clamp(0.02, 2.0), friction: 0.5 }
}

fn scans(count: usize) -> Vec<SimBody> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.deps/ycb");
    let files = list_folder(&folder).unwrap_or_else(|error| panic!("{error}; `make setup` fetches the scans"));
    let small = |path: &&std::path::PathBuf| !path.to_string_lossy().contains("chain");
    let some = files.iter().filter(small).step_by(3).take(count);
    some.map(|path| scene_body(&MeshSource::of_file("scan", path))).collect()
}

fn random_drop(stream: &mut Stream) -> Placement {
    let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
        stream.normal(),
        stream.normal(),
        stream.normal(),
        stream.normal(),
    ));
    Placement::Dropped { rotation: rotation.to_rotation_matrix(), shares: [stream.unit(), stream.unit()] }
}

#[test]
fn a_can_lies_on_a_plane_where_it_weighs_what_the_plane_carries() {
    let can = scene_body(&built_in_source("can-01"));
    let weight = can.mass * GRAVITY;
    let mut worker = SettleWorker::new(Container::Plane { size: [1.0, 1.0] }, SETTINGS, SimdLevel::Scalar);
    let placed = Placement::Placed { world_from_object: IsometryMatrix3::translation(0.1, 0.0, 0.2) };
    let scene = worker.settle(&[can], &[placed], 1);
    assert_eq!(scene.fault, None, "{scene:?}");
    assert!(scene.depths[1] < 2e-4 && scene.drift()[0] < 1e-3, "{scene:?}");
    let carried: f64 = scene.touches.iter().map(|touch| touch.force.z).sum();
    assert!((carried / weight - 1.0).abs() < 0.1, "{carried} of {weight} N");
    assert!(scene.touches.iter().all(|touch| touch.pair == [None, Some(0)] && touch.normal.z > 0.999));
    assert!(scene.touches.len() >= 3, "{:?}", scene.touches);
}

fn walled(lift_speed: f64) -> Walls {
    let inner = [0.2, 0.2, 0.3];
    let mesh = TriMesh::walls(inner, 0.02);
    let surface = ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface");
    Walls::new(Arc::new(ContactBody::new(&mesh, Arc::new(surface), Sampled::Edges)), inner, lift_speed)
}

/// Walls hold bodies together until they are lifted; the remaining bodies have no contact with them, and the same bits
/// twice.
#[test]
fn a_pile_falls_apart_when_its_walls_are_lifted() {
    let bodies = ["box-01", "can-01", "box-02", "cup-01"].map(|name| scene_body(&built_in_source(name)));
    let mut stream = Stream::of_job(4, b"", "drops");
    let drops = [(); 4].map(|()| random_drop(&mut stream));
    let plane = || SettleWorker::new(Container::Plane { size: [2.0, 2.0] }, SETTINGS, SimdLevel::Scalar);
    let mut worker = plane().with_walls(walled(0.2));
    let pile = worker.settle(&bodies, &drops, 4);
    assert_eq!(pile.fault, None, "{pile:?}");
    assert_eq!(worker.settle(&bodies, &drops, 4), pile);
    // The walls stayed until the last body fell and rested, and rose by more than their height.
    let lifted = 0.3 / 0.2;
    assert!(f64::from(pile.steps) * SETTINGS.timestep > 3.0 * SETTINGS.release_every + lifted, "{}", pile.steps);
    let bodies_of = |touch: &SceneTouch| touch.pair.iter().flatten().copied().max();
    assert!(pile.touches.iter().filter_map(bodies_of).all(|body| body < 4));
    // Without walls the same drops fall elsewhere: the room that they are dropped into is wider.
    let spread = |scene: &SettleOutcome| {
        let of = |body: &SettledBody| body.world_from_object.translation.vector.xy().norm();
        scene.bodies.iter().map(of).fold(0.0, f64::max)
    };
    let heap = plane().settle(&bodies, &drops, 4);
    assert!(spread(&pile) < 0.5 * spread(&heap), "{} {}", spread(&pile), spread(&heap));
}

#[test]
fn nothing_moves_walls_and_bodies_stay_between_them() {
    let bodies = ["box-01", "can-01"].map(|name| scene_body(&built_in_source(name)));
    let walls = walled(0.2);
    let all = [bodies[0].clone(), bodies[1].clone(), walls.body.clone()];
    let mut worker = SettleWorker::new(Container::Plane { size: [1.0, 1.0] }, SETTINGS, SimdLevel::Scalar);
    let mut run = worker.run(&all);
    run.walls = Some(walls.standing(2));
    let mut stream = Stream::of_job(5, b"", "drops");
    run.fall(&[(); 2].map(|()| random_drop(&mut stream))).expect("a stable scene");
    for _ in 0..20 {
        run.step_for(LOOK_EVERY).expect("a stable scene");
        let foot = run.walls.expect("walls").foot;
        let moved = run.pose(2).translation.vector - Vector3::z() * foot;
        assert!(moved.norm() < 1e-5, "{moved:?}");
        for (index, body) in bodies.iter().enumerate() {
            let centre = run.pose(index) * body.solid.centre;
            assert!(centre.x.abs().max(centre.y.abs()) < walls.inner[0] / 2.0, "{centre}");
        }
    }
}

#[test]
fn the_same_scene_twice_has_equal_bits_whatever_came_before() {
    let bodies = ["mug-01", "box-01", "can-01"].map(|name| scene_body(&built_in_source(name)));
    let drops = |seed: u64| {
        let mut stream = Stream::of_job(seed, b"", "drops");
        [(); 3].map(|()| random_drop(&mut stream))
    };
    let mut worker = SettleWorker::new(bin(), SETTINGS, SimdLevel::Scalar);
    let first = worker.settle(&bodies, &drops(1), 3);
    let other = worker.settle(&bodies, &drops(2), 3);
    assert_ne!(first, other);
    assert_eq!(worker.settle(&bodies, &drops(1), 3), first);
    let mut fresh = SettleWorker::new(bin(), SETTINGS, SimdLevel::Scalar);
    assert_eq!(fresh.settle(&bodies, &drops(1), 3), first);
    assert_eq!(first.fault, None, "{first:?}");
}

/// A patched model moves as one that was compiled for its bodies.
#[test]
fn a_patched_model_equals_a_compiled_one() {
    let bodies = ["mug-01", "box-01", "cup-01"].map(|name| scene_body(&built_in_source(name)));
    let container = bin();
    let patches = bodies.each_ref().map(|body| BodyPatch::new(body, SETTINGS.rolling));
    let mut models = [
        SceneModel::new(&container, &SETTINGS, patches.len()),
        SceneModel::of_patches(&container, &SETTINGS, &patches),
    ];
    models[0].set_bodies(&patches);
    let mut stream = Stream::of_job(3, b"", "states");
    let mut touched = 0;
    for state in 0..1000 {
        let poses: Vec<f64> = (0..3)
            .flat_map(|_| {
                let at = [stream.uniform(-0.1, 0.1), stream.uniform(-0.1, 0.1), stream.uniform(0.02, 0.15)];
                let turn = [(); 4].map(|()| stream.normal());
                at.into_iter().chain(turn)
            })
            .collect();
        let found = models.each_mut().map(|model| {
            let surfaces = bodies.iter().map(|body| Arc::clone(&body.body)).collect();
            let mut collider = Some(SceneCollider::new(0, container.clone(), surfaces));
            model.data.reset();
            model.data.qpos_mut().copy_from_slice(&poses);
            let loan = SceneLoan::new(&mut collider);
            model.data.forward();
            drop(loan);
            let contacts = model.data.contact().iter();
            let contacts: Vec<_> = contacts.map(|each| (each.geom, each.dist, each.pos, each.friction)).collect();
            (contacts, model.data.qacc().to_vec())
        });
        let [(one, moved), (other, as_compiled)] = &found;
        assert_eq!(one, other, "state {state}");
        touched += one.len();
        let size = as_compiled.iter().fold(1.0, |size: f64, value| size.max(value.abs()));
        for (a, b) in moved.iter().zip(as_compiled) {
            assert!((a - b).abs() < 1e-6 * size, "state {state}: {a} {b}");
        }
    }
    assert!(touched > 1000, "{touched}");
}

/// Two boxes that overlap by 5 mm, one of them hovering, and another that hovers: all are kept and measured.
#[test]
fn poses_of_others_are_examined_as_they_are() {
    let cube = scene_body(&built_in_source("box-01"));
    let bounds = *cube.body.surface().bounds();
    let (sides, ground) = (bounds.max - bounds.min, -bounds.min.z);
    let at = |x: f64, z: f64| IsometryMatrix3::translation(x, z, ground + z);
    let bodies = [cube.clone(), cube.clone(), cube];
    let poses = [at(0.0, 0.0), at(sides.x - 5e-3, 0.01), at(0.5, 0.02)];
    let mut worker = SettleWorker::new(Container::Plane { size: [2.0, 2.0] }, SETTINGS, SimdLevel::Scalar);
    let scene = worker.examine(&bodies, &poses);
    assert_eq!(scene.fault, None, "{scene:?}");
    assert!((scene.depths[0] - 5e-3).abs() < 1e-4 && scene.depths[1] < 1e-6, "{:?}", scene.depths);
    assert_eq!((scene.bodies.len(), scene.gone.len(), scene.steps, scene.crossed), (3, 0, 0, 0));
    // No wall is passed as a whole. The two are pushed apart, the other falls.
    let drifts: Vec<f64> = scene.bodies.iter().map(|body| body.drift).collect();
    assert!(drifts[0] > 1e-3 && drifts[1] > 1e-3 && (drifts[2] - 0.02).abs() < 1e-3, "{drifts:?}");
    assert!(scene.bodies.iter().zip(&poses).all(|(body, pose)| body.world_from_object == *pose));
    assert_eq!(worker.examine(&bodies, &poses), scene);
}

/// Cups that pass one another in steps of 2 ms settle in shorter ones, in which contacts give way less; the stored
/// scene is at rest in steps of 2 ms.
#[test]
fn forces_and_torques_balance_where_bodies_settled_in_shorter_steps() {
    let bodies = ["cup-01", "bowl-01", "mug-01", "cup-02", "bowl-01"].map(|name| scene_body(&built_in_source(name)));
    let mut stream = Stream::of_job(163, b"", "drops");
    let drops = [(); 5].map(|()| random_drop(&mut stream));
    let settled = |finer: u32| {
        let settings = SettleSettings { finer, ..SETTINGS };
        SettleWorker::new(bin(), settings, SimdLevel::Scalar).settle(&bodies, &drops, 5)
    };
    let fault = settled(1).fault;
    assert!(matches!(fault, Some(Fault::Crossed { .. } | Fault::TooDeep { .. })), "{fault:?}");
    let scene = settled(4);
    assert_eq!(scene.fault, None, "{scene:?}");
    let [mut forces, mut torques] = [[Vector3::zeros(); 5]; 2];
    let centres: Vec<_> =
        (scene.bodies.iter()).map(|settled| settled.world_from_object * bodies[settled.index].solid.centre).collect();
    for SceneTouch { pair: [first, second], point, force, torque, .. } in &scene.touches {
        for (body, sign) in [(first, -1.0), (second, 1.0)] {
            if let Some(body) = *body {
                forces[body] += force * sign;
                torques[body] += ((point - centres[body]).cross(force) + torque) * sign;
            }
        }
    }
    for (settled, (force, torque)) in scene.bodies.iter().zip(forces.into_iter().zip(torques)) {
        let body = &bodies[settled.index];
        let weight = Vector3::z() * body.mass * GRAVITY;
        assert!((force - weight).norm() < 0.005 * weight.norm(), "{force:?} {weight:?}");
        let half_length = body.body.surface().bounds().longest_side() / 2.0;
        assert!(torque.norm() < 0.01 * weight.norm() * half_length, "{torque:?} {weight:?} {half_length}");
    }
}

/// Bins of scans, settled with the defaults of jobs: nearly all are kept (docs/jobs/scenes.md), and the cost of a step.
#[test]
#[ignore = "slow: make test-all"]
fn bins_of_scans_settle() {
    let all = scans(26);
    for (count, scenes, floor) in [(5, 20, 19), (10, 20, 18), (20, 6, 4)] {
        let settings = SettleSettings { finer: 4, put_back: 2, ..SETTINGS };
        let mut worker = SettleWorker::new(bin(), settings, SimdLevel::Scalar);
        let (mut kept, mut steps, began) = (0, 0_u64, Instant::now());
        for number in 0..scenes {
            let mut stream = Stream::of_job(number, b"", "bins");
            let mut bodies = all.clone();
            stream.shuffle(&mut bodies);
            bodies.truncate(count);
            let drops: Vec<Placement> = (0..count).map(|_| random_drop(&mut stream)).collect();
            let scene = worker.settle(&bodies, &drops, count);
            kept += u32::from(scene.fault.is_none());
            steps += u64::from(scene.steps) + 1000;
            println!(
                "{count} bodies, scene {number}: {:?}, {} steps, depths {:?} mm, drift {:?} mm",
                scene.fault,
                scene.steps,
                scene.depths.map(|depth| 1e3 * depth),
                1e3 * scene.drift()[0]
            );
        }
        let seconds = began.elapsed().as_secs_f64();
        println!(
            "{count} bodies: {kept} of {scenes} kept, {:.2} s a scene, {:.0} us a step",
            seconds / scenes as f64,
            1e6 * seconds / steps as f64
        );
        assert!(kept >= floor, "{count} bodies: {kept} of {scenes}");
    }
}
