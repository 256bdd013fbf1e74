//! Where a hand will touch an object, by the points of its links alone: a forecast by which approaches are chosen.

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::still::StillAround;
use kernel::contact::ContactSurface;
use robot::hand::Hand;

/// Steps from the opened to the closed hand.
const STEPS: usize = 64;

/// Distance at which a point of the hand touches [m], at the resolution of the lattice of distances.
const TOUCHES: f64 = 0.0025;

/// Shortest step of the coming hand [m], and how many steps it may take.
const SHORTEST: f64 = 0.001;
const MAX_STEPS: u32 = 200;

/// Half the base over which distances are differentiated [m].
const APART: f64 = 0.001;

/// The points with which a hand may touch, in the approach frame of its base, in postures from opened to closed.
pub(super) struct Forecast {
    /// Row per step, point per contact [m].
    points: Vec<Vec<Point3<f64>>>,
    /// Indices of the contacts that each closing motor moves.
    moved: Vec<Vec<usize>>,
    /// Indices of the contacts that no closing motor moves.
    fixed: Vec<usize>,
}

impl Forecast {
    pub(super) fn new(hand: &Hand) -> Self {
        let row = |step: usize| {
            let frames = hand.link_frames(&hand.posture_values(&hand.partly_closed(share(step))));
            let base_from_approach = *hand.approach_pose(&frames).isometry();
            let contacts = 0..hand.contacts().len();
            contacts
                .map(|contact| base_from_approach.inverse_transform_point(&hand.contact_in_base(contact, &frames).0))
                .collect()
        };
        let closing = hand.driven().iter().filter(|driven| driven.closing_sign() != 0.0);
        let moved: Vec<Vec<usize>> = closing
            .map(|driven| {
                let links = hand.links_moved(driven);
                let contacts = hand.contacts().iter().enumerate();
                contacts.filter(|(_, contact)| links[contact.link]).map(|(index, _)| index).collect()
            })
            .collect();
        let fixed =
            (0..hand.contacts().len()).filter(|index| !moved.iter().flatten().any(|other| other == index)).collect();
        Self { points: (0..=STEPS).map(row).collect(), moved, fixed }
    }

    /// Points of an object's surface that a hand will touch, with outward normals, expressed in the object's frame. The
    /// hand moves along the z axis of its approach frame with its fingers partly closed and stops at its first contact;
    /// then each finger closes until it touches. None where it misses the object, or would pass through its
    /// surroundings.
    pub(super) fn touches(
        &self,
        surface: &ContactSurface,
        around: &StillAround,
        object_from_start: &IsometryMatrix3<f64>,
        distance: f64,
        closed: f64,
    ) -> Vec<(Point3<f64>, Vector3<f64>)> {
        let ahead = object_from_start.rotation * Vector3::z();
        let first = (closed * STEPS as f64).round() as usize;
        let (mut travelled, mut touched) = (0.0, false);
        let place = |step: usize, index: usize, travelled: f64| {
            object_from_start * self.points[step][index] + ahead * travelled
        };
        // The hand comes until a point of it touches.
        for _ in 0..MAX_STEPS {
            let near = |index: usize| surface.approximate_distance(&place(first, index, travelled));
            let clearance = (0..self.points[first].len()).map(near).fold(f64::INFINITY, f64::min);
            touched = clearance < TOUCHES;
            let free = |index: usize| around.approximate_distance(&place(first, index, travelled));
            let free = (0..self.points[first].len()).map(free).fold(f64::INFINITY, f64::min);
            if free < 0.0 {
                return Vec::new();
            }
            if touched || travelled > distance {
                break;
            }
            travelled += (clearance - TOUCHES / 2.0).min(free).max(SHORTEST);
        }
        if !touched {
            return Vec::new();
        }
        let touches = |step: usize, index: &usize| {
            let point = place(step, *index, travelled);
            let apart = surface.approximate_distance(&point);
            (apart < TOUCHES).then(|| on_surface(surface, &point, apart))
        };
        let mut found: Vec<_> = self.fixed.iter().filter_map(|index| touches(first, index)).collect();
        for finger in &self.moved {
            let steps =
                (first..=STEPS).map(|step| finger.iter().filter_map(|index| touches(step, index)).collect::<Vec<_>>());
            found.extend(steps.into_iter().find(|touches| !touches.is_empty()).unwrap_or_default());
        }
        found
    }
}

fn share(step: usize) -> f64 {
    step as f64 / STEPS as f64
}

/// The surface's point near one, by the gradient of the distance, and the outward normal there.
fn on_surface(surface: &ContactSurface, point: &Point3<f64>, apart: f64) -> (Point3<f64>, Vector3<f64>) {
    let slope = |axis: usize| {
        let step = Vector3::ith(axis, APART);
        surface.approximate_distance(&(point + step)) - surface.approximate_distance(&(point - step))
    };
    let slopes = Vector3::from_fn(|axis, _| slope(axis));
    let normal = slopes.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    (point - normal * apart, normal)
}
