//! Grasps of a multi-finger hand: energies, annealing over pose and eigengrasps, closing, wrench-space quality, types.
//!
//! After Ciocarlie and Allen 2009 and the thesis, chapters 4 and 7.3. Of class `exact`.

mod found;
mod settings;

pub use found::{Energies, Grasp, GraspContact, GraspRun, GraspVerdict, Quality, Stretch};
pub use settings::{AmplitudeRange, Annealing, EnergyKind, Keeping, SearchFrame, WrenchSpace};
