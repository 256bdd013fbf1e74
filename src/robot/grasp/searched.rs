//! A state of the hand as an energy of a search reads it.

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};

use super::{
    energy::{Potential, contact_energy},
    field::DistanceField,
    frame::Frame,
    settings::EnergyKind,
    solids::LANES,
    state::{HandSearch, VirtualContact},
    wrench::{EpsilonLimits, MassFrame},
};
use kernel::geom::{
    SimdLevel,
    lanes::{Lanes, each_of},
    simd_kernel,
};

/// A state that a search evaluates: legal, its contacts measured by the object's lattice.
pub struct SearchedState<'a> {
    pub(super) level: SimdLevel,
    pub(super) field: &'a DistanceField,
    pub(super) mass: &'a MassFrame,
    pub(super) hand: &'a HandSearch,
    pub(super) contacts: &'a [VirtualContact],
    pub(super) values: &'a [f64],
    pub(super) potential: &'a mut Potential,
    pub(super) potential_scale: f64,
    /// Error of an energy that the acceptance test does not feel.
    pub(super) unfelt: f64,
    pub(super) limit: f64,
    pub(super) object_from_approach: &'a Frame,
    pub(super) amplitudes: &'a [f64],
    /// Wrench spaces that were evaluated.
    pub(super) potentials: &'a mut u64,
}

/// A virtual contact of a searched state, with the surface near it; in `Object`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchedContact {
    /// Position [m].
    pub point: Point3<f64>,
    /// Out of the hand.
    pub normal: Unit<Vector3<f64>>,
    /// Signed distance from the surface, negative inside [m].
    pub distance: f64,
    /// Away from the surface's closest point outside, towards it inside.
    pub outward: Unit<Vector3<f64>>,
}

impl SearchedState<'_> {
    /// Only energies below this are accepted; others need not be exact.
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// The approach frame expressed in the object's frame [m].
    pub fn object_from_approach(&self) -> IsometryMatrix3<f64> {
        self.object_from_approach.isometry()
    }

    /// Amplitudes of the hand's eigengrasps.
    pub fn amplitudes(&self) -> &[f64] {
        self.amplitudes
    }

    /// Values of all joints in the order of the hand's tree [rad or m].
    pub fn joints(&self) -> &[f64] {
        &self.values[..self.hand.hand.tree().len()]
    }

    /// The contact energy: the mean over the virtual contacts of |distance| [mm] and 50 (1 - cos).
    pub fn contact_energy(&self) -> f64 {
        contact_energy(self.contacts)
    }

    /// The potential e, for an energy `scale * e + offset` with a scale above 0: below 0 for a stable state, 0 for one without
    /// force closure, 1 where fewer than three contacts count. Exact only where that energy is below the limit.
    pub fn potential(&mut self, scale: f64, offset: f64) -> f64 {
        // Epsilon above which the energy is below the limit.
        let tolerance = self.potential.tolerance(self.unfelt / scale);
        let limits = EpsilonLimits { above: f64::INFINITY, below: (offset - self.limit) / scale, tolerance };
        let potential = self.potential.of(self.contacts, self.mass, &limits);
        *self.potentials += u64::from(potential.is_some());
        potential.unwrap_or(1.0)
    }

    /// The energy of jobs for grasps: the contact energy, or the scaled potential where it is below 0 (thesis, algorithm 4).
    pub fn energy(&mut self, kind: EnergyKind) -> f64 {
        if kind == EnergyKind::ContactAndPotential {
            let scale = self.potential_scale;
            let potential = self.potential(scale, 0.0);
            if potential < 0.0 {
                return potential * scale;
            }
        }
        self.contact_energy()
    }

    /// Virtual contacts with the surface near them, in the order of the hand's contacts.
    pub fn contacts(&self, out: &mut Vec<SearchedContact>) {
        out.clear();
        for contacts in self.contacts.chunks(LANES) {
            let mut outward = [[0.0; LANES]; 3];
            outward_at(self.level, self.field, contacts, &mut outward);
            for (lane, contact) in contacts.iter().enumerate() {
                let [normal, outward] = [contact.normal, outward.map(|part| part[lane])]
                    .map(|of| Unit::new_normalize(Vector3::from(of.map(f64::from))));
                let point = Point3::from(contact.point.map(f64::from));
                out.push(SearchedContact { point, normal, distance: f64::from(contact.distance), outward });
            }
        }
    }
}

simd_kernel! {
    /// Outward directions at up to sixteen contacts.
    fn outward_at(field: &DistanceField, contacts: &[VirtualContact], out: &mut [[f32; 16]; 3]) = outward_at_body;
}

#[inline(always)]
fn outward_at_body<L: Lanes>(l: L, field: &DistanceField, contacts: &[VirtualContact], out: &mut [[f32; LANES]; 3]) {
    let mut at = [[0.0f32; LANES]; 3];
    for (lane, contact) in contacts.iter().enumerate() {
        for (part, lanes) in contact.point.iter().zip(&mut at) {
            lanes[lane] = *part;
        }
    }
    let near = field.near(l, each_of!([0, 1, 2], axis => l.load(&at[axis])));
    for (part, lanes) in near.outward.iter().zip(out) {
        l.store(*part, lanes);
    }
}
