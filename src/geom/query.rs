//! Closest points and rays against a triangle mesh: the only place that names parry (whose `Vector` is glam's; nalgebra
//! is converted here and nowhere else).

use nalgebra::{Point3, Unit, Vector3};
use parry3d_f64::{
    math::Vector,
    query::{PointQuery, Ray, RayCast},
    shape::TriMesh as ParryMesh,
};

use super::TriMesh;

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
    /// Unit normal of the triangle, turned against the ray.
    pub normal: Unit<Vector3<f64>>,
}

/// A mesh that has no surface to ask about.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no search tree over {triangles} triangles and {vertices} vertices: {reason}; mend or leave out the mesh")]
pub struct NoSurface {
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// What the library says.
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
        let nearest = self.mesh.project_local_point(to_glam(&point.coords), false).point;
        (from_glam(nearest) - point.coords).norm()
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

fn to_glam(vector: &Vector3<f64>) -> Vector {
    Vector::new(vector.x, vector.y, vector.z)
}

fn from_glam(vector: Vector) -> Vector3<f64> {
    Vector3::new(vector.x, vector.y, vector.z)
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn nothing_to_ask_about() {
        assert_eq!(MeshQuery::new(&TriMesh::default()).err().unwrap().triangles, 0);
    }
}
