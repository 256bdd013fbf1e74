//! Patches: what a camera sees around the palm and the fingertips of grasps, with the labels of heatmaps.

mod check;
mod colour_image;
mod facts;
mod heatmap;
mod patch;
#[cfg(test)]
mod patch_tests;
mod sample;
mod types_file;

pub use colour_image::PatchImageColour;
pub use facts::PatchFacts;
pub use heatmap::{HeatmapPoint, PatchHeatmap};
pub use patch::{HeatmapPatch, PATCH_POINTS, POINT_NAMES, PatchColour, PatchPoint};
pub use types_file::{TYPES, read_types, write_types};

use crate::{ArrayFormat, Channel, ChannelFormat, ExtraFile, Noun, Product, ProductFormat};

const PATCH_SCHEMAS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/patches.bin"));
const IMAGE_SCHEMAS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/patch_images.bin"));
const HEATMAP_SCHEMAS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/heatmaps.bin"));
const DEPTH_SCHEMAS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/graspmill.bin"));

const fn channel(
    topic: &'static str,
    message: &'static str,
    descriptors: &'static [u8],
    arrays: &'static [ArrayFormat],
) -> ChannelFormat {
    ChannelFormat { topic, message, descriptors, arrays }
}

const fn array(name: &'static str, shape: &'static str, meaning: &'static str) -> ArrayFormat {
    ArrayFormat { name, shape, meaning }
}

/// The row of patches in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "patches",
    summary: "Image patches around the palm and the fingertips of grasps, with labels.",
    samples: Noun { one: "grasp", many: "grasps" },
    subjects: Noun { one: "object", many: "objects" },
    subjects_are_objects: true,
    subject_meaning: "The object by content, 64 hexadecimal digits.",
    item_meaning: "Number of the grasp of the object.",
    channels: &[
        channel(
            "/patches/patch",
            "graspmill.HeatmapPatch",
            PATCH_SCHEMAS,
            &[
                array("depth", "(4, side, side) f32", "depth around palm and fingertips along the optical axis [m]"),
                array("points", "(4, ...)", "pixel, position [m] and corner of each patch"),
            ],
        ),
        channel(
            "/patches/colour",
            "graspmill.PatchColour",
            PATCH_SCHEMAS,
            &[array("colour", "(4, side, side, 3) u8", "the same patches in colour")],
        ),
        channel(
            "/patches/image",
            "graspmill.Depth",
            DEPTH_SCHEMAS,
            &[array("image", "(height, width)", "depth of the whole image [m]")],
        ),
        channel(
            "/patches/image_colour",
            "graspmill.PatchImageColour",
            IMAGE_SCHEMAS,
            &[array("image_colour", "(height, width, 3) u8", "the whole image in colour")],
        ),
        channel(
            "/patches/heatmap",
            "graspmill.PatchHeatmap",
            HEATMAP_SCHEMAS,
            &[array(
                "heatmap",
                "(points, ...)",
                "pixel, type and value of palm and fingertips of all grasps from about the same side",
            )],
        ),
    ],
    facts: &facts::FACTS,
    has_splits: true,
    inherits_splits: true,
    files: &[ExtraFile {
        name: TYPES,
        meaning: "Grasp types of the kept grasps that the patches were chosen from, with their counts.",
        in_root: None,
        check: check::check_types,
    }],
    check: || Box::new(check::PatchCheck::default()),
};

impl Product {
    /// Image patches around the palm and the fingertips of grasps, with labels.
    pub const PATCHES: Self = Self::named("patches");
}

impl Channel {
    /// [`HeatmapPatch`]: depth around palm and fingertips of one grasp, with labels; every sample of patches has one.
    pub const PATCH: Self = Self::at("/patches/patch");
    /// [`PatchColour`]: the same patches in colour.
    pub const PATCH_COLOUR: Self = Self::at("/patches/colour");
    /// [`Depth`](crate::Depth) of the whole image that the patches are cut out of.
    pub const PATCH_IMAGE: Self = Self::at("/patches/image");
    /// [`PatchImageColour`]: the same image in colour.
    pub const PATCH_IMAGE_COLOUR: Self = Self::at("/patches/image_colour");
    /// [`PatchHeatmap`]: truth for heatmaps over the whole image.
    pub const PATCH_HEATMAP: Self = Self::at("/patches/heatmap");
}
