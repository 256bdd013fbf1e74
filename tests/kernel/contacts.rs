//! Contacts of solids with true meshes, against parry's distances between convex solids and triangles.

use std::time::Instant;

use graspmill::{
    contact::{ContactScratch, ContactSurface, EDGE_RADIUS, Probe, SurfaceContact},
    geom::{Shape, TriMesh, rotation_from_rpy},
    seed::Stream,
    voxel::InsideTest,
};
use nalgebra::{IsometryMatrix3, Point3, Translation3, UnitQuaternion, Vector3};
use parry3d_f64::{
    math::{Pose, Rotation, Vector},
    query::distance,
    shape::{Ball, Capsule, Cuboid, Cylinder, Shape as ParryShape, TriMesh as ParryMesh},
};

use crate::support::meshes::built_in_mesh;

const SOLIDS: [Shape; 5] = [
    Shape::Sphere { radius: 0.003 },
    Shape::Sphere { radius: 0.006 },
    Shape::Capsule { radius: 0.01, half: 0.025 },
    Shape::Box { half: [0.02, 0.012, 0.006] },
    Shape::Cylinder { radius: 0.015, half: 0.0125 },
];

/// A mesh, and the core of a solid, as parry has them.
struct Peer {
    mesh: ParryMesh,
    solid: Box<dyn ParryShape>,
    thickness: f64,
}

impl Peer {
    /// With the edges of boxes and cylinders rounded as those of contacts are.
    fn new(mesh: &TriMesh, shape: &Shape) -> Self {
        Self::drawn_in(mesh, shape, EDGE_RADIUS, EDGE_RADIUS)
    }

    /// A solid whose box or cylinder is smaller all around by `by`, and has that thickness [m].
    fn drawn_in(mesh: &TriMesh, shape: &Shape, by: f64, thickness: f64) -> Self {
        let corners = mesh.vertices.iter().map(|corner| Vector::from(corner.map(f64::from))).collect();
        let (solid, thickness): (Box<dyn ParryShape>, f64) = match shape {
            Shape::Sphere { radius } => (Box::new(Ball::new(*radius)), 0.0),
            Shape::Capsule { radius, half } => (Box::new(Capsule::new_z(*half, *radius)), 0.0),
            Shape::Box { half } => (Box::new(Cuboid::new(Vector::from(half.map(|side| side - by)))), thickness),
            // parry's cylinder is along y.
            Shape::Cylinder { radius, half } => (Box::new(Cylinder::new(half - by, radius - by)), thickness),
            Shape::Mesh(_) => unreachable!("no solid"),
        };
        Self { mesh: ParryMesh::new(corners, mesh.triangles.clone()).expect("triangles"), solid, thickness }
    }

    /// Distance between the solid and the mesh's triangles [m]; not above 0 where they meet.
    fn distance(&self, shape: &Shape, placed: &IsometryMatrix3<f64>) -> f64 {
        let stood = match shape {
            Shape::Cylinder { .. } => {
                placed
                    * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2)
                        .to_rotation_matrix()
            }
            _ => *placed,
        };
        let quaternion = UnitQuaternion::from_rotation_matrix(&stood.rotation);
        let position: [f64; 3] = stood.translation.vector.into();
        let pose = Pose::from_parts(
            Vector::from(position),
            Rotation::from_xyzw(quaternion.i, quaternion.j, quaternion.k, quaternion.w),
        );
        distance(&pose, &*self.solid, &Pose::IDENTITY, &self.mesh).expect("known shapes").distance - self.thickness
    }
}

/// A solid at a random pose, brought to a distance of the mesh [m] along a straight way; `None` where it does not come so
/// near.
fn brought_near(
    surface: &ContactSurface,
    peer: &Peer,
    shape: &Shape,
    wanted: f64,
    draw: &mut Stream,
) -> Option<IsometryMatrix3<f64>> {
    let bounds = *surface.bounds();
    let inside = Point3::from(Vector3::from_fn(|axis, _| draw.uniform(bounds.min[axis], bounds.max[axis])));
    let angles = [(); 3].map(|()| draw.uniform(-3.0, 3.0));
    let rotation = rotation_from_rpy(angles[0], angles[1], angles[2]);
    let direction =
        rotation_from_rpy(draw.uniform(-3.0, 3.0), draw.uniform(-1.5, 1.5), draw.uniform(-3.0, 3.0)) * Vector3::x();
    let mut far = 0.4;
    for _ in 0..200 {
        let placed = IsometryMatrix3::from_parts(Translation3::from(inside.coords + direction * far), rotation);
        let apart = peer.distance(shape, &placed);
        if (apart - wanted).abs() < 1e-7 {
            return Some(placed);
        }
        far -= apart - wanted;
        if far < -0.1 || apart <= 0.0 {
            return None;
        }
    }
    None
}

/// Solids clear by a third of a millimetre or less: the nearest contact has parry's distance, and a smaller margin
/// finds none. After a push along its normal by less than half a millimetre, a single contact is as deep as the push;
/// pulled out by its depth, the solid is just free.
#[test]
fn contacts_are_as_near_as_parry_says() {
    let mut scratch = ContactScratch::default();
    let (mut out, mut deep) = (Vec::new(), Vec::new());
    let mut draw = Stream::of_job(1, b"", "contacts");
    let mut wrong = Vec::new();
    for name in ["mug-01", "can-01", "half-cube-diamond", "bowl-01"] {
        let mesh = built_in_mesh(name);
        let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
        for shape in &SOLIDS {
            let (peer, probe) = (Peer::new(&mesh, shape), Probe::new(shape).expect("a solid"));
            let (mut worst, mut worst_freed, mut alone, mut off) = (0f64, 0f64, 0, 0);
            let mut contacts = |placed: &IsometryMatrix3<f64>, margin: f64, out: &mut Vec<SurfaceContact>| {
                surface.contacts(&probe, placed, margin, &mut scratch, out);
            };
            let mut tried = 0;
            while tried < 100 {
                let wanted = draw.uniform(2e-5, 3e-4);
                let Some(placed) = brought_near(&surface, &peer, shape, wanted, &mut draw) else { continue };
                tried += 1;
                assert!(surface.clearance_at_least(&probe, &placed) <= wanted + 1e-9);
                contacts(&placed, wanted - 1e-5, &mut out);
                assert!(out.is_empty(), "{name} {shape:?} at {wanted}: {out:?}");
                contacts(&placed, 5e-4, &mut out);
                let found = out.first().map_or(f64::INFINITY, |contact| contact.distance);
                worst = worst.max((found - wanted).abs());
                off += usize::from((found - wanted).abs() > 1e-5);
                if (found - wanted).abs() > 2e-4 {
                    wrong.push(format!("{name} {shape:?}: {found} for {wanted}: {placed:?}"));
                    continue;
                }
                let normal = out[0].normal.into_inner();
                let mut pushed = placed;
                pushed.translation.vector -= normal * (wanted + draw.uniform(1e-5, 4e-4));
                contacts(&pushed, 0.0, &mut deep);
                let Some(deepest) = deep.first() else {
                    wrong.push(format!("{name} {shape:?}: pushed in and free: {:?} {pushed:?}", out[0]));
                    continue;
                };
                if deep.len() == 1 {
                    alone += 1;
                    let mut freed = pushed;
                    freed.translation.vector += deepest.normal.into_inner() * (1e-6 - deepest.distance);
                    let apart = peer.distance(shape, &freed);
                    worst_freed = worst_freed.max(apart);
                    if apart > 1e-4 {
                        wrong.push(format!("{name} {shape:?}: pulled out by {} it is {apart} free", deepest.distance));
                    }
                }
            }
            println!(
                "{name} {shape:?}: {off} of 100 off by more than 10 um, {:.2} um worst when clear, pulled out of {alone} {:.2} um worst",
                1e6 * worst,
                1e6 * worst_freed
            );
            if off > 5 {
                wrong.push(format!("{name} {shape:?}: {off} of 100 are off by more than 10 um"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Boxes and cylinders with their edges, and drawn in all around, are as far from a mesh as parry's.
#[test]
fn sharp_solids_are_as_far_as_parry_says() {
    const REACH: f64 = 0.012;
    let mut scratch = ContactScratch::default();
    let mut draw = Stream::of_job(1, b"", "sharp");
    for name in ["mug-01", "half-cube-diamond"] {
        let mesh = built_in_mesh(name);
        let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
        for shape in &SOLIDS[3..] {
            for by in [0.0, 1.5e-4, 0.002] {
                let peer = Peer::drawn_in(&mesh, shape, by, 0.0);
                let probe = Probe::sharp(shape).expect("a solid").drawn_in(by);
                let (mut tried, mut worst) = (0, 0f64);
                while tried < 40 {
                    let wanted = draw.uniform(2e-5, 0.01);
                    let Some(placed) = brought_near(&surface, &peer, shape, wanted, &mut draw) else { continue };
                    tried += 1;
                    let found = surface.distance_within(&probe, &placed, &(-0.001..=REACH), &mut scratch);
                    worst = worst.max((found - peer.distance(shape, &placed)).abs());
                }
                assert!(worst < 2e-6, "{name} {shape:?} drawn in by {by}: off by {worst}");
            }
        }
    }
}

/// Points of the core of a solid whose edges are rounded by a radius [m], with steps of 2 mm at most between neighbours.
fn core_points(shape: &Shape, edge: f64) -> Vec<Point3<f64>> {
    const STEP: f64 = 0.002;
    let (half, round) = match *shape {
        Shape::Sphere { .. } => ([0.0; 3], false),
        Shape::Capsule { half, .. } => ([0.0, 0.0, half], false),
        Shape::Box { half } => (half.map(|side| side - edge), false),
        Shape::Cylinder { radius, half } => ([radius - edge, radius - edge, half - edge], true),
        Shape::Mesh(_) => unreachable!("no solid of a hand"),
    };
    let along = half.map(|side| {
        let steps = (2.0 * side / STEP).ceil() as i32;
        (0..=steps)
            .map(move |step| if steps == 0 { 0.0 } else { side * (2.0 * f64::from(step) / f64::from(steps) - 1.0) })
    });
    let [x, y, z] = along.map(Iterator::collect::<Vec<f64>>);
    let mut points = Vec::new();
    for &x in &x {
        for &y in &y {
            points.extend(z.iter().map(|&z| Point3::new(x, y, z)));
        }
    }
    points.retain(|point| !round || point.x.hypot(point.y) <= half[0]);
    points
}

/// A distance without contacts is that of the nearest or deepest point of the core, compared with many points of the
/// core, with rounded edges, and with sharp ones if the smaller of both is used: exact within its range; beyond it no
/// less than its end; its start for deeper solids.
#[test]
fn distances_without_contacts_are_those_of_a_solids_points() {
    const REACH: f64 = 0.012;
    // To the next of these points.
    const BETWEEN: f64 = 0.0018;
    let mut scratch = ContactScratch::default();
    let mut draw = Stream::of_job(1, b"", "distances");
    for name in ["mug-01", "can-01", "half-cube-diamond", "bowl-01"] {
        let mesh = built_in_mesh(name);
        let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
        let bounds = *surface.bounds();
        let (mut deep, mut within, mut beyond) = (0, 0, 0);
        for index in 0..300 {
            let shape = &SOLIDS[index % SOLIDS.len()];
            let edge = if index % 2 == 0 { EDGE_RADIUS } else { 0.0 };
            let at = Vector3::from_fn(|axis, _| draw.uniform(bounds.min[axis] - 0.03, bounds.max[axis] + 0.03));
            let angles = [(); 3].map(|()| draw.uniform(-3.0, 3.0));
            let rotation = rotation_from_rpy(angles[0], angles[1], angles[2]);
            let placed = IsometryMatrix3::from_parts(Translation3::from(at), rotation);
            let floor = -draw.uniform(0.0, 0.003);
            let mut distance = |probe: Option<Probe>| {
                surface.distance_within(&probe.expect("a solid"), &placed, &(floor..=REACH), &mut scratch)
            };
            // The distance of a sharp solid that is cut may be too large: the rounded one within it is also queried.
            let found = if edge == 0.0 {
                distance(Probe::sharp(shape)).min(distance(Probe::new(shape)))
            } else {
                distance(Probe::new(shape))
            };
            let thickness = match *shape {
                Shape::Sphere { radius } | Shape::Capsule { radius, .. } => radius,
                _ => edge,
            };
            let distances =
                core_points(shape, edge).into_iter().map(|point| surface.signed_distance(&(placed * point)));
            let sampled = distances.fold(f64::INFINITY, f64::min) - thickness;
            let says = format!("{name} {index}: {found} in {floor}..={REACH}, sampled {sampled}");
            assert!(found >= floor, "{says}");
            if found == floor {
                deep += 1;
                assert!(sampled - BETWEEN <= floor + 5e-5, "{says}");
            } else if found < REACH {
                within += 1;
                // Inside, the distance is that of the deepest of pieces of 4 mm.
                let told = if found > 5e-5 - thickness { 1e-6 } else { 0.002 };
                assert!((sampled - BETWEEN..=sampled + told).contains(&found), "{says}");
            } else {
                beyond += 1;
                assert!(sampled >= REACH - 1e-6, "{says}");
            }
        }
        println!("{name}: {deep} deep, {within} within, {beyond} beyond");
        assert!(deep > 30 && within > 30 && beyond > 30, "{name}: {deep} {within} {beyond}");
    }
}

/// A box as large as a palm that parry finds in a mesh is found there by its depth alone. With a wide margin a nearer
/// point next to it can replace it: hands are tested for overlap without one.
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn assert_overlap_is_found(boxes: usize) {
    const OVERLAP: f64 = 1e-4;
    let mut scratch = ContactScratch::default();
    let (mut deep, mut wide) = (Vec::new(), Vec::new());
    let mut draw = Stream::of_job(1, b"", "overlaps");
    let palm = Shape::Box { half: [0.06, 0.062, 0.02] };
    let (mut overlapping, mut hidden) = (0, 0);
    for name in ["mug-01", "can-01", "box-01"] {
        let mesh = built_in_mesh(name);
        let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
        let (peer, probe) = (Peer::new(&mesh, &palm), Probe::new(&palm).expect("a solid"));
        let (bounds, radius) = (surface.bounds(), (surface.bounds().max - surface.bounds().min).norm() / 2.0);
        for _ in 0..boxes {
            let axis = Vector3::from_fn(|_, _| draw.normal());
            let rotation = UnitQuaternion::from_scaled_axis(axis.normalize() * draw.uniform(0.0, 3.1));
            let away = Vector3::from_fn(|_, _| draw.normal()).normalize() * draw.uniform(0.4 * radius, radius + 0.05);
            let placed = IsometryMatrix3::from_parts(
                Translation3::from(bounds.centre().coords + away),
                rotation.to_rotation_matrix(),
            );
            if peer.distance(&palm, &placed) < -2.0 * OVERLAP {
                overlapping += 1;
                surface.contacts(&probe, &placed, -OVERLAP, &mut scratch, &mut deep);
                assert!(deep.first().is_some_and(|contact| contact.distance < -OVERLAP), "{name} at {placed:?}");
                surface.contacts(&probe, &placed, 0.002, &mut scratch, &mut wide);
                hidden += usize::from(wide.first().is_none_or(|contact| contact.distance >= -OVERLAP));
            }
        }
    }
    println!("{overlapping} boxes in a mesh; a margin of 2 mm hides {hidden}");
    assert!(overlapping > 2 * boxes / 3, "{overlapping}");
}

#[test]
fn overlap_is_found_by_depth_alone() {
    assert_overlap_is_found(400);
}

#[test]
#[ignore = "slow: make test-all"]
fn overlap_is_found_by_depth_alone_often() {
    assert_overlap_is_found(1500);
}

#[test]
fn cost_of_a_contact() {
    // Shown, not judged.
    let mesh = built_in_mesh("mug-01@16k");
    let began = Instant::now();
    let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
    println!("{} triangles: {:?} to prepare", mesh.triangles.len(), began.elapsed());
    let (mut scratch, mut out) = (ContactScratch::default(), Vec::new());
    let mut draw = Stream::of_job(2, b"", "contacts");
    for shape in &SOLIDS {
        let (peer, probe) = (Peer::new(&mesh, shape), Probe::new(shape).expect("a solid"));
        for (said, clear, margin) in [("touching", 1e-4, 2e-4), ("2 mm clear", 2e-3, 0.0), ("2 cm clear", 2e-2, 0.0)] {
            let mut poses = Vec::new();
            while poses.len() < 50 {
                poses.extend(brought_near(&surface, &peer, shape, clear, &mut draw));
            }
            let began = Instant::now();
            let mut count = 0;
            for _ in 0..20 {
                for pose in &poses {
                    surface.contacts(&probe, pose, margin, &mut scratch, &mut out);
                    count += out.len();
                }
            }
            println!("{shape:?} {said}: {:?}, {:.1} contacts", began.elapsed() / 1000, count as f64 / 1000.0);
        }
    }
}
