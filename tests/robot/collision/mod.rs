//! Collision checks against parry's, shape by shape, and coal's; and what the depth of an overlap promises.

mod coal;
mod maps;

use std::{collections::BTreeMap, f64::consts::TAU, time::Instant};

use graspmill::{
    collision::{Bodies, Body, Care, CollisionChecker, CollisionVerdict, Geometry, Shape},
    kinematics::PlanningGroup,
    seed::Stream,
};
use nalgebra::{IsometryMatrix3, Point3, Rotation3, Unit, Vector3};

use crate::support::{
    robots::{FETCH, FETCH_ARM, FETCH_MESHES, FETCH_SITE, TX60L, TX60L_JOINTS, TX60L_SITE, open_robot, random_values},
    touch_test::TouchTest,
};

/// Scene, joints and site of a robot.
type Scene = (&'static str, &'static [&'static str], &'static str);

const MESH_FETCH: Scene = (FETCH_MESHES, &FETCH_ARM, FETCH_SITE);
const SCENES: [Scene; 3] = [(FETCH, &FETCH_ARM, FETCH_SITE), MESH_FETCH, (TX60L, &TX60L_JOINTS, TX60L_SITE)];

struct Robot {
    group: PlanningGroup,
    bodies: Bodies,
    checker: CollisionChecker,
    touch: TouchTest,
    stream: Stream,
}

/// Poses of the links, the world first.
type Links = Vec<IsometryMatrix3<f64>>;

impl Robot {
    fn open((scene, joints, site): Scene, purpose: &str) -> Self {
        let none = BTreeMap::new();
        let model = open_robot(scene);
        let group = model.planning_group(joints, site, &none).expect("a group");
        let bodies = model.bodies(joints, &none).expect("bodies");
        let checker = CollisionChecker::new(&bodies).expect("shapes");
        let touch = TouchTest::new(&bodies).expect("shapes");
        Self { group, bodies, checker, touch, stream: Stream::of_job(1, scene.as_bytes(), purpose) }
    }

    fn configuration(&mut self) -> Vec<f64> {
        random_values(&self.group, &mut self.stream)
    }

    fn links(&self, q: &[f64]) -> Links {
        let mut links = vec![IsometryMatrix3::identity(); q.len() + 1];
        self.group.link_frames(q, &mut links[1..]);
        links
    }

    fn name(&self, pair: usize) -> String {
        let [one, other] = self.bodies.pairs[pair].map(|body| &self.bodies.bodies[body].name);
        format!("{one} - {other}")
    }

    fn has_mesh(&self, pair: usize) -> bool {
        self.bodies.pairs[pair]
            .iter()
            .any(|body| self.bodies.bodies[*body].geometries.iter().any(|g| matches!(g.shape, Shape::Mesh(_))))
    }

    /// Parry's verdict, for which a mesh is its surface.
    fn surfaces_touch(&self, pair: usize, links: &Links) -> bool {
        self.touch.touches(self.bodies.pairs[pair], &links[1..])
    }

    fn random_direction(&mut self) -> Unit<Vector3<f64>> {
        let (height, azimuth) = (self.stream.uniform(-1.0, 1.0), self.stream.uniform(0.0, TAU));
        let side = (1.0 - height * height).sqrt();
        Unit::new_normalize(Vector3::new(side * azimuth.cos(), side * azimuth.sin(), height))
    }
}

/// A hall's floor: a body as large as that has a tree no deeper, and a lattice no finer, than one of a robot's link.
#[test]
fn a_floor_of_thirty_metres_is_a_body_like_any_other() {
    let body = |name: &str, link, half| {
        let geometries = vec![Geometry { shape: Shape::Box { half }, link_from_shape: IsometryMatrix3::identity() }];
        Body { name: name.to_owned(), link, geometries }
    };
    let bodies = vec![body("floor", 0, [15.0, 15.0, 0.05]), body("hand", 1, [0.05, 0.04, 0.03])];
    let checker = CollisionChecker::new(&Bodies { bodies, pairs: vec![[0, 1], [1, 0]] }).expect("shapes");
    for (height, x, touches) in [(0.0785, 14.0, true), (0.0815, 14.0, false), (0.0785, 15.1, false), (0.0, 0.0, true)] {
        let links = [IsometryMatrix3::identity(), IsometryMatrix3::translation(x, -3.0, height)];
        for pair in [0, 1] {
            assert_eq!(checker.pair(pair, &links), touches, "{height} m up, {x} m out, pair {pair}");
        }
    }
}

/// A small part of a body that lies wholly inside another, at its wall or deep inside, while the rest is far away.
#[test]
fn what_lies_wholly_inside_is_found() {
    let mut stream = Stream::of_job(1, b"inside", "places");
    let at = |position: [f64; 3], rotation| IsometryMatrix3::from_parts(Vector3::from(position).into(), rotation);
    let still = Rotation3::identity();
    let walls = [0.5, 0.3, 0.2];
    for (shape, reach) in [
        (Shape::Box { half: [0.0003, 0.0005, 0.0011] }, 0.0013),
        (Shape::Box { half: [0.02, 0.01, 0.06] }, 0.065),
        (Shape::Sphere { radius: 0.02 }, 0.02),
        (Shape::Capsule { radius: 0.002, half: 0.1 }, 0.102),
        (Shape::Cylinder { radius: 0.03, half: 0.002 }, 0.031),
    ] {
        // Each wall, both sides of it, and both orders of the bodies.
        for round in 0..12 {
            let rotation = Rotation3::from_euler_angles(stream.unit(), stream.unit(), stream.unit());
            let mut position = walls.map(|wall| stream.uniform(-(wall - reach), wall - reach));
            if round % 2 == 0 {
                position[round % 3] = walls[round % 3] - reach - 1e-5;
            }
            let rest = Geometry { shape: Shape::Sphere { radius: 0.1 }, link_from_shape: at([3.0, 0.0, 0.0], still) };
            let part = Geometry { shape: shape.clone(), link_from_shape: at(position, rotation) };
            let far = Geometry { shape: Shape::Box { half: [0.1; 3] }, link_from_shape: at([0.0, 3.0, 0.0], still) };
            let block = Geometry { shape: Shape::Box { half: walls }, link_from_shape: at([0.0; 3], still) };
            let body = |name: &str, link, geometries| Body { name: name.to_owned(), link, geometries };
            let inner = body("inner", 1, vec![rest, far, part]);
            let mut bodies = vec![body("outer", 0, vec![block]), inner];
            if round % 4 < 2 {
                bodies.reverse();
            }
            let checker = CollisionChecker::new(&Bodies { bodies, pairs: vec![[0, 1]] }).expect("shapes");
            let links = [at([0.0; 3], still), at([0.0; 3], still)];
            let CollisionVerdict::Collides(hit) = checker.check([0], &links) else {
                panic!("{shape:?} at {position:?}")
            };
            let depth = checker.depth(&hit, &links, Care::Short, f64::INFINITY);
            let out = (0..3).map(|axis| walls[axis] - position[axis].abs()).fold(f64::INFINITY, f64::min) + reach;
            assert!(depth <= out, "{shape:?} at {position:?}: {depth}");
            let beside = [at([0.0; 3], still), at([0.0, 0.0, 1.0], still)];
            assert_eq!(checker.check([0], &beside), CollisionVerdict::Free);
        }
    }
}

/// Every pair of bodies in 2,000 configurations.
#[test]
fn pairs_touch_where_parry_says() {
    for scene in SCENES {
        let mut robot = Robot::open(scene, "pairs");
        let (mut touching, mut inside, mut free) = (0, BTreeMap::<String, u32>::new(), 0);
        for _ in 0..2000 {
            let q = robot.configuration();
            let links = robot.links(&q);
            let mut first = None;
            for pair in 0..robot.bodies.pairs.len() {
                let (ours, theirs) = (robot.checker.pair(pair, &links), robot.surfaces_touch(pair, &links));
                touching += u32::from(ours);
                first = first.or(ours.then_some(pair));
                if ours && !theirs && robot.has_mesh(pair) {
                    // One lies inside the other: for parry a mesh is its surface.
                    *inside.entry(robot.name(pair)).or_default() += 1;
                    continue;
                }
                assert_eq!(ours, theirs, "{}: {} {q:?}", scene.0, robot.name(pair));
            }
            // All pairs at once: the first that touches.
            match robot.checker.check(0..robot.bodies.pairs.len(), &links) {
                CollisionVerdict::Free => assert_eq!(first, None),
                CollisionVerdict::Collides(hit) => assert_eq!(first, Some(hit.pair)),
            }
            free += u32::from(first.is_none());
        }
        println!(
            "{}: {touching} pairs touch, {free} of 2,000 configurations are free; inside a mesh: {inside:?}",
            scene.0
        );
        assert!(touching > 1000 && free > 200);
    }
}

/// A body is moved, seen from the other, by a little less than the depth: the two still overlap. As judged by parry where
/// both are solid; of meshes by the checker itself where parry finds no surfaces that touch.
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn assert_bodies_overlap(count: u32) {
    for scene in SCENES {
        let mut robot = Robot::open(scene, "depth");
        let (mut overlaps, mut touches, mut inside, mut deepest) = (0, 0, 0, 0.0f64);
        while overlaps < count {
            let q = robot.configuration();
            let links = robot.links(&q);
            for pair in 0..robot.bodies.pairs.len() {
                let CollisionVerdict::Collides(hit) = robot.checker.check([pair], &links) else { continue };
                let depth = robot.checker.depth(&hit, &links, Care::Short, f64::INFINITY);
                if depth == 0.0 {
                    touches += 1;
                    continue;
                }
                overlaps += 1;
                deepest = deepest.max(depth);
                for motion in 0..12 {
                    let moved = move_one(&mut robot, pair, &links, depth, motion);
                    if robot.surfaces_touch(pair, &moved) {
                        continue;
                    }
                    let still = robot.has_mesh(pair) && robot.checker.pair(pair, &moved);
                    assert!(still, "{}: {} come apart within {depth} m at {q:?}", scene.0, robot.name(pair));
                    inside += 1;
                }
            }
        }
        println!(
            "{}: {overlaps} overlaps up to {deepest:.3} m deep, {touches} of unknown depth; {inside} motions led into a mesh",
            scene.0
        );
        assert!(touches < overlaps / 2);
    }
}

#[test]
fn bodies_overlap_by_the_depth_at_least() {
    assert_bodies_overlap(150);
}

#[test]
#[ignore = "slow: make test-all"]
fn bodies_overlap_by_the_depth_at_least_often() {
    assert_bodies_overlap(1500);
}

/// The second body of a pair moved by a thousandth less than `depth`, measured at its corner that goes farthest: straight
/// (away from the other body at first), or turned about some point too.
fn move_one(robot: &mut Robot, pair: usize, links: &Links, depth: f64, motion: u32) -> Links {
    let [one, other] = robot.bodies.pairs[pair];
    let [one_link, link] = [one, other].map(|body| robot.bodies.bodies[body].link);
    let in_world = |body: usize, link: usize| -> Vec<Point3<f64>> {
        robot.checker.corners(body).map(|corner| links[link] * corner).collect()
    };
    let (fixed, corners) = (in_world(one, one_link), in_world(other, link));
    let middle = |corners: &[Point3<f64>]| {
        corners.iter().map(|corner| corner.coords).sum::<Vector3<f64>>() / corners.len() as f64
    };
    let away = middle(&corners) - middle(&fixed);
    let direction = if motion == 0 { Unit::new_normalize(away) } else { robot.random_direction() };
    let angle = if motion < 6 { 0.0 } else { robot.stream.uniform(0.0, 3.0 * depth / 0.1) };
    let (axis, about) = (robot.random_direction(), corners[robot.stream.below(corners.len() as u64) as usize]);
    let straight = if motion < 6 { depth } else { robot.stream.uniform(0.0, depth) };
    let moved_by = |share: f64| {
        let rotation = Rotation3::from_axis_angle(&axis, share * angle);
        let shift = about.coords - rotation * about.coords + direction.into_inner() * (share * straight);
        IsometryMatrix3::from_parts(shift.into(), rotation)
    };
    let farthest = |share: f64| {
        let motion = moved_by(share);
        corners.iter().map(|corner| (motion * corner - corner).norm()).fold(0.0, f64::max)
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let share = 0.5 * (low + high);
        if farthest(share) <= 0.999 * depth { low = share } else { high = share }
    }
    let mut moved = links.clone();
    moved[link] = moved_by(low) * links[link];
    moved
}

/// The whole robot, in 100,000 configurations: coal's verdict, and the time of a check compared with coal's and
/// MuJoCo's.
#[test]
#[ignore = "slow: make test-all"]
fn the_mesh_fetch_collides_where_coal_says() {
    let mut robot = Robot::open(MESH_FETCH, "coal");
    let configurations: Vec<[f64; 7]> =
        (0..100_000).map(|_| robot.configuration().try_into().expect("seven joints")).collect();
    let links: Vec<Links> = configurations.iter().map(|q| robot.links(q)).collect();
    let pairs = robot.bodies.pairs.len();
    let began = Instant::now();
    let ours: Vec<bool> =
        links.iter().map(|links| robot.checker.check(0..pairs, links) != CollisionVerdict::Free).collect();
    let our_time = began.elapsed();
    let theirs = coal::ask_coal(&robot.bodies, &configurations);
    let mut worker = open_robot(FETCH_MESHES).contact_worker(&FETCH_ARM, &BTreeMap::new()).expect("a worker");
    let began = Instant::now();
    let hulls = configurations[..10_000].iter().filter(|q| !worker.contacts(&q[..]).is_empty()).count();
    let mujocos = began.elapsed();
    let collide = ours.iter().filter(|collides| **collides).count();
    println!("{collide} of 100,000 configurations collide");
    println!("ours: {:.2} us per configuration", our_time.as_secs_f64() * 10.0);
    println!("coal: {}", theirs.facts);
    println!(
        "MuJoCo, of convex hulls, with forward kinematics: {:.1} us; {hulls} of the first 10,000 collide, for us {}",
        mujocos.as_secs_f64() * 100.0,
        ours[..10_000].iter().filter(|collides| **collides).count()
    );
    let mut differ = 0;
    for (index, (ours, theirs)) in ours.iter().zip(&theirs.collides).enumerate() {
        if ours != theirs {
            differ += 1;
            let touching = (0..pairs).filter(|pair| robot.checker.pair(*pair, &links[index]));
            let names: Vec<_> = touching
                .map(|pair| {
                    (
                        robot.name(pair),
                        robot.surfaces_touch(pair, &links[index]),
                        robot.checker.check([pair], &links[index]),
                    )
                })
                .collect();
            println!("{:?}: ours {names:?}, coal {theirs}", configurations[index]);
        }
    }
    assert_eq!(differ, 0);
}
