//! Triangle meshes.

use nalgebra::Point3;

/// An indexed triangle mesh in `Object` [m]. Counter-clockwise seen from outside where the winding is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions [m], shape (vertices, 3).
    pub vertices: Vec<[f32; 3]>,
    /// Vertex indices, shape (triangles, 3), all below `vertices.len()`.
    pub triangles: Vec<[u32; 3]>,
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner [m].
    pub min: Point3<f64>,
    /// Upper corner [m].
    pub max: Point3<f64>,
}

impl Aabb {
    /// The middle of the box [m].
    pub fn centre(&self) -> Point3<f64> {
        nalgebra::center(&self.min, &self.max)
    }

    /// Side lengths [m].
    pub fn extents(&self) -> [f64; 3] {
        (self.max - self.min).into()
    }

    /// The longest side [m].
    pub fn longest_side(&self) -> f64 {
        (self.max - self.min).max()
    }
}

impl TriMesh {
    /// The box of all vertices; `None` for a mesh without vertices.
    pub fn aabb(&self) -> Option<Aabb> {
        let first = self.vertices.first()?;
        let (mut min, mut max) = (*first, *first);
        for vertex in &self.vertices {
            for axis in 0..3 {
                min[axis] = min[axis].min(vertex[axis]);
                max[axis] = max[axis].max(vertex[axis]);
            }
        }
        Some(Aabb { min: Point3::from(min.map(f64::from)), max: Point3::from(max.map(f64::from)) })
    }

    /// The corners of a triangle [m].
    pub fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|vertex| Point3::from(self.vertices[vertex as usize].map(f64::from)))
    }

    /// Signed volume [m^3]: positive for a watertight mesh wound outward (divergence theorem).
    pub fn signed_volume(&self) -> f64 {
        (0..self.triangles.len())
            .map(|triangle| {
                let [a, b, c] = self.corners(triangle).map(|corner| corner.coords);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }
}
