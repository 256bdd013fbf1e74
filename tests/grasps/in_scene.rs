//! Grasps sampled in scenes: tests that only answer yes or no reject nothing that the exact path finds free, and the poses are as
//! documented.

use std::{f64::consts::FRAC_PI_3, sync::Arc};

use graspmill::{
    contact::ContactSurface,
    geom::{SimdLevel, TriMesh},
    grasp::{
        HandPassage, HandSearch, OpenBox, PathObstacle, SampledGrasps, SceneObstacle, SceneSampler, SceneSampling,
        SceneTarget, SurfacePoints, Surroundings,
    },
    seed::Stream,
    sim::HandModel,
    voxel::InsideTest,
};
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use crate::support::robots::{BARRETT, GRIPPER, PANDA_HAND, open_hand};

/// Distance to everything but the target [m].
const MARGIN: f64 = 0.002;

const SAMPLING: SceneSampling = SceneSampling { poses: 3000, grasps: 60, half_angle: FRAC_PI_3, friction: 0.4 };

/// The bin of the scenes here: room inside [m], and thickness of walls and floor.
const INNER: [f64; 3] = [0.34, 0.26, 0.1];
const WALL: f64 = 0.01;

fn obstacle(mesh: &TriMesh, at: [f64; 3], yaw: f64) -> SceneObstacle {
    let surface = ContactSurface::new(mesh, InsideTest::WindingNumber).expect("a surface");
    let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), yaw);
    let pose = IsometryMatrix3::from_parts(Translation3::from(Vector3::from(at)), rotation);
    SceneObstacle { surface: Arc::new(surface), scene_from_obstacle: pose }
}

/// Trays and blocks side by side, in a bin or on a plane.
fn scene(in_bin: bool) -> Surroundings {
    let tray = TriMesh::open_box([0.05, 0.07, 0.06], 0.004);
    let block = TriMesh::walls([0.02, 0.002, 0.06], 0.015);
    let slab = TriMesh::walls([0.1, 0.004, 0.05], 0.006);
    let objects = vec![
        obstacle(&tray, [0.0, 0.0, 0.004], 0.3),
        obstacle(&block, [0.08, 0.03, 0.0], 0.9),
        obstacle(&slab, [-0.03, 0.085, 0.0], 0.1),
        obstacle(&block, [-0.1, -0.05, 0.0], -0.4),
    ];
    let bin = || obstacle(&TriMesh::open_box(INNER, WALL), [0.0; 3], 0.0);
    Surroundings { container: in_bin.then(bin), ground: if in_bin { -WALL } else { 0.0 }, objects }
}

fn prepared(model: &HandModel) -> (HandPassage, SceneSampler) {
    let (bodies, _) = model.bodies().expect("its bodies");
    let search = HandSearch::new(model.hand(), &bodies).expect("eigengrasps");
    let sampler = SceneSampler::new(&search, MARGIN, SimdLevel::detect()).expect("two pads");
    (HandPassage::new(&search, MARGIN), sampler)
}

fn points(scene: &Surroundings, target: usize, sampler: &SceneSampler) -> SurfacePoints {
    let surface = &scene.objects[target].surface;
    SurfacePoints::new(surface, &[target as u8], sampler.widest_pair(), SimdLevel::detect())
}

fn stream(target: usize) -> Stream {
    Stream::of_job(1, &[target as u8], "poses")
}

#[test]
fn what_a_quick_test_rejects_the_exact_path_does_not_find_free() {
    let bin = OpenBox { scene_from_box: IsometryMatrix3::identity(), inner: INNER, wall: WALL };
    for hand in [GRIPPER, PANDA_HAND] {
        let model = open_hand(hand);
        let (mut passage, mut sampler) = prepared(&model);
        let mut counts = [0; 4];
        // In the bin by its walls and by its mesh, and without a bin.
        for (in_bin, container) in [(true, Some(&bin)), (true, None), (false, None)] {
            let scene = scene(in_bin);
            for target in 0..scene.objects.len() {
                let points = points(&scene, target, &sampler);
                let body = SceneTarget { scene: &scene, target, container, floor: 0.0, points: &points };
                let rejected = sampler.rejections(&body, &SAMPLING, &mut stream(target));
                // Those of each obstacle, at even steps.
                for (number, count) in counts.iter_mut().enumerate() {
                    let is_of = |by: PathObstacle| match by {
                        PathObstacle::Ground => number == 0,
                        PathObstacle::Container => number == 1,
                        PathObstacle::Target => number == 2,
                        PathObstacle::Neighbour(_) => number == 3,
                    };
                    let of: Vec<_> = rejected.iter().filter(|pose| is_of(pose.by)).collect();
                    for pose in of.iter().step_by(of.len() / 40 + 1) {
                        let surface = &scene.objects[target].surface;
                        let closed = passage.close(surface, &pose.object_from_base, &pose.posture);
                        let ways = passage.follow(&scene, target, &closed);
                        assert!(ways.shaped.blocked.is_some(), "{hand} {target} {pose:?}");
                        *count += 1;
                    }
                }
            }
        }
        // The opened hand does not reach the ground beside its tips.
        assert!(counts[1..].iter().all(|count| *count > 60), "{hand} {counts:?}");
    }
}

#[test]
fn sampled_grasps_are_about_their_pairs_and_unlike_each_other() {
    let model = open_hand(PANDA_HAND);
    let hand = model.hand();
    let (mut passage, mut sampler) = prepared(&model);
    let scene = scene(false);
    let mut free_of_all = 0;
    for target in 0..scene.objects.len() {
        let points = points(&scene, target, &sampler);
        let body = SceneTarget { scene: &scene, target, container: None, floor: 0.0, points: &points };
        let found = sampler.sample(&mut passage, &body, &SAMPLING, &mut stream(target));
        // The same again, to the bit.
        assert_eq!(sampler.sample(&mut passage, &body, &SAMPLING, &mut stream(target)), found);
        assert_counted(&found);
        let scene_from_object = scene.objects[target].scene_from_obstacle;
        let mut known: Vec<(Vector3<f64>, Matrix3<f64>)> = Vec::new();
        for grasp in &found.grasps {
            let frames = hand.link_frames(&hand.posture_values(&grasp.posture));
            let approach = hand.approach_direction(&frames);
            // Near straight down, within the half angle.
            let down = -(scene_from_object.rotation * grasp.object_from_base.rotation * approach).z;
            assert!(down >= FRAC_PI_3.cos() - 1e-9, "{down}");
            // Both points lie between the pads, on the line along which they close.
            let line = hand.closing_line().expect("a gripper").normalize();
            let seen = grasp.points.map(|point| grasp.object_from_base.inverse() * point);
            let pair = seen[1] - seen[0];
            assert!(pair.cross(&line).norm() < 1e-9 && pair.norm() <= grasp.opening - 0.0019, "{grasp:?}");
            assert!((0.003..0.05).contains(&grasp.depth) && grasp.opening <= 0.08 + 1e-12, "{grasp:?}");
            // The exact path again.
            let closed = passage.close(&scene.objects[target].surface, &grasp.object_from_base, &grasp.posture);
            assert_eq!(passage.follow(&scene, target, &closed), grasp.ways);
            if grasp.ways.shaped.blocked.is_some() {
                continue;
            }
            assert_eq!(grasp.closed.as_ref(), Some(&closed));
            let rotation =
                (grasp.object_from_base.rotation * hand.approach_pose(&frames).isometry().rotation).into_inner();
            // The middle between the pads is on the middle of the pair, up to the depth along the approach.
            let along = grasp.object_from_base.rotation * approach;
            let middle = nalgebra::center(&grasp.points[0], &grasp.points[1]).coords - along * (0.017 - grasp.depth);
            for (other, known) in &known {
                let angle = |turned: &Matrix3<f64>| {
                    ((rotation.tr_mul(turned).trace() - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
                };
                let half_turn = known * Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
                let nearest = angle(known).min(angle(&half_turn));
                let apart = (middle - other).norm();
                assert!(apart >= 0.02 - 1e-9 || nearest >= 15.0 - 1e-9, "{apart} {nearest}");
            }
            known.push((middle, rotation));
        }
        free_of_all += known.len();
    }
    assert!(free_of_all > 40, "{free_of_all}");
    // Points of a pair that is wider than the hand opens are none, and neither are poses.
    let wide = obstacle(&TriMesh::open_box([0.2, 0.2, 0.004], 0.09), [0.0; 3], 0.0);
    let wide = Surroundings { container: None, ground: 0.0, objects: vec![wide] };
    let points = SurfacePoints::new(&wide.objects[0].surface, b"wide", sampler.widest_pair(), SimdLevel::detect());
    let body = SceneTarget { scene: &wide, target: 0, container: None, floor: 0.0, points: &points };
    let found = sampler.sample(&mut passage, &body, &SAMPLING, &mut stream(0));
    assert!(found.grasps.is_empty() && found.counts.free == 0, "{:?}", found.counts);
}

/// Every pose has one result, and free grasps come first.
fn assert_counted(found: &SampledGrasps) {
    let counts = &found.counts;
    let single = [counts.unopposed, counts.too_wide, counts.tilted, counts.too_low, counts.alike, counts.free];
    let sum: u32 = single.iter().chain(&counts.rejected).chain(&counts.blocked).sum();
    assert_eq!(counts.poses, sum);
    assert!(counts.poses == SAMPLING.poses || counts.free == SAMPLING.grasps, "{counts:?}");
    let free = found.grasps.iter().filter(|grasp| grasp.ways.shaped.blocked.is_none()).count();
    assert_eq!(free, counts.free as usize);
    assert!(found.grasps.len() <= SAMPLING.grasps as usize);
    assert!(found.grasps.windows(2).all(|pair| pair[0].pose < pair[1].pose));
}

#[test]
fn only_two_pads_that_slide_towards_each_other_are_sampled() {
    let model = open_hand(BARRETT);
    let (bodies, _) = model.bodies().expect("its bodies");
    let search = HandSearch::new(model.hand(), &bodies).expect("eigengrasps");
    assert!(SceneSampler::new(&search, MARGIN, SimdLevel::detect()).is_none());
}
