//! Bounds of a description. A few letters of XML can make MuJoCo allocate memory and run without limit, so counts,
//! sizes and nesting are checked before it compiles anything.
//!
//! [`BOUNDS`] is the only declaration: the check follows it, a test tries every row, and `docs/mjcf.md` prints it.

/// Most elements of a description with all that it includes and attaches, each counted as often as `replicate` and `attach` copy it.
/// Robots and hands have some hundred, the largest scenes some thousand.
pub const MAX_ELEMENTS: f64 = 20_000.0;

/// Most elements that enclose one element.
pub const MAX_DEPTH: usize = 200;

/// Most files that include or attach each other in a row.
pub const MAX_FILES_DEEP: usize = 16;

/// Most memory that sizes and counts in attributes may need [bytes].
pub const MAX_BYTES: f64 = 256.0 * 1024.0 * 1024.0;

/// A bound of an element or of its attributes.
#[derive(Clone, Copy, Debug)]
pub struct ElementBound {
    /// The element, as `section/element`, or `section/*` for all of a section.
    pub element: &'static str,
    /// Count, value or memory that is bounded.
    pub rule: Rule,
}

/// Count, value or memory that a [`ElementBound`] limits.
#[derive(Clone, Copy, Debug)]
pub enum Rule {
    /// The number of such elements, copies included.
    Count {
        /// Largest number.
        most: f64,
    },
    /// Each number of an attribute.
    Value {
        /// The attribute.
        attribute: &'static str,
        /// Smallest and largest number.
        range: [f64; 2],
    },
    /// The product of all numbers of an attribute, which makes as many elements.
    Copies {
        /// The attribute.
        attribute: &'static str,
        /// Largest product.
        most: f64,
    },
    /// Number of numbers in an attribute.
    Numbers {
        /// The attribute.
        attribute: &'static str,
        /// Largest number of numbers.
        most: usize,
    },
    /// The product of the numbers of attributes; each unit takes memory. All rows share [`MAX_BYTES`].
    Memory {
        /// The attributes.
        attributes: &'static [&'static str],
        /// Memory of a unit [bytes].
        unit: f64,
    },
}

/// The element that copies its content.
pub(super) const REPLICATE: &str = "body/replicate";

const fn count(element: &'static str, most: f64) -> ElementBound {
    ElementBound { element, rule: Rule::Count { most } }
}

const fn at_most(element: &'static str, attribute: &'static str, most: f64) -> ElementBound {
    ElementBound { element, rule: Rule::Value { attribute, range: [f64::NEG_INFINITY, most] } }
}

const fn within(element: &'static str, attribute: &'static str, range: [f64; 2]) -> ElementBound {
    ElementBound { element, rule: Rule::Value { attribute, range } }
}

const fn copies(element: &'static str, attribute: &'static str, most: f64) -> ElementBound {
    ElementBound { element, rule: Rule::Copies { attribute, most } }
}

const fn numbers(element: &'static str, attribute: &'static str, most: usize) -> ElementBound {
    ElementBound { element, rule: Rule::Numbers { attribute, most } }
}

const fn memory(element: &'static str, attributes: &'static [&'static str], unit: f64) -> ElementBound {
    ElementBound { element, rule: Rule::Memory { attributes, unit } }
}

/// Every bound. The cost of each element was found by setting each number of MuJoCo's schema to a million and to a
/// billion, and each element a hundred thousand times.
pub const BOUNDS: &[ElementBound] = &[
    // Time grows with the square of these counts, memory with the square of the constraints.
    count("keyframe/key", 1000.0),
    count("body/joint", 1000.0),
    count("body/freejoint", 1000.0),
    count("body/geom", 5000.0),
    count("equality/*", 1000.0),
    count("contact/pair", 10_000.0),
    count("default/default", 1000.0),
    // Copies.
    within(REPLICATE, "count", [1.0, 1000.0]),
    copies("body/composite", "count", 1000.0),
    copies("body/flexcomp", "count", 1000.0),
    at_most("body/flexcomp", "cellcount", 100.0),
    at_most("deformable/flex", "cellcount", 100.0),
    at_most("composite/skin", "subgrid", 10.0),
    // Files that hold no data but sizes.
    at_most("asset/hfield", "nrow", 2048.0),
    at_most("asset/hfield", "ncol", 2048.0),
    memory("asset/hfield", &["nrow", "ncol"], 16.0),
    at_most("asset/texture", "width", 4096.0),
    at_most("asset/texture", "height", 24_576.0),
    at_most("asset/texture", "nchannel", 4.0),
    // Six sides of a cube, three channels.
    memory("asset/texture", &["width", "height"], 18.0),
    at_most("asset/mesh", "params", 256.0),
    at_most("body/camera", "resolution", 16_384.0),
    // Data stored with the state.
    at_most("mujoco/size", "nuser_*", 100.0),
    at_most("mujoco/size", "nuserdata", 10_000.0),
    at_most("mujoco/size", "nkey", 1000.0),
    numbers("*/*", "user", 100),
    at_most("custom/numeric", "size", 500.0),
    at_most("sensor/user", "dim", 1000.0),
    memory("sensor/user", &["dim"], 24.0),
    at_most("sensor/*", "nsample", 1000.0),
    memory("sensor/*", &["nsample"], 512.0),
    at_most("sensor/contact", "num", 1000.0),
    memory("sensor/contact", &["num"], 512.0),
    at_most("actuator/*", "nsample", 1000.0),
    memory("actuator/*", &["nsample"], 64.0),
    at_most("actuator/general", "actdim", 1000.0),
    at_most("actuator/plugin", "actdim", 1000.0),
    // Work in each step.
    at_most("mujoco/option", "iterations", 10_000.0),
    at_most("mujoco/option", "ls_iterations", 10_000.0),
    at_most("mujoco/option", "noslip_iterations", 10_000.0),
    at_most("mujoco/option", "ccd_iterations", 10_000.0),
    at_most("mujoco/option", "sdf_iterations", 1000.0),
    at_most("mujoco/option", "sdf_initpoints", 1000.0),
];
