//! Suction: poses of a suction cup on the bodies of settled scenes, a stage behind scenes.
//!
//! [`SuctionWorker`] is the producer of one thread. On each body it draws poses, measures the seal and the hold of the weight, and follows
//! cup and tube through the scene ([`robot::suction::SuctionSampler`]); then it repeats free poses with errors. All of class `exact`.

mod check;
mod keys;
mod loaded;
mod record;
mod row;
mod settings;
pub mod spec;
mod work;
mod worker;

pub use row::FACTORY;
pub use settings::{SuctionJob, SuctionSettings};
pub use worker::SuctionWorker;
