//! A solid that moves in small steps against a mesh.

use nalgebra::IsometryMatrix3;

use super::{ContactScratch, ContactSurface, Probe, SurfaceContact, surface::Place};

/// Places that are so near to touching are kept beside those that touch [m]: until the solid has moved by this much, no other
/// place can.
const KEPT: f64 = 5e-4;

/// The contacts of one solid, step by step: a new search only when the solid has moved so far that it may touch elsewhere.
///
/// What is found depends on the steps before, by less than [`ContactSurface::contacts`] itself leaves open: a run begins with
/// [`ContactTracker::forget`].
pub struct ContactTracker {
    probe: Probe,
    /// From the origin of its frame to the farthest place of its core [m].
    radius: f64,
    searched: Option<Searched>,
    places: Vec<Place>,
}

/// What the last search found beside the places.
struct Searched {
    object_from_probe: IsometryMatrix3<f64>,
    /// How far all other parts of the solid were from the surface at least [m].
    farther: f64,
}

impl ContactTracker {
    /// Of a solid that has not been looked for yet.
    pub fn new(probe: Probe) -> Self {
        Self { probe, radius: probe.core_radius(), searched: None, places: Vec::new() }
    }

    /// Begins again.
    pub fn forget(&mut self) {
        self.searched = None;
    }

    /// As [`ContactSurface::contacts`].
    pub fn contacts(
        &mut self,
        surface: &ContactSurface,
        object_from_probe: &IsometryMatrix3<f64>,
        margin: f64,
        scratch: &mut ContactScratch,
        out: &mut Vec<SurfaceContact>,
    ) {
        out.clear();
        let known = self.searched.as_ref().is_some_and(|searched| {
            self.moved(&searched.object_from_probe, object_from_probe) < searched.farther - margin
        });
        if known {
            let probe_from_object = object_from_probe.inverse();
            for place in &mut self.places {
                surface.follow(&self.probe, object_from_probe, &probe_from_object, place);
            }
        } else {
            let reach = margin + KEPT;
            let farther = surface.search(&self.probe, object_from_probe, reach, scratch, &mut self.places);
            self.searched = Some(Searched { object_from_probe: *object_from_probe, farther });
        }
        // Of places that have come to one the first counts.
        let places = &self.places;
        let first = |place: usize| places[..place].iter().all(|before| !before.is_same(&places[place]));
        let pairs = (0..places.len()).filter(|place| first(*place)).map(|place| places[place].pair());
        surface.list(&self.probe, margin, pairs, out);
    }

    /// How far a place of the core has moved at most [m].
    fn moved(&self, from: &IsometryMatrix3<f64>, to: &IsometryMatrix3<f64>) -> f64 {
        let turned = (to.rotation.matrix() - from.rotation.matrix()).norm() / std::f64::consts::SQRT_2;
        (to.translation.vector - from.translation.vector).norm() + turned * self.radius
    }
}
