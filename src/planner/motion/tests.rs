//! Small arms in a plane and in space.

use nalgebra::{IsometryMatrix3, Unit, Vector3};

use super::*;
use kernel::seed::Stream;
use robot::{
    collision::{Bodies, Body, CollisionChecker, Geometry, Obstacle, PlacedObstacle, Shape},
    kinematics::{Joint, JointKind, JointLimits, PlanningGroup, PlanningGroupParts},
};

/// Length of each rod [m].
const ROD: f64 = 0.4;

/// Rods one after the other, about alternating axes; the first joint has no limits.
fn arm(axes: &[Unit<Vector3<f64>>], half: f64) -> (PlanningGroup, CollisionChecker) {
    let joint = |(index, axis): (usize, &Unit<Vector3<f64>>)| Joint {
        name: format!("joint {index}"),
        kind: JointKind::Revolute,
        origin: IsometryMatrix3::translation(if index == 0 { 0.0 } else { ROD }, 0.0, 0.0),
        axis: *axis,
        limits: (index > 0).then_some(JointLimits { low: -2.5, high: 2.5 }),
    };
    let rod = |index: usize| Body {
        name: format!("rod {index}"),
        link: index + 1,
        geometries: vec![Geometry {
            shape: Shape::Box { half: [0.5 * ROD - 0.01, half, half] },
            link_from_shape: IsometryMatrix3::translation(0.5 * ROD, 0.0, 0.0),
        }],
    };
    let joints = axes.iter().enumerate().map(joint).collect();
    let end_effector = IsometryMatrix3::translation(ROD, 0.0, 0.0);
    let group = PlanningGroup::new(PlanningGroupParts { joints, end_effector }).expect("a group");
    let bodies = (0..axes.len()).map(rod).collect();
    let pairs = (2..axes.len()).flat_map(|outer| (0..outer - 1).map(move |inner| [inner, outer])).collect();
    (group, CollisionChecker::for_obstacles(&Bodies { bodies, pairs }).expect("shapes"))
}

fn flat_arm(joints: usize) -> (PlanningGroup, CollisionChecker) {
    arm(&vec![Vector3::z_axis(); joints], 0.02)
}

fn placed(shape: Shape, pose: IsometryMatrix3<f64>) -> PlacedObstacle {
    let geometry = Geometry { shape, link_from_shape: IsometryMatrix3::identity() };
    Obstacle::new(&[geometry]).expect("a shape").at(pose)
}

/// Whether configurations along a path touch nothing, no farther apart than `step` [rad].
fn samples_free(scene: &ArmScene, path: &[Vec<f64>], step: f64) -> bool {
    path.windows(2).all(|edge| {
        let difference = scene.space().difference(&edge[0], &edge[1]);
        scene.samples_free(&edge[0], &difference, step, &mut Checks::default())
    })
}

/// A wall of 1 mm that lies between two samples of an edge; that edge of a thin arm, and the scene.
fn planted_wall(draw: &mut Stream) -> Option<(ArmScene, Vec<f64>, Vec<f64>)> {
    const SAMPLES: f64 = 0.05;
    let (group, checker) = arm(&[Vector3::z_axis(), Vector3::y_axis(), Vector3::z_axis()], 0.0005);
    let from = vec![draw.uniform(-3.0, 3.0), draw.uniform(-1.0, 1.0), draw.uniform(-1.0, 1.0)];
    let difference: Vec<f64> = (0..3).map(|_| draw.uniform(-1.0, 1.0)).collect();
    let free = ArmScene::new(&group, checker.clone());
    let count = (free.space().length(&difference) / SAMPLES).ceil();
    let share = (draw.below(count as u64) as f64 + 0.5) / count;
    // The tip's frame there, and the direction in which it moves.
    let tip = |share: f64| *group.forward(&free.space().along(&from, &difference, share)).isometry();
    let (here, next) = (tip(share), tip(share + 1e-6));
    let motion = here.rotation.inverse() * (next.translation.vector - here.translation.vector);
    let across = Vector3::new(0.0, motion.y, motion.z).try_normalize(1e-9)?;
    let rotation = nalgebra::Rotation3::rotation_between(&Vector3::y(), &across)?;
    let wall = here * IsometryMatrix3::from_parts(Vector3::new(-0.03, 0.0, 0.0).into(), rotation);
    let wall = placed(Shape::Box { half: [0.01, 0.0005, 0.01] }, wall);
    let scene = ArmScene::new(&group, checker.among(&[wall], |_| true));
    let mut checks = Checks::default();
    let passes = scene.touch(&from, &mut checks).is_none()
        && scene.samples_free(&from, &difference, SAMPLES, &mut checks)
        && free.certify(&from, &difference, &mut CertificateWork::default()).is_ok();
    passes.then_some((scene, from, difference))
}

fn planted_walls(count: usize) {
    let mut draw = Stream::of_job(1, b"", "walls");
    let (mut refused, mut drawn) = (0, 0);
    while drawn < count {
        let Some((scene, from, difference)) = planted_wall(&mut draw) else { continue };
        drawn += 1;
        let mut work = CertificateWork::default();
        refused += usize::from(scene.certify(&from, &difference, &mut work).is_err());
    }
    assert_eq!(refused, count);
}

#[test]
fn a_wall_of_a_millimetre_between_two_samples_is_refused() {
    planted_walls(100);
}

#[test]
#[ignore = "slow: make test-all"]
fn a_thousand_walls_of_a_millimetre_are_refused() {
    planted_walls(1000);
}

/// Posts around a flat arm of four joints, drawn anew in each scene.
fn posts(draw: &mut Stream) -> (ArmScene, Vec<f64>, Vec<f64>) {
    let (group, checker) = flat_arm(4);
    let mut posts = Vec::new();
    for _ in 0..6 {
        let (radius, angle) = (draw.uniform(0.5, 1.5), draw.uniform(-3.1, 3.1));
        let at = IsometryMatrix3::translation(radius * libm::cos(angle), radius * libm::sin(angle), 0.0);
        posts.push(placed(Shape::Cylinder { radius: 0.06, half: 0.5 }, at));
    }
    let scene = ArmScene::new(&group, checker.among(&posts, |_| true));
    let mut free = || loop {
        let q = scene.space().draw(draw);
        if scene.touch(&q, &mut Checks::default()).is_none() && scene.clear_by(&q, 1e-3) {
            return q;
        }
    };
    let (start, goal) = (free(), free());
    (scene, start, goal)
}

#[test]
fn certified_paths_are_free_at_a_milliradian_and_the_same_each_time() {
    let mut draw = Stream::of_job(2, b"", "posts");
    let (mut found, mut uncertain) = (0, 0);
    for round in 0..20_u8 {
        let (scene, start, goal) = posts(&mut draw);
        let key = [round];
        let plan =
            || plan_path(&scene, &start, std::slice::from_ref(&goal), &PathKey::new(1, &key), &PathSettings::default());
        let (verdict, work) = plan();
        assert_eq!(plan(), (verdict.clone(), work));
        match verdict {
            PathVerdict::Found(path) => {
                assert_eq!((&path.waypoints[0], path.goal), (&start, 0));
                let end = scene.space().difference(path.waypoints.last().expect("waypoints"), &goal);
                assert!(scene.space().length(&end) < 1e-9);
                let inside = path.waypoints.iter().all(|q| scene.group().within_limits(q));
                assert!(inside && samples_free(&scene, &path.waypoints, 1e-3));
                found += 1;
            }
            PathVerdict::Uncertain(_) => uncertain += 1,
            PathVerdict::NotFound => {}
            other => panic!("{other:?}"),
        }
    }
    assert!(found >= 16 && uncertain <= 2, "{found} found, {uncertain} uncertain");
}

#[test]
fn a_goal_in_a_cage_is_not_found_with_the_same_work_each_time() {
    let (group, checker) = flat_arm(3);
    // Walls on both sides of the outstretched arm.
    let wall = |y| placed(Shape::Box { half: [0.8, 0.01, 0.2] }, IsometryMatrix3::translation(0.9, y, 0.0));
    let scene = ArmScene::new(&group, checker.among(&[wall(0.04), wall(-0.04)], |_| true));
    let settings = PathSettings { iterations: 5000, checks: 20_000, rejections: 500, ..PathSettings::default() };
    let plan = || plan_path(&scene, &[2.0, 0.0, 0.0], &[vec![0.0; 3]], &PathKey::new(1, b"cage"), &settings);
    let (verdict, work) = plan();
    assert_eq!(verdict, PathVerdict::NotFound);
    assert!(work.restarts > 0 && (work.iterations == 5000 || work.checks >= 20_000), "{work:?}");
    assert_eq!(plan(), (verdict, work));
}

#[test]
fn starts_and_goals_in_collision_are_named() {
    let (group, checker) = flat_arm(2);
    let post = placed(Shape::Sphere { radius: 0.1 }, IsometryMatrix3::translation(0.0, 0.6, 0.0));
    let grazing = placed(Shape::Sphere { radius: 0.1 }, IsometryMatrix3::translation(-0.2, -0.120_05, 0.0));
    let scene = ArmScene::new(&group, checker.among(&[post, grazing], |_| true));
    let up = vec![std::f64::consts::FRAC_PI_2, 0.0];
    let plan = |start: &[f64], goals: &[Vec<f64>]| {
        plan_path(&scene, start, goals, &PathKey::new(1, b""), &PathSettings::default()).0
    };
    let touch = Touch { bodies: [1, 2] };
    assert_eq!(plan(&up, &[vec![0.0; 2]]), PathVerdict::StartInCollision(touch));
    assert_eq!(plan(&[0.0; 2], &[up.clone(), up.clone()]), PathVerdict::GoalInCollision(touch));
    // Another goal is free; one of 50 um is not far enough to be certain.
    let PathVerdict::Found(path) = plan(&[0.0; 2], &[up, vec![0.5, 0.5]]) else { panic!("a free goal") };
    assert_eq!(path.goal, 1);
    assert_eq!(plan(&[0.0; 2], &[vec![std::f64::consts::PI, 0.0]]), PathVerdict::Uncertain(None));
}

#[test]
fn joints_without_limits_take_the_short_way_round() {
    let (group, checker) = flat_arm(2);
    let scene = ArmScene::new(&group, checker);
    let goal = vec![-3.0, 0.2];
    let (verdict, _) = plan_path(&scene, &[3.0, 0.0], &[goal], &PathKey::new(1, b""), &PathSettings::default());
    let PathVerdict::Found(path) = verdict else { panic!("{verdict:?}") };
    assert!((path.waypoints.last().expect("an end")[0] - (std::f64::consts::TAU - 3.0)).abs() < 1e-12);
    assert!(path.length < 0.5, "{}", path.length);
}

/// No body moves farther than the bound of a certificate, in any order of the links.
#[test]
fn bodies_move_no_farther_than_bounded() {
    let (group, checker) = arm(&[Vector3::z_axis(), Vector3::y_axis(), Vector3::x_axis(), Vector3::z_axis()], 0.03);
    let held = Obstacle::new(&[Geometry {
        shape: Shape::Box { half: [0.05, 0.1, 0.02] },
        link_from_shape: IsometryMatrix3::translation(0.1, 0.2, 0.0),
    }]);
    let held = PlacedObstacle {
        obstacle: held.expect("a shape"),
        link: 4,
        link_from_obstacle: IsometryMatrix3::translation(0.3, 0.0, 0.1),
    };
    let wall = placed(Shape::Sphere { radius: 0.1 }, IsometryMatrix3::translation(2.0, 0.0, 0.0));
    let scene = ArmScene::new(&group, checker.among(&[held, wall], |_| true));
    let links: Vec<[usize; 2]> = scene.checker().pairs().collect();
    let mut draw = Stream::of_job(3, b"", "motions");
    let mut closest = f64::INFINITY;
    for _ in 0..500 {
        let from = scene.space().draw(&mut draw);
        let difference: Vec<f64> = (0..4).map(|_| draw.uniform(-0.5, 0.5)).collect();
        let frames = [from.clone(), scene.space().along(&from, &difference, 1.0)].map(|q| scene.links(&q));
        for (pair, [one, two]) in links.iter().enumerate() {
            let bound = scene.travel(pair, &difference);
            let outer = scene.touch_of(pair).bodies[usize::from(two > one)];
            let [inner, link] = [one.min(two), one.max(two)];
            for corner in scene.checker().corners(outer) {
                let [before, after] = frames.each_ref().map(|frames| frames[*inner].inverse() * frames[*link] * corner);
                closest = closest.min(bound - (after - before).norm());
            }
        }
    }
    assert!(closest >= -1e-12, "{closest}");
}
