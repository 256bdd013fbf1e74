//! Errors of decoding: why bytes are not a record.

/// Why a payload is not a valid record.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordError {
    /// The bytes are not a protobuf message of that type.
    #[error("{message}: not a protobuf message of this type: {problem}")]
    Protobuf {
        /// Message type.
        message: &'static str,
        /// Problem that the decoder found.
        problem: String,
    },
    /// A field that every record has is absent.
    #[error("{message}.{field} is missing")]
    Missing {
        /// Message type.
        message: &'static str,
        /// Field.
        field: &'static str,
    },
    /// A field has the wrong number of bytes or values.
    #[error("{message}.{field} has length {found}, expected {expected}")]
    Length {
        /// Message type.
        message: &'static str,
        /// Field.
        field: &'static str,
        /// Length that the other fields require.
        expected: usize,
        /// Length found.
        found: usize,
    },
    /// A number is outside its range.
    #[error("{message}.{field} = {value}: must be {allowed}")]
    Range {
        /// Message type.
        message: &'static str,
        /// Field.
        field: &'static str,
        /// Value found.
        value: f64,
        /// Allowed values, in words.
        allowed: &'static str,
    },
    /// A stated count is not the count of the bits.
    #[error("{message}.{field} states {stated} cells, but {counted} bits are set")]
    Count {
        /// Message type.
        message: &'static str,
        /// Field.
        field: &'static str,
        /// Stated count.
        stated: u32,
        /// Counted bits.
        counted: u32,
    },
    /// A text is unknown.
    #[error("{message}.{field} is '{found}': must be {expected}")]
    Name {
        /// Message type.
        message: &'static str,
        /// Field.
        field: &'static str,
        /// Text found.
        found: String,
        /// Allowed texts.
        expected: String,
    },
    /// The axes do not form a grid of poses.
    #[error("{message}.axes: {problem}")]
    Grid {
        /// Message type.
        message: &'static str,
        /// Why not.
        problem: kernel::geom::InvalidPoseGrid,
    },
    /// The rotation of a pose is not orthonormal and right-handed.
    #[error("{message}.{field} is not a rotation: it is off by {error:e}, at most 1e-9 is allowed")]
    Rotation {
        /// Message type.
        message: &'static str,
        /// Field.
        field: &'static str,
        /// Largest entry of |R R^T - 1|, or of |det R - 1|.
        error: f64,
    },
    /// world_from_object is not world_from_camera * camera_from_object.
    #[error(
        "{message}: the three poses are inconsistent: world_from_camera * camera_from_object is off by {error:e}, at most 1e-9 is allowed"
    )]
    PoseChain {
        /// Message type.
        message: &'static str,
        /// Largest difference of two entries (rotation: 1, translation: m).
        error: f64,
    },
}
