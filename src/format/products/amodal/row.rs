//! The row of amodal pairs in the table of products.

use super::facts::FACTS;
use crate::{ArrayFormat, ChannelFormat, Cloud, Coverage, Depth, Implicit, Noun, ProductFormat, Tsdf, Visibility};

const PAIR_SCHEMAS: &[u8] = include_bytes!("../../generated/graspmill.bin");
const CLUTTER_SCHEMAS: &[u8] = include_bytes!("../../generated/amodal.bin");
const TOUCH_SCHEMAS: &[u8] = include_bytes!("../../generated/touch_in_clutter.bin");

/// The row of amodal pairs in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "amodal",
    summary: "Completion pairs of bodies in clutter: what one image shows of each, the whole solid, and what surrounds it.",
    samples: Noun { one: "pair", many: "pairs" },
    subjects: Noun { one: "scene", many: "scenes" },
    subjects_are_objects: false,
    subject_meaning: "The scene by content, 64 hexadecimal digits.",
    item_meaning: "Number of the view of the scene; the instance is the number of the body in it, from 1.",
    has_instances: true,
    channels: &CHANNELS,
    facts: &FACTS,
    has_splits: true,
    inherits_splits: true,
    files: &[],
};

const CHANNELS: [ChannelFormat; 10] = [
    ChannelFormat::new(
        "/amodal/pair",
        "graspmill.VoxelPair",
        PAIR_SCHEMAS,
        &[
            ArrayFormat::new("partial", "(N, N, N) bits", "cells that hold a measured point of the body"),
            ArrayFormat::new("complete", "(N, N, N) bits", "cells of the whole solid body, same grid, same pose"),
        ],
    ),
    ChannelFormat::new(
        "/amodal/visibility",
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
        "/amodal/depth",
        "graspmill.Depth",
        PAIR_SCHEMAS,
        &[ArrayFormat::new(
            "depth",
            "(height, width)",
            "depth of the body along the optical axis [m], elsewhere NaN; crop of the image",
        )],
    )
    .decoded_by(|payload| Ok(Depth::decode(payload)?.sample)),
    ChannelFormat::new(
        "/amodal/cloud",
        "graspmill.Cloud",
        PAIR_SCHEMAS,
        &[ArrayFormat::new("cloud", "(n, 3) f32", "the measured points of the body [m]")],
    )
    .decoded_by(|payload| Ok(Cloud::decode(payload)?.sample)),
    ChannelFormat::new(
        "/amodal/tsdf",
        "graspmill.Tsdf",
        PAIR_SCHEMAS,
        &[ArrayFormat::new(
            "tsdf",
            "(N, N, N) i16",
            "signed distance to the body's surface, seen or not, truncated, negative inside",
        )],
    )
    .decoded_by(|payload| Ok(Tsdf::decode(payload)?.sample)),
    ChannelFormat::new(
        "/amodal/coverage",
        "graspmill.Coverage",
        PAIR_SCHEMAS,
        &[ArrayFormat::new("coverage", "(N, N, N) u8", "share of each cell that the body fills, times 255")],
    )
    .decoded_by(|payload| Ok(Coverage::decode(payload)?.sample)),
    ChannelFormat::new(
        "/amodal/implicit",
        "graspmill.Implicit",
        PAIR_SCHEMAS,
        &[ArrayFormat::new("implicit", "points, normals, distances", "samples of the surface and of space [m]")],
    )
    .decoded_by(|payload| Ok(Implicit::decode(payload)?.sample)),
    ChannelFormat::new(
        "/amodal/clutter",
        "graspmill.Clutter",
        CLUTTER_SCHEMAS,
        &[
            ArrayFormat::new("others_seen", "(N, N, N) bits", "cells that hold a measured point of anything else"),
            ArrayFormat::new("others_solid", "(N, N, N) bits", "cells that meet another body, container or table"),
        ],
    ),
    ChannelFormat::new(
        "/amodal/touch_rays",
        "graspmill.ClutterContacts",
        TOUCH_SCHEMAS,
        &[
            ArrayFormat::new(
                "contacts",
                "(contacts, ...)",
                "where rays from behind met the body: point [m], outward normal, distance [m], which ray, seen or not",
            ),
            ArrayFormat::new(
                "blocked",
                "(blocked, ...)",
                "where rays met something else first: which ray, what it is, point [m]",
            ),
            ArrayFormat::new("tactile", "(N, N, N) bits", "cells that hold a contact, same grid"),
        ],
    ),
    ChannelFormat::new(
        "/amodal/touch_exploration",
        "graspmill.ClutterContacts",
        TOUCH_SCHEMAS,
        &[
            ArrayFormat::new(
                "contacts",
                "(contacts, ...)",
                "where a hand that explored the hidden side touched the body: point [m], outward normal, which approach, \
                 seen or not; link, force [N], gap [m]",
            ),
            ArrayFormat::new(
                "blocked",
                "(blocked, ...)",
                "where the hand or a finger met something else: which approach, what it is, point [m]",
            ),
            ArrayFormat::new(
                "approaches",
                "(approaches, ...)",
                "where each ended: pose of the hand, joint values, why it ended",
            ),
        ],
    ),
];
