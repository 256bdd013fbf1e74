//! Energies of a state; lower is better.

use std::f64::consts::PI;

use nalgebra::{Point3, Unit, Vector3};

use super::{
    settings::{Annealing, WrenchSpace},
    state::VirtualContact,
    wrench::{Contact, EpsilonEnd, EpsilonLimits, EpsilonSolver, FrictionCone, MassFrame, WrenchSet},
};
use kernel::geom::SimdLevel;

/// Weighs 1 - cos against millimetres in the contact energy.
const ANGLE_WEIGHT: f64 = 50.0;

/// A virtual contact farther from the surface [mm] or pointing farther past it has no weight.
const FARTHEST: f64 = 50.0;
const MIN_COS: f64 = 0.7;

/// Contacts with a larger weight count; fewer of them make no wrench space.
const COUNTS: f64 = 0.25;
const FEWEST: usize = 3;

/// Edges of the friction cones of virtual contacts, hard points. (Of the soft fingers of the thesis 8 edges count in the space
/// of forces.)
const EDGES: usize = 8;

/// Tolerance of an epsilon of forces and torques during annealing, at least: closing in on it costs most of its
/// time.
const TOLERANCE: f64 = 1e-3;

/// Mean over the virtual contacts of |distance| [mm] and 50 (1 - cos); cos is of the angle between the contact's normal and
/// the direction to the surface's closest point, which inside is still the direction inward.
pub(super) fn contact_energy(contacts: &[VirtualContact]) -> f64 {
    let of = |contact: &VirtualContact| {
        1e3 * f64::from(contact.distance).abs() + ANGLE_WEIGHT * (1.0 - f64::from(contact.cos))
    };
    contacts.iter().map(of).sum::<f64>() / contacts.len() as f64
}

/// Weight of a virtual contact: 2 on the surface, falling to 0 at 50 mm.
fn weight(contact: &VirtualContact) -> f64 {
    let distance = 1e3 * f64::from(contact.distance).abs();
    if contact.cos < MIN_COS as f32 || distance > FARTHEST {
        return 0.0;
    }
    libm::cos(PI * distance / FARTHEST) + 1.0
}

/// The potential of the virtual contacts: -epsilon of their wrench space, each weighted by its distance.
pub(super) struct Potential {
    space: WrenchSpace,
    cone: FrictionCone,
    solver: EpsilonSolver,
    set: WrenchSet,
    counted: Vec<Contact>,
}

impl Potential {
    pub(super) fn new(settings: &Annealing, level: SimdLevel) -> Self {
        Self {
            space: settings.space,
            cone: FrictionCone::hard(settings.friction, EDGES),
            solver: EpsilonSolver::new(level),
            set: WrenchSet::default(),
            counted: Vec::new(),
        }
    }

    /// Tolerance of epsilon where an error of `unfelt` does not matter.
    pub(super) fn tolerance(&self, unfelt: f64) -> f64 {
        match self.space {
            WrenchSpace::Force => 0.0,
            WrenchSpace::Wrench => unfelt.max(TOLERANCE),
        }
    }

    /// Clears the memory of earlier states, which could change the last bits of later ones.
    pub(super) fn forget(&mut self) {
        self.solver.forget();
    }

    /// -epsilon, or `None` where fewer than three contacts count. Where epsilon is known to be below the limit, any number
    /// that is, too.
    pub(super) fn of(&mut self, contacts: &[VirtualContact], mass: &MassFrame, limits: &EpsilonLimits) -> Option<f64> {
        self.counted.clear();
        for contact in contacts {
            let weight = weight(contact);
            if weight > COUNTS {
                let [point, normal] = [contact.point, contact.normal].map(|of| Vector3::from(of.map(f64::from)));
                let contact = Contact::new(Point3::from(point), Unit::new_normalize(normal));
                self.counted.push(contact.with_weight(weight));
            }
        }
        if self.counted.len() < FEWEST {
            return None;
        }
        self.set.fill(&self.counted, &self.cone, mass);
        let epsilon = match self.space {
            WrenchSpace::Force => self.solver.of_forces(&self.set, limits),
            WrenchSpace::Wrench => self.solver.of_wrenches_within(&self.set, limits),
        };
        Some(match epsilon.end {
            EpsilonEnd::Outside => 0.0,
            _ => -epsilon.lower,
        })
    }
}
