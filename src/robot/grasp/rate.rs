//! Rating of states that annealing kept: closed, and rated with exact distances.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Translation3, Unit, Vector3};

use super::{
    closing::Closing,
    energy::{Potential, contact_energy},
    found::{Energies, GraspContact, Quality, RatedGrasp},
    frame::Frame,
    kind::KindDigits,
    object::ObjectSearch,
    settings::{Annealing, EnergyKind, Keeping, WrenchSpace},
    state::{HandSearch, VirtualContact},
    table::TableWatch,
    variables::axis_and_angle,
    wrench::{Contact, EpsilonLimits, EpsilonSolver, FrictionCone, HullSolver, MassFrame, WrenchSet},
};
use crate::hand::Hand;
use kernel::{contact::ContactSurface, geom::SimdLevel, words::GraspVerdict};

/// Edges of the cones whose hull's volume is taken.
const VOLUME_EDGES: usize = 8;

/// A state of the hand before it closes.
#[derive(Clone, Debug, PartialEq)]
pub struct HandState {
    /// The approach frame expressed in the object's frame [m].
    pub object_from_approach: IsometryMatrix3<f64>,
    /// One value per driven joint [rad or m].
    pub posture: Vec<f64>,
    /// Amplitudes of the eigengrasps; none where they did not make the posture.
    pub amplitudes: Vec<f64>,
}

/// One thread's rating of states of one hand with exact distances: closed as [`Keeping`] states, with quality and verdict.
pub struct GraspRater(Rating);

impl GraspRater {
    /// With vector instructions up to a level, which does not change the result. Only the energy of `annealing` is used.
    pub fn new(search: &HandSearch, annealing: &Annealing, keeping: &Keeping, level: SimdLevel) -> Self {
        Self(Rating::new(search, annealing, keeping, level.usable()))
    }

    /// Closes and rates a state, once the hand has come on along its approach until it meets the object, by at most
    /// [`Keeping::advance`].
    pub fn rate(&mut self, object: &ObjectSearch, start: HandState) -> RatedGrasp {
        self.0.started(object, start)
    }

    /// Closes and rates a state, with the hand where it is.
    pub fn rate_in_place(&mut self, object: &ObjectSearch, start: HandState) -> RatedGrasp {
        self.0.placed(object, start)
    }

    /// The contact energy and the potential of a state.
    pub fn energies(&mut self, object: &ObjectSearch, start: &HandState) -> Energies {
        self.0.energies_of(object, start)
    }
}

/// Working memory of one thread that rates grasps of one hand.
pub(super) struct Rating {
    hand: Arc<Hand>,
    closing: Closing,
    pub(super) table: TableWatch,
    keeping: Keeping,
    energy: EnergyKind,
    potential_scale: f64,
    potential: Potential,
    kind: Option<KindDigits>,
    quality: QualityMeter,
}

impl Rating {
    pub(super) fn new(search: &HandSearch, annealing: &Annealing, keeping: &Keeping, level: SimdLevel) -> Self {
        let hand = &search.hand;
        Self {
            hand: Arc::clone(hand),
            closing: Closing::new(hand, &search.solids),
            table: TableWatch::new(hand, &search.solids),
            keeping: *keeping,
            energy: annealing.energy,
            potential_scale: annealing.potential_scale,
            potential: Potential::new(annealing, level),
            kind: KindDigits::new(hand),
            quality: QualityMeter::new(keeping, level),
        }
    }

    /// Finds every overlap by exact distances.
    pub(super) fn without_prefilter(&mut self) {
        self.closing.without_prefilter();
    }

    /// The energies of a state, with exact distances.
    pub(super) fn energies_of(&mut self, object: &ObjectSearch, start: &HandState) -> Energies {
        let frames = self.hand.link_frames(&self.hand.posture_values(&start.posture));
        let object_from_base = start.object_from_approach * self.hand.approach_pose(&frames).isometry().inverse();
        self.energies(object, &object_from_base, &frames)
    }

    /// Closes and rates a state, once the hand has come on along its approach until it meets the object.
    pub(super) fn started(&mut self, object: &ObjectSearch, start: HandState) -> RatedGrasp {
        self.rated(object, start, self.keeping.advance)
    }

    /// Closes and rates a state, with the hand where it is.
    pub(super) fn placed(&mut self, object: &ObjectSearch, start: HandState) -> RatedGrasp {
        self.rated(object, start, 0.0)
    }

    /// Closes and rates a state, once the hand has come on by `max_advance` at most [m].
    fn rated(&mut self, object: &ObjectSearch, start: HandState, max_advance: f64) -> RatedGrasp {
        let hand = Arc::clone(&self.hand);
        let HandState { object_from_approach, posture, amplitudes } = start;
        // The hand before closing: its pose, its depth in the object and the energies of this state.
        let open = hand.posture_values(&posture);
        let frames = hand.link_frames(&open);
        let object_from_base = object_from_approach * hand.approach_pose(&frames).isometry().inverse();
        let penetration = self.closing.penetration(object.surface(), &object_from_base, &open).max(0.0);
        let energies = self.energies(object, &object_from_base, &frames);
        let mut grasp = RatedGrasp {
            object_from_approach,
            amplitudes,
            posture,
            penetration,
            energies,
            advance: 0.0,
            shift: None,
            turn: None,
            joints: open,
            contacts: Vec::new(),
            quality: Quality::default(),
            kind: None,
            verdict: GraspVerdict::Penetrates,
            clearances: Vec::new(),
            point_scheme: None,
        };
        // A hand that starts too deep is not closed.
        if penetration > self.keeping.max_penetration {
            return grasp;
        }
        // Move on along the approach until the hand meets the object.
        let direction = object_from_approach.rotation * Vector3::z();
        grasp.advance =
            self.closing.advance(object.surface(), &object_from_base, &grasp.joints, &direction, max_advance);
        let advanced = Translation3::from(direction * grasp.advance);
        grasp.object_from_approach = advanced * object_from_approach;
        let mut object_from_base = advanced * object_from_base;
        // Close: a gripper gives way until both pads touch, any other hand closes where it is.
        let max = self.keeping.max_penetration;
        let closed = match self.closing.centred(object.surface(), &object_from_base, &grasp.posture, max) {
            Some(centred) => {
                let base_from_approach = hand.approach_pose(&frames);
                let object_from_approach = centred.object_from_base * base_from_approach.isometry();
                let moved = Frame::of(&(grasp.object_from_approach.inverse() * object_from_approach));
                let (axis, angle) = axis_and_angle(&moved.rotation);
                (grasp.shift, grasp.turn) = (Some(moved.origin), Some(axis * angle));
                (grasp.object_from_approach, object_from_base) = (object_from_approach, centred.object_from_base);
                centred.closed
            }
            None => self.closing.close(object.surface(), &object_from_base, &grasp.posture),
        };
        grasp.joints = closed.joints;
        // Rate the contacts of the closed hand: quality, grasp type, clearance over the table, verdict.
        grasp.contacts = self.closing.contacts(object.surface(), &object_from_base, &grasp.joints);
        grasp.quality = self.quality.of(&grasp.contacts, &object.mass);
        let turn = *grasp.object_from_approach.rotation.matrix();
        grasp.kind = self.kind.as_ref().map(|digits| digits.kind(&grasp.joints, &turn));
        let (resting, direction) = (&object.resting().poses, grasp.object_from_approach.rotation * Vector3::z());
        grasp.clearances =
            self.table.clearances(resting, &object_from_base, &direction, &grasp.posture, &closed.motors);
        grasp.verdict = self.verdict(&grasp);
        grasp
    }

    /// Energies of the state before closing, with exact distances.
    fn energies(
        &mut self,
        object: &ObjectSearch,
        object_from_base: &IsometryMatrix3<f64>,
        frames: &[IsometryMatrix3<f64>],
    ) -> Energies {
        let contacts: Vec<VirtualContact> = (0..self.hand.contacts().len())
            .map(|contact| {
                let (point, normal) = self.hand.contact_in_base(contact, frames);
                virtual_contact(object.surface(), object_from_base * point, object_from_base.rotation * normal)
            })
            .collect();
        let contact = contact_energy(&contacts);
        self.potential.forget();
        let potential = self.potential.of(&contacts, &object.mass, &EpsilonLimits::EXACT).unwrap_or(1.0);
        let total = match self.energy {
            EnergyKind::ContactAndPotential if potential < 0.0 => potential * self.potential_scale,
            _ => contact,
        };
        Energies { total, contact, potential }
    }

    fn verdict(&self, grasp: &RatedGrasp) -> GraspVerdict {
        let first = grasp.contacts.first().map(|contact| contact.link);
        let epsilon = match self.keeping.space {
            WrenchSpace::Force => grasp.quality.epsilon_force,
            WrenchSpace::Wrench => grasp.quality.epsilon_wrench,
        };
        if grasp.contacts.iter().all(|contact| Some(contact.link) == first) {
            GraspVerdict::OpenHand
        } else if epsilon == 0.0 {
            GraspVerdict::NoForceClosure
        } else if epsilon < self.keeping.min_epsilon {
            GraspVerdict::LowQuality
        } else if self.keeping.table && !grasp.clearances.iter().any(|lowest| lowest.shaped >= 0.0) {
            GraspVerdict::BelowTable
        } else {
            GraspVerdict::Kept
        }
    }
}

/// A virtual contact at a point in `Object`, with the surface's exact closest point.
fn virtual_contact(surface: &ContactSurface, point: Point3<f64>, normal: Unit<Vector3<f64>>) -> VirtualContact {
    let (outward, distance) = surface.outward(&point);
    VirtualContact {
        point: point.map(|part| part as f32).into(),
        normal: normal.map(|part| part as f32).into(),
        distance: distance as f32,
        cos: -outward.dot(&normal) as f32,
    }
}

/// Quality of contacts in their wrench space.
struct QualityMeter {
    cone: FrictionCone,
    volume_cone: FrictionCone,
    solver: EpsilonSolver,
    hull: HullSolver,
    set: WrenchSet,
}

impl QualityMeter {
    fn new(keeping: &Keeping, level: SimdLevel) -> Self {
        let cone = |edges| match keeping.torsion {
            Some(torsion) => FrictionCone::soft(keeping.friction, torsion),
            None => FrictionCone::hard(keeping.friction, edges),
        };
        Self {
            cone: cone(keeping.edges as usize),
            volume_cone: cone(VOLUME_EDGES),
            solver: EpsilonSolver::new(level),
            hull: HullSolver::default(),
            set: WrenchSet::default(),
        }
    }

    fn of(&mut self, contacts: &[GraspContact], mass: &MassFrame) -> Quality {
        let contacts: Vec<Contact> =
            contacts.iter().map(|contact| Contact::new(contact.point, -contact.normal)).collect();
        if contacts.len() < 2 {
            return Quality::default();
        }
        self.solver.forget();
        self.set.fill(&contacts, &self.cone, mass);
        let epsilon_force = self.solver.of_forces(&self.set, &EpsilonLimits::EXACT).lower;
        let epsilon_wrench = self.solver.of_wrenches_within(&self.set, &EpsilonLimits::EXACT).lower;
        let volume = if epsilon_wrench > 0.0 {
            self.set.fill(&contacts, &self.volume_cone, mass);
            self.hull.of_wrenches(&self.set).volume
        } else {
            0.0
        };
        Quality { epsilon_force, epsilon_wrench, volume }
    }
}
