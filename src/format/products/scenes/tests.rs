use std::sync::Arc;

use nalgebra::Point3;

use super::*;
use crate::{Facts, RecordError};
use kernel::{
    geom::{Pose, TriMesh},
    ids::{Digest, ItemId, ObjectId, SampleId},
};

fn scene() -> Scene {
    let body = |number: u8| SceneBody {
        object: ObjectId(Digest([number; 32])),
        world_from_object: Pose::from_xyz_rpy([0.1 * f64::from(number), 0.0, 0.05, 0.3, 0.2, 0.1]),
        mass: 0.3,
        centre_of_mass: [0.1 * f64::from(number), 0.0, 0.06],
        friction: 0.5,
        released_at: 0.3 * f64::from(number),
        resting: (number == 1).then_some((2, 0.01)),
        drift: 1e-5,
        turn: 2e-5,
    };
    let contact = |pair| SceneContact {
        pair,
        point: [0.1, 0.0, 0.0],
        normal: [0.0, 0.0, 1.0],
        distance: -1e-5,
        force: [0.0, 0.1, 2.9],
        torque: [1e-3, 0.0, -2e-4],
    };
    Scene {
        sample: SampleId::of_object(ObjectId(Digest([9; 32])), ItemId(17)),
        mode: SceneMode::Bin,
        container: SceneContainer::Bin { inner: [0.4, 0.3, 0.2], wall: 0.02, tilt_deg: 0.0 },
        bodies: vec![body(1), body(2)],
        contacts: vec![contact([0, 1]), contact([1, 2])],
        supports: vec![SceneSupport { by: 0, body: 1, share: 2.0 }, SceneSupport { by: 1, body: 2, share: 1.0 }],
        rest_time: 0.5,
        steps: 700,
        top_speed: 1e-3,
        depths: [1e-5, 2e-5],
        gone: 1,
        import: None,
    }
}

fn imported() -> Scene {
    let import = SceneImport {
        source: "000048, image 1".to_owned(),
        world_from_source: Pose::from_xyz_rpy([0.1, -0.2, -0.7, 0.1, 0.2, 0.3]),
        crossed: 2,
    };
    let container = SceneContainer::Plane { size: [0.6, 0.5] };
    Scene { mode: SceneMode::Imported, container, import: Some(import), ..scene() }
}

fn payload(scene: &Scene) -> Vec<u8> {
    let mut out = Vec::new();
    scene.encode(&mut out);
    out
}

fn tilted(tilt_deg: f64) -> SceneContainer {
    SceneContainer::Bin { inner: [0.4, 0.3, 0.2], wall: 0.02, tilt_deg }
}

#[test]
fn a_tilted_bin_is_raised_at_positive_y_and_stands_on_its_lowest_corner() {
    let upright = tilted(0.0);
    assert_eq!(upright.mesh().expect("a bin"), TriMesh::open_box([0.4, 0.3, 0.2], 0.02));
    assert_eq!((upright.table_z(), upright.sizes().len()), (-0.02, 4));
    let room = upright.room().expect("a bin");
    assert_eq!((room.min, room.max), (Point3::new(-0.2, -0.15, 0.0), Point3::new(0.2, 0.15, 0.2)));
    for tilt in [1.0, 15.0, 45.0_f64] {
        let bin = tilted(tilt);
        let bounds = bin.mesh().and_then(|mesh| mesh.aabb()).expect("a bin");
        assert!((bounds.min.z - bin.table_z()).abs() < 1e-7, "{} {}", bounds.min.z, bin.table_z());
        let far = bin.world_from_container() * Point3::new(0.0, 0.15, 0.0);
        assert!((far.z - 0.15 * tilt.to_radians().sin()).abs() < 1e-12 && far.y > 0.0);
        // The lowest corners of the room and of the box around it are as far apart as the floor's and the wall's thickness have it.
        let lowest = bin.room().expect("a bin").min.z;
        let apart = 0.02 * (tilt.to_radians().cos() + tilt.to_radians().sin());
        assert!((lowest - bounds.min.z - apart).abs() < 1e-7, "{lowest} {}", bounds.min.z);
    }
    let plane = SceneContainer::Plane { size: [0.6, 0.5] };
    assert!(plane.mesh().is_none() && plane.room().is_none() && plane.table_z() == 0.0);
}

/// A box as a mesh, with a change.
fn changed_tote(tilt_deg: f64, change: impl Fn(&mut TriMesh)) -> SceneContainer {
    let inner = [0.4, 0.3, 0.2];
    let mut mesh = TriMesh::open_box(inner, 0.02);
    change(&mut mesh);
    SceneContainer::Mesh { shape: Arc::new(ContainerMesh::new(mesh, inner)), tilt_deg }
}

fn tote(tilt_deg: f64) -> SceneContainer {
    changed_tote(tilt_deg, |_| {})
}

#[test]
fn a_mesh_of_a_bin_stands_as_the_bin_does() {
    for tilt in [0.0, 12.0] {
        let (bin, tote) = (tilted(tilt), tote(tilt));
        assert_eq!((bin.mesh(), bin.floor()), (tote.mesh(), tote.floor()));
        assert_eq!(bin.room().map(|room| room.max), tote.room().map(|room| room.max));
        assert!((bin.table_z() - tote.table_z()).abs() < 1e-7, "{} {}", bin.table_z(), tote.table_z());
        assert_ne!(bin.identity(), tote.identity());
    }
    // Another vertex is another container.
    assert_eq!(tote(3.0), tote(3.0));
    assert_ne!(tote(0.0), changed_tote(0.0, |mesh| mesh.vertices[0][0] -= 1e-6));
}

#[test]
fn a_scene_comes_back_as_it_was() {
    let plane = Scene { mode: SceneMode::Table, container: SceneContainer::Plane { size: [0.6, 0.5] }, ..scene() };
    let tilted = Scene { container: tilted(15.0), ..scene() };
    let [tote, tilted_tote] = [0.0, 10.0].map(|tilt_deg| Scene { container: tote(tilt_deg), ..scene() });
    for scene in [scene(), plane, imported(), tilted, tote, tilted_tote] {
        assert_eq!(Scene::decode(&payload(&scene)), Ok(scene));
    }
}

#[test]
fn facts_come_back_as_they_were() {
    let facts = scene().facts();
    assert_eq!(SceneFacts::from(&Facts::from(facts)), facts);
    assert_eq!((facts.bodies, facts.contacts, facts.gone), (2, 2, 1));
}

#[test]
fn a_scene_is_named_after_container_objects_and_poses_alone() {
    let one = scene();
    let mut other = scene();
    (other.sample.item, other.mode, other.steps, other.bodies[0].mass) = (ItemId(3), SceneMode::Heap, 1, 9.0);
    assert_eq!(one.id(), other.id());
    other.bodies[1].world_from_object = Pose::identity();
    assert_ne!(one.id(), other.id());
    other = scene();
    other.bodies.swap(0, 1);
    assert_ne!(one.id(), other.id());
    other = scene();
    other.container = SceneContainer::Bin { inner: [0.4, 0.3, 0.2], wall: 0.03, tilt_deg: 0.0 };
    assert_ne!(one.id(), other.id());
}

#[test]
fn what_is_no_scene_is_refused_with_its_field() {
    type Change = fn(&mut Scene);
    let refused = |change: Change| {
        let mut scene = scene();
        change(&mut scene);
        Scene::decode(&payload(&scene)).expect_err("no scene").to_string()
    };
    let cases: [(&str, Change); 16] = [
        ("centres_of_mass", |scene| scene.bodies[1].centre_of_mass[2] = f64::INFINITY),
        ("touch_forces", |scene| scene.contacts[0].force[1] = f64::NAN),
        ("touch_torques", |scene| scene.contacts[1].torque[0] = f64::NAN),
        ("masses", |scene| scene.bodies[0].mass = -1.0),
        ("masses", |scene| scene.bodies.clear()),
        ("touch_second", |scene| scene.contacts[1].pair = [1, 3]),
        ("touch_second", |scene| scene.contacts[1].pair = [2, 1]),
        ("touch_normals", |scene| scene.contacts[0].normal = [0.0, 0.0, 0.9]),
        ("supported", |scene| scene.supports[0].body = 7),
        ("container_size", |scene| scene.container = SceneContainer::Plane { size: [0.0, 1.0] }),
        ("container_size", |scene| scene.container = tilted(90.0)),
        ("container_size", |scene| scene.container = tilted(-5.0)),
        ("container_size", |scene| scene.container = tote(90.0)),
        ("container_triangles", |scene| scene.container = changed_tote(0.0, |mesh| mesh.triangles.clear())),
        ("container_triangles", |scene| scene.container = changed_tote(0.0, |mesh| mesh.triangles[0][2] = 99)),
        ("container_vertices", |scene| scene.container = changed_tote(0.0, |mesh| mesh.vertices[3][1] = f32::NAN)),
    ];
    for (field, change) in cases {
        let error = refused(change);
        assert!(error.contains(field), "{field}: {error}");
    }
    // A settled scene has no source, an imported one has.
    for other in [Scene { import: imported().import, ..scene() }, Scene { import: None, ..imported() }] {
        let error = Scene::decode(&payload(&other)).expect_err("no scene").to_string();
        assert!(error.contains("world_from_source"), "{error}");
    }
    // The digest of another scene.
    let mut other = scene();
    other.bodies[0].mass = 0.4;
    let mut bytes = payload(&other);
    let id = other.id().0.0;
    let at = bytes.windows(32).position(|window| window == id).expect("the digest");
    bytes[at] ^= 1;
    let error = Scene::decode(&bytes).expect_err("another digest");
    assert!(matches!(error, RecordError::Range { field: "scene", .. }), "{error}");
}
