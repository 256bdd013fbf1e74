//! Whether a solid is in a mesh, yes or no.

use nalgebra::IsometryMatrix3;

use super::{ContactScratch, ContactSurface, Probe, surface::Seed};
use crate::geom::BoxCluster;

/// Boxes within a solid end so far from its surface [m]: rounding makes none of them too large.
const INSET: f64 = 1e-6;

/// A solid's answer to whether a triangle is deeper in it than a length, by boxes that lie in it.
#[derive(Clone, Debug, PartialEq)]
pub struct OverlapProbe {
    probe: Probe,
    /// Deeper than this it overlaps [m].
    depth: f64,
    within: BoxCluster,
}

impl OverlapProbe {
    /// A solid that overlaps a surface where they are deeper in each other than `depth` [m], above 0.
    pub fn new(probe: &Probe, depth: f64) -> Self {
        // All points within `reach` of the core are deeper.
        let reach = probe.thickness - depth - INSET;
        let core = if probe.is_round() {
            // A square in the disc.
            let [across, _, along] = probe.half;
            [across * std::f64::consts::FRAC_1_SQRT_2, across * std::f64::consts::FRAC_1_SQRT_2, along]
        } else {
            probe.half
        };
        // The core, wider along some axes: a corner moves by `reach` at most.
        let wider = |axes: &[usize]| {
            let by = reach / (axes.len() as f64).sqrt();
            let mut half = core;
            axes.iter().for_each(|axis| half[*axis] += by);
            half
        };
        let axes: [&[usize]; 5] = [&[0, 1, 2], &[0, 1], &[0], &[1], &[2]];
        let boxes: Vec<[f64; 3]> = if reach > 0.0 { axes.map(wider).into() } else { Vec::new() };
        Self { probe: *probe, depth, within: BoxCluster::new(&boxes) }
    }
}

impl ContactSurface {
    /// Whether a triangle of the surface is surely too deep in a solid placed in `Object`. What is false here may still
    /// [overlap](Self::overlaps): at its rounded edges, or where the solid lies wholly inside the mesh.
    pub fn surely_overlaps(&self, solid: &OverlapProbe, object_from_probe: &IsometryMatrix3<f64>) -> bool {
        self.tree().meets_boxes(object_from_probe, &solid.within)
    }

    /// Whether a solid placed in `Object` is too deep in the mesh: whether [`contacts`](Self::contacts) finds one within
    /// minus the depth. The first ends the search.
    pub fn overlaps(
        &self,
        solid: &OverlapProbe,
        object_from_probe: &IsometryMatrix3<f64>,
        scratch: &mut ContactScratch,
    ) -> bool {
        let OverlapProbe { probe, depth, .. } = solid;
        self.seeds(probe, object_from_probe, -depth, scratch);
        let probe_from_object = object_from_probe.inverse();
        let max = probe.thickness - depth;
        let ContactScratch { seeds, free, .. } = scratch;
        free.clear();
        seeds.iter().any(|Seed { point, reach, bound, .. }| {
            // Pieces in a ball that is known to be free are settled.
            if free.iter().any(|(known, radius)| (known - point).norm() + reach < *radius) {
                return false;
            }
            let start = object_from_probe * point;
            let limit = if *bound < 0.0 { f64::INFINITY } else { max + reach };
            let Some((closest, distance)) = self.closest_within(&start, limit, None) else { return false };
            if distance < max {
                return true;
            }
            free.push((*point, distance - max));
            if distance < 0.0 || distance > max + reach {
                return false;
            }
            // From outside, the piece slides to where core and surface are nearest to each other.
            let pair = self.slide(probe, [object_from_probe, &probe_from_object], start, closest);
            free.push((probe_from_object * pair.core(), pair.distance() - max));
            pair.distance() < max
        })
    }
}
