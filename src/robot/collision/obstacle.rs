//! Obstacles that come and go: shapes prepared once, which checkers of one robot share.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3};

use super::{
    body::Geometry,
    cells,
    checker::{CheckedBody, CollisionChecker, PlacedBody, triangles_of},
    curved::Curved,
    solid::Solid,
};
use kernel::geom::{NoSurface, OccupancyGrid, Shape, SimdLevel};

/// Shapes that a robot must not touch, prepared for its checks, in a frame of their own. Clones share the shapes.
///
/// Boxes, balls, capsules and cylinders take microseconds to prepare; a mesh tens of milliseconds, and occupied cells some
/// milliseconds.
#[derive(Clone)]
pub struct Obstacle {
    body: Arc<CheckedBody>,
}

/// An obstacle in the scene of a robot.
#[derive(Clone)]
pub struct PlacedObstacle {
    /// The shapes.
    pub obstacle: Obstacle,
    /// Link that carries it (see [`Body::link`](super::Body::link)): 0 for the world, the last for an object in the hand.
    pub link: usize,
    /// The obstacle's frame expressed in the link's.
    pub link_from_obstacle: IsometryMatrix3<f64>,
}

impl Obstacle {
    /// From shapes in the obstacle's frame, at least one.
    ///
    /// # Errors
    /// When a mesh has no triangle with an area, or no shape is given.
    pub fn new(geometries: &[Geometry]) -> Result<Self, NoSurface> {
        let level = SimdLevel::detect().usable();
        let (meshes, others): (Vec<_>, Vec<_>) =
            geometries.iter().cloned().partition(|geometry| matches!(geometry.shape, Shape::Mesh(_)));
        let curved: Vec<Curved> = others.iter().filter_map(Curved::closed_form).collect();
        let triangles = triangles_of(&meshes);
        let solid = if triangles.is_empty() && !curved.is_empty() { None } else { Some(Solid::new(triangles, level)?) };
        Ok(Self { body: Arc::new(CheckedBody::of_parts(solid, curved)) })
    }

    /// The occupied cells of a grid as solid cubes of side `cell_size` [m]; the frame's origin is the lower corner of cell
    /// (0, 0, 0). `None` of an empty grid.
    ///
    /// # Panics
    /// When `cell_size` is not above 0.
    pub fn of_cells(grid: &OccupancyGrid, cell_size: f64) -> Option<Self> {
        assert!(cell_size > 0.0, "cells have a size");
        let solid = cells::solid_of_cells(grid, cell_size, SimdLevel::detect().usable())?;
        Some(Self { body: Arc::new(CheckedBody::of_parts(Some(solid), Vec::new())) })
    }

    /// A ball around all shapes, in the obstacle's frame: centre and radius [m].
    pub fn ball(&self) -> (Point3<f64>, f64) {
        (self.body.centre, self.body.radius)
    }

    /// At a pose in the world.
    #[must_use]
    pub fn at(&self, world_from_obstacle: IsometryMatrix3<f64>) -> PlacedObstacle {
        PlacedObstacle { obstacle: self.clone(), link: 0, link_from_obstacle: world_from_obstacle }
    }
}

impl CollisionChecker {
    /// A checker of the same robot among obstacles; the robot's shapes are shared.
    ///
    /// Obstacles follow the robot's bodies in their order, and their pairs follow the robot's: each obstacle with every
    /// prepared body and every earlier obstacle that another link carries, if `meets` is true for the two (indices in the list of
    /// bodies with the obstacles, the lower first). Begin with [`CollisionChecker::for_obstacles`], which prepares every
    /// body that moves.
    ///
    /// ```
    /// use graspmill_robot::collision::{Bodies, Body, CollisionChecker, Geometry, Obstacle, Shape};
    /// use nalgebra::IsometryMatrix3;
    ///
    /// let ball = |radius| vec![Geometry { shape: Shape::Sphere { radius }, link_from_shape: IsometryMatrix3::identity() }];
    /// let bodies = vec![Body { name: "hand".to_owned(), link: 1, geometries: ball(0.1) }];
    /// let robot = CollisionChecker::for_obstacles(&Bodies { bodies, pairs: Vec::new() })?;
    /// let wall = Obstacle::new(&ball(0.2))?.at(IsometryMatrix3::translation(0.5, 0.0, 0.0));
    /// let checker = robot.among(&[wall], |_| true);
    /// // The frames of the world and of the link.
    /// let links = |x| [IsometryMatrix3::identity(), IsometryMatrix3::translation(x, 0.0, 0.0)];
    /// assert!(checker.pair(0, &links(0.25)));
    /// assert!((checker.clearance(0, &links(0.0), 1.0) - 0.2).abs() < 1e-5);
    /// # Ok::<(), kernel::geom::NoSurface>(())
    /// ```
    #[must_use]
    pub fn among(&self, obstacles: &[PlacedObstacle], meets: impl Fn([usize; 2]) -> bool) -> Self {
        let mut checker = self.clone();
        for PlacedObstacle { obstacle, link, link_from_obstacle } in obstacles {
            let index = checker.bodies.len();
            let body = Arc::clone(&obstacle.body);
            checker.bodies.push(Some(PlacedBody { body, link: *link, link_from_body: Some(*link_from_obstacle) }));
            checker.links.push(*link);
            for other in 0..index {
                let moves = checker.links[other] != *link && checker.bodies[other].is_some();
                if moves && meets([other, index]) {
                    checker.add_pair([other, index]);
                }
            }
        }
        checker
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::*;
    use crate::collision::{Bodies, Body, CollisionVerdict, Triangles};
    use kernel::seed::Stream;

    fn pose(draw: &mut Stream, spread: f64) -> IsometryMatrix3<f64> {
        let shift = Vector3::from([(); 3].map(|()| draw.uniform(-spread, spread)));
        let angles = [(); 3].map(|()| draw.uniform(-3.0, 3.0));
        IsometryMatrix3::from_parts(shift.into(), Rotation3::from_euler_angles(angles[0], angles[1], angles[2]))
    }

    fn shape(shape: Shape, x: f64) -> Geometry {
        Geometry { shape, link_from_shape: IsometryMatrix3::translation(x, 0.0, 0.0) }
    }

    /// A tetrahedron.
    fn mesh(size: f64) -> Shape {
        let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let corners = corners.map(|corner| Point3::from(corner.map(|value: f64| value * size))).to_vec();
        Shape::Mesh(Triangles { corners, triangles: vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]] }.into())
    }

    /// A robot of two links.
    fn robot() -> Vec<Body> {
        let body = |name: &str, link, geometries| Body { name: name.to_owned(), link, geometries };
        let upper = vec![
            shape(Shape::Box { half: [0.15, 0.04, 0.03] }, 0.1),
            shape(Shape::Capsule { radius: 0.03, half: 0.1 }, 0.2),
        ];
        let fore = vec![shape(mesh(0.05), 0.05), shape(Shape::Cylinder { radius: 0.02, half: 0.1 }, -0.05)];
        vec![body("upper", 1, upper), body("fore", 2, fore)]
    }

    fn obstacles() -> Vec<Vec<Geometry>> {
        vec![
            vec![shape(Shape::Box { half: [0.1, 0.06, 0.12] }, 0.0)],
            vec![shape(Shape::Sphere { radius: 0.08 }, 0.0), shape(Shape::Box { half: [0.05; 3] }, 0.1)],
            vec![shape(Shape::Cylinder { radius: 0.06, half: 0.1 }, 0.02)],
            vec![shape(Shape::Capsule { radius: 0.04, half: 0.15 }, 0.0)],
            vec![shape(mesh(0.1), 0.0)],
        ]
    }

    fn cells() -> (OccupancyGrid, Shape) {
        let mut grid = OccupancyGrid::new(6);
        for cell in [[1, 1, 1], [2, 1, 1], [2, 2, 1], [2, 2, 2], [4, 4, 4], [3, 2, 2], [2, 3, 2]] {
            grid.set(cell);
        }
        let triangles = cells::triangles_of_cells(&grid, 0.04);
        let corners: Vec<_> = triangles.iter().flatten().copied().collect();
        let triangles = (0..triangles.len() as u32).map(|index| [0, 1, 2].map(|corner| 3 * index + corner)).collect();
        (grid, Shape::Mesh(Triangles { corners, triangles }.into()))
    }

    /// A checker with obstacles, one built from scratch with obstacles as bodies of the robot, and the number of pairs.
    fn both(draw: &mut Stream) -> (CollisionChecker, CollisionChecker, usize) {
        let (bodies, pairs) = (robot(), vec![[0, 1]]);
        let checker = CollisionChecker::for_obstacles(&Bodies { bodies: bodies.clone(), pairs }).expect("shapes");
        let (grid, surface) = cells();
        let mut all = bodies;
        let (mut placed, mut pairs) = (Vec::new(), vec![[0, 1]]);
        let mut kinds = obstacles();
        kinds.push(vec![Geometry { shape: surface, link_from_shape: IsometryMatrix3::identity() }]);
        for (kind, geometries) in kinds.iter().enumerate() {
            let world = pose(draw, 0.4);
            let obstacle = match kind {
                5 => Obstacle::of_cells(&grid, 0.04).expect("cells"),
                _ => Obstacle::new(geometries).expect("shapes"),
            };
            placed.push(obstacle.at(world));
            let moved = geometries
                .iter()
                .map(|geometry| Geometry { link_from_shape: world * geometry.link_from_shape, ..geometry.clone() });
            pairs.extend([[0, all.len()], [1, all.len()]]);
            all.push(Body { name: kind.to_string(), link: 0, geometries: moved.collect() });
        }
        let count = pairs.len();
        let scratch = CollisionChecker::new(&Bodies { bodies: all, pairs }).expect("shapes");
        (checker.among(&placed, |_| true), scratch, count)
    }

    #[test]
    fn verdicts_and_distances_are_those_of_a_checker_built_with_the_obstacles() {
        let mut draw = Stream::of_job(1, b"", "obstacles");
        let (mut touching, mut free, mut compared) = (0, 0, 0);
        for _ in 0..5 {
            let (among, scratch, count) = both(&mut draw);
            assert!(among.pairs().eq(scratch.pairs()));
            for round in 0..2000 {
                let links = [IsometryMatrix3::identity(), pose(&mut draw, 0.4), pose(&mut draw, 0.4)];
                for pair in 0..count {
                    let verdict = among.pair(pair, &links);
                    assert_eq!(verdict, scratch.pair(pair, &links), "pair {pair}");
                    touching += u32::from(verdict);
                    if verdict || round % 50 > 0 {
                        continue;
                    }
                    free += 1;
                    let most = 0.2;
                    let [found, other] = [&among, &scratch].map(|checker| checker.clearance(pair, &links, most));
                    // One of two cylinders is approximated by a prism.
                    let error = if pair == 6 { 1e-4 } else { 4e-6 };
                    assert!((found - other).abs() < error, "pair {pair}: {found} {other}");
                    compared += u32::from(found < most);
                    assert!(among.clearance_at_least(pair, &links, 0.33 * found - 2e-6), "pair {pair}: {found}");
                    assert!(found >= most || !among.clearance_at_least(pair, &links, found + 4e-6 + error));
                }
                if round == 0 {
                    let all = among.hits(0..count, &links).count();
                    let verdict = among.check(0..count, &links);
                    assert_eq!(verdict == CollisionVerdict::Free, all == 0);
                }
            }
        }
        assert!(touching > 4000 && free > 1000 && compared > 300, "{touching} {free} {compared}");
    }

    /// Bodies that move by less than their clearance do not touch.
    #[test]
    fn clearance_is_room_to_move() {
        let mut draw = Stream::of_job(2, b"", "obstacles");
        let (among, _, count) = both(&mut draw);
        for _ in 0..60 {
            let links = [IsometryMatrix3::identity(), pose(&mut draw, 0.5), pose(&mut draw, 0.5)];
            for pair in (0..count).filter(|pair| !among.pair(*pair, &links)).collect::<Vec<_>>() {
                let room = among.clearance(pair, &links, 1.0);
                let direction = Vector3::from([(); 3].map(|()| draw.normal())).normalize();
                let moved = IsometryMatrix3::from_parts((direction * (0.999 * room)).into(), Rotation3::identity());
                let links = [links[0], moved * links[1], links[2]];
                assert!(pair % 2 > 0 && pair > 0 || !among.pair(pair, &links), "pair {pair}: {room}");
            }
        }
    }

    #[test]
    fn an_object_in_the_hand_is_checked_with_what_moves_against_it() {
        let bodies = Bodies { bodies: robot(), pairs: vec![[0, 1]] };
        let checker = CollisionChecker::for_obstacles(&bodies).expect("shapes");
        let ball = Obstacle::new(&[shape(Shape::Sphere { radius: 0.05 }, 0.0)]).expect("a shape");
        let held = PlacedObstacle { obstacle: ball.clone(), link: 2, link_from_obstacle: IsometryMatrix3::identity() };
        let among = checker.among(&[held, ball.at(IsometryMatrix3::translation(1.0, 0.0, 0.0))], |_| true);
        // The robot's own pair; the held ball with the upper arm; the wall with the arm, the hand and the held ball.
        let links: Vec<_> = among.pairs().collect();
        assert_eq!(links, [[1, 2], [1, 2], [1, 0], [2, 0], [2, 0]]);
        assert_eq!(Obstacle::of_cells(&OccupancyGrid::new(4), 0.1).map(|_| ()), None);
        assert!(Obstacle::new(&[]).is_err());
    }
}
