//! Contacts of two true meshes.
//!
//! Points of each surface are compared with the exact distances of the other: a point of the first body that lies inside the
//! second, or a point of the second inside the first. Two convex edges that cross touch at points of either edge, a cell apart
//! at most.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};

use super::{
    ContactSurface, SurfaceContact,
    points::{Sampled, SurfacePoints, Waiting},
    surface::spread_out,
};
use crate::{
    geom::{TriMesh, convex_hull_vertices},
    voxel::channels::Closest,
};

/// Contacts of one pair of bodies, at most: nested cups need more than the four that hold a box.
pub const MAX_CONTACTS: usize = 8;

/// Points within this distance of touching are kept along with those that touch [m]: until the bodies have moved by
/// this much, no other point can touch.
const SKIN: f64 = 0.001;

/// A point that has moved by less than this since its distance was exact takes the distance along the gradient instead [m].
const FOLLOWED: f64 = 2e-5;

/// Cosine of the smallest angle between a point's own outward normal and the direction out of the other body, for a
/// point of an edge and for one of a face. A point beyond that angle is on the far side of a thin wall; a face point
/// that would leave the other body sideways is near an edge of that body, and that edge's own points find the contact.
const FAR_SIDE: [f64; 2] = [0.3, -0.3];

/// A mesh prepared for contacts with other meshes; built once per object, shared by threads. Of class `exact`.
pub struct ContactBody {
    surface: Arc<ContactSurface>,
    points: SurfacePoints,
    /// Corners of the convex hull, in `Object` [m].
    corners: Vec<Point3<f64>>,
    /// Edges of the mesh, each once, as pairs of vertices.
    edges: Vec<[u32; 2]>,
    /// Centre of the mesh's box [m], and half its diagonal [m].
    centre: Point3<f64>,
    radius: f64,
}

impl ContactBody {
    /// Prepares a mesh whose surface has been prepared already.
    pub fn new(mesh: &TriMesh, surface: Arc<ContactSurface>, sampled: Sampled) -> Self {
        let vertices: Vec<_> = mesh.vertices.iter().map(|vertex| Point3::from(vertex.map(f64::from))).collect();
        // A mesh that lies in a plane touches with its vertices.
        let hull = convex_hull_vertices(&vertices).unwrap_or_else(|| (0..vertices.len() as u32).collect());
        let points = SurfacePoints::new(mesh, &hull, sampled);
        let corners = hull.iter().map(|corner| vertices[*corner as usize]).collect();
        let (centre, extents) = (surface.bounds().centre(), surface.bounds().max - surface.bounds().min);
        let mut edges: Vec<[u32; 2]> = Vec::with_capacity(3 * mesh.triangles.len());
        for [a, b, c] in &mesh.triangles {
            edges.extend([[a, b], [b, c], [c, a]].map(|[one, other]| [*one.min(other), *one.max(other)]));
        }
        edges.sort_unstable();
        edges.dedup();
        Self { surface, points, corners, edges, centre, radius: extents.norm() / 2.0 }
    }

    /// Surface of the body, with its distances.
    pub fn surface(&self) -> &Arc<ContactSurface> {
        &self.surface
    }

    /// Corners of the convex hull, in `Object` [m].
    pub fn corners(&self) -> &[Point3<f64>] {
        &self.corners
    }

    /// Edges of the mesh, each once, as pairs of vertices.
    pub(super) fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// Centre of the mesh's box [m], in `Object`.
    pub(super) fn centre(&self) -> Point3<f64> {
        self.centre
    }

    /// Half the diagonal of the mesh's box [m].
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Points of the surface that are compared with other bodies.
    pub fn points(&self) -> usize {
        self.points.len()
    }

    /// Upper bound on the motion of any point of the body between two of its poses [m].
    fn moved(&self, from: &IsometryMatrix3<f64>, to: &IsometryMatrix3<f64>) -> f64 {
        let angle = (to.rotation.matrix() - from.rotation.matrix()).norm() / std::f64::consts::SQRT_2;
        (to * self.centre - from * self.centre).norm() + angle * self.radius
    }
}

/// A point of one body near the other's surface.
struct Candidate {
    /// Whether it is a point of the second body.
    of_second: bool,
    /// In its own body's frame [m], with its outward normal.
    point: Point3<f64>,
    normal: Vector3<f64>,
    /// One of [`FAR_SIDE`].
    far_side: f64,
    /// Where it was in the other body's frame when its distance was exact [m].
    at: Point3<f64>,
    /// The other surface's closest point, the signed distance [m] and its gradient there, in the other's frame.
    closest: Closest,
    distance: f64,
    gradient: Vector3<f64>,
}

/// Memory of the searches of one thread.
#[derive(Default)]
pub struct BodyScratch {
    waiting: Waiting,
}

/// Contacts of two bodies, step by step: a new search only when they have moved so far that they may touch elsewhere.
///
/// The result depends on the steps before by less than 20 um: a run begins with [`PairTracker::forget`].
#[derive(Default)]
pub struct PairTracker {
    searched: Option<Searched>,
    candidates: Vec<Candidate>,
}

/// Result of the last search, besides the candidates.
struct Searched {
    first_from_second: IsometryMatrix3<f64>,
    /// Lower bound of the distance of all other points from the other surface [m].
    farther: f64,
}

impl PairTracker {
    /// Begins again.
    pub fn forget(&mut self) {
        self.searched = None;
        self.candidates.clear();
    }

    /// Contacts of two overlapping bodies, in the first body's frame, deepest first: at most [`MAX_CONTACTS`], the
    /// deepest one and those whose positions and normals differ most from it. Each has its point on the second body's
    /// surface and its normal out of the first.
    pub fn contacts(
        &mut self,
        [first, second]: [&ContactBody; 2],
        first_from_second: &IsometryMatrix3<f64>,
        scratch: &mut BodyScratch,
        out: &mut Vec<SurfaceContact>,
    ) {
        out.clear();
        self.update([first, second], first_from_second, scratch);
        if self.candidates.is_empty() {
            return;
        }
        let second_from_first = first_from_second.inverse();
        for candidate in &mut self.candidates {
            let (other, other_from_own) = match candidate.of_second {
                true => (first, first_from_second),
                false => (second, &second_from_first),
            };
            if let Some(distance) = candidate.follow(other, other_from_own).filter(|distance| *distance < 0.0) {
                out.push(candidate.contact(distance, first_from_second));
            }
        }
        out.sort_by(|one, other| one.distance.total_cmp(&other.distance));
        spread_out(out, MAX_CONTACTS);
    }

    /// Searches again where the last search is no longer valid.
    fn update(
        &mut self,
        [first, second]: [&ContactBody; 2],
        first_from_second: &IsometryMatrix3<f64>,
        scratch: &mut BodyScratch,
    ) {
        // The last search is valid while neither body has moved by more than the gap of all points left out.
        let known = self.searched.as_ref().is_some_and(|searched| {
            let of_second = second.moved(&searched.first_from_second, first_from_second);
            of_second < searched.farther
                || first.moved(&searched.first_from_second.inverse(), &first_from_second.inverse()) < searched.farther
        });
        if known {
            return;
        }
        // Points of each body near the other's surface.
        self.candidates.clear();
        let sides = [(second, first, *first_from_second), (first, second, first_from_second.inverse())];
        let mut farther = f64::INFINITY;
        for ((own, other, other_from_own), of_second) in sides.into_iter().zip([true, false]) {
            let candidates = &mut self.candidates;
            let mut nearest_left = f64::INFINITY;
            let left_out =
                own.points.near(&other.surface, &other_from_own, SKIN, &mut scratch.waiting, |index, at, bound| {
                    // Deep inside, the surface may be beyond this reach and still count.
                    let reach = if bound < 0.0 { f64::INFINITY } else { 2.0 * SKIN };
                    let Some((closest, distance)) = other.surface.closest_within(&at, reach, None) else {
                        nearest_left = nearest_left.min(2.0 * SKIN);
                        return;
                    };
                    // Points farther than the skin only bound the gap of the next search.
                    if distance > SKIN {
                        nearest_left = nearest_left.min(distance);
                        return;
                    }
                    let gradient = other.surface.gradient(&at, &closest, distance);
                    let own = own.points.get(index);
                    candidates.push(Candidate {
                        of_second,
                        point: own.point,
                        normal: own.normal,
                        far_side: FAR_SIDE[usize::from(!own.is_sharp)],
                        at,
                        closest,
                        distance,
                        gradient,
                    });
                });
            farther = farther.min(left_out).min(nearest_left);
        }
        self.searched = Some(Searched { first_from_second: *first_from_second, farther });
    }
}

impl Candidate {
    /// Signed distance from the other body [m], exact or along the last gradient; `None` on the far side of a thin wall.
    fn follow(&mut self, other: &ContactBody, other_from_own: &IsometryMatrix3<f64>) -> Option<f64> {
        let at = other_from_own * self.point;
        let step = at - self.at;
        let mut distance = self.distance + self.gradient.dot(&step);
        if step.norm_squared() > FOLLOWED * FOLLOWED {
            // One that was clear by more than it has moved since is clear.
            if self.distance > step.norm() {
                return None;
            }
            let found = other.surface.closest_within(&at, f64::INFINITY, Some(&self.closest));
            let (closest, exact) = found.expect("a mesh has a closest point");
            distance = exact;
            self.gradient = other.surface.gradient(&at, &closest, exact);
            (self.at, self.closest, self.distance) = (at, closest, exact);
        }
        let own_normal = other_from_own.rotation * self.normal;
        (own_normal.dot(&self.gradient) <= self.far_side).then_some(distance)
    }

    /// The contact of this point at a distance [m].
    fn contact(&self, distance: f64, first_from_second: &IsometryMatrix3<f64>) -> SurfaceContact {
        if self.of_second {
            let point = first_from_second * self.point;
            return SurfaceContact { point, normal: Unit::new_unchecked(self.gradient), distance };
        }
        // For a point of the first body: its closest point on the second's surface, with the normal into the second.
        let normal = -(first_from_second.rotation * self.gradient);
        SurfaceContact { point: self.point + normal * distance, normal: Unit::new_unchecked(normal), distance }
    }
}

/// Contacts of a body with the half space below the plane z = 0 of its frame, in the body's frame, normals out of the
/// body. Only corners of the body's hull can touch; selects the deepest and those farthest from it, at most
/// [`MAX_CONTACTS`].
pub fn plane_contacts(body: &ContactBody, plane_from_object: &IsometryMatrix3<f64>, out: &mut Vec<SurfaceContact>) {
    out.clear();
    let up = plane_from_object.rotation.inverse() * Vector3::z();
    let level = plane_from_object.translation.vector.z;
    for corner in &body.corners {
        let distance = up.dot(&corner.coords) + level;
        if distance < 0.0 {
            let normal = Unit::new_unchecked(-up);
            out.push(SurfaceContact { point: corner - up * distance, normal, distance });
        }
    }
    out.sort_by(|one, other| one.distance.total_cmp(&other.distance));
    spread_out(out, MAX_CONTACTS);
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    use nalgebra::{Translation3, UnitQuaternion};

    use super::*;
    use crate::{test_shapes::built_in, voxel::InsideTest};

    fn body(mesh: &TriMesh, sampled: Sampled) -> ContactBody {
        let surface = Arc::new(ContactSurface::new(mesh, InsideTest::WindingNumber).expect("a surface"));
        ContactBody::new(mesh, surface, sampled)
    }

    /// A box around the origin.
    fn cuboid(half: [f64; 3]) -> TriMesh {
        let corner = |index: usize| {
            std::array::from_fn(|axis| (if index >> axis & 1 == 1 { half[axis] } else { -half[axis] }) as f32)
        };
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        TriMesh { vertices: (0..8).map(corner).collect(), triangles }
    }

    /// A body of revolution about z: its profile of (radius, height) from the bottom of the axis outside round to the axis.
    fn lathe(profile: &[[f64; 2]], segments: u32) -> TriMesh {
        let mut mesh = TriMesh::default();
        for [radius, height] in profile {
            for segment in 0..segments {
                let angle = TAU * f64::from(segment) / f64::from(segments);
                let [x, y] = [radius * libm::cos(angle), radius * libm::sin(angle)];
                mesh.vertices.push([x as f32, y as f32, *height as f32]);
            }
        }
        for ring in 0..profile.len() as u32 - 1 {
            for segment in 0..segments {
                let next = (segment + 1) % segments;
                let [a, b] = [ring * segments + segment, ring * segments + next];
                let [c, d] = [a + segments, b + segments];
                mesh.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| Point3::from(mesh.vertices[vertex as usize].map(f64::from)));
            (b - a).cross(&(c - a)).norm() > 1e-12
        };
        let triangles = mesh.triangles.iter().filter(|triangle| area(triangle)).copied().collect();
        TriMesh { triangles, ..mesh }
    }

    /// The profile of an arc of a circle around a height on the axis, from one angle above the horizontal to another.
    fn arc(radius: f64, height: f64, from: f64, to: f64, steps: u32) -> Vec<[f64; 2]> {
        let at = |step| from + (to - from) * f64::from(step) / f64::from(steps);
        let point = |angle| [(radius * libm::cos(angle)).max(0.0), height + radius * libm::sin(angle)];
        (0..=steps).map(|step| point(at(step))).collect()
    }

    fn contacts(first: &ContactBody, second: &ContactBody, placed: &IsometryMatrix3<f64>) -> Vec<SurfaceContact> {
        let mut out = Vec::new();
        PairTracker::default().contacts([first, second], placed, &mut BodyScratch::default(), &mut out);
        out
    }

    #[test]
    fn a_box_on_a_box_is_carried_at_the_corners_of_what_they_share() {
        let [lower, upper] =
            [[0.05, 0.04, 0.02], [0.03, 0.06, 0.01]].map(|half| body(&cuboid(half), Sampled::Everywhere));
        for (yaw, depth) in [(0.0, 1e-4), (0.0, 4e-4), (0.5, 2e-4), (1.2, 3e-5)] {
            let rotation = IsometryMatrix3::rotation(Vector3::z() * yaw);
            let placed = Translation3::new(0.0, 0.0, 0.03 - depth) * rotation;
            let found = contacts(&lower, &upper, &placed);
            assert_eq!(found.len(), MAX_CONTACTS, "yaw {yaw}");
            for contact in &found {
                assert!((contact.distance + depth).abs() < 1e-7, "{contact:?}");
                assert!((contact.normal.z - 1.0).abs() < 1e-6, "{contact:?}");
                assert!((contact.point.z - (0.02 - depth)).abs() < 1e-6, "{contact:?}");
            }
            // They hold against tipping: whichever way, some contact lies near the far end of the shared face.
            for step in 0..16 {
                let angle = TAU * f64::from(step) / 16.0;
                let way = Vector3::new(libm::cos(angle), libm::sin(angle), 0.0);
                let reached =
                    found.iter().map(|contact| way.dot(&contact.point.coords)).fold(f64::NEG_INFINITY, f64::max);
                assert!(reached > 0.018, "yaw {yaw}: {reached} m towards {way:?}");
            }
            // Seen from the other body: the same distances, the other way round.
            let mut back = contacts(&upper, &lower, &placed.inverse());
            back.sort_by(|one, other| one.distance.total_cmp(&other.distance));
            assert!(back.iter().all(|contact| (placed.rotation * contact.normal.into_inner()).z < -0.999_999));
        }
        assert!(contacts(&lower, &upper, &IsometryMatrix3::translation(0.0, 0.0, 0.0301)).is_empty());
    }

    #[test]
    fn crossed_edges_touch_within_a_cell_of_where_they_cross() {
        // Two beams, each upright on an edge, across each other.
        let beam = body(&cuboid([0.06, 0.01, 0.01]), Sampled::Everywhere);
        let on_edge = IsometryMatrix3::rotation(Vector3::x() * (PI / 4.0));
        let half = 0.01 * 2.0_f64.sqrt();
        let across = IsometryMatrix3::rotation(Vector3::z() * FRAC_PI_2) * on_edge;
        for depth in [3e-3, 4e-3] {
            let upper = Translation3::new(0.0, 0.0, 2.0 * half - depth) * across;
            let found = contacts(&beam, &beam, &(on_edge.inverse() * upper));
            let deepest = found.first().expect("they overlap");
            let normal = on_edge * deepest.normal.into_inner();
            // A point of an edge inside the other beam leaves through one of two faces at 45 degrees.
            assert!((-deepest.distance - depth / 2.0_f64.sqrt()).abs() < 1e-6, "{deepest:?}");
            assert!((normal.z - 0.5_f64.sqrt()).abs() < 1e-6, "{normal:?}");
            assert!((on_edge * deepest.point).xy().coords.norm() < 0.006, "{deepest:?}");
        }
    }

    #[test]
    fn a_ball_on_a_plane_and_on_the_floor_of_a_bin() {
        let radius = 0.035;
        let ball = lathe(&arc(radius, 0.0, -FRAC_PI_2, FRAC_PI_2, 180), 256);
        let ball = body(&ball, Sampled::Everywhere);
        let bin = body(&TriMesh::open_box([0.4, 0.3, 0.2], 0.02), Sampled::Edges);
        for depth in [2e-4, 5e-4] {
            let placed = IsometryMatrix3::translation(0.05, -0.03, radius - depth);
            let found = contacts(&bin, &ball, &placed);
            let deepest = found.first().expect("the ball rests on the floor");
            assert!((deepest.distance + depth).abs() < 1e-7, "{deepest:?}");
            assert!((deepest.normal.z - 1.0).abs() < 1e-6);
            let mut on_plane = Vec::new();
            plane_contacts(&ball, &placed, &mut on_plane);
            assert!((on_plane[0].distance + depth).abs() < 1e-6, "{:?}", on_plane[0]);
            assert!((on_plane[0].normal.z + 1.0).abs() < 1e-12);
        }
        // Rough as a scan, with vertices nearer to each other than a cell is wide: its lowest vertex determines how
        // deep it is.
        let mut rough = lathe(&arc(radius, 0.0, -FRAC_PI_2, FRAC_PI_2, 90), 128);
        for (index, vertex) in (0_u32..).zip(&mut rough.vertices) {
            let share = f64::from(index.wrapping_mul(2_654_435_761)) / f64::from(u32::MAX);
            *vertex = vertex.map(|part| part * (1.0 - 0.01 * share as f32));
        }
        let rough_body = body(&rough, Sampled::Everywhere);
        for angle in [0.3, 0.9, 1.4] {
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(angle, 0.4, 0.0));
            let low = |mesh: &TriMesh| {
                let height = |vertex: &[f32; 3]| (rotation * Point3::from(vertex.map(f64::from))).z;
                mesh.vertices.iter().map(height).fold(f64::INFINITY, f64::min)
            };
            let at = Translation3::new(0.05, -0.03, -low(&rough) - 3e-4);
            let placed = IsometryMatrix3::from_parts(at, rotation.to_rotation_matrix());
            let deepest = contacts(&bin, &rough_body, &placed)[0];
            assert!((deepest.distance + 3e-4).abs() < 1e-7, "{deepest:?}");
        }
        // In a corner it touches the floor and two walls.
        let corner = IsometryMatrix3::translation(0.2 - radius + 3e-4, 0.15 - radius + 3e-4, radius - 3e-4);
        let found = contacts(&bin, &ball, &corner);
        for wall in [-Vector3::x(), -Vector3::y(), Vector3::z()] {
            assert!(found.iter().any(|contact| contact.normal.dot(&wall) > 0.999), "{wall:?}: {found:?}");
        }
        // The rim of a wall carries a box that lies across it.
        let plate = body(&cuboid([0.05, 0.05, 0.01]), Sampled::Everywhere);
        let found = contacts(&bin, &plate, &IsometryMatrix3::translation(0.21, 0.0, 0.21 - 1e-4));
        assert!(found.len() >= 4 && found.iter().all(|contact| (contact.distance + 1e-4).abs() < 1e-6), "{found:?}");
    }

    #[test]
    fn a_ball_in_a_bowl_touches_inside_not_at_its_hull() {
        let (inner, wall, radius) = (0.06, 0.002, 0.02);
        let mut profile = arc(inner + wall, 0.0, -FRAC_PI_2, 0.0, 90);
        profile.extend(arc(inner, 0.0, 0.0, -FRAC_PI_2, 90));
        let bowl = body(&lathe(&profile, 256), Sampled::Everywhere);
        let ball = body(&lathe(&arc(radius, 0.0, -FRAC_PI_2, FRAC_PI_2, 120), 192), Sampled::Everywhere);
        for (angle, depth) in [(0.0, 3e-4), (0.4, 3e-4), (0.9, 2e-4)] {
            // The centre that far from the bowl's, along a direction down and aside.
            let way = Vector3::new(libm::sin(angle), 0.0, -libm::cos(angle));
            let centre = way * (inner - radius + depth);
            let found = contacts(&bowl, &ball, &IsometryMatrix3::translation(centre.x, centre.y, centre.z));
            let deepest = found.first().expect("the ball rests in the bowl");
            // Facets of both, and points one cell apart.
            let slack = 0.0025_f64.powi(2) / 2.0 * (1.0 / radius - 1.0 / inner) + 2e-5;
            assert!((-deepest.distance - depth).abs() < slack, "{angle}: {deepest:?}");
            assert!(deepest.normal.dot(&-way) > 0.99, "{angle}: {deepest:?}");
        }
        // In the middle of the bowl it floats, although its hull would hold it.
        assert!(contacts(&bowl, &ball, &IsometryMatrix3::translation(0.0, 0.0, -0.01)).is_empty());
    }

    #[test]
    fn cups_nest_until_their_walls_touch() {
        // A cone of a cup: at a wall of this slope a step down moves the walls together by its sine.
        let (bottom, top, height, wall) = (0.03, 0.04, 0.1, 0.0015);
        let slope = libm::atan2(top - bottom, height);
        let across = wall / libm::cos(slope);
        // The inner wall is as steep as the outer one.
        let inside = bottom + (top - bottom) * wall / height - across;
        let profile = [[0.0, 0.0], [bottom, 0.0], [top, height], [top - across, height], [inside, wall], [0.0, wall]];
        let cup = body(&lathe(&profile, 512), Sampled::Everywhere);
        // Lifted by this much, the outer wall of the upper cup touches the inner wall of the lower.
        let touching = wall / libm::sin(slope);
        for depth in [1e-4, 3e-4] {
            let down = depth / libm::sin(slope);
            let found = contacts(&cup, &cup, &IsometryMatrix3::translation(0.0, 0.0, touching - down));
            assert_eq!(found.len(), MAX_CONTACTS);
            for contact in &found {
                assert!((-contact.distance - depth).abs() < 2e-5, "{contact:?}");
                // Out of the lower cup: inward and up.
                let inward = -Vector3::new(contact.point.x, contact.point.y, 0.0).normalize();
                assert!(contact.normal.dot(&inward) > 0.99, "{contact:?}");
            }
            // All round.
            let angles = found.iter().map(|contact| libm::atan2(contact.point.y, contact.point.x));
            let mut angles: Vec<f64> = angles.collect();
            angles.sort_by(f64::total_cmp);
            let gap = angles.windows(2).map(|pair| pair[1] - pair[0]).fold(TAU - (angles[7] - angles[0]), f64::max);
            assert!(gap < PI, "{angles:?}");
        }
        let clear = IsometryMatrix3::translation(0.0, 0.0, touching + 1e-3);
        assert!(contacts(&cup, &cup, &clear).is_empty());
    }

    /// Two bodies that slide, rotate and jump: a tracker finds what a fresh search finds.
    #[test]
    fn remembering_finds_the_same_contacts() {
        let [mug, can] = ["mug-01@16k", "can-01"].map(|name| body(&built_in(name), Sampled::Everywhere));
        let mut tracker = PairTracker::default();
        let (mut scratch, mut found, mut touched) = (BodyScratch::default(), Vec::new(), 0);
        let top = mug.surface.bounds().max.z - can.surface.bounds().min.z;
        for step in 0..1500 {
            let (slow, jump) = (f64::from(step) * 3e-6, f64::from(step / 500) * 0.004);
            let position = Vector3::new(slow + jump, 0.2 * slow, top - 4e-4 + 1e-4 * libm::sin(f64::from(step) * 0.02));
            let placed = IsometryMatrix3::new(position, Vector3::new(slow * 3.0, slow, 20.0 * slow));
            tracker.contacts([&mug, &can], &placed, &mut scratch, &mut found);
            let anew = contacts(&mug, &can, &placed);
            let deepest = |found: &[SurfaceContact]| found.first().map_or(0.0, |contact| contact.distance);
            assert!((deepest(&found) - deepest(&anew)).abs() < FOLLOWED, "step {step}: {found:?} {anew:?}");
            touched += usize::from(found.len() >= 3);
        }
        assert!(touched > 400, "{touched}");
        tracker.forget();
        assert!(tracker.searched.is_none());
    }
}
