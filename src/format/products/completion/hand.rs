//! Record of touch by a hand: forces and gaps of its contacts, and its pose at the end of each approach.

use super::{BlockedProbe, TouchContact};
use crate::codec::{
    RecordError,
    fields::{floats, lengthy, pose, ranged},
    proto, wire,
};
use kernel::geom::{CameraCv, HandBase, Pose};

const MESSAGE: &str = "HandContacts";

/// Additions of a hand to the contacts that it made.
///
/// For the hot path keep one and refill it: its lists keep their memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HandTouch {
    /// The hand's name, from its description.
    pub hand: String,
    /// Names of its links; the base is the first.
    pub links: Vec<String>,
    /// Names of its joints.
    pub joints: Vec<String>,
    /// One row per contact, in their order.
    pub contacts: Vec<LinkContact>,
    /// One row per probe, in their order.
    pub approaches: Vec<Approach>,
}

/// Measurement of a hand at one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkContact {
    /// Which link touched: an index in [`HandTouch::links`].
    pub link: u32,
    /// Force along the contact's normal [N], 0 or positive.
    pub force: f32,
    /// From the mesh to the link's surface [m]; negative where the link presses in.
    pub gap: f32,
}

/// End of one guarded move of a hand: how, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct Approach {
    /// Pose of the hand's base at the end.
    pub camera_from_hand: Pose<CameraCv, HandBase>,
    /// Values of the joints at the end [rad or m], in the order of [`HandTouch::joints`].
    pub joints: Vec<f64>,
    /// Event that ended it.
    pub end: ApproachEnd,
}

/// Event that ended an approach.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ApproachEnd {
    /// The hand came to rest.
    AtRest,
    /// The time was up before it did.
    TimedOut,
    /// The hand never touched.
    Missed,
    /// The simulation became unstable: its contacts are not kept.
    Unstable,
    /// A contact pressed harder than the hand's fingertips can bear: its contacts are not kept.
    Overloaded,
    /// An obstacle stopped the approaching hand, in a scene.
    Blocked,
}

impl ApproachEnd {
    /// Every end, in the order of their numbers on disk.
    pub const ALL: [Self; 6] =
        [Self::AtRest, Self::TimedOut, Self::Missed, Self::Unstable, Self::Overloaded, Self::Blocked];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::AtRest => "at_rest",
            Self::TimedOut => "timed_out",
            Self::Missed => "missed",
            Self::Unstable => "unstable",
            Self::Overloaded => "overloaded",
            Self::Blocked => "blocked",
        }
    }

    /// Whether such an approach may have contacts.
    pub fn has_contacts(self) -> bool {
        matches!(self, Self::AtRest | Self::TimedOut)
    }

    fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.get(usize::from(byte)).copied()
    }
}

impl HandTouch {
    /// Appends fields 12 to 20.
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        let Self { hand, links, joints, contacts, approaches } = self;
        out.reserve(9 * contacts.len() + (97 + 8 * joints.len()) * approaches.len() + 512);
        wire::bytes(out, 12, hand.as_bytes());
        links.iter().for_each(|name| wire::element(out, 13, name.as_bytes()));
        joints.iter().for_each(|name| wire::element(out, 14, name.as_bytes()));
        wire::uint32s(out, 15, contacts.iter().map(|contact| contact.link));
        wire::singles(out, 16, contacts.iter().map(|contact| contact.force));
        wire::singles(out, 17, contacts.iter().map(|contact| contact.gap));
        wire::doubles_of(out, 18, approaches.iter().flat_map(|approach| approach.camera_from_hand.to_rows()));
        wire::doubles_of(out, 19, approaches.iter().flat_map(|approach| approach.joints.iter().copied()));
        wire::bytes_of(out, 20, approaches.iter().map(|approach| approach.end as u8));
    }

    /// Reads and checks the fields of a hand for these contacts; `None` if no hand made them.
    pub(super) fn decode(
        message: &proto::ClutterContacts,
        probes: u32,
        contacts: &[TouchContact],
        blocked: &[BlockedProbe],
    ) -> Result<Option<Self>, RecordError> {
        let proto::ClutterContacts { hand, links, joints, link, forces, gaps, joint_values, ends, .. } = message;
        let poses = &message.camera_from_hand;
        let names = hand.len() + links.len() + joints.len();
        if names + link.len() + forces.len() + gaps.len() + joint_values.len() + ends.len() + poses.len() == 0 {
            return Ok(None);
        }
        ranged(MESSAGE, "links", links.len() as f64, !links.is_empty(), "at least one, the base")?;
        let (forces, gaps) = (floats(MESSAGE, "forces", forces, 1)?, floats(MESSAGE, "gaps", gaps, 1)?);
        for (field, found) in [("link", link.len()), ("forces", forces.len()), ("gaps", gaps.len())] {
            lengthy(MESSAGE, field, contacts.len(), found)?;
        }
        let mut by_link = Vec::with_capacity(contacts.len());
        for ((link, force), gap) in link.iter().copied().zip(forces).zip(gaps) {
            ranged(MESSAGE, "link", f64::from(link), (link as usize) < links.len(), "an index into links")?;
            ranged(MESSAGE, "forces", f64::from(force), force >= 0.0, "0 or positive")?;
            by_link.push(LinkContact { link, force, gap });
        }
        let count = probes as usize;
        for (field, expected, found) in [
            ("ends", count, ends.len()),
            ("camera_from_hand", 12 * count, poses.len()),
            ("joint_values", joints.len() * count, joint_values.len()),
        ] {
            lengthy(MESSAGE, field, expected, found)?;
        }
        let wild = joint_values.iter().find(|value| !value.is_finite());
        ranged(MESSAGE, "joint_values", wild.copied().unwrap_or_default(), wild.is_none(), "finite")?;
        let mut approaches = Vec::with_capacity(count);
        for (index, byte) in ends.iter().enumerate() {
            let end = ApproachEnd::from_byte(*byte).ok_or(RecordError::Range {
                message: MESSAGE,
                field: "ends",
                value: f64::from(*byte),
                allowed: "0 to 5",
            })?;
            let camera_from_hand = pose(MESSAGE, "camera_from_hand", &poses[12 * index..][..12])?;
            let joints = joint_values[joints.len() * index..][..joints.len()].to_vec();
            approaches.push(Approach { camera_from_hand, joints, end });
        }
        let barren = contacts.iter().find(|contact| !approaches[contact.probe as usize].end.has_contacts());
        let value = barren.map_or(0.0, |contact| f64::from(contact.probe));
        ranged(MESSAGE, "probe", value, barren.is_none(), "an approach that did not miss or become unstable")?;
        // Fingers can be stopped where the hand was not.
        let stops = |end: ApproachEnd| end.has_contacts() || end == ApproachEnd::Blocked;
        let stray = blocked.iter().find(|blocked| !stops(approaches[blocked.probe as usize].end));
        let value = stray.map_or(0.0, |blocked| f64::from(blocked.probe));
        ranged(MESSAGE, "blocked_probe", value, stray.is_none(), "an approach that did not miss or become unstable")?;
        let is_said = |probe: usize| blocked.iter().any(|blocked| blocked.probe as usize == probe);
        let unsaid = (0..count).find(|probe| approaches[*probe].end == ApproachEnd::Blocked && !is_said(*probe));
        let value = unsaid.map_or(0.0, |probe| probe as f64);
        ranged(MESSAGE, "ends", value, unsaid.is_none(), "5 where blocked_probe has a row with the obstacle")?;
        let (hand, links, joints) = (hand.clone(), links.clone(), joints.clone());
        Ok(Some(Self { hand, links, joints, contacts: by_link, approaches }))
    }
}
