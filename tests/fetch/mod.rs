//! The Fetch as the tests and benchmarks name its parts.

/// The joints of its arm, from the base outward.
pub const ARM: [&str; 7] = [
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "upperarm_roll_joint",
    "elbow_flex_joint",
    "forearm_roll_joint",
    "wrist_flex_joint",
    "wrist_roll_joint",
];
