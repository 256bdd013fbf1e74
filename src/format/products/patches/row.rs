//! The row of patches in the table of products.

use super::{
    colour_image::PatchImageColour,
    facts::{FACTS, TRIAL_TOPIC, VISIBILITY_TOPIC},
    patch::PatchColour,
};
use crate::{ArrayFormat, ChannelFormat, ExtraFile, Noun, ProductFormat};

/// Name of the file of grasp types.
pub const TYPES: &str = "types.json";

const PATCH_SCHEMAS: &[u8] = include_bytes!("../../generated/patches.bin");
const IMAGE_SCHEMAS: &[u8] = include_bytes!("../../generated/patch_images.bin");
const HEATMAP_SCHEMAS: &[u8] = include_bytes!("../../generated/heatmaps.bin");
const MARK_SCHEMAS: &[u8] = include_bytes!("../../generated/patch_marks.bin");
const DEPTH_SCHEMAS: &[u8] = include_bytes!("../../generated/graspmill.bin");

/// The row of patches in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "patches",
    summary: "Image patches around the palm and the fingertips of grasps, with labels.",
    samples: Noun { one: "grasp", many: "grasps" },
    subjects: Noun { one: "object", many: "objects" },
    subjects_are_objects: true,
    subject_meaning: "The object by content, 64 hexadecimal digits.",
    item_meaning: "Number of the grasp of the object.",
    has_instances: false,
    channels: &[
        ChannelFormat::new(
            "/patches/patch",
            "graspmill.HeatmapPatch",
            PATCH_SCHEMAS,
            &[
                ArrayFormat::new(
                    "depth",
                    "(4, side, side) f32",
                    "depth around palm and fingertips along the optical axis [m]",
                ),
                ArrayFormat::new("points", "(4, ...)", "pixel, position [m] and corner of each patch"),
            ],
        ),
        ChannelFormat::new(
            "/patches/colour",
            "graspmill.PatchColour",
            PATCH_SCHEMAS,
            &[ArrayFormat::new("colour", "(4, side, side, 3) u8", "the same patches in colour")],
        )
        .decoded_by(|payload| Ok(PatchColour::decode(payload)?.sample)),
        ChannelFormat::new(
            "/patches/image",
            "graspmill.Depth",
            DEPTH_SCHEMAS,
            &[ArrayFormat::new("image", "(height, width)", "depth of the whole image [m]")],
        ),
        ChannelFormat::new(
            "/patches/image_colour",
            "graspmill.PatchImageColour",
            IMAGE_SCHEMAS,
            &[ArrayFormat::new("image_colour", "(height, width, 3) u8", "the whole image in colour")],
        )
        .decoded_by(|payload| Ok(PatchImageColour::decode(payload)?.sample)),
        ChannelFormat::new(
            "/patches/heatmap",
            "graspmill.PatchHeatmap",
            HEATMAP_SCHEMAS,
            &[ArrayFormat::new(
                "heatmap",
                "(points, ...)",
                "pixel, type and value of palm and fingertips of all grasps from the camera's side",
            )],
        ),
        ChannelFormat::new(
            TRIAL_TOPIC,
            "graspmill.PatchTrial",
            MARK_SCHEMAS,
            &[ArrayFormat::new(
                "tested",
                "(4, 4 types) u8",
                "1 where a trial determines a number of the labels, else 0",
            )],
        ),
        ChannelFormat::new(
            VISIBILITY_TOPIC,
            "graspmill.PatchVisibility",
            MARK_SCHEMAS,
            &[
                ArrayFormat::new("visible", "(4) u8", "1 unless the surface in the image hides the point, else 0"),
                ArrayFormat::new("surfaces", "(4) f32", "depth of the image in the pixel of each point [m]"),
            ],
        ),
        ChannelFormat::new(
            "/patches/metric",
            "graspmill.PatchMetric",
            MARK_SCHEMAS,
            &[ArrayFormat::new(
                "metric",
                "(4, side, side) f32",
                "depth in squares of one size in metres around each point [m]",
            )],
        ),
        ChannelFormat::new(
            "/patches/metric_colour",
            "graspmill.PatchColour",
            PATCH_SCHEMAS,
            &[ArrayFormat::new("metric_colour", "(4, side, side, 3) u8", "these squares in colour")],
        )
        .decoded_by(|payload| Ok(PatchColour::decode(payload)?.sample)),
        ChannelFormat::new(
            "/patches/table",
            "graspmill.PatchTable",
            MARK_SCHEMAS,
            &[ArrayFormat::new("table", "(3, 4)", "pose of the table under the object in camera axes [m]")],
        ),
    ],
    facts: &FACTS,
    has_splits: true,
    inherits_splits: true,
    files: &[ExtraFile {
        name: TYPES,
        meaning: "Grasp types of the kept grasps from which the patches were chosen, with their counts.",
    }],
};
