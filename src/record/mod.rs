//! What is on disk: records, their protobuf codec and schema, the format's number.
//!
//! A record is one protobuf message on one MCAP topic (`proto/graspmill.proto`, `proto/touch.proto`, `proto/hand.proto`,
//! `proto/reachability.proto`, `proto/grasp.proto`, `proto/trials.proto`, `proto/patches.proto`, `proto/patch_images.proto`,
//! `proto/heatmaps.proto`). Encoding is written by hand, in tag
//! order, straight from the record's own memory; decoding goes through the generated types and then checks every
//! length, range and count, so that a decoded record can be trusted. Names of objects, paths, clocks and sample
//! indices never enter a payload: the same sample has the same bytes in every dataset.

mod block;
mod channels;
mod colour_image;
mod depth;
mod error;
mod facts;
mod field;
mod grasp;
#[cfg(test)]
mod grasp_tests;
mod grasp_type;
mod hand;
mod heatmap;
mod pair;
mod patch;
#[cfg(test)]
mod patch_tests;
mod shapes;
#[cfg(test)]
mod tests;
mod touch;
mod trial;
#[cfg(test)]
mod trial_tests;
mod wire;

#[allow(dead_code, reason = "TactileContacts is read as HandContacts, which has its fields")]
pub(crate) mod proto {
    include!(concat!(env!("OUT_DIR"), "/graspmill.rs"));
}

pub use block::ReachabilityBlock;
pub use channels::{Cloud, Coverage, Implicit, Tsdf, Visibility};
pub use colour_image::PatchImageColour;
pub use depth::{Depth, DepthCoding};
pub use error::RecordError;
pub use facts::{BlockFacts, GraspFacts, PairFacts, PatchFacts, SampleFacts, TrialFacts};
pub use field::{FieldHeader, ReachabilityField};
pub use grasp::{
    FORCE, Grasp, GraspMethod, GraspRun, GraspVerdict, HandNames, HeldContact, RunStretch, STRETCHES, Seed, WRENCH,
};
pub use grasp_type::{TYPE_BINS, TYPE_DIGITS, type_digits};
pub use hand::{Approach, ApproachEnd, Felt, HandTouch};
pub use heatmap::{HeatmapPoint, PatchHeatmap};
pub use pair::VoxelPair;
pub use patch::{HeatmapPatch, PATCH_POINTS, POINT_NAMES, PatchColour, PatchPoint};
pub use shapes::{HandJoint, HandShape, LinkSolid, ObjectShape, TrialHand};
pub use touch::{TactileContacts, TouchContact};
pub use trial::{
    ClosedHand, GraspTrial, GraspTrials, PerturbedTrial, PressedContact, TrialMethod, TrialOutcome, TrialVerdict,
};

use crate::ids::{Digest, ObjectId, Product, SampleId, ViewId};

/// Number of the format on disk; a reader refuses every other.
pub const FORMAT_VERSION: u32 = 1;

/// What a message of a shard holds; each has its own topic and schema.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Channel {
    /// [`VoxelPair`]: partial and complete grid, camera, poses; every completion sample has one.
    Pair,
    /// [`Visibility`]: cells seen to be free.
    Visibility,
    /// [`Depth`]: the depth crop.
    Depth,
    /// [`Cloud`]: the partial point cloud.
    Cloud,
    /// [`Tsdf`]: truncated signed distance.
    Tsdf,
    /// [`Coverage`]: share of each cell that is solid.
    Coverage,
    /// [`Implicit`]: samples for implicit networks.
    Implicit,
    /// [`TactileContacts`] of random rays from the far side.
    TouchRays,
    /// [`TactileContacts`] of a hand that feels its way over what the camera did not see.
    TouchExploration,
    /// [`TactileContacts`] of a hand that takes hold once.
    TouchGrasp,
    /// [`ReachabilityBlock`]: labels, proofs and witnesses of one position; every reachability sample has one.
    Block,
    /// [`GraspRun`]: one run of annealing and the grasps that it found; every sample of grasps has one.
    GraspRun,
    /// [`GraspTrials`]: physical trials of the grasps that a run kept.
    GraspTrials,
    /// [`HeatmapPatch`]: depth around the palm and the fingertips of one grasp, with labels; every sample of patches has one.
    Patch,
    /// [`PatchColour`]: the same patches in colour.
    PatchColour,
    /// [`Depth`] of the whole image that the patches are cut out of.
    PatchImage,
    /// [`PatchImageColour`]: the same image in colour.
    PatchImageColour,
    /// [`PatchHeatmap`]: truth for heatmaps over the whole image.
    PatchHeatmap,
}

impl Channel {
    /// Every channel, in the order in which a sample's messages are written.
    pub const ALL: [Self; 18] = [
        Self::Pair,
        Self::Visibility,
        Self::Depth,
        Self::Cloud,
        Self::Tsdf,
        Self::Coverage,
        Self::Implicit,
        Self::TouchRays,
        Self::TouchExploration,
        Self::TouchGrasp,
        Self::Block,
        Self::GraspRun,
        Self::GraspTrials,
        Self::Patch,
        Self::PatchColour,
        Self::PatchImage,
        Self::PatchImageColour,
        Self::PatchHeatmap,
    ];

    /// The product whose samples have such messages.
    pub fn product(self) -> Product {
        match self {
            Self::Pair
            | Self::Visibility
            | Self::Depth
            | Self::Cloud
            | Self::Tsdf
            | Self::Coverage
            | Self::Implicit
            | Self::TouchRays
            | Self::TouchExploration
            | Self::TouchGrasp => Product::Completion,
            Self::Block => Product::Reachability,
            Self::GraspRun | Self::GraspTrials => Product::Grasps,
            Self::Patch | Self::PatchColour | Self::PatchImage | Self::PatchImageColour | Self::PatchHeatmap => {
                Product::Patches
            }
        }
    }

    /// Whether its messages are [`TactileContacts`]; each kind of touch has a channel of its own.
    pub fn is_touch(self) -> bool {
        self == Self::TouchRays || self.is_touch_by_hand()
    }

    /// Whether its [`TactileContacts`] have a [`HandTouch`].
    pub fn is_touch_by_hand(self) -> bool {
        matches!(self, Self::TouchExploration | Self::TouchGrasp)
    }

    /// The channel that every sample of a product has; the facts of a sample are counted in it.
    pub fn leading(product: Product) -> Self {
        match product {
            Product::Completion => Self::Pair,
            Product::Reachability => Self::Block,
            Product::Grasps => Self::GraspRun,
            Product::Patches => Self::Patch,
        }
    }

    /// MCAP topic.
    pub fn topic(self) -> &'static str {
        match self {
            Self::Pair => "/completion/pair",
            Self::Visibility => "/completion/visibility",
            Self::Depth => "/completion/depth",
            Self::Cloud => "/completion/cloud",
            Self::Tsdf => "/completion/tsdf",
            Self::Coverage => "/completion/coverage",
            Self::Implicit => "/completion/implicit",
            Self::TouchRays => "/completion/touch_rays",
            Self::TouchExploration => "/completion/touch_exploration",
            Self::TouchGrasp => "/completion/touch_grasp",
            Self::Block => "/reachability/block",
            Self::GraspRun => "/grasps/run",
            Self::GraspTrials => "/grasps/trials",
            Self::Patch => "/patches/patch",
            Self::PatchColour => "/patches/colour",
            Self::PatchImage => "/patches/image",
            Self::PatchImageColour => "/patches/image_colour",
            Self::PatchHeatmap => "/patches/heatmap",
        }
    }

    /// The last part of the topic, for column names and people.
    pub fn name(self) -> &'static str {
        self.topic().rsplit('/').next().unwrap_or_default()
    }

    /// Full name of the protobuf message.
    pub fn schema_name(self) -> &'static str {
        match self {
            Self::Pair => "graspmill.VoxelPair",
            Self::Visibility => "graspmill.Visibility",
            Self::Depth | Self::PatchImage => "graspmill.Depth",
            Self::Cloud => "graspmill.Cloud",
            Self::Tsdf => "graspmill.Tsdf",
            Self::Coverage => "graspmill.Coverage",
            Self::Implicit => "graspmill.Implicit",
            Self::TouchRays => "graspmill.TactileContacts",
            Self::TouchExploration | Self::TouchGrasp => "graspmill.HandContacts",
            Self::Block => "graspmill.ReachabilityBlock",
            Self::GraspRun => "graspmill.GraspRun",
            Self::GraspTrials => "graspmill.GraspTrials",
            Self::Patch => "graspmill.HeatmapPatch",
            Self::PatchColour => "graspmill.PatchColour",
            Self::PatchImageColour => "graspmill.PatchImageColour",
            Self::PatchHeatmap => "graspmill.PatchHeatmap",
        }
    }

    /// The `FileDescriptorSet` of its message: the schema that a shard carries for it.
    pub fn descriptors(self) -> &'static [u8] {
        match self {
            Self::TouchRays => include_bytes!(concat!(env!("OUT_DIR"), "/touch.bin")),
            Self::TouchExploration | Self::TouchGrasp => include_bytes!(concat!(env!("OUT_DIR"), "/hand.bin")),
            Self::GraspTrials => include_bytes!(concat!(env!("OUT_DIR"), "/trials.bin")),
            Self::PatchImage => descriptors(Product::Completion),
            Self::PatchImageColour => include_bytes!(concat!(env!("OUT_DIR"), "/patch_images.bin")),
            Self::PatchHeatmap => include_bytes!(concat!(env!("OUT_DIR"), "/heatmaps.bin")),
            other => descriptors(other.product()),
        }
    }

    /// The channel of a topic; `None` for a topic that this version does not know.
    pub fn from_topic(topic: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|channel| channel.topic() == topic)
    }
}

/// The `FileDescriptorSet` of the messages that every dataset of a product has.
pub fn descriptors(product: Product) -> &'static [u8] {
    match product {
        Product::Completion => include_bytes!(concat!(env!("OUT_DIR"), "/graspmill.bin")),
        Product::Reachability => include_bytes!(concat!(env!("OUT_DIR"), "/reachability.bin")),
        Product::Grasps => include_bytes!(concat!(env!("OUT_DIR"), "/grasp.bin")),
        Product::Patches => include_bytes!(concat!(env!("OUT_DIR"), "/patches.bin")),
    }
}

/// Checks the payloads of a sample one after the other, as [`VoxelPair::decode`] and its siblings do, and what stands
/// beside a pair or a run against that.
#[derive(Debug, Default)]
pub struct Checker {
    /// The pair of the sample.
    pair: Option<VoxelPair>,
    /// Whose run it is, and the places of its kept grasps.
    kept: Option<(SampleId, Vec<u32>)>,
    /// The patches of the sample.
    patch: Option<HeatmapPatch>,
}

/// What a payload says that its sample's ledger row says too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checked {
    /// Whose it is.
    pub sample: SampleId,
    /// Of a leading channel.
    pub facts: Option<SampleFacts>,
    /// Of trials.
    pub trials: Option<TrialFacts>,
    /// Of touch: contacts in the grid in cells that the pair's complete grid lacks.
    pub touched_outside_complete: u32,
}

impl Checker {
    /// Checks the next payload; those of a sample come in the order of their channels.
    ///
    /// # Errors
    /// When the payload is no valid record of that channel, or does not fit the pair of its sample.
    pub fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<Checked, RecordError> {
        let checked = |sample| Ok(Checked { sample, facts: None, trials: None, touched_outside_complete: 0 });
        match channel {
            Channel::Pair => {
                self.pair = None;
                let pair = self.pair.insert(VoxelPair::decode(payload)?);
                Ok(Checked { facts: Some(pair.facts().into()), ..checked(pair.sample)? })
            }
            Channel::Block => {
                let block = ReachabilityBlock::decode(payload)?;
                Ok(Checked { facts: Some(block.facts().into()), ..checked(block.sample)? })
            }
            Channel::GraspRun => {
                let run = GraspRun::decode(payload)?;
                let kept = (0..).zip(&run.grasps).filter(|(_, grasp)| grasp.verdict == GraspVerdict::Kept);
                self.kept = Some((run.sample, kept.map(|(place, _)| place).collect()));
                Ok(Checked { facts: Some(run.facts().into()), ..checked(run.sample)? })
            }
            Channel::GraspTrials => {
                let trials = GraspTrials::decode(payload)?;
                if let Some((_, kept)) = self.kept.as_ref().filter(|(sample, _)| *sample == trials.sample) {
                    trials.check_beside(kept)?;
                }
                Ok(Checked { trials: Some(trials.facts()), ..checked(trials.sample)? })
            }
            Channel::Patch => {
                self.patch = None;
                let patch = self.patch.insert(HeatmapPatch::decode(payload)?);
                Ok(Checked { facts: Some(patch.facts().into()), ..checked(patch.sample)? })
            }
            Channel::PatchColour => checked(PatchColour::decode(payload)?.sample),
            Channel::PatchImage => {
                let image = Depth::decode(payload)?;
                if let Some(patch) = self.patch.as_ref().filter(|patch| patch.sample == image.sample) {
                    patch.check_image(&image)?;
                }
                checked(image.sample)
            }
            Channel::PatchImageColour => checked(PatchImageColour::decode(payload)?.sample),
            Channel::PatchHeatmap => {
                let heatmap = PatchHeatmap::decode(payload)?;
                if let Some(patch) = self.patch.as_ref().filter(|patch| patch.sample == heatmap.sample) {
                    heatmap.check_beside(patch)?;
                }
                checked(heatmap.sample)
            }
            Channel::TouchRays | Channel::TouchExploration | Channel::TouchGrasp => {
                let touch = TactileContacts::decode_of(channel, payload)?;
                let Some(pair) = self.pair.as_ref().filter(|pair| pair.sample == touch.sample) else {
                    return checked(touch.sample);
                };
                touch.check_beside(pair)?;
                let cells = touch.contacts.iter().filter_map(|contact| contact.cell);
                let touched_outside_complete = cells.filter(|cell| !pair.complete.get(*cell)).count() as u32;
                Ok(Checked { touched_outside_complete, ..checked(touch.sample)? })
            }
            Channel::Visibility => checked(Visibility::decode(payload)?.sample),
            Channel::Depth => checked(Depth::decode(payload)?.sample),
            Channel::Cloud => checked(Cloud::decode(payload)?.sample),
            Channel::Tsdf => checked(Tsdf::decode(payload)?.sample),
            Channel::Coverage => checked(Coverage::decode(payload)?.sample),
            Channel::Implicit => checked(Implicit::decode(payload)?.sample),
        }
    }
}

fn sample_from_proto(message: &'static str, sample: Option<proto::SampleId>) -> Result<SampleId, RecordError> {
    let sample = sample.ok_or(RecordError::Missing { message, field: "sample" })?;
    let subject = sample.subject.as_slice().try_into().map_err(|_| RecordError::Length {
        message,
        field: "sample.subject",
        expected: 32,
        found: sample.subject.len(),
    })?;
    Ok(SampleId {
        subject: ObjectId(Digest(subject)),
        instance: sample.instance,
        view: ViewId(sample.view),
        camera: sample.camera,
    })
}
