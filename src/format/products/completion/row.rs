//! The row of completion in the table of products.

use super::{
    channels::{Cloud, Coverage, Implicit, Tsdf, Visibility},
    facts::{FACTS, OCCLUSION},
};
use crate::{ArrayFormat, ChannelFormat, Depth, Noun, ProductFormat};

const PAIR_SCHEMAS: &[u8] = include_bytes!("../../generated/graspmill.bin");
const TOUCH_SCHEMAS: &[u8] = include_bytes!("../../generated/touch.bin");
const OCCLUSION_SCHEMAS: &[u8] = include_bytes!("../../generated/occlusion.bin");
const HAND_SCHEMAS: &[u8] = include_bytes!("../../generated/hand.bin");

/// The row of completion in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "completion",
    summary: "Pairs of occupancy grids: the part of an object that one camera saw, and the solid object.",
    samples: Noun { one: "sample", many: "samples" },
    subjects: Noun { one: "object", many: "objects" },
    subjects_are_objects: true,
    subject_meaning: "The object by content, 64 hexadecimal digits.",
    item_meaning: "Number of the view of the object.",
    has_instances: false,
    channels: &CHANNELS,
    facts: &FACTS,
    has_splits: true,
    inherits_splits: false,
    files: &[],
};

const CHANNELS: [ChannelFormat; 11] = [
    ChannelFormat::new(
        "/completion/pair",
        "graspmill.VoxelPair",
        PAIR_SCHEMAS,
        &[
            ArrayFormat::new("partial", "(N, N, N) bits", "cells that hold a point the camera saw"),
            ArrayFormat::new("complete", "(N, N, N) bits", "cells of the solid object, same grid, same pose"),
        ],
    ),
    ChannelFormat::new(
        "/completion/visibility",
        "graspmill.Visibility",
        PAIR_SCHEMAS,
        &[ArrayFormat::new(
            "free",
            "(N, N, N) bits",
            "cells that the camera sees to be free; what is neither is unseen",
        )],
    )
    .decoded_by(|payload| Ok(Visibility::decode(payload)?.sample)),
    ChannelFormat::new(
        "/completion/depth",
        "graspmill.Depth",
        PAIR_SCHEMAS,
        &[ArrayFormat::new(
            "depth",
            "(height, width)",
            "depth along the optical axis [m], no return = NaN; crop of the image",
        )],
    )
    .decoded_by(|payload| Ok(Depth::decode(payload)?.sample)),
    ChannelFormat::new(
        "/completion/cloud",
        "graspmill.Cloud",
        PAIR_SCHEMAS,
        &[ArrayFormat::new("cloud", "(n, 3) f32", "points that the camera saw [m]")],
    )
    .decoded_by(|payload| Ok(Cloud::decode(payload)?.sample)),
    ChannelFormat::new(
        "/completion/tsdf",
        "graspmill.Tsdf",
        PAIR_SCHEMAS,
        &[ArrayFormat::new(
            "tsdf",
            "(N, N, N) i16",
            "signed distance to the surface, seen or not, truncated, negative inside",
        )],
    )
    .decoded_by(|payload| Ok(Tsdf::decode(payload)?.sample)),
    ChannelFormat::new(
        "/completion/coverage",
        "graspmill.Coverage",
        PAIR_SCHEMAS,
        &[ArrayFormat::new("coverage", "(N, N, N) u8", "share of each cell that is solid, times 255")],
    )
    .decoded_by(|payload| Ok(Coverage::decode(payload)?.sample)),
    ChannelFormat::new(
        "/completion/implicit",
        "graspmill.Implicit",
        PAIR_SCHEMAS,
        &[ArrayFormat::new("implicit", "points, normals, distances", "samples of the surface and of space [m]")],
    )
    .decoded_by(|payload| Ok(Implicit::decode(payload)?.sample)),
    ChannelFormat::new(
        OCCLUSION,
        "graspmill.Occlusion",
        OCCLUSION_SCHEMAS,
        &[
            ArrayFormat::new("corners", "(n, 3) f32", "corners of the occluder, which is their convex hull [m]"),
            ArrayFormat::new("mask", "(height, width) bits", "pixels that see the occluder; crop of the image"),
        ],
    ),
    ChannelFormat::new(
        "/completion/touch_rays",
        "graspmill.TactileContacts",
        TOUCH_SCHEMAS,
        &[
            ArrayFormat::new(
                "contacts",
                "(contacts, ...)",
                "where rays from behind met the object: point [m], outward normal, distance [m], which ray, seen or not",
            ),
            ArrayFormat::new("tactile", "(N, N, N) bits", "cells that hold a contact, same grid"),
        ],
    ),
    ChannelFormat::new(
        "/completion/touch_exploration",
        "graspmill.HandContacts",
        HAND_SCHEMAS,
        &[
            ArrayFormat::new(
                "contacts",
                "(contacts, ...)",
                "where a hand that explored the hidden side touched: point [m], outward normal, which approach, seen \
             or not; link, force [N], gap [m]",
            ),
            ArrayFormat::new(
                "approaches",
                "(approaches, ...)",
                "where each ended: pose of the hand, joint values, why it ended",
            ),
        ],
    ),
    ChannelFormat::new(
        "/completion/touch_grasp",
        "graspmill.HandContacts",
        HAND_SCHEMAS,
        &[
            ArrayFormat::new(
                "contacts",
                "(contacts, ...)",
                "where a hand that grasped once touched; as for exploration",
            ),
            ArrayFormat::new("approaches", "(1, ...)", "where it ended: pose of the hand, joint values, why it ended"),
        ],
    ),
];
