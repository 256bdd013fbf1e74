//! The row of views in the table of products.

use super::facts::FACTS;
use crate::{ArrayFormat, ChannelFormat, ExtraFile, Noun, ProductFormat, products::grasps::SHAPES};

const SCHEMAS: &[u8] = include_bytes!("../../generated/views.bin");
const DEPTH_SCHEMAS: &[u8] = include_bytes!("../../generated/graspmill.bin");
const COLOUR_SCHEMAS: &[u8] = include_bytes!("../../generated/view_colours.bin");

/// The row of views in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "views",
    summary: "Images of settled scenes: depth, which body each pixel sees, and the silhouette of every body alone.",
    samples: Noun { one: "view", many: "views" },
    subjects: Noun { one: "scene", many: "scenes" },
    subjects_are_objects: false,
    subject_meaning: "The scene by content, 64 hexadecimal digits.",
    item_meaning: "Number of the view of the scene.",
    has_instances: false,
    channels: &[
        ChannelFormat::new(
            "/views/image",
            "graspmill.SceneImage",
            SCHEMAS,
            &[
                ArrayFormat::new(
                    "instances",
                    "(height, width) u8",
                    "body that each pixel sees, from 1: 0 nothing, 254 container, 255 table",
                ),
                ArrayFormat::new(
                    "point_instances",
                    "(height, width) u8",
                    "body of each measured depth, 253 between two; with a sensor",
                ),
                ArrayFormat::new("world_from_object", "(bodies, 12) f64", "pose of each body by rows [m]"),
                ArrayFormat::new("masks", "bits", "silhouette of each body alone, in its box"),
                ArrayFormat::new(
                    "pixels_all",
                    "(bodies) u32",
                    "pixels of its silhouette alone, including those outside the image",
                ),
                ArrayFormat::new("pixels_visible", "(bodies) u32", "pixels that see each body"),
            ],
        ),
        ChannelFormat::new(
            "/views/depth",
            "graspmill.Depth",
            DEPTH_SCHEMAS,
            &[ArrayFormat::new("depth", "(height, width)", "depth of the whole image [m]")],
        ),
        ChannelFormat::new(
            "/views/colour",
            "graspmill.SceneColour",
            COLOUR_SCHEMAS,
            &[ArrayFormat::new("colour", "(height, width, 3) u8", "red, green, blue of the whole image")],
        ),
    ],
    facts: &FACTS,
    has_splits: true,
    inherits_splits: true,
    files: &[ExtraFile { name: SHAPES, meaning: "Meshes of the objects." }],
};
