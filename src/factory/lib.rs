//! The factory: from a job file to a dataset.
//!
//! ```text
//! jobs/*.toml -> job -> plan -> run( products ) -> format::dataset
//! ```
//!
//! A product is one row of [`PRODUCTS`](products::PRODUCTS): its keys, defaults and checks, and the
//! [`Work`](work::Work) that they become. The job reader, the plan and the scheduler are independent of products.

// Tests compare with what the C library computes.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod clock;
pub mod cluster;
mod context;
mod error;
mod event;
pub mod job;
mod leaks;
mod objects;
pub mod plan;
pub mod product;
pub mod products;
mod recent;
pub mod run;
pub mod sections;
mod sink;
pub mod work;

pub use context::{Parallelism, RunContext};
pub use error::{Cause, ProduceError, RunError};
pub use event::{Event, Listener, Progress};
pub use kernel::cancel::{Cancel, Cancelled};
pub use leaks::{Leak, LeakSide, find_leaks};
pub use sink::{MadeFate, MadeSample, SampleSink, SampleWriter, TakeSample};
