//! The poses of one position: labels, their proofs, and joint values that reach the reachable poses.

use prost::Message;

use super::BlockFacts;
use crate::codec::{
    RecordError,
    fields::{lengthy, ranged},
    proto, sample_from_proto, wire,
};
use kernel::{
    geom::{PoseLabel, Proof},
    ids::SampleId,
};

const MESSAGE: &str = "ReachabilityBlock";

/// Which orientations an end effector has at one position of a [`PoseGrid`](kernel::geom::PoseGrid).
///
/// For the hot path keep one and refill it: its lists keep their memory.
#[derive(Clone, Debug, PartialEq)]
pub struct ReachabilityBlock {
    /// Which sample: the robot, and the position's cell in C order over (x, y, z) as its view.
    pub sample: SampleId,
    /// Joints of the planning group.
    pub joints: u32,
    /// One label per cell, C order over (roll, pitch, yaw).
    pub labels: Vec<PoseLabel>,
    /// Proof behind each label.
    pub proofs: Vec<Proof>,
    /// `joints` values [rad or m] for each reachable cell, in the order of the cells.
    pub witnesses: Vec<f64>,
}

impl ReachabilityBlock {
    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        out.reserve(2 * self.labels.len() + 8 * self.witnesses.len() + 96);
        wire::sample(out, 1, &self.sample);
        wire::uint32(out, 2, self.joints);
        wire::bytes_of(out, 3, self.labels.iter().map(|label| *label as u8));
        wire::bytes_of(out, 4, self.proofs.iter().map(|proof| *proof as u8));
        wire::doubles(out, 5, &self.witnesses);
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length or range does not hold, or a proof does not fit its label.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let block = proto::ReachabilityBlock::decode(payload)
            .map_err(|error| RecordError::Protobuf { message: MESSAGE, problem: error.to_string() })?;
        let sample = sample_from_proto(MESSAGE, block.sample)?;
        let joints = block.joints;
        ranged(MESSAGE, "joints", f64::from(joints), (1..=1024).contains(&joints), "1 to 1024")?;
        let labels = labels(MESSAGE, &block.labels)?;
        lengthy(MESSAGE, "proofs", labels.len(), block.proofs.len())?;
        let mut proofs = Vec::with_capacity(labels.len());
        for (byte, label) in block.proofs.iter().zip(&labels) {
            let proof = Proof::from_byte(*byte).filter(|proof| proof.fits(*label));
            let error = || RecordError::Range {
                message: MESSAGE,
                field: "proofs",
                value: f64::from(*byte),
                allowed: "4 for reachable cells, 0 to 3 for the others",
            };
            proofs.push(proof.ok_or_else(error)?);
        }
        let reachable = labels.iter().filter(|label| **label == PoseLabel::Reachable).count();
        lengthy(MESSAGE, "witnesses", reachable * joints as usize, block.witnesses.len())?;
        if let Some(value) = block.witnesses.iter().find(|value| !value.is_finite()) {
            ranged(MESSAGE, "witnesses", *value, false, "finite")?;
        }
        Ok(Self { sample, joints, labels, proofs, witnesses: block.witnesses })
    }

    /// Joint values [rad or m] of a cell; `None` when it is not reachable.
    pub fn witness(&self, cell: usize) -> Option<&[f64]> {
        let label = self.labels.get(cell)?;
        let before = self.labels[..cell].iter().filter(|label| **label == PoseLabel::Reachable).count();
        let joints = self.joints as usize;
        (*label == PoseLabel::Reachable).then(|| &self.witnesses[before * joints..(before + 1) * joints])
    }

    /// Counts of labels and proofs.
    pub fn facts(&self) -> BlockFacts {
        let mut facts = BlockFacts::default();
        self.labels.iter().for_each(|label| facts.labels[*label as usize] += 1);
        self.proofs.iter().for_each(|proof| facts.proofs[*proof as usize] += 1);
        facts
    }
}

/// One label per byte; there is at least one.
pub(super) fn labels(message: &'static str, bytes: &[u8]) -> Result<Vec<PoseLabel>, RecordError> {
    let missing = RecordError::Missing { message, field: "labels" };
    let label = |byte: &u8| {
        let error = RecordError::Range { message, field: "labels", value: f64::from(*byte), allowed: "0, 1 or 2" };
        PoseLabel::from_byte(*byte).ok_or(error)
    };
    if bytes.is_empty() { Err(missing) } else { bytes.iter().map(label).collect() }
}
