//! The row of heatmaps in the table of products.

use super::facts::FACTS;
use crate::{ArrayFormat, ChannelFormat, Noun, ProductFormat};

const SCHEMAS: &[u8] = include_bytes!("../../generated/scene_heatmaps.bin");
const DEPTH_SCHEMAS: &[u8] = include_bytes!("../../generated/graspmill.bin");

/// The row of heatmaps in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "heatmaps",
    summary: "Images of settled scenes with the grasps of all bodies: where palm and fingertips would be, and the outcome of trials.",
    samples: Noun { one: "image", many: "images" },
    subjects: Noun { one: "scene", many: "scenes" },
    subjects_are_objects: false,
    subject_meaning: "The scene by content, 64 hexadecimal digits.",
    item_meaning: "Number of the view of the scene.",
    has_instances: false,
    channels: &[
        ChannelFormat::new(
            "/heatmaps/grasps",
            "graspmill.SceneHeatmap",
            SCHEMAS,
            &[
                ArrayFormat::new("bodies", "(grasps) u32", "number of the body of each grasp, from 1"),
                ArrayFormat::new("type_indices", "(grasps) u32", "type of each grasp among the chosen types"),
                ArrayFormat::new("states", "(grasps) u8", "0 untried, 1 held, 2 failed"),
                ArrayFormat::new("values", "(grasps) f32", "label of each grasp, lower is better"),
                ArrayFormat::new("pixels", "(grasps, points, 2) f64", "projections of palm and fingertips [px]"),
                ArrayFormat::new("visible", "(grasps, points) u8", "1 where the image shows the point, else 0"),
                ArrayFormat::new("corners", "(patches, points, 2) u32", "left and top pixel of each patch"),
                ArrayFormat::new(
                    "forbidden_pixels",
                    "(forbidden grasps, 2) f64",
                    "projections of the palms of grasps that are not free [px]",
                ),
            ],
        ),
        ChannelFormat::new(
            "/heatmaps/depth",
            "graspmill.Depth",
            DEPTH_SCHEMAS,
            &[ArrayFormat::new("depth", "(height, width)", "exact depth along the optical axis [m]")],
        ),
    ],
    facts: &FACTS,
    has_splits: true,
    inherits_splits: true,
    files: &[],
};
