//! One body, ready to be asked.

use nalgebra::{IsometryMatrix3, Point3};

use super::{
    boxes::BoxTree,
    lattice::Lattice,
    surface_tree::SurfaceTree,
    triangle::{self, Triangle},
};

/// Balls inside a body, at most.
const INNER_BALLS: usize = 32;
/// Radius of the smallest of them [m].
const LEAST_BALL: f64 = 0.004;

/// A body's surface as triangles in the frame of its link, with what makes questions cheap.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    triangles: Vec<Triangle>,
    lattice: Lattice,
    tree: SurfaceTree,
    boxes: BoxTree,
    /// Balls of the inside: centre and radius, largest first.
    inner: Vec<(Point3<f64>, f64)>,
}

impl Solid {
    /// From triangles that have an area; at least one.
    pub fn new(triangles: Vec<Triangle>) -> Self {
        let lattice = Lattice::new(&triangles);
        let inner = inner_balls(&lattice);
        Self { tree: SurfaceTree::new(&triangles), boxes: BoxTree::new(&triangles), lattice, inner, triangles }
    }

    /// A ball around the whole body.
    pub fn ball(&self) -> (Point3<f64>, f64) {
        let root = &self.tree.nodes[0];
        (root.centre, root.radius)
    }

    /// How far `other`, whose frame is seen from this one's as `here_from_there`, may be moved at least without ceasing to
    /// overlap [m], by balls inside it; `None` when they prove nothing.
    pub fn overlap(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> Option<f64> {
        let depth = |(centre, radius): &(Point3<f64>, f64)| radius - self.lattice.bounds(&(here_from_there * centre)).1;
        let deepest = other.inner.iter().map(depth).fold(0.0, f64::max);
        (deepest > 0.0).then_some(deepest)
    }

    /// Whether the two surfaces touch.
    pub fn touches(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> bool {
        let mut open = vec![0u32];
        while let Some(place) = open.pop() {
            let node = &other.tree.nodes[place as usize];
            let centre = here_from_there * node.centre;
            if self.lattice.bounds(&centre).0 > node.radius {
                continue;
            }
            if node.children.is_empty() {
                let near = other.tree.triangles(node).iter().map(|place| &other.triangles[*place as usize]);
                if near.into_iter().any(|triangle| self.meets(&triangle.map(|corner| here_from_there * corner))) {
                    return true;
                }
            }
            open.extend(node.children.clone());
        }
        false
    }

    fn meets(&self, moved: &Triangle) -> bool {
        let [a, b, c] = moved;
        let (low, high) = (a.inf(b).inf(c), a.sup(b).sup(c));
        self.boxes.any_near(&low, &high, |place| triangle::touch(&self.triangles[place as usize], moved))
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
