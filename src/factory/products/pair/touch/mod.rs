//! Touch stored with pairs: rays from an object's far side (`rays`), with or without other things around it, and hands
//! that explore or grasp it (`feel`).

mod check;
mod feel;
mod forecast;
mod obstacles;
mod rays;
mod seen;
mod settings;
mod spec;
mod still;
mod surface;

pub use check::{EXPLORES, HAND_USES};
pub use feel::{HandOnObject, TouchingHand};
pub use obstacles::TouchObstacles;
pub use seen::SeenSurface;
pub use settings::{Exploration, ExplorationTarget, RandomRays, RayTarget, Touch, TouchByHand};
pub use spec::TouchSpec;
pub use still::StillAround;
pub use surface::TouchSurface;
