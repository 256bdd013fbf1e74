//! Inside test of a closed mesh: winding numbers by crossings of lines along z.

use kernel::geom::TriMesh;
use nalgebra::Point3;

/// Bins along x and y in which triangles are sorted.
const BINS: usize = 64;

/// A mesh prepared for inside tests.
pub struct MeshInside<'a> {
    mesh: &'a TriMesh,
    low: [f64; 2],
    /// Bins per metre.
    scale: [f64; 2],
    /// Triangles over each bin.
    bins: Vec<Vec<Shadow>>,
}

/// A triangle, with the rectangle that it covers along z: most triangles of a bin are beside a line, and need no more.
#[derive(Clone, Copy)]
struct Shadow {
    triangle: u32,
    /// Least and most of x and of y [m].
    rectangle: [[f32; 2]; 2],
}

impl Shadow {
    fn of(mesh: &TriMesh, triangle: usize) -> Self {
        let corners = mesh.triangles[triangle].map(|vertex| mesh.vertices[vertex as usize]);
        let range = |axis: usize| {
            let values = corners.map(|corner| corner[axis]);
            [values.into_iter().fold(f32::INFINITY, f32::min), values.into_iter().fold(f32::NEG_INFINITY, f32::max)]
        };
        Self { triangle: triangle as u32, rectangle: [range(0), range(1)] }
    }

    /// Whether a line along z may meet the triangle: its border counts.
    #[inline]
    fn covers(&self, point: [f64; 2]) -> bool {
        let fits = |axis: usize| {
            let [low, high] = self.rectangle[axis];
            f64::from(low) <= point[axis] && point[axis] <= f64::from(high)
        };
        fits(0) & fits(1)
    }
}

impl<'a> MeshInside<'a> {
    /// Sorts the triangles.
    pub fn new(mesh: &'a TriMesh) -> Self {
        let mut inside = Self { mesh, low: [0.0; 2], scale: [0.0; 2], bins: vec![Vec::new(); BINS * BINS] };
        if let Some(bounds) = mesh.aabb() {
            inside.low = [bounds.min.x, bounds.min.y];
            let extents = bounds.extents();
            inside.scale = [0, 1].map(|axis| if extents[axis] > 0.0 { BINS as f64 / extents[axis] } else { 0.0 });
        }
        for index in 0..mesh.triangles.len() {
            let shadow = Shadow::of(mesh, index);
            let span = |axis: usize| {
                let [low, high] = shadow.rectangle[axis].map(|value| inside.bin(axis, f64::from(value)));
                low..=high
            };
            let (columns, rows) = (span(0), span(1));
            for x in columns {
                for y in rows.clone() {
                    inside.bins[x * BINS + y].push(shadow);
                }
            }
        }
        inside
    }

    fn bin(&self, axis: usize, value: f64) -> usize {
        // Below the first bin counts as in it.
        (((value - self.low[axis]) * self.scale[axis]) as usize).min(BINS - 1)
    }

    /// Whether a closed mesh winds around a point [m] at least once.
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        let above = self.crossings(point.x, point.y).into_iter().filter(|(z, _)| *z > point.z);
        above.map(|(_, sense)| sense).sum::<i32>() != 0
    }

    /// Depths z [m] at which the line along z through (x, y) crosses the surface, each with +1 where it comes out of a mesh that
    /// is wound outward and -1 where it enters; in no order. A line through an edge or a corner crosses as its neighbour does that
    /// lies an infinitesimal step along x, and a smaller one along y, aside (Edelsbrunner and Muecke 1990).
    pub fn crossings(&self, x: f64, y: f64) -> Vec<(f64, i32)> {
        let mut found = Vec::new();
        let bin = &self.bins[self.bin(0, x) * BINS + self.bin(1, y)];
        for Shadow { triangle, .. } in bin.iter().filter(|shadow| shadow.covers([x, y])) {
            let [a, b, c] = self.mesh.triangles[*triangle as usize];
            let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| self.side(from, to, x, y));
            if sides.iter().any(|side| side.is_positive() != sides[0].is_positive()) {
                continue;
            }
            let [a, b, c] = self.mesh.corners(*triangle as usize);
            let normal = (b - a).cross(&(c - a));
            let z = if normal.z == 0.0 { a.z } else { a.z - (normal.x * (x - a.x) + normal.y * (y - a.y)) / normal.z };
            found.push((z, if sides[0].is_positive() { 1 } else { -1 }));
        }
        found
    }

    /// On which side of an edge, seen along z, a line lies.
    fn side(&self, from: u32, to: u32, x: f64, y: f64) -> Side {
        // Both triangles of an edge must agree: it is always looked at from its lower vertex.
        let (low, high) = (from.min(to), from.max(to));
        let [a, b] = [low, high].map(|vertex| self.mesh.vertices[vertex as usize].map(f64::from));
        let along = [b[0] - a[0], b[1] - a[1]];
        let area = along[0] * (y - a[1]) - along[1] * (x - a[0]);
        let is_left =
            [area, -along[1], along[0]].into_iter().find(|value| *value != 0.0).is_some_and(|value| value > 0.0);
        if is_left == (from < to) { Side::Left } else { Side::Right }
    }
}

/// A side of a directed edge.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
}

impl Side {
    fn is_positive(self) -> bool {
        self == Self::Left
    }
}

#[cfg(test)]
mod tests {
    use kernel::seed::Stream;

    use super::*;
    use crate::surfaces::tests::cuboid;

    #[test]
    fn points_of_boxes_are_inside_where_closed_forms_say_so() {
        let mesh = cuboid([0.0; 3], [0.2, 0.1, 0.05]);
        let inside = MeshInside::new(&mesh);
        let mut draw = Stream::of_job(1, b"", "points");
        let mut count = 0;
        for _ in 0..5000 {
            let point = Point3::new(0.3 * draw.unit() - 0.05, 0.2 * draw.unit() - 0.05, 0.1 * draw.unit() - 0.02);
            let wanted = (0.0..f64::from(0.2_f32)).contains(&point.x)
                && (0.0..f64::from(0.1_f32)).contains(&point.y)
                && (0.0..f64::from(0.05_f32)).contains(&point.z);
            assert_eq!(inside.contains(&point), wanted, "{point}");
            count += u32::from(wanted);
        }
        assert!((500..1500).contains(&count), "{count}");
        // Lines through a face's diagonal, an edge and a corner cross twice or not at all, in opposite senses.
        for [x, y] in [[0.1, 0.05], [0.0, 0.03], [0.0, 0.0], [f64::from(0.2_f32), 0.05], [0.05, 0.025]] {
            let crossings = inside.crossings(x, y);
            assert!([0, 2].contains(&crossings.len()), "{x} {y}: {crossings:?}");
            assert_eq!(crossings.iter().map(|(_, sense)| sense).sum::<i32>(), 0);
        }
        assert!(!MeshInside::new(&TriMesh::default()).contains(&Point3::origin()));
    }
}
