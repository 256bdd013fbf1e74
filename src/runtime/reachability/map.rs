//! Queries of a robot's reachable set: labels, distances, witnesses and obstacles.

use std::{cmp::Ordering, collections::BTreeMap};

use nalgebra::{Point3, Rotation3, Vector3};

use super::{Ball, EndEffectorVolume, Obstacle};
use kernel::geom::{FieldLookup, FieldMetric, PoseGrid, PoseLabel};

/// Cells between two stored counts of earlier reachable cells.
const STRIDE: usize = 64;

/// The robot, its planning group and the frames of the poses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RobotFacts {
    /// Name of the robot, for people.
    pub robot: String,
    /// The planning group, from the base outward.
    pub joints: Vec<String>,
    /// The site that reaches the poses.
    pub target: String,
    /// The frame of the poses.
    pub frame: String,
}

/// Parts of a [`ReachabilityMap`].
#[derive(Clone, Debug)]
pub struct ReachabilityParts {
    /// The poses.
    pub grid: PoseGrid,
    /// Metric of the distances.
    pub metric: FieldMetric,
    /// One label per cell, in the order of the grid.
    pub labels: Vec<PoseLabel>,
    /// Signed distance of each cell, negative inside.
    pub distances: Vec<f32>,
    /// Joint values [rad or m] of each reachable cell, in the order of the cells.
    pub witnesses: Option<Vec<f64>>,
    /// The robot, its planning group and the frames of the poses.
    pub robot: RobotFacts,
}

/// Reason why parts do not form a [`ReachabilityMap`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidMap {
    /// A count that differs from that of the grid or the labels.
    #[error("{found} {what}, {expected} expected")]
    Count {
        /// Kind of counted item.
        what: &'static str,
        /// Count given.
        found: usize,
        /// Count required.
        expected: usize,
    },
    /// A grid of directions with cells as the unit.
    #[error("a grid of directions has no distances in cells; use metres (profile `standard`)")]
    Metric,
    /// A distance whose sign contradicts the label.
    #[error("cell {cell}: distance {distance} of a cell that is {}; it must be negative exactly for reachable cells", label.name())]
    Sign {
        /// Index of the cell.
        cell: usize,
        /// Label of the cell.
        label: PoseLabel,
        /// Distance of the cell.
        distance: f32,
    },
}

/// An obstacle that was added to a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObstacleId(u64);

/// The cell nearest to a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestCell<'a> {
    /// Index of the cell.
    pub cell: usize,
    /// The pose of its centre: x, y, z [m], roll, pitch, yaw [rad].
    pub pose: [f64; 6],
    /// Label of the cell, including obstacles.
    pub label: PoseLabel,
    /// Joint values that reach the pose, for a reachable cell of a map with witnesses.
    pub witness: Option<&'a [f64]>,
}

/// A pose in a ranking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranked {
    /// Index of the pose in the ranked list.
    pub index: usize,
    /// Distance at the pose, negative inside.
    pub distance: f64,
}

/// The reachable set of a robot: distances, labels, witnesses, and obstacles that can be added and removed.
///
/// Poses are x, y, z [m], roll, pitch, yaw [rad] with rotation Rz(yaw) Ry(pitch) Rx(roll), of the target site in the frame
/// that [`RobotFacts`] names; `Pose::xyz_rpy` gives them.
///
/// A map of positions within a ball, reachable with every orientation, and an obstacle in it:
///
/// ```
/// use graspmill_runtime::{Ball, EndEffectorVolume, Obstacle, ReachabilityMap, ReachabilityParts, RobotFacts};
/// use kernel::geom::{Axis, AxisUnit, FieldMetric, HealPix, METRES_PER_RADIAN, Pose, PoseGrid, PoseLabel};
/// use nalgebra::Point3;
///
/// let axis = |name| Axis { name, unit: AxisUnit::Metre, first: -0.45, step: 0.1, count: 10, periodic: false };
/// let directions = HealPix::new(1).expect("a power of two");
/// let grid = PoseGrid::on_sphere([axis("x"), axis("y"), axis("z")], directions, 4)?;
/// let is_inside = |cell| {
///     let [x, y, z, ..] = grid.pose(cell);
///     x * x + y * y + z * z < 0.35 * 0.35
/// };
/// let inside: Vec<bool> = (0..grid.cells()).map(is_inside).collect();
/// let label = |is_inside: &bool| if *is_inside { PoseLabel::Reachable } else { PoseLabel::NoSolution };
/// let labels = inside.iter().map(label).collect();
/// let metric = FieldMetric::Metres { rho: METRES_PER_RADIAN };
/// let distances = metric.signed_distance(&inside, &grid);
/// let robot = RobotFacts::default();
/// let mut map = ReachabilityMap::new(ReachabilityParts { grid, metric, labels, distances, witnesses: None, robot })?;
///
/// let pose = [0.2, 0.0, 0.0, 0.0, 0.0, 0.0];
/// let (distance, gradient) = map.distance_and_gradient(&pose);
/// assert!(distance < 0.0 && gradient[0] > 0.0, "inside, and deeper towards the centre");
///
/// let obstacle = Obstacle::cuboid(&Pose::from_xyz_rpy(pose), [0.05, 0.2, 0.2])?;
/// let hand = EndEffectorVolume::new(vec![Ball { centre: Point3::origin(), radius: 0.05 }]);
/// let id = map.add_obstacle(&obstacle, &hand);
/// assert!(map.distance(&pose) > 0.0, "the hand would touch the obstacle");
/// assert!(map.remove(id) && map.distance(&pose) == distance);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ReachabilityMap {
    robot: RobotFacts,
    lookup: FieldLookup,
    labels: Vec<PoseLabel>,
    distances: Vec<f32>,
    /// Labels and distances without obstacles, stored while there are obstacles.
    clear: Option<(Vec<PoseLabel>, Vec<f32>)>,
    /// Cells that each obstacle blocks, among those reachable without obstacles.
    obstacles: Vec<(ObstacleId, Vec<u32>)>,
    next: u64,
    witnesses: Option<Vec<f64>>,
    /// Number of reachable cells without obstacles.
    reachable: usize,
    /// Number of reachable cells before every `STRIDE`-th cell.
    reachable_before: Vec<u32>,
    /// The grid's rotations, and the orientations that describe each.
    rotations: Vec<(Rotation3<f64>, Vec<usize>)>,
}

/// Balls that cover the arm [m, world], given joint values; they are added to the list.
pub type ArmCover<'a> = &'a dyn Fn(&[f64], &mut Vec<Ball>);

impl ReachabilityMap {
    /// Builds a map from its parts.
    ///
    /// # Errors
    /// When a count or a sign does not match.
    pub fn new(parts: ReachabilityParts) -> Result<Self, InvalidMap> {
        let ReachabilityParts { grid, metric, labels, distances, witnesses, robot } = parts;
        let count = |what, found, expected| {
            if found == expected { Ok(()) } else { Err(InvalidMap::Count { what, found, expected }) }
        };
        if !metric.fits(&grid) {
            return Err(InvalidMap::Metric);
        }
        count("labels", labels.len(), grid.cells())?;
        count("distances", distances.len(), grid.cells())?;
        for (cell, (label, distance)) in labels.iter().zip(&distances).enumerate() {
            let holds = if *label == PoseLabel::Reachable { *distance < 0.0 } else { *distance > 0.0 };
            if !holds {
                return Err(InvalidMap::Sign { cell, label: *label, distance: *distance });
            }
        }
        let (mut reachable_before, mut before) = (Vec::with_capacity(labels.len() / STRIDE + 1), 0);
        for some in labels.chunks(STRIDE) {
            reachable_before.push(before);
            before += some.iter().filter(|label| **label == PoseLabel::Reachable).count() as u32;
        }
        let (lookup, rotations) = (FieldLookup::new(&grid, metric), rotations(&grid));
        let (clear, obstacles, next) = (None, Vec::new(), 0);
        let mut map = Self {
            robot,
            lookup,
            labels,
            distances,
            clear,
            obstacles,
            next,
            witnesses: None,
            reachable: before as usize,
            reachable_before,
            rotations,
        };
        witnesses.map_or(Ok(()), |witnesses| map.set_witnesses(witnesses))?;
        Ok(map)
    }

    /// Adds witnesses: joint values of each cell that is reachable without obstacles, in the order of the cells.
    pub(super) fn set_witnesses(&mut self, witnesses: Vec<f64>) -> Result<(), InvalidMap> {
        let (found, expected) = (witnesses.len(), self.reachable * self.robot.joints.len());
        if found != expected {
            return Err(InvalidMap::Count { what: "joint values of witnesses", found, expected });
        }
        self.witnesses = Some(witnesses);
        Ok(())
    }

    /// Whether the map has joint values of its reachable cells.
    pub fn has_witnesses(&self) -> bool {
        self.witnesses.is_some()
    }

    /// The robot, its planning group and the frames of the poses.
    pub fn robot(&self) -> &RobotFacts {
        &self.robot
    }

    /// The grid.
    pub fn grid(&self) -> &PoseGrid {
        self.lookup.grid()
    }

    /// Metric of the distances.
    pub fn metric(&self) -> FieldMetric {
        self.lookup.metric()
    }

    /// One label per cell, including obstacles.
    pub fn labels(&self) -> &[PoseLabel] {
        &self.labels
    }

    /// Signed distance of each cell, including obstacles.
    pub fn distances(&self) -> &[f32] {
        &self.distances
    }

    /// Signed distance at a pose, negative inside the reachable set.
    ///
    /// See [`FieldLookup::value_and_gradient`] for values between centres and outside the grid.
    pub fn distance(&self, pose: &[f64; 6]) -> f64 {
        self.distance_and_gradient(pose).0
    }

    /// Signed distance at a pose, and its gradient per metre (x, y, z) and per radian (roll, pitch, yaw). Moving against the
    /// gradient lowers the distance and leads deeper inside.
    pub fn distance_and_gradient(&self, pose: &[f64; 6]) -> (f64, [f64; 6]) {
        self.lookup.value_and_gradient(&self.distances, pose)
    }

    /// Signed distances and gradients at many poses; see [`Self::distance_and_gradient`].
    pub fn distances_and_gradients<'a>(
        &'a self,
        poses: impl IntoIterator<Item = &'a [f64; 6]> + 'a,
    ) -> impl Iterator<Item = (f64, [f64; 6])> + 'a {
        poses.into_iter().map(|pose| self.distance_and_gradient(pose))
    }

    /// Whether a pose is in the box of the grid's cells: within half a step of a centre on every non-periodic axis. Directions
    /// cover the whole sphere.
    pub fn is_in_grid(&self, pose: &[f64; 6]) -> bool {
        let axes = match self.grid() {
            PoseGrid::Axes(grid) => &grid.axes()[..],
            PoseGrid::Sphere(grid) => &grid.position_axes()[..],
        };
        let inside = axes.iter().zip(pose).all(|(axis, coordinate)| {
            let steps = (coordinate - axis.first) / axis.step;
            axis.periodic || (-0.5..=axis.count as f64 - 0.5).contains(&steps)
        });
        inside && pose.iter().all(|coordinate| coordinate.is_finite())
    }

    /// The cell nearest to a pose (see [`PoseGrid::nearest`]); `None` for a pose that is not finite.
    pub fn nearest_cell(&self, pose: &[f64; 6]) -> Option<NearestCell<'_>> {
        if !pose.iter().all(|coordinate| coordinate.is_finite()) {
            return None;
        }
        let cell = self.grid().nearest(*pose);
        Some(NearestCell { cell, pose: self.grid().pose(cell), label: self.labels[cell], witness: self.witness(cell) })
    }

    /// Joint values that reach a cell; `None` if it is not reachable or the map has no witnesses.
    pub fn witness(&self, cell: usize) -> Option<&[f64]> {
        if self.labels[cell] == PoseLabel::Reachable { self.clear_witness(cell) } else { None }
    }

    /// The witness of a cell that is reachable without obstacles.
    fn clear_witness(&self, cell: usize) -> Option<&[f64]> {
        let witnesses = self.witnesses.as_ref().filter(|_| self.is_clear(cell))?;
        let first = cell / STRIDE * STRIDE;
        let near = self.clear_labels()[first..cell].iter().filter(|label| **label == PoseLabel::Reachable).count();
        let (row, joints) = (self.reachable_before[cell / STRIDE] as usize + near, self.robot.joints.len());
        Some(&witnesses[row * joints..(row + 1) * joints])
    }

    /// Ranks poses by distance, the deepest inside first; equal poses keep their order, and those without a value come last.
    pub fn rank(&self, poses: &[[f64; 6]]) -> Vec<Ranked> {
        let mut ranked: Vec<Ranked> =
            poses.iter().enumerate().map(|(index, pose)| Ranked { index, distance: self.distance(pose) }).collect();
        ranked.sort_by(|a, b| {
            let unknown = a.distance.is_nan().cmp(&b.distance.is_nan());
            unknown.then(a.distance.partial_cmp(&b.distance).unwrap_or(Ordering::Equal))
        });
        ranked
    }

    /// Adds an obstacle: cells at which the end effector touches it become `Colliding`, and distances are computed for the
    /// remaining cells.
    ///
    /// Only the end effector counts; for the arm see [`Self::add_obstacle_for_arm`].
    pub fn add_obstacle(&mut self, obstacle: &Obstacle, end_effector: &EndEffectorVolume) -> ObstacleId {
        let blocked = self.touching(obstacle, end_effector.balls());
        self.put(blocked)
    }

    /// Adds an obstacle as [`Self::add_obstacle`] does, and also blocks cells in which the arm touches the obstacle for all
    /// witnesses (of all cells that describe one pose). Other joint values might still be free: the result is conservative.
    ///
    /// In a map without witnesses, only the end effector counts.
    pub fn add_obstacle_for_arm(
        &mut self,
        obstacle: &Obstacle,
        end_effector: &EndEffectorVolume,
        arm: ArmCover,
    ) -> ObstacleId {
        let mut blocked = self.touching(obstacle, end_effector.balls());
        if self.witnesses.is_some() {
            let angles = self.grid().orientations();
            let mut balls = Vec::new();
            let mut passes = |cell: usize| {
                balls.clear();
                self.clear_witness(cell).is_some_and(|joints| {
                    arm(joints, &mut balls);
                    !balls.iter().any(|ball| obstacle.touches(&ball.centre, ball.radius))
                })
            };
            for position in 0..self.grid().positions() {
                for (_, alike) in &self.rotations {
                    let cells = alike.iter().map(|angle| position * angles + angle);
                    if !cells.clone().any(&mut passes) {
                        // Cells that are unreachable without obstacles are not assigned to an obstacle.
                        blocked.extend(cells.filter(|cell| self.is_clear(*cell)).map(|cell| cell as u32));
                    }
                }
            }
            blocked.sort_unstable();
            blocked.dedup();
        }
        self.put(blocked)
    }

    /// Removes an obstacle: labels and distances become byte for byte those without it. Returns `false` if there is no such
    /// obstacle.
    pub fn remove(&mut self, obstacle: ObstacleId) -> bool {
        let Some(position) = self.obstacles.iter().position(|(id, _)| *id == obstacle) else { return false };
        self.obstacles.remove(position);
        self.renew();
        true
    }

    /// Removes the obstacle that was added last; `None` if there is none.
    pub fn undo(&mut self) -> Option<ObstacleId> {
        let (last, _) = *self.obstacles.last()?;
        self.remove(last);
        Some(last)
    }

    /// The obstacles in the order added, each with the number of cells that it blocks and that are reachable without obstacles.
    pub fn obstacles(&self) -> impl Iterator<Item = (ObstacleId, usize)> + '_ {
        self.obstacles.iter().map(|(id, blocked)| (*id, blocked.len()))
    }

    fn put(&mut self, blocked: Vec<u32>) -> ObstacleId {
        let id = ObstacleId(self.next);
        self.next += 1;
        self.obstacles.push((id, blocked));
        self.renew();
        id
    }

    /// Recomputes labels and distances for the present obstacles.
    fn renew(&mut self) {
        if self.obstacles.is_empty() {
            if let Some(clear) = self.clear.take() {
                (self.labels, self.distances) = clear;
            }
            return;
        }
        let (labels, _) = self.clear.get_or_insert_with(|| (self.labels.clone(), std::mem::take(&mut self.distances)));
        self.labels.copy_from_slice(labels);
        for cell in self.obstacles.iter().flat_map(|(_, blocked)| blocked) {
            self.labels[*cell as usize] = PoseLabel::Colliding;
        }
        let inside: Vec<bool> = self.labels.iter().map(|label| *label == PoseLabel::Reachable).collect();
        self.distances = self.lookup.metric().signed_distance(&inside, self.lookup.grid());
    }

    /// Labels without obstacles.
    pub(super) fn clear_labels(&self) -> &[PoseLabel] {
        self.clear.as_ref().map_or(&self.labels, |(labels, _)| labels)
    }

    /// Whether a cell is reachable without obstacles.
    fn is_clear(&self, cell: usize) -> bool {
        self.clear_labels()[cell] == PoseLabel::Reachable
    }

    /// The cells, reachable without obstacles, at which a ball touches the obstacle, in order.
    fn touching(&self, obstacle: &Obstacle, balls: &[Ball]) -> Vec<u32> {
        let (grid, angles, bounds) = (self.grid(), self.grid().orientations(), obstacle.bounds());
        let counts = grid.position_counts();
        let mut touched = vec![false; grid.positions()];
        let (mut positions, mut blocked) = (Vec::new(), Vec::new());
        for (rotation, alike) in &self.rotations {
            for Ball { centre, radius } in balls {
                // Centre of the ball relative to the position; constant for a rotation.
                let away = rotation * centre.coords;
                // Positions at which the ball may reach the obstacle's box, a little more for rounding.
                let [xs, ys, zs] = [0, 1, 2].map(|k| {
                    let (axis, reach) = (&grid.position_axes()[k], radius + 1e-9);
                    let steps = |world: f64| (world - away[k] - axis.first) / axis.step;
                    let first = steps(bounds.min[k] - reach).ceil().max(0.0) as usize;
                    first..(steps(bounds.max[k] + reach).floor() + 1.0).clamp(0.0, axis.count as f64) as usize
                });
                // Exact test of ball and obstacle at each of these positions.
                let centre = |k: usize, index: usize| grid.position_axes()[k].centre(index);
                for x in xs {
                    for y in ys.clone() {
                        for z in zs.clone() {
                            let position = PoseGrid::position(counts, [x, y, z]);
                            let centre_of_ball =
                                Point3::from(Vector3::new(centre(0, x), centre(1, y), centre(2, z)) + away);
                            if !touched[position] && obstacle.touches(&centre_of_ball, *radius) {
                                touched[position] = true;
                                positions.push(position);
                            }
                        }
                    }
                }
            }
            // Cells of all equal orientations at the touched positions; the marks are cleared for the next rotation.
            for position in positions.drain(..) {
                touched[position] = false;
                let cells = alike.iter().map(|angle| position * angles + angle);
                blocked.extend(cells.filter(|cell| self.is_clear(*cell)).map(|cell| cell as u32));
            }
        }
        blocked.sort_unstable();
        blocked
    }
}

/// The rotations of a grid, and the orientations that describe each. Equal orientations share one computed rotation, so that they
/// get equal results.
fn rotations(grid: &PoseGrid) -> Vec<(Rotation3<f64>, Vec<usize>)> {
    let mut found: BTreeMap<[i32; 9], (Rotation3<f64>, Vec<usize>)> = BTreeMap::new();
    for angle in 0..grid.orientations() {
        let rotation = grid.rotation(angle);
        let mut rounded = rotation.matrix().iter().map(|entry| (entry * 1e6).round() as i32);
        let key = std::array::from_fn(|_| rounded.next().unwrap_or_default());
        found.entry(key).or_insert((rotation, Vec::new())).1.push(angle);
    }
    found.into_values().collect()
}
