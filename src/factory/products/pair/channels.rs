//! Channels stored in addition to the partial and the complete grid, from their keys in a job file to their payloads.
//!
//! One more channel of this kind is one more field of [`ChannelsSpec`] and of [`Channels`], with its default in
//! `profiles/standard.toml`, and one more line in each of the functions below; no other file of the factory names it.

use std::{mem, sync::Arc};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::SampleWriter;
use assets::object::PreparedObject;
use form::{Checker, Path};
use format::{Channel, Cloud, Coverage, Depth, DepthCoding, Implicit, Product, Tsdf, Visibility, VoxelPair};
use kernel::{
    geom::{DepthCrop, Intrinsics, OccupancyGrid, SimdLevel, SolidGrid},
    seed::Stream,
    voxel::{
        ViewGrids,
        channels::{CoverageBlocks, ImplicitPoints, Surface, implicit_points, point_cloud, tsdf},
    },
};

/// The channel of a product that holds the records of one of completion's; `None` where the product has none.
pub fn own_channel(product: Product, channel: Channel) -> Option<Channel> {
    product.channels().find(|own| own.name() == channel.name() && own.message == channel.message)
}

/// Empty buffer for the payload of a product's own channel; `None` when samples do not have it.
fn payload<'w>(out: &'w mut SampleWriter<'_>, product: Product, channel: Channel) -> Option<&'w mut Vec<u8>> {
    out.payload(own_channel(product, channel)?)
}

/// Channels stored in addition to the partial and the complete grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelsSpec {
    /// Cells that the camera sees to be free, one more bit per cell: distinguishes free, surface and unseen cells.
    pub visibility: bool,
    /// The depth crop.
    pub depth: DepthSpec,
    /// With `depth = "u16"`: the step.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0))]
    pub depth_step: f64,
    /// The partial point cloud.
    pub cloud: bool,
    /// Truncated signed distance at the same grid.
    pub tsdf: bool,
    /// With `tsdf`: truncation.
    #[schemars(extend("x-unit" = "cells", "exclusiveMinimum" = 0))]
    pub tsdf_truncation: f64,
    /// Share of each cell that is solid, 8 bits.
    pub coverage: bool,
    /// Samples for implicit networks.
    pub implicit: bool,
    /// With `implicit`: points on the surface, with normals.
    #[schemars(range(max = 1_000_000), extend("x-unit" = "points"))]
    pub implicit_surface: u32,
    /// With `implicit`: points in the grid's box, with signed distance.
    #[schemars(range(max = 1_000_000), extend("x-unit" = "points"))]
    pub implicit_space: u32,
}

/// Form in which the depth crop is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DepthSpec {
    /// Not at all.
    None,
    /// Metres as 32-bit floats, NaN = no return.
    F32,
    /// Steps of `depth_step` as 16-bit integers, 0 = no return.
    U16,
}

/// Channels in addition to the pair, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Channels {
    /// One more bit plane: cells that the camera sees to be free.
    pub visibility: bool,
    /// The depth crop.
    pub depth: Option<DepthFormat>,
    /// The partial point cloud.
    pub cloud: bool,
    /// Truncated signed distance at the same grid, with this truncation in cells.
    pub tsdf: Option<f64>,
    /// Share of each cell that is solid, 8 bits.
    pub coverage: bool,
    /// Samples for implicit networks.
    pub implicit: Option<ImplicitSamples>,
}

/// Format of a stored depth crop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthFormat {
    /// Metres as f32, NaN = no return.
    F32,
    /// Steps of this many metres as u16, 0 = no return.
    U16 {
        /// Metres per step.
        step: f64,
    },
}

/// Counts of points for an implicit network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImplicitSamples {
    /// Points on the surface, with normals.
    pub surface: u32,
    /// Points in the grid's box, with signed distance.
    pub space: u32,
}

impl Channels {
    /// The channels of a job whose farthest view has this distance [m], if that is known.
    pub fn read(checker: &mut Checker, spec: &ChannelsSpec, product: Product, farthest: Option<f64>) -> Self {
        let depth = match spec.depth {
            DepthSpec::None => None,
            DepthSpec::F32 => Some(DepthFormat::F32),
            DepthSpec::U16 => Some(DepthFormat::U16 { step: spec.depth_step }),
        };
        let reach = spec.depth_step * f64::from(u16::MAX);
        if let Some(farthest) = farthest.filter(|farthest| spec.depth == DepthSpec::U16 && reach <= *farthest) {
            let expected =
                format!("a step of at least {:.2e} m, so that 65,535 steps reach {farthest} m", farthest / 65535.0);
            checker.invalid("channels.depth_step", expected, format!("{} m", spec.depth_step));
        }
        let implicit = ImplicitSamples { surface: spec.implicit_surface, space: spec.implicit_space };
        if spec.implicit && implicit.surface == 0 && implicit.space == 0 {
            checker.contradiction("channels.implicit", "channels.implicit_surface = 0", "no points are stored");
        }
        let channels = Self {
            visibility: spec.visibility,
            depth,
            cloud: spec.cloud,
            tsdf: spec.tsdf.then_some(spec.tsdf_truncation),
            coverage: spec.coverage,
            implicit: spec.implicit.then_some(implicit),
        };
        for channel in channels.asked().filter(|channel| own_channel(product, *channel).is_none()) {
            let key = Path::from("channels").key(channel.name());
            checker.contradiction(key, "product", format!("samples of {product} have no such channel"));
        }
        channels
    }

    /// Writes the channels into keys that hold the defaults; those of channels that are not stored stay.
    pub fn write_keys(&self, spec: &mut ChannelsSpec) {
        (spec.visibility, spec.cloud, spec.coverage) = (self.visibility, self.cloud, self.coverage);
        (spec.depth, spec.depth_step) = match self.depth {
            None => (DepthSpec::None, spec.depth_step),
            Some(DepthFormat::F32) => (DepthSpec::F32, spec.depth_step),
            Some(DepthFormat::U16 { step }) => (DepthSpec::U16, step),
        };
        (spec.tsdf, spec.tsdf_truncation) = (self.tsdf.is_some(), self.tsdf.unwrap_or(spec.tsdf_truncation));
        spec.implicit = self.implicit.is_some();
        if let Some(points) = self.implicit {
            (spec.implicit_surface, spec.implicit_space) = (points.surface, points.space);
        }
    }

    /// The channels that are stored, in the order in which they are written.
    pub fn stored(&self, product: Product) -> impl Iterator<Item = Channel> {
        self.asked().filter_map(move |channel| own_channel(product, channel))
    }

    /// Completion's channels for the requested records.
    fn asked(&self) -> impl Iterator<Item = Channel> {
        let asked = [
            (Channel::VISIBILITY, self.visibility),
            (Channel::DEPTH, self.depth.is_some()),
            (Channel::CLOUD, self.cloud),
            (Channel::TSDF, self.tsdf.is_some()),
            (Channel::COVERAGE, self.coverage),
            (Channel::IMPLICIT, self.implicit.is_some()),
        ];
        asked.into_iter().filter_map(|(channel, asked)| asked.then_some(channel))
    }
}

/// Parts of an object that its channels use; only those that the job stores are made.
pub struct ObjectChannels {
    coverage: Option<CoverageBlocks>,
    surface: Option<Arc<Surface>>,
}

impl ObjectChannels {
    /// The parts of an object that these channels use.
    pub fn new(channels: &Channels, prepared: &PreparedObject, solid: &SolidGrid, level: SimdLevel) -> Self {
        let wants_surface = channels.tsdf.is_some() || channels.implicit.is_some();
        Self {
            coverage: channels.coverage.then(|| CoverageBlocks::new(level, solid)),
            surface: wants_surface.then(|| Arc::clone(prepared.surface())),
        }
    }
}

/// A view that was made, as its channels need it.
pub struct ChannelView<'a> {
    /// Product of the sample.
    pub product: Product,
    /// Seed of the job.
    pub seed: u64,
    /// The camera.
    pub camera: &'a Intrinsics,
    /// The pair.
    pub pair: &'a VoxelPair,
    /// Depth of the object alone, of which the partial grid was made.
    pub crop: &'a DepthCrop,
    /// Depth at which each line of sight ends: at the object as measured, or at an occluder.
    pub sight: &'a DepthCrop,
    /// Whether lines of sight that pass outside the image are unknown; else they meet nothing.
    pub ends_at_image: bool,
    /// The object's solid.
    pub solid: &'a SolidGrid,
    /// Parts of the object that its channels use.
    pub object: &'a ObjectChannels,
}

/// Buffers in which a thread makes the channels of a pair.
#[derive(Default)]
pub struct ChannelScratch {
    free: OccupancyGrid,
    cloud: Vec<[f32; 3]>,
    tsdf: Vec<i16>,
    coverage: Vec<u8>,
    implicit: ImplicitPoints,
}

impl ChannelScratch {
    /// Fills the payload of every channel of a pair that the job stores, except touch.
    pub fn encode(
        &mut self,
        channels: &Channels,
        view: &ChannelView,
        grids: &mut ViewGrids,
        out: &mut SampleWriter<'_>,
    ) {
        let ChannelView { product, seed, camera, pair, crop, sight, ends_at_image, solid, object } = *view;
        let (sample, pose, grid) = (&pair.sample, &pair.camera_from_object, &pair.grid);

        // Channels of the view's image.
        if let Some(payload) = payload(out, product, Channel::VISIBILITY) {
            grids.free(sight, camera, grid, &pair.partial, &mut self.free);
            if ends_at_image {
                grids.drop_outside_image(camera, grid, &mut self.free);
            }
            Visibility::encode_parts(sample, &self.free, payload);
        }
        if let Some(payload) = payload(out, product, Channel::DEPTH) {
            let coding = match channels.depth {
                Some(DepthFormat::U16 { step }) => DepthCoding::U16 { step },
                Some(DepthFormat::F32) | None => DepthCoding::F32,
            };
            Depth::encode_parts(sample, crop, coding, payload);
        }
        if let Some(payload) = payload(out, product, Channel::CLOUD) {
            point_cloud(camera, crop, &mut self.cloud);
            Cloud::encode_parts(sample, &self.cloud, payload);
        }

        // Channels of the mesh and its solid in the view's pose.
        if let Some(payload) = payload(out, product, Channel::TSDF) {
            let cells = channels.tsdf.unwrap_or_default();
            let surface = object.surface.as_ref().expect("an object has a surface where the job stores TSDFs");
            tsdf(surface, solid, pose, grid, cells, &mut self.tsdf);
            Tsdf::encode_parts(sample, grid.resolution, cells * grid.cell_size, &self.tsdf, payload);
        }
        if let Some(payload) = payload(out, product, Channel::COVERAGE) {
            let blocks = object.coverage.as_ref().expect("an object has blocks where the job stores coverage");
            blocks.coverage(solid, pose, grid, &mut self.coverage);
            Coverage::encode_parts(sample, grid.resolution, &self.coverage, payload);
        }
        if let Some(payload) = payload(out, product, Channel::IMPLICIT) {
            let counts = channels.implicit.map_or((0, 0), |counts| (counts.surface, counts.space));
            let surface = object.surface.as_ref().expect("an object has a surface where the job stores points");
            let mut stream = Stream::of_sample(seed, sample, "implicit");
            let points = &mut self.implicit;
            implicit_points(surface, solid, pose, grid, counts, &mut stream, points);
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
}
