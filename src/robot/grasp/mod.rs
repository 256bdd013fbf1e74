//! Grasps of a multi-finger hand: energies, annealing over pose and eigengrasps, closing, wrench-space quality, types.
//!
//! After Ciocarlie and Allen 2009 and the thesis, chapters 4 and 7.3. Of class `exact`.

mod anneal;
mod best;
mod centring;
mod closing;
mod energy;
mod field;
mod found;
mod kind;
mod links;
mod meeting;
mod numbers;
mod pairs;
mod rate;
mod sampled;
mod settings;
mod solids;
mod state;
mod table;
mod variables;
pub mod wrench;

pub use anneal::{Annealer, ObjectSearch};
pub use closing::TOUCHES;
pub use field::DistanceField;
pub use found::{Energies, Grasp, GraspContact, GraspRun, Quality, Stretch};
pub use kind::{KindDigits, camera_axes, wrist_roll};
pub use sampled::{GraspSampler, axes};
pub use settings::{
    AmplitudeRange, Annealing, Antipodal, EnergyKind, Keeping, Rolls, Sampler, SearchFrame, Uniform, WrenchSpace,
};
pub use state::{ALLOWED_OVERLAP, HandSearch, UnsearchableHand};
pub use table::{STAND_OFF, TableClearance};
