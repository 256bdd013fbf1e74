//! From a made view to the payloads of its channels.

use std::iter;

use super::{object::CompletionObject, occlusion::ViewOcclusion, settings::CompletionSettings};
use crate::{
    ProduceError, SampleWriter,
    products::pair::{
        ChannelScratch, ChannelView,
        touch::{HandOnObject, SeenSurface, TouchByHand, TouchObstacles},
    },
};
use format::{Channel, Product, TactileContacts, VoxelPair};
use kernel::{geom::DepthCrop, seed::Stream, voxel::ViewGrids};

/// A made view.
pub(super) struct MadeView<'a> {
    pub settings: &'a CompletionSettings,
    pub seed: u64,
    pub pair: &'a VoxelPair,
    pub crop: &'a DepthCrop,
    pub occlusion: &'a ViewOcclusion,
    pub object: &'a CompletionObject,
}

/// Buffers in which a thread makes the payloads of a view.
#[derive(Default)]
pub(super) struct ViewEncoder {
    channels: ChannelScratch,
    touch: Option<TactileContacts>,
}

/// The channels that a job stores, in the order in which they are written.
pub fn channels_of(settings: &CompletionSettings) -> Vec<Channel> {
    let touch = &settings.touch;
    let by_hand = |asks: fn(&TouchByHand) -> bool| touch.by_hand.as_ref().is_some_and(asks);
    let beside = [
        (Channel::OCCLUSION, settings.occlusion.is_some()),
        (Channel::TOUCH_RAYS, touch.random_rays.is_some()),
        (Channel::TOUCH_EXPLORATION, by_hand(|touch| touch.exploration.is_some())),
        (Channel::TOUCH_GRASP, by_hand(|touch| touch.grasp)),
    ];
    let beside = beside.into_iter().filter_map(|(channel, asked)| asked.then_some(channel));
    iter::once(Channel::PAIR).chain(settings.channels.stored(Product::COMPLETION)).chain(beside).collect()
}

impl ViewEncoder {
    /// Fills the payload of every channel that the job stores.
    ///
    /// # Errors
    /// When a hand cannot touch.
    pub(super) fn encode(
        &mut self,
        made: &MadeView,
        grids: &mut ViewGrids,
        hand: Option<&mut HandOnObject>,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        let MadeView { settings, seed, pair, crop, occlusion, object } = *made;
        if let Some(payload) = out.payload(Channel::PAIR) {
            pair.encode(payload);
        }
        let (camera, solid) = (&settings.camera, object.kernel.solid.as_ref());
        let sight = occlusion.sight(crop);
        let (product, object) = (Product::COMPLETION, &object.channels);
        let view = ChannelView { product, seed, camera, pair, crop, sight, ends_at_image: false, solid, object };
        self.channels.encode(&settings.channels, &view, grids, out);
        if let Some(payload) = out.payload(Channel::OCCLUSION) {
            occlusion.record(pair.sample).encode(payload);
        }
        self.encode_touch(made, hand, out)
    }

    /// Contacts of rays and of a hand.
    fn encode_touch(
        &mut self,
        made: &MadeView,
        hand: Option<&mut HandOnObject>,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        let MadeView { settings, pair, object, .. } = made;
        let (sample, drop_zero) = (&pair.sample, settings.drop_index_zero);
        let Some(surface) = &object.touch else { return Ok(()) };
        let alone = TouchObstacles::default();
        let seen = SeenSurface::new(surface, &object.kernel.render, &pair.camera_from_object, &alone);
        if let (Some(rays), Some(payload)) = (settings.touch.random_rays, out.payload(Channel::TOUCH_RAYS)) {
            let mut stream = Stream::of_sample(made.seed, sample, "touch");
            let touch = self.touch.get_or_insert_with(|| TactileContacts::none(*sample));
            seen.random_rays(rays, pair, drop_zero, &mut stream, touch);
            touch.encode(payload);
        }
        let (Some(by_hand), Some(hand)) = (&settings.touch.by_hand, hand) else { return Ok(()) };
        for channel in [Channel::TOUCH_EXPLORATION, Channel::TOUCH_GRASP] {
            if let Some(payload) = out.payload(channel) {
                let stream = |name: &str| Stream::of_sample(made.seed, sample, name);
                hand.touch(channel, by_hand, pair, &seen, drop_zero, stream)?.encode(payload);
            }
        }
        Ok(())
    }
}
