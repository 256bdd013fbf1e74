//! Grasps of a multi-finger hand: energies, annealing over pose and eigengrasps, closing, wrench-space quality, types.
//!
//! After Ciocarlie and Allen 2009 and the thesis, chapters 4 and 7.3. Of class `exact`.

mod alike;
mod anneal;
mod antipodal;
mod approach;
mod best;
mod centring;
mod closing;
mod energy;
mod field;
mod found;
mod frame;
mod in_scene;
mod kind;
mod known;
mod links;
mod meeting;
mod motion;
mod numbers;
mod object;
mod opposition;
mod own_overlaps;
mod pads;
mod pairs;
mod passage;
mod points;
mod probes;
mod rate;
mod sampled;
mod searched;
mod seeds;
mod settings;
mod solids;
mod state;
mod straight;
mod symmetry;
mod table;
mod tally;
mod unsearchable;
mod variables;
pub mod wrench;

pub use alike::DistinctGrasps;
pub use anneal::{Annealer, Exploration, FoundState, SearchFrom};
pub use closing::TOUCHES;
pub use field::DistanceField;
pub use found::{ApproachLosses, Energies, GraspContact, PairLosses, Quality, RatedGrasp, SearchInterval, SearchRun};
pub use in_scene::{
    OpenBox, PoseCounts, RejectedPose, SampledGrasp, SampledGrasps, SceneSampler, SceneSampling, SceneTarget,
};
pub use kind::{KindDigits, camera_axes, kind_in_frame, wrist_roll};
pub use object::ObjectSearch;
pub use opposition::has_opposition;
pub use own_overlaps::OwnOverlaps;
pub use passage::{ClosingGrasp, HandPassage, Passage, PathObstacle, SceneObstacle, Surroundings};
pub use points::SurfacePoints;
pub use rate::{GraspRater, HandState};
pub use sampled::{GraspSampler, axes};
pub use searched::{SearchedContact, SearchedState};
pub use seeds::seeds;
pub use settings::{
    AmplitudeRange, Annealing, Antipodal, ApproachDraws, EnergyKind, Keeping, PairHold, RestingChoice, Rolls, Sampler,
    SearchFrame, Support, Uniform, WrenchSpace,
};
pub use solids::ALLOWED_OVERLAP;
pub use state::HandSearch;
pub use straight::{ToolPassage, ToolSolid};
pub use table::{STAND_OFF, TableClearance};
pub use unsearchable::UnsearchableHand;
