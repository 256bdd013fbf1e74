//! Pairs of grids, as every product that makes some has them: where the grid lies, what is partial, what is complete, the
//! channels beside them, and touch. Where the depth comes from, and which pairs are kept, each product says.

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
