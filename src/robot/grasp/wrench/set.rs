//! The wrenches of a grasp, laid out for the search of support points.

use super::contact::{Contact, FrictionCone, MassFrame};
use kernel::geom::{SimdLevel, simd_kernel};

/// Largest shift of each coordinate of a wrench, against a weight of 1: far more than rounding, far less than
/// anything that counts.
pub const JOGGLE: f64 = 1e-10;
/// Hulls no thicker than this, against the largest weight, count as flat.
pub const FLAT: f64 = 1e-9;

/// Wrenches side by side in a vector register.
const LANES: usize = 8;

/// The wrenches of all edges of all contacts: force, then torque divided by the object's radius, of unit normal forces
/// times the contact's weight. Keeps its memory when filled again.
#[derive(Clone, Debug, Default)]
pub struct WrenchSet {
    /// Eight wrenches each, coordinate by coordinate. Lanes of the last that no wrench was put in hold its first.
    blocks: Vec<[[f64; LANES]; 6]>,
    count: usize,
    scale: f64,
    /// Shifts of the wrenches, by index; grows with the largest set.
    joggle: Vec<[f64; 6]>,
}

impl WrenchSet {
    /// The wrenches of a grasp.
    pub fn new(contacts: &[Contact], cone: &FrictionCone, mass: &MassFrame) -> Self {
        let mut set = Self::default();
        set.fill(contacts, cone, mass);
        set
    }

    /// Holds the wrenches of another grasp from now on.
    pub fn fill(&mut self, contacts: &[Contact], cone: &FrictionCone, mass: &MassFrame) {
        self.clear();
        for (index, contact) in contacts.iter().enumerate().filter(|(_, contact)| contact.weight > 0.0) {
            let (normal, tangent) = (contact.normal.into_inner(), contact.tangent.into_inner());
            let across = normal.cross(&tangent);
            let arm = (contact.point - mass.centre) / mass.radius;
            let [torque, lean, lean_across] = [arm.cross(&normal), arm.cross(&tangent), arm.cross(&across)];
            for (edge, [along, aside, torsion]) in cone.edges.iter().enumerate() {
                let force = normal + tangent * *along + across * *aside;
                let torque = torque + lean * *along + lean_across * *aside + normal * (*torsion / mass.radius);
                let wrench = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
                self.push(wrench, contact.weight, index * cone.edges.len() + edge);
            }
        }
    }

    /// A set of given wrenches, for hulls that contacts do not make.
    pub fn from_wrenches(wrenches: &[[f64; 6]]) -> Self {
        let mut set = Self::default();
        wrenches.iter().enumerate().for_each(|(name, wrench)| set.push(*wrench, 1.0, name));
        set
    }

    fn clear(&mut self) {
        self.blocks.clear();
        (self.count, self.scale) = (0, 0.0);
    }

    /// Adds a wrench under a name, which settles how it is moved.
    fn push(&mut self, wrench: [f64; 6], weight: f64, name: usize) {
        while self.joggle.len() <= name {
            self.joggle.push(joggle(self.joggle.len()));
        }
        let moved: [f64; 6] = std::array::from_fn(|axis| (wrench[axis] + self.joggle[name][axis]) * weight);
        assert!(self.count < usize::from(u16::MAX), "no more than 65,535 wrenches");
        let lane = self.count % LANES;
        if lane == 0 {
            self.blocks.push(moved.map(|value| [value; LANES]));
        } else if let Some(block) = self.blocks.last_mut() {
            block.iter_mut().zip(moved).for_each(|(row, value)| row[lane] = value);
        }
        self.count += 1;
        self.scale = self.scale.max(weight);
    }

    /// Number of wrenches.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether the set is empty.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The wrenches as used by the search, moved by up to [`JOGGLE`].
    pub fn wrenches(&self) -> impl Iterator<Item = [f64; 6]> {
        (0..self.count).map(|index| self.point(index as u16))
    }

    /// The largest weight.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// The first `D` coordinates of a wrench.
    pub(super) fn point<const D: usize>(&self, index: u16) -> [f64; D] {
        let (block, lane) = (usize::from(index) / LANES, usize::from(index) % LANES);
        std::array::from_fn(|axis| self.blocks[block][axis][lane])
    }

    /// The wrench that lies farthest along a direction, and how far; of equals the first. The set is not empty.
    pub(super) fn support<const D: usize>(&self, level: SimdLevel, direction: &[f64; D]) -> (u16, f64) {
        let mut whole = [0.0; 6];
        whole[..D].copy_from_slice(direction);
        if D == 3 {
            support_of_forces(level, &self.blocks, &whole)
        } else {
            support_of_wrenches(level, &self.blocks, &whole)
        }
    }
}

simd_kernel! {
    fn support_of_forces(blocks: &[[[f64; LANES]; 6]], direction: &[f64; 6]) -> (u16, f64) = forces_body;
}

simd_kernel! {
    fn support_of_wrenches(blocks: &[[[f64; LANES]; 6]], direction: &[f64; 6]) -> (u16, f64) = wrenches_body;
}

#[inline(always)]
fn forces_body<L>(_: L, blocks: &[[[f64; LANES]; 6]], direction: &[f64; 6]) -> (u16, f64) {
    support_body::<3>(blocks, direction)
}

#[inline(always)]
fn wrenches_body<L>(_: L, blocks: &[[[f64; LANES]; 6]], direction: &[f64; 6]) -> (u16, f64) {
    support_body::<6>(blocks, direction)
}

/// The best of each lane first, then of the lanes: the same at every width.
#[inline(always)]
fn support_body<const D: usize>(blocks: &[[[f64; LANES]; 6]], direction: &[f64; 6]) -> (u16, f64) {
    // Height of each wrench along the direction; each lane keeps its first highest.
    let mut best = [f64::NEG_INFINITY; LANES];
    let mut point = [0u64; LANES];
    for (index, block) in blocks.iter().enumerate() {
        let mut height = [0.0; LANES];
        for axis in 0..D {
            for lane in 0..LANES {
                height[lane] += block[axis][lane] * direction[axis];
            }
        }
        for lane in 0..LANES {
            let better = height[lane] > best[lane];
            best[lane] = if better { height[lane] } else { best[lane] };
            point[lane] = if better { index as u64 } else { point[lane] };
        }
    }
    // The highest of the lanes; at equal heights the lowest index.
    let (mut found, mut max) = (u64::MAX, f64::NEG_INFINITY);
    for lane in 0..LANES {
        let index = point[lane] * LANES as u64 + lane as u64;
        if best[lane] > max || (best[lane] == max && index < found) {
            (found, max) = (index, best[lane]);
        }
    }
    (found as u16, max)
}

/// Six numbers in +-JOGGLE that belong to an index (SplitMix64, Steele et al. 2014).
fn joggle(name: usize) -> [f64; 6] {
    std::array::from_fn(|axis| {
        let mut bits = (6 * name as u64 + axis as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^= bits >> 31;
        JOGGLE * ((bits >> 11) as f64 * (2.0 / (1u64 << 53) as f64) - 1.0)
    })
}
