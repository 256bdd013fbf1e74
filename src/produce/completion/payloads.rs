//! From a made view to the bytes of its channels.

use std::mem;

#[cfg(feature = "sim")]
use super::feel::HandBeforeObject;
use super::worker::CompletionObject;
use crate::{
    geom::{DepthCrop, OccupancyGrid},
    job::{Completion, DepthFormat},
    produce::ProduceError,
    record::{Channel, Cloud, Coverage, Depth, DepthCoding, Implicit, TactileContacts, Tsdf, Visibility, VoxelPair},
    seed::Stream,
    voxel::{
        ViewGrids,
        channels::{ImplicitPoints, implicit_points, point_cloud, tsdf},
    },
};

/// Payload buffers of one thread, one a stored channel, and what the channels are made in.
pub(super) struct Payloads {
    stored: Vec<(Channel, Vec<u8>)>,
    free: OccupancyGrid,
    cloud: Vec<[f32; 3]>,
    tsdf: Vec<i16>,
    coverage: Vec<u8>,
    implicit: ImplicitPoints,
    touch: Option<TactileContacts>,
}

/// A made view.
pub(super) struct Made<'a> {
    pub settings: &'a Completion,
    pub seed: u64,
    pub pair: &'a VoxelPair,
    pub crop: &'a DepthCrop,
    pub object: &'a CompletionObject,
}

/// The channels that a job stores, in the order in which they are written.
pub fn channels_of(settings: &Completion) -> Vec<Channel> {
    let (channels, by_hand) = (&settings.channels, settings.touch.by_hand.as_ref());
    let stored = |channel: &Channel| match channel {
        Channel::Pair => true,
        Channel::Visibility => channels.visibility,
        Channel::Depth => channels.depth.is_some(),
        Channel::Cloud => channels.cloud,
        Channel::Tsdf => channels.tsdf.is_some(),
        Channel::Coverage => channels.coverage,
        Channel::Implicit => channels.implicit.is_some(),
        Channel::TouchRays => settings.touch.random_rays.is_some(),
        Channel::TouchExploration => by_hand.is_some_and(|touch| touch.exploration.is_some()),
        Channel::TouchGrasp => by_hand.is_some_and(|touch| touch.grasp),
        Channel::Block
        | Channel::GraspRun
        | Channel::GraspTrials
        | Channel::Patch
        | Channel::PatchColour
        | Channel::PatchImage
        | Channel::PatchImageColour
        | Channel::PatchHeatmap => false,
    };
    Channel::ALL.into_iter().filter(stored).collect()
}

impl Payloads {
    pub(super) fn new(settings: &Completion) -> Self {
        Self {
            stored: channels_of(settings).into_iter().map(|channel| (channel, Vec::new())).collect(),
            free: OccupancyGrid::default(),
            cloud: Vec::new(),
            tsdf: Vec::new(),
            coverage: Vec::new(),
            implicit: ImplicitPoints::default(),
            touch: None,
        }
    }

    pub(super) fn channels(&self) -> Vec<Channel> {
        self.stored.iter().map(|(channel, _)| *channel).collect()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (Channel, &[u8])> {
        let filled = self.stored.iter().filter(|(_, payload)| !payload.is_empty());
        filled.map(|(channel, payload)| (*channel, payload.as_slice()))
    }

    pub(super) fn clear(&mut self) {
        self.stored.iter_mut().for_each(|(_, payload)| payload.clear());
    }

    /// Encodes every channel that the job stores.
    ///
    /// # Errors
    /// When a hand cannot touch.
    pub(super) fn encode(
        &mut self,
        made: &Made,
        grids: &mut ViewGrids,
        #[cfg(feature = "sim")] mut hand: Option<&mut HandBeforeObject>,
    ) -> Result<(), ProduceError> {
        let Made { settings, pair, crop, object, .. } = made;
        let (sample, pose, grid) = (&pair.sample, &pair.camera_from_object, &pair.grid);
        for (channel, payload) in &mut self.stored {
            payload.clear();
            match channel {
                Channel::Pair => pair.encode(payload),
                Channel::Visibility => {
                    grids.free(crop, &settings.camera, grid, &pair.partial, &mut self.free);
                    Visibility::encode_parts(sample, &self.free, payload);
                }
                Channel::Depth => Depth::encode_parts(sample, crop, coding(settings), payload),
                Channel::Cloud => {
                    point_cloud(&settings.camera, crop, &mut self.cloud);
                    Cloud::encode_parts(sample, &self.cloud, payload);
                }
                Channel::Tsdf => {
                    let cells = settings.channels.tsdf.unwrap_or_default();
                    let surface = object.surface.as_ref().expect("an object has a surface where the job stores TSDFs");
                    tsdf(surface, &object.kernel.solid, pose, grid, cells, &mut self.tsdf);
                    Tsdf::encode_parts(sample, grid.resolution, cells * grid.cell_size, &self.tsdf, payload);
                }
                Channel::Coverage => {
                    let blocks = object.coverage.as_ref().expect("an object has blocks where the job stores coverage");
                    blocks.coverage(&object.kernel.solid, pose, grid, &mut self.coverage);
                    Coverage::encode_parts(sample, grid.resolution, &self.coverage, payload);
                }
                Channel::TouchRays => {
                    let (Some(rays), Some(surface)) = (settings.touch.random_rays, &object.touch) else { continue };
                    let mut stream = Stream::of_sample(made.seed, sample, "touch");
                    let touch = self.touch.get_or_insert_with(|| TactileContacts::none(*sample));
                    surface.random_rays(
                        &object.kernel.render,
                        rays,
                        pair,
                        settings.drop_index_zero,
                        &mut stream,
                        touch,
                    );
                    touch.encode(payload);
                }
                Channel::TouchExploration | Channel::TouchGrasp => {
                    let (Some(by_hand), Some(surface)) = (&settings.touch.by_hand, &object.touch) else { continue };
                    #[cfg(feature = "sim")]
                    if let Some(hand) = hand.as_deref_mut() {
                        let seen = surface.seen(&object.kernel.render, pose);
                        let stream = |name: &str| Stream::of_sample(made.seed, sample, name);
                        hand.touch(*channel, by_hand, pair, &seen, settings.drop_index_zero, stream)?.encode(payload);
                    }
                    #[cfg(not(feature = "sim"))]
                    {
                        let _ = surface;
                        let why = "this build has no simulator to touch with (feature `sim`)".to_owned();
                        return Err(ProduceError::NoTouch { name: by_hand.hand.scene.display().to_string(), why });
                    }
                }
                Channel::Implicit => {
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
                // No channel of this product: `channels_of` names them all.
                _ => {}
            }
        }
        Ok(())
    }
}

fn coding(settings: &Completion) -> DepthCoding {
    match settings.channels.depth {
        Some(DepthFormat::U16 { step }) => DepthCoding::U16 { step },
        Some(DepthFormat::F32) | None => DepthCoding::F32,
    }
}
