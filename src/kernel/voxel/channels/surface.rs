//! Exact distances to a mesh's surface: a box tree for the closest point, pseudo-normals and the solid for the sign.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use crate::geom::{SolidCells, TriMesh, TriangleTree};

/// No neighbour across an edge.
const NONE: u32 = u32::MAX;

/// A mesh's surface, prepared for closest-point queries. Build it once per object; it copies what it needs.
pub struct Surface {
    vertices: Vec<[f32; 3]>,
    /// Triangles in the order of the tree's leaves.
    triangles: Vec<[u32; 3]>,
    /// Triangle across the edge from corner i to corner i + 1.
    neighbours: Vec<[u32; 3]>,
    /// Angle-weighted sums of the normals around each vertex.
    vertex_normals: Vec<[f32; 3]>,
    tree: Arc<TriangleTree>,
    /// Sums of triangle areas up to and with each triangle [m^2].
    areas: Vec<f64>,
}

/// A point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// The point, in `Object` [m].
    pub point: Point3<f64>,
    /// Squared distance to the query point [m^2].
    pub distance_squared: f64,
    /// Index of the triangle in the [`Surface`].
    triangle: u32,
    feature: Feature,
}

/// Cached candidate triangles for repeated closest-point queries around one point: a few are tested, where the tree tests
/// dozens.
#[derive(Default)]
pub(crate) struct Neighbourhood {
    /// Centre of the neighbourhood, in `Object` [m].
    middle: Point3<f64>,
    /// Largest distance of a query point from the centre [m]; 0 before the neighbourhood was gathered.
    radius: f64,
    /// Distances from the middle [m] and triangles, the nearest first.
    triangles: Vec<(f32, u32)>,
}

/// Bound on the error of distances in f32 [m], for coordinates below a few metres.
const ROUNDED: f64 = 1e-6;

impl Neighbourhood {
    /// Empties the neighbourhood.
    pub(crate) fn forget(&mut self) {
        self.radius = 0.0;
    }

    /// Whether a point is close enough to the centre for the candidates to be complete.
    pub(crate) fn holds(&self, point: &Point3<f64>) -> bool {
        (point - self.middle).norm_squared() < self.radius * self.radius
    }
}

/// The part of a triangle that holds a point.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Feature {
    Face,
    /// From corner i to corner i + 1.
    Edge(u8),
    Corner(u8),
}

impl Surface {
    /// Prepares a mesh. Its winding decides the sign next to the surface, so it should point outward.
    pub fn new(mesh: &TriMesh) -> Self {
        Self::of_tree(mesh, Arc::new(TriangleTree::new(mesh)))
    }

    /// Prepares a mesh whose tree has been built already.
    pub fn of_tree(mesh: &TriMesh, tree: Arc<TriangleTree>) -> Self {
        let triangles: Vec<[u32; 3]> = tree.order().iter().map(|t| mesh.triangles[*t as usize]).collect();
        let mut surface = Self {
            vertices: mesh.vertices.clone(),
            neighbours: neighbours(&triangles),
            triangles,
            vertex_normals: Vec::new(),
            tree,
            areas: Vec::new(),
        };
        surface.vertex_normals = surface.angle_weighted_normals();
        let mut sum = 0.0;
        surface.areas = (0..surface.triangles.len())
            .map(|t| {
                sum += 0.5 * surface.area_normal(t).norm();
                sum
            })
            .collect();
        surface
    }

    /// Vertices of the mesh, in `Object` [m].
    pub fn vertices(&self) -> &[[f32; 3]] {
        &self.vertices
    }

    /// Tree over the triangles.
    pub(crate) fn tree(&self) -> &TriangleTree {
        &self.tree
    }

    /// Total area [m^2].
    pub fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    /// The closest point of the surface strictly within `reach` [m] of `point` (in `Object`).
    ///
    /// The triangle is found in f32, the point on it in f64: the distance is good to 1e-7 of the coordinates' size.
    pub fn closest(&self, point: &Point3<f64>, reach: f64) -> Option<Closest> {
        self.closest_from(point, reach, None)
    }

    /// Closest point as [`Surface::closest`] returns it; the triangle of an earlier answer nearby is tried first.
    pub(crate) fn closest_from(&self, point: &Point3<f64>, reach: f64, hint: Option<&Closest>) -> Option<Closest> {
        let first = hint.map(|hint| self.on_triangle(hint.triangle, point));
        let bound = first.map_or(reach * reach, |first| first.distance_squared.min(reach * reach));
        // A little more than the bound, so that rounding loses no triangle at it.
        let bound = (bound * 1.000_001) as f32;
        let found = self.tree.nearest(point.coords.map(|v| v as f32).into(), bound);
        let found = found.map(|triangle| self.on_triangle(triangle, point));
        let nearer = match (found, first) {
            (Some(found), Some(first)) if first.distance_squared < found.distance_squared => Some(first),
            (found, first) => found.or(first),
        };
        nearer.filter(|closest| closest.distance_squared < reach * reach)
    }

    /// Gathers the candidates of [`Surface::closest_among`] for points within `radius` [m] of `middle`: all triangles nearer
    /// to the middle than `reach` [m]. For the exact closest point, `reach` is its distance plus twice the radius.
    pub(crate) fn gather(&self, middle: &Point3<f64>, radius: f64, reach: f64, into: &mut Neighbourhood) {
        (into.middle, into.radius) = (*middle, radius);
        into.triangles.clear();
        let bound = (reach + ROUNDED).powi(2) as f32;
        let point = middle.coords.map(|v| v as f32).into();
        self.tree.within(point, bound, |triangle, squared| into.triangles.push((squared.sqrt(), triangle)));
        into.triangles.sort_unstable_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
    }

    /// The closest point among the candidates of a neighbourhood that holds `point`; within its reach it is the closest point
    /// of the surface, in f64.
    pub(crate) fn closest_among(&self, point: &Point3<f64>, near: &Neighbourhood) -> Option<Closest> {
        let away = (point - near.middle).norm() + ROUNDED;
        let mut best: Option<(f64, Closest)> = None;
        for (distance, triangle) in &near.triangles {
            if best.is_some_and(|(min, _)| f64::from(*distance) - away >= min) {
                break;
            }
            let found = self.on_triangle(*triangle, point);
            if best.is_none_or(|(_, best)| found.distance_squared < best.distance_squared) {
                best = Some((found.distance_squared.sqrt(), found));
            }
        }
        best.map(|(_, found)| found)
    }

    fn on_triangle(&self, triangle: u32, point: &Point3<f64>) -> Closest {
        let (closest, feature) = closest_on_triangle(point, &self.corners(triangle as usize));
        Closest { point: closest, distance_squared: (point - closest).norm_squared(), triangle, feature }
    }

    /// Whether `point` (in `Object`) lies inside, given its closest point of the surface, if any is within reach.
    ///
    /// Farther than the diagonal of one fine cell from the surface, the solid decides, for all defects of the mesh; nearer,
    /// the angle-weighted pseudo-normal decides (Baerentzen and Aanaes 2005, "Signed distance computation using the angle
    /// weighted pseudonormal").
    pub fn inside(&self, solid: &impl SolidCells, point: &Point3<f64>, closest: Option<&Closest>) -> bool {
        match closest {
            Some(closest) if closest.distance_squared <= 3.0 * solid.pitch() * solid.pitch() => {
                (point - closest.point).dot(&self.pseudo_normal(closest)) < 0.0
            }
            _ => solid.holds(point),
        }
    }

    /// Signed distance to the surface [m], negative inside; exact.
    pub fn signed_distance(&self, solid: &impl SolidCells, point: &Point3<f64>) -> f64 {
        let closest = self.closest(point, f64::INFINITY);
        let distance = closest.map_or(f64::INFINITY, |closest| closest.distance_squared.sqrt());
        if self.inside(solid, point, closest.as_ref()) { -distance } else { distance }
    }

    /// A point of the surface by three numbers from 0 to 1: `share` chooses the triangle by cumulated area, (u, v) the point
    /// in it. Returns the point and the unit normal, in `Object`. Uniform numbers give points uniform over the area.
    pub(crate) fn point_at(&self, share: f64, u: f64, v: f64) -> Option<(Point3<f64>, Vector3<f64>)> {
        let wanted = share * self.area();
        let triangle = self.areas.partition_point(|sum| *sum <= wanted).min(self.triangles.len().checked_sub(1)?);
        let [a, b, c] = self.corners(triangle);
        // The far half of the parallelogram folds back onto the triangle.
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        Some((a + (b - a) * u + (c - a) * v, self.unit_normal(triangle)))
    }

    fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|vertex| Point3::from(self.vertices[vertex as usize].map(f64::from)))
    }

    /// The normal, whose length is twice the area.
    fn area_normal(&self, triangle: usize) -> Vector3<f64> {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(&(c - a))
    }

    /// The unit normal; zero for a triangle without area.
    fn unit_normal(&self, triangle: usize) -> Vector3<f64> {
        let normal = self.area_normal(triangle);
        let length = normal.norm();
        if length > 0.0 { normal / length } else { Vector3::zeros() }
    }

    /// The outward unit normal at a closest point, by its face, edge or corner.
    pub(crate) fn normal(&self, closest: &Closest) -> Vector3<f64> {
        let normal = self.pseudo_normal(closest);
        let length = normal.norm();
        if length > 0.0 { normal / length } else { Vector3::z() }
    }

    /// Points outward whether the closest feature is a face, an edge or a corner; not of unit length.
    fn pseudo_normal(&self, closest: &Closest) -> Vector3<f64> {
        let triangle = closest.triangle as usize;
        match closest.feature {
            Feature::Face => self.area_normal(triangle),
            Feature::Edge(edge) => {
                let own = self.unit_normal(triangle);
                match self.neighbours[triangle][edge as usize] {
                    NONE => own,
                    other => own + self.unit_normal(other as usize),
                }
            }
            Feature::Corner(corner) => {
                let vertex = self.triangles[triangle][corner as usize];
                Vector3::from(self.vertex_normals[vertex as usize].map(f64::from))
            }
        }
    }

    fn angle_weighted_normals(&self) -> Vec<[f32; 3]> {
        let mut sums = vec![Vector3::<f64>::zeros(); self.vertices.len()];
        for (triangle, vertices) in self.triangles.iter().enumerate() {
            let (corners, normal) = (self.corners(triangle), self.unit_normal(triangle));
            for i in 0..3 {
                let (a, b) = (corners[(i + 1) % 3] - corners[i], corners[(i + 2) % 3] - corners[i]);
                sums[vertices[i] as usize] += normal * libm::atan2(a.cross(&b).norm(), a.dot(&b));
            }
        }
        sums.into_iter().map(|sum| sum.map(|v| v as f32).into()).collect()
    }
}

/// The triangle across each edge, where there is one; of more than two at an edge, some other one.
fn neighbours(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut edges: Vec<(u32, u32, u32, u8)> = Vec::with_capacity(3 * triangles.len());
    for (triangle, vertices) in triangles.iter().enumerate() {
        for i in 0..3 {
            let (a, b) = (vertices[i], vertices[(i + 1) % 3]);
            edges.push((a.min(b), a.max(b), triangle as u32, i as u8));
        }
    }
    edges.sort_unstable();
    let mut neighbours = vec![[NONE; 3]; triangles.len()];
    for group in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        for (i, (_, _, triangle, edge)) in group.iter().enumerate() {
            if group.len() > 1 {
                neighbours[*triangle as usize][*edge as usize] = group[(i + 1) % group.len()].2;
            }
        }
    }
    neighbours
}

/// The point of a triangle closest to `p` by the Voronoi regions of its corners and edges (Ericson 2005, "Real-Time
/// Collision Detection", 5.1.5).
fn closest_on_triangle(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> (Point3<f64>, Feature) {
    let (ab, ac) = (b - a, c - a);
    let ap = p - a;
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    // Voronoi region of corner a.
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, Feature::Corner(0));
    }
    // Voronoi region of corner b.
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, Feature::Corner(1));
    }
    // Voronoi region of edge ab: the projection onto the edge.
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), Feature::Edge(0));
    }
    // Voronoi region of corner c.
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, Feature::Corner(2));
    }
    // Voronoi region of edge ac.
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), Feature::Edge(2));
    }
    // Voronoi region of edge bc.
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), Feature::Edge(1));
    }
    // Inside the face: barycentric coordinates of the projection.
    let whole = va + vb + vc;
    (a + ab * (vb / whole) + ac * (vc / whole), Feature::Face)
}

#[cfg(test)]
pub(super) mod shapes {
    //! Meshes with closed forms, and views of them.

    use std::rc::Rc;

    use super::*;
    use crate::geom::{CameraCv, GridPlacement, Object, Pose, SolidGrid, rotation_from_rpy};

    /// Signed distance [m] of a point.
    type Distance = Rc<dyn Fn(&Point3<f64>) -> f64>;

    pub struct Shape {
        pub mesh: TriMesh,
        pub solid: SolidGrid,
        pub centre: Point3<f64>,
        pub radius: f64,
        pub distance: Distance,
    }

    fn shape_of(mesh: TriMesh, distance: Distance) -> Shape {
        let bounds = mesh.aabb().expect("vertices");
        let mut solid = SolidGrid::new(bounds.min, bounds.longest_side());
        for i in 0..SolidGrid::SIDE.pow(3) {
            let [x, y, z] = [i >> 16, i >> 8 & 255, i & 255];
            if distance(&solid.centre(x, y, z)) < 0.0 {
                solid.words[i / 64] |= 1 << (i % 64);
            }
        }
        Shape { mesh, solid, centre: bounds.centre(), radius: 0.5 * bounds.longest_side(), distance }
    }

    /// A box of these sides whose lower corner is (0.02, -0.01, 0.03).
    pub fn cuboid(sides: [f64; 3]) -> Shape {
        let origin = [0.02f64, -0.01, 0.03];
        let vertices = (0..8usize)
            .map(|i| std::array::from_fn(|axis| (origin[axis] + sides[axis] * (i >> (2 - axis) & 1) as f64) as f32));
        let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let mesh = TriMesh { vertices: vertices.collect(), triangles };
        // The f32 corners, so that the reference is exact for this mesh.
        let bounds = mesh.aabb().expect("vertices");
        let (middle, half) = (bounds.centre(), (bounds.max - bounds.min) * 0.5);
        shape_of(
            mesh,
            Rc::new(move |point| {
                let beyond = (point - middle).abs() - half;
                beyond.map(|v| v.max(0.0)).norm() + beyond.max().min(0.0)
            }),
        )
    }

    /// A shape rotated by roll, pitch and yaw about the origin.
    pub fn turned(shape: &Shape, [roll, pitch, yaw]: [f64; 3]) -> Shape {
        let rotation = rotation_from_rpy(roll, pitch, yaw);
        let rotate = |v: &[f32; 3]| (rotation * Vector3::from(v.map(f64::from))).map(|v| v as f32).into();
        let vertices = shape.mesh.vertices.iter().map(rotate).collect();
        let back = rotation.inverse();
        let distance = shape.distance.clone();
        shape_of(
            TriMesh { vertices, triangles: shape.mesh.triangles.clone() },
            Rc::new(move |point| distance(&(back * point))),
        )
    }

    /// A ball around (0.01, 0.02, -0.03): an octahedron whose faces are split six times; 32,768 triangles.
    pub fn sphere(radius: f64) -> Shape {
        let centre = Point3::new(0.01, 0.02, -0.03);
        let mut vertices: Vec<Vector3<f64>> =
            [[1., 0., 0.], [-1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]]
                .map(Vector3::from)
                .into();
        let mut triangles =
            vec![[0u32, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        for _ in 0..6 {
            let mut middles = std::collections::BTreeMap::new();
            let mut split = Vec::new();
            for [a, b, c] in triangles {
                let mut middle = |p: u32, q: u32| {
                    *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                        vertices.push((vertices[p as usize] + vertices[q as usize]).normalize());
                        vertices.len() as u32 - 1
                    })
                };
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                split.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            triangles = split;
        }
        let vertices = vertices.iter().map(|v| (centre + v * radius).coords.map(|v| v as f32).into()).collect();
        shape_of(TriMesh { vertices, triangles }, Rc::new(move |point| (point - centre).norm() - radius))
    }

    /// Some views with a grid around the whole shape, among them one along the axes.
    pub fn views(shape: &Shape) -> impl Iterator<Item = (Pose<CameraCv, Object>, GridPlacement)> + use<> {
        let (centre, radius) = (shape.centre, shape.radius);
        [[0.0, 0.0, 0.0], [0.4, -0.7, 1.9], [2.1, 0.3, -0.8]].into_iter().map(move |[roll, pitch, yaw]| {
            let rotation = rotation_from_rpy(roll, pitch, yaw);
            let middle = Point3::new(0.013, -0.021, 1.0);
            let pose = Pose::new(rotation, middle.coords - rotation * centre.coords);
            (pose, GridPlacement { resolution: 40, centre: middle, cell_size: radius / 15.0 })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{geom::SolidGrid, seed::Stream};

    #[test]
    fn the_tree_finds_what_trying_every_triangle_finds() {
        let shape = shapes::sphere(0.05);
        let surface = Surface::new(&shape.mesh);
        let mut stream = Stream::of_job(4, b"", "closest");
        for _ in 0..60 {
            let point = shape.centre + Vector3::from_fn(|_, _| stream.uniform(-0.1, 0.1));
            let all = (0..shape.mesh.triangles.len())
                .map(|t| (point - closest_on_triangle(&point, &shape.mesh.corners(t)).0).norm_squared())
                .fold(f64::INFINITY, f64::min);
            let found = surface.closest(&point, f64::INFINITY).expect("a surface");
            assert!((found.distance_squared.sqrt() - all.sqrt()).abs() < 1e-8);
            assert!(surface.closest(&point, all.sqrt() * 0.999).is_none());
            assert!(surface.closest(&point, all.sqrt() * 1.001).is_some());
        }
    }

    #[test]
    fn a_neighbourhood_finds_what_trying_every_triangle_finds() {
        let shape = shapes::sphere(0.05);
        let surface = Surface::new(&shape.mesh);
        let mut stream = Stream::of_job(4, b"", "neighbourhoods");
        let (mut near, radius) = (Neighbourhood::default(), 3e-4);
        for _ in 0..20 {
            let away = Vector3::from_fn(|_, _| stream.normal()).normalize();
            let middle = shape.centre + away * stream.uniform(0.04, 0.06);
            assert!(!near.holds(&middle));
            let distance = surface.closest(&middle, f64::INFINITY).expect("a surface").distance_squared.sqrt();
            surface.gather(&middle, radius, distance + 2.0 * radius, &mut near);
            for _ in 0..20 {
                let direction = Vector3::from_fn(|_, _| stream.normal()).normalize();
                let point = middle + direction * stream.uniform(0.0, 0.99 * radius);
                assert!(near.holds(&point));
                let all = (0..shape.mesh.triangles.len())
                    .map(|t| (point - closest_on_triangle(&point, &shape.mesh.corners(t)).0).norm_squared())
                    .fold(f64::INFINITY, f64::min);
                let found = surface.closest_among(&point, &near).expect("one of them");
                assert_eq!(found.distance_squared, all);
            }
        }
        near.forget();
        assert!(!near.holds(&shape.centre));
    }

    #[test]
    fn signs_hold_at_faces_edges_and_corners() {
        let shape = shapes::cuboid([0.1, 0.06, 0.03]);
        let surface = Surface::new(&shape.mesh);
        let mut stream = Stream::of_job(4, b"", "signs");
        for _ in 0..20_000 {
            // Most of these lie within a fine cell of the surface, where the pseudo-normal decides.
            let (mut point, _) = surface.point_at(stream.unit(), stream.unit(), stream.unit()).expect("area");
            if stream.unit() < 0.3 {
                let corner = shape.mesh.vertices[stream.below(8) as usize].map(f64::from);
                point = Point3::from(corner);
            }
            let point = point + Vector3::from_fn(|_, _| stream.normal() * 0.0003);
            let (seen, truth) = (surface.signed_distance(&shape.solid, &point), (shape.distance)(&point));
            assert!((seen - truth).abs() < 1e-8, "{seen} for {truth} at {point}");
        }
    }

    #[test]
    fn an_empty_mesh_is_far_from_everything() {
        let surface = Surface::new(&TriMesh::default());
        let solid = SolidGrid::new(Point3::origin(), 1.0);
        assert_eq!(surface.signed_distance(&solid, &Point3::origin()), f64::INFINITY);
        assert_eq!(surface.area(), 0.0);
        assert!(surface.point_at(0.5, 0.5, 0.5).is_none());
    }
}
