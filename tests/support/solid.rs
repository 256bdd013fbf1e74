//! Closed solids of polygons, swept, lathed, subdivided, or cut out of space by an implicit function.

use std::collections::HashMap;

use graspmill::geom::TriMesh;
use nalgebra::{Isometry3, Point3, Vector3};

pub type P3 = Point3<f64>;

/// A closed surface of plane or nearly plane polygons, wound outward.
#[derive(Clone, Debug, Default)]
pub struct Solid {
    pub points: Vec<P3>,
    pub faces: Vec<Vec<u32>>,
}

/// Shape of the ends of a sweep.
#[derive(Clone, Copy)]
pub enum Ends {
    /// Faces of as many corners as the ring has.
    Polygons,
    /// Triangles round the middle of the ring.
    Fans,
    /// The last ring meets the first one, shifted by this many points.
    Meet(usize),
}

impl Solid {
    /// Volume by the divergence theorem, polygons as fans [m^3].
    pub fn volume(&self) -> f64 {
        let at = |corner: u32| self.points[corner as usize].coords;
        let of_face = |face: &Vec<u32>| -> f64 {
            (1..face.len() - 1).map(|i| at(face[0]).dot(&at(face[i]).cross(&at(face[i + 1])))).sum()
        };
        self.faces.iter().map(of_face).sum::<f64>() / 6.0
    }

    /// In triangles, polygons as fans.
    pub fn mesh(&self) -> TriMesh {
        let fan = |face: &Vec<u32>| (1..face.len() - 1).map(|i| [face[0], face[i], face[i + 1]]).collect::<Vec<_>>();
        TriMesh {
            vertices: self.points.iter().map(|point| [point.x, point.y, point.z].map(|value| value as f32)).collect(),
            triangles: self.faces.iter().flat_map(fan).collect(),
        }
    }

    pub fn reversed(mut self) -> Self {
        self.faces.iter_mut().for_each(|face| face.reverse());
        self
    }

    /// Wound outward, whichever way it was.
    fn outward(self) -> Self {
        if self.volume() < 0.0 { self.reversed() } else { self }
    }

    pub fn scaled(mut self, factor: f64) -> Self {
        self.points.iter_mut().for_each(|point| *point *= factor);
        self
    }

    pub fn moved(mut self, by: &Isometry3<f64>) -> Self {
        self.points.iter_mut().for_each(|point| *point = by * *point);
        self
    }

    pub fn shifted(self, by: [f64; 3]) -> Self {
        self.moved(&Isometry3::translation(by[0], by[1], by[2]))
    }

    /// All parts as one mesh; none is merged with another.
    pub fn join(parts: impl IntoIterator<Item = Self>) -> Self {
        let mut all = Self::default();
        for part in parts {
            let first = all.points.len() as u32;
            all.points.extend(part.points);
            all.faces
                .extend(part.faces.into_iter().map(|face| face.into_iter().map(|c| c + first).collect::<Vec<_>>()));
        }
        all
    }

    /// Rings of points joined by quadrangles; a ring of one point is a tip.
    pub fn sweep(rings: &[Vec<P3>], ends: Ends) -> Self {
        let mut solid = Self::default();
        let starts: Vec<u32> = rings
            .iter()
            .map(|ring| {
                solid.points.extend(ring);
                (solid.points.len() - ring.len()) as u32
            })
            .collect();
        let mut band = |one: usize, other: usize, shift: usize| {
            let count = rings[one].len().max(rings[other].len());
            let vertex = |ring: usize, step: usize| starts[ring] + (step % rings[ring].len()) as u32;
            for step in 0..count {
                let (a, b) = (vertex(one, step), vertex(one, step + 1));
                let (c, d) = (vertex(other, step + shift + 1), vertex(other, step + shift));
                let mut face = vec![a, b, c, d];
                face.dedup();
                if face.first() == face.last() {
                    face.pop();
                }
                solid.faces.push(face);
            }
        };
        (1..rings.len()).for_each(|ring| band(ring - 1, ring, 0));
        if let Ends::Meet(shift) = ends {
            band(rings.len() - 1, 0, shift);
        } else {
            solid.close(rings, &starts, matches!(ends, Ends::Fans));
        }
        solid.outward()
    }

    /// Faces at both ends of a sweep.
    fn close(&mut self, rings: &[Vec<P3>], starts: &[u32], with_fans: bool) {
        let last = rings.len() - 1;
        for (ring, is_first) in [(0, true), (last, false)].into_iter().filter(|(ring, _)| rings[*ring].len() > 1) {
            let corners: Vec<u32> = (0..rings[ring].len() as u32).map(|step| starts[ring] + step).collect();
            let mut add = |mut face: Vec<u32>| {
                if is_first {
                    face.reverse();
                }
                self.faces.push(face);
            };
            if !with_fans {
                add(corners);
                continue;
            }
            let sum: Vector3<f64> = rings[ring].iter().map(|point| point.coords).sum();
            let middle = self.points.len() as u32;
            (0..corners.len()).for_each(|i| add(vec![corners[i], corners[(i + 1) % corners.len()], middle]));
            self.points.push(P3::from(sum / corners.len() as f64));
        }
    }

    /// A profile of radii and heights, turned round z; it starts and ends on the axis, or has flat ends.
    pub fn lathe(profile: &[[f64; 2]], steps: usize, ends: Ends) -> Self {
        let ring = |&[radius, height]: &[f64; 2]| match radius {
            0.0 => vec![P3::new(0.0, 0.0, height)],
            radius => circle(steps).map(|[x, y]| P3::new(radius * x, radius * y, height)).collect(),
        };
        Self::sweep(&profile.iter().map(ring).collect::<Vec<_>>(), ends)
    }

    /// An icosahedron of radius 1, its faces split into four so often, projected on the ball.
    pub fn icosphere(splits: u32) -> Self {
        let golden = f64::midpoint(1.0, 5f64.sqrt());
        let mut points = Vec::new();
        for [a, b] in [[1.0, golden], [-1.0, golden], [1.0, -golden], [-1.0, -golden]] {
            points.extend([P3::new(0.0, a, b), P3::new(a, b, 0.0), P3::new(b, 0.0, a)]);
        }
        // Faces are all triples of corners that are an edge apart.
        let near = |a: usize, b: usize| ((points[a] - points[b]).norm() - 2.0).abs() < 1e-9;
        let mut faces = Vec::new();
        for a in 0..12 {
            for b in a + 1..12 {
                for c in (b + 1..12).filter(|&c| near(a, b) && near(b, c) && near(a, c)) {
                    let is_outward = points[a].coords.dot(&points[b].coords.cross(&points[c].coords)) > 0.0;
                    faces.push(if is_outward { [a, b, c] } else { [a, c, b] }.map(|corner| corner as u32));
                }
            }
        }
        for _ in 0..splits {
            let mut middles = HashMap::new();
            let mut middle = |a: u32, b: u32, points: &mut Vec<P3>| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    points.push(nalgebra::center(&points[a as usize], &points[b as usize]));
                    points.len() as u32 - 1
                })
            };
            let split = |[a, b, c]: [u32; 3]| {
                let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[one, other]| middle(one, other, &mut points));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            };
            faces = faces.into_iter().flat_map(split).collect();
        }
        points.iter_mut().for_each(|point| *point = P3::from(point.coords.normalize()));
        Self { points, faces: faces.into_iter().map(Vec::from).collect() }
    }

    /// The body where `inside` is negative, within the cube of half side 1, on a lattice of `cells` cells along each
    /// side: marching tetrahedra, six in each cell (Doi and Koide 1991).
    pub fn implicit(cells: usize, inside: impl Fn(&P3) -> f64) -> Self {
        let along = |index: usize| (2.0 * index as f64 / cells as f64 - 1.0) * 1.000_37;
        let place = |[x, y, z]: [usize; 3]| P3::new(along(x), along(y), along(z));
        let index = |[x, y, z]: [usize; 3]| (x * (cells + 1) + y) * (cells + 1) + z;
        let all = (0..=cells).flat_map(|x| (0..=cells).flat_map(move |y| (0..=cells).map(move |z| [x, y, z])));
        // What reaches the lattice's end is cut off there.
        let is_rim = |at: [usize; 3]| at.iter().any(|&along| along == 0 || along == cells);
        let values: Vec<f64> = all.map(|at| if is_rim(at) { 1.0 } else { inside(&place(at)) }).collect();
        let mut made = Crossings { values: &values, solid: Self::default(), known: HashMap::new() };
        for x in 0..cells {
            for y in 0..cells {
                for z in 0..cells {
                    for [first, second] in [[0, 1], [0, 2], [1, 0], [1, 2], [2, 0], [2, 1]] {
                        // From the lowest corner to the highest, one axis after another.
                        let mut at = [x, y, z];
                        let mut corners = [(index(at), place(at)); 4];
                        for (step, axis) in [first, second, 3 - first - second].into_iter().enumerate() {
                            at[axis] += 1;
                            corners[step + 1] = (index(at), place(at));
                        }
                        made.cut(corners);
                    }
                }
            }
        }
        made.solid
    }
}

/// Points where a function changes its sign along the edges of tetrahedra, and the surface through them.
struct Crossings<'a> {
    values: &'a [f64],
    solid: Solid,
    known: HashMap<(usize, usize), u32>,
}

type Corner = (usize, P3);

impl Crossings<'_> {
    /// The surface in one tetrahedron.
    fn cut(&mut self, corners: [Corner; 4]) {
        let (inside, outside): (Vec<Corner>, Vec<Corner>) =
            corners.into_iter().partition(|(index, _)| self.values[*index] < 0.0);
        let edges: Vec<[Corner; 2]> = match (&inside[..], &outside[..]) {
            ([a], [b, c, d]) => vec![[*a, *b], [*a, *c], [*a, *d]],
            ([b, c, d], [a]) => vec![[*b, *a], [*c, *a], [*d, *a]],
            ([a, b], [c, d]) => vec![[*a, *c], [*a, *d], [*b, *d], [*b, *c]],
            _ => return,
        };
        // Which way it faces shows with every crossing in the middle of its edge.
        let middle = |edge: usize| nalgebra::center(&edges[edge][0].1, &edges[edge][1].1);
        let normal = (middle(1) - middle(0)).cross(&(middle(2) - middle(0)));
        let mut face: Vec<u32> = edges.iter().map(|&[from, to]| self.crossing(from, to)).collect();
        if normal.dot(&(inside[0].1 - middle(0))) > 0.0 {
            face.reverse();
        }
        self.solid.faces.push(face);
    }

    fn crossing(&mut self, (one, at): Corner, (other, to): Corner) -> u32 {
        let Self { values, solid, known } = self;
        let share = values[one] / (values[one] - values[other]);
        *known.entry((one.min(other), one.max(other))).or_insert_with(|| {
            // No sliver at a corner of the lattice.
            solid.points.push(at + (to - at) * share.clamp(0.05, 0.95));
            solid.points.len() as u32 - 1
        })
    }
}

/// Points of the unit circle.
pub fn circle(steps: usize) -> impl Iterator<Item = [f64; 2]> {
    let angle = move |step: usize| std::f64::consts::TAU * step as f64 / steps as f64;
    (0..steps).map(move |step| [angle(step).cos(), angle(step).sin()])
}
