//! One body, prepared for queries.

use std::collections::BTreeMap;

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{
    boxes::BoxTree,
    curved::{Curved, FINE_STEPS, STEPS, deepest},
    lattice::Lattice,
    near::{Points, View, lanes},
    nearest::Nearest,
    parts::Bounds,
    surface_tree::{Below, Block, LANES, Leaf, MAX_OPEN, SurfaceTree},
    triangle::{self, Triangle},
};
use kernel::geom::{NoSurface, SimdLevel};

/// Stride of the coarse pass along each axis of a lattice: one point of this many is tested first.
const COARSE: usize = 4;

/// Effort spent on a depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Care {
    /// A few microseconds: what lattices know.
    Short,
    /// Tens of microseconds: exact distances decide.
    Long,
}

/// A depth by balls below which no better one is searched [m].
const ENOUGH: f64 = 0.02;
/// Triangles of a piece that are compared with the other surface together.
const AT_ONCE: usize = 6;
/// Balls inside a body, at most.
const INNER_BALLS: usize = 32;
/// Radius of the smallest ball [m].
const MIN_BALL: f64 = 0.004;

/// Blocks that are still to be visited.
struct Open {
    indices: [u32; MAX_OPEN],
    count: usize,
}

impl Open {
    /// With the root, if there is one.
    fn new(tree: &SurfaceTree) -> Self {
        Self { indices: [0; MAX_OPEN], count: usize::from(!tree.blocks.is_empty()) }
    }

    fn push(&mut self, index: u32) {
        self.indices[self.count] = index;
        self.count += 1;
    }

    fn pop(&mut self) -> Option<u32> {
        self.count = self.count.checked_sub(1)?;
        Some(self.indices[self.count])
    }
}

/// A body's surface as triangles in the frame of its link, with what makes questions cheap.
pub(super) struct Solid {
    triangles: Vec<Triangle>,
    lattice: Lattice,
    /// The lattice as kernels read it: few of its points, and all.
    points: [Points; 2],
    tree: SurfaceTree,
    boxes: BoxTree,
    /// Balls of the inside: centre and radius, largest first.
    inner: Vec<(Point3<f64>, f64)>,
    /// Inner balls in blocks, side by side.
    inner_blocks: Vec<Block>,
    /// A corner of each part of the surface that hangs together.
    shells: Vec<Point3<f64>>,
    level: SimdLevel,
}

impl Solid {
    /// From triangles that have an area.
    ///
    /// # Errors
    /// If there are no triangles.
    pub fn new(triangles: Vec<Triangle>, level: SimdLevel) -> Result<Self, NoSurface> {
        if triangles.is_empty() {
            let reason = "no triangle has an area".to_owned();
            return Err(NoSurface { triangles: 0, vertices: 0, reason });
        }
        let boxes = BoxTree::new(&triangles, level);
        let lattice = Lattice::new(&triangles, &boxes);
        let shells = shells(&triangles);
        let tree = SurfaceTree::new(&triangles);
        Ok(Self::with_trees(triangles, (boxes, tree), lattice, shells, level))
    }

    /// From triangles, the distances to them, a corner of each part that hangs together, and the side of the pieces into which
    /// the surface is cut [m].
    pub fn of_parts(
        triangles: Vec<Triangle>,
        lattice: Lattice,
        shells: Vec<Point3<f64>>,
        piece: f64,
        level: SimdLevel,
    ) -> Self {
        let (boxes, tree) = (BoxTree::new(&triangles, level), SurfaceTree::with_pieces(&triangles, piece));
        Self::with_trees(triangles, (boxes, tree), lattice, shells, level)
    }

    fn with_trees(
        triangles: Vec<Triangle>,
        (boxes, tree): (BoxTree, SurfaceTree),
        lattice: Lattice,
        shells: Vec<Point3<f64>>,
        level: SimdLevel,
    ) -> Self {
        let inner = inner_balls(&lattice);
        let points = [lattice.points(COARSE), lattice.points(1)];
        let inner_blocks = Block::of_balls(&inner);
        Self { triangles, lattice, points, tree, boxes, inner, inner_blocks, shells, level }
    }

    /// The corners of the surface.
    pub fn corners(&self) -> impl Iterator<Item = &Point3<f64>> {
        self.triangles.iter().flatten()
    }

    /// A ball around the whole body.
    pub fn ball(&self) -> (Point3<f64>, f64) {
        self.tree.ball
    }

    /// Where this body and `other`, whose frame is expressed in this one's as `here_from_there`, meet: a point of the other's
    /// frame near which their surfaces touch, or that lies inside both. `None` when they are apart.
    pub fn meets(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> Option<Point3<f64>> {
        let [few, all] = &self.points;
        let views = [few.view(here_from_there, &other.tree.ball), all.view(here_from_there, &other.tree.ball)];
        let mut open = Open::new(&other.tree);
        let mut balls_tried = false;
        while let Some(index) = open.pop() {
            let block = &other.tree.blocks[index as usize];
            let mut found = few.test_block(self.level, &views[0], block);
            if found.near != 0 {
                found = all.test_block(self.level, &views[1], block);
            }
            if let Some(lane) = lanes(found.inside).next() {
                return Some(block.centre(lane));
            }
            // What reaches inside is tested first: there the surfaces are likely to touch.
            let (likely, others) = (found.near & found.reaching, found.near & !found.reaching);
            for lane in lanes(likely).chain(lanes(others)) {
                let Below::Leaf(leaf) = block.below[lane] else { continue };
                if !std::mem::replace(&mut balls_tried, true)
                    && let Some(centre) = self.reached_by_balls(other, &views[1])
                {
                    return Some(centre);
                }
                let leaf = &other.tree.leaves[leaf as usize];
                if self.meets_leaf(other, leaf, here_from_there) {
                    return Some(leaf.centre);
                }
            }
            for lane in lanes(others).chain(lanes(likely)) {
                if let Below::Block(below) = block.below[lane] {
                    open.push(below);
                }
            }
        }
        // Of surfaces that don't touch a part may still be inside the other body: of this one's in the other, or, too near to
        // this one's surface to be distinguished from it so far, of the other's in this one.
        let there_from_here = here_from_there.inverse();
        let own = self.shells.iter().map(|corner| there_from_here * corner).find(|corner| other.holds(corner));
        let held = || other.shells.iter().find(|corner| self.holds(&(here_from_there * *corner))).copied();
        own.or_else(|| if balls_tried { held() } else { None })
    }

    /// The centre of a ball inside the other body that reaches inside this one.
    fn reached_by_balls(&self, other: &Self, view: &View) -> Option<Point3<f64>> {
        other.inner_blocks.iter().find_map(|block| {
            let found = self.points[1].test_block(self.level, view, block);
            lanes(found.reaching).next().map(|lane| block.centre(lane))
        })
    }

    /// Whether a piece of the other's surface touches this one's.
    fn meets_leaf(&self, other: &Self, leaf: &Leaf, here_from_there: &IsometryMatrix3<f64>) -> bool {
        // What lies outside of this ball is another leaf's.
        let (centre, side) = (here_from_there * leaf.centre, Vector3::repeat(leaf.radius));
        let piece = Bounds { low: centre - side, high: centre + side };
        other.tree.triangles(leaf).chunks(AT_ONCE).any(|triangles_here| {
            let mut moved = [([Point3::origin(); 3], piece); AT_ONCE];
            let mut count = 0;
            for index in triangles_here {
                let triangle = other.triangles[*index as usize].map(|corner| here_from_there * corner);
                let bounds = triangle::bounds(&triangle);
                if bounds.meets(&piece) {
                    moved[count] = (triangle, bounds.shared(&piece));
                    count += 1;
                }
            }
            count > 0
                && self.boxes.any_near(&piece, |own| {
                    let bounds = triangle::bounds(own);
                    moved[..count].iter().any(|(triangle, part)| bounds.meets(part) && triangle::touch(own, triangle))
                })
        })
    }

    /// Lower bound on the distance that one of two bodies that meet near `there` (see [`Solid::meets`]) may move
    /// without the two ceasing to overlap [m]; `care` is the effort spent, which ends early once more than `enough` is
    /// known.
    pub fn depth(
        &self,
        other: &Self,
        here_from_there: &IsometryMatrix3<f64>,
        there: &Point3<f64>,
        care: Care,
        enough: f64,
    ) -> f64 {
        let by_balls = self.overlap(other, here_from_there);
        if by_balls > enough.min(ENOUGH) {
            return by_balls;
        }
        let there_from_here = here_from_there.inverse();
        let depth = |here: &Point3<f64>| -self.signed_at_most(here) - other.signed_at_most(&(there_from_here * here));
        // Lattices lead to a point that is deep in both bodies, once that of the one and once that of the other.
        let by_other = other.climb_with(self, here_from_there, there, enough);
        if by_other.0 > enough {
            return by_other.0;
        }
        let by_self = self.climb_with(other, &there_from_here, &(here_from_there * there), enough);
        if by_self.0 > enough {
            return by_self.0;
        }
        let deep = [here_from_there * by_other.1, by_self.1].map(|point| (depth(&point), point));
        let (found, point) = if deep[0].0 >= deep[1].0 { deep[0] } else { deep[1] };
        let found = if care == Care::Long { deepest(point, FINE_STEPS, enough, depth).1 } else { found };
        by_balls.max(found)
    }

    /// Visits pieces of the other body's surface that may be nearer to this one's than the distance found so far, until the
    /// search is decided.
    pub fn near_leaves(
        &self,
        other: &Self,
        here_from_there: &IsometryMatrix3<f64>,
        nearest: &mut Nearest,
        mut visit: impl FnMut(&Leaf, &mut Nearest),
    ) {
        let views = self.points.each_ref().map(|points| points.view(here_from_there, &other.tree.ball));
        let mut open = Open::new(&other.tree);
        while let Some(index) = open.pop() {
            let block = &other.tree.blocks[index as usize];
            let bounds = [nearest.best, nearest.enough];
            let mut found = self.points[0].gaps(self.level, &views[0], bounds, block);
            if found.near != 0 {
                found = self.points[1].gaps(self.level, &views[1], bounds, block);
            }
            if found.nearer != 0 {
                nearest.decide();
                return;
            }
            // The nearest ball comes last, so that it is visited next.
            let (mut order, mut count) = ([0; LANES], 0);
            for lane in lanes(found.near) {
                order[count] = lane;
                count += 1;
            }
            order[..count].sort_unstable_by(|a, b| found.apart[*b].total_cmp(&found.apart[*a]));
            for lane in &order[..count] {
                match block.below[*lane] {
                    Below::Block(below) => open.push(below),
                    Below::Leaf(leaf) => visit(&other.tree.leaves[leaf as usize], nearest),
                }
                if nearest.decided() {
                    return;
                }
            }
        }
    }

    /// Visits pieces of this body's surface that may be nearer to a shape, whose link's frame is expressed in this one's, than
    /// the distance found so far, until the search is decided.
    pub fn leaves_near_curved(
        &self,
        other: &Curved,
        here_from_there: &IsometryMatrix3<f64>,
        nearest: &mut Nearest,
        mut visit: impl FnMut(&Leaf, &mut Nearest),
    ) {
        let axis = other.axis(here_from_there);
        let mut open = Open::new(&self.tree);
        while let Some(index) = open.pop() {
            let block = &self.tree.blocks[index as usize];
            for lane in lanes(axis.widened(nearest.best).near(self.level, block)) {
                match block.below[lane] {
                    Below::Block(below) => open.push(below),
                    Below::Leaf(leaf) => visit(&self.tree.leaves[leaf as usize], nearest),
                }
                if nearest.decided() {
                    return;
                }
            }
        }
    }

    /// Lowers `nearest` to the distance between this body and the triangles of a piece of the other's surface, but those
    /// `done`, which it joins.
    pub fn approach_leaf(
        &self,
        other: &Self,
        leaf: &Leaf,
        here_from_there: &IsometryMatrix3<f64>,
        done: &mut Vec<u32>,
        nearest: &mut Nearest,
    ) {
        for (index, triangle) in other.triangles_of(leaf) {
            if done.contains(&index) {
                continue;
            }
            done.push(index);
            let triangle = triangle.map(|corner| here_from_there * corner);
            let (Bounds { low, high }, side) = (triangle::bounds(&triangle), Vector3::repeat(nearest.best));
            let around = Bounds { low: low - side, high: high + side };
            self.boxes.any_near(&around, |own| {
                let gap = triangle::squared_gap(own, &triangle);
                if gap < nearest.best * nearest.best {
                    nearest.best = gap.sqrt();
                }
                nearest.decided()
            });
            if nearest.decided() {
                return;
            }
        }
    }

    /// The triangles that reach into a piece of the surface, with their indices.
    pub fn triangles_of(&self, leaf: &Leaf) -> impl Iterator<Item = (u32, &Triangle)> {
        self.tree.triangles(leaf).iter().map(|index| (*index, &self.triangles[*index as usize]))
    }

    /// Exact distance to the surface where it is less than `limit`, else `limit` [m].
    pub fn distance_within(&self, point: &Point3<f64>, limit: f64) -> f64 {
        let max = self.lattice.distance_at_most(point).min(limit);
        self.boxes.squared_distance_within(point, max * max).sqrt()
    }

    /// Exact distance to the surface [m]: the lattice's bound keeps the search short.
    fn distance(&self, point: &Point3<f64>) -> f64 {
        let max = self.lattice.distance_at_most(point);
        self.boxes.squared_distance_within(point, max * max).sqrt()
    }

    /// Whether a point is inside.
    fn holds(&self, point: &Point3<f64>) -> bool {
        let (centre, radius) = self.tree.ball;
        if (point - centre).norm_squared() > radius * radius {
            return false;
        }
        let (away, signed) = self.lattice.bounds(point);
        if signed < 0.0 || away > 0.0 {
            return signed < 0.0;
        }
        // So near the surface that a point of the lattice must be in sight.
        let distance = self.distance(point);
        self.lattice.is_inside(point, distance)
            || self.lattice.inside_near(point).any(|seen| !self.boxes.crosses(point, &seen))
    }

    /// Lower bound on the distance that `other` may move without ceasing to overlap [m], by balls inside it; 0 when
    /// they prove nothing.
    fn overlap(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> f64 {
        let depth = |(centre, radius): &(Point3<f64>, f64)| radius - self.lattice.bounds(&(here_from_there * centre)).1;
        other.inner.iter().map(depth).fold(0.0, f64::max)
    }

    /// Where climbing this body's lattice from near `start` leads to, with the height that lattices know of: how deep a point
    /// lies in this body and in `other` together [m].
    fn climb_with(
        &self,
        other: &Self,
        other_from_here: &IsometryMatrix3<f64>,
        start: &Point3<f64>,
        enough: f64,
    ) -> (f64, Point3<f64>) {
        let height = |point: &Point3<f64>, own: f64| -own - other.lattice.bounds(&(other_from_here * point)).1;
        self.lattice.climb(self.lattice.cell(start), enough, height)
    }

    /// Where this body and a curved shape, whose link's frame is expressed in this one's as `here_from_there`, meet: as
    /// [`Solid::meets`], but a point of this body's frame.
    pub fn meets_curved(&self, other: &Curved, here_from_there: &IsometryMatrix3<f64>) -> Option<Point3<f64>> {
        let axis = other.axis(here_from_there);
        let mut open = Open::new(&self.tree);
        let mut near = None;
        while let (Some(index), None) = (open.pop(), near) {
            let block = &self.tree.blocks[index as usize];
            for lane in lanes(axis.near(self.level, block)) {
                match block.below[lane] {
                    Below::Block(below) => open.push(below),
                    Below::Leaf(leaf) => near = Some(self.tree.leaves[leaf as usize].centre),
                }
            }
        }
        if near.is_some() {
            let held = self.deepest_ball(other, here_from_there);
            if held.is_some() || other.touches(&self.boxes, here_from_there) {
                return held.or(near);
            }
        }
        // Their surfaces are apart: of connected shapes this one holds the other, or neither.
        let centre = here_from_there * other.ball().0;
        self.holds(&centre).then_some(centre)
    }

    /// The centre of the ball inside this body that a curved shape reaches into by most.
    fn deepest_ball(&self, other: &Curved, here_from_there: &IsometryMatrix3<f64>) -> Option<Point3<f64>> {
        let there_from_here = here_from_there.inverse();
        let mut best = (0.0, None);
        for (centre, radius) in &self.inner {
            let depth = radius - other.signed(&(there_from_here * centre));
            if depth > best.0 {
                best = (depth, Some(*centre));
            }
        }
        best.1
    }

    /// Overlap depth of this body and a curved shape that meet near `here`, as [`Solid::depth`] defines it.
    pub fn depth_with_curved(
        &self,
        other: &Curved,
        here_from_there: &IsometryMatrix3<f64>,
        here: &Point3<f64>,
        care: Care,
        enough: f64,
    ) -> f64 {
        let there_from_here = here_from_there.inverse();
        let bound = |point: &Point3<f64>| -self.lattice.bounds(point).1 - other.signed(&(there_from_here * point));
        let depth = |point: &Point3<f64>| -self.signed_at_most(point) - other.signed(&(there_from_here * point));
        let (point, min) = deepest(*here, STEPS, enough, bound);
        match care {
            _ if min > enough => min,
            Care::Short => depth(&point),
            Care::Long => deepest(point, FINE_STEPS, enough, depth).1,
        }
    }

    /// Signed distance at a point, exact where the sides are known, else that to the outside [m].
    fn signed_at_most(&self, point: &Point3<f64>) -> f64 {
        let distance = self.distance(point);
        if self.lattice.bounds(point).1 < 0.0 || self.lattice.is_inside(point, distance) { -distance } else { distance }
    }
}

/// Balls of the inside, each time the largest whose centre is not inside one already taken.
fn inner_balls(lattice: &Lattice) -> Vec<(Point3<f64>, f64)> {
    let mut points: Vec<_> = lattice.inside().filter(|(_, depth)| *depth >= MIN_BALL).collect();
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
    for (index, triangle) in triangles.iter().enumerate() {
        triangle.iter().for_each(|corner| at_corner.entry(key(corner)).or_default().push(index));
    }
    let (mut found, mut seen) = (Vec::new(), vec![false; triangles.len()]);
    for first in 0..triangles.len() {
        if seen[first] {
            continue;
        }
        found.push(triangles[first][0]);
        let mut open = vec![first];
        while let Some(index) = open.pop() {
            if !std::mem::replace(&mut seen[index], true) {
                let beside = triangles[index].iter().filter_map(|corner| at_corner.remove(&key(corner)));
                open.extend(beside.flatten());
            }
        }
    }
    found
}
