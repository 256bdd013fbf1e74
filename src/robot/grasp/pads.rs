//! The two pads of a gripper: their distance, and how far along the fingers they reach.

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use super::{motion::preshape, solids::HandSolids};
use crate::hand::Hand;
use kernel::geom::rotation_towards;

/// Nearer to the tips of the fingers no pad takes hold: there their edges are rounded [m].
pub(super) const TIP: f64 = 0.003;

/// A hand in a posture, with the line along which it holds a pair of points.
pub(super) struct Grip {
    /// One value per driven joint.
    pub(super) posture: Vec<f64>,
    /// Amplitudes of the eigengrasps that make it; none of a gripper.
    pub(super) amplitudes: Vec<f64>,
    /// All joints in that posture, and the frames of its links, expressed in the base frame.
    pub(super) joints: Vec<f64>,
    pub(super) frames: Vec<IsometryMatrix3<f64>>,
    /// Origin half way between what holds, z from one to the other.
    pub(super) base_from_line: IsometryMatrix3<f64>,
    /// The part of the approach along which a pair can be held, from that origin on [m].
    pub(super) extent: [f64; 2],
}

/// The two pads of a gripper.
pub(super) struct Pads {
    /// Index of the motor.
    pub(super) index: usize,
    /// Displacement of the first pad per unit of the motor, expressed in the base frame.
    line: Vector3<f64>,
    /// The motor's opened and closed value.
    opened: f64,
    closed: f64,
    /// Width of the opened hand [m].
    pub(super) widest: f64,
    links: [usize; 2],
}

impl Pads {
    /// The pads of a hand with a [`Hand::closing_line`]; `None` of every other.
    pub(super) fn new(hand: &Hand) -> Option<Self> {
        let line = hand.closing_line()?;
        let index = hand.driven().iter().position(|driven| driven.closing_sign() != 0.0)?;
        let driven = &hand.driven()[index];
        let widest = hand.width(&hand.link_frames(&hand.posture_values(&hand.opened())))?;
        let links = hand.pads()?.map(|contact| hand.contacts()[contact].link);
        Some(Self { index, line, opened: driven.opened, closed: driven.closed?, widest, links })
    }

    /// The motor's value at a width; `None` where the pads do not go.
    pub(super) fn value(&self, width: f64) -> Option<f64> {
        let rotation = (self.widest - width) / (2.0 * self.line.norm());
        let max = self.closed - self.opened;
        (0.0..=max.abs()).contains(&rotation).then(|| self.opened + max.signum() * rotation)
    }

    /// The posture of the hand with its motor at a value.
    pub(super) fn posture(&self, hand: &Hand, value: f64) -> Vec<f64> {
        let mut posture = preshape(hand);
        posture[self.index] = value;
        posture
    }

    /// The gripper with its motor at a value.
    pub(super) fn grip(&self, hand: &Hand, solids: &HandSolids, value: f64) -> Grip {
        let posture = self.posture(hand, value);
        let joints = hand.posture_values(&posture);
        let frames = hand.link_frames(&joints);
        let base_from_line = self.base_from_pads(hand, &frames);
        let extent = self.extent(hand, solids, &frames);
        Grip { posture, amplitudes: Vec::new(), joints, frames, base_from_line, extent }
    }

    /// A frame half way between the pads, its z along the first one's direction of motion; the middle of a pad is that of its
    /// contacts.
    pub(super) fn base_from_pads(&self, hand: &Hand, frames: &[IsometryMatrix3<f64>]) -> IsometryMatrix3<f64> {
        let middle = |link: usize| {
            let points: Vec<_> = contacts_of(hand, link, frames).collect();
            points.iter().sum::<Vector3<f64>>() / points.len() as f64
        };
        let [first, second] = self.links.map(middle);
        let rotation = Rotation3::from_matrix_unchecked(rotation_towards(&self.line.normalize(), 0.0));
        IsometryMatrix3::from_parts(Translation3::from((first + second) / 2.0), rotation)
    }

    /// The part of the approach that both pads cover, from their middle on [m]: from the innermost of their contacts to just
    /// before the tips of their links.
    fn extent(&self, hand: &Hand, solids: &HandSolids, frames: &[IsometryMatrix3<f64>]) -> [f64; 2] {
        let approach = hand.approach_pose(frames).isometry().rotation * Vector3::z();
        let middle = self.base_from_pads(hand, frames).translation.vector.dot(&approach);
        let of_pad = |link: usize| {
            let inner = contacts_of(hand, link, frames).map(|point| point.dot(&approach)).fold(f64::INFINITY, f64::min);
            let tip = solids.reach_along(link, &approach, frames);
            [inner - middle, tip - TIP - middle]
        };
        let [one, other] = self.links.map(of_pad);
        let inner = one[0].max(other[0]);
        [inner, one[1].min(other[1]).max(inner)]
    }
}

/// Where the contacts of a link are, expressed in the base frame [m].
fn contacts_of(hand: &Hand, link: usize, frames: &[IsometryMatrix3<f64>]) -> impl Iterator<Item = Vector3<f64>> {
    let on_it = (0..hand.contacts().len()).filter(move |contact| hand.contacts()[*contact].link == link);
    on_it.map(|contact| hand.contact_in_base(contact, frames).0.coords)
}
