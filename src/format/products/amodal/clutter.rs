//! Record of the surroundings of one body of a scene in one image.

use prost::Message;

use crate::{
    RecordError, VoxelPair,
    codec::{
        fields::{broken, lengthy, plane, ranged, resolution},
        proto, sample_from_proto, wire,
    },
};
use kernel::{
    geom::OccupancyGrid,
    ids::{Digest, ObjectId, SampleId},
};

const MESSAGE: &str = "Clutter";

/// Surroundings of one body of a scene in one image, on the grid of its pair.
///
/// For the hot path keep one and refill it: its grids keep their memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Clutter {
    /// Which sample; its instance is the number of the body, from 1.
    pub sample: SampleId,
    /// The body's object.
    pub object: ObjectId,
    /// Pixels of its silhouette alone, including those outside the image.
    pub pixels_all: u32,
    /// Pixels of its silhouette alone, in the image.
    pub pixels_in_image: u32,
    /// Pixels that see it.
    pub pixels_visible: u32,
    /// Measured depths from which the partial grid is made.
    pub points: u32,
    /// Depths among them that were measured on the body's own surface.
    pub own_points: u32,
    /// Cells that hold a measured depth of anything else.
    pub others_seen: OccupancyGrid,
    /// Cells that meet another body, the container or the half-space below the table.
    pub others_solid: OccupancyGrid,
}

impl Clutter {
    /// Nothing around a body, to be filled.
    pub fn none(sample: SampleId, object: ObjectId, resolution: u32) -> Self {
        let grid = OccupancyGrid::new(resolution);
        Self {
            sample,
            object,
            pixels_all: 0,
            pixels_in_image: 0,
            pixels_visible: 0,
            points: 0,
            own_points: 0,
            others_seen: grid.clone(),
            others_solid: grid,
        }
    }

    /// Visible share of its silhouette; 0 for a body without a pixel.
    pub fn visible_share(&self) -> f64 {
        f64::from(self.pixels_visible) / f64::from(self.pixels_all.max(1))
    }

    /// Whether the body extends beyond the image.
    pub fn is_truncated(&self) -> bool {
        self.pixels_in_image < self.pixels_all
    }

    /// Share of the points of the partial grid that were measured on the body's own surface; 0 without points.
    pub fn purity(&self) -> f64 {
        f64::from(self.own_points) / f64::from(self.points.max(1))
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        out.reserve(self.others_seen.bytes().len() + self.others_solid.bytes().len() + 160);
        wire::sample(out, 1, &self.sample);
        wire::bytes(out, 2, &self.object.0.0);
        let counts = [self.pixels_all, self.pixels_in_image, self.pixels_visible, self.points, self.own_points];
        for (field, count) in (3..).zip(counts) {
            wire::uint32(out, field, count);
        }
        wire::uint32(out, 8, self.others_seen.resolution());
        wire::bytes(out, 9, self.others_seen.bytes());
        wire::bytes(out, 10, self.others_solid.bytes());
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length or a count does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::Clutter::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample)?;
        ranged(MESSAGE, "sample.instance", f64::from(sample.instance), sample.instance > 0, "from 1")?;
        lengthy(MESSAGE, "object", 32, raw.object.len())?;
        let object = ObjectId(Digest(raw.object.as_slice().try_into().expect("32 bytes")));
        for (field, count, most) in [
            ("pixels_in_image", raw.pixels_in_image, raw.pixels_all),
            ("pixels_visible", raw.pixels_visible, raw.pixels_in_image),
            ("own_points", raw.own_points, raw.points),
        ] {
            ranged(MESSAGE, field, f64::from(count), count <= most, "at most the count of which it is a part")?;
        }
        let n = resolution(MESSAGE, raw.resolution)?;
        Ok(Self {
            sample,
            object,
            pixels_all: raw.pixels_all,
            pixels_in_image: raw.pixels_in_image,
            pixels_visible: raw.pixels_visible,
            points: raw.points,
            own_points: raw.own_points,
            others_seen: plane(MESSAGE, "others_seen", n, raw.others_seen)?,
            others_solid: plane(MESSAGE, "others_solid", n, raw.others_solid)?,
        })
    }

    /// Compares the record with the pair of its sample: the grid is the same, and a partial grid has at least one point per cell.
    ///
    /// # Errors
    /// When the two contradict each other.
    pub fn check_beside(&self, pair: &VoxelPair) -> Result<(), RecordError> {
        let n = self.others_seen.resolution();
        ranged(MESSAGE, "resolution", f64::from(n), n == pair.grid.resolution, "that of the pair")?;
        let fits = self.points >= pair.partial_cells;
        ranged(MESSAGE, "points", f64::from(self.points), fits, "at least one per cell of the partial grid")
    }
}
