//! Random-ray touch: closed forms, the thesis's way by hand, and that it leaves all else alone.

use std::fs;

use graspmill::{
    factory::products::pair::touch::{RandomRays, RayTarget, SeenSurface, TouchObstacles, TouchSurface},
    files::Folder,
    format::{TactileContacts, VoxelPair, dataset::DatasetReader},
    geom::{CameraCv, GridPlacement, Object, Pose, RenderMesh, SimdLevel, TriMesh, rotation_from_rpy},
    ids::{Digest, ItemId, ObjectId, SampleId},
    seed::Stream,
};
use nalgebra::{Point3, Vector3};

use crate::support::{
    files::list_shards,
    meshes::{centred_block, round},
    pairs::{default_camera, empty_pair},
    workspace::Workspace,
};

fn sample() -> SampleId {
    SampleId::of_object(ObjectId(Digest([7; 32])), ItemId(3))
}

/// A pair of empty grids of cells 2 mm wide about a point.
fn pair(camera_from_object: Pose<CameraCv, Object>, centre: Point3<f64>) -> VoxelPair {
    let grid = GridPlacement { resolution: 40, centre, cell_size: 0.002 };
    empty_pair(sample(), grid, default_camera(), camera_from_object)
}

fn touch(mesh: &TriMesh, closed: bool, rays: RandomRays, pair: &VoxelPair, level: SimdLevel) -> TactileContacts {
    let mut touch = TactileContacts::none(sample());
    let mut stream = Stream::of_sample(5, &sample(), "touch");
    let render = RenderMesh::new(mesh, closed);
    let (surface, alone) = (TouchSurface::new(mesh, level), TouchObstacles::default());
    let seen = SeenSurface::new(&surface, &render, &pair.camera_from_object, &alone);
    seen.random_rays(rays, pair, false, &mut stream, &mut touch);
    touch.check_beside(pair).expect("contacts are in the cells they name");
    touch
}

fn mesh_rays(count: u32) -> RandomRays {
    RandomRays { count, target: RayTarget::Mesh }
}

fn vector(value: [f32; 3]) -> Vector3<f64> {
    Vector3::from(value.map(f64::from))
}

#[test]
fn a_ball_is_touched_where_it_is_with_normals_outward() {
    const RADIUS: f64 = 0.03;
    let mut ball = round(48, |_, _| RADIUS);
    let centre = Vector3::new(0.05, -0.04, 0.9);
    let pair = pair(Pose::new(rotation_from_rpy(0.4, -1.0, 2.0), centre), Point3::from(centre));
    let rays = 20_000;
    let outward = touch(&ball, true, mesh_rays(rays), &pair, SimdLevel::detect());
    for contact in &outward.contacts {
        let (position, normal) = (vector(contact.position), vector(contact.normal));
        let radial = position - centre;
        // Facets lie inside of the ball by 1 - cos(pi / 96) at most, either way.
        assert!((0.998..=1.000_001).contains(&(radial.norm() / RADIUS)), "{}", radial.norm());
        assert!((normal.norm() - 1.0).abs() < 1e-6 && normal.dot(&radial) / RADIUS > 0.99);
        assert!(normal.z > 0.0 && radial.z > -1e-3, "rays come from the far side");
        let from = position.z + f64::from(contact.distance);
        assert!((from - centre.z - RADIUS).abs() < 1e-4, "a ray starts on the box's far side: {from}");
        // Of a convex body the camera sees the faces that face it, here a sliver of the far side towards the axis.
        assert_eq!(contact.visible, normal.dot(&position) < 0.0);
    }
    assert!((1..200).contains(&outward.visible()), "{}", outward.visible());
    // A circle in its square: a binomial count, 4 standard deviations.
    let (hits, share) = (outward.contacts.len() as f64, std::f64::consts::PI / 4.0);
    let spread = (f64::from(rays) * share * (1.0 - share)).sqrt();
    assert!((hits - f64::from(rays) * share).abs() < 4.0 * spread + 0.003 * hits, "{hits}");
    assert_eq!(outward.contacts.len() + outward.misses.len(), rays as usize);
    for miss in &outward.misses {
        let aside = vector(*miss) - centre;
        assert!(aside.x.hypot(aside.y) > 0.995 * RADIUS && aside.x.abs().max(aside.y.abs()) < RADIUS + 1e-6);
    }
    for level in SimdLevel::available() {
        assert_eq!(touch(&ball, true, mesh_rays(rays), &pair, level), outward, "{level}");
    }
    // Wound the other way round, nothing changes: the side that a ray comes to is the outer one.
    ball.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    assert_eq!(touch(&ball, false, mesh_rays(rays), &pair, SimdLevel::detect()), outward);
}

/// A cube beside the optical axis, rotated by a little: rays from behind meet the side that faces the axis, and the camera
/// sees that side while the line of sight is steeper than the rotation.
#[test]
fn a_side_that_faces_the_axis_is_touched_and_seen() {
    let cube = centred_block([0.05; 3]);
    let rays = 20_000;
    for (angle, seen) in [(0.1_f64, true), (0.4, false)] {
        let centre = Vector3::new(0.3, 0.0, 1.0);
        let pair = pair(Pose::new(rotation_from_rpy(0.0, angle, 0.0), centre), Point3::from(centre));
        let touch = |closed| touch(&cube, closed, mesh_rays(rays), &pair, SimdLevel::detect());
        let found = touch(true);
        assert_eq!(found, touch(false), "the short cut for closed meshes changes nothing");
        let (mut sides, mut last) = (0, 0);
        for contact in &found.contacts {
            let side = contact.normal[0] < -0.8;
            assert_eq!(contact.visible, side && seen, "{contact:?}");
            sides += u32::from(side);
            assert!(side || contact.normal[2] > 0.9);
            assert!(last <= contact.probe);
            last = contact.probe;
        }
        let (sine, cosine) = angle.sin_cos();
        let share = sine / (sine + cosine);
        let spread = (f64::from(rays) * share * (1.0 - share)).sqrt();
        let expected = f64::from(rays) * share;
        println!(
            "rotated by {angle}: {sides} of {} contacts on the side, {expected:.0} expected",
            found.contacts.len()
        );
        assert!((f64::from(sides) - expected).abs() < 4.0 * spread);
        assert_eq!(found.visible(), if seen { sides } else { 0 });
    }
}

/// A flat back on the very plane from which rays start, and contacts beyond the grid.
#[test]
fn a_flat_back_is_touched_at_distance_0_and_what_lies_outside_the_grid_is_kept() {
    let cube = centred_block([0.05; 3]);
    let centre = Point3::new(0.0, 0.0, 0.5);
    // The grid reaches 22 cells = 44 mm behind its centre: the back lies beyond.
    let mut pair = pair(Pose::new(rotation_from_rpy(0.0, 0.0, 0.0), centre.coords), centre);
    let found = touch(&cube, true, mesh_rays(200), &pair, SimdLevel::detect());
    assert_eq!((found.contacts.len(), found.outside(), found.tactile().count()), (200, 200, 0));
    for contact in &found.contacts {
        assert!(contact.distance < 1e-6 && (contact.position[2] - 0.55).abs() < 1e-7, "{contact:?}");
        assert_eq!(contact.normal, [0.0, 0.0, 1.0]);
    }
    pair.grid.cell_size = 0.01;
    let found = touch(&cube, true, mesh_rays(200), &pair, SimdLevel::detect());
    assert_eq!(found.outside(), 0);
    assert!(found.contacts.iter().all(|contact| contact.cell.is_some_and(|[_, _, z]| z == 22 || z == 23)));
}

/// The thesis's rays, by hand: a wall across the grid with a hole, and something behind it.
#[test]
fn the_thesis_walks_along_columns_from_the_last_cell() {
    let cube = centred_block([0.05; 3]);
    let centre = Point3::new(0.01, 0.02, 0.8);
    let mut pair = pair(Pose::new(rotation_from_rpy(0.0, 0.0, 0.0), centre.coords), centre);
    for (x, y) in (0..40).flat_map(|x| (0..40).map(move |y| (x, y))) {
        if x < 30 {
            pair.complete.set([x, y, 12]);
        }
        if y >= 20 {
            pair.complete.set([x, y, 25]);
            pair.complete.set([x, y, 24]);
        }
    }
    let rays = RandomRays { count: 500, target: RayTarget::Cells };
    let found = touch(&cube, true, rays, &pair, SimdLevel::detect());
    let mut stream = Stream::of_sample(5, &sample(), "touch");
    let (mut contacts, mut misses) = (found.contacts.iter(), found.misses.iter());
    let lower = pair.grid.lower_corner();
    let corner = |cell: [u32; 3]| lower.coords + Vector3::from(cell.map(f64::from)) * 0.002;
    for ray in 0..500 {
        let (x, y) = (stream.below(40) as u32, stream.below(40) as u32);
        let Some(z) = (if y >= 20 { Some(25) } else { (x < 30).then_some(12) }) else {
            let start = misses.next().expect("a ray through the hole");
            assert!((vector(*start) - corner([x, y, 39])).norm() < 1e-6);
            continue;
        };
        let contact = contacts.next().expect("a ray that meets a wall");
        assert_eq!((contact.probe, contact.cell), (ray, Some([x, y, z])));
        assert!((vector(contact.position) - corner([x, y, z])).norm() < 1e-6, "its lower corner");
        assert!((f64::from(contact.distance) - f64::from(39 - z) * 0.002).abs() < 1e-8);
        assert_eq!(contact.normal, [0.0, 0.0, 1.0]);
    }
    assert!(contacts.next().is_none() && misses.next().is_none());
    // A fixed case: the draws must never change.
    let first: Vec<_> = found.contacts.iter().take(4).map(|contact| (contact.probe, contact.cell)).collect();
    assert_eq!(format!("{first:?}"), GOLDEN);
}

const GOLDEN: &str =
    "[(0, Some([20, 14, 12])), (2, Some([13, 31, 25])), (3, Some([11, 7, 12])), (4, Some([34, 22, 25]))]";

const JOB: &str = r#"
name = "touch"
seed = 11
views = { even = 20 }

[[objects]]
built_in = ["can-01", "bowl-01", "half-cube-sphere"]
"#;

#[test]
fn switching_touch_on_changes_nothing_else() {
    let workspace = Workspace::new();
    workspace.write("job.toml", JOB);
    for (name, settings) in [("standard", &[][..]), ("thesis", &["profile=thesis"])] {
        let without = name.to_owned() + "-without";
        workspace.run_job("job", name).set(settings).set(["touch.random_rays=true"]).succeed();
        workspace.run_job("job", &without).set(settings).succeed();
        let payloads = |name: &str| {
            let reader = DatasetReader::open(&Folder::at(workspace.path(name))).expect("a dataset");
            let samples = reader.iter(Default::default()).map(|sample| sample.expect("a sample"));
            samples
                .map(|sample| {
                    let channels = sample.channels().filter(|channel| !channel.is_touch());
                    let payloads: Vec<_> =
                        channels.map(|channel| (channel, sample.payload(channel).map(<[u8]>::to_vec))).collect();
                    (sample.id, payloads, sample.touch().expect("sound records").len())
                })
                .collect::<Vec<_>>()
        };
        let (touched, plain) = (payloads(name), payloads(&without));
        assert!(touched.len() > 40 && touched.len() == plain.len());
        for (a, b) in touched.iter().zip(&plain) {
            assert_eq!((a.0, &a.1), (b.0, &b.1));
            assert_eq!((a.2, b.2), (1, 0));
        }
        // The shards of a job without touch do not know of it.
        for shard in list_shards(workspace.path(without)) {
            let bytes = fs::read(shard).expect("a shard");
            assert!(!bytes.windows(7).any(|word| word == b"Tactile"));
        }
    }
}
