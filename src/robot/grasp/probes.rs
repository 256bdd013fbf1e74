//! Distances of a tool's solids from true meshes, and how deep they overlap.

use nalgebra::IsometryMatrix3;

use super::solids::ALLOWED_OVERLAP;
use kernel::{
    contact::{ContactScratch, ContactSurface, Probe},
    geom::Shape,
};

/// Overlaps are computed down to this [m].
pub(super) const DEEP: f64 = 0.001;

/// Error of a computed distance [m].
pub(super) const TOLERANCE: f64 = 1e-4;

/// Solids are shrunk by this to test whether they are deeper in the object than allowed [m]: half a tolerance more,
/// since a solid at exactly that distance counts as touching.
const DRAWN_IN: f64 = ALLOWED_OVERLAP + TOLERANCE / 2.0;

/// Halvings of the range in which an overlap lies: to less than a tolerance.
const HALVINGS: u32 = 4;

/// A solid as its distances are computed.
#[derive(Clone, Copy, Debug)]
pub(super) struct SolidProbes {
    /// The solid with sharp edges and with rounded ones.
    whole: [Probe; 2],
    /// Both, shrunk by the overlap with the object that is allowed.
    drawn_in: [Probe; 2],
}

impl SolidProbes {
    /// Probes of a solid; `None` for a mesh.
    pub(super) fn new(shape: &Shape) -> Option<Self> {
        let whole = [Probe::sharp(shape)?, Probe::new(shape)?];
        Some(Self { drawn_in: whole.map(|probe| probe.drawn_in(DRAWN_IN)), whole })
    }

    /// Distance of the solid, placed in `Object`, from a surface [m], exact from -[`DEEP`] to a reach; farther away a lower bound.
    /// The distance to the target is that of the shrunk solid.
    pub(super) fn distance(
        &self,
        surface: &ContactSurface,
        object_from_solid: &IsometryMatrix3<f64>,
        reach: f64,
        is_target: bool,
        scratch: &mut ContactScratch,
    ) -> f64 {
        let probes = if is_target { &self.drawn_in } else { &self.whole };
        // Touching solids have the start of the range as distance. The distance of a sharp solid that cuts a surface
        // may be too large: the rounded one applies if it is nearer.
        let mut least = |probes: &[Probe; 2], reach: f64| {
            let distances = probes
                .each_ref()
                .map(|probe| surface.distance_within(probe, object_from_solid, &(0.0..=reach), scratch));
            distances[0].min(distances[1])
        };
        let found = least(probes, reach.max(TOLERANCE));
        if found > 0.0 {
            return found;
        }
        let touches = |by: f64| {
            let drawn_in = self.whole.each_ref().map(|probe| probe.drawn_in(by));
            least(&drawn_in, TOLERANCE) == 0.0
        };
        0.0 - overlap(touches)
    }
}

/// Overlap of a solid with something that it touches [m], as a lower bound, up to [`DEEP`]; `touches` returns
/// whether they still touch when the surface is shrunk by a length.
fn overlap(mut touches: impl FnMut(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, DEEP);
    if touches(high) {
        return high;
    }
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if touches(middle) { low = middle } else { high = middle }
    }
    low
}
