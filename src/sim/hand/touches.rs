//! Touches of a hand: on the object, on fixed things around it, and on itself.

use std::collections::BTreeSet;

use mujoco_rs::wrappers::mj_auxiliary::MjContact;
use nalgebra::{Point3, Unit, Vector3};

use crate::hand::{closing::HandWorker, link_touch::LinkTouch, sim::GeomOwner};

impl HandWorker {
    /// Touches that press on the object, in MuJoCo's order.
    pub fn touches(&self) -> Vec<LinkTouch> {
        self.touches_of(|owner| (owner == GeomOwner::Object).then_some(()))
            .into_iter()
            .map(|((), touch)| touch)
            .collect()
    }

    /// Touches that press on things other than the object, each with its number, in MuJoCo's order.
    pub(crate) fn thing_touches(&self) -> Vec<(usize, LinkTouch)> {
        self.touches_of(|owner| if let GeomOwner::Scene(number) = owner { Some(number) } else { None })
    }

    /// Touches between the hand's links and the given geoms, in MuJoCo's order.
    fn touches_of<T>(&self, of: impl Fn(GeomOwner) -> Option<T>) -> Vec<(T, LinkTouch)> {
        let mut found = Vec::new();
        for (index, contact) in self.data.contact().iter().enumerate() {
            let [Some(first), Some(second)] = self.owners_of(contact) else { continue };
            let (link, thing, thing_first) = match (first, second) {
                (GeomOwner::Link(link), other) => (link, of(other), false),
                (other, GeomOwner::Link(link)) => (link, of(other), true),
                _ => continue,
            };
            let Some(thing) = thing else { continue };
            // From the first geom to the second; the point is half way between the two surfaces.
            let along = Vector3::from_column_slice(&contact.frame[..3]);
            let normal = if thing_first { along } else { -along };
            let point = Point3::from(contact.pos) - self.carried - normal * (contact.dist / 2.0);
            let force = self.data.contact_force(index)[0];
            let normal = Unit::new_unchecked(normal);
            found.push((thing, LinkTouch { link, point, normal, distance: contact.dist, force }));
        }
        found
    }

    /// Pairs of links that press on each other, the lower first, sorted.
    pub fn self_touches(&self) -> Vec<[usize; 2]> {
        let mut found = BTreeSet::new();
        for contact in self.data.contact() {
            let sides = self.owners_of(contact);
            if let [Some(GeomOwner::Link(one)), Some(GeomOwner::Link(other))] = sides {
                found.insert([one.min(other), one.max(other)]);
            }
        }
        found.into_iter().collect()
    }

    /// Owners of the two sides of a contact; the object has the only flex.
    pub(crate) fn owners_of(&self, contact: &MjContact) -> [Option<GeomOwner>; 2] {
        let flex = |side: usize| (contact.flex[side] >= 0).then_some(GeomOwner::Object);
        [0, 1].map(|side| match usize::try_from(contact.geom[side]) {
            Ok(geom) => Some(self.sim.owners[geom]),
            Err(_) => flex(side),
        })
    }
}
