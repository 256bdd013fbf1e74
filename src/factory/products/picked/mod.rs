//! A dataset of picks for the jobs that read one: its scenes, the grasps of a scene's bodies, the outcomes of trials,
//! and the positions of the hand's points.

mod found;
mod hand;
mod reader;
mod scene;
mod source;
mod spec;

pub use found::FoundPicks;
pub use hand::PickedHand;
pub use reader::{InvalidPicks, open_picks, read_picks};
pub use scene::{BodyPicks, ScenePicks};
pub use source::{PICKS, found_picks, has_hand};
pub use spec::PicksSourceSpec;
