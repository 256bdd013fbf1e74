//! From a made view to the payloads of its channels.

use std::mem;

use super::{
    feel::HandOnObject,
    object::CompletionObject,
    settings::{CompletionSettings, DepthFormat, TouchByHand},
};
use crate::{ProduceError, SampleWriter};
use format::{Channel, Cloud, Coverage, Depth, DepthCoding, Implicit, TactileContacts, Tsdf, Visibility, VoxelPair};
use kernel::{
    geom::{DepthCrop, OccupancyGrid},
    seed::Stream,
    voxel::{
        ViewGrids,
        channels::{ImplicitPoints, implicit_points, point_cloud, tsdf},
    },
};

/// Buffers in which a thread makes the channels beside the pair.
#[derive(Default)]
pub(super) struct ChannelScratch {
    free: OccupancyGrid,
    cloud: Vec<[f32; 3]>,
    tsdf: Vec<i16>,
    coverage: Vec<u8>,
    implicit: ImplicitPoints,
    touch: Option<TactileContacts>,
}

/// A made view.
pub(super) struct MadeView<'a> {
    pub settings: &'a CompletionSettings,
    pub seed: u64,
    pub pair: &'a VoxelPair,
    pub crop: &'a DepthCrop,
    pub object: &'a CompletionObject,
}

/// The channels that a job stores, in the order in which they are written.
pub fn channels_of(settings: &CompletionSettings) -> Vec<Channel> {
    let (channels, touch) = (&settings.channels, &settings.touch);
    let by_hand = |asks: fn(&TouchByHand) -> bool| touch.by_hand.as_ref().is_some_and(asks);
    let asked = [
        (Channel::PAIR, true),
        (Channel::VISIBILITY, channels.visibility),
        (Channel::DEPTH, channels.depth.is_some()),
        (Channel::CLOUD, channels.cloud),
        (Channel::TSDF, channels.tsdf.is_some()),
        (Channel::COVERAGE, channels.coverage),
        (Channel::IMPLICIT, channels.implicit.is_some()),
        (Channel::TOUCH_RAYS, touch.random_rays.is_some()),
        (Channel::TOUCH_EXPLORATION, by_hand(|touch| touch.exploration.is_some())),
        (Channel::TOUCH_GRASP, by_hand(|touch| touch.grasp)),
    ];
    asked.into_iter().filter_map(|(channel, asked)| asked.then_some(channel)).collect()
}

impl ChannelScratch {
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
        let MadeView { settings, pair, crop, .. } = made;
        let sample = &pair.sample;
        if let Some(payload) = out.payload(Channel::PAIR) {
            pair.encode(payload);
        }
        if let Some(payload) = out.payload(Channel::VISIBILITY) {
            grids.free(crop, &settings.camera, &pair.grid, &pair.partial, &mut self.free);
            Visibility::encode_parts(sample, &self.free, payload);
        }
        if let Some(payload) = out.payload(Channel::DEPTH) {
            Depth::encode_parts(sample, crop, coding(settings), payload);
        }
        if let Some(payload) = out.payload(Channel::CLOUD) {
            point_cloud(&settings.camera, crop, &mut self.cloud);
            Cloud::encode_parts(sample, &self.cloud, payload);
        }
        self.encode_solid_channels(made, out);
        self.encode_touch(made, hand, out)
    }

    /// Channels that depend on the mesh and its solid, not on the view's image.
    fn encode_solid_channels(&mut self, made: &MadeView, out: &mut SampleWriter<'_>) {
        let MadeView { settings, pair, object, .. } = made;
        let (sample, pose, grid) = (&pair.sample, &pair.camera_from_object, &pair.grid);
        if let Some(payload) = out.payload(Channel::TSDF) {
            let cells = settings.channels.tsdf.unwrap_or_default();
            let surface = object.surface.as_ref().expect("an object has a surface where the job stores TSDFs");
            tsdf(surface, &object.kernel.solid, pose, grid, cells, &mut self.tsdf);
            Tsdf::encode_parts(sample, grid.resolution, cells * grid.cell_size, &self.tsdf, payload);
        }
        if let Some(payload) = out.payload(Channel::COVERAGE) {
            let blocks = object.coverage.as_ref().expect("an object has blocks where the job stores coverage");
            blocks.coverage(&object.kernel.solid, pose, grid, &mut self.coverage);
            Coverage::encode_parts(sample, grid.resolution, &self.coverage, payload);
        }
        if let Some(payload) = out.payload(Channel::IMPLICIT) {
            let counts = settings.channels.implicit.map_or((0, 0), |counts| (counts.surface, counts.space));
            let surface = object.surface.as_ref().expect("an object has a surface where the job stores points");
            let mut stream = Stream::of_sample(made.seed, sample, "implicit");
            let points = &mut self.implicit;
            implicit_points(surface, &object.kernel.solid, pose, grid, counts, &mut stream, points);
            // The buffers lend their memory to the record and get it back.
            let record = Implicit {
                sample: *sample,
                surface_points: mem::take(&mut points.surface),
                surface_normals: mem::take(&mut points.normals),
                space_points: mem::take(&mut points.space),
                space_distances: mem::take(&mut points.distances),
            };
            record.encode(payload);
            points.surface = record.surface_points;
            points.normals = record.surface_normals;
            points.space = record.space_points;
            points.distances = record.space_distances;
        }
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
        if let (Some(rays), Some(payload)) = (settings.touch.random_rays, out.payload(Channel::TOUCH_RAYS)) {
            let mut stream = Stream::of_sample(made.seed, sample, "touch");
            let touch = self.touch.get_or_insert_with(|| TactileContacts::none(*sample));
            surface.random_rays(&object.kernel.render, rays, pair, drop_zero, &mut stream, touch);
            touch.encode(payload);
        }
        let (Some(by_hand), Some(hand)) = (&settings.touch.by_hand, hand) else { return Ok(()) };
        for channel in [Channel::TOUCH_EXPLORATION, Channel::TOUCH_GRASP] {
            if let Some(payload) = out.payload(channel) {
                let seen = surface.seen(&object.kernel.render, &pair.camera_from_object);
                let stream = |name: &str| Stream::of_sample(made.seed, sample, name);
                hand.touch(channel, by_hand, pair, &seen, drop_zero, stream)?.encode(payload);
            }
        }
        Ok(())
    }
}

fn coding(settings: &CompletionSettings) -> DepthCoding {
    match settings.channels.depth {
        Some(DepthFormat::U16 { step }) => DepthCoding::U16 { step },
        Some(DepthFormat::F32) | None => DepthCoding::F32,
    }
}
