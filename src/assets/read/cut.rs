//! Faces of any number of corners, cut into triangles.
//!
//! A triangle is kept unchanged. If all corners of a face are visible from its first one in their order, the triangles
//! are a fan around that corner. Any other outline, including one that passes a corner twice or joins its holes by
//! bridges, is cut by a Delaunay triangulation of its plane. In both cases the triangles have the sides of the outline
//! and no other open ones, none is flipped, and their areas add up to that of the outline: an outline that cannot be
//! cut like this has crossing sides, and is refused.

use super::{
    delaunay::{Fault, fill},
    outline::Outline,
};
use crate::repair::{edges::NEXT, seams::Seams};

/// A triangle of a fan with less than this share of the area of its face is only rounding.
const THINNEST: f64 = 1e-12;

/// Error of areas by rounding, as a share.
const ROUNDING: f64 = 1e-9;

/// Cuts the faces of a mesh.
pub(super) struct Cutter<'a> {
    positions: &'a [[f64; 3]],
    seams: &'a Seams,
}

impl<'a> Cutter<'a> {
    pub(super) fn new(positions: &'a [[f64; 3]], seams: &'a Seams) -> Self {
        Self { positions, seams }
    }

    /// Adds the triangles of a face.
    ///
    /// # Errors
    /// When its outline crosses itself.
    pub(super) fn cut(&self, face: &[u32], triangles: &mut Vec<[u32; 3]>) -> Result<(), Fault> {
        if let [a, b, c] = *face {
            triangles.push([a, b, c]);
            return Ok(());
        }
        // Sides without length are dropped.
        let mut ring = face.to_vec();
        ring.dedup();
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        if ring.len() < 3 {
            return Ok(());
        }
        let Some(plane) = Plane::of(self.positions, &ring) else {
            // In one point, or not finite: dropped or refused with the mesh.
            triangles.extend(fan(&ring));
            return Ok(());
        };
        if plane.is_fan(self.positions, &ring) {
            triangles.extend(fan(&ring));
            return Ok(());
        }
        // Change of the area when every point of the outline moves by the distance within which two vertices are one.
        let reach = self.seams.reach / plane.unit;
        let slack = reach * plane.perimeter + ROUNDING * plane.area;
        if plane.area <= slack {
            let areas = fan(&ring).map(|triangle| plane.area_of(self.positions, triangle));
            if areas.sum::<f64>() > slack * ring.len() as f64 {
                return Err(Fault::NoPlane);
            }
            triangles.extend(fan(&ring));
            return Ok(());
        }
        let mut outline = plane.outline(self.positions, &ring);
        let thin = outline.settle(reach, |a, b| !self.seams.is_open(a, b))?;
        let inside = fill(&outline.points, &outline.sides()).map_err(|fault| fault.with_names(&outline.vertices))?;
        let area: f64 =
            inside.iter().map(|triangle| triangle_area(triangle.map(|point| outline.points[point as usize]))).sum();
        if libm::fabs(area - plane.area) > slack {
            return Err(Fault::Area);
        }
        triangles.extend(
            inside.into_iter().chain(thin).map(|triangle| triangle.map(|point| outline.vertices[point as usize])),
        );
        Ok(())
    }
}

/// Triangles around the first corner.
fn fan(ring: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    ring[1..].windows(2).map(|side| [ring[0], side[0], side[1]])
}

/// The plane of a face. Lengths and areas in its unit.
struct Plane {
    /// Unit of the plane in that of the positions: a power of two, so that dividing by it is exact.
    unit: f64,
    /// Out of the face.
    normal: [f64; 3],
    area: f64,
    perimeter: f64,
}

impl Plane {
    /// The plane that a ring of vertices fits best (Newell's method); `None` where they are not finite or in one point.
    fn of(positions: &[[f64; 3]], ring: &[u32]) -> Option<Self> {
        let coordinates = ring.iter().flat_map(|vertex| positions[*vertex as usize]);
        let largest = coordinates
            .map(libm::fabs)
            .try_fold(0.0, |largest: f64, coordinate| coordinate.is_finite().then_some(largest.max(coordinate)))?;
        // Only the exponent: a power of two between half of the largest coordinate and all of it.
        let unit = f64::from_bits(largest.to_bits() & 0x7ff0_0000_0000_0000);
        if unit == 0.0 {
            return None;
        }
        let mut plane = Self { unit, normal: [0.0; 3], area: 0.0, perimeter: 0.0 };
        let first = plane.corner(positions, ring[0]);
        for triangle in fan(ring) {
            let [a, b] = [triangle[1], triangle[2]].map(|vertex| sub(plane.corner(positions, vertex), first));
            plane.normal = add(plane.normal, cross(a, b));
        }
        for (from, to) in ring.iter().zip(ring.iter().skip(1).chain(ring.first())) {
            plane.perimeter += length(sub(plane.corner(positions, *to), plane.corner(positions, *from)));
        }
        // The sum of the cross products is twice the area.
        let doubled = length(plane.normal);
        plane.area = doubled / 2.0;
        if doubled > 0.0 {
            plane.normal = plane.normal.map(|part| part / doubled);
        }
        (plane.perimeter > 0.0).then_some(plane)
    }

    /// A vertex in the plane's unit.
    fn corner(&self, positions: &[[f64; 3]], vertex: u32) -> [f64; 3] {
        positions[vertex as usize].map(|coordinate| coordinate / self.unit)
    }

    /// Whether all corners are seen from the first one in their turn, without going round it more than once.
    fn is_fan(&self, positions: &[[f64; 3]], ring: &[u32]) -> bool {
        let first = self.corner(positions, ring[0]);
        let towards = |vertex: u32| sub(self.corner(positions, vertex), first);
        let start = towards(ring[1]);
        let mut is_beyond = false;
        for triangle in fan(ring) {
            let [a, b] = [towards(triangle[1]), towards(triangle[2])];
            if dot(cross(a, b), self.normal) <= 2.0 * THINNEST * self.area || self.area == 0.0 {
                return false;
            }
            // Each turn is to the left, by less than half a turn: beyond half a turn from the start, the start itself may not be
            // passed again.
            let is_left = dot(cross(start, b), self.normal) >= 0.0;
            if is_beyond && is_left {
                return false;
            }
            is_beyond |= !is_left;
        }
        true
    }

    /// Area of a triangle, whichever way it faces.
    fn area_of(&self, positions: &[[f64; 3]], triangle: [u32; 3]) -> f64 {
        let [a, b, c] = triangle.map(|vertex| self.corner(positions, vertex));
        length(cross(sub(b, a), sub(c, a))) / 2.0
    }

    /// The outline of a ring of vertices, seen against the normal. Vertices of one position are one point.
    fn outline(&self, positions: &[[f64; 3]], ring: &[u32]) -> Outline {
        let [right, up] = self.axes();
        let mut points = Vec::with_capacity(ring.len());
        let mut vertices = Vec::with_capacity(ring.len());
        let mut known = std::collections::HashMap::with_capacity(ring.len());
        let mut path = Vec::with_capacity(ring.len());
        for &vertex in ring {
            let corner = self.corner(positions, vertex);
            // -0 is 0.
            let bits = corner.map(|coordinate| (coordinate + 0.0).to_bits());
            let point = *known.entry(bits).or_insert_with(|| {
                points.push([right, up].map(|axis| without_dust(dot(corner, axis))));
                vertices.push(vertex);
                points.len() as u32 - 1
            });
            if path.last() != Some(&point) {
                path.push(point);
            }
        }
        while path.len() > 1 && path.first() == path.last() {
            path.pop();
        }
        Outline::through(&path, vertices, points)
    }

    /// Two directions in the plane at a right angle, counter-clockwise about the normal. A normal along an axis of the
    /// coordinates has axes along the others, without rounding.
    fn axes(&self) -> [[f64; 3]; 2] {
        let n = self.normal;
        // The axis that is farthest from the normal.
        let least = (0..3).min_by(|a, b| libm::fabs(n[*a]).total_cmp(&libm::fabs(n[*b]))).unwrap_or(0);
        let mut right = n.map(|part| -part * n[least]);
        right[least] += 1.0;
        let long = length(right);
        let right = right.map(|part| part / long);
        [right, cross(n, right)]
    }
}

/// A coordinate of the order of 1; a value too small for exact predicates becomes 0.
fn without_dust(coordinate: f64) -> f64 {
    if libm::fabs(coordinate) < 1e-40 { 0.0 } else { coordinate }
}

fn triangle_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0
}

fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| a[axis] * b[axis]).sum()
}

fn length(a: [f64; 3]) -> f64 {
    libm::sqrt(dot(a, a))
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let (i, j) = (NEXT[axis], NEXT[NEXT[axis]]);
        a[i] * b[j] - a[j] * b[i]
    })
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeMap, f64::consts::TAU};

    use super::*;

    /// Longest side of the meshes of these tests, whose coordinates are of the order of 1.
    const SIDE: f64 = 10.0;

    fn seams() -> Seams {
        Seams { reach: crate::repair::seams::SHARE * SIDE, ..Seams::default() }
    }

    /// Corners in a plane, turned in space and named by position, and the polygon's vertices.
    fn placed(outline: &[[f64; 2]], tilt: f64) -> (Vec<[f64; 3]>, Vec<u32>) {
        let (sine, cosine) = (libm::sin(tilt), libm::cos(tilt));
        let mut positions: Vec<[f64; 3]> = Vec::new();
        let mut polygon = Vec::new();
        for &[x, y] in outline {
            let position = [cosine * x - sine * y, sine * cosine * x + cosine * cosine * y, sine * y];
            let known = positions.iter().position(|other| *other == position);
            polygon.push(known.unwrap_or(positions.len()) as u32);
            if known.is_none() {
                positions.push(position);
            }
        }
        (positions, polygon)
    }

    fn cut(outline: &[[f64; 2]], tilt: f64) -> Result<Vec<[u32; 3]>, Fault> {
        let (positions, polygon) = placed(outline, tilt);
        let mut triangles = Vec::new();
        Cutter::new(&positions, &seams()).cut(&polygon, &mut triangles)?;
        Ok(triangles)
    }

    /// Runs along each edge from its lower vertex, less those back; edges that cancel are left out.
    fn chain(faces: impl Iterator<Item = Vec<u32>>) -> BTreeMap<[u32; 2], i32> {
        let mut sum = BTreeMap::new();
        for face in faces {
            for (from, to) in face.iter().zip(face.iter().cycle().skip(1)) {
                *sum.entry([*from.min(to), *from.max(to)]).or_insert(0) += if from < to { 1 } else { -1 };
            }
        }
        sum.retain(|edge, times| *times != 0 && edge[0] != edge[1]);
        sum
    }

    /// Area by Newell's sum, which needs no triangles.
    fn area_vector(positions: &[[f64; 3]], ring: &[u32]) -> [f64; 3] {
        let next = ring.iter().skip(1).chain(ring.first());
        ring.iter().zip(next).fold([0.0; 3], |sum, (from, to)| {
            add(sum, cross(positions[*from as usize], positions[*to as usize]).map(|part| part / 2.0))
        })
    }

    /// Cuts a polygon in several attitudes and checks that the triangles have its sides, face as it does and cover its area once.
    fn assert_covers(name: &str, outline: &[[f64; 2]]) {
        for tilt in [0.0, 0.3, 1.1, 2.9] {
            let (positions, polygon) = placed(outline, tilt);
            let mut triangles = Vec::new();
            let cut = Cutter::new(&positions, &seams()).cut(&polygon, &mut triangles);
            cut.unwrap_or_else(|fault| panic!("{name}, tilt {tilt}: {fault}"));
            let whole = area_vector(&positions, &polygon);
            let normal = whole.map(|part| part / length(whole));
            let slack = 1e-5 * SIDE;
            let mut sum = 0.0;
            for triangle in &triangles {
                let area = dot(area_vector(&positions, triangle), normal);
                assert!(area > -slack, "{name}, tilt {tilt}: {triangle:?} is turned over: {area}");
                sum += libm::fabs(area);
            }
            assert!(libm::fabs(sum - length(whole)) < slack, "{name}, tilt {tilt}: {sum}, not {}", length(whole));
            let of_triangles = chain(triangles.iter().map(|triangle| triangle.to_vec()));
            assert_eq!(of_triangles, chain([polygon].into_iter()), "{name}, tilt {tilt}");
        }
    }

    fn circle(radius: f64, count: u32) -> Vec<[f64; 2]> {
        let angle = |step| TAU * f64::from(step) / f64::from(count);
        (0..count).map(|step| [radius * libm::cos(angle(step)), radius * libm::sin(angle(step))]).collect()
    }

    /// An outline with a hole that a bridge joins to it.
    fn keyhole(outer: &[[f64; 2]], hole: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let inner = hole.iter().rev();
        outer.iter().chain(&outer[..1]).chain(inner).chain(&hole[hole.len() - 1..]).copied().collect()
    }

    #[test]
    fn polygons_of_every_shape_are_covered_once() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_covers("square", &square);
        assert_covers("dart", &[[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]]);
        assert_covers("dart from its notch", &[[0.5, 1.0], [0.0, 0.0], [2.0, 1.0], [0.0, 2.0]]);
        assert_covers(
            "comb",
            &[[0.0, 0.0], [5.0, 0.0], [5.0, 3.0], [4.0, 3.0], [4.0, 1.0], [3.0, 1.0], [3.0, 3.0], [0.0, 3.0]],
        );
        let thirds: Vec<[f64; 2]> = (0..12)
            .map(|step| {
                let [from, to] = [square[step / 3], square[(step / 3 + 1) % 4]];
                [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * (step % 3) as f64 / 3.0)
            })
            .collect();
        assert_covers("corners along straight sides", &thirds);
        assert_covers(
            "corners twice and more",
            &[square[0], square[0], square[1], square[2], square[2], square[2], square[3]],
        );
        let star: Vec<[f64; 2]> = circle(1.0, 500)
            .into_iter()
            .enumerate()
            .map(|(step, point)| point.map(|x| if step % 2 == 0 { 4.0 * x } else { x }))
            .collect();
        assert_covers("star", &star);
        let spiral = |side: f64| {
            (0..400).map(move |step| {
                let (angle, radius) = (f64::from(step) * 0.1, 0.2 + f64::from(step) * 0.01 + side);
                [radius * libm::cos(angle), radius * libm::sin(angle)]
            })
        };
        let turns: Vec<[f64; 2]> = spiral(0.2).chain(spiral(0.0).rev()).collect();
        assert_covers("spiral", &turns);
    }

    #[test]
    fn outlines_that_pass_a_corner_twice_are_covered_once() {
        let outer = circle(4.0, 24);
        assert_covers("one hole", &keyhole(&outer, &circle(2.0, 24)));
        assert_covers(
            "a hole of four corners",
            &keyhole(&outer, &[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
        );
        // Two holes, the second bridged to the first.
        let shifted = |by: f64| circle(0.5, 12).into_iter().map(move |[x, y]| [x + by, y]).collect::<Vec<_>>();
        let two = keyhole(&keyhole(&outer, &shifted(2.0)), &shifted(-2.0));
        assert_covers("two holes bridged to one corner", &two);
        // A hole that touches the outline in a corner, and two squares that touch in one.
        let mut touching: Vec<[f64; 2]> = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        touching.extend([[0.0, 0.0], [1.0, 3.0], [3.0, 1.0]]);
        assert_covers("a hole that touches a corner", &touching);
        assert_covers(
            "two squares",
            &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0], [1.0, 1.0], [0.0, 1.0]],
        );
        // A spike outward and a slit inward have no area.
        assert_covers("spike", &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_covers("slit", &[[0.0, 0.0], [1.0, 0.0], [0.5, 0.5], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        // Bridges with separate corners on the way in, and none on the way out.
        let mut bridged: Vec<[f64; 2]> = vec![[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0], [0.0, 0.0]];
        bridged.extend([[1.0, 1.0], [2.0, 2.0], [3.0, 3.0], [3.0, 6.0], [6.0, 6.0], [6.0, 3.0], [3.0, 3.0]]);
        assert_covers("a bridge with corners on one side", &bridged);
    }

    #[test]
    fn corners_on_sides_are_met_whatever_rounding_made_of_them() {
        // The tip of a notch is on the other side of the square, or a little beyond or before it.
        for off in [0.0, 1e-9, -1e-9, 3e-6, -3e-6] {
            let outline = [[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [2.0, 3.0], [1.5, off], [1.0, 3.0], [0.0, 3.0]];
            assert_covers(&format!("notch {off}"), &outline);
            // A slit of no width but for rounding.
            let slit = [[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [1.5 + off, 3.0], [1.5, 1.0], [1.5 - off, 3.0], [0.0, 3.0]];
            assert_covers(&format!("slit {off}"), &slit);
        }
    }

    #[test]
    fn outlines_that_cross_or_wind_twice_are_refused() {
        let bow = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]];
        assert!(matches!(cut(&bow, 0.0), Err(Fault::Crossing(_))), "{:?}", cut(&bow, 0.0));
        let even = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        assert_eq!(cut(&even, 0.3), Err(Fault::NoPlane));
        let pentagram: Vec<[f64; 2]> = (0..5).map(|step| circle(1.0, 5)[step * 2 % 5]).collect();
        assert!(matches!(cut(&pentagram, 0.0), Err(Fault::Crossing(_))));
        let twice = circle(1.0, 8).repeat(2);
        assert_eq!(cut(&twice, 0.3), Err(Fault::Overlapping));
        // A fan around the middle goes round it twice.
        let around: Vec<[f64; 2]> = [[0.0, 0.0]]
            .into_iter()
            .chain((0..17).map(|step| circle(1.0 + 0.01 * f64::from(step), 8)[step as usize % 8]))
            .collect();
        assert!(cut(&around, 0.3).is_err(), "{:?}", cut(&around, 0.3));
    }

    #[test]
    fn a_face_without_area_keeps_its_sides() {
        for outline in
            [[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]], [[0.0, 0.0], [3.0, 0.0], [1.0, 0.0], [2.0, 0.0]]]
        {
            let (positions, polygon) = placed(&outline, 0.3);
            let mut triangles = Vec::new();
            Cutter::new(&positions, &seams()).cut(&polygon, &mut triangles).expect("a face without area");
            let of_triangles = chain(triangles.iter().map(|triangle| triangle.to_vec()));
            assert_eq!(of_triangles, chain([polygon].into_iter()));
        }
        let point = [[1.0, 1.0]; 5];
        assert_eq!(cut(&point, 0.0), Ok(vec![]));
    }

    /// Processor time of this thread [ns], independent of other load.
    fn processor_time() -> u64 {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
        text.split(' ').next().and_then(|first| first.parse().ok()).expect("a number")
    }

    /// A gear and a comb of about `count` corners.
    fn large_outlines(count: u32) -> [Vec<[f64; 2]>; 2] {
        let gear = (circle(1.0, count).into_iter().zip(0..))
            .map(|(point, step)| point.map(|part| if step % 4 < 2 { 3.0 * part } else { 4.0 * part }));
        let comb = (0..count).map(|step| [f64::from(step) / f64::from(count), if step % 4 < 2 { 0.1 } else { 8.0 }]);
        [gear.collect(), comb.chain([[1.0, 0.0], [0.0, 0.0]]).collect::<Vec<_>>().into_iter().rev().collect()]
    }

    /// Cuts a large outline, checks its triangles and returns the time that the cut took [ns].
    fn time_of_cut(outline: &[[f64; 2]]) -> u64 {
        let positions: Vec<[f64; 3]> = outline.iter().map(|[x, y]| [*x, 0.6 * y, 0.8 * y]).collect();
        let polygon: Vec<u32> = (0..outline.len() as u32).collect();
        let mut triangles = Vec::new();
        let start = processor_time();
        Cutter::new(&positions, &seams()).cut(&polygon, &mut triangles).expect("a simple outline");
        let time = processor_time() - start;
        let sum: f64 = triangles.iter().map(|triangle| length(area_vector(&positions, triangle))).sum();
        let whole = length(area_vector(&positions, &polygon));
        assert!(libm::fabs(sum / whole - 1.0) < 1e-9 && triangles.len() + 2 == outline.len(), "{sum} {whole}");
        assert_eq!(chain(triangles.iter().map(|triangle| triangle.to_vec())), chain([polygon].into_iter()));
        time
    }

    #[test]
    fn time_grows_with_the_number_of_corners_not_with_its_square() {
        let least = |outline: &[[f64; 2]]| (0..3).map(|_| time_of_cut(outline)).min().expect("three times");
        for (small, large) in large_outlines(2_500).iter().zip(&large_outlines(20_000)) {
            let (few, many) = (least(small), least(large));
            println!(
                "{} corners: {:.3} s, {} corners: {:.3} s",
                small.len(),
                few as f64 / 1e9,
                large.len(),
                many as f64 / 1e9
            );
            // Eight times as many corners; their square would be 64.
            assert!(many < 32 * few, "{few} ns, {many} ns");
        }
    }
}
