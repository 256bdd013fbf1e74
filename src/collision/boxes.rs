//! A tree of boxes over triangles: which come near a box.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use super::triangle::{Triangle, bounds_of, may_cross, squared_distance};

/// Triangles a leaf, at most.
const LEAF: usize = 4;

/// Boxes, each around those below it; the triangles of every node are a run of `order`.
#[derive(Clone, Debug)]
pub(super) struct BoxTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Node {
    low: Point3<f64>,
    high: Point3<f64>,
    triangles: Range<u32>,
    /// The node after all that hang below this one.
    next: u32,
}

impl BoxTree {
    pub fn new(triangles: &[Triangle]) -> Self {
        let mut tree = Self { nodes: Vec::new(), order: (0..triangles.len() as u32).collect() };
        tree.split(triangles, 0..triangles.len());
        tree
    }

    fn split(&mut self, triangles: &[Triangle], run: Range<usize>) {
        let (low, high) = bounds_of(self.order[run.clone()].iter().map(|place| &triangles[*place as usize]));
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, triangles: run.start as u32..run.end as u32, next: 0 });
        if run.len() > LEAF {
            let axis = (high - low).imax();
            let middle = |place: &u32| triangles[*place as usize].iter().map(|corner| corner[axis]).sum::<f64>();
            // Equal keys keep the order of the triangles: the same tree everywhere.
            self.order[run.clone()].sort_by(|a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
            let half = run.start + run.len() / 2;
            self.split(triangles, run.start..half);
            self.split(triangles, half..run.end);
        }
        self.nodes[node].next = self.nodes.len() as u32;
    }

    /// Squared distance from a point to the nearest of the triangles [m^2].
    pub fn squared_distance(&self, triangles: &[Triangle], point: &Point3<f64>) -> f64 {
        let mut best = f64::INFINITY;
        self.approach(0, triangles, point, &mut best);
        best
    }

    fn approach(&self, at: usize, triangles: &[Triangle], point: &Point3<f64>, best: &mut f64) {
        let node = &self.nodes[at];
        if node.next as usize == at + 1 {
            let run = node.triangles.start as usize..node.triangles.end as usize;
            for place in &self.order[run] {
                *best = best.min(squared_distance(point, &triangles[*place as usize]));
            }
            return;
        }
        let outside = |child: usize| {
            let node = &self.nodes[child];
            (node.low - point).sup(&(point - node.high)).sup(&Vector3::zeros()).norm_squared()
        };
        let children = [at + 1, self.nodes[at + 1].next as usize];
        let [near, far] =
            if outside(children[0]) <= outside(children[1]) { children } else { [children[1], children[0]] };
        for child in [near, far] {
            if outside(child) < *best {
                self.approach(child, triangles, point, best);
            }
        }
    }

    /// Whether one of the triangles stands between two points, or just beside the line.
    pub fn crosses(&self, triangles: &[Triangle], from: &Point3<f64>, to: &Point3<f64>) -> bool {
        self.any_near(&from.inf(to), &from.sup(to), |place| may_cross(from, to, &triangles[place as usize]))
    }

    /// Whether `found` holds for a triangle whose group's box meets the box from `low` to `high`.
    pub fn any_near(&self, low: &Point3<f64>, high: &Point3<f64>, mut found: impl FnMut(u32) -> bool) -> bool {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let apart = (0..3).any(|axis| node.low[axis] > high[axis] || node.high[axis] < low[axis]);
            if apart {
                at = node.next as usize;
                continue;
            }
            if node.next as usize == at + 1 {
                let run = node.triangles.start as usize..node.triangles.end as usize;
                if self.order[run].iter().any(|place| found(*place)) {
                    return true;
                }
            }
            at += 1;
        }
        false
    }
}
