//! Questions about a mesh's surface that need no distance: boxes and straight lines that meet it, and where a ray leaves it.

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};

use super::ContactSurface;
use crate::geom::{Ray, SimdLevel};

/// Hits of one ray that are followed, at most.
const MAX_HITS: usize = 16;

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

    /// Points at which a ray from a point in `Object` leaves the mesh, at most `reach` away [m]: distances, ascending, and the
    /// outward unit normals there.
    pub fn exits(
        &self,
        level: SimdLevel,
        from: &Point3<f64>,
        direction: &Unit<Vector3<f64>>,
        reach: f64,
        exits: &mut Vec<(f64, Vector3<f64>)>,
    ) {
        exits.clear();
        let mut start = 0.0;
        for _ in 0..MAX_HITS {
            let ray = Ray::new(&(from + direction.into_inner() * start), direction);
            let Some(hit) = self.tree().first_hit(level, &ray, reach - start) else { return };
            start += hit.distance;
            let normal = self.tree().normal(&hit).map(Unit::into_inner);
            exits.extend(normal.filter(|normal| normal.dot(direction) > 0.0).map(|normal| (start, normal)));
            start += BEYOND;
            if start >= reach {
                return;
            }
        }
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
        assert!(tray.meets_line(level, &Point3::new(0.0, 0.0, 0.05), &Vector3::x_axis(), 0.11));
        assert!(!tray.meets_line(level, &Point3::new(0.0, 0.0, 0.05), &Vector3::x_axis(), 0.09));
        let at = IsometryMatrix3::translation(0.0, 0.0, 0.05);
        assert!(!tray.meets_box(&at, &Vector3::new(0.09, 0.09, 0.04)));
        assert!(tray.meets_box(&at, &Vector3::new(0.09, 0.09, 0.06)));
    }
}
