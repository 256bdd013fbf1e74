//! Kinematics against MuJoCo's own, and solvers of inverse kinematics against each other.

use std::{collections::BTreeMap, f64::consts::PI};

use graspmill::{
    geom::{EndEffector, Pose, World, rotation_from_rpy},
    kinematics::{Joint, SelfMotion, SixJointArm, SolverSettings, SphericalWristArm, solve_numeric},
    seed::Stream,
};
use nalgebra::Vector3;

use crate::robot::write_scene;
use crate::support::{
    files::read_text,
    robots::{
        FETCH, FETCH_ARM, FETCH_SITE, TX60L, TX60L_JOINTS, TX60L_SITE, max_difference, open_robot, random_values,
    },
};

#[test]
fn fetch_has_the_numbers_of_its_public_description() {
    let group = open_robot(FETCH).planning_group(&FETCH_ARM, FETCH_SITE, &BTreeMap::new()).expect("the arm");
    let limits: Vec<_> =
        group.joints().iter().map(|joint| joint.limits.map(|limits| (limits.low, limits.high))).collect();
    let lift = Some((-1.221, 1.518));
    let (elbow, wrist) = (Some((-2.251, 2.251)), Some((-2.16, 2.16)));
    assert_eq!(limits, [Some((-1.6056, 1.6056)), lift, None, elbow, None, wrist, None]);
    // Stretched out along x: the sum of all offsets.
    let out = group.forward(&[0.0; 7]);
    let x = -0.086875 + 0.119525 + 0.117 + 0.219 + 0.133 + 0.197 + 0.1245 + 0.1385;
    let z = 0.37743 + 0.34858 + 0.06;
    assert!((out.translation() - Vector3::new(x, 0.0, z)).norm() < 1e-15, "{out:?}");
    // Lifting the torso lifts the arm and nothing else.
    let lifted = BTreeMap::from([("torso_lift_joint".to_owned(), 0.3)]);
    let lifted = open_robot(FETCH).planning_group(&FETCH_ARM, FETCH_SITE, &lifted).expect("the arm").forward(&[0.0; 7]);
    assert!((lifted.translation() - out.translation() - Vector3::z() * 0.3).norm() < 1e-15);
}

#[test]
fn forward_kinematics_is_mujocos() {
    let robot = open_robot(FETCH);
    let with_torso: Vec<&str> = ["torso_lift_joint"].into_iter().chain(FETCH_ARM).collect();
    for joints in [&FETCH_ARM[..], &with_torso] {
        let group = robot.planning_group(joints, FETCH_SITE, &BTreeMap::new()).expect("a group");
        let mut stream = Stream::of_job(1, b"robots", "forward");
        let mut worst = 0.0f64;
        for _ in 0..500 {
            let q = random_values(&group, &mut stream);
            let values: Vec<_> = joints.iter().copied().zip(q.iter().copied()).collect();
            worst =
                worst.max(max_difference(&group.forward(&q), &robot.target_pose(FETCH_SITE, &values).expect("a pose")));
        }
        println!("{} joints: at most {worst:.1e} from MuJoCo's", joints.len());
        assert!(worst <= 1e-12);
    }
}

/// Anchors off the origin, several joints in a body, a reference angle, turned bodies and sites, slides.
#[test]
fn odd_descriptions_are_read_as_mujoco_reads_them() {
    let text = r#"<mujoco><compiler angle="radian"/><worldbody><body name="a" pos="0.1 0.2 0.3" euler="0.3 -0.2 0.9">
        <joint name="one" axis="0.2 1 0.3" pos="0.05 0 0.1" range="-2 2" ref="0.4"/><geom size="0.1"/>
        <joint name="two" type="slide" axis="1 1 0" pos="0 0.3 0" range="-0.2 0.5"/>
        <body pos="0 0 0.4" quat="0.9 0.1 -0.3 0.2"><joint name="three" axis="1 0 0.5" pos="-0.1 0.1 0"/><geom size="0.1"/>
        <body pos="0.2 0 0"><joint name="still" axis="0 1 0" ref="0.1"/><geom size="0.1"/>
        <site name="tool" pos="0.1 0 -0.2" euler="1 2 3"/></body></body></body></worldbody></mujoco>"#;
    let file = write_scene(text);
    let robot = open_robot(file.path());
    let joints = ["one", "two", "three"];
    let fixed = BTreeMap::from([("still".to_owned(), 0.7)]);
    let group = robot.planning_group(&joints, "tool", &fixed).expect("a group");
    let mut stream = Stream::of_job(1, b"robots", "odd");
    for _ in 0..100 {
        let q = random_values(&group, &mut stream);
        let values: Vec<_> = joints.iter().copied().zip(q.iter().copied()).chain([("still", 0.7)]).collect();
        let theirs = robot.target_pose("tool", &values).expect("a pose");
        assert!(max_difference(&group.forward(&q), &theirs) <= 1e-12);
    }
}

#[test]
fn the_jacobian_is_the_slope_of_forward_kinematics() {
    let with_torso: Vec<&str> = ["torso_lift_joint"].into_iter().chain(FETCH_ARM).collect();
    let group = open_robot(FETCH).planning_group(&with_torso, FETCH_SITE, &BTreeMap::new()).expect("a group");
    let mut stream = Stream::of_job(1, b"robots", "jacobian");
    for _ in 0..20 {
        let q = random_values(&group, &mut stream);
        let (pose, jacobian) = group.forward_and_jacobian(&q);
        assert!(max_difference(&pose, &group.forward(&q)) == 0.0);
        for joint in 0..group.len() {
            let step = 1e-6;
            let at = |offset: f64| {
                let mut q = q.clone();
                q[joint] += offset;
                group.forward(&q)
            };
            let (before, after) = (at(-step), at(step));
            let moves = (after.translation() - before.translation()) / (2.0 * step);
            let spin = (after.rotation().matrix() - before.rotation().matrix()) / (2.0 * step)
                * pose.rotation().matrix().transpose();
            let rotations = Vector3::new(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]);
            assert!((moves - jacobian.fixed_view::<3, 1>(0, joint)).norm() < 1e-8);
            assert!((rotations - jacobian.fixed_view::<3, 1>(3, joint)).norm() < 1e-8);
        }
    }
}

/// Poses that the arm can have: twenty starts find joint values for nearly all, and what is found is right.
#[test]
fn the_numeric_solver_finds_poses_that_the_arm_has() {
    let group = open_robot(FETCH).planning_group(&FETCH_ARM, FETCH_SITE, &BTreeMap::new()).expect("a group");
    let mut stream = Stream::of_job(1, b"robots", "numeric");
    let settings = SolverSettings::default();
    let (mut found, mut starts) = (0, 0);
    for _ in 0..200 {
        let target = group.forward(&random_values(&group, &mut stream));
        let solution = (0..20).find_map(|_| {
            starts += 1;
            solve_numeric(&group, &target, &random_values(&group, &mut stream), &settings)
        });
        if let Some(solution) = solution {
            assert!(group.within_limits(&solution.q));
            assert!(max_difference(&group.forward(&solution.q), &target) < 1e-8);
            found += 1;
        }
    }
    println!("{found} of 200 found, {:.1} starts each", f64::from(starts) / 200.0);
    assert!(found >= 195, "{found} of 200");
}

/// Given the first joint of a pose that the arm has, the values that made the pose are among those found, and every set
/// found makes the pose.
#[test]
fn the_closed_form_finds_every_way_to_a_pose() {
    let group = open_robot(FETCH).planning_group(&FETCH_ARM, FETCH_SITE, &BTreeMap::new()).expect("a group");
    let arm = SphericalWristArm::recognise(&group).expect("a closed form");
    let mut stream = Stream::of_job(1, b"robots", "closed form");
    let (mut worst, mut solutions) = (0.0f64, [0; 9]);
    for _ in 0..20_000 {
        let q = random_values(&group, &mut stream);
        let target = group.forward(&q);
        let found: Vec<_> = arm.branches(&target, q[0]).into_iter().flatten().collect();
        solutions[found.len()] += 1;
        let away = |solution: &[f64; 7]| solution.iter().zip(&q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let nearest = found.iter().map(away).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-5, "{q:?} is {nearest} from the nearest of {found:?}");
        for solution in &found {
            assert!(group.within_limits(solution));
            worst = worst.max(max_difference(&group.forward(solution), &target));
        }
    }
    println!("{solutions:?} poses with 0 to 8 ways; at most {worst:.1e} off");
    assert!(worst < 1e-6 && solutions[0] == 0 && solutions[8] > 0);
}

/// The closed form finds every pose that the numeric solver finds: nothing is missed.
#[test]
fn the_closed_form_misses_nothing_that_the_numeric_solver_finds() {
    let group = open_robot(FETCH).planning_group(&FETCH_ARM, FETCH_SITE, &BTreeMap::new()).expect("a group");
    let arm = SphericalWristArm::recognise(&group).expect("a closed form");
    let mut stream = Stream::of_job(1, b"robots", "against numeric");
    let mut solved = 0;
    for _ in 0..400 {
        let target = group.forward(&random_values(&group, &mut stream));
        let start = random_values(&group, &mut stream);
        let Some(solution) = solve_numeric(&group, &target, &start, &SolverSettings::default()) else { continue };
        // On a limit the numeric solution's own error decides on which side the exact one lies.
        let limits = group.joints().iter().zip(&solution.q);
        let inside = |(joint, value): (&Joint, &f64)| {
            joint.limits.is_none_or(|limits| *value > limits.low + 1e-6 && *value < limits.high - 1e-6)
        };
        if limits.into_iter().all(inside) {
            assert!(arm.branches(&target, solution.q[0]).iter().any(Option::is_some), "{:?}", solution.q);
            solved += 1;
        }
    }
    println!("{solved} poses");
    assert!(solved > 100, "{solved}");
}

/// A pose of the thesis's grid (section 7.2): 12 x 22 x 20 positions, step 0.1 m, and 2 x 8 x 8 orientations.
fn grid_pose(cell: usize) -> Pose<World, EndEffector> {
    let (x, y, z) = (cell / 56_320, cell / 2_560 % 22, cell / 128 % 20);
    let (roll, pitch, yaw) = (cell / 64 % 2, cell / 8 % 8, cell % 8);
    let position = Vector3::new(0.1 * x as f64, -1.1 + 0.1 * y as f64, 0.1 * z as f64);
    let angle = |index: usize, step: f64| -PI + step * index as f64;
    let rotation = rotation_from_rpy(angle(roll, PI), angle(pitch, PI / 4.0), angle(yaw, PI / 4.0));
    Pose::new(rotation, position)
}

/// Poses of the grid by end points and by ten thousand values of the first joint: the dense search finds nothing that the
/// end points have missed, and every way is one.
#[test]
fn the_exact_test_misses_nothing_that_a_dense_search_finds() {
    let group = open_robot(FETCH).planning_group(&FETCH_ARM, FETCH_SITE, &BTreeMap::new()).expect("a group");
    let test = SelfMotion::new(&group).expect("the Fetch's arm");
    let mut stream = Stream::of_job(1, b"robots", "reach");
    let (mut both, mut exact_only) = (0, 0);
    for _ in 0..600 {
        let target = grid_pose(stream.below(675_840) as usize);
        let solution = test.find(&target);
        if let Some(solution) = &solution {
            assert!(group.within_limits(solution));
            assert!(max_difference(&group.forward(solution), &target) < 1e-6);
        }
        let dense = (0..10_000).any(|step| {
            let first = -1.6056 + 3.2112 * (f64::from(step) + 0.5) / 10_000.0;
            test.arm().branches(&target, first).iter().any(Option::is_some)
        });
        assert!(solution.is_some() || !dense, "{target:?}");
        both += u32::from(dense);
        exact_only += u32::from(solution.is_some() && !dense);
    }
    println!("{both} of 600 reachable, {exact_only} by the exact test alone");
    assert!(both > 60);
}

/// The whole grid without collisions. An independent recount gave about 119,100.
#[test]
fn the_grid_of_the_thesis_without_collisions() {
    let group = open_robot(FETCH).planning_group(&FETCH_ARM, FETCH_SITE, &BTreeMap::new()).expect("a group");
    let test = SelfMotion::new(&group).expect("the Fetch's arm");
    let began = std::time::Instant::now();
    let reachable = (0..675_840).filter(|cell| test.find(&grid_pose(*cell)).is_some()).count();
    println!("{reachable} of 675,840 in {:.1} s", began.elapsed().as_secs_f64());
    assert!((119_050..119_150).contains(&reachable), "{reachable}");
    // The same by their pose of the wrist: 26 directions, each with several rotations.
    let mut directions: Vec<(Vector3<f64>, Vec<usize>)> = Vec::new();
    for rotation in 0..128 {
        let ahead = test.wrist(&grid_pose(rotation)).ahead;
        match directions.iter_mut().find(|(other, _)| (other - ahead).norm() < 1e-9) {
            Some((_, rotations)) => rotations.push(rotation),
            None => directions.push((ahead, vec![rotation])),
        }
    }
    assert_eq!(directions.len(), 26);
    let began = std::time::Instant::now();
    let mut ends = Vec::new();
    let mut by_direction = 0;
    for position in 0..5280 {
        for (_, rotations) in &directions {
            let wrist = test.wrist(&grid_pose(128 * position + rotations[0]));
            by_direction += usize::from(test.first_value(&wrist, &mut ends).is_some()) * rotations.len();
        }
    }
    println!("{by_direction} of 675,840 in {:.3} s", began.elapsed().as_secs_f64());
    assert_eq!(by_direction, reachable);
}

#[test]
fn arms_without_a_closed_form_are_told_why() {
    let with_torso: Vec<&str> = ["torso_lift_joint"].into_iter().chain(FETCH_ARM[1..].iter().copied()).collect();
    let none = BTreeMap::new();
    let group = |joints: &[&str]| open_robot(FETCH).planning_group(joints, FETCH_SITE, &none).expect("a group");
    let why = |joints: &[&str]| SphericalWristArm::recognise(&group(joints)).expect_err("none").to_string();
    assert!(why(&FETCH_ARM[1..]).contains("6 joints"));
    assert!(why(&with_torso).contains("\"torso_lift_joint\" slides"));
    let text = read_text(FETCH);
    let moved = r#"<body name="wrist_flex_link" pos="0.1245 0 0.01">"#;
    let file = write_scene(&text.replace(r#"<body name="wrist_flex_link" pos="0.1245 0 0">"#, moved));
    let offset = open_robot(file.path()).planning_group(&FETCH_ARM, FETCH_SITE, &none).expect("a group");
    let error = SphericalWristArm::recognise(&offset).expect_err("an offset wrist").to_string();
    assert!(error.contains("wrist_flex_joint") && error.contains("meet at the wrist"), "{error}");
}

/// The six-joint arm: of random configurations every one's own joint values are found again, up to whole rotations, and every
/// way found makes the pose.
#[test]
fn six_joints_have_every_way_in_closed_form() {
    let group = open_robot(TX60L).planning_group(&TX60L_JOINTS, TX60L_SITE, &BTreeMap::new()).expect("a group");
    let arm = SixJointArm::recognise(&group).expect("a closed form");
    let mut stream = Stream::of_job(1, b"robots", "six joints");
    let (mut worst, mut counts) = (0.0f64, [0; 9]);
    for _ in 0..20_000 {
        let q = random_values(&group, &mut stream);
        let target = group.forward(&q);
        let found = arm.solutions(&target);
        counts[found.solutions.len()] += 1;
        let difference = |a: f64, b: f64| (a - b - 2.0 * PI * ((a - b) / (2.0 * PI)).round()).abs();
        let away = |solution: &[f64; 6]| solution.iter().zip(&q).map(|(a, b)| difference(*a, *b)).fold(0.0, f64::max);
        let nearest = found.solutions.iter().map(away).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-5, "{q:?} is {nearest} from the nearest of {:?}", found.solutions);
        for solution in &found.solutions {
            assert!(group.within_limits(solution));
            worst = worst.max(max_difference(&group.forward(solution), &target));
        }
    }
    println!("{counts:?} poses with 0 to 8 ways; at most {worst:.1e} off");
    assert!(worst < 1e-6 && counts[0] == 0 && counts[8] > 0);
}
