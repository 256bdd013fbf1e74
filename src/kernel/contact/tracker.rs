//! A solid that moves in small steps against a mesh.

use nalgebra::IsometryMatrix3;

use super::{ContactScratch, ContactSurface, Probe, SurfaceContact, surface::Minimum, trail::Trail};

/// Points within this distance of touching are kept along with those that touch [m]: until the solid has moved by this
/// much, no other point can touch.
const KEPT: f64 = 5e-4;

/// The contacts of one solid, step by step: a new search only when the solid has moved so far that it may touch elsewhere.
///
/// The result depends on earlier steps by less than the tolerance of [`ContactSurface::contacts`] itself: start a run
/// with [`ContactTracker::forget`].
pub struct ContactTracker {
    probe: Probe,
    /// From the origin of its frame to the farthest point of its core [m].
    radius: f64,
    remembers: bool,
    searched: Option<Searched>,
    minima: Vec<Minimum>,
    /// Cache of the surface around each point; may hold more trails than there are points now, for later ones.
    trails: Vec<Trail>,
}

/// Result of the last search, besides the points.
struct Searched {
    object_from_probe: IsometryMatrix3<f64>,
    /// Lower bound on the distance of all other parts of the solid from the surface [m].
    farther: f64,
}

impl ContactTracker {
    /// Creates a tracker of a solid that has not been searched yet. With `remembers` it caches the surface around each
    /// point and takes closest points from there: in half the time, and the same but for the choice between triangles
    /// that are equally near to 1e-8 m.
    pub fn new(probe: Probe, remembers: bool) -> Self {
        let radius = probe.core_radius();
        Self { probe, radius, remembers, searched: None, minima: Vec::new(), trails: Vec::new() }
    }

    /// Begins again.
    pub fn forget(&mut self) {
        self.searched = None;
        self.trails.iter_mut().for_each(Trail::forget);
    }

    /// Contacts as from [`ContactSurface::contacts`], starting from the results of the last search.
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
            for (minimum, trail) in self.minima.iter_mut().zip(&mut self.trails) {
                surface.follow(&self.probe, object_from_probe, &probe_from_object, minimum, trail);
            }
        } else {
            let reach = margin + KEPT;
            let farther = surface.search(&self.probe, object_from_probe, reach, scratch, &mut self.minima);
            self.searched = Some(Searched { object_from_probe: *object_from_probe, farther });
            self.trails.resize_with(self.minima.len().max(self.trails.len()), || Trail::new(self.remembers));
        }
        // If several points have converged to one, the first counts.
        let minima = &self.minima;
        let first = |index: usize| minima[..index].iter().all(|before| !before.is_same(&minima[index]));
        let pairs = (0..minima.len()).filter(|index| first(*index)).map(|index| (index, minima[index].pair()));
        surface.list_followed(&self.probe, margin, pairs, &mut self.trails, out);
    }

    /// Upper bound on the motion of any point of the core between two poses [m].
    fn moved(&self, from: &IsometryMatrix3<f64>, to: &IsometryMatrix3<f64>) -> f64 {
        let angle = (to.rotation.matrix() - from.rotation.matrix()).norm() / std::f64::consts::SQRT_2;
        (to.translation.vector - from.translation.vector).norm() + angle * self.radius
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, Vector3};

    use super::*;
    use crate::{geom::Shape, test_shapes::built_in, voxel::InsideTest};

    /// A finger slides along a mug and rotates, in steps of micrometres with an occasional jump: a tracker finds the
    /// contacts that a fresh search finds each time.
    #[test]
    fn remembering_finds_the_same_contacts() {
        let mesh = built_in("mug-01@16k");
        let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
        let shapes = [Shape::Capsule { radius: 0.01, half: 0.02 }, Shape::Box { half: [0.01, 0.02, 0.03] }];
        let bounds = *surface.bounds();
        for shape in shapes {
            let probe = Probe::new(&shape).expect("a solid");
            let mut trackers = [true, false].map(|remembers| ContactTracker::new(probe, remembers));
            let (mut scratch, mut touched) = (ContactScratch::default(), 0);
            for step in 0..1200 {
                let (slow, jumps) = (f64::from(step) * 2e-6, f64::from(step / 300) * 0.003);
                let aside = bounds.max.x + probe.radius().min(0.0095) - slow / 4.0;
                let position = Vector3::new(aside, bounds.centre().y + slow, bounds.centre().z + jumps);
                let rotation = IsometryMatrix3::rotation(Vector3::new(slow * 5.0, 0.0, slow * 3.0));
                let placed = Translation3::from(position) * rotation;
                let [one, other] = trackers.each_mut().map(|tracker| {
                    let mut found = Vec::new();
                    tracker.contacts(&surface, &placed, 0.0, &mut scratch, &mut found);
                    found
                });
                assert_eq!(one.len(), other.len(), "step {step}");
                touched += one.len();
                for (one, other) in one.iter().zip(&other) {
                    assert!((one.distance - other.distance).abs() < 1e-7, "step {step}: {one:?} {other:?}");
                }
            }
            assert!(touched > 600, "{touched}");
        }
    }
}
