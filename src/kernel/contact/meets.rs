//! Questions about a mesh's surface that need no distance: boxes and straight lines that meet it, and where a ray leaves it.

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};

use super::ContactSurface;
use crate::geom::{Ray, SimdLevel};

/// Hits of one ray that are followed, at most.
const MAX_HITS: usize = 64;

/// Distance by which a ray continues behind a hit [m].
const BEYOND: f64 = 1e-7;

impl ContactSurface {
    /// Whether a box, given by its pose in `Object` and half its sides [m], meets the surface; a box that lies inside of the mesh
    /// does not. Of class `exact`.
    pub fn meets_box(&self, object_from_box: &IsometryMatrix3<f64>, half: &Vector3<f64>) -> bool {
        self.tree().meets_box(object_from_box, half)
    }

    /// Whether a straight line of some length [m] from a point in `Object` meets the surface.
    pub fn meets_line(
        &self,
        level: SimdLevel,
        from: &Point3<f64>,
        direction: &Unit<Vector3<f64>>,
        length: f64,
    ) -> bool {
        self.tree().blocks(level, &Ray::new(from, direction), length)
    }

    /// The first point at which a ray from a point in `Object` meets the surface, at most `reach` away [m], if the ray enters the mesh
    /// there: its distance, and the outward unit normal. `None` where the ray first meets the surface from inside.
    pub fn entry(
        &self,
        level: SimdLevel,
        from: &Point3<f64>,
        direction: &Unit<Vector3<f64>>,
        reach: f64,
    ) -> Option<(f64, Vector3<f64>)> {
        let hit = self.tree().first_hit(level, &Ray::new(from, direction), reach)?;
        let normal = self.tree().normal(&hit)?.into_inner();
        (normal.dot(direction) < 0.0).then_some((hit.distance, normal))
    }

    /// Points at which a ray from a point in `Object` leaves the solid, at most `reach` away [m]: distances, ascending, and the
    /// outward unit normals there.
    ///
    /// The ray is cut at each triangle that it meets; a part is inside where its middle is, so that surfaces inside the solid do
    /// not count.
    pub fn exits(
        &self,
        level: SimdLevel,
        from: &Point3<f64>,
        direction: &Unit<Vector3<f64>>,
        reach: f64,
        exits: &mut Vec<(f64, Vector3<f64>)>,
    ) {
        // Cut the ray at every triangle.
        exits.clear();
        let mut start = 0.0;
        while exits.len() < MAX_HITS {
            let ray = Ray::new(&(from + direction.into_inner() * start), direction);
            let Some(hit) = self.tree().first_hit(level, &ray, f64::INFINITY) else { break };
            start += hit.distance;
            exits.push((start, self.tree().normal(&hit).map_or_else(Vector3::zeros, Unit::into_inner)));
            start += BEYOND;
        }
        // Keep the ends of parts inside that another part outside follows; behind the last cut nothing is inside.
        let is_inside = |begin: f64, end: f64| {
            self.signed_distance(&(from + direction.into_inner() * f64::midpoint(begin, end))) < 0.0
        };
        let mut inside = exits.first().is_some_and(|(end, _)| is_inside(0.0, *end));
        let mut kept = 0;
        for index in 0..exits.len() {
            let (end, _) = exits[index];
            if end > reach {
                break;
            }
            let next = exits.get(index + 1).is_some_and(|(next, _)| is_inside(end, *next));
            if inside && !next {
                exits[kept] = exits[index];
                kept += 1;
            }
            inside = next;
        }
        exits.truncate(kept);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{geom::TriMesh, voxel::InsideTest};

    #[test]
    fn a_ray_leaves_a_tray_at_both_walls() {
        let tray = ContactSurface::new(&TriMesh::open_box([0.2, 0.2, 0.1], 0.01), InsideTest::WindingNumber);
        let tray = tray.expect("a surface");
        let (level, mut exits) = (SimdLevel::Scalar, Vec::new());
        let from = Point3::new(-0.11, 0.011, 0.05);
        tray.exits(level, &from, &Vector3::x_axis(), 1.0, &mut exits);
        let distances: Vec<f64> = exits.iter().map(|(distance, _)| *distance).collect();
        assert!(distances.len() == 2 && (distances[0] - 0.01).abs() < 1e-6 && (distances[1] - 0.22).abs() < 1e-6);
        assert!(exits.iter().all(|(_, normal)| (normal - Vector3::x()).norm() < 1e-6));
        tray.exits(level, &from, &Vector3::x_axis(), 0.1, &mut exits);
        assert_eq!(exits.len(), 1);
        let outside = Point3::new(-0.13, 0.011, 0.05);
        let (distance, normal) =
            tray.entry(level, &outside, &Vector3::x_axis(), 1.0).expect("the outer side of a wall");
        assert!((distance - 0.02).abs() < 1e-6 && (normal + Vector3::x()).norm() < 1e-6);
        let inside = Point3::new(-0.105, 0.011, 0.05);
        assert_eq!(tray.entry(level, &inside, &Vector3::x_axis(), 1.0), None);
        assert!(tray.meets_line(level, &Point3::new(0.0, 0.0, 0.05), &Vector3::x_axis(), 0.11));
        assert!(!tray.meets_line(level, &Point3::new(0.0, 0.0, 0.05), &Vector3::x_axis(), 0.09));
        let at = IsometryMatrix3::translation(0.0, 0.0, 0.05);
        assert!(!tray.meets_box(&at, &Vector3::new(0.09, 0.09, 0.04)));
        assert!(tray.meets_box(&at, &Vector3::new(0.09, 0.09, 0.06)));
    }

    /// Two trays whose floors overlap are one solid: a ray along the floors leaves it once.
    #[test]
    fn surfaces_inside_a_solid_are_no_exits() {
        let mut mesh = TriMesh::open_box([0.2, 0.2, 0.1], 0.01);
        let count = mesh.vertices.len() as u32;
        let vertices: Vec<[f32; 3]> = mesh.vertices.iter().map(|[x, y, z]| [x + 0.1, *y, *z]).collect();
        let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|triangle| triangle.map(|i| i + count)).collect();
        mesh.vertices.extend(vertices);
        mesh.triangles.extend(triangles);
        let trays = ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface");
        let mut exits = Vec::new();
        trays.exits(SimdLevel::Scalar, &Point3::new(-0.1, 0.011, -0.005), &Vector3::x_axis(), 1.0, &mut exits);
        assert!(exits.len() == 1 && (exits[0].0 - 0.31).abs() < 1e-6, "{exits:?}");
    }
}
