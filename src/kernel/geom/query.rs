//! Closest points and rays against a triangle mesh, and whether two shapes touch: the only place that names parry (whose
//! `Vector` is glam's; nalgebra is converted here and nowhere else).

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};
use parry3d_f64::{
    math::{Matrix, Pose as ParryPose, Rotation, Vector},
    query::{PointQuery, Ray, RayCast, intersection_test},
    shape::{Ball, Capsule, Cuboid, Cylinder, Shape as ParryShape, TriMesh as ParryMesh, Triangle},
};

use super::{Shape, TriMesh};

/// A triangle mesh with a search tree over it.
pub struct MeshQuery {
    mesh: ParryMesh,
}

/// Where a ray meets the surface first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Distance from the ray's origin [m].
    pub distance: f64,
    /// Index of the triangle; of several at one edge or corner, any.
    pub triangle: u32,
    /// Unit normal of the triangle, pointing against the ray.
    pub normal: Unit<Vector3<f64>>,
}

/// A mesh without a surface that queries could search.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no search tree over {triangles} triangles and {vertices} vertices: {reason}; repair or leave out the mesh")]
pub struct NoSurface {
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Reason that the library gives.
    pub reason: String,
}

impl MeshQuery {
    /// Builds the tree.
    ///
    /// # Errors
    /// When the mesh has no triangles.
    pub fn new(mesh: &TriMesh) -> Result<Self, NoSurface> {
        let vertices = mesh.vertices.iter().map(|vertex| {
            let [x, y, z] = vertex.map(f64::from);
            Vector::new(x, y, z)
        });
        ParryMesh::new(vertices.collect(), mesh.triangles.clone()).map(|mesh| Self { mesh }).map_err(|error| {
            NoSurface { triangles: mesh.triangles.len(), vertices: mesh.vertices.len(), reason: error.to_string() }
        })
    }

    /// Distance from a point, in `Object`, to the surface [m], whichever side it is on.
    pub fn distance(&self, point: &Point3<f64>) -> f64 {
        (self.closest_point(point) - point).norm()
    }

    /// The point of the surface next to a point, both in `Object` [m].
    pub fn closest_point(&self, point: &Point3<f64>) -> Point3<f64> {
        Point3::from(from_glam(self.mesh.project_local_point(to_glam(&point.coords), false).point))
    }

    /// Where the ray from `origin`, in `Object`, meets the surface first, from either side, at most `reach` [m] away.
    pub fn first_hit(&self, origin: &Point3<f64>, direction: &Unit<Vector3<f64>>, reach: f64) -> Option<RayHit> {
        let ray = Ray::new(to_glam(&origin.coords), to_glam(direction));
        let hit = self.mesh.cast_local_ray_and_get_normal(&ray, reach, false)?;
        let [a, b, c] = self.mesh.triangle(hit.subshape).vertices().map(from_glam);
        let normal = Unit::new_normalize((b - a).cross(&(c - a)));
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        Some(RayHit { distance: hit.time_of_impact, triangle: hit.subshape, normal })
    }
}

/// A shape with what a search for contacts needs, built once.
pub struct TouchShape {
    shape: Box<dyn ParryShape>,
    /// Triangles of a mesh; 0 of a solid.
    triangles: usize,
    /// Ball around the shape, in its frame.
    centre: Point3<f64>,
    radius: f64,
}

impl TouchShape {
    /// Builds the search tree of a mesh.
    ///
    /// # Errors
    /// When a mesh has no triangles.
    pub fn new(shape: &Shape) -> Result<Self, NoSurface> {
        let (parry, triangles): (Box<dyn ParryShape>, usize) = match shape {
            Shape::Box { half: [x, y, z] } => (Box::new(Cuboid::new(Vector::new(*x, *y, *z))), 0),
            Shape::Sphere { radius } => (Box::new(Ball::new(*radius)), 0),
            Shape::Capsule { radius, half } => (Box::new(Capsule::new_z(*half, *radius)), 0),
            Shape::Cylinder { radius, half } => (Box::new(Cylinder::new(*half, *radius)), 0),
            Shape::Mesh(mesh) => {
                let corners = mesh.corners.iter().map(|corner| to_glam(&corner.coords)).collect();
                let built = ParryMesh::new(corners, mesh.triangles.clone()).map_err(|error| NoSurface {
                    triangles: mesh.triangles.len(),
                    vertices: mesh.corners.len(),
                    reason: error.to_string(),
                })?;
                (Box::new(built), mesh.triangles.len())
            }
        };
        let ball = parry.compute_local_bounding_sphere();
        // Rounding of the ball's own making must not lose a touch.
        let (centre, radius) = (Point3::from(from_glam(ball.center)), ball.radius * (1.0 + 1e-9));
        Ok(Self { shape: parry, triangles, centre, radius })
    }

    /// Whether two shapes share a point, each placed in the world [m]. Solids are solid; a mesh is its surface: what
    /// floats inside of one does not touch it.
    pub fn touches(&self, pose: &IsometryMatrix3<f64>, other: &Self, other_pose: &IsometryMatrix3<f64>) -> bool {
        let reach = self.radius + other.radius;
        if (pose * self.centre - other_pose * other.centre).norm_squared() > reach * reach {
            return false;
        }
        // The search iterates over the first mesh's triangles and queries the second's tree with each.
        let swap = self.triangles == 0 || other.triangles != 0 && other.triangles < self.triangles;
        let [(first, first_pose), (second, second_pose)] =
            if swap { [(other, other_pose), (self, pose)] } else { [(self, pose), (other, other_pose)] };
        let (first_pose, second_pose) = (first.placed(first_pose), second.placed(second_pose));
        intersection_test(&first_pose, &*first.shape, &second_pose, &*second.shape)
            .is_ok_and(|found| found.intersecting)
    }

    /// Whether a solid, placed in the world, and a triangle [m] share a point.
    pub fn touches_triangle(&self, pose: &IsometryMatrix3<f64>, corners: &[Point3<f64>; 3]) -> bool {
        let [a, b, c] = corners.map(|corner| to_glam(&corner.coords));
        intersection_test(&self.placed(pose), &*self.shape, &ParryPose::IDENTITY, &Triangle::new(a, b, c))
            .is_ok_and(|found| found.intersecting)
    }

    /// Distance of a point from a solid's surface [m], negative inside; for a mesh, the distance from its surface.
    pub fn distance(&self, pose: &IsometryMatrix3<f64>, point: &Point3<f64>) -> f64 {
        self.shape.distance_to_point(&self.placed(pose), to_glam(&point.coords), false)
    }

    /// Where a ray from outside meets the surface first, at most `reach` away [m]: how far, and the outward normal.
    pub fn first_hit(
        &self,
        pose: &IsometryMatrix3<f64>,
        origin: &Point3<f64>,
        direction: &Unit<Vector3<f64>>,
        reach: f64,
    ) -> Option<(f64, Unit<Vector3<f64>>)> {
        let ray = Ray::new(to_glam(&origin.coords), to_glam(direction));
        let hit = self.shape.cast_ray_and_get_normal(&self.placed(pose), &ray, reach, true)?;
        let normal = Unit::new_normalize(from_glam(hit.normal));
        Some((hit.time_of_impact, if normal.dot(direction) > 0.0 { -normal } else { normal }))
    }

    /// A ball around the shape placed in the world: its centre and radius [m].
    pub fn ball(&self, pose: &IsometryMatrix3<f64>) -> (Point3<f64>, f64) {
        (pose * self.centre, self.radius)
    }

    /// A pose for parry, whose cylinders are along y.
    fn placed(&self, pose: &IsometryMatrix3<f64>) -> ParryPose {
        let rotation = pose.rotation.matrix();
        let [x, y, z] =
            [0, 1, 2].map(|axis| Vector::new(rotation[(0, axis)], rotation[(1, axis)], rotation[(2, axis)]));
        let rotation =
            if self.shape.as_cylinder().is_some() { Matrix::from_cols(x, z, -y) } else { Matrix::from_cols(x, y, z) };
        ParryPose::from_parts(to_glam(&pose.translation.vector), Rotation::from_mat3(&rotation))
    }
}

fn to_glam(vector: &Vector3<f64>) -> Vector {
    Vector::new(vector.x, vector.y, vector.z)
}

fn from_glam(vector: Vector) -> Vector3<f64> {
    Vector3::new(vector.x, vector.y, vector.z)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::geom::Triangles;

    /// A square of side 2 m in the plane z = 1 m, facing up.
    fn square() -> TriMesh {
        TriMesh {
            vertices: vec![[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    #[test]
    fn distances_to_a_square() {
        let query = MeshQuery::new(&square()).unwrap();
        for (point, distance) in
            [([0.0, 0.0, 0.25], 0.75), ([0.5, 0.5, 3.0], 2.0), ([4.0, 0.0, 5.0], 5.0), ([1.0, 0.3, 1.0], 0.0)]
        {
            assert!((query.distance(&Point3::from(point)) - distance).abs() < 1e-12, "{point:?}");
        }
    }

    #[test]
    fn rays_hit_either_side_within_reach() {
        let query = MeshQuery::new(&square()).unwrap();
        let up = Vector3::z_axis();
        let hit = query.first_hit(&Point3::new(0.25, -0.5, -1.0), &up, 10.0).unwrap();
        assert_eq!(hit, RayHit { distance: 2.0, triangle: 0, normal: -up });
        let hit = query.first_hit(&Point3::new(-0.25, 0.5, 2.5), &-up, 10.0).unwrap();
        assert_eq!(hit, RayHit { distance: 1.5, triangle: 1, normal: up });
        assert_eq!(query.first_hit(&Point3::new(0.25, -0.5, -1.0), &up, 1.5), None);
        assert_eq!(query.first_hit(&Point3::new(1.25, -0.5, -1.0), &up, 10.0), None);
    }

    fn at(x: f64, y: f64, z: f64, roll: f64, pitch: f64, yaw: f64) -> IsometryMatrix3<f64> {
        IsometryMatrix3::from_parts(
            Vector3::new(x, y, z).into(),
            nalgebra::Rotation3::from_euler_angles(roll, pitch, yaw),
        )
    }

    /// A box as a mesh of twelve triangles.
    fn hollow(half: [f64; 3]) -> Shape {
        let corner =
            |k: usize| Point3::from([0, 1, 2].map(|axis| if k >> axis & 1 == 1 { half[axis] } else { -half[axis] }));
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        Shape::Mesh(Arc::new(Triangles { corners: (0..8).map(corner).collect(), triangles }))
    }

    /// Pairs a hair apart and a hair together, by hand: the direction of each shape and how long it is.
    #[test]
    fn shapes_touch_where_they_should() {
        let capsule = Shape::Capsule { radius: 0.1, half: 0.5 };
        let cylinder = Shape::Cylinder { radius: 0.1, half: 0.5 };
        let (ball, cube) = (Shape::Sphere { radius: 0.2 }, Shape::Box { half: [0.1, 0.2, 0.3] });
        let quarter = std::f64::consts::FRAC_PI_2;
        // Along z: a capsule reaches 0.6 m, a cylinder 0.5 m; lying down (about y) along x.
        for (one, other, towards, rotation, reach) in [
            (&capsule, &ball, Vector3::z(), 0.0, 0.8),
            (&cylinder, &ball, Vector3::z(), 0.0, 0.7),
            (&capsule, &ball, Vector3::x(), quarter, 0.8),
            (&cylinder, &ball, Vector3::x(), quarter, 0.7),
            (&cylinder, &ball, Vector3::y(), quarter, 0.3),
            (&cylinder, &cylinder, Vector3::x(), quarter, 0.6),
            (&cylinder, &capsule, Vector3::y(), quarter, 0.2),
            (&cube, &capsule, Vector3::z(), 0.0, 0.9),
            (&cube, &cylinder, Vector3::x(), quarter, 0.4),
            (&cube, &hollow([0.1, 0.2, 0.3]), Vector3::y(), 0.0, 0.4),
            (&hollow([0.1, 0.2, 0.3]), &cylinder, Vector3::z(), 0.0, 0.8),
            (&hollow([0.1, 0.2, 0.3]), &capsule, Vector3::x(), quarter, 0.4),
            (&hollow([0.1, 0.2, 0.3]), &hollow([0.3, 0.2, 0.1]), Vector3::x(), 0.0, 0.4),
            (&hollow([0.1, 0.2, 0.3]), &ball, Vector3::y(), 0.0, 0.4),
        ] {
            let (a, b) = (TouchShape::new(one).unwrap(), TouchShape::new(other).unwrap());
            let base = at(0.3, -0.2, 0.7, 0.4, 0.5, 0.6);
            let first = base * at(0.0, 0.0, 0.0, 0.0, rotation, 0.0);
            for (gap, touch) in [(1e-6, false), (-1e-6, true)] {
                let step = towards * (reach + gap);
                let second = base * at(step.x, step.y, step.z, 0.0, 0.0, 0.0);
                assert_eq!(a.touches(&first, &b, &second), touch, "{one:?} {other:?} {gap}");
                assert_eq!(b.touches(&second, &a, &first), touch, "{other:?} {one:?} {gap}");
            }
        }
    }

    #[test]
    fn a_mesh_is_its_surface() {
        let [room, block] = [hollow([1.0; 3]), hollow([0.1; 3])].map(|shape| TouchShape::new(&shape).unwrap());
        let still = IsometryMatrix3::identity();
        assert!(!room.touches(&still, &block, &still));
        assert!(room.touches(&still, &block, &at(0.95, 0.0, 0.0, 0.0, 0.0, 0.0)));
    }

    /// A cylinder lying along x, by hand: distances from inside and outside, and rays from above.
    #[test]
    fn solids_have_distances_and_are_hit() {
        let lying = at(0.0, 0.0, 1.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0);
        for shape in [Shape::Cylinder { radius: 0.2, half: 0.5 }, Shape::Capsule { radius: 0.2, half: 0.5 }] {
            let solid = TouchShape::new(&shape).unwrap();
            for (point, distance) in
                [([0.1, 0.0, 1.5], 0.3), ([0.0, 0.05, 1.0], -0.15), ([-0.3, 0.0, 0.8], 0.0), ([0.0, 0.5, 1.0], 0.3)]
            {
                let found = solid.distance(&lying, &Point3::from(point));
                assert!((found - distance).abs() < 1e-12, "{shape:?} {point:?}: {found}");
            }
            let (far, normal) =
                solid.first_hit(&lying, &Point3::new(0.2, 0.12, 3.0), &-Vector3::z_axis(), 9.0).unwrap();
            assert!((far - (2.0 - 0.16)).abs() < 1e-6, "{shape:?}: {far}");
            assert!((normal.into_inner() - Vector3::new(0.0, 0.6, 0.8)).norm() < 1e-5, "{shape:?}: {normal:?}");
            assert_eq!(solid.first_hit(&lying, &Point3::new(0.2, 0.12, 3.0), &Vector3::z_axis(), 9.0), None);
        }
    }

    #[test]
    fn nothing_to_ask_about() {
        assert_eq!(MeshQuery::new(&TriMesh::default()).err().unwrap().triangles, 0);
    }
}
