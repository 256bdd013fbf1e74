//! Whether a state of the hand is legal, and how near its virtual contacts are.

use std::sync::{Arc, OnceLock};

use nalgebra::Vector3;

use super::{
    field::DistanceField,
    frame::Frame,
    links::{Links, MAX_JOINTS},
    meeting::{ClearPostures, overlap},
    opposition::Oppositions,
    solids::{ALLOWED_OVERLAP, Balls, HandSolids, LANES, Solid},
    symmetry::{SolidTolerances, is_half_turn_symmetric},
    unsearchable::UnsearchableHand,
    variables::check_amplitudes,
};
use crate::{collision::Bodies, hand::Hand};
use kernel::geom::{
    lanes::{Affine, Lanes, each_of},
    simd_kernel,
};

/// Maximal count: the bits of a word.
const MAX_SOLIDS: usize = u128::BITS as usize;

/// A hand, prepared for annealing: shared by threads.
pub struct HandSearch {
    pub(super) hand: Arc<Hand>,
    pub(super) links: Links,
    pub(super) solids: HandSolids,
    /// Blocks of sixteen solids: their middles, and balls around them that hold them or that lie in them.
    middles: Vec<Middles>,
    /// Virtual contacts.
    contacts: Vec<Virtual>,
    pub(super) base_from_approach: Frame,
    /// Both made on first use: pads on pairs of points need neither.
    clear: OnceLock<ClearPostures>,
    oppositions: OnceLock<Oppositions>,
}

struct Middles {
    reach: [f32; LANES],
    /// Signed distance below which the object is too near the solid's middle.
    inner: [f32; LANES],
}

#[derive(Clone, Copy)]
struct Virtual {
    link: usize,
    point: Vector3<f64>,
    normal: Vector3<f64>,
}

/// Memory for one state after another.
pub(super) struct StateScratch {
    pub(super) values: [f64; MAX_JOINTS],
    /// Pose of each link, expressed in the object's frame.
    pub(super) frames: Vec<Frame>,
    /// The solids, those first that were illegal last.
    order: Vec<usize>,
    pairs: Vec<usize>,
    pub(super) contacts: Vec<VirtualContact>,
}

/// A virtual contact of a state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct VirtualContact {
    /// In `Object` [m].
    pub(super) point: [f32; 3],
    /// Out of the hand, in `Object`.
    pub(super) normal: [f32; 3],
    /// From the surface, negative inside [m].
    pub(super) distance: f32,
    /// Cosine of the angle between the normal and the direction to the surface's closest point.
    pub(super) cos: f32,
}

impl HandSearch {
    /// Prepares a hand, whose bodies are what of it can collide.
    ///
    /// # Errors
    /// When it cannot be annealed.
    pub fn new(hand: &Arc<Hand>, bodies: &Bodies) -> Result<Self, UnsearchableHand> {
        let links = Links::new(hand)?;
        check_amplitudes(hand)?;
        let approach = hand.approach();
        if approach.link != 0 {
            return Err(UnsearchableHand::MovingApproach);
        }
        let mut solids = HandSolids::new(bodies)?;
        let count = solids.solids.len();
        if count > MAX_SOLIDS {
            return Err(UnsearchableHand::TooManyShapes { count, max: MAX_SOLIDS });
        }
        // The order of the pairs is that of the links.
        solids.pairs.sort_unstable();
        let block = |solids: &[Solid]| Middles {
            reach: lanes(solids, |solid| solid.reach as f32),
            inner: lanes(solids, |solid| (solid.inner - ALLOWED_OVERLAP) as f32),
        };
        let middles = solids.solids.chunks(LANES).map(block).collect();
        let contact = |contact: &crate::hand::ContactPoint| Virtual {
            link: contact.link,
            point: contact.point.coords,
            normal: contact.normal.into_inner(),
        };
        let contacts = hand.contacts().iter().map(contact).collect();
        let base_from_approach = Frame::of(&approach.link_from_frame);
        let hand = Arc::clone(hand);
        let (clear, oppositions) = (OnceLock::new(), OnceLock::new());
        Ok(Self { hand, links, solids, middles, contacts, base_from_approach, clear, oppositions })
    }

    /// The hand.
    pub fn hand(&self) -> &Arc<Hand> {
        &self.hand
    }

    /// Whether the hand is a gripper whose solids are the same after half a turn about its approach, those of the fingers within
    /// 0.1 mm, the others within 4 mm: a grasp and the one rotated so count as one.
    pub fn is_half_turn_symmetric(&self) -> bool {
        is_half_turn_symmetric(&self.hand, &self.solids, SolidTolerances::GRASPS)
    }

    /// Whether no two links overlap for sure in the posture of these amplitudes.
    #[inline(always)]
    fn is_surely_clear(&self, amplitudes: &[f64]) -> bool {
        let clear = self.clear.get_or_init(|| ClearPostures::new(&self.hand, &self.links, &self.solids));
        clear.holds(amplitudes)
    }

    /// Contacts that face each other, over the hand's postures.
    pub(super) fn oppositions(&self) -> &Oppositions {
        self.oppositions.get_or_init(|| {
            let mut scratch = self.scratch();
            Oppositions::new(&self.hand, &self.solids, |amplitudes| {
                self.set_frames(&Frame::identity(), amplitudes, &mut scratch);
                self.is_clear_of_itself(&mut scratch)
            })
        })
    }

    pub(super) fn scratch(&self) -> StateScratch {
        StateScratch {
            values: [0.0; MAX_JOINTS],
            frames: vec![Frame::identity(); self.links.count()],
            order: (0..self.solids.solids.len()).collect(),
            pairs: (0..self.solids.pairs.len()).collect(),
            contacts: vec![VirtualContact::default(); self.contacts.len()],
        }
    }

    /// Places the links for a base in `Object` and amplitudes.
    #[inline(always)]
    fn set_frames(&self, object_from_base: &Frame, amplitudes: &[f64], scratch: &mut StateScratch) {
        self.links.values(amplitudes, &mut scratch.values);
        self.links.link_frames(object_from_base, &scratch.values, &mut scratch.frames);
    }

    /// Whether no two links overlap that may not.
    fn is_clear_of_itself(&self, scratch: &mut StateScratch) -> bool {
        let StateScratch { frames, pairs, .. } = scratch;
        let hit = pairs.iter().position(|pair| {
            let [one, other] = self.solids.pairs[*pair].map(|solid| &self.solids.solids[solid]);
            overlap(one, other, frames)
        });
        // Most likely the next one is stopped by the same.
        hit.inspect(|hit| pairs[..=*hit].rotate_right(1)).is_none()
    }
}

fn lanes(solids: &[Solid], of: impl Fn(&Solid) -> f32) -> [f32; LANES] {
    std::array::from_fn(|lane| of(&solids[lane.min(solids.len() - 1)]))
}

simd_kernel! {
    /// Sets the frames of a state's links and checks whether it is feasible.
    pub(super) fn is_feasible(
        hand: &HandSearch, field: &DistanceField, object_from_base: &Frame, amplitudes: &[f64], scratch: &mut StateScratch,
    ) -> bool = is_feasible_body;
}

#[inline(always)]
fn is_feasible_body<L: Lanes>(
    l: L,
    hand: &HandSearch,
    field: &DistanceField,
    object_from_base: &Frame,
    amplitudes: &[f64],
    scratch: &mut StateScratch,
) -> bool {
    hand.set_frames(object_from_base, amplitudes, scratch);
    let solids = &hand.solids.solids;
    let mut near = 0u128;
    // Broad phase: sixteen solids at once by their bounding and inscribed balls.
    for (block, middles) in hand.middles.iter().enumerate() {
        let mut at = [[0.0f32; LANES]; 3];
        for lane in 0..LANES {
            let solid = &solids[(LANES * block + lane).min(solids.len() - 1)];
            let point = scratch.frames[solid.link].point(&solid.centre.coords);
            for axis in 0..3 {
                at[axis][lane] = point[axis] as f32;
            }
        }
        let point: [L::F; 3] = each_of!([0, 1, 2], axis => l.load(&at[axis]));
        let (inner, reach) = (l.load(&middles.inner), l.load(&middles.reach));
        // Inscribed ball against the bounds of the field's blocks, then against the field itself.
        let [low, high] = field.bounds(l, point);
        if l.bits(l.lt(high, inner)) != 0 {
            return false;
        }
        if l.bits(l.lt(low, inner)) != 0 && l.bits(l.lt(field.distance(l, point), inner)) != 0 {
            return false;
        }
        // Solids whose bounding ball may reach the surface, a bit each.
        near |= u128::from(l.bits(l.lt(low, reach))) << (LANES * block);
    }
    // Lanes past the last solid repeat it.
    // Narrow phase in the order of the last rejections: the solid that rejects moves to the front.
    let StateScratch { frames, order, .. } = scratch;
    for rank in 0..order.len() {
        let solid = order[rank];
        if near >> solid & 1 == 1 && !is_clear(l, &solids[solid], field, &frames[solids[solid].link]) {
            order[..=rank].rotate_right(1);
            return false;
        }
    }
    // Self-collision, except in postures known to be clear of it.
    hand.is_surely_clear(amplitudes) || hand.is_clear_of_itself(scratch)
}

/// Whether a solid overlaps the object by no more than is allowed.
#[inline(always)]
fn is_clear<L: Lanes>(l: L, solid: &Solid, field: &DistanceField, frame: &Frame) -> bool {
    let rows: [Affine<L>; 3] = each_of!([0, 1, 2], axis => Affine::new(l, row(frame, axis)));
    for (block, covers) in solid.covers.iter().enumerate() {
        let [low, _] = field.bounds(l, placed(l, &rows, covers));
        let mut near = l.bits(l.lt(low, l.load(&covers.radius)));
        while near != 0 {
            let piece = LANES * block + near.trailing_zeros() as usize;
            near &= near - 1;
            let Some(balls) = solid.balls.get(piece) else { break };
            let distance = field.distance(l, placed(l, &rows, balls));
            let allowed = l.sub(l.load(&balls.radius), l.splat(ALLOWED_OVERLAP as f32));
            if l.bits(l.lt(distance, allowed)) != 0 {
                return false;
            }
        }
    }
    true
}

#[inline(always)]
fn row(frame: &Frame, axis: usize) -> [f32; 4] {
    let rotation = &frame.rotation;
    [rotation[(axis, 0)] as f32, rotation[(axis, 1)] as f32, rotation[(axis, 2)] as f32, frame.origin[axis] as f32]
}

#[inline(always)]
fn placed<L: Lanes>(l: L, rows: &[Affine<L>; 3], balls: &Balls) -> [L::F; 3] {
    let (x, y, z) = (l.load(&balls.x), l.load(&balls.y), l.load(&balls.z));
    each_of!([0, 1, 2], axis => rows[axis].at(l, x, y, z))
}

simd_kernel! {
    /// Distances and angles of the virtual contacts of the state that was placed last.
    pub(super) fn evaluate_contacts(hand: &HandSearch, field: &DistanceField, scratch: &mut StateScratch) = evaluate_contacts_body;
}

#[inline(always)]
fn evaluate_contacts_body<L: Lanes>(l: L, hand: &HandSearch, field: &DistanceField, scratch: &mut StateScratch) {
    let StateScratch { frames, contacts, .. } = scratch;
    for (first, contacts) in (0..).step_by(LANES).zip(contacts.chunks_mut(LANES)) {
        // Virtual contacts in the object's frame, one in each lane.
        let mut at = [[0.0f32; LANES]; 3];
        let mut normals = [[0.0f32; LANES]; 3];
        for lane in 0..contacts.len() {
            let Virtual { link, point, normal } = &hand.contacts[first + lane];
            let frame = &frames[*link];
            let (point, normal) = (frame.point(point), frame.rotation * normal);
            for axis in 0..3 {
                at[axis][lane] = point[axis] as f32;
                normals[axis][lane] = normal[axis] as f32;
            }
        }
        // Signed distance and outward direction; the cosine is between the contact's normal and the inward direction.
        let near = field.near(l, each_of!([0, 1, 2], axis => l.load(&at[axis])));
        let [x, y, z]: [L::F; 3] = each_of!([0, 1, 2], axis => l.mul(near.outward[axis], l.load(&normals[axis])));
        let cos = l.sub(l.splat(0.0), l.add(l.add(x, y), z));
        let (mut distances, mut cosines) = ([0.0; LANES], [0.0; LANES]);
        l.store(near.distance, &mut distances);
        l.store(cos, &mut cosines);
        for (lane, contact) in contacts.iter_mut().enumerate() {
            *contact = VirtualContact {
                point: [at[0][lane], at[1][lane], at[2][lane]],
                normal: [normals[0][lane], normals[1][lane], normals[2][lane]],
                distance: distances[lane],
                cos: cosines[lane],
            };
        }
    }
}
