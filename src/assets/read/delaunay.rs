//! The area inside of outlines in a plane, cut into triangles.
//!
//! The triangulation is a constrained Delaunay one by the crate `spade`, whose predicates are exact (Shewchuk 1997, "Adaptive
//! precision floating-point arithmetic and fast robust geometric predicates"). Points are inserted one by one in a fixed
//! order: loading them at once goes through a hash table, whose order differs from run to run.

use std::{collections::BTreeSet, fmt};

use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation, handles::FixedVertexHandle};

/// Why a face has no triangles. Numbers are those of points, or of vertices once they are [named](Self::with_names).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    /// Two sides of the outline cross.
    Crossing([[u32; 2]; 2]),
    /// The outline runs around some area more than once, or in the opposite direction.
    Overlapping,
    /// Two corners are at one position of the plane, seen along its normal.
    Folded([u32; 2]),
    /// The outline runs around as much area one way as the other.
    NoPlane,
    /// Most corners are within rounding of most sides.
    Dust,
    /// The triangles do not add up to the area of the outline.
    Area,
}

impl Fault {
    /// Names the points of a fault by other numbers.
    pub(super) fn with_names(self, names: &[u32]) -> Self {
        let name = |point: u32| names[point as usize];
        match self {
            Self::Crossing(sides) => Self::Crossing(sides.map(|side| side.map(name))),
            Self::Folded(points) => Self::Folded(points.map(name)),
            other => other,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Crossing([[a, b], [c, d]]) => write!(
                f,
                "its outline crosses itself, the side of vertices {a} and {b} that of {c} and {d} (counted from 0)"
            ),
            Self::Overlapping => f.write_str("its outline runs around some of its area twice, or the wrong way round"),
            Self::Folded([a, b]) => {
                write!(f, "it is folded: vertex {b} lies behind vertex {a} (counted from 0)")
            }
            Self::NoPlane => f.write_str("its outline runs around as much area one way as the other"),
            Self::Dust => f.write_str("most of its corners are within rounding of most of its sides"),
            Self::Area => f.write_str("its triangles do not add up to its area"),
        }
    }
}

/// A side of outlines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Side {
    /// Two points, the lower index first.
    pub(super) ends: [u32; 2],
    /// Runs of outlines from the first end to the second, less those back; not 0.
    pub(super) times: i32,
}

/// Triangles, counter-clockwise, of the area that outlines run around once, counter-clockwise. `sides` are those of the
/// outlines, in rising order of their ends; outlines are closed. The triangles have these sides and no others that belong to a
/// single triangle.
///
/// # Errors
/// When sides cross, or run around some area in any other way.
pub(super) fn fill(points: &[[f64; 2]], sides: &[Side]) -> Result<Vec<[u32; 3]>, Fault> {
    let mut used: Vec<u32> = sides.iter().flat_map(|side| side.ends).collect();
    used.sort_unstable();
    used.dedup();
    let mut filling =
        Filling { plane: Plane::new(), vertices: vec![None; points.len()], points: Vec::with_capacity(used.len()) };
    for (place, before) in insertion_order(used.len()) {
        let point = used[place];
        filling.insert(point, points[point as usize], before.map(|before| used[before]))?;
    }
    for side in sides {
        filling.constrain(side.ends)?;
    }
    filling.inside(sides)
}

/// Places of a list in the order in which its points are inserted, each with a place that has been inserted before: the nearest one
/// below it, where the search for the point begins.
///
/// The order is scattered: a point then changes a few triangles on average, for all positions of the points (Guibas,
/// Knuth and Sharir 1992, "Randomized incremental construction of Delaunay and Voronoi diagrams"). An order along the
/// outline changes most of them again and again where teeth are regular.
fn insertion_order(count: usize) -> Vec<(usize, Option<usize>)> {
    let mut places: Vec<usize> = (0..count).collect();
    places.sort_unstable_by_key(|place| scattered(*place as u64));
    let mut inserted = BTreeSet::new();
    let mut order = Vec::with_capacity(count);
    for place in places {
        order.push((place, inserted.range(..place).next_back().or_else(|| inserted.first()).copied()));
        inserted.insert(place);
    }
    order
}

/// A number for each number, no two the same (Steele, Lea and Flood 2014, "Fast splittable pseudorandom number generators").
fn scattered(number: u64) -> u64 {
    let mixed = (number ^ number >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ mixed >> 31
}

type Plane = ConstrainedDelaunayTriangulation<Point2<f64>>;

struct Filling {
    plane: Plane,
    /// Vertex of each point that has been inserted.
    vertices: Vec<Option<FixedVertexHandle>>,
    /// Point of each vertex.
    points: Vec<u32>,
}

impl Filling {
    fn insert(&mut self, point: u32, [x, y]: [f64; 2], near: Option<u32>) -> Result<(), Fault> {
        let hint = near.and_then(|near| self.vertices[near as usize]);
        let inserted = match hint {
            Some(hint) => self.plane.insert_with_hint(Point2::new(x, y), hint),
            None => self.plane.insert(Point2::new(x, y)),
        };
        let vertex = inserted.map_err(|_| Fault::NoPlane)?;
        if let Some(&other) = self.points.get(vertex.index()) {
            return Err(Fault::Folded([other, point]));
        }
        self.points.push(point);
        self.vertices[point as usize] = Some(vertex);
        Ok(())
    }

    /// Makes a side an edge of the triangulation.
    fn constrain(&mut self, ends: [u32; 2]) -> Result<(), Fault> {
        let [from, to] = ends.map(|end| self.vertices[end as usize].expect("the ends of sides are inserted"));
        // A side that passes through a point becomes two edges: the point is on it without being an end of it.
        if self.plane.try_add_constraint(from, to).len() == 1 {
            return Ok(());
        }
        let other = self.plane.get_conflicting_edges_between_vertices(from, to).next();
        let other = other.map(|edge| edge.vertices().map(|vertex| self.points[vertex.index()]));
        Err(Fault::Crossing([ends, other.unwrap_or(ends)]))
    }

    /// The triangles around which the outlines run once. The winding number outside is 0; it increases from the right
    /// of a side to its left by the number of outlines along it.
    fn inside(&self, sides: &[Side]) -> Result<Vec<[u32; 3]>, Fault> {
        let plane = &self.plane;
        let mut turns: Vec<Option<i32>> = vec![None; plane.num_all_faces()];
        turns[plane.outer_face().index()] = Some(0);
        let mut waiting: Vec<_> = plane.directed_edges().filter(|edge| edge.is_outer_edge()).collect();
        while let Some(edge) = waiting.pop() {
            let next = edge.rev().face();
            if turns[next.index()].is_some() {
                continue;
            }
            let [from, to] = edge.vertices().map(|vertex| self.points[vertex.index()]);
            let side = sides.binary_search_by_key(&[from.min(to), from.max(to)], |side| side.ends);
            let times = side.map_or(0, |side| if from < to { sides[side].times } else { -sides[side].times });
            turns[next.index()] = turns[edge.face().index()].map(|turns| turns - times);
            waiting.extend(next.as_inner().into_iter().flat_map(|face| face.adjacent_edges()));
        }
        let mut triangles = Vec::with_capacity(plane.num_inner_faces());
        for face in plane.inner_faces() {
            match turns[face.index()] {
                Some(0) => {}
                Some(1) => triangles.push(face.vertices().map(|vertex| self.points[vertex.index()])),
                _ => return Err(Fault::Overlapping),
            }
        }
        Ok(triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_inserted_once_after_the_one_before_it() {
        for count in [0, 1, 2, 3, 8, 13, 1000] {
            let mut seen = vec![false; count];
            for (place, before) in insertion_order(count) {
                assert!(!seen[place] && before.is_none_or(|before| seen[before]), "{place} of {count}");
                seen[place] = true;
            }
            assert!(seen.iter().all(|seen| *seen), "{count}");
        }
    }
}
