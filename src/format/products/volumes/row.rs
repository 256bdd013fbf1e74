//! The row of volumes in the table of products.

use super::facts::{AFFORDANCE, FACTS};
use crate::{ArrayFormat, ChannelFormat, Noun, ProductFormat};

const SCHEMAS: &[u8] = include_bytes!("../../generated/volumes.bin");
const AFFORDANCE_SCHEMAS: &[u8] = include_bytes!("../../generated/affordance.bin");

/// The row of volumes in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "volumes",
    summary: "Truncated signed distances fused from depth images of settled scenes, and which body each voxel is in.",
    samples: Noun { one: "volume", many: "volumes" },
    subjects: Noun { one: "scene", many: "scenes" },
    subjects_are_objects: false,
    subject_meaning: "The scene by content, 64 hexadecimal digits.",
    item_meaning: "Number of the fusion of the scene.",
    has_instances: false,
    channels: &[
        ChannelFormat::new(
            "/volumes/fusion",
            "graspmill.SceneVolume",
            SCHEMAS,
            &[
                ArrayFormat::new("values", "(N, N, N) i16", "mean signed distance in steps of truncation / 32767"),
                ArrayFormat::new("weights", "(N, N, N) u8", "number of images averaged in the distance"),
                ArrayFormat::new("views", "(images) u32", "number of each fused view of the scene"),
                ArrayFormat::new("world_from_camera", "(images, 12) f64", "pose of each camera by rows [m]"),
                ArrayFormat::new("world_from_volume", "(12) f64", "pose of the cube by rows, its origin a corner [m]"),
            ],
        ),
        ChannelFormat::new(
            "/volumes/truth",
            "graspmill.VolumeTruth",
            SCHEMAS,
            &[
                ArrayFormat::new(
                    "instances",
                    "(N, N, N) u8",
                    "what is at each centre: 0 free, from 1 the body, 254 container, 255 below the table",
                ),
                ArrayFormat::new("world_from_object", "(bodies, 12) f64", "pose of each body by rows [m]"),
            ],
        ),
        ChannelFormat::new(
            AFFORDANCE,
            "graspmill.VolumeAffordance",
            AFFORDANCE_SCHEMAS,
            &[
                ArrayFormat::new(
                    "voxels",
                    "(grasps) u32",
                    "number of the voxel that contains the centre of each free grasp",
                ),
                ArrayFormat::new("states", "(grasps) u8", "0 untried, 1 held, 2 failed"),
                ArrayFormat::new("centres", "(grasps, 3) f64", "centre of each grasp in the volume's frame [m]"),
                ArrayFormat::new("rotations", "(grasps, 4) f64", "quaternion x, y, z, w: x closing, z approach"),
                ArrayFormat::new("widths", "(grasps) f64", "free width between the pads of the closed hand [m]"),
            ],
        ),
    ],
    facts: &FACTS,
    has_splits: true,
    inherits_splits: true,
    files: &[],
};
