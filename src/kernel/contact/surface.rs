//! A mesh, prepared for contacts with solids.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};

use super::{DistanceGrid, Probe, piece::Piece, trail::Trail};
use crate::{
    geom::{Aabb, NoSurface, PackedSolid, SolidGrid, TriMesh, TriangleTree, convex_hull_corners},
    voxel::{
        InsideTest,
        channels::{Closest, Surface},
        solid_occupancy,
    },
};

/// Cells of the distance grid along the mesh's longest side: enough to rule out distant parts.
const CELLS: u32 = 64;
/// Margin of the distance grid around the mesh's box [m].
const MARGIN: f64 = 0.012;
/// Contacts of one solid are at least so far apart [m], unless they press in different directions.
const SEPARATION: f64 = 0.008;
/// From a piece to its closest point: projections onto the surface and back onto the core, at most.
const PROJECTIONS: usize = 24;
/// Least decrease of the distance per step [m]: a step that gains less ends the iteration.
const NEARER: f64 = 1e-8;
/// Distances below which directions are lost [m].
const SETTLED: f64 = 1e-7;
/// Distance between two contacts that counts as much as an angle of 60 degrees between their normals [m].
const NORMAL_WEIGHT: f64 = 0.05;
/// Cosine of the smallest angle between the directions in which one point of a core is pressed.
pub(super) const OTHER_WALL: f64 = 0.8;

/// A mesh's surface with what makes contacts cheap; built once per object, shared by threads. Of class `exact`.
pub struct ContactSurface {
    surface: Arc<Surface>,
    solid: Arc<PackedSolid>,
    distances: DistanceGrid,
}

/// Where a solid touches the surface, in `Object`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceContact {
    /// The point of the solid's surface that touches [m].
    pub point: Point3<f64>,
    /// Out of the mesh.
    pub normal: Unit<Vector3<f64>>,
    /// From the mesh to that point [m], exact: negative where it lies inside.
    pub distance: f64,
}

/// Memory of one thread's search.
#[derive(Default)]
pub struct ContactScratch {
    pub(super) waiting: Vec<Piece>,
    pub(super) seeds: Vec<Seed>,
    /// Balls in which nothing touches, around points of the core: centres and radii [m].
    pub(super) free: Vec<(Point3<f64>, f64)>,
    /// Points of the core from which the surface is at least so far away [m].
    pub(super) known: Vec<(Point3<f64>, f64)>,
    minima: Vec<Minimum>,
    /// Points of the core that are nearer to the surface than those around them, and the directions out of it there.
    pub(super) cores: Vec<(Point3<f64>, Vector3<f64>)>,
}

/// A piece of the core near which the surface may be, in the probe's frame.
pub(super) struct Seed {
    pub(super) point: Point3<f64>,
    /// Distance that the piece reaches from there [m].
    pub(super) reach: f64,
    /// Lower bound of its signed distance, and about how much that is [m].
    pub(super) bound: f64,
    pub(super) about: f64,
}

/// A point of a core that is nearer to the surface than those around it.
pub(super) struct Minimum {
    /// In the probe's frame.
    core: Point3<f64>,
    pair: Pair,
}

impl Minimum {
    /// Whether another point of the core is so near that it counts as this one.
    fn is_near(&self, other: &Point3<f64>) -> bool {
        are_near(&self.core, other)
    }

    pub(super) fn pair(&self) -> &Pair {
        &self.pair
    }

    /// Whether two points are so near to each other that they count as one.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.is_near(&other.core)
    }
}

/// The nearest pair of a core and the surface, from some start.
pub(super) struct Pair {
    /// On the core, in `Object`.
    core: Point3<f64>,
    /// On the surface.
    closest: Closest,
    /// Out of the mesh.
    normal: Vector3<f64>,
    /// From the surface to the core [m], negative inside.
    distance: f64,
}

impl Pair {
    /// The point of the core, in `Object`.
    pub(super) fn core(&self) -> &Point3<f64> {
        &self.core
    }

    /// From the surface to the core [m], negative inside.
    pub(super) fn distance(&self) -> f64 {
        self.distance
    }

    /// Direction out of the mesh, in `Object`.
    pub(super) fn normal(&self) -> &Vector3<f64> {
        &self.normal
    }
}

impl ContactSurface {
    /// Prepares a mesh. Distances around it are measured later, on first use.
    ///
    /// # Errors
    /// When the mesh has no triangles.
    pub fn new(mesh: &TriMesh, inside: InsideTest) -> Result<Self, NoSurface> {
        Self::of_parts(mesh, Arc::new(Surface::new(mesh)), &solid_occupancy(mesh, inside, false))
    }

    /// Adds a distance grid, which is measured where it is needed, to a mesh's surface and solid that have been made already.
    ///
    /// # Errors
    /// When the mesh has no triangles.
    pub fn of_parts(mesh: &TriMesh, surface: Arc<Surface>, solid: &SolidGrid) -> Result<Self, NoSurface> {
        let bounds = mesh.aabb().filter(|bounds| bounds.longest_side() > 0.0 && !mesh.triangles.is_empty());
        let Some(bounds) = bounds else {
            let (triangles, vertices) = (mesh.triangles.len(), mesh.vertices.len());
            return Err(NoSurface { triangles, vertices, reason: "it has no surface".to_owned() });
        };
        let solid = Arc::new(PackedSolid::from(solid));
        let distances = DistanceGrid::new(Arc::clone(&surface), Arc::clone(&solid), &bounds, CELLS, MARGIN);
        Ok(Self { surface, solid, distances })
    }

    /// The mesh's box, in `Object`.
    pub fn bounds(&self) -> &Aabb {
        self.distances.bounds()
    }

    /// The solid that it bounds, unpacked.
    pub fn solid(&self) -> SolidGrid {
        self.solid.to_grid()
    }

    /// Vertices of the mesh, in `Object` [m].
    pub(super) fn vertices(&self) -> &[[f32; 3]] {
        self.surface.vertices()
    }

    /// Tree over the mesh's triangles.
    pub(super) fn tree(&self) -> &TriangleTree {
        self.surface.tree()
    }

    /// Corners of the mesh's convex hull, in `Object` [m], which can touch a plane. `None` if all vertices are in one
    /// plane.
    pub fn hull_corners(&self) -> Option<Vec<Point3<f64>>> {
        let points: Vec<_> = self.surface.vertices().iter().map(|vertex| Point3::from(vertex.map(f64::from))).collect();
        convex_hull_corners(&points)
    }

    /// Signed distance from the surface to a point in `Object` [m], negative inside; exact.
    pub fn signed_distance(&self, point: &Point3<f64>) -> f64 {
        self.surface.signed_distance(&*self.solid, point)
    }

    /// About the signed distance from the surface to a point in `Object` [m], read off a lattice; beyond its margin a lower bound.
    pub fn approximate_distance(&self, point: &Point3<f64>) -> f64 {
        self.distances.about(point)
    }

    /// The surface's closest point to a point in `Object`, and the signed distance [m], negative inside; exact. An answer
    /// nearby makes it faster.
    pub fn closest(&self, point: &Point3<f64>, hint: Option<&Closest>) -> (Closest, f64) {
        let closest = self.surface.closest_from(point, f64::INFINITY, hint).expect("a mesh has a closest point");
        let distance = closest.distance_squared.sqrt();
        let inside = self.surface.inside(&*self.solid, point, Some(&closest));
        (closest, if inside { -distance } else { distance })
    }

    /// The surface's closest point strictly within `reach` [m] of a point in `Object`, and the signed distance [m], negative
    /// inside; exact. An answer nearby makes it faster.
    pub(super) fn closest_within(
        &self,
        point: &Point3<f64>,
        reach: f64,
        hint: Option<&Closest>,
    ) -> Option<(Closest, f64)> {
        let closest = self.surface.closest_from(point, reach, hint)?;
        let distance = closest.distance_squared.sqrt();
        let inside = self.surface.inside(&*self.solid, point, Some(&closest));
        Some((closest, if inside { -distance } else { distance }))
    }

    /// Direction of steepest rise of the signed distance at a point with its closest point and distance [m]: a unit vector out
    /// of the mesh.
    pub(super) fn gradient(&self, point: &Point3<f64>, closest: &Closest, distance: f64) -> Vector3<f64> {
        self.away(point, closest, distance)
    }

    /// A lower bound of the signed distance from the surface to a point in `Object` [m], off the lattice.
    pub(super) fn at_least(&self, point: &Point3<f64>) -> f64 {
        self.distances.at_least(point)
    }

    /// An upper bound of the same.
    pub(super) fn at_most(&self, point: &Point3<f64>) -> f64 {
        self.distances.at_most(point)
    }

    /// Direction of steepest rise of the signed distance at a point in `Object`, and the distance [m]; on the surface itself
    /// its outward normal.
    pub fn outward(&self, point: &Point3<f64>) -> (Vector3<f64>, f64) {
        let (closest, distance) = self.closest(point, None);
        let away =
            if distance.abs() > 1e-6 { (point - closest.point) / distance } else { self.surface.normal(&closest) };
        (away, distance)
    }

    /// The surface point at `share` (0 to 1) of the cumulative area and at (u, v), both in 0 to 1, of its triangle,
    /// with the outward unit normal there; in `Object`. Uniform numbers give points uniform over the area.
    pub fn point_at(&self, share: f64, u: f64, v: f64) -> Option<(Point3<f64>, Vector3<f64>)> {
        self.surface.point_at(share, u, v)
    }

    /// Contacts of a solid placed in `Object` that is nearer to the surface than `margin` [m]: the nearest point and
    /// those that differ most from it, at most [`Probe::max_contacts`], nearest first.
    pub fn contacts(
        &self,
        probe: &Probe,
        object_from_probe: &IsometryMatrix3<f64>,
        margin: f64,
        scratch: &mut ContactScratch,
        out: &mut Vec<SurfaceContact>,
    ) {
        out.clear();
        let mut minima = std::mem::take(&mut scratch.minima);
        self.search(probe, object_from_probe, margin, scratch, &mut minima);
        let pairs = minima.iter().map(|minimum| &minimum.pair).enumerate();
        self.list(probe, margin, pairs, |_, point, reach| self.surface.closest(point, reach), out);
        scratch.minima = minima;
    }

    /// All local minima of the distance from a solid's core to the surface, where the solid is nearer to it than
    /// `margin` [m]. Every other part of the solid is farther away than the returned points.
    pub(super) fn search(
        &self,
        probe: &Probe,
        object_from_probe: &IsometryMatrix3<f64>,
        margin: f64,
        scratch: &mut ContactScratch,
        minima: &mut Vec<Minimum>,
    ) -> f64 {
        let farther = self.seeds(probe, object_from_probe, margin, scratch);
        let ContactScratch { seeds, free, .. } = scratch;
        free.clear();
        minima.clear();
        let probe_from_object = object_from_probe.inverse();
        let near = |minima: &[Minimum], point: &Point3<f64>| minima.iter().any(|known| known.is_near(point));
        let max = probe.thickness + margin;
        for Seed { point, reach, bound, .. } in seeds.iter() {
            // Pieces inside a ball already found free, or at a known minimum, are settled.
            let known = free.iter().any(|(known, radius)| (known - point).norm() + reach < *radius);
            if known || near(minima, point) {
                continue;
            }
            let start = object_from_probe * point;
            // Deep inside, the surface may be beyond this reach and still count.
            let limit = if *bound < 0.0 { f64::INFINITY } else { max + reach };
            let Some(closest) = self.surface.closest(&start, limit) else { continue };
            // Inside the mesh the closest point completes the pair. Outside, the search slides to a local minimum.
            let pair = if *bound < 0.0 && self.surface.inside(&*self.solid, &start, Some(&closest)) {
                self.pair_inside(start, closest)
            } else {
                let distance = closest.distance_squared.sqrt();
                // Free ball: everywhere inside it the surface is at least `max` away.
                free.push((*point, distance - max));
                if distance > max + reach {
                    continue;
                }
                self.slide(probe, [object_from_probe, &probe_from_object], start, closest)
            };
            // Minimum in the probe's frame, each kept once.
            let core = probe_from_object * pair.core;
            if near(minima, &core) {
                continue;
            }
            // Contact within the margin, or one more free ball.
            if pair.distance < max {
                minima.push(Minimum { core, pair });
            } else {
                free.push((core, pair.distance - max));
            }
        }
        farther
    }

    /// The nearest pair from a point of the core on, placed in `Object`. From a point outside the mesh, it slides to
    /// the nearest point of the core, unless the direction out of its nearest surface is already known. `None` if the
    /// surface is beyond a reach of that point [m].
    pub(super) fn pair_from(
        &self,
        probe: &Probe,
        [object_from_probe, probe_from_object]: [&IsometryMatrix3<f64>; 2],
        start: Point3<f64>,
        reach: f64,
        is_known: impl FnOnce(&Vector3<f64>) -> bool,
    ) -> Option<Pair> {
        let may_be_inside = self.distances.at_least(&start) < 0.0;
        let closest = self.surface.closest(&start, if may_be_inside { f64::INFINITY } else { reach })?;
        if may_be_inside && self.surface.inside(&*self.solid, &start, Some(&closest)) {
            return Some(self.pair_inside(start, closest));
        }
        let distance = closest.distance_squared.sqrt();
        if distance > reach {
            return None;
        }
        let normal = self.away(&start, &closest, distance);
        if is_known(&normal) {
            return Some(Pair { core: start, closest, normal, distance });
        }
        Some(self.slide(probe, [object_from_probe, probe_from_object], start, closest))
    }

    /// Slides a point of the core, outside of the mesh, to where core and surface are nearest to each other.
    pub(super) fn slide(
        &self,
        probe: &Probe,
        [object_from_probe, probe_from_object]: [&IsometryMatrix3<f64>; 2],
        start: Point3<f64>,
        closest: Closest,
    ) -> Pair {
        self.followed(probe, object_from_probe, probe_from_object, start, closest, |from, next, closest| {
            // Such a small step brings the two no nearer than the step is long.
            let stands = (next - from).norm_squared() <= NEARER * NEARER;
            (!stands).then(|| self.surface.closest_from(next, f64::INFINITY, Some(closest)))?
        })
    }

    /// Follows a point that a search has found to where it is with the solid placed elsewhere.
    pub(super) fn follow(
        &self,
        probe: &Probe,
        object_from_probe: &IsometryMatrix3<f64>,
        probe_from_object: &IsometryMatrix3<f64>,
        minimum: &mut Minimum,
        Trail { near, .. }: &mut Trail,
    ) {
        let start = object_from_probe * minimum.core;
        let closest = near.closest(&self.surface, &start, f64::INFINITY, Some(&minimum.pair.closest));
        let closest = closest.expect("a mesh has a closest point");
        let may_be_inside = self.distances.at_least(&start) < 0.0;
        minimum.pair = if may_be_inside && self.surface.inside(&*self.solid, &start, Some(&closest)) {
            self.pair_inside(start, closest)
        } else {
            self.followed(probe, object_from_probe, probe_from_object, start, closest, |from, next, closest| {
                // Such a small step brings the two no nearer than the step is long.
                let stands = near.remembers && (next - from).norm_squared() <= NEARER * NEARER;
                (!stands).then(|| near.closest(&self.surface, next, f64::INFINITY, Some(closest)))?
            })
        };
        minimum.core = probe_from_object * minimum.pair.core;
    }

    /// The contacts of pairs that are nearer than `margin`, the nearest first; each with the memory of its point.
    pub(super) fn list_followed<'a>(
        &self,
        probe: &Probe,
        margin: f64,
        pairs: impl Iterator<Item = (usize, &'a Pair)>,
        trails: &mut [Trail],
        out: &mut Vec<SurfaceContact>,
    ) {
        let beyond =
            |index: usize, point: &Point3<f64>, reach| trails[index].beyond.closest(&self.surface, point, reach, None);
        self.list(probe, margin, pairs, beyond, out);
    }

    /// The contacts of pairs that are nearer than `margin`, the nearest first; `closest` searches the surface from a point
    /// within a reach.
    fn list<'a>(
        &self,
        probe: &Probe,
        margin: f64,
        pairs: impl Iterator<Item = (usize, &'a Pair)>,
        mut closest: impl FnMut(usize, &Point3<f64>, f64) -> Option<Closest>,
        out: &mut Vec<SurfaceContact>,
    ) {
        for (index, pair) in pairs {
            let contact = SurfaceContact {
                point: pair.core - pair.normal * probe.thickness,
                normal: Unit::new_unchecked(pair.normal),
                distance: pair.distance - probe.thickness,
            };
            if contact.distance < margin {
                out.push(contact);
                let other = other_wall(probe, pair, |point, reach| closest(index, point, reach));
                out.extend(other.filter(|other| other.distance < margin));
            }
        }
        out.sort_by(|one, other| one.distance.total_cmp(&other.distance));
        spread_out(out, probe.max_contacts());
    }

    /// The points of the core that the distance grid does not rule out, the nearest first; how far the solid is from the
    /// surface elsewhere at least [m].
    pub(super) fn seeds(
        &self,
        probe: &Probe,
        object_from_probe: &IsometryMatrix3<f64>,
        margin: f64,
        scratch: &mut ContactScratch,
    ) -> f64 {
        let ContactScratch { waiting, seeds, .. } = scratch;
        seeds.clear();
        waiting.clear();
        waiting.push(Piece::whole(probe));
        let mut farther = f64::INFINITY;
        while let Some(piece) = waiting.pop() {
            let centre = Point3::from(piece.centre);
            let clear = self.distances.at_least(&(object_from_probe * centre)) - piece.half.norm() - probe.thickness;
            if clear > margin {
                farther = farther.min(clear);
                continue;
            }
            match piece.halves() {
                Some(halves) => waiting.extend(halves),
                None => {
                    let point = probe.nearest(&centre);
                    let seen = object_from_probe * point;
                    let (bound, about) = (self.distances.at_least(&seen), self.distances.about(&seen));
                    // Nearest points are nearer to each other than the shapes that contain them.
                    seeds.push(Seed { point, reach: piece.half.norm(), bound, about });
                }
            }
        }
        seeds.sort_by(|one, other| one.about.total_cmp(&other.about));
        if seeds.is_empty() { farther } else { farther.min(margin) }
    }

    /// The pair of a point inside the mesh.
    fn pair_inside(&self, core: Point3<f64>, closest: Closest) -> Pair {
        let distance = -closest.distance_squared.sqrt();
        Pair { core, closest, normal: self.away(&core, &closest, distance), distance }
    }

    /// Follows a point of the core, outside of the mesh, to where core and surface are nearest to each other. `closest_near`
    /// goes from a point of the core with its closest point to the next point.
    fn followed(
        &self,
        probe: &Probe,
        object_from_probe: &IsometryMatrix3<f64>,
        probe_from_object: &IsometryMatrix3<f64>,
        start: Point3<f64>,
        closest: Closest,
        mut closest_near: impl FnMut(&Point3<f64>, &Point3<f64>, &Closest) -> Option<Closest>,
    ) -> Pair {
        let (mut core, mut closest) = (start, closest);
        // A solid nearly parallel to the surface moves slowly: while it comes nearer, it takes longer steps.
        let mut stretch = 1.0;
        for _ in 0..PROJECTIONS {
            let next = object_from_probe * probe.nearest(&(probe_from_object * closest.point));
            let next = match stretch {
                1.0 => next,
                stretch => object_from_probe * probe.nearest(&(probe_from_object * (core + (next - core) * stretch))),
            };
            let found = closest_near(&core, &next, &closest);
            // Where the surface cuts the core no direction out can be read from it.
            let found = found.filter(|found| found.distance_squared > SETTLED * SETTLED);
            let nearer = found.filter(|found| closest.distance_squared.sqrt() - found.distance_squared.sqrt() > NEARER);
            match nearer {
                Some(found) => {
                    (core, closest) = (next, found);
                    stretch *= 2.0;
                }
                None if stretch > 1.0 => stretch = 1.0,
                None => break,
            }
        }
        let distance = closest.distance_squared.sqrt();
        Pair { core, closest, normal: self.away(&core, &closest, distance), distance }
    }

    /// Direction out of the mesh at the closest point to a point at a signed distance.
    fn away(&self, point: &Point3<f64>, closest: &Closest, distance: f64) -> Vector3<f64> {
        if distance.abs() > SETTLED { (point - closest.point) / distance } else { self.surface.normal(closest) }
    }
}

/// Whether two points of a core count as one.
pub(super) fn are_near(one: &Point3<f64>, other: &Point3<f64>) -> bool {
    (one - other).norm_squared() < SEPARATION * SEPARATION
}

/// A ball, or the end of a capsule, may lie in a corner: another part of the surface that the same point of the core is near
/// to, in another direction. `closest` searches the surface from a point within a reach.
fn other_wall(
    probe: &Probe,
    pair: &Pair,
    closest: impl FnOnce(&Point3<f64>, f64) -> Option<Closest>,
) -> Option<SurfaceContact> {
    if probe.max_contacts() > 2 || pair.distance <= 0.0 {
        return None;
    }
    // Seen from farther away from the wall, another one is the nearest.
    let beyond = pair.core + pair.normal * (probe.thickness - pair.distance).abs().max(probe.thickness / 2.0);
    let closest = closest(&beyond, 2.0 * probe.thickness)?;
    let away = pair.core - closest.point;
    let distance = away.norm();
    let normal = away / distance;
    let other = distance > SETTLED && normal.dot(&pair.normal) < OTHER_WALL;
    other.then(|| SurfaceContact {
        point: pair.core - normal * probe.thickness,
        normal: Unit::new_unchecked(normal),
        distance: distance - probe.thickness,
    })
}

/// Keeps the nearest contact and, of the others, those whose positions and normals differ most from the kept ones;
/// preserves their order. On a flat pad against a flat face any point may be the nearest: with contacts at one side of
/// the patch only, the held object would rotate and creep.
pub(super) fn spread_out(contacts: &mut Vec<SurfaceContact>, max: usize) {
    let unlike = |one: &SurfaceContact, other: &SurfaceContact| {
        let between_normals = (one.normal.into_inner() - other.normal.into_inner()).norm_squared();
        (one.point - other.point).norm_squared() + NORMAL_WEIGHT * NORMAL_WEIGHT * between_normals
    };
    // Of each contact that is not kept the distance to the kept one that it is most like.
    let mut likeness = vec![f64::INFINITY; contacts.len()];
    for kept in 1..max.min(contacts.len()) {
        let known = contacts[kept - 1];
        // Of several equally unlike the nearest.
        let mut next = (kept, f64::NEG_INFINITY);
        for (at, (contact, likeness)) in contacts.iter().zip(&mut likeness).enumerate().skip(kept) {
            *likeness = likeness.min(unlike(&known, contact));
            if *likeness > next.1 {
                next = (at, *likeness);
            }
        }
        contacts[kept..=next.0].rotate_right(1);
        likeness[kept..=next.0].rotate_right(1);
    }
    contacts.truncate(max);
    contacts.sort_by(|one, other| one.distance.total_cmp(&other.distance));
}
