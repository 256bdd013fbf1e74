//! Motions of the Fetch among tables and boxes: verdicts with obstacles that come and go, certified paths, whole grasps.

use std::{collections::BTreeMap, time::Instant};

use graspmill::{
    collision::{Body, CollisionChecker, Geometry, Obstacle, PlacedObstacle, Shape},
    geom::OccupancyGrid,
    runtime::planner::motion::{
        ArmScene, Checks, GraspPose, GraspScenes, InverseArm, MotionLevel, MotionSettings, MotionVerdict, PathKey,
        PathSettings, PathVerdict, plan_grasp, plan_path,
    },
    seed::Stream,
};
use nalgebra::{IsometryMatrix3, Vector3};

use crate::support::robots::{FETCH, FETCH_ARM, FETCH_SITE, open_robot, random_values};

/// The arm beside the body, as the maker's own demonstrations start.
const TUCKED: [f64; 7] = [1.32, 1.4, -0.2, 1.72, 0.0, 1.66, 0.0];

struct Fetch {
    group: graspmill::kinematics::PlanningGroup,
    bodies: graspmill::collision::Bodies,
    robot: ArmScene,
}

impl Fetch {
    fn open() -> Self {
        let (model, none) = (open_robot(FETCH), BTreeMap::new());
        let group = model.planning_group(&FETCH_ARM, FETCH_SITE, &none).expect("the arm");
        let bodies = model.bodies(&FETCH_ARM, &none).expect("bodies");
        let robot = ArmScene::new(&group, CollisionChecker::for_obstacles(&bodies).expect("shapes"));
        Self { group, bodies, robot }
    }

    fn among(&self, obstacles: &[PlacedObstacle]) -> ArmScene {
        self.robot.among(obstacles, |_| true)
    }
}

fn geometry(shape: Shape) -> Vec<Geometry> {
    vec![Geometry { shape, link_from_shape: IsometryMatrix3::identity() }]
}

/// A table with five boxes on it, as shapes and poses in the world.
fn table(draw: &mut Stream) -> Vec<(Shape, IsometryMatrix3<f64>)> {
    let height = draw.uniform(0.5, 0.8);
    let mut all = vec![(Shape::Box { half: [0.4, 0.6, 0.02] }, IsometryMatrix3::translation(0.85, 0.0, height - 0.02))];
    for _ in 0..5 {
        let half = [draw.uniform(0.02, 0.06), draw.uniform(0.02, 0.06), draw.uniform(0.04, 0.15)];
        let at = IsometryMatrix3::translation(draw.uniform(0.5, 1.0), draw.uniform(-0.5, 0.5), height + half[2]);
        all.push((Shape::Box { half }, at * IsometryMatrix3::rotation(Vector3::z() * draw.uniform(0.0, 3.0))));
    }
    all
}

fn placed(shapes: &[(Shape, IsometryMatrix3<f64>)]) -> Vec<PlacedObstacle> {
    let place = |(shape, pose): &(Shape, IsometryMatrix3<f64>)| {
        Obstacle::new(&geometry(shape.clone())).expect("a shape").at(*pose)
    };
    shapes.iter().map(place).collect()
}

/// A free configuration with the end effector above the table, not far from its boxes.
fn above_table(fetch: &Fetch, scene: &ArmScene, draw: &mut Stream) -> Vec<f64> {
    loop {
        let q = random_values(&fetch.group, draw);
        let at = fetch.group.forward(&q).translation().into_owned();
        let above = (0.4..1.0).contains(&at.x) && at.y.abs() < 0.5 && (0.5..1.1).contains(&at.z);
        if above && scene.touch(&q, &mut Checks::default()).is_none() && scene.clear_by(&q, 1e-3) {
            return q;
        }
    }
}

/// Whether the plain checker finds no contact along a path, at most a milliradian between checks.
#[track_caller]
fn assert_free(scene: &ArmScene, path: &[Vec<f64>]) {
    let mut checks = Checks::default();
    for edge in path.windows(2) {
        let difference = scene.space().difference(&edge[0], &edge[1]);
        assert_eq!(scene.touch(&edge[0], &mut checks), None);
        assert!(scene.samples_free(&edge[0], &difference, 1e-3, &mut checks), "{edge:?}");
    }
}

#[test]
fn obstacles_of_the_fetch_touch_as_in_a_checker_built_with_them() {
    let fetch = Fetch::open();
    let mut draw = Stream::of_job(1, b"fetch", "obstacles");
    let mut shapes = table(&mut draw);
    shapes.push((Shape::Cylinder { radius: 0.05, half: 0.15 }, IsometryMatrix3::translation(0.7, 0.3, 0.9)));
    shapes.push((Shape::Sphere { radius: 0.1 }, IsometryMatrix3::translation(0.6, -0.4, 1.0)));
    let scene = fetch.among(&placed(&shapes));
    let mut bodies = fetch.bodies.clone();
    for (index, (shape, pose)) in shapes.into_iter().enumerate() {
        let geometries = vec![Geometry { shape, link_from_shape: pose }];
        bodies.bodies.push(Body { name: format!("obstacle {index}"), link: 0, geometries });
    }
    bodies.pairs = (0..scene.pairs()).map(|pair| scene.touch_of(pair).bodies).collect();
    let scratch = CollisionChecker::new(&bodies).expect("shapes");
    let mut touching = 0;
    for _ in 0..2000 {
        let links = scene.links(&random_values(&fetch.group, &mut draw));
        for pair in 0..scene.pairs() {
            let touches = scene.checker().pair(pair, &links);
            assert_eq!(touches, scratch.pair(pair, &links), "{:?}", scene.touch_of(pair));
            touching += u32::from(touches);
        }
    }
    assert!(touching > 2000, "{touching}");
}

#[test]
fn paths_of_the_fetch_over_a_table_are_free_and_the_same_each_time() {
    let fetch = Fetch::open();
    let mut draw = Stream::of_job(2, b"fetch", "tables");
    let mut found = 0;
    for round in 0..8_u8 {
        let obstacles = placed(&table(&mut draw));
        let scene = fetch.among(&obstacles);
        let goals: Vec<_> = (0..3).map(|_| above_table(&fetch, &scene, &mut draw)).collect();
        if scene.touch(&TUCKED, &mut Checks::default()).is_some() {
            continue;
        }
        let key = [round];
        let plan = || plan_path(&scene, &TUCKED, &goals, &PathKey::new(1, &key), &PathSettings::default());
        let began = Instant::now();
        let (verdict, work) = plan();
        println!("{:.1} ms, {work:?}", began.elapsed().as_secs_f64() * 1e3);
        assert_eq!(plan(), (verdict.clone(), work));
        let PathVerdict::Found(path) = verdict else { panic!("{verdict:?}") };
        assert!(path.waypoints.iter().all(|q| fetch.group.within_limits(q)));
        assert_free(&scene, &path.waypoints);
        found += 1;
    }
    assert!(found >= 4, "{found}");
}

/// Grasps at random poses above the table: the end effector comes along its own x.
#[test]
fn grasps_of_the_fetch_are_reached_along_straight_lines() {
    let fetch = Fetch::open();
    let arm = InverseArm::new(&fetch.group, 1);
    assert!(arm.is_exact());
    let mut draw = Stream::of_job(3, b"fetch", "grasps");
    let mut verdicts = BTreeMap::<String, u32>::new();
    for round in 0..12_u8 {
        let obstacles = placed(&table(&mut draw));
        let scene = fetch.among(&obstacles);
        let grasp = fetch.group.forward(&above_table(&fetch, &scene, &mut draw));
        let pose = GraspPose { grasp, approach: Vector3::x_axis() };
        let scenes = GraspScenes { way: &scene, approach: &scene, lift: &scene };
        let (key, settings) = ([round], MotionSettings::default());
        let plan = || plan_grasp(&arm, &scenes, &TUCKED, &pose, &PathKey::new(1, &key), &settings);
        let report = plan();
        assert_eq!(plan(), report);
        let name = format!("{:?}", report.verdict);
        *verdicts.entry(name.split(['(', ' ']).next().unwrap_or_default().to_owned()).or_default() += 1;
        let MotionVerdict::Valid(motion) = report.verdict else {
            assert!(report.level < MotionLevel::Path);
            continue;
        };
        assert_eq!(report.level, MotionLevel::Path);
        assert_eq!(motion.path.waypoints.last().map(Vec::len), Some(7));
        for path in [&motion.path.waypoints, &motion.lines.approach, &motion.lines.lift] {
            assert_free(&scene, path);
        }
        // The path ends where the approach begins; both lines are straight and keep the orientation.
        let pregrasp = pose.grasp.translation() - pose.grasp.rotation() * Vector3::x() * 0.1;
        let at = |q: &[f64]| fetch.group.forward(q);
        let end = at(motion.path.waypoints.last().expect("an end"));
        assert!((end.translation() - pregrasp).norm() < 1e-9);
        let up = pose.grasp.translation() + Vector3::z() * 0.1;
        for (line, from, to) in [
            (&motion.lines.approach, pregrasp, *pose.grasp.translation()),
            (&motion.lines.lift, *pose.grasp.translation(), up),
        ] {
            assert_eq!(line.len(), 51);
            for (step, q) in line.iter().enumerate() {
                let expected = from + (to - from) * (step as f64 / 50.0);
                assert!((at(q).translation() - expected).norm() < 1e-6);
                assert!((at(q).rotation().matrix() - pose.grasp.rotation().matrix()).amax() < 1e-6);
            }
        }
    }
    println!("{verdicts:?}");
    assert!(verdicts.get("Valid").is_some_and(|valid| *valid >= 3), "{verdicts:?}");
}

#[test]
fn poses_out_of_reach_or_in_a_table_are_named() {
    let fetch = Fetch::open();
    let arm = InverseArm::new(&fetch.group, 1);
    let block = (Shape::Box { half: [0.1; 3] }, IsometryMatrix3::translation(0.7, 0.0, 0.8));
    let scene = fetch.among(&placed(&[block]));
    let scenes = GraspScenes { way: &scene, approach: &scene, lift: &scene };
    let plan = |x: f64| {
        let grasp = graspmill::geom::Pose::from_isometry(IsometryMatrix3::translation(x, 0.0, 0.8));
        let pose = GraspPose { grasp, approach: Vector3::x_axis() };
        plan_grasp(&arm, &scenes, &TUCKED, &pose, &PathKey::new(1, b""), &MotionSettings::default())
    };
    let far = plan(2.0);
    assert_eq!((far.verdict, far.level), (MotionVerdict::NoIk, MotionLevel::Unreachable));
    let inside = plan(0.7);
    let obstacle = fetch.bodies.bodies.len();
    assert!(matches!(inside.verdict, MotionVerdict::ApproachBlocked(touch) if touch.bodies[1] == obstacle));
    assert_eq!(inside.level, MotionLevel::Unreachable);
}

/// Completed cells cost milliseconds, primitives microseconds.
#[test]
fn a_completed_grid_is_an_obstacle() {
    let fetch = Fetch::open();
    let mut grid = OccupancyGrid::new(40);
    for x in 0..40_u32 {
        for y in 0..40 {
            for z in 0..40 {
                let out = [x, y, z].map(|cell| f64::from(cell) - 19.5).iter().map(|side| side * side).sum::<f64>();
                if out < 16.0 * 16.0 {
                    grid.set([x, y, z]);
                }
            }
        }
    }
    let began = Instant::now();
    let cells = Obstacle::of_cells(&grid, 0.0075).expect("cells");
    println!("{:.2} ms for a grid", began.elapsed().as_secs_f64() * 1e3);
    let corner = IsometryMatrix3::translation(0.8 - 0.15, -0.15, 0.7 - 0.15);
    let began = Instant::now();
    let scene = fetch.among(&[cells.at(corner)]);
    println!("{:.3} ms for a scene", began.elapsed().as_secs_f64() * 1e3);
    let ball =
        |radius| fetch.among(&placed(&[(Shape::Sphere { radius }, IsometryMatrix3::translation(0.8, 0.0, 0.7))]));
    // Between the balls inside and outside of the cells.
    let (smaller, larger) = (ball(15.0 * 0.0075), ball(17.0 * 0.0075));
    let mut draw = Stream::of_job(4, b"fetch", "cells");
    let mut touching = 0;
    for _ in 0..2000 {
        let links = scene.links(&random_values(&fetch.group, &mut draw));
        for pair in 0..scene.pairs() {
            let touches = |scene: &ArmScene| scene.checker().pair(pair, &links);
            assert!(touches(&scene) || !touches(&smaller));
            assert!(touches(&larger) || !touches(&scene));
            touching += u32::from(touches(&scene));
        }
    }
    assert!(touching > 100, "{touching}");
}
