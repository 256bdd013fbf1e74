//! Energies that rank poses of a hand at an object that a camera saw in part. Lower is better. Of class `exact`.
//!
//! | energy | source | here |
//! | --- | --- | --- |
//! | contact, of visible contacts alone on request | thesis, 4.4.1 and algorithm 1 | [`ContactEnergy`] |
//! | heatmap | thesis, 4.4.2 | [`HeatmapEnergy`] |
//! | combined | thesis, equation 4.2 | [`combined_energy`] |
//! | contact and potential | thesis, algorithm 4 | `robot::grasp` |
//! | with reachability | thesis, algorithm 5 | [`grasp_energy`] |

mod contact;
mod heatmap;
mod maps;
mod probability;
mod reachability;
mod shape;

pub use contact::{Alignment, ContactEnergy, ContactForm, HandContact, Visibility};
pub use heatmap::{HeatmapEnergy, HeatmapSettings, HeatmapValue, combined_energy};
pub use maps::{Heatmaps, InvalidHeatmaps};
pub use probability::{HeldModel, ReachModel};
pub(crate) use reachability::POTENTIAL_SCALE;
pub use reachability::{EnergyForm, grasp_energy};
pub use shape::HandShape;

/// Energy of a state that an energy has no value for: no visible contact, or no canonical type nearby. Far above all others.
pub const MAX_ENERGY: f64 = 1e5;
