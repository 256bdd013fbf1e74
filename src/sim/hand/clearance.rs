//! Distances of a hand from the object and its surroundings, without stepping.

use kernel::contact::{ContactScratch, Probe};
use nalgebra::{IsometryMatrix3, Point3, Translation3, Vector3};
use robot::hand::Mount;

use crate::{
    hand::sim::HandSim,
    objects::{
        thing::{StillShape, StillThing, ThingTouch},
        true_mesh::TrueMesh,
    },
};

/// A hand nearer to something than this meets it [m]; a path is followed in steps of at least this length.
const MEETS: f64 = 1e-4;

/// Distances are exact up to this [m], and down to this far below 0.
const EXACT: f64 = 0.01;
const DEEP: f64 = 1e-3;

/// A hand in a posture that moves straight, its base placed in the object's frame.
pub(crate) struct StraightWay<'a> {
    /// Frames of its links in its base.
    pub(crate) frames: &'a [IsometryMatrix3<f64>],
    pub(crate) object_from_start: IsometryMatrix3<f64>,
    /// Direction of unit length, in the object's frame.
    pub(crate) direction: Vector3<f64>,
}

impl StraightWay<'_> {
    /// The hand's base after some of the way [m].
    pub(crate) fn moved(&self, by: f64) -> IsometryMatrix3<f64> {
        Translation3::from(self.direction * by) * self.object_from_start
    }
}

impl HandSim {
    /// A lower bound of the distance between the true mesh and the hand, with its links at these frames in its base [m];
    /// `None` without a true mesh.
    pub(crate) fn clearance_at_least(
        &self,
        frames: &[IsometryMatrix3<f64>],
        object_from_base: &IsometryMatrix3<f64>,
    ) -> Option<f64> {
        let TrueMesh { surface, .. } = self.true_mesh.as_ref()?;
        let clearance = |(mount, probe): &(Mount, Probe)| {
            surface.clearance_at_least(probe, &(object_from_base * self.hand.base_from(mount, frames)))
        };
        Some(self.solids.iter().map(clearance).fold(f64::INFINITY, f64::min))
    }

    /// Bound on the distance of the hand's points in a posture from the origin of its approach frame [m], as far as it can
    /// touch a true mesh.
    ///
    /// # Panics
    /// When there is not one value per driven joint.
    pub fn reach(&self, posture: &[f64]) -> f64 {
        let frames = self.hand.link_frames(&self.hand.posture_values(posture));
        let origin = self.hand.approach_pose(&frames).isometry().translation.vector;
        let reach = |(mount, probe): &(Mount, Probe)| {
            (self.hand.base_from(mount, &frames).translation.vector - origin).norm() + probe.radius()
        };
        self.solids.iter().map(reach).fold(0.0, f64::max)
    }

    /// The first thing around the object that a hand meets on its straight motion, at most [m], with the distance moved
    /// until then; if it meets several at once, the first in their order. By conservative advancement (Mirtich 1996):
    /// in steps short enough that nothing is skipped.
    pub(crate) fn first_met(
        &self,
        way: &StraightWay<'_>,
        distance: f64,
        scratch: &mut ContactScratch,
    ) -> Option<(f64, ThingTouch)> {
        let mut first: Option<(f64, ThingTouch)> = None;
        for (number, thing) in self.still.iter().enumerate() {
            let end = first.map_or(distance, |(travelled, _)| travelled);
            let mut travelled = 0.0;
            // One that is met where another was comes after that.
            while travelled < end || (travelled <= end && first.is_none()) {
                let thing_from_base = thing.object_from_thing.inv_mul(&way.moved(travelled));
                let (clearance, solid) = self.nearest_solid(thing, &thing_from_base, way.frames, scratch);
                if clearance < MEETS {
                    let (mount, probe) = &self.solids[solid];
                    let placed = thing_from_base * self.hand.base_from(mount, way.frames);
                    let point = thing.object_from_thing * touching_point(thing, probe, &placed, scratch);
                    first = Some((travelled, ThingTouch { thing: number, link: mount.link, point }));
                    break;
                }
                travelled += clearance.max(MEETS);
            }
        }
        first
    }

    /// Smallest distance of the hand's solids from a thing [m], exact near it, and the solid.
    fn nearest_solid(
        &self,
        thing: &StillThing,
        thing_from_base: &IsometryMatrix3<f64>,
        frames: &[IsometryMatrix3<f64>],
        scratch: &mut ContactScratch,
    ) -> (f64, usize) {
        let mut nearest = (f64::INFINITY, 0);
        for (index, (mount, probe)) in self.solids.iter().enumerate() {
            let placed = thing_from_base * self.hand.base_from(mount, frames);
            let distance = match &thing.shape {
                StillShape::Mesh(surface) => {
                    surface.distance_within(probe, &placed, &(-DEEP..=nearest.0.min(EXACT)), scratch)
                }
                StillShape::Ground => lowest(probe, &placed).z,
            };
            if distance < nearest.0 {
                nearest = (distance, index);
            }
        }
        nearest
    }
}

/// The lowest point of a solid over the plane z = 0 of the frame that it is placed in.
fn lowest(probe: &Probe, placed: &IsometryMatrix3<f64>) -> Point3<f64> {
    placed * probe.support(&(placed.rotation.inverse() * -Vector3::z()))
}

/// The point of a solid that touches a thing, in the thing's frame.
fn touching_point(
    thing: &StillThing,
    probe: &Probe,
    placed: &IsometryMatrix3<f64>,
    scratch: &mut ContactScratch,
) -> Point3<f64> {
    match &thing.shape {
        StillShape::Ground => lowest(probe, placed),
        StillShape::Mesh(surface) => {
            let mut found = Vec::new();
            surface.contacts(probe, placed, 2.0 * MEETS, scratch, &mut found);
            // A solid completely inside a body has no distance.
            found.first().map_or(placed.translation.vector.into(), |contact| contact.point)
        }
    }
}
