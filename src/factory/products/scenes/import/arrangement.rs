//! Arrangements of others, as a job has them.

use kernel::words::Split;

/// Arrangements of others.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// The arrangements; each is one scene, in this order.
    pub scenes: Vec<ImportedScene>,
    /// Split of all of them.
    pub split: Split,
    /// Where the scene is in the world of the files.
    pub frame: SourceFrame,
}

/// Where the world of a scene is in the world of the files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SourceFrame {
    /// On a table: its normal becomes z, its plane z = 0, and the middle of all bodies is above the origin.
    Table {
        /// Direction of the table's normal in the world of the files, of any length above 0.
        up: [f64; 3],
        /// Height of the table along that direction in the world of the files [m]; `None`: that of the lowest point of each
        /// scene.
        height: Option<f64>,
    },
    /// In a container, whose frame is the scene's world.
    Container {
        /// The frame in the world of the files: x, y, z [m], qx, qy, qz, qw, of about unit length.
        pose: [f64; 7],
    },
}

/// An arrangement.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedScene {
    /// The scene among its files: name or number.
    pub source: String,
    /// The bodies.
    pub bodies: Vec<ImportedBody>,
}

/// A body of an arrangement.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedBody {
    /// Name of the object in the job.
    pub object: String,
    /// The object in the world of the files: x, y, z [m], qx, qy, qz, qw, of about unit length.
    pub pose: [f64; 7],
}

impl SourceFrame {
    /// Default direction of the table's normal in the world of files.
    pub const UP: [f64; 3] = [0.0, 0.0, 1.0];

    /// Pose of a container whose frame is the world of the files.
    pub const SAME: [f64; 7] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
}
