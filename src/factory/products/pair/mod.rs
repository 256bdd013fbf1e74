//! Pairs of grids, for every product that makes some: the pose of the grid, the partial and the complete grid, further
//! channels, and touch. Each product supplies the depth and decides which pairs are kept.

mod channels;
mod grids;
mod object;
mod spec;
pub mod touch;

pub use channels::{
    ChannelScratch, ChannelView, Channels, ChannelsSpec, DepthFormat, DepthSpec, ImplicitSamples, ObjectChannels,
    own_channel,
};
pub use grids::{PairRules, empty_pair, fill_grids};
pub use object::PairObject;
pub use spec::{GridSpec, TruthRule, TruthSpec};
