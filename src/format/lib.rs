//! Everything that is on disk: records and their codec, products and channels as tables, datasets of shards.
//!
//! A record is one protobuf message on one MCAP topic (`proto/`). Names of objects, paths, clocks and sample indices never enter
//! a payload: the same sample has the same bytes in every dataset. Everything that the format knows about a product is in its row
//! of [`PRODUCTS`](products::PRODUCTS); the code of [`dataset`] depends only on rows.

// Tests compare with what the C library computes.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod codec;
pub mod dataset;
pub mod extras;
mod product_format;
pub mod products;
mod storage;
#[cfg(test)]
mod tests;

pub use codec::{Depth, DepthCoding, RecordError};
pub use extras::{FileCheck, FileContext, RootPart, TouchedPair};
pub use product_format::{
    ArrayFormat, ChannelFormat, ExtraFile, FactFormat, FactKind, FactRange, Facts, Noun, ProductFormat, RecordDecoder,
};
pub use products::{
    BrokenRule, Channel, CheckSample, CheckedRecord, Product, ProductChecks, Record,
    amodal::{AmodalFacts, Clutter},
    check_record, checks_of,
    completion::{
        Approach, ApproachEnd, BlockedProbe, Cloud, Coverage, HandTouch, Implicit, LinkContact, Occlusion,
        OcclusionFacts, PARTIAL_INSIDE_COMPLETE, PairFacts, PixelMask, TactileContacts, TouchContact, Tsdf, Visibility,
        VoxelPair,
    },
    grasps::{
        ClosedHand, FORCE, FailureReason, Grasp, GraspFacts, GraspLabel, GraspLadder, GraspLadders, GraspMethod,
        GraspRun, GraspTrial, GraspTrials, HELD_SHARE, HandJoint, HandNames, HandShape, HeldContact, LadderFacts,
        LadderLabel, LadderLevel, LadderMethod, LevelResult, LevelTrial, LinkSolid, ObjectShape, PerturbedTrial,
        PressedContact, RunInterval, Seed, SeriesMoment, TableTrial, TrialFacts, TrialHand, TrialMethod, TrialOutcome,
        TrialSeries, TrialVerdict, TriedStates, WRENCH, WayObstacles, Waypoint, trial_phases,
    },
    heatmaps::{ForbiddenGrasp, HeatmapFacts, HeatmapLabel, PatchSquare, ProjectedPoint, SceneHeatmap, SeenGrasp},
    patches::{
        HeatmapPatch, HeatmapPoint, PATCH_POINTS, POINT_NAMES, PatchColour, PatchFacts, PatchHeatmap, PatchImageColour,
        PatchMetric, PatchPoint, PatchTable, PatchTrial, PatchVisibility, TRIAL_LABEL, VISIBLE_TOLERANCE, is_visible,
        pixel_in_image, projection, trial_value, window_pixel, window_side,
    },
    picks::{
        AwakeBodies, AwakeNeighbour, Blocked, DrawnPick, PickCandidate, PickCandidates, PickFacts, PickObstacle,
        PickPassage, PickPhase, PickPoses, PickProtocol, PickSampling, PickSamplingFacts, PickState, PickTrial,
        PickTrialFacts, PickTrials, PickVerdict, PressedThing, TakenGrasps,
    },
    reachability::{BlockFacts, FieldHeader, ReachabilityBlock, ReachabilityField},
    scenes::{
        CONTAINER, ContainerMesh, Scene, SceneBody, SceneContact, SceneContainer, SceneFacts, SceneImport, SceneMode,
        SceneOverview, SceneSupport,
    },
    suction::{
        CupMeasures, SealedSurface, SuctionDraws, SuctionFacts, SuctionHold, SuctionPose, SuctionPoses, SuctionResult,
        SuctionRules,
    },
    views::{NearBody, SceneColour, SceneImage, SceneInstance, ViewFacts},
    volumes::{FusedView, GraspsInVolume, SceneVolume, VolumeAffordance, VolumeFacts, VolumeTruth, VoxelGrasp},
};

/// Number of the format on disk; a reader refuses every other.
pub const FORMAT_VERSION: u32 = 4;
