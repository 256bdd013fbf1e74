//! Contacts of the bodies of a scene, lent to MuJoCo by the thread that steps.

use std::{cell::RefCell, sync::Arc};

use nalgebra::IsometryMatrix3;

use super::container::{Container, Vessel};
use crate::objects::true_mesh::WorldContact;
use kernel::contact::{BodyScratch, ContactBody, PairTracker, SurfaceContact, plane_contacts};

/// Working memory of one thread that finds the contacts of one scene. Bodies are counted from the one that the container is, which
/// is 0: the world, where nothing else is simulated.
pub(crate) struct SceneCollider {
    /// MuJoCo's number of the container's body; those of the scene's bodies follow.
    first: usize,
    container: Container,
    bodies: Vec<Arc<ContactBody>>,
    /// Tracker of each pair, the lower body first.
    trackers: Vec<PairTracker>,
    scratch: BodyScratch,
    found: Vec<SurfaceContact>,
}

thread_local! {
    static LENT: RefCell<Option<SceneCollider>> = const { RefCell::new(None) };
}

/// While it lives, MuJoCo calls the collider on this thread.
pub(crate) struct SceneLoan<'a> {
    owner: &'a mut Option<SceneCollider>,
}

impl<'a> SceneLoan<'a> {
    pub(crate) fn new(owner: &'a mut Option<SceneCollider>) -> Self {
        LENT.set(owner.take());
        Self { owner }
    }
}

impl Drop for SceneLoan<'_> {
    fn drop(&mut self) {
        *self.owner = LENT.take();
    }
}

/// Calls `ask` with the collider of the scene that this thread steps, if it steps one.
pub(crate) fn with_scene<T>(ask: impl FnOnce(&mut SceneCollider) -> T) -> Option<T> {
    LENT.with_borrow_mut(|lent| lent.as_mut().map(ask))
}

impl SceneCollider {
    pub(crate) fn new(first: usize, container: Container, bodies: Vec<Arc<ContactBody>>) -> Self {
        let count = bodies.len() + 1;
        let trackers = (0..count * (count - 1) / 2).map(|_| PairTracker::default()).collect();
        Self { first, container, bodies, trackers, scratch: BodyScratch::default(), found: Vec::new() }
    }

    /// Begins a new run.
    pub(crate) fn forget(&mut self) {
        self.trackers.iter_mut().for_each(PairTracker::forget);
    }

    /// Numbers of two bodies in the scene by MuJoCo's; `None` if one is not part of it.
    pub(crate) fn pair_of(&self, bodies: [usize; 2]) -> Option<[usize; 2]> {
        let [one, other] = bodies.map(|body| body.checked_sub(self.first).filter(|body| *body <= self.bodies.len()));
        Some([one?, other?])
    }

    /// Contacts of two bodies that overlap, with their normals out of the first; the container's frame is the scene's.
    pub(crate) fn contacts(
        &mut self,
        pair: [usize; 2],
        poses: [IsometryMatrix3<f64>; 2],
    ) -> impl Iterator<Item = WorldContact> + '_ {
        let swapped = pair[0] > pair[1];
        let [low, high] = if swapped { [pair[1], pair[0]] } else { pair };
        let [world_from_low, world_from_high] = if swapped { [poses[1], poses[0]] } else { poses };
        let sign = if swapped { -1.0 } else { 1.0 };
        self.found.clear();
        let second = self.bodies[high - 1].as_ref();
        // The frame of the contacts, and whether their normals point out of the lower body.
        let (world_from_first, out_of_low) = match (low, &self.container) {
            (0, Container::Plane { .. }) => {
                plane_contacts(second, &world_from_low.inv_mul(&world_from_high), &mut self.found);
                (world_from_high, -1.0)
            }
            (low, container) => {
                let first = match container {
                    Container::Bin(Vessel { body, .. }) if low == 0 => body.as_ref(),
                    _ => self.bodies[low - 1].as_ref(),
                };
                let tracker = &mut self.trackers[high * (high - 1) / 2 + low];
                let first_from_second = world_from_low.inv_mul(&world_from_high);
                tracker.contacts([first, second], &first_from_second, &mut self.scratch, &mut self.found);
                (world_from_low, 1.0)
            }
        };
        self.found.iter().map(move |contact| {
            let normal = world_from_first * contact.normal.into_inner();
            let point = world_from_first * contact.point - normal * (contact.distance / 2.0);
            WorldContact { distance: contact.distance, point, normal: normal * (sign * out_of_low) }
        })
    }
}
