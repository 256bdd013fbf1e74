//! A dataset of picks as every job that is made of one reads it: which scenes it has, the grasps of a scene's bodies, what trials say
//! of them, and where the hand's points are.

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
