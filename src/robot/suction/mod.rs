//! Suction cups: how well a cup seals on a true mesh, which loads it holds, and how it comes there in a scene.
//!
//! A cup approaches along its axis until its whole lip lies on the surface. Rays along the axis measure the surface below the lip
//! and inside of it (`seal`); a limit on each measure, as data sheets of cups and Dex-Net 3.0 (Mahler et al. 2018) have them, decides
//! whether it seals. Vacuum and friction resist the weight of the object by the wrench constraints of Dex-Net 3.0 (`hold`). In a
//! scene, poses are drawn on the points that grippers use, too, and the exact path of the tool decides (`sampler`). `suctionnet` has
//! the scores of SuctionNet-1Billion (Cao et al. 2021). Of class `exact`; no simulator.

mod cup;
mod draw;
mod hold;
mod sampler;
mod seal;
mod shape;
mod suctionnet;
mod table;

pub use cup::{CupSettings, InvalidCup, SuctionCup, elastic_moment};
pub use hold::{GRAVITY, Hold, HoldLimit, Load};
pub use sampler::{
    PoseErrors, SampledSuction, SampledSuctions, SuctionCounts, SuctionSampler, SuctionSampling, SuctionTarget,
};
pub use seal::{Seal, SealLimit, SealMeter};
pub use shape::SealShape;
pub use suctionnet::{SUCTIONNET_GRAVITY, SUCTIONNET_STIFFNESS, suctionnet_seal, suctionnet_wrench};
