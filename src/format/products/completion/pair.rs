//! The pair of grids: what one camera saw of an object, and the solid object.

use nalgebra::Point3;
use prost::Message;

use super::{OcclusionFacts, PairFacts};
use crate::codec::{
    RecordError,
    fields::{intrinsics, plane, pose, ranged, resolution},
    proto, sample_from_proto, wire,
};
use kernel::{
    geom::{CameraCv, GridPlacement, Intrinsics, Object, OccupancyGrid, Pose, World},
    ids::SampleId,
};

const MESSAGE: &str = "VoxelPair";
/// Tolerance of a stored pose: distance from a rotation, and inconsistency of the three poses; composing them costs about 1e-15.
const POSE_TOLERANCE: f64 = 1e-9;

/// Partial and complete grid: what one camera saw of an object, and the solid object, on one grid in `CameraCv` (spec:
/// thesis ch. 5.3).
///
/// For the hot path keep one and refill it: its grids keep their memory.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelPair {
    /// Which sample.
    pub sample: SampleId,
    /// The grid, in `CameraCv` [m].
    pub grid: GridPlacement,
    /// The camera [px].
    pub camera: Intrinsics,
    /// Pose of the object in camera axes.
    pub camera_from_object: Pose<CameraCv, Object>,
    /// Pose of the object in the world.
    pub world_from_object: Pose<World, Object>,
    /// Pose of the camera in the world.
    pub world_from_camera: Pose<World, CameraCv>,
    /// Cells that hold a point the camera saw.
    pub partial: OccupancyGrid,
    /// Cells of the solid object.
    pub complete: OccupancyGrid,
    /// Occupied cells of `partial`.
    pub partial_cells: u32,
    /// Occupied cells of `complete`.
    pub complete_cells: u32,
    /// Cells occupied in both.
    pub both_cells: u32,
    /// Share of the solid's volume inside the grid, 0 to 1.
    pub solid_share: f64,
}

impl VoxelPair {
    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        out.reserve(self.partial.bytes().len() + self.complete.bytes().len() + 640);
        wire::sample(out, 1, &self.sample);
        wire::grid(out, 2, &self.grid);
        wire::camera(out, 3, &self.camera);
        wire::doubles(out, 4, &self.camera_from_object.to_rows());
        wire::doubles(out, 5, &self.world_from_object.to_rows());
        wire::doubles(out, 6, &self.world_from_camera.to_rows());
        wire::bytes(out, 7, self.partial.bytes());
        wire::bytes(out, 8, self.complete.bytes());
        wire::uint32(out, 9, self.partial_cells);
        wire::uint32(out, 10, self.complete_cells);
        wire::uint32(out, 11, self.both_cells);
        wire::double(out, 12, self.solid_share);
    }

    /// Counts for tables; a pair has no occluder.
    pub fn facts(&self) -> PairFacts {
        let Self { partial_cells, complete_cells, both_cells, solid_share, .. } = *self;
        PairFacts { partial_cells, complete_cells, both_cells, solid_share, occlusion: OcclusionFacts::default() }
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length, range or count does not hold, a pose is not a rigid motion or the three poses are inconsistent.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let pair = proto::VoxelPair::decode(payload)
            .map_err(|error| RecordError::Protobuf { message: MESSAGE, problem: error.to_string() })?;
        let sample = sample_from_proto(MESSAGE, pair.sample)?;
        let grid = placement(pair.grid)?;
        let camera = intrinsics(MESSAGE, pair.camera)?;
        let camera_from_object = pose(MESSAGE, "camera_from_object", &pair.camera_from_object)?;
        let world_from_object: Pose<World, Object> = pose(MESSAGE, "world_from_object", &pair.world_from_object)?;
        let world_from_camera: Pose<World, CameraCv> = pose(MESSAGE, "world_from_camera", &pair.world_from_camera)?;
        let chained = (world_from_camera * camera_from_object).to_rows();
        let error = largest_difference(&chained, &world_from_object.to_rows());
        if error > POSE_TOLERANCE {
            return Err(RecordError::PoseChain { message: MESSAGE, error });
        }
        let partial = plane(MESSAGE, "partial", grid.resolution, pair.partial)?;
        let complete = plane(MESSAGE, "complete", grid.resolution, pair.complete)?;
        for (field, stated, counted) in [
            ("partial_cells", pair.partial_cells, partial.count()),
            ("complete_cells", pair.complete_cells, complete.count()),
            ("both_cells", pair.both_cells, partial.count_both(&complete)),
        ] {
            if stated != counted {
                return Err(RecordError::Count { message: MESSAGE, field, stated, counted });
            }
        }
        ranged(MESSAGE, "solid_share", pair.solid_share, (0.0..=1.0).contains(&pair.solid_share), "0 to 1")?;
        Ok(Self {
            sample,
            grid,
            camera,
            camera_from_object,
            world_from_object,
            world_from_camera,
            partial,
            complete,
            partial_cells: pair.partial_cells,
            complete_cells: pair.complete_cells,
            both_cells: pair.both_cells,
            solid_share: pair.solid_share,
        })
    }
}

fn placement(grid: Option<proto::Grid>) -> Result<GridPlacement, RecordError> {
    let grid = grid.ok_or(RecordError::Missing { message: MESSAGE, field: "grid" })?;
    let resolution = resolution(MESSAGE, grid.resolution)?;
    for (field, value) in
        [("grid.centre_x", grid.centre_x), ("grid.centre_y", grid.centre_y), ("grid.centre_z", grid.centre_z)]
    {
        ranged(MESSAGE, field, value, value.is_finite(), "finite")?;
    }
    let holds = grid.cell_size > 0.0 && grid.cell_size.is_finite();
    ranged(MESSAGE, "grid.cell_size", grid.cell_size, holds, "positive and finite")?;
    let centre = Point3::new(grid.centre_x, grid.centre_y, grid.centre_z);
    Ok(GridPlacement { resolution, centre, cell_size: grid.cell_size })
}

fn largest_difference(a: &[f64; 12], b: &[f64; 12]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
