//! Distances from a mesh to a solid, without their contacts.

use std::ops::{Range, RangeInclusive};

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{
    ContactScratch, ContactSurface, Probe,
    piece::Piece,
    surface::{OTHER_WALL, Pair, Seed, are_near},
};

/// Where a point of the core slides to, the surface cuts the core if it is nearer than this [m].
const CUT: f64 = 5e-5;
/// Two distances are the same when they differ by less [m].
const FLAT: f64 = 1e-6;
/// Corners of the core that are tried from a point on, at most.
const CORNERS: usize = 4;

impl ContactSurface {
    /// A lower bound of the distance from the surface to a solid placed in `Object` [m]; below 0 where they may overlap.
    pub fn clearance_at_least(&self, probe: &Probe, object_from_probe: &IsometryMatrix3<f64>) -> f64 {
        self.bound(probe, object_from_probe, f64::NEG_INFINITY, &mut Vec::new())
    }

    /// The distance from the surface to a solid placed in `Object` [m], the smallest of its [contacts](Self::contacts):
    /// exact within a range. Below the start of the range, or less than 50 um above it, returns that start; beyond its
    /// end, a lower bound that is no less than that end. Of class `exact`.
    pub fn distance_within(
        &self,
        probe: &Probe,
        object_from_probe: &IsometryMatrix3<f64>,
        range: &RangeInclusive<f64>,
        scratch: &mut ContactScratch,
    ) -> f64 {
        let (floor, reach) = (*range.start(), *range.end());
        let bound = self.bound(probe, object_from_probe, reach, &mut scratch.waiting);
        if bound > reach {
            return bound;
        }
        // From here on, distances of the core only.
        let (deep, far) = (floor + probe.thickness, reach + probe.thickness);
        let ContactScratch { waiting, seeds, known, cores, .. } = scratch;
        if !self.near_seeds(probe, object_from_probe, deep..far, waiting, seeds) {
            return floor;
        }
        let probe_from_object = object_from_probe.inverse();
        let mut least = far;
        known.clear();
        cores.clear();
        for Seed { point, reach: around, bound, .. } in seeds.iter() {
            // Nothing nearer is in a ball around a point whose distance is known.
            let is_free = known.iter().any(|(centre, distance)| (centre - point).norm() + around < distance - least);
            if bound - around >= least || is_free {
                continue;
            }
            let frames = [object_from_probe, &probe_from_object];
            // Around a nearest point, hardly anything is nearer on the same side.
            let is_known = |normal: &Vector3<f64>| {
                cores.iter().any(|(core, known)| are_near(core, point) && known.dot(normal) > OTHER_WALL)
            };
            let Some(pair) = self.pair_from(probe, frames, object_from_probe * point, least + around, is_known) else {
                known.push((*point, least + around));
                continue;
            };
            let pair = self.settled(probe, frames, pair, least);
            let (core, distance) = (probe_from_object * pair.core(), pair.distance());
            if distance <= deep + CUT {
                return floor;
            }
            if distance >= least {
                known.push((core, distance));
                continue;
            }
            least = distance;
            // Where the surface cuts the core, points around this one may be deeper.
            if distance > CUT {
                cores.push((core, *pair.normal()));
            }
        }
        if least == far { reach } else { least - probe.thickness }
    }

    /// The pair itself, or a nearer one: a slightly tilted core slides slowly, and is nearest at its farthest point
    /// against the direction out of the mesh. That point is tried if it would be nearer than the current minimum on a
    /// flat surface.
    fn settled(&self, probe: &Probe, frames: [&IsometryMatrix3<f64>; 2], mut pair: Pair, least: f64) -> Pair {
        let [object_from_probe, probe_from_object] = frames;
        for _ in 0..CORNERS {
            let corner = object_from_probe * probe.farthest(&(probe_from_object * -pair.normal()));
            let nearer_by = pair.normal().dot(&(pair.core() - corner));
            if pair.distance() <= 0.0 || nearer_by < CUT || pair.distance() - nearer_by > least - FLAT {
                break;
            }
            match self.pair_from(probe, frames, corner, pair.distance(), |_| false) {
                Some(nearer) if nearer.distance() < pair.distance() => pair = nearer,
                _ => break,
            }
        }
        pair
    }

    /// Points of the core that may be nearer to the surface than the end of a range [m], sorted by the lattice's
    /// distance; false if one is certainly deeper than the start of the range. The first piece that is reached bounds
    /// the nearest distance from above.
    fn near_seeds(
        &self,
        probe: &Probe,
        object_from_probe: &IsometryMatrix3<f64>,
        Range { start: deep, end: mut least }: Range<f64>,
        waiting: &mut Vec<Piece>,
        seeds: &mut Vec<Seed>,
    ) -> bool {
        waiting.clear();
        seeds.clear();
        waiting.push(Piece::whole(probe));
        while let Some(piece) = waiting.pop() {
            // Skip a piece whose ball is beyond the nearest distance found.
            let centre = Point3::from(piece.centre);
            let around = piece.half.norm();
            if self.at_least(&(object_from_probe * centre)) - around >= least {
                continue;
            }
            // Stop at a point that is certainly deeper than the range.
            let point = probe.nearest(&centre);
            let start = object_from_probe * point;
            if self.at_most(&start) <= deep {
                return false;
            }
            if let Some(halves) = piece.halves() {
                // The half that seems nearer first: what is found there rules out most of the other.
                let about =
                    halves.map(|half| self.approximate_distance(&(object_from_probe * Point3::from(half.centre))));
                let [one, other] = halves;
                waiting.extend(if about[0] < about[1] { [other, one] } else { [one, other] });
                continue;
            }
            // The exact distance of the first small piece limits the search.
            if seeds.is_empty() {
                let distance = self.signed_distance(&start);
                if distance <= deep {
                    return false;
                }
                least = least.min(distance);
            }
            let (bound, about) = (self.at_least(&start), self.approximate_distance(&start));
            seeds.push(Seed { point, reach: around, bound, about });
        }
        seeds.sort_by(|one, other| one.about.total_cmp(&other.about));
        true
    }

    /// Smallest of the lattice's bounds over the pieces of a solid [m]; stops early at any bound that is no more than
    /// `enough`.
    fn bound(
        &self,
        probe: &Probe,
        object_from_probe: &IsometryMatrix3<f64>,
        enough: f64,
        waiting: &mut Vec<Piece>,
    ) -> f64 {
        let mut min = f64::INFINITY;
        waiting.clear();
        waiting.push(Piece::whole(probe));
        while let Some(piece) = waiting.pop() {
            let centre = object_from_probe * Point3::from(piece.centre);
            let bound = self.at_least(&centre) - piece.half.norm() - probe.thickness;
            if bound >= min {
                continue;
            }
            match piece.halves() {
                Some(halves) => waiting.extend(halves),
                None if bound <= enough => return bound,
                None => min = bound,
            }
        }
        min
    }
}
