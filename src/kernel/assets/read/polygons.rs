//! Vertices and polygons as a file lists them, and how polygons become triangles.

use super::raw::RawMesh;
use crate::assets::{Refuse, edges::NEXT};

/// Vertices and faces that a reader has found so far.
#[derive(Default)]
pub(super) struct Builder {
    mesh: RawMesh,
    /// Corners of all polygons, one after the other.
    corners: Vec<u32>,
    /// Where each polygon ends in `corners`.
    ends: Vec<u32>,
    highest: Option<(u32, String)>,
    degenerate: usize,
}

impl Builder {
    pub(super) fn vertices(&self) -> usize {
        self.mesh.positions.len()
    }

    pub(super) fn reserve(&mut self, vertices: usize, polygons: usize) {
        self.mesh.positions.reserve(vertices);
        self.ends.reserve(polygons);
        self.corners.reserve(3 * polygons);
    }

    pub(super) fn note(&mut self, note: String) {
        self.mesh.notes.push(note);
    }

    pub(super) fn vertex(&mut self, position: [f64; 3], location: impl FnOnce() -> String) {
        if !position.iter().all(|coordinate| coordinate.is_finite()) {
            // A scan may have a NaN for every missing pixel: those beyond the first thousand lose their location, not their
            // count.
            let location = if self.mesh.not_finite.len() < 1000 { location() } else { String::new() };
            self.mesh.not_finite.push((self.mesh.positions.len() as u32, location));
        }
        self.mesh.positions.push(position);
    }

    /// Adds a corner to the polygon under way; `index` counts from 0 and is checked when all vertices are known.
    pub(super) fn corner(&mut self, index: i64, location: impl FnOnce() -> String) -> Result<(), Refuse> {
        let Ok(corner) = u32::try_from(index) else {
            return Err(out_of_range(index, self.vertices(), location()));
        };
        if self.highest.as_ref().is_none_or(|(highest, _)| *highest < corner) && corner as usize >= self.vertices() {
            self.highest = Some((corner, location()));
        }
        self.corners.push(corner);
        Ok(())
    }

    /// Ends the polygon under way; one of fewer than three corners is dropped and counted.
    pub(super) fn end_polygon(&mut self) {
        let start = self.ends.last().map_or(0, |&end| end as usize);
        if self.corners.len() < start + 3 {
            self.corners.truncate(start);
            self.degenerate += 1;
        } else {
            self.ends.push(self.corners.len() as u32);
        }
    }

    /// Checks the corners and cuts the polygons into triangles.
    pub(super) fn finish(mut self) -> Result<RawMesh, Refuse> {
        if let Some((highest, location)) =
            self.highest.filter(|(highest, _)| *highest as usize >= self.mesh.positions.len())
        {
            return Err(out_of_range(i64::from(highest), self.mesh.positions.len(), location));
        }
        if self.degenerate > 0 {
            self.mesh.notes.push(format!("{} faces of fewer than three corners are ignored", self.degenerate));
        }
        self.mesh.faces.reserve(self.ends.len());
        let mut start = 0;
        for &end in &self.ends {
            triangulate(&self.mesh.positions, &self.corners[start..end as usize], &mut self.mesh.faces);
            start = end as usize;
        }
        Ok(self.mesh)
    }
}

fn out_of_range(index: i64, vertices: usize, location: String) -> Refuse {
    let problem = format!("a face names vertex {index} (counted from 0), but there are {vertices}");
    Refuse::new("index_out_of_range", problem, "export it again: vertices are missing or the file was cut").at(location)
}

/// Most corners of a polygon that is cut ear by ear; the time grows with the square, at worst with the cube.
const MAX_CORNERS: usize = 1000;

/// Knowledge about a corner of a polygon that is being cut, as long as its neighbours stay.
#[derive(Clone, Copy)]
enum Corner {
    Unknown,
    Ear,
    /// The outline bends to the right at this corner.
    Concave,
    /// Another corner, this one, lies in its triangle.
    BlockedBy(usize),
}

/// Cuts a polygon into triangles: a fan where that is right (convex polygons), ears otherwise.
fn triangulate(positions: &[[f64; 3]], polygon: &[u32], faces: &mut Vec<[u32; 3]>) {
    if let [a, b, c] = *polygon {
        return faces.push([a, b, c]);
    }
    let corners: Vec<[f64; 3]> = polygon.iter().map(|&corner| positions[corner as usize]).collect();
    let normal = newell(&corners);
    // Twice the area of triangle (a, b, c) along the polygon's normal: positive for a left bend.
    let up = |a: usize, b: usize, c: usize| {
        let cross = cross(sub(corners[b], corners[a]), sub(corners[c], corners[a]));
        (0..3).map(|axis| cross[axis] * normal[axis]).sum::<f64>()
    };
    let count = polygon.len();
    // Fan from corner 0: right when all of its triangles face along the normal.
    let is_fan = (1..count - 1).all(|i| up(0, i, i + 1) > 0.0);
    // Not finite, flat or huge: any cut is as good as another.
    let size: f64 = normal.iter().map(|x| x * x).sum();
    let give_up = size == 0.0 || !size.is_finite() || count > MAX_CORNERS;
    if is_fan || give_up {
        return faces.extend((1..count - 1).map(|i| [polygon[0], polygon[i], polygon[i + 1]]));
    }
    // Ear clipping: an ear has a convex corner and no other corner inside.
    let mut rest: Vec<usize> = (0..count).collect();
    let mut known = vec![Corner::Unknown; count];
    let mut is_cut = vec![false; count];
    while rest.len() > 3 {
        let around = |i: usize| {
            let n = rest.len();
            (rest[(i + n - 1) % n], rest[i], rest[(i + 1) % n])
        };
        let judge = |i: usize| {
            let (a, b, c) = around(i);
            let is_convex = up(a, b, c) > 0.0;
            if !is_convex {
                return Corner::Concave;
            }
            let blocks = |&p: &usize| {
                p != a && p != b && p != c && up(a, b, p) >= 0.0 && up(b, c, p) >= 0.0 && up(c, a, p) >= 0.0
            };
            rest.iter().copied().find(blocks).map_or(Corner::Ear, Corner::BlockedBy)
        };
        let mut is_ear = |&i: &usize| {
            let corner = &mut known[rest[i]];
            match *corner {
                Corner::Unknown => *corner = judge(i),
                Corner::BlockedBy(blocker) if is_cut[blocker] => *corner = judge(i),
                _ => {}
            }
            matches!(corner, Corner::Ear)
        };
        // A polygon that crosses itself may have no ear; then the widest corner goes.
        let ear = (0..rest.len()).find(|i| is_ear(i)).unwrap_or_else(|| {
            let width = |&i: &usize| up(around(i).0, around(i).1, around(i).2);
            (0..rest.len()).max_by(|a, b| width(a).total_cmp(&width(b))).unwrap_or(0)
        });
        let (a, b, c) = around(ear);
        faces.push([a, b, c].map(|corner| polygon[corner]));
        rest.remove(ear);
        is_cut[b] = true;
        [a, c].into_iter().for_each(|neighbour| known[neighbour] = Corner::Unknown);
    }
    faces.push([rest[0], rest[1], rest[2]].map(|corner| polygon[corner]));
}

/// The area vector of a polygon, times two (Newell's method).
fn newell(corners: &[[f64; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for i in 1..corners.len() - 1 {
        let part = cross(sub(corners[i], corners[0]), sub(corners[i + 1], corners[0]));
        (0..3).for_each(|axis| sum[axis] += part[axis]);
    }
    sum
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let (i, j) = (NEXT[axis], NEXT[NEXT[axis]]);
        a[i] * b[j] - a[j] * b[i]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Signed areas of the triangles of a plane polygon.
    fn areas(polygon: &[[f64; 2]]) -> Vec<f64> {
        let positions: Vec<[f64; 3]> = polygon.iter().map(|&[x, y]| [x, y, 1.0]).collect();
        let corners: Vec<u32> = (0..polygon.len() as u32).collect();
        let mut faces = Vec::new();
        triangulate(&positions, &corners, &mut faces);
        let area = |[a, b, c]: [[f64; 3]; 3]| cross(sub(b, a), sub(c, a))[2] / 2.0;
        faces.iter().map(|face| area(face.map(|corner| positions[corner as usize]))).collect()
    }

    #[test]
    fn convex_and_concave_polygons_are_covered_once() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let dart = [[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]];
        let comb = [[0.0, 0.0], [5.0, 0.0], [5.0, 3.0], [4.0, 3.0], [4.0, 1.0], [3.0, 1.0], [3.0, 3.0], [0.0, 3.0]];
        for (polygon, area) in [(&square[..], 1.0), (&dart[..], 1.5), (&comb[..], 13.0)] {
            let areas = areas(polygon);
            assert_eq!(areas.len(), polygon.len() - 2);
            assert!(areas.iter().all(|&area| area > 0.0), "{areas:?}");
            assert!((areas.iter().sum::<f64>() - area).abs() < 1e-12);
        }
    }
}
