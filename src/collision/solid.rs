//! One body, ready to be asked.

use std::{collections::BTreeMap, sync::Arc};

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{
    Shape, Triangles,
    boxes::BoxTree,
    curved::{Curved, deepest},
    lattice::Lattice,
    surface_tree::SurfaceTree,
    triangle::{self, Triangle},
};
use crate::geom::{NoSurface, TouchShape};

/// Balls inside a body, at most.
const INNER_BALLS: usize = 32;
/// Radius of the smallest of them [m].
const LEAST_BALL: f64 = 0.004;

/// How two bodies stand to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Contact {
    /// They don't touch.
    Apart,
    /// Their surfaces touch.
    Touch,
    /// They overlap, and moving one by less than this [m] does not part them.
    Overlap(f64),
}

impl Contact {
    /// Of bodies that touch, and overlap by a depth that may not be known.
    pub fn of_depth(depth: f64) -> Self {
        // Rounding must not prove anything.
        let depth = depth - 1e-6;
        if depth > 0.0 { Self::Overlap(depth) } else { Self::Touch }
    }
}

/// Places that are still to be looked at: of a tree with eight children a node, whose smallest cubes are a 256th of the
/// largest at least.
struct Stack {
    places: [u32; 64],
    count: usize,
}

impl Stack {
    /// With the root.
    fn new() -> Self {
        Self { places: [0; 64], count: 1 }
    }

    fn push(&mut self, place: u32) {
        self.places[self.count] = place;
        self.count += 1;
    }

    fn pop(&mut self) -> Option<u32> {
        self.count = self.count.checked_sub(1)?;
        Some(self.places[self.count])
    }
}

/// A body's surface as triangles in the frame of its link, with what makes questions cheap.
pub(super) struct Solid {
    triangles: Vec<Triangle>,
    lattice: Lattice,
    tree: SurfaceTree,
    boxes: BoxTree,
    /// Balls of the inside: centre and radius, largest first.
    inner: Vec<(Point3<f64>, f64)>,
    /// A corner of each part of the surface that hangs together.
    shells: Vec<Point3<f64>>,
    /// The same surface for contacts with curved shapes.
    touch: TouchShape,
}

impl Solid {
    /// From triangles that have an area.
    ///
    /// # Errors
    /// When there is none.
    pub fn new(triangles: Vec<Triangle>) -> Result<Self, NoSurface> {
        let mesh = Triangles {
            corners: triangles.iter().flatten().copied().collect(),
            triangles: (0..triangles.len() as u32).map(|place| [3 * place, 3 * place + 1, 3 * place + 2]).collect(),
        };
        let touch = TouchShape::new(&Shape::Mesh(Arc::new(mesh)))?;
        let (tree, boxes) = (SurfaceTree::new(&triangles), BoxTree::new(&triangles));
        let lattice = Lattice::new(&triangles, &boxes);
        let inner = inner_balls(&lattice);
        let shells = shells(&triangles);
        Ok(Self { triangles, lattice, tree, boxes, inner, shells, touch })
    }

    /// The corners of the surface.
    pub fn corners(&self) -> impl Iterator<Item = &Point3<f64>> {
        self.triangles.iter().flatten()
    }

    /// A ball around the whole body.
    pub fn ball(&self) -> (Point3<f64>, f64) {
        let root = &self.tree.nodes[0];
        (root.centre, root.radius)
    }

    /// How this body and `other`, whose frame is seen from this one's as `here_from_there`, stand to each other.
    pub fn contact(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> Contact {
        let mut open = Stack::new();
        let mut overlap_tried = false;
        while let Some(place) = open.pop() {
            let node = &other.tree.nodes[place as usize];
            let centre = here_from_there * node.centre;
            if self.lattice.is_farther(&centre, node.radius) {
                continue;
            }
            for child in node.children.clone() {
                open.push(child);
            }
            if !node.children.is_empty() {
                continue;
            }
            // The surfaces are near each other. First what is proved easily.
            if !overlap_tried {
                overlap_tried = true;
                if let Some(depth) = self.overlap(other, here_from_there) {
                    return Contact::Overlap(depth);
                }
            }
            // What lies outside of this ball is another leaf's.
            let piece = (centre - Vector3::repeat(node.radius), centre + Vector3::repeat(node.radius));
            let mut near = other.tree.triangles(node).iter().map(|place| &other.triangles[*place as usize]);
            if near.any(|triangle| self.meets(&triangle.map(|corner| here_from_there * corner), &piece)) {
                return Contact::of_depth(self.depth_near(other, here_from_there, &node.centre));
            }
        }
        // Of surfaces that don't touch a part may still be inside the other body.
        let there_from_here = here_from_there.inverse();
        let held = other.shells.iter().find_map(|corner| self.depth_of(&(here_from_there * corner)));
        let holds = || self.shells.iter().find_map(|corner| other.depth_of(&(there_from_here * corner)));
        match held.or_else(holds) {
            Some(depth) => {
                Contact::of_depth(self.overlap(other, here_from_there).map_or(depth, |most| most.max(depth)))
            }
            None => Contact::Apart,
        }
    }

    /// How far inside a point is, at least [m]; `None` for one that is not.
    fn depth_of(&self, point: &Point3<f64>) -> Option<f64> {
        let (away, signed) = self.lattice.bounds(point);
        if signed < 0.0 {
            return Some(-signed);
        }
        if away > 0.0 {
            return None;
        }
        // So near the surface that a point of the lattice must be in sight.
        let distance = self.boxes.squared_distance(&self.triangles, point).sqrt();
        let inside = self.lattice.is_inside(point, distance)
            || self.lattice.inside_near(point).any(|seen| !self.boxes.crosses(&self.triangles, point, &seen));
        inside.then_some(distance)
    }

    /// How far `other` may be moved at least without ceasing to overlap [m], by balls inside it; `None` when they prove
    /// nothing.
    fn overlap(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> Option<f64> {
        let depth = |(centre, radius): &(Point3<f64>, f64)| radius - self.lattice.bounds(&(here_from_there * centre)).1;
        let deepest = other.inner.iter().map(depth).fold(0.0, f64::max);
        (deepest > 0.0).then_some(deepest)
    }

    /// How far the bodies overlap near a point of `other`'s surface [m], a lower bound: a point inside both, as deep in the
    /// one as the balls around it fit, and in the other likewise.
    fn depth_near(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>, there: &Point3<f64>) -> f64 {
        let below = |one: &Self, two: &Self, two_from_one: &IsometryMatrix3<f64>, start: &Point3<f64>| {
            let height = |point: &Point3<f64>, own: f64| -own - two.lattice.bounds(&(two_from_one * point)).1;
            let (_, point) = one.lattice.climb(one.lattice.cell(start), height);
            -one.signed_at_most(&point) - two.signed_at_most(&(two_from_one * point))
        };
        let there_from_here = here_from_there.inverse();
        let by_other = below(other, self, here_from_there, there);
        let by_self = below(self, other, &there_from_here, &(here_from_there * there));
        by_other.max(by_self)
    }

    /// How this body stands to a curved shape, whose link's frame is seen from this one's as `here_from_there`.
    pub fn contact_with_curved(&self, other: &Curved, here_from_there: &IsometryMatrix3<f64>) -> Contact {
        let (centre, radius) = other.ball();
        let centre = here_from_there * centre;
        let there_from_here = here_from_there.inverse();
        let depth = |point: &Point3<f64>| -self.lattice.bounds(point).1 - other.signed(&(there_from_here * point));
        if self.lattice.is_farther(&centre, radius) {
            // Far from the surface: on one side or the other.
            return if self.lattice.bounds(&centre).1 < 0.0 {
                Contact::Overlap(depth(&centre))
            } else {
                Contact::Apart
            };
        }
        let mut open = Stack::new();
        while let Some(place) = open.pop() {
            let node = &self.tree.nodes[place as usize];
            if other.signed(&(there_from_here * node.centre)) > node.radius {
                continue;
            }
            for child in node.children.clone() {
                open.push(child);
            }
            if node.children.is_empty() {
                let (point, _) = deepest(node.centre, depth);
                let found = -self.signed_at_most(&point) - other.signed(&(there_from_here * point));
                match Contact::of_depth(found) {
                    Contact::Touch if !other.touches(&self.touch, &there_from_here) => break,
                    contact => return contact,
                }
            }
        }
        // Their surfaces are apart: of connected shapes one holds the other, or neither.
        match self.depth_of(&centre) {
            Some(depth) => Contact::of_depth(depth - other.signed(&(there_from_here * centre))),
            None => Contact::Apart,
        }
    }

    /// Signed distance at a point, exact where the sides are known, else that to the outside [m].
    fn signed_at_most(&self, point: &Point3<f64>) -> f64 {
        let distance = self.boxes.squared_distance(&self.triangles, point).sqrt();
        if self.lattice.bounds(point).1 < 0.0 || self.lattice.is_inside(point, distance) { -distance } else { distance }
    }

    /// Whether a triangle touches the surface inside a box (low, high).
    fn meets(&self, moved: &Triangle, (low, high): &(Point3<f64>, Point3<f64>)) -> bool {
        let (from, to) = triangle::bounds(moved);
        let (low, high) = (from.sup(low), to.inf(high));
        if (0..3).any(|axis| low[axis] > high[axis]) {
            return false;
        }
        self.boxes.any_near(&low, &high, |place| {
            let own = &self.triangles[place as usize];
            let (from, to) = triangle::bounds(own);
            (0..3).all(|axis| from[axis] <= high[axis] && to[axis] >= low[axis]) && triangle::touch(own, moved)
        })
    }
}

/// Balls of the inside, each time the largest whose centre is not inside one already taken.
fn inner_balls(lattice: &Lattice) -> Vec<(Point3<f64>, f64)> {
    let mut points: Vec<_> = lattice.inside().filter(|(_, depth)| *depth >= LEAST_BALL).collect();
    let mut balls = Vec::new();
    while balls.len() < INNER_BALLS {
        let Some((centre, radius)) =
            points.iter().copied().reduce(|best, next| if next.1 > best.1 { next } else { best })
        else {
            break;
        };
        balls.push((centre, radius));
        points.retain(|(point, _)| (point - centre).norm() > 0.8 * radius);
    }
    balls
}

/// A corner of each part of a surface that hangs together at its corners.
fn shells(triangles: &[Triangle]) -> Vec<Point3<f64>> {
    let key = |corner: &Point3<f64>| [corner.x, corner.y, corner.z].map(|value| (value + 0.0).to_bits());
    let mut at_corner: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (place, triangle) in triangles.iter().enumerate() {
        triangle.iter().for_each(|corner| at_corner.entry(key(corner)).or_default().push(place));
    }
    let (mut found, mut seen) = (Vec::new(), vec![false; triangles.len()]);
    for first in 0..triangles.len() {
        if seen[first] {
            continue;
        }
        found.push(triangles[first][0]);
        let mut open = vec![first];
        while let Some(place) = open.pop() {
            if !std::mem::replace(&mut seen[place], true) {
                let beside = triangles[place].iter().filter_map(|corner| at_corner.remove(&key(corner)));
                open.extend(beside.flatten());
            }
        }
    }
    found
}
