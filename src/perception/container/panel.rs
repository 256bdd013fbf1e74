//! Upright planes of a picture.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::coarse::Facet;
use crate::plane::{Plane, fitted};

/// Largest cosine between the vertical and the normal of an upright surface; totes have slanted walls.
const UPRIGHT: f64 = 0.35;
/// Smallest cosine between a panel's normal and those of its facets.
const ALIGNED: f64 = 0.93;
/// Facets nearer than this to a plane rate it, and belong to it [m].
const TOLERANCE: [f64; 2] = [0.014, 0.009];
/// Planes that are tried for each panel.
const HYPOTHESES: usize = 32;
/// Facets that rate a plane, about.
const JUDGES: usize = 500;
/// Fewest facets of a panel.
const FACETS: usize = 40;
/// Most panels.
const PANELS: usize = 12;
/// Step along a panel [m], and longest gap in it [steps].
const STEP: f64 = 0.02;
/// See [`STEP`].
const GAP: usize = 8;
/// Share of the facets left out at each end of a panel's extents.
const TAIL: f64 = 0.02;

/// Share of the steps whose highest facet is below the upper edge.
const UPPER: f64 = 0.7;

/// An upright plane with its facets.
#[derive(Clone, Debug)]
pub(super) struct Panel {
    /// The plane, its normal towards the camera.
    pub plane: Plane,
    /// Unit vector along it, perpendicular to the vertical.
    pub along: Vector3<f64>,
    /// Facets on the plane, of one run along it.
    pub facets: Vec<Facet>,
    /// Lowest coordinate along the vertical, and that of its upper edge [m].
    pub heights: [f64; 2],
    /// Lowest and highest coordinate along it [m].
    pub ends: [f64; 2],
    /// Whether the border of the picture is near its highest facets.
    pub is_top_cut: bool,
}

impl Panel {
    /// Length [m].
    pub fn length(&self) -> f64 {
        self.ends[1] - self.ends[0]
    }

    /// The distance from a wall below which a share of the facets lies [m].
    pub fn nearest_to(&self, other: &Plane, share: f64) -> f64 {
        quantile(self.facets.iter().map(|facet| other.height(&facet.point)).collect(), share)
    }
}

/// Upright planes among the facets, by consensus of facets (RANSAC with a hypothesis per facet): the largest first.
pub(super) fn panels_of(facets: &[Facet], up: &Vector3<f64>) -> Vec<Panel> {
    let mut left: Vec<Facet> = facets.iter().filter(|facet| facet.normal.dot(up).abs() < UPRIGHT).copied().collect();
    let mut panels = Vec::new();
    while panels.len() < PANELS && left.len() >= FACETS {
        let Some(plane) = best_plane(&left) else { break };
        let (on, off): (Vec<Facet>, Vec<Facet>) = left.iter().partition(|facet| belongs(facet, &plane, TOLERANCE[0]));
        if on.len() < FACETS {
            break;
        }
        left = off;
        panels.extend(panel_of(&plane, on, up));
    }
    panels
}

/// Whether a facet lies on a plane.
fn belongs(facet: &Facet, plane: &Plane, tolerance: f64) -> bool {
    plane.height(&facet.point).abs() < tolerance && facet.normal.dot(&plane.normal) > ALIGNED
}

/// The plane with the largest count of facets, fitted to them.
fn best_plane(facets: &[Facet]) -> Option<Plane> {
    let judges: Vec<Facet> = facets.iter().step_by(facets.len().div_ceil(JUDGES)).copied().collect();
    let mut best: Option<(usize, Plane)> = None;
    for index in 0..HYPOTHESES.min(facets.len()) {
        let seed = &facets[index * facets.len() / HYPOTHESES.min(facets.len())];
        let Some(plane) = Plane::through(seed.normal, &seed.point.coords) else { continue };
        // A normal of one facet is off by some degrees: fit once before the count.
        let Some(plane) = refined(&judges, &plane, TOLERANCE[0]) else { continue };
        let votes = judges.iter().filter(|facet| belongs(facet, &plane, TOLERANCE[1])).count();
        if best.as_ref().is_none_or(|(most, _)| votes > *most) {
            best = Some((votes, plane));
        }
    }
    let plane = refined(facets, &best?.1, TOLERANCE[0])?;
    refined(facets, &plane, TOLERANCE[1])
}

/// The plane of least squares over the facets on a plane.
fn refined(facets: &[Facet], plane: &Plane, tolerance: f64) -> Option<Plane> {
    let on = facets.iter().filter(|facet| belongs(facet, plane, tolerance)).map(|facet| &facet.point);
    fitted(on, &plane.foot())
}

/// The longest run of these facets along their plane.
fn panel_of(plane: &Plane, facets: Vec<Facet>, up: &Vector3<f64>) -> Option<Panel> {
    let along = up.cross(&plane.normal).try_normalize(1e-6)?;
    let step = |point: &Point3<f64>| (along.dot(&point.coords) / STEP).floor() as i64;
    let mut steps: Vec<i64> = facets.iter().map(|facet| step(&facet.point)).collect();
    steps.sort_unstable();
    // Runs of steps without a gap, as ranges of the sorted steps; the run with the largest count of facets.
    let breaks: Vec<usize> = (1..steps.len()).filter(|at| steps[*at] - steps[at - 1] > GAP as i64).collect();
    let starts = std::iter::once(0).chain(breaks.iter().copied());
    let ends = breaks.iter().copied().chain([steps.len()]);
    let (start, end) = starts.zip(ends).max_by_key(|(start, end)| (end - start, usize::MAX - start))?;
    let run = steps[start]..=steps[end - 1];
    let facets: Vec<Facet> = facets.into_iter().filter(|facet| run.contains(&step(&facet.point))).collect();
    if facets.len() < FACETS {
        return None;
    }
    let range = |direction: &Vector3<f64>| {
        let values: Vec<f64> = facets.iter().map(|facet| direction.dot(&facet.point.coords)).collect();
        [quantile(values.clone(), TAIL), quantile(values, 1.0 - TAIL)]
    };
    let (heights, ends) = ([range(up)[0], upper_edge(&facets, up, step)], range(&along));
    let is_high = |facet: &&Facet| up.dot(&facet.point.coords) > heights[1] - STEP;
    let (high, cut) = facets
        .iter()
        .filter(is_high)
        .fold((0, 0), |(high, cut), facet| (high + 1, cut + usize::from(facet.is_at_border)));
    Some(Panel { plane: *plane, along, heights, ends, is_top_cut: 4 * cut > high, facets })
}

/// Coordinate along the vertical of the upper edge: that of most steps along the panel [m].
fn upper_edge(facets: &[Facet], up: &Vector3<f64>, step: impl Fn(&Point3<f64>) -> i64) -> f64 {
    let mut highest: BTreeMap<i64, f64> = BTreeMap::new();
    for facet in facets {
        let highest = highest.entry(step(&facet.point)).or_insert(f64::NEG_INFINITY);
        *highest = highest.max(up.dot(&facet.point.coords));
    }
    quantile(highest.into_values().collect(), UPPER)
}

/// The value below which a share of the values lies.
pub(super) fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = (share * values.len().saturating_sub(1) as f64).round() as usize;
    values.get(at).copied().unwrap_or(f64::NAN)
}
