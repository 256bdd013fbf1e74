//! The table of a hand as written.

use schemars::JsonSchema;
use serde::Deserialize;

/// The motors of a hand's joints, and where it touches.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct HandTableSpec {
    /// The frame in which grasps are expressed: origin on the palm, z towards what the hand grasps.
    pub approach: FrameSpec,
    /// The joints with motors, in the order in which postures name them.
    #[schemars(length(max = 100))]
    pub driven: Vec<DrivenSpec>,
    /// Where the hand may touch.
    #[serde(default)]
    #[schemars(length(max = 1000))]
    pub contacts: Vec<ContactSpec>,
    /// The names of two contacts whose distance is the hand's width.
    pub width: Option<[String; 2]>,
    /// The space in which postures are searched.
    pub eigengrasps: Option<EigengraspsSpec>,
}

/// A frame: a site of the description, or numbers in a body's frame.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct FrameSpec {
    /// A site of the description.
    pub site: Option<String>,
    /// A body of the description.
    pub body: Option<String>,
    /// Origin of the frame, expressed in the body's.
    #[schemars(extend("x-unit" = "m"))]
    pub position: Option<[f64; 3]>,
    /// Direction of its z axis, expressed in the body's frame.
    pub z: Option<[f64; 3]>,
    /// Direction of its x axis; what of it is along z does not count.
    pub x: Option<[f64; 3]>,
}

/// A joint with a motor.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct DrivenSpec {
    /// The joint of the description.
    pub joint: String,
    /// Name of the motor. Without it, the joint's.
    pub name: Option<String>,
    /// The joint's value in the opened hand.
    #[schemars(extend("x-unit" = "rad or m"))]
    pub opened: f64,
    /// The joint's value in the closed hand. Without it, the joint shapes the hand and does not close it.
    #[schemars(extend("x-unit" = "rad or m"))]
    pub closed: Option<f64>,
    /// Speed of the motor.
    #[schemars(extend("x-unit" = "rad/s or m/s", "exclusiveMinimum" = 0))]
    pub speed: f64,
    /// Load that stops the joint.
    #[schemars(extend("x-unit" = "N m or N", "exclusiveMinimum" = 0))]
    pub torque: f64,
    /// Load against its closing at which a stopped joint gives way: what its gears bear without the motor, at least `torque`.
    /// Without it, 1.25 times `torque`.
    #[schemars(extend("x-unit" = "N m or N", "exclusiveMinimum" = 0))]
    pub holding_torque: Option<f64>,
    /// A clutch between motor and joint.
    pub breakaway: Option<BreakawaySpec>,
}

impl DrivenSpec {
    /// Key and value of its name.
    pub fn name(&self) -> (&'static str, &str) {
        self.name.as_ref().map_or(("joint", &self.joint), |name| ("name", name))
    }
}

/// A clutch: when the joint is stopped it stays, and the motor moves only one of its followers.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct BreakawaySpec {
    /// The follower that moves on.
    pub joint: String,
    /// Motion per unit of the motor's; not 0.
    pub ratio: f64,
    /// Load that stops it.
    #[schemars(extend("x-unit" = "N m or N", "exclusiveMinimum" = 0))]
    pub torque: f64,
    /// Load at which it gives way once it is stopped, at least `torque`. Without it, 1.25 times `torque`.
    #[schemars(extend("x-unit" = "N m or N", "exclusiveMinimum" = 0))]
    pub holding_torque: Option<f64>,
}

/// A point that may touch: a site of the description, or numbers in a body's frame.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ContactSpec {
    /// A site of the description, its z axis out of the link.
    pub site: Option<String>,
    /// Name of the contact. Without it, the site's.
    pub name: Option<String>,
    /// A body of the description.
    pub body: Option<String>,
    /// The point, expressed in the body's frame.
    #[schemars(extend("x-unit" = "m"))]
    pub position: Option<[f64; 3]>,
    /// Direction out of the link, expressed in the body's frame.
    pub normal: Option<[f64; 3]>,
}

impl ContactSpec {
    /// Key and value of its name, where it has one.
    pub fn name(&self) -> Option<(&'static str, &str)> {
        let name = self.name.as_deref().map(|name| ("name", name));
        name.or_else(|| self.site.as_deref().map(|site| ("site", site)))
    }
}

/// A posture, and directions from it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct EigengraspsSpec {
    /// One value per driven joint [rad or m].
    #[schemars(length(max = 100))]
    pub origin: Vec<f64>,
    /// Directions, each with one value per driven joint.
    #[schemars(length(max = 100))]
    pub directions: Vec<Vec<f64>>,
}
