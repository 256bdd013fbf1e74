//! Every message of a dataset.

use graspmill::record::{
    Channel, Checker, Cloud, Coverage, Depth, GraspRun, GraspTrials, HandShape, HeatmapPatch, Implicit, ObjectShape,
    PatchColour, PatchHeatmap, PatchImageColour, ReachabilityBlock, ReachabilityField, TactileContacts, Tsdf,
    Visibility, VoxelPair,
};

/// What an input of the target is, by its first byte: a channel's message, or one that is no sample's.
pub const RECORDS: usize = Channel::ALL.len() + 3;

/// A message that the first byte names: decoded; what decodes is encoded, and that must decode to the same bytes.
pub fn records(input: &[u8]) {
    let Some((kind, payload)) = input.split_first() else { return };
    let kind = usize::from(*kind) % RECORDS;
    let Some(channel) = Channel::ALL.get(kind).copied() else {
        let _ = match kind - Channel::ALL.len() {
            0 => again(payload, |bytes| ReachabilityField::decode(bytes).ok(), ReachabilityField::encode),
            1 => again(payload, |bytes| HandShape::decode(bytes).ok(), HandShape::encode),
            _ => again(payload, |bytes| ObjectShape::decode(bytes).ok(), ObjectShape::encode),
        };
        return;
    };
    let decodes = Checker::default().check(channel, payload).is_ok();
    let found = match channel {
        Channel::Pair => again(payload, |bytes| VoxelPair::decode(bytes).ok(), VoxelPair::encode),
        Channel::Visibility => again(payload, |bytes| Visibility::decode(bytes).ok(), Visibility::encode),
        Channel::Depth | Channel::PatchImage => again(payload, |bytes| Depth::decode(bytes).ok(), Depth::encode),
        Channel::Cloud => again(payload, |bytes| Cloud::decode(bytes).ok(), Cloud::encode),
        Channel::Tsdf => again(payload, |bytes| Tsdf::decode(bytes).ok(), Tsdf::encode),
        Channel::Coverage => again(payload, |bytes| Coverage::decode(bytes).ok(), Coverage::encode),
        Channel::Implicit => again(payload, |bytes| Implicit::decode(bytes).ok(), Implicit::encode),
        Channel::TouchRays | Channel::TouchExploration | Channel::TouchGrasp => {
            again(payload, |bytes| TactileContacts::decode_of(channel, bytes).ok(), TactileContacts::encode)
        }
        Channel::Block => again(payload, |bytes| ReachabilityBlock::decode(bytes).ok(), ReachabilityBlock::encode),
        Channel::GraspRun => again(payload, |bytes| GraspRun::decode(bytes).ok(), GraspRun::encode),
        Channel::GraspTrials => again(payload, |bytes| GraspTrials::decode(bytes).ok(), GraspTrials::encode),
        Channel::Patch => again(payload, |bytes| HeatmapPatch::decode(bytes).ok(), HeatmapPatch::encode),
        Channel::PatchColour => again(payload, |bytes| PatchColour::decode(bytes).ok(), PatchColour::encode),
        Channel::PatchImageColour => {
            again(payload, |bytes| PatchImageColour::decode(bytes).ok(), PatchImageColour::encode)
        }
        Channel::PatchHeatmap => again(payload, |bytes| PatchHeatmap::decode(bytes).ok(), PatchHeatmap::encode),
    };
    assert_eq!(found, decodes, "the checker takes what decodes, and nothing else");
}

/// Whether the bytes decode; then their record's own bytes decode to a record of the same bytes.
fn again<T>(payload: &[u8], decode: impl Fn(&[u8]) -> Option<T>, encode: impl Fn(&T, &mut Vec<u8>)) -> bool {
    let Some(record) = decode(payload) else { return false };
    let (mut first, mut second) = (Vec::new(), Vec::new());
    encode(&record, &mut first);
    encode(&decode(&first).expect("what is encoded decodes"), &mut second);
    assert!(first == second, "encoding is stable");
    true
}
