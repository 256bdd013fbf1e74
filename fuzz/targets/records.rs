//! Every message of a dataset.

use graspmill::format::{
    Channel, Cloud, Clutter, Coverage, Depth, GraspLadders, GraspRun, GraspTrials, HandShape, HeatmapPatch, Implicit,
    ObjectShape, Occlusion, PatchColour, PatchHeatmap, PatchImageColour, PatchMetric, PatchTable, PatchTrial,
    PatchVisibility, PickCandidates, PickSampling, PickTrials, ReachabilityBlock, ReachabilityField, Scene,
    SceneColour, SceneHeatmap, SceneImage, SceneOverview, SceneVolume, SuctionPoses, TactileContacts, Tsdf, Visibility,
    VolumeAffordance, VolumeTruth, VoxelPair, check_record, checks_of,
};

use super::channels;

/// Kinds of inputs of the target, by the first byte: a channel's message, or one that is no sample's.
pub fn count_records() -> usize {
    channels().count() + 3
}

/// A message that the first byte names: decoded; what decodes is encoded, and that must decode to the same bytes.
pub fn records(input: &[u8]) {
    let Some((kind, payload)) = input.split_first() else { return };
    let kind = usize::from(*kind) % count_records();
    let Some(channel) = channels().nth(kind) else {
        let _ = match kind - channels().count() {
            0 => again(payload, |bytes| ReachabilityField::decode(bytes).ok(), ReachabilityField::encode),
            1 => again(payload, |bytes| HandShape::decode(bytes).ok(), HandShape::encode),
            _ => again(payload, |bytes| ObjectShape::decode(bytes).ok(), ObjectShape::encode),
        };
        return;
    };
    let mut checks = (checks_of(channel.product()).samples)();
    let decodes = check_record(checks.as_mut(), channel, payload).is_ok();
    let found = match channel {
        Channel::PAIR | Channel::AMODAL_PAIR => {
            again(payload, |bytes| VoxelPair::decode(bytes).ok(), VoxelPair::encode)
        }
        Channel::VISIBILITY | Channel::AMODAL_VISIBILITY => {
            again(payload, |bytes| Visibility::decode(bytes).ok(), Visibility::encode)
        }
        Channel::DEPTH
        | Channel::PATCH_IMAGE
        | Channel::VIEW_DEPTH
        | Channel::AMODAL_DEPTH
        | Channel::HEATMAP_DEPTH => again(payload, |bytes| Depth::decode(bytes).ok(), Depth::encode),
        Channel::CLOUD | Channel::AMODAL_CLOUD => again(payload, |bytes| Cloud::decode(bytes).ok(), Cloud::encode),
        Channel::TSDF | Channel::AMODAL_TSDF => again(payload, |bytes| Tsdf::decode(bytes).ok(), Tsdf::encode),
        Channel::COVERAGE | Channel::AMODAL_COVERAGE => {
            again(payload, |bytes| Coverage::decode(bytes).ok(), Coverage::encode)
        }
        Channel::OCCLUSION => again(payload, |bytes| Occlusion::decode(bytes).ok(), Occlusion::encode),
        Channel::IMPLICIT | Channel::AMODAL_IMPLICIT => {
            again(payload, |bytes| Implicit::decode(bytes).ok(), Implicit::encode)
        }
        Channel::TOUCH_RAYS
        | Channel::TOUCH_EXPLORATION
        | Channel::TOUCH_GRASP
        | Channel::AMODAL_TOUCH_RAYS
        | Channel::AMODAL_TOUCH_EXPLORATION => {
            again(payload, |bytes| TactileContacts::decode_of(channel, bytes).ok(), TactileContacts::encode)
        }
        Channel::BLOCK => again(payload, |bytes| ReachabilityBlock::decode(bytes).ok(), ReachabilityBlock::encode),
        Channel::GRASP_RUN => again(payload, |bytes| GraspRun::decode(bytes).ok(), GraspRun::encode),
        Channel::GRASP_TRIALS => again(payload, |bytes| GraspTrials::decode(bytes).ok(), GraspTrials::encode),
        Channel::GRASP_LADDERS => again(payload, |bytes| GraspLadders::decode(bytes).ok(), GraspLadders::encode),
        Channel::PATCH => again(payload, |bytes| HeatmapPatch::decode(bytes).ok(), HeatmapPatch::encode),
        Channel::PATCH_COLOUR | Channel::PATCH_METRIC_COLOUR => {
            again(payload, |bytes| PatchColour::decode(bytes).ok(), PatchColour::encode)
        }
        Channel::PATCH_TRIAL => again(payload, |bytes| PatchTrial::decode(bytes).ok(), PatchTrial::encode),
        Channel::PATCH_VISIBILITY => {
            again(payload, |bytes| PatchVisibility::decode(bytes).ok(), PatchVisibility::encode)
        }
        Channel::PATCH_METRIC => again(payload, |bytes| PatchMetric::decode(bytes).ok(), PatchMetric::encode),
        Channel::PATCH_TABLE => again(payload, |bytes| PatchTable::decode(bytes).ok(), PatchTable::encode),
        Channel::PATCH_IMAGE_COLOUR => {
            again(payload, |bytes| PatchImageColour::decode(bytes).ok(), PatchImageColour::encode)
        }
        Channel::PATCH_HEATMAP => again(payload, |bytes| PatchHeatmap::decode(bytes).ok(), PatchHeatmap::encode),
        Channel::SCENE => again(payload, |bytes| Scene::decode(bytes).ok(), Scene::encode),
        Channel::SCENE_OVERVIEW => again(payload, |bytes| SceneOverview::decode(bytes).ok(), SceneOverview::encode),
        Channel::VIEW_IMAGE => again(payload, |bytes| SceneImage::decode(bytes).ok(), SceneImage::encode),
        Channel::VIEW_COLOUR => again(payload, |bytes| SceneColour::decode(bytes).ok(), SceneColour::encode),
        Channel::VOLUME_FUSION => again(payload, |bytes| SceneVolume::decode(bytes).ok(), SceneVolume::encode),
        Channel::VOLUME_TRUTH => again(payload, |bytes| VolumeTruth::decode(bytes).ok(), VolumeTruth::encode),
        Channel::VOLUME_AFFORDANCE => {
            again(payload, |bytes| VolumeAffordance::decode(bytes).ok(), VolumeAffordance::encode)
        }
        Channel::PICK_CANDIDATES => again(payload, |bytes| PickCandidates::decode(bytes).ok(), PickCandidates::encode),
        Channel::PICK_TRIALS => again(payload, |bytes| PickTrials::decode(bytes).ok(), PickTrials::encode),
        Channel::PICK_SAMPLING => again(payload, |bytes| PickSampling::decode(bytes).ok(), PickSampling::encode),
        Channel::HEATMAP_GRASPS => again(payload, |bytes| SceneHeatmap::decode(bytes).ok(), SceneHeatmap::encode),
        Channel::SUCTION_POSES => again(payload, |bytes| SuctionPoses::decode(bytes).ok(), SuctionPoses::encode),
        Channel::CLUTTER => again(payload, |bytes| Clutter::decode(bytes).ok(), Clutter::encode),
        other => panic!("{other:?} has no record here"),
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
