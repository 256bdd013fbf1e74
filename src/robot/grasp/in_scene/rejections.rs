//! Yes-or-no tests of a hand's swept boxes against walls, lines, neighbours and the body itself, in this order.

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Translation3, Unit, Vector3};

use super::{
    super::passage::{PathObstacle, SceneObstacle, Surroundings},
    sweep::SweptBox,
};
use kernel::geom::SimdLevel;

/// Lines along a finger are at this share of half its sides from its middle, on both axes.
const LINES: f64 = 0.6;

/// Added to the cosines of axes that may be parallel, so that their product separates nothing by rounding.
const PARALLEL: f64 = 1e-9;

/// An open box of walls and a floor of one thickness, as bins are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenBox {
    /// Pose of the middle of its floor, z up.
    pub scene_from_box: IsometryMatrix3<f64>,
    /// The room inside [m].
    pub inner: [f64; 3],
    /// Thickness of walls and floor [m].
    pub wall: f64,
}

/// A box placed in a scene.
#[derive(Clone, Copy, Debug)]
struct Placed {
    pose: IsometryMatrix3<f64>,
    half: Vector3<f64>,
}

/// A mesh and a ball around it.
struct Ball<'s> {
    what: PathObstacle,
    obstacle: &'s SceneObstacle,
    obstacle_from_scene: IsometryMatrix3<f64>,
    /// In the scene [m].
    centre: Point3<f64>,
    radius: f64,
}

/// Everything around a body that a hand can touch.
pub(super) struct Around<'s> {
    walls: Vec<Placed>,
    /// The body itself, and all other meshes; the container only where it is no open box.
    own: Ball<'s>,
    others: Vec<Ball<'s>>,
    level: SimdLevel,
}

/// Order of the tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Test {
    Walls,
    Lines,
    Others,
    Own,
}

impl Test {
    pub(super) const ALL: [Self; 4] = [Self::Walls, Self::Lines, Self::Others, Self::Own];
}

impl OpenBox {
    /// Floor and walls.
    fn walls(&self) -> Vec<Placed> {
        let Self { scene_from_box, inner: [x, y, z], wall } = *self;
        let (half, height) = (wall / 2.0, (z + wall) / 2.0);
        let [side_x, side_y] = [(x + wall) / 2.0, (y + wall) / 2.0];
        let middle = (z - wall) / 2.0;
        let parts = [
            ([0.0, 0.0, -half], [x / 2.0 + wall, y / 2.0 + wall, half]),
            ([side_x, 0.0, middle], [half, y / 2.0 + wall, height]),
            ([-side_x, 0.0, middle], [half, y / 2.0 + wall, height]),
            ([0.0, side_y, middle], [x / 2.0 + wall, half, height]),
            ([0.0, -side_y, middle], [x / 2.0 + wall, half, height]),
        ];
        let place = |(at, half): ([f64; 3], [f64; 3])| Placed {
            pose: scene_from_box * Translation3::from(Vector3::from(at)),
            half: half.into(),
        };
        parts.map(place).to_vec()
    }
}

impl Placed {
    /// Whether two boxes overlap: by the 15 axes that can separate them (Gottschalk, Lin and Manocha 1996).
    fn overlaps(&self, other: &Self) -> bool {
        let rotation: Matrix3<f64> = self.pose.rotation.matrix().tr_mul(other.pose.rotation.matrix());
        let shift = self.pose.rotation.inverse() * (other.pose.translation.vector - self.pose.translation.vector);
        let abs = rotation.map(|cos| cos.abs() + PARALLEL);
        let (a, b) = (&self.half, &other.half);
        for axis in 0..3 {
            if shift[axis].abs() > a[axis] + abs.row(axis).transpose().dot(b)
                || rotation.column(axis).dot(&shift).abs() > abs.column(axis).dot(a) + b[axis]
            {
                return false;
            }
        }
        for i in 0..3 {
            let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
            for j in 0..3 {
                let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
                let reach = a[i1] * abs[(i2, j)] + a[i2] * abs[(i1, j)] + b[j1] * abs[(i, j2)] + b[j2] * abs[(i, j1)];
                if (shift[i2] * rotation[(i1, j)] - shift[i1] * rotation[(i2, j)]).abs() > reach {
                    return false;
                }
            }
        }
        true
    }
}

impl<'s> Ball<'s> {
    fn new(what: PathObstacle, obstacle: &'s SceneObstacle) -> Self {
        let bounds = obstacle.surface.bounds();
        Self {
            what,
            obstacle,
            obstacle_from_scene: obstacle.scene_from_obstacle.inverse(),
            centre: obstacle.scene_from_obstacle * bounds.centre(),
            radius: (bounds.max - bounds.min).norm() / 2.0,
        }
    }

    fn may_meet(&self, pose: &IsometryMatrix3<f64>, half: &Vector3<f64>) -> bool {
        (self.centre.coords - pose.translation.vector).norm() <= self.radius + half.norm()
    }

    /// Whether a box placed in the scene meets the mesh.
    fn meets_box(&self, pose: &IsometryMatrix3<f64>, half: &Vector3<f64>) -> bool {
        self.may_meet(pose, half) && self.obstacle.surface.meets_box(&(self.obstacle_from_scene * pose), half)
    }

    /// Whether one of four lines along a swept box meets the mesh, from its front backwards.
    fn meets_lines(
        &self,
        level: SimdLevel,
        pose: &IsometryMatrix3<f64>,
        half: &Vector3<f64>,
        (along, forward): (usize, f64),
    ) -> bool {
        if !self.may_meet(pose, half) {
            return false;
        }
        let obstacle_from_box = self.obstacle_from_scene * pose;
        let back = Unit::new_unchecked(obstacle_from_box.rotation * Vector3::ith(along, -forward));
        let (one, other) = ((along + 1) % 3, (along + 2) % 3);
        [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]].into_iter().any(|[u, v]| {
            let mut from = Point3::origin();
            (from[along], from[one], from[other]) =
                (forward * half[along], u * LINES * half[one], v * LINES * half[other]);
            self.obstacle.surface.meets_line(level, &(obstacle_from_box * from), &back, 2.0 * half[along])
        })
    }
}

impl<'s> Around<'s> {
    /// Surroundings of an object; `container` where the scene's container is an open box.
    pub(super) fn new(scene: &'s Surroundings, target: usize, container: Option<&OpenBox>, level: SimdLevel) -> Self {
        let vessel = scene.container.iter().filter(|_| container.is_none());
        let vessel = vessel.map(|vessel| Ball::new(PathObstacle::Container, vessel));
        let neighbours = scene.objects.iter().enumerate().filter(|(index, _)| *index != target);
        let neighbours = neighbours.map(|(index, obstacle)| Ball::new(PathObstacle::Neighbour(index), obstacle));
        Self {
            walls: container.map(OpenBox::walls).unwrap_or_default(),
            own: Ball::new(PathObstacle::Target, &scene.objects[target]),
            others: vessel.chain(neighbours).collect(),
            level,
        }
    }

    /// SceneObstacle of these boxes of a hand by one test; `None` if none of them meets anything.
    pub(super) fn blocks(
        &self,
        test: Test,
        boxes: &[SweptBox],
        scene_from_base: &IsometryMatrix3<f64>,
    ) -> Option<PathObstacle> {
        boxes.iter().find_map(|swept| {
            let pose = scene_from_base * swept.base_from_box;
            match test {
                Test::Walls => {
                    let placed = Placed { pose, half: swept.half };
                    self.walls.iter().any(|wall| wall.overlaps(&placed)).then_some(PathObstacle::Container)
                }
                Test::Lines => self.lines(swept, &pose, scene_from_base),
                Test::Others => {
                    self.others.iter().find(|other| other.meets_box(&pose, &swept.half)).map(|other| other.what)
                }
                Test::Own => {
                    let (base_from_own, half) = swept.own?;
                    self.own.meets_box(&(scene_from_base * base_from_own), &half).then_some(PathObstacle::Target)
                }
            }
        })
    }

    /// SceneObstacle of lines along a finger that moves along one of its own edges.
    fn lines(
        &self,
        swept: &SweptBox,
        pose: &IsometryMatrix3<f64>,
        scene_from_base: &IsometryMatrix3<f64>,
    ) -> Option<PathObstacle> {
        let along = swept.along.filter(|_| swept.is_finger)?;
        let other = self.others.iter().find(|other| other.meets_lines(self.level, pose, &swept.half, along));
        let own = || {
            let (base_from_own, half) = swept.own?;
            let pose = scene_from_base * base_from_own;
            self.own.meets_lines(self.level, &pose, &half, along).then_some(PathObstacle::Target)
        };
        other.map(|other| other.what).or_else(own)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use kernel::{
        geom::{TriMesh, TriangleTree},
        seed::Stream,
    };

    #[test]
    fn walls_are_those_of_the_mesh_of_a_bin() {
        let (inner, wall) = ([0.3, 0.2, 0.1], 0.01);
        let mesh = TriMesh::open_box(inner, wall);
        let tree = TriangleTree::new(&mesh);
        let walls = OpenBox { scene_from_box: IsometryMatrix3::identity(), inner, wall }.walls();
        let mut draw = Stream::of_job(1, b"", "walls");
        let (mut met, mut clear) = (0, 0);
        for _ in 0..5000 {
            let rotation = Rotation3::from_euler_angles(draw.uniform(-3.0, 3.0), draw.uniform(-1.5, 1.5), 0.2);
            let at = Vector3::new(draw.uniform(-0.2, 0.2), draw.uniform(-0.15, 0.15), draw.uniform(-0.06, 0.15));
            let pose = IsometryMatrix3::from_parts(at.into(), rotation);
            let half = Vector3::from([(); 3].map(|()| draw.uniform(0.011, 0.04)));
            // No such box fits into a wall: it meets the walls where it meets the mesh.
            let overlaps = walls.iter().any(|wall| wall.overlaps(&Placed { pose, half }));
            assert_eq!(overlaps, tree.meets_box(&pose, &half), "{pose} {half}");
            if overlaps { met += 1 } else { clear += 1 }
        }
        assert!(met > 1000 && clear > 1000, "{met} {clear}");
    }
}
