//! Boxes against the triangles of a tree, yes or no, without a distance: the first triangle that meets one ends the search.
//!
//! Separating axes (Gottschalk, Lin and Manocha 1996; of a triangle Akenine-Moeller 2001, "Fast 3D triangle-box overlap
//! testing"), in double precision: exact by IEEE 754 on every machine.

use nalgebra::{IsometryMatrix3, Matrix3, Vector3};

use super::{LEAF, Leaf, NONE, Node, TriangleTree, WIDTH};

/// Waiting children: three per level; medians of 2^31 triangles make at most 16 levels.
const WAITING: usize = 64;

/// Boxes about the origin of one frame, each by half its sides [m].
#[derive(Clone, Debug, PartialEq)]
pub struct BoxCluster {
    boxes: Vec<Vector3<f64>>,
    /// The smallest box that contains them all.
    hull: Vector3<f64>,
}

impl BoxCluster {
    /// Boxes by half their sides [m].
    pub fn new(boxes: &[[f64; 3]]) -> Self {
        let boxes: Vec<Vector3<f64>> = boxes.iter().map(|half| Vector3::from(*half)).collect();
        let hull = boxes.iter().fold(Vector3::zeros(), |hull, half| hull.sup(half));
        Self { boxes, hull }
    }

    /// Whether a triangle in the frame of the boxes, which meets their hull, meets one of them.
    fn meets(&self, triangle: &[Vector3<f64>; 3]) -> bool {
        self.boxes.iter().any(|half| *half == self.hull || triangle_meets(triangle, half))
    }
}

/// A box placed in `Object`.
struct Placed {
    /// Rows: the box's axes.
    axes: Matrix3<f64>,
    abs: Matrix3<f64>,
    centre: Vector3<f64>,
    half: Vector3<f64>,
    /// Half the sides of the box around it whose sides are parallel to the axes of `Object` [m].
    around: Vector3<f64>,
}

impl TriangleTree {
    /// Whether a box, given by its pose in `Object` and half its sides [m], meets a triangle. The first hit ends the search.
    /// A box inside of a closed mesh that touches no triangle does not meet it.
    pub fn meets_box(&self, object_from_box: &IsometryMatrix3<f64>, half: &Vector3<f64>) -> bool {
        self.has_in(&Placed::new(object_from_box, half), |_| true)
    }

    /// Whether a triangle meets one of the boxes, whose common frame has this pose in `Object`. Boxes and triangles that only touch
    /// count as one that meets or not, by rounding.
    pub fn meets_boxes(&self, object_from_box: &IsometryMatrix3<f64>, cluster: &BoxCluster) -> bool {
        !cluster.boxes.is_empty()
            && self.has_in(&Placed::new(object_from_box, &cluster.hull), |triangle| cluster.meets(triangle))
    }

    /// Whether one of the triangles that meet a box passes a test, by its corners in the frame of the box.
    fn has_in(&self, placed: &Placed, passes: impl Fn(&[Vector3<f64>; 3]) -> bool) -> bool {
        let (mut waiting, mut depth) = ([NONE; WAITING], 0);
        let mut next = self.root;
        while next != NONE {
            if next & LEAF != 0 {
                if self.leaves[(next & !LEAF) as usize].has_in(placed, &passes) {
                    return true;
                }
            } else {
                let node = &self.nodes[next as usize];
                for lane in (0..WIDTH).filter(|lane| node.children[*lane] != NONE && node.may_meet(*lane, placed)) {
                    waiting[depth] = node.children[lane];
                    depth += 1;
                }
            }
            next = if depth > 0 { waiting[depth - 1] } else { NONE };
            depth = depth.saturating_sub(1);
        }
        false
    }
}

impl Placed {
    fn new(object_from_box: &IsometryMatrix3<f64>, half: &Vector3<f64>) -> Self {
        let axes = object_from_box.rotation.matrix().transpose();
        let abs = axes.abs();
        let centre = object_from_box.translation.vector;
        Self { axes, abs, centre, half: *half, around: abs.tr_mul(half) }
    }
}

impl Node {
    /// Whether a box may meet the box of a child: by the face normals of both.
    fn may_meet(&self, lane: usize, placed: &Placed) -> bool {
        let ends = |sides: &[[f32; WIDTH]; 3]| Vector3::from_fn(|axis, _| f64::from(sides[axis][lane]));
        let (low, high) = (ends(&self.min), ends(&self.max));
        let (middle, half) = ((low + high) / 2.0 - placed.centre, (high - low) / 2.0);
        let apart = |along: &Vector3<f64>, reach: &Vector3<f64>| (0..3).any(|axis| along[axis].abs() > reach[axis]);
        !apart(&middle, &(placed.around + half)) && !apart(&(placed.axes * middle), &(placed.half + placed.abs * half))
    }
}

impl Leaf {
    fn has_in(&self, placed: &Placed, passes: impl Fn(&[Vector3<f64>; 3]) -> bool) -> bool {
        (0..self.count as usize).any(|lane| {
            let corner = |corner: usize| {
                let at = Vector3::from_fn(|axis, _| f64::from(self.corners[corner][axis][lane]));
                placed.axes * (at - placed.centre)
            };
            let triangle = [corner(0), corner(1), corner(2)];
            triangle_meets(&triangle, &placed.half) && passes(&triangle)
        })
    }
}

/// Whether a triangle meets a box about the origin with these half sides.
fn triangle_meets(corners: &[Vector3<f64>; 3], half: &Vector3<f64>) -> bool {
    let is_apart = |[a, b, c]: [f64; 3], reach: f64| a.min(b).min(c) > reach || a.max(b).max(c) < -reach;
    // Faces of the box.
    if (0..3).any(|axis| is_apart(corners.map(|corner| corner[axis]), half[axis])) {
        return false;
    }
    // The triangle's plane.
    let [a, b, c] = corners;
    let edges = [b - a, c - b, a - c];
    let normal = edges[0].cross(&edges[1]);
    if is_apart(corners.map(|corner| normal.dot(&corner)), normal.abs().dot(half)) {
        return false;
    }
    // Cross products of the box's axes with the edges: e_i x edge has no part along i.
    edges.iter().all(|edge| {
        (0..3).all(|axis| {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let reach = half[u] * edge[v].abs() + half[v] * edge[u].abs();
            !is_apart(corners.map(|corner| corner[v] * edge[u] - corner[u] * edge[v]), reach)
        })
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Rotation3, Translation3};

    use super::*;
    use crate::{
        geom::{TriMesh, rotation_from_rpy},
        seed::Stream,
    };

    /// Points of a triangle on a grid that lie in the box, by how far inside [m].
    fn deepest(corners: &[Point3<f64>; 3], placed: &IsometryMatrix3<f64>, half: &Vector3<f64>) -> f64 {
        const STEPS: u32 = 60;
        let [a, b, c] = corners.map(|corner| placed.inverse() * corner);
        let mut deepest = f64::NEG_INFINITY;
        for i in 0..=STEPS {
            for j in 0..=STEPS - i {
                let [u, v] = [i, j].map(|step| f64::from(step) / f64::from(STEPS));
                let at = a + (b - a) * u + (c - a) * v;
                deepest = deepest.max((half - at.coords.abs()).min());
            }
        }
        deepest
    }

    #[test]
    fn boxes_meet_the_triangles_that_have_points_in_them() {
        let mut draw = Stream::of_job(3, b"", "boxes");
        let (mut met, mut clear) = (0, 0);
        for _ in 0..3000 {
            let mut point = || Point3::from([(); 3].map(|()| draw.uniform(-0.1, 0.1)));
            let corners = [point(), point(), point()];
            let rotation =
                Rotation3::from_euler_angles(draw.uniform(-3.0, 3.0), draw.uniform(-1.5, 1.5), draw.uniform(-3.0, 3.0));
            let shift = Vector3::from([(); 3].map(|()| draw.uniform(-0.08, 0.08)));
            let placed = IsometryMatrix3::from_parts(shift.into(), rotation);
            let half = Vector3::from([(); 3].map(|()| draw.uniform(0.002, 0.05)));
            let vertices = corners.map(|corner| corner.coords.map(|value| value as f32).into()).to_vec();
            let tree = TriangleTree::new(&TriMesh { vertices, triangles: vec![[0, 1, 2]] });
            let deepest = deepest(&corners, &placed, &half);
            let meets = tree.meets_box(&placed, &half);
            // A point on the grid in the box: they meet. Far from every point: they do not.
            assert!(meets || deepest < 1e-6, "{deepest}");
            assert!(!meets || deepest > -0.006, "{deepest}");
            if meets { met += 1 } else { clear += 1 }
        }
        assert!(met > 500 && clear > 500, "{met} {clear}");
    }

    #[test]
    fn a_tree_answers_as_its_triangles_do() {
        let mesh = TriMesh::open_box([0.2, 0.16, 0.1], 0.01);
        let tree = TriangleTree::new(&mesh);
        let single = |triangle: &[u32; 3]| {
            TriangleTree::new(&TriMesh { vertices: mesh.vertices.clone(), triangles: vec![*triangle] })
        };
        let singles: Vec<TriangleTree> = mesh.triangles.iter().map(single).collect();
        let mut draw = Stream::of_job(4, b"", "boxes");
        let mut met = 0;
        for _ in 0..2000 {
            let rotation = Rotation3::from_euler_angles(draw.uniform(-3.0, 3.0), draw.uniform(-1.5, 1.5), 0.3);
            let shift = Vector3::from([(); 3].map(|()| draw.uniform(-0.15, 0.15)));
            let placed = IsometryMatrix3::from_parts(shift.into(), rotation);
            let half = Vector3::from([(); 3].map(|()| draw.uniform(0.002, 0.03)));
            let meets = tree.meets_box(&placed, &half);
            assert_eq!(meets, singles.iter().any(|tree| tree.meets_box(&placed, &half)));
            met += usize::from(meets);
        }
        assert!((200..1800).contains(&met), "{met}");
    }

    /// Triangles clipped by the faces of a box (Sutherland and Hodgman 1974) keep a corner where they meet it.
    fn clipped(triangle: &[Vector3<f64>; 3], half: &Vector3<f64>) -> bool {
        let mut polygon = triangle.to_vec();
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let inside = |point: &Vector3<f64>| half[axis] - sign * point[axis];
                let mut kept = Vec::new();
                for (index, point) in polygon.iter().enumerate() {
                    let next = &polygon[(index + 1) % polygon.len()];
                    let (here, there) = (inside(point), inside(next));
                    if here >= 0.0 {
                        kept.push(*point);
                    }
                    if here * there < 0.0 {
                        kept.push(point + (next - point) * (here / (here - there)));
                    }
                }
                polygon = kept;
            }
        }
        !polygon.is_empty()
    }

    fn vector(stream: &mut Stream, low: f64, high: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| stream.uniform(low, high))
    }

    #[test]
    fn a_triangle_meets_a_box_where_clipping_leaves_a_part_of_it() {
        let mut stream = Stream::of_job(1, b"", "boxes");
        let mut met = 0;
        for _ in 0..4000 {
            let triangle = [(); 3].map(|()| vector(&mut stream, -2.0, 2.0));
            let half = vector(&mut stream, 0.1, 1.0);
            let meets = triangle_meets(&triangle, &half);
            assert_eq!(meets, clipped(&triangle, &half), "{triangle:?} {half:?}");
            met += u32::from(meets);
        }
        assert!((500..3500).contains(&met), "{met}");
    }

    #[test]
    fn a_cluster_meets_what_one_of_its_boxes_meets() {
        let mut stream = Stream::of_job(2, b"", "boxes");
        let mut met = 0;
        for _ in 0..400 {
            let count = 1 + stream.below(40) as u32;
            let mut vertices: Vec<[f32; 3]> = Vec::new();
            for _ in 0..count {
                let first = vector(&mut stream, -1.0, 1.0);
                let edges = [(); 2].map(|()| vector(&mut stream, -0.2, 0.2));
                vertices.extend(
                    [first, first + edges[0], first + edges[1]].map(|at| -> [f32; 3] { at.map(|x| x as f32).into() }),
                );
            }
            let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            let mesh = TriMesh { vertices, triangles };
            let [roll, pitch, yaw] = [(); 3].map(|()| stream.uniform(-3.0, 3.0));
            let at = vector(&mut stream, -0.7, 0.7);
            let pose = IsometryMatrix3::from_parts(Translation3::from(at), rotation_from_rpy(roll, pitch, yaw));
            let sides: Vec<[f64; 3]> =
                (0..1 + stream.below(3)).map(|_| vector(&mut stream, 0.01, 0.4).into()).collect();
            let any = mesh.triangles.iter().any(|triangle| {
                let placed = triangle.map(|vertex| {
                    let point = Vector3::from(mesh.vertices[vertex as usize].map(f64::from));
                    pose.rotation.inverse() * (point - at)
                });
                sides.iter().any(|half| triangle_meets(&placed, &Vector3::from(*half)))
            });
            assert_eq!(TriangleTree::new(&mesh).meets_boxes(&pose, &BoxCluster::new(&sides)), any);
            met += u32::from(any);
        }
        assert!((50..350).contains(&met), "{met}");
    }
}
