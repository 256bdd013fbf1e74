//! The row of completion in the table of products.

use super::facts::FACTS;
use crate::{ArrayFormat, ChannelFormat, Noun, ProductFormat};

const PAIR_SCHEMAS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/graspmill.bin"));
const TOUCH_SCHEMAS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/touch.bin"));
const HAND_SCHEMAS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/hand.bin"));

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

/// The row of completion in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "completion",
    summary: "Pairs of occupancy grids: the part of an object that one camera saw, and the solid object.",
    samples: Noun { one: "sample", many: "samples" },
    subjects: Noun { one: "object", many: "objects" },
    subjects_are_objects: true,
    subject_meaning: "The object by content, 64 hexadecimal digits.",
    item_meaning: "Number of the view of the object.",
    channels: &CHANNELS,
    facts: &FACTS,
    has_splits: true,
    inherits_splits: false,
    files: &[],
};

const CHANNELS: [ChannelFormat; 10] = [
    channel(
        "/completion/pair",
        "graspmill.VoxelPair",
        PAIR_SCHEMAS,
        &[
            array("partial", "(N, N, N) bits", "cells that hold a point the camera saw"),
            array("complete", "(N, N, N) bits", "cells of the solid object, same grid, same pose"),
        ],
    ),
    channel(
        "/completion/visibility",
        "graspmill.Visibility",
        PAIR_SCHEMAS,
        &[array("free", "(N, N, N) bits", "cells that the camera sees to be free; what is neither is unseen")],
    ),
    channel(
        "/completion/depth",
        "graspmill.Depth",
        PAIR_SCHEMAS,
        &[array("depth", "(height, width)", "depth along the optical axis [m], no return = NaN; crop of the image")],
    ),
    channel(
        "/completion/cloud",
        "graspmill.Cloud",
        PAIR_SCHEMAS,
        &[array("cloud", "(n, 3) f32", "the seen points [m]")],
    ),
    channel(
        "/completion/tsdf",
        "graspmill.Tsdf",
        PAIR_SCHEMAS,
        &[array("tsdf", "(N, N, N) i16", "signed distance to the surface, seen or not, cut off, negative inside")],
    ),
    channel(
        "/completion/coverage",
        "graspmill.Coverage",
        PAIR_SCHEMAS,
        &[array("coverage", "(N, N, N) u8", "share of each cell that is solid, times 255")],
    ),
    channel(
        "/completion/implicit",
        "graspmill.Implicit",
        PAIR_SCHEMAS,
        &[array("implicit", "points, normals, distances", "samples of the surface and of space [m]")],
    ),
    channel(
        "/completion/touch_rays",
        "graspmill.TactileContacts",
        TOUCH_SCHEMAS,
        &[
            array(
                "contacts",
                "(contacts, ...)",
                "where rays from behind met the object: point [m], outward normal, distance [m], which ray, seen or not",
            ),
            array("tactile", "(N, N, N) bits", "cells that hold a contact, same grid"),
        ],
    ),
    channel(
        "/completion/touch_exploration",
        "graspmill.HandContacts",
        HAND_SCHEMAS,
        &[
            array(
                "contacts",
                "(contacts, ...)",
                "where a hand that felt its way over the hidden side touched: point [m], outward normal, which approach, seen \
             or not; link, force [N], gap [m]",
            ),
            array("approaches", "(approaches, ...)", "where each ended: pose of the hand, joint values, why it ended"),
        ],
    ),
    channel(
        "/completion/touch_grasp",
        "graspmill.HandContacts",
        HAND_SCHEMAS,
        &[
            array("contacts", "(contacts, ...)", "where a hand that took hold once touched; as of exploration"),
            array("approaches", "(1, ...)", "where it ended: pose of the hand, joint values, why it ended"),
        ],
    ),
];
