//! Maps over small grids against answers from scratch.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use nalgebra::{Point3, Rotation3, Vector3};
use proptest::{collection::vec, prelude::*};

use super::*;
use kernel::geom::{
    Axis, AxisUnit, EndEffector, FieldMetric, HealPix, METRES_PER_RADIAN, Object, OccupancyGrid, Pose, PoseGrid,
    PoseLabel, TriMesh, World,
};

const METRES: FieldMetric = FieldMetric::Metres { rho: METRES_PER_RADIAN };
const FIRST: [f64; 3] = [0.2, -0.3, 0.1];

/// 5 x 6 x 4 positions 0.1 m apart, with these steps of the angles.
fn grid(angles: [usize; 3]) -> PoseGrid {
    let count = [5, 6, 4, angles[0], angles[1], angles[2]];
    PoseGrid::new(std::array::from_fn(|k| Axis {
        name: ["x", "y", "z", "roll", "pitch", "yaw"][k],
        unit: if k < 3 { AxisUnit::Metre } else { AxisUnit::Radian },
        first: if k < 3 { FIRST[k] } else { -PI },
        step: if k < 3 { 0.1 } else { 2.0 * PI / count[k] as f64 },
        count: count[k],
        periodic: k > 2,
    }))
    .unwrap()
}

/// Grid of the same positions with directions and roll.
fn on_sphere(nside: u32, rolls: usize) -> PoseGrid {
    PoseGrid::on_sphere(*grid([1, 1, 1]).position_axes(), HealPix::new(nside).unwrap(), rolls).unwrap()
}

/// Reachable within a ball, but not from behind: the same for all cells that mean one pose.
fn parts(grid: &PoseGrid, metric: FieldMetric) -> ReachabilityParts {
    let label = |cell| {
        let pose = Pose::<World, EndEffector>::from_xyz_rpy(grid.pose(cell));
        let near = (pose.translation() - Vector3::new(0.35, 0.0, 0.2)).norm() < 0.22;
        match (near, pose.rotation().matrix()[(0, 0)] > -0.3) {
            (true, true) => PoseLabel::Reachable,
            (true, false) => PoseLabel::Colliding,
            _ => PoseLabel::NoSolution,
        }
    };
    let labels: Vec<PoseLabel> = (0..grid.cells()).map(label).collect();
    let distances = field(grid, &labels, metric);
    // The position again, by three sliding joints.
    let reachable = (0..grid.cells()).filter(|cell| labels[*cell] == PoseLabel::Reachable);
    let witnesses = Some(reachable.flat_map(|cell| grid.pose(cell).into_iter().take(3)).collect());
    let robot = RobotFacts { joints: ["x", "y", "z"].map(str::to_owned).into(), ..RobotFacts::default() };
    ReachabilityParts { grid: grid.clone(), metric, labels, distances, witnesses, robot }
}

fn field(grid: &PoseGrid, labels: &[PoseLabel], metric: FieldMetric) -> Vec<f32> {
    let inside: Vec<bool> = labels.iter().map(|label| *label == PoseLabel::Reachable).collect();
    metric.signed_distance(&inside, grid)
}

fn bits(map: &ReachabilityMap) -> (Vec<PoseLabel>, Vec<u32>) {
    (map.labels().to_vec(), map.distances().iter().map(|distance| distance.to_bits()).collect())
}

fn hand() -> EndEffectorVolume {
    let pose = Pose::new(Rotation3::identity(), Vector3::new(0.05, 0.0, 0.0));
    EndEffectorVolume::default()
        .with_box(&pose, [0.03, 0.02, 0.04], 0.03)
        .with_capsule([Point3::new(0.0, 0.0, 0.0), Point3::new(0.0, 0.0, -0.06)], 0.02)
}

fn pose_at(at: [f64; 3], angles: [f64; 3]) -> Pose<World, Object> {
    Pose::from_xyz_rpy([at[0], at[1], at[2], angles[0], angles[1], angles[2]])
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let grid = grid([2, 4, 4]);
    let broken = |change: &dyn Fn(&mut ReachabilityParts)| {
        let mut parts = parts(&grid, METRES);
        change(&mut parts);
        ReachabilityMap::new(parts).err().unwrap()
    };
    let cells = grid.cells();
    let count = |what, found, expected| InvalidMap::Count { what, found, expected };
    assert_eq!(broken(&|parts| parts.labels.truncate(parts.labels.len() - 1)), count("labels", cells - 1, cells));
    assert_eq!(broken(&|parts| parts.distances.push(1.0)), count("distances", cells + 1, cells));
    let all = parts(&grid, METRES).witnesses.unwrap().len();
    let short = broken(&|parts| parts.witnesses.as_mut().unwrap().truncate(1));
    assert_eq!(short, count("joint values of witnesses", 1, all));
    let message = broken(&|parts| parts.distances[7] = -parts.distances[7]).to_string();
    assert!(message.starts_with("cell 7: distance -"), "{message}");
    assert!(matches!(broken(&|parts| parts.distances[0] = f32::NAN), InvalidMap::Sign { cell: 0, .. }));
}

#[test]
fn both_ways_to_write_a_pose_have_one_value() {
    let grid = grid([2, 8, 8]);
    let mut map = ReachabilityMap::new(parts(&grid, METRES)).unwrap();
    let thing = Obstacle::cuboid(&pose_at([0.5, 0.05, 0.3], [0.3, 0.2, 0.1]), [0.06, 0.1, 0.05]).unwrap();
    for round in 0..2 {
        for cell in 0..grid.cells() {
            let [x, y, z, roll, pitch, yaw] = grid.pose(cell);
            let twin = [x, y, z, roll + PI, PI - pitch, yaw + PI];
            let other = map.nearest_cell(&twin).unwrap();
            assert_ne!(other.cell, cell);
            assert_eq!((other.label, map.distances()[other.cell]), (map.labels()[cell], map.distances()[cell]));
        }
        let mut draw = 0.5_f64;
        for _ in 0..2_000 {
            let pose: [f64; 6] = std::array::from_fn(|k| {
                draw = (draw * 997.0 + 0.123).fract();
                if k < 3 { FIRST[k] + draw * 0.6 - 0.05 } else { (draw - 0.5) * 4.0 * PI }
            });
            let twin = [pose[0], pose[1], pose[2], pose[3] + PI, PI - pose[4], pose[5] + PI];
            let (value, gradient) = map.distance_and_gradient(&pose);
            let (other, slopes) = map.distance_and_gradient(&twin);
            assert!((value - other).abs() < 1e-9);
            let signs = [1.0, 1.0, 1.0, 1.0, -1.0, 1.0];
            assert!((0..6).all(|k| (gradient[k] - signs[k] * slopes[k]).abs() < 1e-6), "{gradient:?} {slopes:?}");
            let written = Pose::<World, EndEffector>::from_xyz_rpy(pose).xyz_rpy();
            assert!((value - map.distance(&written)).abs() < 1e-9);
        }
        if round == 0 {
            map.add_obstacle(&thing, &hand());
        }
    }
}

#[test]
fn looking_straight_down_is_one_pose_however_it_is_written() {
    let map = ReachabilityMap::new(parts(&grid([2, 8, 8]), METRES)).unwrap();
    for angle in [-FRAC_PI_2, 0.0, FRAC_PI_4, 2.0 * FRAC_PI_4] {
        let pose = [0.4, 0.05, 0.2, 0.0, FRAC_PI_2, angle];
        let written = Pose::<World, EndEffector>::from_xyz_rpy(pose).xyz_rpy();
        assert!((map.distance(&pose) - map.distance(&written)).abs() < 1e-9);
    }
}

#[test]
fn poses_outside_and_poses_that_are_none() {
    let grid = grid([2, 4, 4]);
    let map = ReachabilityMap::new(parts(&grid, METRES)).unwrap();
    let mut pose = grid.pose(0);
    assert!(map.is_in_grid(&pose));
    let at_border = map.distance(&pose);
    pose[0] -= 0.049;
    assert!(map.is_in_grid(&pose));
    pose[0] -= 0.951;
    assert!(!map.is_in_grid(&pose));
    assert!((map.distance(&pose) - at_border - 1.0).abs() < 1e-12);
    assert_eq!(map.nearest_cell(&pose).unwrap().cell, 0);
    for k in 0..6 {
        let mut bad = pose;
        bad[k] = f64::NAN;
        assert!(map.distance(&bad).is_nan() && map.nearest_cell(&bad).is_none() && !map.is_in_grid(&bad));
    }
}

#[test]
fn reachable_cells_have_their_own_witness() {
    for grid in [grid([2, 4, 4]), on_sphere(2, 4)] {
        let map = ReachabilityMap::new(parts(&grid, METRES)).unwrap();
        for cell in 0..grid.cells() {
            let pose = grid.pose(cell);
            let witness = map.nearest_cell(&pose).unwrap().witness;
            let expected = (map.labels()[cell] == PoseLabel::Reachable).then_some(&pose[..3]);
            assert_eq!(witness, expected);
        }
    }
}

/// Away from the border, a map over directions gives the same result for all notations of a pose.
#[test]
fn directions_answer_as_six_axes_do() {
    let grid = on_sphere(3, 8);
    let map = ReachabilityMap::new(parts(&grid, METRES)).unwrap();
    let (mut draw, mut inside, mut outside) = (0.5_f64, 0, 0);
    for _ in 0..4_000 {
        let pose: [f64; 6] = std::array::from_fn(|k| {
            draw = (draw * 997.0 + 0.123).fract();
            if k < 3 { FIRST[k] + draw * [0.4, 0.5, 0.3][k] } else { (draw - 0.5) * 4.0 * PI }
        });
        let (value, gradient) = map.distance_and_gradient(&pose);
        let twin = [pose[0], pose[1], pose[2], pose[3] + PI, PI - pose[4], pose[5] + PI];
        let (other, slopes) = map.distance_and_gradient(&twin);
        assert!((value - other).abs() < 1e-9);
        let signs = [1.0, 1.0, 1.0, 1.0, -1.0, 1.0];
        assert!((0..6).all(|k| (gradient[k] - signs[k] * slopes[k]).abs() < 1e-6), "{gradient:?} {slopes:?}");
        let seen = Pose::<World, EndEffector>::from_xyz_rpy(pose);
        let near = (seen.translation() - Vector3::new(0.35, 0.0, 0.2)).norm();
        let ahead = seen.rotation().matrix()[(0, 0)];
        if near < 0.12 && ahead > 0.1 {
            assert!(value < 0.0, "{pose:?}: {value}");
            inside += 1;
        } else if near > 0.34 || ahead < -0.7 {
            assert!(value > 0.0, "{pose:?}: {value}");
            outside += 1;
        }
        assert!(map.is_in_grid(&pose));
    }
    assert!(inside > 50 && outside > 300, "{inside} {outside}");
    let cells = FieldMetric::Cells;
    let refused = ReachabilityMap::new(ReachabilityParts { metric: cells, ..parts(&grid, METRES) }).err().unwrap();
    assert_eq!(refused, InvalidMap::Metric);
}

#[test]
fn ranking_is_stable_with_the_deepest_first() {
    let grid = grid([2, 4, 4]);
    let map = ReachabilityMap::new(parts(&grid, METRES)).unwrap();
    let mut poses: Vec<[f64; 6]> = (0..grid.cells()).step_by(7).map(|cell| grid.pose(cell)).collect();
    poses[3][0] = f64::NAN;
    let ranked = map.rank(&poses);
    assert_eq!(ranked.len(), poses.len());
    assert!(ranked[0].distance < 0.0 && ranked.last().unwrap().index == 3);
    for pair in ranked[..ranked.len() - 1].windows(2) {
        assert!(
            pair[0].distance < pair[1].distance
                || (pair[0].distance == pair[1].distance && pair[0].index < pair[1].index)
        );
    }
    assert_eq!(
        map.distances_and_gradients(&poses[4..6]).map(|answer| answer.0).collect::<Vec<_>>(),
        [map.distance(&poses[4]), map.distance(&poses[5])]
    );
}

#[test]
fn the_arm_counts_where_every_witness_touches() {
    let grid = grid([2, 4, 4]);
    let mut map = ReachabilityMap::new(parts(&grid, METRES)).unwrap();
    let before = bits(&map);
    // The arm is a ball 0.3 m above the sliding joints; the end effector is a point.
    let arm = |joints: &[f64], balls: &mut Vec<Ball>| {
        balls.push(Ball { centre: Point3::new(joints[0], joints[1], joints[2] + 0.3), radius: 0.02 });
    };
    let plate = Obstacle::cuboid(&pose_at([0.0, 0.0, 0.5], [0.0; 3]), [0.31, 1.0, 0.03]).unwrap();
    let point = EndEffectorVolume::new(vec![Ball { centre: Point3::origin(), radius: 0.0 }]);
    map.add_obstacle(&plate, &point);
    assert_eq!(bits(&map), before, "only the arm would touch");
    map.undo();
    map.add_obstacle_for_arm(&plate, &point, &arm);
    for cell in 0..grid.cells() {
        let [x, _, z, ..] = grid.pose(cell);
        let blocked = before.0[cell] == PoseLabel::Reachable && x < 0.33 && (z - 0.2).abs() < 0.05;
        assert_eq!(map.labels()[cell], if blocked { PoseLabel::Colliding } else { before.0[cell] });
    }
    assert_ne!(bits(&map), before);
    map.undo();
    assert_eq!(bits(&map), before);
}

#[test]
fn obstacles_that_are_none_are_refused() {
    let pose = pose_at([0.0; 3], [0.0; 3]);
    assert!(matches!(Obstacle::cuboid(&pose, [0.1, -0.1, 0.1]), Err(InvalidObstacle::Length { .. })));
    assert!(matches!(
        Obstacle::cuboid(&pose_at([f64::NAN; 3], [0.0; 3]), [0.1; 3]),
        Err(InvalidObstacle::Length { .. })
    ));
    assert!(matches!(Obstacle::box_of(&[]), Err(InvalidObstacle::Empty)));
    assert!(matches!(Obstacle::mesh(&pose, &TriMesh::default()), Err(InvalidObstacle::NoSurface(_))));
    assert!(matches!(Obstacle::occupancy(&pose, &OccupancyGrid::new(4), 0.1), Err(InvalidObstacle::Empty)));
}

#[test]
fn the_box_of_points_lies_around_them() {
    let points = [[0.1, 0.2, 0.3], [-0.4, 0.5, 0.9], [0.0, 0.1, 1.0]].map(Point3::from);
    let bounds = Obstacle::box_of(&points).unwrap().bounds();
    assert!((bounds.min - Point3::new(-0.4, 0.1, 0.3)).norm() < 1e-12);
    assert!((bounds.max - Point3::new(0.1, 0.5, 1.0)).norm() < 1e-12);
}

#[test]
fn covers_hold_what_they_cover() {
    let pose = Pose::<EndEffector, Object>::from_xyz_rpy([0.1, 0.2, -0.1, 0.4, -0.3, 1.0]);
    let cover = EndEffectorVolume::default().with_box(&pose, [0.05, 0.02, 0.08], 0.03);
    let within = |cover: &EndEffectorVolume, point: Point3<f64>| {
        cover.balls().iter().any(|ball| (point - ball.centre).norm() <= ball.radius + 1e-12)
    };
    let sides = |k: usize| (0..=10).map(move |step| [0.05, 0.02, 0.08][k] * (f64::from(step) / 5.0 - 1.0));
    for x in sides(0) {
        assert!(sides(1).all(|y| sides(2).all(|z| within(&cover, pose.point(&Point3::new(x, y, z))))));
    }
    let ends = [Point3::new(0.0, 0.1, 0.0), Point3::new(0.2, 0.0, 0.1)];
    let cover = EndEffectorVolume::default().with_capsule(ends, 0.03);
    let across = (ends[1] - ends[0]).cross(&Vector3::z()).normalize() * 0.03;
    assert!((0..=100).all(|step| within(&cover, ends[0] + (ends[1] - ends[0]) * (f64::from(step) / 100.0) + across)));
}

/// A box of twelve triangles.
fn box_mesh(half: [f64; 3]) -> TriMesh {
    let corner = |index: usize| std::array::from_fn(|k| (if index >> k & 1 == 1 { half[k] } else { -half[k] }) as f32);
    let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    TriMesh { vertices: (0..8).map(corner).collect(), triangles }
}

fn points() -> impl Strategy<Value = [f64; 3]> {
    [0.0..0.8, -0.5..0.5, -0.1..0.6]
}

/// Whether a ball touches a box, by sampling nothing: the nearest point of the box.
fn touches_box(pose: &Pose<World, Object>, half: [f64; 3], centre: Point3<f64>, radius: f64) -> bool {
    let local = pose.inverse().point(&centre);
    let nearest = Point3::from(std::array::from_fn::<f64, 3, _>(|k| local[k].clamp(-half[k], half[k])));
    (local - nearest).norm() <= radius
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Obstacles by boxes, in any order, against masks and fields from scratch.
    #[test]
    fn boxes_are_as_from_scratch(
        directed in any::<bool>(),
        boxes in vec((points(), [-3.0..3.0, -1.5..1.5, -3.0..3.0], [0.01..0.2, 0.01..0.2, 0.01..0.2]), 1..4),
        cells in any::<bool>(),
        remove in any::<prop::sample::Index>(),
    ) {
        let metric = if cells && !directed { FieldMetric::Cells } else { METRES };
        let (grid, hand) = (if directed { on_sphere(1, 4) } else { grid([2, 4, 4]) }, hand());
        let mut map = ReachabilityMap::new(parts(&grid, metric)).unwrap();
        let clear = bits(&map);
        let scratch = |boxes: &[(Pose<World, Object>, [f64; 3])]| {
            let label = |cell: usize| {
                let world_from_hand = Pose::<World, EndEffector>::from_xyz_rpy(grid.pose(cell));
                let touched = hand.balls().iter().any(|ball| {
                    let centre = world_from_hand.point(&ball.centre);
                    boxes.iter().any(|(pose, half)| touches_box(pose, *half, centre, ball.radius))
                });
                if touched && clear.0[cell] == PoseLabel::Reachable { PoseLabel::Colliding } else { clear.0[cell] }
            };
            let labels: Vec<PoseLabel> = (0..grid.cells()).map(label).collect();
            let distances = field(&grid, &labels, metric);
            (labels, distances.iter().map(|distance| distance.to_bits()).collect::<Vec<_>>())
        };
        let mut boxes: Vec<_> = boxes.into_iter().map(|(at, angles, half)| (pose_at(at, angles), half)).collect();
        let mut states = vec![bits(&map)];
        let mut ids = Vec::new();
        for count in 1..=boxes.len() {
            let (pose, half) = &boxes[count - 1];
            ids.push(map.add_obstacle(&Obstacle::cuboid(pose, *half).unwrap(), &hand));
            prop_assert_eq!(bits(&map), scratch(&boxes[..count]));
            states.push(bits(&map));
        }
        prop_assert_eq!(map.obstacles().map(|(id, _)| id).collect::<Vec<_>>(), ids.clone());
        // One away and in again, then all away, last first.
        let gone = remove.index(boxes.len());
        prop_assert!(map.remove(ids[gone]) && !map.remove(ids[gone]));
        let taken = boxes.remove(gone);
        prop_assert_eq!(bits(&map), if boxes.is_empty() { clear.clone() } else { scratch(&boxes) });
        map.add_obstacle(&Obstacle::cuboid(&taken.0, taken.1).unwrap(), &hand);
        prop_assert_eq!(bits(&map), states.pop().unwrap());
        while map.undo().is_some() {}
        prop_assert_eq!(bits(&map), clear);
    }

    /// Occupied cells one by one.
    #[test]
    fn occupied_cells_are_boxes(
        occupied in vec([0_u32..9, 0_u32..9, 0_u32..9], 1..30),
        centres in vec([-0.3..0.8, -0.3..0.8, -0.3..0.8], 200),
        radius in 0.0..0.2,
        angles in [-3.0..3.0, -1.5..1.5, -3.0..3.0],
    ) {
        let (cell, mut grid) = (0.05, OccupancyGrid::new(9));
        occupied.iter().for_each(|cell| grid.set(*cell));
        let pose = pose_at([0.1, 0.2, -0.1], angles);
        let obstacle = Obstacle::occupancy(&pose, &grid, cell).unwrap();
        for centre in centres.into_iter().map(Point3::from) {
            let touched = occupied.iter().any(|indices| {
                let middle = Point3::from(indices.map(|index| (f64::from(index) + 0.5) * cell));
                let local = Pose::<Object, Object>::new(Rotation3::identity(), middle.coords);
                touches_box(&(pose * local), [cell / 2.0; 3], centre, radius)
            });
            prop_assert_eq!(obstacle.touches(&centre, radius), touched);
            if touched {
                let bounds = obstacle.bounds();
                prop_assert!((0..3).all(|k| centre[k] + radius >= bounds.min[k] && centre[k] - radius <= bounds.max[k]));
            }
        }
    }

    /// A mesh of a box against the box, for balls that are not swallowed.
    #[test]
    fn the_mesh_of_a_box_is_its_surface(at in points(), angles in [-3.0..3.0, -1.5..1.5, -3.0..3.0], centre in points(), radius in 0.0..0.3) {
        let half = [0.125, 0.0625, 0.25];
        let pose = pose_at(at, angles);
        let mesh = Obstacle::mesh(&pose, &box_mesh(half)).unwrap();
        let solid = Obstacle::cuboid(&pose, half).unwrap();
        let centre = Point3::from(centre);
        prop_assert!(!mesh.touches(&centre, radius) || solid.touches(&centre, radius));
        if !solid.touches(&centre, 0.0) && solid.touches(&centre, radius) == solid.touches(&centre, radius + 1e-9) {
            prop_assert_eq!(mesh.touches(&centre, radius), solid.touches(&centre, radius));
        }
    }
}
