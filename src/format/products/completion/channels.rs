//! The optional channels in addition to the pair: visibility, cloud, distances, coverage, samples for implicit networks.

use prost::Message;

use crate::codec::{
    RecordError,
    fields::{broken, floats, lengthy, plane, ranged, resolution, triples},
    proto, sample_from_proto, wire,
};
use kernel::{geom::OccupancyGrid, ids::SampleId};

/// Which cells of the pair's grid the camera sees to be free: surface = the pair's partial, the rest is unseen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Visibility {
    /// Which sample.
    pub sample: SampleId,
    /// Cells seen to be free.
    pub free: OccupancyGrid,
}

impl Visibility {
    /// Appends the payload to `out`.
    pub fn encode(&self, out: &mut Vec<u8>) {
        Self::encode_parts(&self.sample, &self.free, out);
    }

    /// [`Visibility::encode`] without owning the grid, for the hot path.
    pub fn encode_parts(sample: &SampleId, free: &OccupancyGrid, out: &mut Vec<u8>) {
        out.reserve(free.bytes().len() + 80);
        wire::sample(out, 1, sample);
        wire::uint32(out, 2, free.resolution());
        wire::bytes(out, 3, free.bytes());
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length or range does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        const MESSAGE: &str = "Visibility";
        let visibility = proto::Visibility::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, visibility.sample)?;
        let free = plane(MESSAGE, "free", resolution(MESSAGE, visibility.resolution)?, visibility.free)?;
        Ok(Self { sample, free })
    }
}

/// The points behind the partial grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloud {
    /// Which sample.
    pub sample: SampleId,
    /// Points in `CameraCv` [m], in pixel order.
    pub points: Vec<[f32; 3]>,
}

impl Cloud {
    /// Appends the payload to `out`.
    pub fn encode(&self, out: &mut Vec<u8>) {
        Self::encode_parts(&self.sample, &self.points, out);
    }

    /// [`Cloud::encode`] without owning the points, for the hot path.
    pub fn encode_parts(sample: &SampleId, points: &[[f32; 3]], out: &mut Vec<u8>) {
        wire::sample(out, 1, sample);
        wire::floats(out, 2, points.as_flattened());
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length does not hold or a number is not finite.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        const MESSAGE: &str = "Cloud";
        let cloud = proto::Cloud::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, cloud.sample)?;
        Ok(Self { sample, points: triples(MESSAGE, "points", &cloud.points)? })
    }
}

/// Truncated signed distance to the mesh's surface, seen or not, at the cell centres of the pair's grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Tsdf {
    /// Which sample.
    pub sample: SampleId,
    /// Cells along each axis.
    pub resolution: u32,
    /// Distance at which values are truncated [m].
    pub truncation: f64,
    /// Steps of `truncation / 32767`, negative inside, -32767 to 32767.
    /// Shape (resolution, resolution, resolution) indexed (x, y, z), C order.
    pub steps: Vec<i16>,
}

impl Tsdf {
    /// Steps of a distance [m], rounded half up.
    pub fn step_of(distance: f64, truncation: f64) -> i16 {
        ((distance / truncation).clamp(-1.0, 1.0) * 32767.0 + 0.5).floor() as i16
    }

    /// Distance [m] of a cell's steps.
    pub fn distance(&self, steps: i16) -> f64 {
        f64::from(steps) / 32767.0 * self.truncation
    }

    /// Appends the payload to `out`.
    pub fn encode(&self, out: &mut Vec<u8>) {
        Self::encode_parts(&self.sample, self.resolution, self.truncation, &self.steps, out);
    }

    /// [`Tsdf::encode`] without owning the values, for the hot path.
    pub fn encode_parts(sample: &SampleId, resolution: u32, truncation: f64, steps: &[i16], out: &mut Vec<u8>) {
        wire::sample(out, 1, sample);
        wire::uint32(out, 2, resolution);
        wire::double(out, 3, truncation);
        if !steps.is_empty() {
            wire::bytes_header(out, 4, 2 * steps.len());
            out.extend(steps.iter().flat_map(|step| step.to_le_bytes()));
        }
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length or range does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        const MESSAGE: &str = "Tsdf";
        let tsdf = proto::Tsdf::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, tsdf.sample)?;
        let resolution = resolution(MESSAGE, tsdf.resolution)?;
        let truncation = tsdf.truncation;
        ranged(MESSAGE, "truncation", truncation, truncation > 0.0 && truncation.is_finite(), "positive and finite")?;
        lengthy(MESSAGE, "values", 2 * (resolution as usize).pow(3), tsdf.values.len())?;
        let steps: Vec<i16> =
            tsdf.values.chunks_exact(2).map(|bytes| i16::from_le_bytes([bytes[0], bytes[1]])).collect();
        ranged(MESSAGE, "values", f64::from(i16::MIN), !steps.contains(&i16::MIN), "-32767 to 32767")?;
        Ok(Self { sample, resolution, truncation, steps })
    }
}

/// Share of each cell of the pair's grid that is solid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Coverage {
    /// Which sample.
    pub sample: SampleId,
    /// Cells along each axis.
    pub resolution: u32,
    /// Share * 255. Shape (resolution, resolution, resolution) indexed (x, y, z), C order.
    pub share: Vec<u8>,
}

impl Coverage {
    /// Appends the payload to `out`.
    pub fn encode(&self, out: &mut Vec<u8>) {
        Self::encode_parts(&self.sample, self.resolution, &self.share, out);
    }

    /// [`Coverage::encode`] without owning the values, for the hot path.
    pub fn encode_parts(sample: &SampleId, resolution: u32, share: &[u8], out: &mut Vec<u8>) {
        wire::sample(out, 1, sample);
        wire::uint32(out, 2, resolution);
        wire::bytes(out, 3, share);
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length or range does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        const MESSAGE: &str = "Coverage";
        let coverage = proto::Coverage::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, coverage.sample)?;
        let resolution = resolution(MESSAGE, coverage.resolution)?;
        lengthy(MESSAGE, "share", (resolution as usize).pow(3), coverage.share.len())?;
        Ok(Self { sample, resolution, share: coverage.share })
    }
}

/// Samples for implicit networks, in `CameraCv`.
#[derive(Clone, Debug, PartialEq)]
pub struct Implicit {
    /// Which sample.
    pub sample: SampleId,
    /// Points on the surface [m].
    pub surface_points: Vec<[f32; 3]>,
    /// Outward unit normals there.
    pub surface_normals: Vec<[f32; 3]>,
    /// Points in the grid's box [m].
    pub space_points: Vec<[f32; 3]>,
    /// Signed distance there [m], negative inside.
    pub space_distances: Vec<f32>,
}

impl Implicit {
    /// Appends the payload to `out`.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::sample(out, 1, &self.sample);
        wire::floats(out, 2, self.surface_points.as_flattened());
        wire::floats(out, 3, self.surface_normals.as_flattened());
        wire::floats(out, 4, self.space_points.as_flattened());
        wire::floats(out, 5, &self.space_distances);
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, a number is not finite or a normal is not of unit length.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        const MESSAGE: &str = "Implicit";
        let implicit = proto::Implicit::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, implicit.sample)?;
        let surface_points = triples(MESSAGE, "surface_points", &implicit.surface_points)?;
        let surface_normals = triples(MESSAGE, "surface_normals", &implicit.surface_normals)?;
        let space_points = triples(MESSAGE, "space_points", &implicit.space_points)?;
        let space_distances = floats(MESSAGE, "space_distances", &implicit.space_distances, 1)?;
        lengthy(MESSAGE, "surface_normals", surface_points.len(), surface_normals.len())?;
        lengthy(MESSAGE, "space_distances", space_points.len(), space_distances.len())?;
        for normal in &surface_normals {
            let length = normal.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>().sqrt();
            ranged(MESSAGE, "surface_normals", length, (length - 1.0).abs() < 1e-3, "of unit length")?;
        }
        Ok(Self { sample, surface_points, surface_normals, space_points, space_distances })
    }
}
