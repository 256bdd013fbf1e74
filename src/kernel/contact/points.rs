//! Points of a surface in a tree of balls.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::ContactSurface;
use crate::geom::TriMesh;

/// Side of a cell; each cell keeps one point of the surface [m].
pub const POINT_CELL: f64 = 0.0025;

/// Points of a leaf, at most.
const LEAF: usize = 6;

/// Sharpness from which an edge or a vertex counts as sharp: 1 minus the length of the mean of the unit normals around
/// it. Two faces at an angle of 16 degrees have it.
const SHARP: f64 = 0.01;

/// Part of a surface that is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampled {
    /// Faces, edges and vertices.
    Everywhere,
    /// Edges and vertices that stick out: enough of a body with large flat faces, which others touch with points of theirs.
    Edges,
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfacePoint {
    /// In `Object` [m].
    pub(super) point: Point3<f64>,
    /// Out of the mesh: a unit vector, the mean of the faces around an edge or a vertex.
    pub(super) normal: Vector3<f64>,
    /// Whether it is of an edge or a vertex that sticks out.
    pub(super) is_sharp: bool,
}

/// Points of a surface, one per cell of [`POINT_CELL`] and the corners of its hull, in a binary tree of balls. Each
/// cell keeps the point that sticks out most: a vertex or an edge before a face. All corners of the hull are kept: the
/// point of a body that is deepest in a flat wall is one of them, and scans have several vertices in a cell. Of class
/// `exact`.
pub(super) struct SurfacePoints {
    points: Vec<SurfacePoint>,
    balls: Vec<Ball>,
}

/// A ball around some of the points.
struct Ball {
    centre: Point3<f64>,
    radius: f64,
    /// Indices of its points.
    first: u32,
    count: u32,
    /// Index of its second child; the first is the next ball. `None` for a leaf.
    second: Option<u32>,
}

/// Searches in progress, reused.
pub(super) type Waiting = Vec<u32>;

impl SurfacePoints {
    /// Points of a mesh whose hull has its corners at some of the vertices, in rising order.
    pub(super) fn new(mesh: &TriMesh, hull: &[u32], sampled: Sampled) -> Self {
        let mut cells = Cells::default();
        let faces = Faces::of(mesh);
        faces.add_vertices(mesh, hull, &mut cells);
        faces.add_edges(mesh, &mut cells);
        match sampled {
            Sampled::Everywhere => faces.add_faces(mesh, &mut cells),
            Sampled::Edges => cells.best.retain(|_, (sharpness, _)| *sharpness >= SHARP),
        }
        let mut points = cells.into_points();
        let mut balls = Vec::new();
        if !points.is_empty() {
            add_balls(&mut points, 0, &mut balls);
        }
        Self { points, balls }
    }

    /// Number of points.
    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    pub(super) fn get(&self, index: u32) -> &SurfacePoint {
        &self.points[index as usize]
    }

    /// Reports to `found` the points whose lower bound of the distance to another surface is at most `reach` [m], with where
    /// they are in the other's frame and that bound. Returns a lower bound of the distance of all others [m].
    pub(super) fn near(
        &self,
        other: &ContactSurface,
        other_from_own: &IsometryMatrix3<f64>,
        reach: f64,
        waiting: &mut Waiting,
        mut found: impl FnMut(u32, Point3<f64>, f64),
    ) -> f64 {
        let mut farther = f64::INFINITY;
        waiting.clear();
        waiting.extend(self.balls.first().map(|_| 0));
        while let Some(index) = waiting.pop() {
            let ball = &self.balls[index as usize];
            let clear = other.at_least(&(other_from_own * ball.centre)) - ball.radius;
            if clear > reach {
                farther = farther.min(clear);
                continue;
            }
            if let Some(second) = ball.second {
                waiting.extend([second, index + 1]);
                continue;
            }
            for index in ball.first..ball.first + ball.count {
                let point = other_from_own * self.points[index as usize].point;
                let bound = other.at_least(&point);
                if bound > reach {
                    farther = farther.min(bound);
                } else {
                    found(index, point, bound);
                }
            }
        }
        farther
    }
}

/// Builds the balls of some points, whose first has the index `first`, and orders the points by their leaves.
fn add_balls(points: &mut [SurfacePoint], first: usize, balls: &mut Vec<Ball>) {
    let (mut low, mut high) = (points[0].point, points[0].point);
    for SurfacePoint { point, .. } in &*points {
        low = low.inf(point);
        high = high.sup(point);
    }
    let centre = low + (high - low) / 2.0;
    let radius = points.iter().map(|each| (each.point - centre).norm_squared()).fold(0.0, f64::max).sqrt();
    let own = balls.len();
    balls.push(Ball { centre, radius, first: first as u32, count: points.len() as u32, second: None });
    if points.len() > LEAF {
        let axis = (high - low).imax();
        let middle = points.len() / 2;
        // Points of different cells differ; where one coordinate is equal the others decide.
        points.select_nth_unstable_by(middle, |one, other| {
            let order = |axis: usize| one.point[axis].total_cmp(&other.point[axis]);
            order(axis).then(order((axis + 1) % 3)).then(order((axis + 2) % 3))
        });
        let (left, right) = points.split_at_mut(middle);
        add_balls(left, first, balls);
        balls[own].second = Some(balls.len() as u32);
        add_balls(right, first + middle, balls);
    }
}

/// Points that are kept.
#[derive(Default)]
struct Cells {
    /// The point of each cell that sticks out most, and by how much.
    best: BTreeMap<[i32; 3], (f64, SurfacePoint)>,
    /// Corners of the hull.
    corners: Vec<SurfacePoint>,
}

impl Cells {
    /// Each point once.
    fn into_points(self) -> Vec<SurfacePoint> {
        let bits = |each: &SurfacePoint| [0, 1, 2].map(|axis| each.point[axis].to_bits());
        let mut points: Vec<SurfacePoint> = self.best.into_values().map(|(_, point)| point).collect();
        let mut kept: BTreeSet<[u64; 3]> = points.iter().map(bits).collect();
        points.extend(self.corners.into_iter().filter(|corner| kept.insert(bits(corner))));
        points
    }

    /// Adds a point unless its outside is unknown.
    fn add(&mut self, point: Point3<f64>, normal: Vector3<f64>, sharpness: f64) -> Option<SurfacePoint> {
        let normal = normal.try_normalize(0.0)?;
        let point = SurfacePoint { point, normal, is_sharp: sharpness >= SHARP };
        let cell = [0, 1, 2].map(|axis| (point.point[axis] / POINT_CELL).floor() as i32);
        let best = self.best.entry(cell).or_insert((sharpness, point));
        if sharpness > best.0 {
            *best = (sharpness, point);
        }
        Some(point)
    }
}

/// Unit normals of the faces, and what meets at each edge and vertex.
struct Faces {
    /// Zero for a face without area.
    normals: Vec<Vector3<f64>>,
    /// Edges by their vertices, in rising order: the faces on both sides, by index.
    edges: BTreeMap<[u32; 2], Vec<u32>>,
}

impl Faces {
    fn of(mesh: &TriMesh) -> Self {
        let normal = |face: usize| {
            let [a, b, c] = mesh.corners(face);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vector3::zeros)
        };
        let normals = (0..mesh.triangles.len()).map(normal).collect();
        let mut edges: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for (face, corners) in (0..).zip(&mesh.triangles) {
            for side in 0..3 {
                let [one, other] = [corners[side], corners[(side + 1) % 3]];
                edges.entry([one.min(other), one.max(other)]).or_default().push(face);
            }
        }
        Self { normals, edges }
    }

    /// Sharpness of a feature between faces of these normals: 0 where it is flat.
    fn sharpness(sum: &Vector3<f64>, count: usize) -> f64 {
        1.0 - sum.norm() / count.max(1) as f64
    }

    /// Adds the vertices; a vertex in a hollow counts as a face point.
    fn add_vertices(&self, mesh: &TriMesh, hull: &[u32], cells: &mut Cells) {
        let mut sums = vec![(Vector3::zeros(), 0, Vector3::zeros()); mesh.vertices.len()];
        for (face, corners) in mesh.triangles.iter().enumerate() {
            let middle = mesh.corners(face).iter().map(|corner| corner.coords).sum::<Vector3<f64>>() / 3.0;
            for corner in corners {
                let (normal, count, around) = &mut sums[*corner as usize];
                *normal += self.normals[face];
                *count += 1;
                *around += middle;
            }
        }
        for ((index, vertex), (normal, count, around)) in (0..).zip(&mesh.vertices).zip(&sums) {
            let point = Point3::from(vertex.map(f64::from));
            let sticks_out = normal.dot(&(around / (*count).max(1) as f64 - point.coords)) < 0.0;
            let sharpness = if sticks_out { Self::sharpness(normal, *count) } else { 0.0 };
            let added = cells.add(point, *normal, sharpness);
            if hull.binary_search(&index).is_ok() {
                cells.corners.extend(added);
            }
        }
    }

    /// Adds points along the edges.
    fn add_edges(&self, mesh: &TriMesh, cells: &mut Cells) {
        let vertex = |index: u32| Point3::from(mesh.vertices[index as usize].map(f64::from));
        for ([one, other], faces) in &self.edges {
            let normal: Vector3<f64> = faces.iter().map(|face| self.normals[*face as usize]).sum();
            let (from, to) = (vertex(*one), vertex(*other));
            // The faces of an edge that sticks out fall away from its normal.
            let middle = faces.iter().map(|face| {
                mesh.corners(*face as usize).iter().map(|corner| corner.coords).sum::<Vector3<f64>>() / 3.0
            });
            let around = middle.sum::<Vector3<f64>>() / faces.len() as f64;
            let sticks_out = normal.dot(&(around - (from.coords + to.coords) / 2.0)) < 0.0;
            let sharpness = if sticks_out { Self::sharpness(&normal, faces.len()) } else { 0.0 };
            let steps = pieces((to - from).norm());
            for step in 0..=steps {
                cells.add(from + (to - from) * (f64::from(step) / f64::from(steps)), normal, sharpness);
            }
        }
    }

    /// Adds points of the faces.
    fn add_faces(&self, mesh: &TriMesh, cells: &mut Cells) {
        for (face, normal) in self.normals.iter().enumerate() {
            let [a, b, c] = mesh.corners(face);
            let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
            let steps = pieces(longest);
            for u in 0..=steps {
                for v in 0..=steps - u {
                    let [u, v] = [u, v].map(|step| f64::from(step) / f64::from(steps));
                    cells.add(a + (b - a) * u + (c - a) * v, *normal, 0.0);
                }
            }
        }
    }
}

/// Pieces of a length, each at most half a cell long.
fn pieces(length: f64) -> u32 {
    ((length / (POINT_CELL / 2.0)).ceil() as u32).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{geom::convex_hull_vertices, test_shapes::built_in, voxel::InsideTest};

    #[test]
    fn every_cell_of_the_surface_has_a_point_on_it_and_no_cell_two() {
        let mesh = built_in("mug-01");
        let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
        let points = SurfacePoints::new(&mesh, &[], Sampled::Everywhere);
        let mut cells = std::collections::BTreeSet::new();
        for each in &points.points {
            assert!(surface.signed_distance(&each.point).abs() < 1e-7, "{:?}", each.point);
            assert!((each.normal.norm() - 1.0).abs() < 1e-12);
            let cell = [0, 1, 2].map(|axis| (each.point[axis] / POINT_CELL).floor() as i32);
            assert!(cells.insert(cell), "{cell:?} twice");
        }
        // Any point of the surface has one nearby: at most a diagonal of a cell away, but for a rim between.
        for step in 0..2000 {
            let share = (f64::from(step) + 0.5) / 2000.0;
            let (point, _) = surface.point_at(share, 0.3, 0.3).expect("area");
            let nearest = points.points.iter().map(|each| (each.point - point).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < POINT_CELL * 3.0_f64.sqrt(), "{nearest} at {point}");
        }
    }

    #[test]
    fn a_search_leaves_out_only_what_is_farther_than_it_says() {
        let (mesh, other) = (built_in("mug-01"), built_in("box-01"));
        let surface = ContactSurface::new(&other, InsideTest::Crossings).expect("a surface");
        let points = SurfacePoints::new(&mesh, &[], Sampled::Everywhere);
        let mut waiting = Waiting::new();
        for step in 0..12 {
            let aside = 0.02 * f64::from(step);
            let placed = IsometryMatrix3::new(Vector3::new(aside, 0.01, 0.02), Vector3::new(0.3, 0.2, aside * 9.0));
            let mut found = std::collections::BTreeSet::new();
            let farther = points.near(&surface, &placed, 0.001, &mut waiting, |index, point, bound| {
                assert!(bound <= surface.signed_distance(&point) + 1e-6);
                found.insert(index);
            });
            for index in (0..points.len() as u32).filter(|index| !found.contains(index)) {
                let distance = surface.signed_distance(&(placed * points.get(index).point));
                assert!(distance >= farther - 1e-6 && farther > 0.001, "{distance} {farther}");
            }
        }
    }

    #[test]
    fn corners_of_the_hull_are_kept_all_and_each_once() {
        let mesh = built_in("bottle-01@16k");
        let vertices: Vec<_> = mesh.vertices.iter().map(|vertex| Point3::from(vertex.map(f64::from))).collect();
        let hull = convex_hull_vertices(&vertices).expect("a hull");
        let [with, without] = [&hull[..], &[]].map(|hull| SurfacePoints::new(&mesh, hull, Sampled::Everywhere).points);
        let holds = |points: &[SurfacePoint], at: &Point3<f64>| points.iter().filter(|each| each.point == *at).count();
        let corners = || hull.iter().map(|corner| &vertices[*corner as usize]);
        assert!(corners().all(|corner| holds(&with, corner) == 1));
        let missed = corners().filter(|corner| holds(&without, corner) == 0).count();
        assert!(missed > 100, "cells alone miss {missed} of {}", hull.len());
        assert_eq!(with.len(), without.len() + missed);
    }

    #[test]
    fn edges_alone_are_few_and_stick_out() {
        let mesh = TriMesh::open_box([0.4, 0.3, 0.2], 0.02);
        let points = SurfacePoints::new(&mesh, &[], Sampled::Edges);
        let everywhere = SurfacePoints::new(&mesh, &[], Sampled::Everywhere);
        assert!(
            points.len() > 1000 && points.len() < everywhere.len() / 20,
            "{} of {}",
            points.len(),
            everywhere.len()
        );
        // No point of an inner edge that is hollow, such as one between floor and wall.
        for each in &points.points {
            let [x, y, z] = each.point.coords.into();
            let inner_floor = z.abs() < 1e-6 && x.abs() < 0.2 && y.abs() < 0.15;
            assert!(!inner_floor, "{:?}", each.point);
        }
    }
}
