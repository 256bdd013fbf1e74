//! Which thin-walled bodies have one surface: their solids, a wall apart, share next to nothing.
//!
//! A skin is a cloud of points with normals on the surface, along the body's principal axes and scaled to its own root mean
//! square radius. Two skins are laid on each other from every orientation that their axes leave open, brought together by
//! iterative closest points with distances to planes (Chen and Medioni 1992), and their mean distance is taken.

use nalgebra::{Matrix3, Matrix6, Rotation3, Unit, Vector3, Vector6};

use crate::geom::TriMesh;

type V3 = Vector3<f64>;

/// Thickness of the walls, twice the volume over the surface, below which a body has a skin, over its radius.
const THIN: f64 = 0.15;

/// Points of a skin, those that are laid on another one, and those that choose from where.
const POINTS: usize = 4096;
const COMPARED: usize = 512;
const CHOOSING: usize = 64;

/// Angles about an axis that is free to rotate, orientations that are followed, and rounds in which each settles.
const ANGLES: u32 = 24;
const FOLLOWED: usize = 4;
const ROUNDS: u32 = 10;

/// Distances are cut off at this value [radii].
const FAR: f64 = 0.4;

/// Deviations nearer than this ratio leave the axes free.
const ROUND: f64 = 1.12;

/// Radii of two scans of one thing differ by less than this share.
const SAME_SIZE: f64 = 0.025;

/// Difference between two skins that are one, at most.
#[derive(Clone, Copy)]
struct Tolerance {
    /// Mean distance [radii].
    distance: f64,
    /// Largest difference of deviations along an axis [radii]; other skins are not compared.
    deviation: f64,
}

/// Between bodies of the same size, whose surfaces noise may have moved. Noise of 1 mm makes 0.017 of a mug; no other two of the
/// 78 YCB scans that have one size are nearer than 0.08.
const NOISY: Tolerance = Tolerance { distance: 0.03, deviation: 0.04 };

/// Between others, where only pose and scale may differ. Two cups of a nest, each a size larger, are 0.014 apart.
const EQUAL: Tolerance = Tolerance { distance: 0.003, deviation: 0.01 };

/// Cells of the index along each axis.
const CELLS: usize = 24;

/// The surface of a thin-walled body. About 100 KiB.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Skin {
    /// Root mean square distance of the surface from its middle [m].
    radius: f64,
    /// Root mean squares along the axes, in radii.
    deviations: [f64; 3],
    /// In radii, from the body's centre, in the order of the index's cells.
    points: Vec<[f32; 3]>,
    /// Unit normals of `points`.
    normals: Vec<[f32; 3]>,
    /// Distance between neighbours [radii].
    spacing: f64,
    /// The index: its corner, the side of a cell, and where the points of each cell begin.
    corner: V3,
    cell: f64,
    begins: Vec<u32>,
}

/// A surface as triangles with their areas.
struct Sheet<'a> {
    triangles: &'a [[V3; 3]],
    area: f64,
}

impl Skin {
    /// The skin of a body of a volume about a centre and axes, in units of its triangles; `None` where its walls are not thin.
    /// `mesh` is the same body in metres.
    pub(super) fn of(
        mesh: &TriMesh,
        triangles: &[[V3; 3]],
        volume: f64,
        centre: &V3,
        axes: &Matrix3<f64>,
    ) -> Option<Self> {
        let sheet = Sheet { triangles, area: triangles.iter().map(area).sum() };
        let sampled = sheet.sampled();
        let local: Vec<V3> = sampled.iter().map(|(point, _)| axes.transpose() * (point - centre)).collect();
        let mean_square = local.iter().map(V3::norm_squared).sum::<f64>() / local.len().max(1) as f64;
        let radius = mean_square.sqrt();
        let thin = 2.0 * volume / sheet.area < THIN * radius;
        if !thin || !radius.is_finite() || local.len() < POINTS {
            return None;
        }
        let points: Vec<V3> = local.iter().map(|point| point / radius).collect();
        let deviations = std::array::from_fn(|axis| {
            (points.iter().map(|point| point[axis] * point[axis]).sum::<f64>() / points.len() as f64).sqrt()
        });
        let normals: Vec<V3> = sampled.iter().map(|(_, normal)| axes.transpose() * normal).collect();
        let spacing = (sheet.area / POINTS as f64).sqrt() / radius;
        Some(Self::indexed(radius_of(mesh), deviations, &points, &normals, spacing))
    }

    fn indexed(radius: f64, deviations: [f64; 3], points: &[V3], normals: &[V3], spacing: f64) -> Self {
        let low = points.iter().fold(points[0], |low, point| low.inf(point));
        let high = points.iter().fold(points[0], |high, point| high.sup(point));
        let cell = ((high - low).max() / CELLS as f64 * 1.001).max(1e-6);
        let mut skin = Self {
            radius,
            deviations,
            points: Vec::new(),
            normals: Vec::new(),
            spacing,
            corner: low,
            cell,
            begins: Vec::new(),
        };
        let mut order: Vec<(usize, usize)> =
            points.iter().enumerate().map(|(index, point)| (skin.cell_at(skin.cell_of(point)), index)).collect();
        order.sort_unstable();
        let single = |vector: &V3| -> [f32; 3] { vector.map(|part| part as f32).into() };
        skin.points = order.iter().map(|(_, index)| single(&points[*index])).collect();
        skin.normals = order.iter().map(|(_, index)| single(&normals[*index])).collect();
        let below = |cell: usize| order.partition_point(|(of, _)| *of < cell) as u32;
        skin.begins = (0..=CELLS * CELLS * CELLS).map(below).collect();
        skin
    }

    /// Whether two bodies have one surface: the same size but for noise, or any size without.
    pub(super) fn is_one_with(&self, other: &Self) -> bool {
        let same_size = (self.radius / other.radius).max(other.radius / self.radius) < 1.0 + SAME_SIZE;
        let tolerance = if same_size { NOISY } else { EQUAL };
        self.distance(other, tolerance) < tolerance.distance
    }

    /// Mean distance between two skins laid on each other [radii], or the first within the tolerance.
    fn distance(&self, other: &Self, tolerance: Tolerance) -> f64 {
        let unlike = |(a, b): (&f64, &f64)| (a - b).abs() > tolerance.deviation;
        if self.deviations.iter().zip(&other.deviations).any(unlike) {
            return FAR;
        }
        // Orientations by how few points of one lie how far from the other.
        let few = self.some(CHOOSING);
        let mut starts: Vec<(f64, Rotation3<f64>)> = self
            .orientations(other)
            .into_iter()
            .map(|turn| (other.mean_distance(&few, &turn, &V3::zeros()), turn))
            .collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (ours, theirs) = (self.some(COMPARED), other.some(COMPARED));
        let mut best = FAR;
        for (_, turn) in starts.into_iter().take(FOLLOWED) {
            let (turn, shift) = other.settle(&ours, turn);
            let back = turn.inverse();
            let apart =
                other.mean_distance(&ours, &turn, &shift).max(self.mean_distance(&theirs, &back, &-(back * shift)));
            best = best.min(apart);
            if best < tolerance.distance {
                break;
            }
        }
        best
    }

    /// `count` points, evenly spaced in the list.
    fn some(&self, count: usize) -> Vec<V3> {
        self.points.iter().step_by(POINTS / count).map(|point| V3::from(point.map(f64::from))).collect()
    }

    /// The rotations that the axes of both leave open: half turns, and any turn about an axis between two that are alike.
    fn orientations(&self, other: &Self) -> Vec<Rotation3<f64>> {
        let half = |axis: Vector3<f64>| Rotation3::from_matrix_unchecked(Matrix3::from_diagonal(&axis));
        let halves = [
            Rotation3::identity(),
            half(V3::new(1.0, -1.0, -1.0)),
            half(V3::new(-1.0, 1.0, -1.0)),
            half(V3::new(-1.0, -1.0, 1.0)),
        ];
        let is_round = |of: &Self, [a, b]: [usize; 2]| of.deviations[a] < ROUND * of.deviations[b];
        let mut turns = halves.to_vec();
        for (axes, axis) in [([0, 1], V3::z_axis()), ([1, 2], V3::x_axis())] {
            if is_round(self, axes) || is_round(other, axes) {
                let angle = |step: u32| f64::from(step) / f64::from(ANGLES) * std::f64::consts::TAU;
                let turn = |step| Rotation3::from_matrix_unchecked(turn_about(&axis, angle(step)));
                turns.extend((1..ANGLES).flat_map(|step| halves.map(|half| turn(step) * half)));
            }
        }
        turns
    }

    /// Brings points nearer to this skin from a rotation on: the rotation and the shift in the end.
    fn settle(&self, points: &[V3], mut turn: Rotation3<f64>) -> (Rotation3<f64>, V3) {
        let mut shift = V3::zeros();
        for _ in 0..ROUNDS {
            let (mut left, mut right) = (Matrix6::zeros(), Vector6::zeros());
            for point in points {
                let at = turn * point + shift;
                let Some(nearest) = self.nearest(&at) else { continue };
                let [near, normal] =
                    [self.points[nearest], self.normals[nearest]].map(|part| V3::from(part.map(f64::from)));
                let (arm, off) = (at.cross(&normal), normal.dot(&(at - near)));
                let row = Vector6::new(arm.x, arm.y, arm.z, normal.x, normal.y, normal.z);
                left += row * row.transpose();
                right -= row * off;
            }
            // Rotations that leave a body of revolution unchanged keep their value.
            left += Matrix6::identity() * (1e-6 * left.trace().max(1e-12));
            let Some(step) = left.cholesky().map(|factors| factors.solve(&right)) else { break };
            let [about, along] = [V3::new(step[0], step[1], step[2]), V3::new(step[3], step[4], step[5])];
            let angle = about.norm();
            if angle > 0.0 {
                let axis = Unit::new_unchecked(about / angle);
                let more = Rotation3::from_matrix_unchecked(turn_about(&axis, angle.min(0.2)));
                (turn, shift) = (more * turn, more * shift);
            }
            shift += along;
        }
        (turn, shift)
    }

    /// Mean distance of points, turned and shifted, from this skin; [`FAR`] at most.
    fn mean_distance(&self, points: &[V3], turn: &Rotation3<f64>, shift: &V3) -> f64 {
        let sum: f64 = points.iter().map(|point| self.distance_to(&(turn * point + shift))).sum();
        sum / points.len() as f64
    }

    /// Distance of a point from the plane through the nearest one, and along it from where its neighbours would be.
    fn distance_to(&self, point: &V3) -> f64 {
        let Some(nearest) = self.nearest(point) else { return FAR };
        let [near, normal] = [self.points[nearest], self.normals[nearest]].map(|part| V3::from(part.map(f64::from)));
        let off = normal.dot(&(point - near));
        let aside = ((point - near) - normal * off).norm();
        let beyond = (aside - 2.0 * self.spacing).max(0.0);
        (off * off + beyond * beyond).sqrt().min(FAR)
    }

    /// The point nearest to one, where any is nearer than [`FAR`].
    fn nearest(&self, point: &V3) -> Option<usize> {
        let middle = self.cell_of(point);
        let (mut best, mut found) = (FAR * FAR, None);
        for ring in 0..=(FAR / self.cell).ceil() as i32 {
            // Cells of the ring are so far at least.
            let least = f64::from((ring - 1).max(0)) * self.cell;
            if least * least > best {
                break;
            }
            self.for_each_in_ring(middle, ring, |index| {
                let apart = (V3::from(self.points[index].map(f64::from)) - point).norm_squared();
                if apart < best {
                    (best, found) = (apart, Some(index));
                }
            });
        }
        found
    }

    fn for_each_in_ring(&self, middle: [i32; 3], ring: i32, mut see: impl FnMut(usize)) {
        let sides = middle.map(|at| (at - ring).max(0)..=(at + ring).min(CELLS as i32 - 1));
        for x in sides[0].clone() {
            for y in sides[1].clone() {
                let on_side = (x - middle[0]).abs() == ring || (y - middle[1]).abs() == ring;
                for z in sides[2].clone() {
                    if on_side || (z - middle[2]).abs() == ring {
                        let cell = self.cell_at([x, y, z]);
                        (self.begins[cell]..self.begins[cell + 1]).for_each(|index| see(index as usize));
                    }
                }
            }
        }
    }

    fn cell_of(&self, point: &V3) -> [i32; 3] {
        ((point - self.corner) / self.cell).map(|part| part.floor().clamp(-1e6, 1e6) as i32).into()
    }

    /// Index of a cell; points on the far sides belong to the last.
    fn cell_at(&self, cell: [i32; 3]) -> usize {
        let [x, y, z] = cell.map(|at| at.clamp(0, CELLS as i32 - 1) as usize);
        (x * CELLS + y) * CELLS + z
    }
}

impl Sheet<'_> {
    /// Points spread evenly over the area, each with the normal of its triangle: in the order of triangles, in each by the additive
    /// sequence of the plastic number (Roberts 2018).
    fn sampled(&self) -> Vec<(V3, V3)> {
        const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
        let (mut sampled, mut before) = (Vec::with_capacity(POINTS), 0.0);
        for triangle in self.triangles {
            let until = before + area(triangle);
            while sampled.len() < POINTS && (sampled.len() as f64 + 0.5) * self.area / (POINTS as f64) < until {
                let [u, v] = STEPS.map(|step| (0.5 + step * sampled.len() as f64).fract());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let [a, b, c] = triangle;
                let normal = (b - a).cross(&(c - a)).normalize();
                sampled.push((a + (b - a) * u + (c - a) * v, normal));
            }
            before = until;
        }
        sampled
    }
}

fn area(triangle: &[V3; 3]) -> f64 {
    let [a, b, c] = triangle;
    (b - a).cross(&(c - a)).norm() / 2.0
}

/// Root mean square distance of a mesh's surface from its middle, by the middles of its triangles [m].
fn radius_of(mesh: &TriMesh) -> f64 {
    let corners = |triangle: &[u32; 3]| triangle.map(|vertex| V3::from(mesh.vertices[vertex as usize].map(f64::from)));
    let (mut total, mut first, mut second) = (0.0, V3::zeros(), 0.0);
    for triangle in mesh.triangles.iter().map(corners) {
        let (area, middle) = (area(&triangle), triangle.iter().sum::<V3>() / 3.0);
        total += area;
        first += middle * area;
        second += middle.norm_squared() * area;
    }
    (second / total - (first / total).norm_squared()).max(0.0).sqrt()
}

/// Rotation about an axis (Rodrigues), with functions that are the same on every machine.
fn turn_about(axis: &Unit<V3>, angle: f64) -> Matrix3<f64> {
    let (sine, cosine) = libm::sincos(angle);
    let cross = axis.cross_matrix();
    Matrix3::identity() + cross * sine + cross * cross * (1.0 - cosine)
}
