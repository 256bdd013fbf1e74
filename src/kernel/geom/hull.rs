//! Convex hulls, decided by integers.
//!
//! Points are rounded to a lattice of 2^24 steps along the longest side of their box, and every question which side of a plane
//! a point is on is one of whole numbers: no tolerance, no degenerate case, the same hull everywhere. By quickhull (Barber,
//! Dobkin and Huhdanpaa 1996, "The quickhull algorithm for convex hulls").

use nalgebra::{Point3, Vector3};

/// Steps along the longest side.
const STEPS: f64 = (1 << 24) as f64;

/// No face.
const NONE: u32 = u32::MAX;

/// A point of the lattice.
type Site = [i64; 3];

/// A convex hull with a volume.
#[derive(Clone, Debug)]
pub(super) struct ConvexHull {
    /// Corners of the hull, rounded [m].
    pub(super) corners: Vec<Point3<f64>>,
    /// For each corner the first of the points that it is.
    vertices: Vec<u32>,
    /// Facets of the hull; no two lie in one plane.
    pub(super) facets: Vec<Facet>,
}

/// Corners of the convex hull of points [m], each once: those at which it is bent. `None` where the points lie in a plane.
pub fn convex_hull_corners(points: &[Point3<f64>]) -> Option<Vec<Point3<f64>>> {
    let hull = ConvexHull::of(points)?;
    Some(hull.bent().into_iter().map(|corner| hull.corners[corner as usize]).collect())
}

/// Vertices at which the convex hull of points [m] is bent, as indices of the points, in rising order; of equal points the first.
/// `None` where the points lie in a plane.
pub fn convex_hull_vertices(points: &[Point3<f64>]) -> Option<Vec<u32>> {
    let hull = ConvexHull::of(points)?;
    let mut vertices: Vec<u32> = hull.bent().into_iter().map(|corner| hull.vertices[corner as usize]).collect();
    vertices.sort_unstable();
    Some(vertices)
}

/// Planes of the convex hull's facets, as outward unit normals and offsets: `normal . point <= offset` inside. `None` where the
/// points lie in a plane.
pub fn convex_hull_planes(points: &[Point3<f64>]) -> Option<Vec<(Vector3<f64>, f64)>> {
    let hull = ConvexHull::of(points)?;
    let plane = |facet: &Facet| (facet.normal, facet.normal.dot(&hull.corners[facet.corners[0] as usize].coords));
    Some(hull.facets.iter().map(plane).collect())
}

/// Area of the convex hull of points [m^2]; where the points lie in a plane, 0.
pub fn convex_hull_area(points: &[Point3<f64>]) -> f64 {
    let Some(hull) = ConvexHull::of(points) else { return 0.0 };
    let of_facet = |facet: &Facet| {
        let corner = |index: usize| hull.corners[facet.corners[index] as usize];
        let fan = (1..facet.corners.len() - 1)
            .map(|index| (corner(index) - corner(0)).cross(&(corner(index + 1) - corner(0))).dot(&facet.normal));
        fan.sum::<f64>() / 2.0
    };
    hull.facets.iter().map(of_facet).sum()
}

/// A facet: a convex polygon.
#[derive(Clone, Debug)]
pub(super) struct Facet {
    /// Corners, counter-clockwise as viewed from outside: indices in [`ConvexHull::corners`].
    pub(super) corners: Vec<u32>,
    /// Across the edge from corner k to corner k + 1.
    pub(super) neighbours: Vec<u32>,
    /// Outward, of unit length.
    pub(super) normal: Vector3<f64>,
}

/// A triangle of the hull while it grows.
struct Face {
    corners: [u32; 3],
    /// Across the edge from corner k to corner k + 1.
    neighbours: [u32; 3],
    /// Outward.
    normal: Site,
    /// Points that it sees, each with one face only.
    outside: Vec<u32>,
    /// Whether it is still a face of the hull.
    stands: bool,
}

impl ConvexHull {
    /// The hull of points [m]; `None` where they lie in a plane.
    pub(super) fn of(points: &[Point3<f64>]) -> Option<Self> {
        let first = *points.first()?;
        let low = points.iter().fold(first, |low, point| low.inf(point));
        let high = points.iter().fold(first, |high, point| high.sup(point));
        let pitch = (high - low).max() / STEPS;
        if pitch.is_nan() || pitch <= 0.0 {
            return None;
        }
        let site = |point: &Point3<f64>| ((point - low) / pitch).map(|part| part.round() as i64).into();
        let mut sites: Vec<(Site, u32)> = points.iter().map(site).zip(0..).collect();
        sites.sort_unstable();
        sites.dedup_by_key(|(site, _)| *site);
        let (sites, vertices) = sites.into_iter().unzip();
        let mut growth = Growth::begin(sites)?;
        growth.finish();
        let facets = growth.facets();
        let metres = |site: &Site| low + Vector3::from(site.map(|part| part as f64)) * pitch;
        Some(Self { corners: growth.sites.iter().map(metres).collect(), vertices, facets })
    }

    /// Corners at which the hull is bent, in rising order; the others lie inside it or in a facet.
    fn bent(&self) -> Vec<u32> {
        let mut used: Vec<u32> = self.facets.iter().flat_map(|facet| facet.corners.iter().copied()).collect();
        used.sort_unstable();
        used.dedup();
        used
    }
}

/// A hull that grows point by point.
struct Growth {
    sites: Vec<Site>,
    faces: Vec<Face>,
    /// Faces that may see points.
    waiting: Vec<u32>,
}

fn minus(one: &Site, other: &Site) -> Site {
    std::array::from_fn(|axis| one[axis] - other[axis])
}

/// Cross product of differences of sites: every component fits 53 bits.
fn cross(one: &Site, other: &Site) -> Site {
    let part = |a: usize, b: usize| one[a] * other[b] - one[b] * other[a];
    [part(1, 2), part(2, 0), part(0, 1)]
}

fn dot(one: &Site, other: &Site) -> i128 {
    (0..3).map(|axis| i128::from(one[axis]) * i128::from(other[axis])).sum()
}

impl Growth {
    /// A tetrahedron, and every point outside with one of its faces; `None` where all lie in a plane.
    fn begin(sites: Vec<Site>) -> Option<Self> {
        let all = || 0..sites.len() as u32;
        let site = |index: u32| &sites[index as usize];
        let (a, b) = (0, sites.len() as u32 - 1);
        let along = minus(site(b), site(a));
        let aside = |index: &u32| {
            let across = cross(&along, &minus(site(*index), site(a)));
            dot(&across, &across)
        };
        let c = all().max_by_key(aside).filter(|index| aside(index) > 0)?;
        let normal = cross(&along, &minus(site(c), site(a)));
        let height = |index: &u32| dot(&normal, &minus(site(*index), site(a)));
        let d = all().max_by_key(|index| height(index).abs()).filter(|index| height(index) != 0)?;
        // So that the fourth corner is behind the first three.
        let [b, c] = if height(&d) > 0 { [c, b] } else { [b, c] };
        let mut growth = Self { sites, faces: Vec::new(), waiting: Vec::new() };
        for (corners, neighbours) in
            [([a, b, c], [1, 2, 3]), ([b, a, d], [0, 3, 2]), ([c, b, d], [0, 1, 3]), ([a, c, d], [0, 2, 1])]
        {
            growth.add(corners, neighbours);
        }
        let points = (0..growth.sites.len() as u32).filter(|index| ![a, b, c, d].contains(index)).collect();
        growth.share(points, 0..4);
        Some(growth)
    }

    fn add(&mut self, corners: [u32; 3], neighbours: [u32; 3]) -> u32 {
        let [a, b, c] = corners.map(|index| &self.sites[index as usize]);
        let normal = cross(&minus(b, a), &minus(c, a));
        self.faces.push(Face { corners, neighbours, normal, outside: Vec::new(), stands: true });
        self.faces.len() as u32 - 1
    }

    /// Signed height of a point above a face, in units of the face's normal; 0 in its plane.
    fn height(&self, face: u32, index: u32) -> i128 {
        let Face { normal, corners, .. } = &self.faces[face as usize];
        dot(normal, &minus(&self.sites[index as usize], &self.sites[corners[0] as usize]))
    }

    /// Gives each point to the first of some faces that sees it; the others are inside.
    fn share(&mut self, points: Vec<u32>, faces: std::ops::Range<u32>) {
        for point in points {
            if let Some(face) = faces.clone().find(|face| self.height(*face, point) > 0) {
                self.faces[face as usize].outside.push(point);
            }
        }
        self.waiting.extend(faces.filter(|face| !self.faces[*face as usize].outside.is_empty()));
    }

    /// Takes points until none is outside.
    fn finish(&mut self) {
        while let Some(face) = self.waiting.pop() {
            if !self.faces[face as usize].stands {
                continue;
            }
            let outside = &self.faces[face as usize].outside;
            let apex = outside.iter().copied().max_by_key(|point| (self.height(face, *point), *point));
            if let Some(apex) = apex {
                self.take(face, apex);
            }
        }
    }

    /// Replaces the faces that see a point, one of which is given, by a cone over their horizon.
    fn take(&mut self, seen_from: u32, apex: u32) {
        // Flood fill of the faces that see the point; edges to other faces are the horizon.
        let mut seen = vec![seen_from];
        self.faces[seen_from as usize].stands = false;
        // From a corner of the horizon to the next, and the face beyond.
        let mut horizon = Vec::new();
        let mut next = 0;
        while let Some(face) = seen.get(next).copied() {
            next += 1;
            for edge in 0..3 {
                let beyond = self.faces[face as usize].neighbours[edge];
                if !self.faces[beyond as usize].stands {
                    continue;
                }
                if self.height(beyond, apex) > 0 {
                    self.faces[beyond as usize].stands = false;
                    seen.push(beyond);
                } else {
                    let corners = self.faces[face as usize].corners;
                    horizon.push((corners[edge], corners[(edge + 1) % 3], beyond));
                }
            }
        }
        // A face that was kept at first may have been seen later.
        horizon.retain(|(.., beyond)| self.faces[*beyond as usize].stands);
        horizon.sort_unstable();
        let first = self.faces.len() as u32;
        let position_of = |from: u32| horizon.partition_point(|(corner, ..)| *corner < from) as u32;
        let mut before = vec![NONE; horizon.len()];
        // The face before each one around the horizon.
        for (number, (_, to, _)) in (0..).zip(&horizon) {
            before[position_of(*to) as usize] = number;
        }
        // One face of the cone per edge of the horizon, linked to its neighbours.
        for (number, (from, to, beyond)) in horizon.iter().enumerate() {
            let new = self.add([*from, *to, apex], [*beyond, first + position_of(*to), first + before[number]]);
            let Face { corners, neighbours, .. } = &mut self.faces[*beyond as usize];
            let edge = (0..3).find(|edge| corners[*edge] == *to && corners[(*edge + 1) % 3] == *from);
            neighbours[edge.expect("adjacent faces share an edge")] = new;
        }
        // Points outside the removed faces are shared out among the new ones.
        let mut points = Vec::new();
        seen.iter().for_each(|face| points.append(&mut self.faces[*face as usize].outside));
        points.retain(|point| *point != apex);
        self.share(points, first..first + horizon.len() as u32);
    }

    /// Faces in one plane, together.
    fn facets(&self) -> Vec<Facet> {
        let mut facet_of = vec![NONE; self.faces.len()];
        let mut members: Vec<Vec<u32>> = Vec::new();
        for start in (0..self.faces.len() as u32).filter(|face| self.faces[*face as usize].stands) {
            if facet_of[start as usize] != NONE {
                continue;
            }
            let number = members.len() as u32;
            facet_of[start as usize] = number;
            let (mut faces, mut next) = (vec![start], 0);
            while let Some(face) = faces.get(next).copied() {
                next += 1;
                for beyond in self.faces[face as usize].neighbours {
                    let corners = self.faces[beyond as usize].corners;
                    let flat = corners.iter().all(|corner| self.height(start, *corner) == 0);
                    if facet_of[beyond as usize] == NONE && flat {
                        facet_of[beyond as usize] = number;
                        faces.push(beyond);
                    }
                }
            }
            members.push(faces);
        }
        members.iter().map(|faces| self.facet(faces, &facet_of)).collect()
    }

    /// The polygon that faces in one plane make.
    fn facet(&self, faces: &[u32], facet_of: &[u32]) -> Facet {
        let mine = facet_of[faces[0] as usize];
        let mut edges = Vec::new();
        for face in faces {
            let Face { corners, neighbours, .. } = &self.faces[*face as usize];
            for edge in 0..3 {
                let beyond = facet_of[neighbours[edge] as usize];
                if beyond != mine {
                    edges.push((corners[edge], corners[(edge + 1) % 3], beyond));
                }
            }
        }
        edges.sort_unstable();
        let (mut corners, mut neighbours) = (Vec::new(), Vec::new());
        let mut at = edges[0].0;
        for _ in 0..edges.len() {
            let index = edges.partition_point(|(from, ..)| *from < at);
            let (from, to, beyond) = edges[index];
            corners.push(from);
            neighbours.push(beyond);
            at = to;
        }
        let normal = Vector3::from(self.faces[faces[0] as usize].normal.map(|part| part as f64)).normalize();
        Facet { corners, neighbours, normal }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(points: &[[f64; 3]]) -> Option<ConvexHull> {
        ConvexHull::of(&points.iter().map(|point| Point3::from(*point)).collect::<Vec<_>>())
    }

    fn grid(n: usize) -> Vec<[f64; 3]> {
        let part = |number: usize| number as f64 / (n - 1) as f64;
        (0..n * n * n).map(|k| [part(k % n), part(k / n % n), 0.5 * part(k / n / n)]).collect()
    }

    /// Asserts that the hull is a closed convex surface around all points.
    fn check(hull: &ConvexHull, points: &[[f64; 3]]) {
        let edges: usize = hull.facets.iter().map(|facet| facet.corners.len()).sum();
        let mut used: Vec<u32> = hull.facets.iter().flat_map(|facet| facet.corners.clone()).collect();
        used.sort_unstable();
        used.dedup();
        assert_eq!(used.len() + hull.facets.len(), edges / 2 + 2, "Euler's formula");
        for (number, facet) in (0..).zip(&hull.facets) {
            let at = |corner: u32| hull.corners[corner as usize];
            let base = at(facet.corners[0]);
            for point in points {
                assert!(facet.normal.dot(&(Point3::from(*point) - base)) < 1e-6, "a point outside");
            }
            for (edge, beyond) in facet.neighbours.iter().enumerate() {
                let ends = |facet: &Facet, edge: usize| {
                    [edge, (edge + 1) % facet.corners.len()].map(|index| facet.corners[index])
                };
                let [from, to] = ends(facet, edge);
                let other = &hull.facets[*beyond as usize];
                let back =
                    (0..other.corners.len()).find(|edge| ends(other, *edge) == [to, from]).expect("an edge back");
                assert_eq!(other.neighbours[back], number);
                let inward = facet.normal.cross(&(at(to) - at(from)));
                assert!(facet.corners.iter().all(|corner| inward.dot(&(at(*corner) - at(from))) > -1e-12), "convex");
            }
        }
    }

    #[test]
    fn a_brick_full_of_points_has_six_facets() {
        let points = grid(6);
        let hull = of(&points).expect("a hull");
        check(&hull, &points);
        assert_eq!(hull.facets.len(), 6);
        let normals: Vec<[f64; 3]> = hull.facets.iter().map(|facet| facet.normal.into()).collect();
        for axis in 0..3 {
            for side in [1.0, -1.0] {
                let wanted: [f64; 3] = std::array::from_fn(|other| if other == axis { side } else { 0.0 });
                assert!(normals.contains(&wanted), "{normals:?}");
            }
        }
    }

    #[test]
    fn points_on_a_sphere_are_all_corners() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let points: Vec<[f64; 3]> =
            (0..500).map(|_| Vector3::from([(); 3].map(|()| random())).normalize().into()).collect();
        let hull = of(&points).expect("a hull");
        check(&hull, &points);
        assert_eq!(hull.facets.len(), 2 * 500 - 4, "triangles");
    }

    /// A lattice of points in a box has eight; points in a plane have none.
    #[test]
    fn corners_are_those_at_which_the_hull_is_bent() {
        let points = |from: &[[f64; 3]]| from.iter().map(|point| Point3::from(*point)).collect::<Vec<_>>();
        let lattice = convex_hull_corners(&points(&grid(5))).expect("a hull");
        assert_eq!(lattice.len(), 8);
        let is_end = |part: f64| part.abs() < 1e-6 || (part - 1.0).abs() < 1e-6;
        assert!(lattice.iter().all(|corner| is_end(corner.x) && is_end(corner.y) && is_end(2.0 * corner.z)));
        assert!(convex_hull_corners(&points(&[[1.0; 3]; 5])).is_none());

        // The same as vertices: the first of equal points, and none within a facet.
        let twice: Vec<_> = points(&grid(5)).into_iter().flat_map(|point| [point; 2]).collect();
        let vertices = convex_hull_vertices(&twice).expect("a hull");
        let found: Vec<_> = vertices.iter().map(|vertex| twice[*vertex as usize]).collect();
        assert!(vertices.is_sorted() && vertices.iter().all(|vertex| vertex % 2 == 0), "{vertices:?}");
        assert_eq!(found.len(), 8);
        assert!(lattice.iter().all(|corner| found.iter().any(|vertex| (vertex - corner).norm() < 1e-6)));
        assert!(convex_hull_vertices(&points(&[[1.0; 3]; 5])).is_none());
    }

    #[test]
    fn what_has_no_volume_has_no_hull() {
        assert!(of(&[]).is_none());
        assert!(of(&[[1.0; 3]; 5]).is_none());
        assert!(of(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]).is_none());
        assert!(of(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]).is_none());
        assert!(of(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1e-3]]).is_some());
    }
}
