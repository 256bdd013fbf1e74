//! The winding number of the caps over a surface's holes, fast: multipoles over a tree (Barill et al. 2018, with their
//! second-order expansion).

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use super::columns::{Ticks, in_cells};

type V3 = Vector3<f64>;

/// A node is taken as a whole from this many radii off.
const FAR: f64 = 2.5;

/// A node goes into the expansion of a ball that is this many radii of the ball further off.
const FAR_FROM_BLOCK: f64 = 3.0;

/// Caps over closed polygons, as a tree: groups of caps at the top, each cap halved again and again below. Lengths in
/// cells.
pub(super) struct Caps {
    nodes: Vec<Node>,
}

struct Node {
    /// Middle of the expansion.
    centre: V3,
    /// Everything below lies within this distance of `centre`.
    radius: f64,
    /// Vector area: the integral of the normal.
    first: V3,
    /// The integral of normal * (position - centre)^T.
    second: Matrix3<f64>,
    /// Area.
    area: f64,
    /// Triangles.
    count: f64,
    /// Length of rim.
    rim: f64,
    /// The middle triangle of a polygon, and whether side i, from corner i to the next, belongs to the rim; none for a
    /// group.
    triangle: Option<([V3; 3], [bool; 3])>,
    children: [Option<u32>; 2],
}

impl Caps {
    /// Caps over polygons.
    pub(super) fn new(polygons: &[Vec<Ticks>]) -> Self {
        let mut caps = Self { nodes: Vec::new() };
        let mut roots: Vec<u32> = polygons
            .iter()
            .map(|polygon| {
                let corners: Vec<V3> = polygon.iter().map(|corner| V3::from(in_cells(*corner))).collect();
                caps.polygon(&corners, true)
            })
            .collect();
        if !roots.is_empty() {
            caps.group(&mut roots);
        }
        assert!(caps.nodes.len() < Part::TRIANGLE as usize, "node indices have 31 bits");
        caps
    }

    /// The triangles of all caps.
    pub(super) fn triangles(&self) -> impl Iterator<Item = [V3; 3]> + '_ {
        self.nodes.iter().filter_map(|node| node.triangle.as_ref().map(|(corners, _)| *corners))
    }

    /// A polygon with three corners or more: the triangle first, middle, last, and what lies beyond its first two sides.
    fn polygon(&mut self, corners: &[V3], whole: bool) -> u32 {
        let (middle, last) = (corners.len() / 2, corners.len() - 1);
        let sides = [&corners[..=middle], &corners[middle..]];
        let children = sides.map(|side| (side.len() > 2).then(|| self.polygon(side, false)));
        let triangle = [corners[0], corners[middle], corners[last]];
        let on_rim = [middle == 1, last == middle + 1, whole];
        let doubled = (triangle[1] - triangle[0]).cross(&(triangle[2] - triangle[0]));
        let own = Node {
            centre: (triangle[0] + triangle[1] + triangle[2]) / 3.0,
            radius: 0.0,
            first: doubled * 0.5,
            second: Matrix3::zeros(),
            area: 0.5 * doubled.norm(),
            count: 1.0,
            rim: (0..3).map(|i| if on_rim[i] { (triangle[(i + 1) % 3] - triangle[i]).norm() } else { 0.0 }).sum(),
            triangle: Some((triangle, on_rim)),
            children,
        };
        let mut node = self.merge(own);
        node.radius = corners.iter().map(|corner| (corner - node.centre).norm()).fold(0.0, f64::max);
        self.push(node)
    }

    /// A balanced tree over whole caps.
    fn group(&mut self, roots: &mut [u32]) -> u32 {
        if let [root] = roots {
            return *root;
        }
        // Split at the median of the longest axis of the centres.
        let centre = |caps: &Self, root: u32| caps.nodes[root as usize].centre;
        let (mut low, mut high) = (V3::repeat(f64::MAX), V3::repeat(f64::MIN));
        for root in roots.iter() {
            low = low.inf(&centre(self, *root));
            high = high.sup(&centre(self, *root));
        }
        let axis = (high - low).imax();
        roots.sort_unstable_by(|a, b| centre(self, *a)[axis].total_cmp(&centre(self, *b)[axis]).then_with(|| a.cmp(b)));
        let (left, right) = roots.split_at_mut(roots.len() / 2);
        let children = [Some(self.group(left)), Some(self.group(right))];
        let empty = Node {
            centre: V3::zeros(),
            radius: 0.0,
            first: V3::zeros(),
            second: Matrix3::zeros(),
            area: 0.0,
            count: 0.0,
            rim: 0.0,
            triangle: None,
            children,
        };
        // Moments of the children, and a ball around theirs.
        let mut node = self.merge(empty);
        node.radius =
            self.below(&node).map(|child| (child.centre - node.centre).norm() + child.radius).fold(0.0, f64::max);
        self.push(node)
    }

    fn push(&mut self, node: Node) -> u32 {
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }

    fn below<'a>(&'a self, node: &Node) -> impl Iterator<Item = &'a Node> + use<'a> {
        node.children.into_iter().flatten().map(|child| &self.nodes[child as usize])
    }

    /// Adds the moments of the children to a node's own, about their common centroid.
    fn merge(&self, own: Node) -> Node {
        let (mut area, mut weighted) = (own.area, own.centre * own.area);
        for child in self.below(&own) {
            area += child.area;
            weighted += child.centre * child.area;
        }
        let centre = if area > 0.0 { weighted / area } else { own.centre };
        let mut node = Node { centre, second: own.first * (own.centre - centre).transpose(), ..own };
        for child in self.below(&node) {
            node.second += child.second + child.first * (child.centre - centre).transpose();
            node.first += child.first;
            node.area += child.area;
            node.count += child.count;
            node.rim += child.rim;
        }
        node
    }

    /// Cap set before any block is evaluated: nothing is far.
    pub(super) fn everywhere(&self) -> Local {
        let root = self.nodes.len() as u32 - 1;
        Local { near: vec![Part::all(root)], near_caps: vec![root], ..Local::default() }
    }

    /// Narrows `outer` down to the ball of radius `reach` around `point`, which must lie inside that of `outer`: parts
    /// that have become far move into the expansion.
    pub(super) fn narrow(&self, outer: &Local, point: V3, reach: f64, inner: &mut Local) {
        inner.shift_from(outer, point);
        // Parts far from the ball join the expansion; large near parts are opened.
        let mut parts = Stack::default();
        for part in &outer.near {
            parts.push(*part);
            while let Some(part) = parts.pop() {
                let node = &self.nodes[part.node()];
                let to = node.centre - point;
                if to.norm() > FAR * node.radius + FAR_FROM_BLOCK * reach {
                    node.expand(&to, inner);
                } else if node.radius > reach && part.has_more(node) {
                    if node.triangle.is_some() {
                        inner.near.push(part.triangle_only());
                    }
                    node.children.into_iter().flatten().for_each(|child| parts.push(Part::all(child)));
                } else {
                    inner.near.push(part);
                }
            }
        }
        // Whole caps far from the ball only bound the gradient.
        let mut caps = Stack::default();
        for cap in &outer.near_caps {
            caps.push(*cap);
            while let Some(index) = caps.pop() {
                let node = &self.nodes[index as usize];
                let gap = (node.centre - point).norm() - node.radius - reach;
                // The bound is for the whole ball and stays for the blocks inside: it must not be much too wide there.
                if gap > node.radius && gap > FAR_FROM_BLOCK * reach {
                    inner.far_slope += node.slope_by_area(gap).min(node.slope_by_rim(gap));
                } else if node.triangle.is_none() && node.radius > reach {
                    node.children.into_iter().flatten().for_each(|child| caps.push(child));
                } else {
                    inner.near_caps.push(index);
                }
            }
        }
    }

    /// The winding number of all caps at `point` in the ball of `local`.
    pub(super) fn winding(&self, local: &Local, point: &V3) -> f64 {
        let mut angle = local.far_angle(point);
        let mut near = HalfAngle::default();
        let mut stack = Stack::default();
        for part in &local.near {
            stack.push(*part);
            while let Some(part) = stack.pop() {
                let node = &self.nodes[part.node()];
                let to = node.centre - point;
                let squared = to.norm_squared();
                if squared > (FAR * node.radius) * (FAR * node.radius) && !part.is_triangle_only() {
                    angle += node.far_angle(&to, squared);
                    continue;
                }
                if let Some((corners, _)) = &node.triangle {
                    near.add(corners, point);
                }
                if !part.is_triangle_only() {
                    node.children.into_iter().flatten().for_each(|child| stack.push(Part::all(child)));
                }
            }
        }
        (angle + 2.0 * near.sum()) / (4.0 * PI)
    }

    /// The winding number of all caps around `point` without expansions.
    pub(super) fn exact_winding(&self, point: &V3) -> f64 {
        let mut sum = HalfAngle::default();
        self.triangles().for_each(|corners| sum.add(&corners, point));
        2.0 * sum.sum() / (4.0 * PI)
    }

    /// Whether the winding number, followed without its jumps across the caps, stays within `bound` of its value at
    /// `point` on all straight paths of length `reach`, the ball of `local`. "No" may be wrong, "yes" is not.
    ///
    /// The gradient of a cap is at most area / (2 pi d^3) (dipoles at distance d), and at most the integral of
    /// 1 / (4 pi d^2) over its rim (the law of Biot and Savart). Inner edges carry no current, so that the second bound
    /// holds for whole caps only. Away from a cap its winding number is also small in itself.
    pub(super) fn is_calm(&self, local: &Local, point: &V3, reach: f64, bound: f64) -> bool {
        let mut swing = local.far_slope * reach;
        let mut caps = Stack::default();
        for near in &local.near_caps {
            caps.push(*near);
            while let Some(cap) = caps.pop() {
                if swing > bound {
                    return false;
                }
                let node = &self.nodes[cap as usize];
                let gap = (node.centre - point).norm() - node.radius - reach;
                let outside = (node.slope_by_area(gap) * reach).min(2.0 * node.max(gap));
                if outside < 0.1 * bound {
                    swing += outside;
                } else if node.triangle.is_none() {
                    // Each cap of a group has its own bounds.
                    node.children.into_iter().flatten().for_each(|child| caps.push(child));
                } else {
                    swing += outside.min(self.rim_slope(cap, point, reach, (bound - swing) / reach) * reach);
                }
            }
        }
        swing <= bound
    }

    /// The integral of 1 / (4 pi d^2) over the rim of one cap, at most; given up beyond `limit`.
    fn rim_slope(&self, cap: u32, point: &V3, reach: f64, limit: f64) -> f64 {
        let mut slope = 0.0;
        let mut stack = Stack::default();
        stack.push(cap);
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            let gap = (node.centre - point).norm() - node.radius - reach;
            if gap > node.radius {
                slope += node.slope_by_rim(gap);
            } else if let Some((corners, on_rim)) = &node.triangle {
                for side in (0..3).filter(|side| on_rim[*side]) {
                    let (a, b) = (corners[side], corners[(side + 1) % 3]);
                    let gap = distance_to_segment(point, &a, &b) - reach;
                    slope += if gap > 0.0 { (b - a).norm() / (4.0 * PI * gap * gap) } else { f64::INFINITY };
                }
                node.children.into_iter().flatten().for_each(|child| stack.push(child));
            }
            if slope > limit {
                return f64::INFINITY;
            }
        }
        slope
    }
}

/// Cap set as evaluated inside a ball: far parts as a Taylor expansion, near ones by index.
#[derive(Debug, Default)]
pub(super) struct Local {
    /// Middle of the expansion and of the ball.
    centre: V3,
    /// Solid angle of the far parts at `centre`, its gradient and its second derivatives.
    angle: f64,
    gradient: V3,
    hessian: Matrix3<f64>,
    /// Parts that are too near for the expansion.
    near: Vec<Part>,
    /// Bound of the gradient of the far caps' winding number, anywhere in the ball.
    far_slope: f64,
    /// Whole caps, and groups of them, too near for that bound.
    near_caps: Vec<u32>,
}

impl Local {
    fn shift_from(&mut self, outer: &Self, point: V3) {
        let by = point - outer.centre;
        self.centre = point;
        self.angle = outer.far_angle(&point);
        self.gradient = outer.gradient + outer.hessian * by;
        self.hessian = outer.hessian;
        self.far_slope = outer.far_slope;
        self.near.clear();
        self.near_caps.clear();
    }

    fn far_angle(&self, point: &V3) -> f64 {
        let by = point - self.centre;
        self.angle + self.gradient.dot(&by) + 0.5 * by.dot(&(self.hessian * by))
    }
}

/// A node with all below it, or its own triangle alone.
#[derive(Clone, Copy, Debug, Default)]
struct Part(u32);

impl Part {
    const TRIANGLE: u32 = 1 << 31;

    fn all(node: u32) -> Self {
        Self(node)
    }

    fn triangle_only(self) -> Self {
        Self(self.0 | Self::TRIANGLE)
    }

    fn is_triangle_only(self) -> bool {
        self.0 & Self::TRIANGLE != 0
    }

    fn node(self) -> usize {
        (self.0 & !Self::TRIANGLE) as usize
    }

    fn has_more(self, node: &Node) -> bool {
        !self.is_triangle_only() && node.children != [None, None]
    }
}

impl Node {
    fn slope_by_area(&self, gap: f64) -> f64 {
        if gap > 0.0 { self.area / (2.0 * PI * gap * gap * gap) } else { f64::INFINITY }
    }

    /// The winding number, at most, at this distance from the ball that holds everything below: no triangle covers more
    /// of the view than the ball does.
    fn max(&self, gap: f64) -> f64 {
        if gap <= 0.0 {
            return f64::INFINITY;
        }
        let sine = self.radius / (gap + self.radius);
        let ball = 0.5 * (1.0 - (1.0 - sine * sine).sqrt());
        (self.count * ball).min(self.area / (4.0 * PI * gap * gap))
    }

    fn slope_by_rim(&self, gap: f64) -> f64 {
        if gap > 0.0 { self.rim / (4.0 * PI * gap * gap) } else { f64::INFINITY }
    }

    /// Adds the expansion of the node, seen from afar, to `local`; `to` leads from its centre to the node's.
    fn expand(&self, to: &V3, local: &mut Local) {
        let squared = to.norm_squared();
        let inverse = 1.0 / squared;
        let cube = inverse * inverse.sqrt();
        let along = self.first.dot(to);
        let bent = self.second * to;
        let bend = to.dot(&bent);
        local.angle += cube * (along + self.second.trace() - 3.0 * inverse * bend);
        // Derivatives by the eye's position are those by `to`, with the sign changed once for each order.
        let fifth = 3.0 * cube * inverse;
        local.gradient -= self.first * cube - to * (fifth * along);
        local.gradient += (to * (self.second.trace() - 5.0 * inverse * bend) + bent + self.second.tr_mul(to)) * fifth;
        let outer = self.first * to.transpose();
        local.hessian += (to * to.transpose() * (5.0 * inverse * along) - outer - outer.transpose()) * fifth;
        local.hessian -= Matrix3::from_diagonal_element(fifth * along);
    }

    /// Solid angle from afar; `to` leads from the eye to `centre`.
    fn far_angle(&self, to: &V3, squared: f64) -> f64 {
        let inverse = 1.0 / squared;
        let cube = inverse * inverse.sqrt();
        let bend = self.second.trace() - 3.0 * inverse * to.dot(&(self.second * to));
        cube * (self.first.dot(to) + bend)
    }
}

/// A sum of halved solid angles of triangles (Van Oosterom and Strackee 1983), each positive from the side that the
/// triangle's back faces: as a complex number, so that one arc tangent does for all.
struct HalfAngle {
    re: f64,
    im: f64,
    /// Full revolutions that `(re, im)` does not show.
    revolutions: f64,
}

impl Default for HalfAngle {
    fn default() -> Self {
        Self { re: 1.0, im: 0.0, revolutions: 0.0 }
    }
}

impl HalfAngle {
    fn add(&mut self, corners: &[V3; 3], point: &V3) {
        let [a, b, c] = corners.map(|corner| corner - point);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let re = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        let im = a.dot(&b.cross(&c));
        let size = re.abs() + im.abs();
        if size == 0.0 {
            return;
        }
        let (re, im) = (re / size, im / size);
        // Adding 0 makes 0 of -0, which would be the lower side of the cut.
        let (new_re, new_im) = (self.re * re - self.im * im, self.re * im + self.im * re + 0.0);
        // Two angles of one sign whose sum shows the other sign have passed half a revolution.
        match (self.im < 0.0, im < 0.0, new_im < 0.0) {
            (false, false, true) => self.revolutions += 1.0,
            (true, true, false) => self.revolutions -= 1.0,
            _ => {}
        }
        (self.re, self.im) = (new_re, new_im);
    }

    fn sum(&self) -> f64 {
        libm::atan2(self.im, self.re) + 2.0 * PI * self.revolutions
    }
}

/// Distance of a point from the line between two others.
pub(super) fn distance_to_segment(point: &V3, a: &V3, b: &V3) -> f64 {
    let (along, to) = (b - a, point - a);
    let share = (to.dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (to - along * share).norm()
}

/// Nodes still to be visited. A tree over `n` caps of `m` corners is about log2(n m) deep.
struct Stack<T> {
    items: [T; 64],
    len: usize,
}

impl<T: Copy + Default> Default for Stack<T> {
    fn default() -> Self {
        Self { items: [T::default(); 64], len: 0 }
    }
}

impl<T: Copy> Stack<T> {
    fn push(&mut self, item: T) {
        self.items[self.len] = item;
        self.len += 1;
    }

    fn pop(&mut self) -> Option<T> {
        self.len = self.len.checked_sub(1)?;
        Some(self.items[self.len])
    }
}
