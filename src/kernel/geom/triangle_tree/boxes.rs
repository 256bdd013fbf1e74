//! Whether a box meets a triangle of a tree: yes or no, without a distance.
//!
//! Separating axes (Gottschalk, Lin and Manocha 1996; of a triangle Akenine-Moeller 2001, "Fast 3D triangle-box overlap
//! testing"), in double precision: exact by IEEE 754 on every machine.

use nalgebra::{IsometryMatrix3, Matrix3, Vector3};

use super::{LEAF, Leaf, NONE, Node, TriangleTree, WIDTH};

/// Waiting children: three per level; medians of 2^31 triangles make at most 16 levels.
const WAITING: usize = 64;

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
        let placed = Placed::new(object_from_box, half);
        let (mut waiting, mut depth) = ([NONE; WAITING], 0);
        let mut next = self.root;
        while next != NONE {
            if next & LEAF != 0 {
                if self.leaves[(next & !LEAF) as usize].meets(&placed) {
                    return true;
                }
            } else {
                let node = &self.nodes[next as usize];
                for lane in (0..WIDTH).filter(|lane| node.children[*lane] != NONE && node.may_meet(*lane, &placed)) {
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
    fn meets(&self, placed: &Placed) -> bool {
        (0..self.count as usize).any(|lane| {
            let corner = |corner: usize| {
                let at = Vector3::from_fn(|axis, _| f64::from(self.corners[corner][axis][lane]));
                placed.axes * (at - placed.centre)
            };
            triangle_meets(&[corner(0), corner(1), corner(2)], &placed.half)
        })
    }
}

/// Whether a triangle meets a box around the origin.
fn triangle_meets(corners: &[Vector3<f64>; 3], half: &Vector3<f64>) -> bool {
    let apart = |axis: &Vector3<f64>| {
        let [a, b, c] = corners.each_ref().map(|corner| axis.dot(corner));
        let reach = axis.abs().dot(half);
        a.min(b).min(c) > reach || a.max(b).max(c) < -reach
    };
    let [a, b, c] = corners;
    let edges = [b - a, c - b, a - c];
    // The box's faces, the triangle's own plane, and the products of the edges of both.
    let faces = [Vector3::x(), Vector3::y(), Vector3::z()];
    !(faces.iter().any(apart)
        || apart(&edges[0].cross(&edges[1]))
        || edges.iter().any(|edge| faces.iter().any(|face| apart(&face.cross(edge)))))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Rotation3};

    use super::*;
    use crate::{geom::TriMesh, seed::Stream};

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
}
