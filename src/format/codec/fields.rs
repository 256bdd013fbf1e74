//! Checks of decoded fields: lengths, ranges, names, poses, cameras, bit planes.

use nalgebra::Matrix3;

use crate::codec::{RecordError, proto};
use kernel::geom::{Frame, Intrinsics, InvalidIntrinsics, OccupancyGrid, Pose};

/// Tolerance of a stored pose: distance from a rotation, and inconsistency of the three poses; composing them costs about 1e-15.
const POSE_TOLERANCE: f64 = 1e-9;

/// `Err` with the value unless `holds`.
pub(crate) fn ranged(
    message: &'static str,
    field: &'static str,
    value: f64,
    holds: bool,
    allowed: &'static str,
) -> Result<(), RecordError> {
    if holds { Ok(()) } else { Err(RecordError::Range { message, field, value, allowed }) }
}

/// `Err` unless `found` is `expected`.
pub(crate) fn lengthy(
    message: &'static str,
    field: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), RecordError> {
    if found == expected { Ok(()) } else { Err(RecordError::Length { message, field, expected, found }) }
}

/// A grid's resolution: 1 to 128.
pub(crate) fn resolution(message: &'static str, value: u32) -> Result<u32, RecordError> {
    ranged(message, "resolution", f64::from(value), (1..=128).contains(&value), "1 to 128")?;
    Ok(value)
}

/// A bit plane whose unused last bits are 0.
pub(crate) fn plane(
    message: &'static str,
    field: &'static str,
    resolution: u32,
    bits: Vec<u8>,
) -> Result<OccupancyGrid, RecordError> {
    let found = bits.len();
    let expected = OccupancyGrid::bytes_for(resolution);
    let last = bits.last().copied().unwrap_or_default();
    let grid =
        OccupancyGrid::from_bytes(resolution, bits).ok_or(RecordError::Length { message, field, expected, found })?;
    let spare = 8 * expected - (resolution as usize).pow(3);
    let padding = u32::from(last) >> (8 - spare);
    ranged(message, field, f64::from(padding), padding == 0, "without bits after the last cell")?;
    Ok(grid)
}

/// Focal lengths that a camera can have.
pub(crate) const FOCAL_LENGTHS: &str = "0.01 to 100 times the longer side of the image";
/// Principal points that a camera can have.
const PRINCIPAL: &str = "up to five sides of the image from its middle";

/// A camera from its numbers.
pub(crate) fn intrinsics(message: &'static str, camera: Option<proto::Camera>) -> Result<Intrinsics, RecordError> {
    let camera = camera.ok_or(RecordError::Missing { message, field: "camera" })?;
    let proto::Camera { width, height, fx, fy, cx, cy, near } = camera;
    let camera = Intrinsics { width, height, fx, fy, cx, cy, near };
    camera.checked().map_err(|error| {
        let (field, value, allowed) = match error {
            InvalidIntrinsics::Size { width, .. } if !(1..=16384).contains(&width) => {
                ("camera.width", f64::from(width), "1 to 16384")
            }
            InvalidIntrinsics::Size { height, .. } => ("camera.height", f64::from(height), "1 to 16384"),
            InvalidIntrinsics::OutOfRange { name: "fx", value, .. } => ("camera.fx", value, FOCAL_LENGTHS),
            InvalidIntrinsics::OutOfRange { name: "fy", value, .. } => ("camera.fy", value, FOCAL_LENGTHS),
            InvalidIntrinsics::OutOfRange { name: "cx", value, .. } => ("camera.cx", value, PRINCIPAL),
            InvalidIntrinsics::OutOfRange { value, .. } => ("camera.cy", value, PRINCIPAL),
            InvalidIntrinsics::Near(value) | InvalidIntrinsics::FieldOfView(value) => {
                ("camera.near", value, "positive and finite")
            }
        };
        RecordError::Range { message, field, value, allowed }
    })
}

/// A rigid motion from its twelve numbers.
pub(crate) fn pose<To: Frame, From: Frame>(
    message: &'static str,
    field: &'static str,
    rows: &[f64],
) -> Result<Pose<To, From>, RecordError> {
    let rows: &[f64; 12] =
        rows.try_into().map_err(|_| RecordError::Length { message, field, expected: 12, found: rows.len() })?;
    if let Some(value) = rows.iter().find(|value| !value.is_finite()) {
        return Err(RecordError::Range { message, field, value: *value, allowed: "finite" });
    }
    let pose = Pose::from_rows(rows);
    let rotation = pose.rotation().matrix();
    let error =
        (rotation * rotation.transpose() - Matrix3::identity()).amax().max((rotation.determinant() - 1.0).abs());
    if error > POSE_TOLERANCE {
        return Err(RecordError::Rotation { message, field, error });
    }
    Ok(pose)
}

pub(crate) fn broken(message: &'static str) -> impl FnOnce(prost::DecodeError) -> RecordError {
    move |error| RecordError::Protobuf { message, problem: error.to_string() }
}

/// Little-endian f32 from a bytes field; every value must be finite.
pub(crate) fn floats(
    message: &'static str,
    field: &'static str,
    data: &[u8],
    each: usize,
) -> Result<Vec<f32>, RecordError> {
    lengthy(message, field, data.len() / (4 * each) * (4 * each), data.len())?;
    let values: Vec<f32> =
        data.chunks_exact(4).map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).collect();
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(RecordError::Range { message, field, value: f64::from(*value), allowed: "finite" }),
        None => Ok(values),
    }
}

/// (n, 3) little-endian f32 from a bytes field.
pub(crate) fn triples(message: &'static str, field: &'static str, data: &[u8]) -> Result<Vec<[f32; 3]>, RecordError> {
    Ok(floats(message, field, data, 3)?.chunks_exact(3).map(|xyz| [xyz[0], xyz[1], xyz[2]]).collect())
}

/// `Err` unless the text is one of these.
pub(crate) fn named(
    message: &'static str,
    field: &'static str,
    found: &str,
    known: &[&str],
) -> Result<(), RecordError> {
    if known.contains(&found) {
        return Ok(());
    }
    let (found, expected) = (found.to_owned(), known.join(" or "));
    Err(RecordError::Name { message, field, found, expected })
}
