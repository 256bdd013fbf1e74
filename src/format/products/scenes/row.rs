//! The row of scenes in the table of products.

use super::{SceneOverview, facts::FACTS};
use crate::{ArrayFormat, ChannelFormat, ExtraFile, Noun, ProductFormat, products::grasps::SHAPES};

const SCHEMAS: &[u8] = include_bytes!("../../generated/scenes.bin");

/// The row of scenes in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "scenes",
    summary: "Bodies dropped or put down and settled on their true meshes, in a bin or on a plane.",
    samples: Noun { one: "scene", many: "scenes" },
    subjects: Noun { one: "split", many: "splits" },
    subjects_are_objects: false,
    subject_meaning: "The digest of container, mode and split, 64 hexadecimal digits.",
    item_meaning: "Number of the scene in its split.",
    has_instances: false,
    channels: &[
        ChannelFormat::new(
            "/scenes/scene",
            "graspmill.Scene",
            SCHEMAS,
            &[
                ArrayFormat::new("world_from_object", "(bodies, 12) f64", "pose of each body by rows [m]"),
                ArrayFormat::new("masses", "(bodies) f64", "mass of each body [kg]"),
                ArrayFormat::new("touch_points", "(contacts, 3) f64", "points at which two bodies touch [m]"),
                ArrayFormat::new("touch_forces", "(contacts, 3) f64", "force of the lower body on the higher [N]"),
                ArrayFormat::new(
                    "touch_torques",
                    "(contacts, 3) f64",
                    "torque of the lower body on the higher about the point, by torsion and rolling friction [N m]",
                ),
                ArrayFormat::new("centres_of_mass", "(bodies, 3) f64", "centre of mass of each body, in the world [m]"),
                ArrayFormat::new("shares", "(supports) f64", "share of a body's weight that another carries"),
            ],
        ),
        ChannelFormat::new(
            "/scenes/overview",
            "graspmill.SceneOverview",
            SCHEMAS,
            &[
                ArrayFormat::new(
                    "instances",
                    "(height, width) u8",
                    "body in front, from above: 0 floor, 255 container",
                ),
                ArrayFormat::new("depths", "(height, width) u16", "depth from above [0.1 mm], 0 where nothing is"),
            ],
        )
        .decoded_by(|payload| SceneOverview::decode(payload).map(|overview| overview.sample)),
    ],
    facts: &FACTS,
    has_splits: true,
    inherits_splits: false,
    files: &[ExtraFile { name: SHAPES, meaning: "Meshes of the objects." }],
};
