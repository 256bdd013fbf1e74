//! The table of URDF. MuJoCo silently drops unknown statements; here each one needs a row.

use super::row::{
    Decision::{self, Honoured, HonouredUnless, Ignored},
    Row,
};

const FORCES: Decision = Ignored { reason: "no force and no mass decides which poses are reached" };
const TABLE: Decision = Ignored { reason: "the hand's table has speeds and gains" };
const STILL: Decision = Ignored { reason: "a container is fixed" };
const CAMERA: Decision = Ignored { reason: "the camera alone is read" };
const SHOWN: Decision = Ignored { reason: "it is only drawn" };
const OTHERS: Decision = Ignored { reason: "it speaks to another program" };
const NAME: Decision = Ignored { reason: "a name alone" };

const READ: [Decision; 4] = [Honoured, Honoured, Honoured, CAMERA];
const MOVES: [Decision; 4] = [Honoured, Honoured, STILL, CAMERA];

/// Elements that are ignored with all that they hold.
pub(super) const HOLDS_ANYTHING: &[&str] = &[
    "link/visual",
    "*/material",
    "robot/gazebo",
    "robot/transmission",
    "robot/ros2_control",
    "robot/sensor",
    "link/sensor",
    "joint/hardwareInterface",
];

const fn element(element: &'static str, example: &'static str, decisions: [Decision; 4]) -> Row {
    Row { element, attributes: "", example, decisions }
}

const fn attributes(element: &'static str, attributes: &'static str, decisions: [Decision; 4]) -> Row {
    Row { element, attributes, example: "", decisions }
}

/// Statements of URDF: single attributes before their elements.
pub(super) const ROWS: &[Row] = &[
    element("/robot", "", [NAME; 4]),
    element("robot/link", "", READ),
    element(
        "link/inertial",
        r#"<inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"#,
        [FORCES, Honoured, STILL, CAMERA],
    ),
    element("inertial/*", "", [FORCES, Honoured, STILL, CAMERA]),
    element("link/visual", r#"<visual><geometry><sphere radius="1"/></geometry></visual>"#, [SHOWN; 4]),
    element("link/collision", r#"<collision><geometry><sphere radius="0.1"/></geometry></collision>"#, READ),
    element("collision/geometry", "", READ),
    element("*/origin", "", READ),
    element("geometry/box", "", READ),
    element("geometry/sphere", "", READ),
    element("geometry/cylinder", "", READ),
    element("geometry/capsule", "", READ),
    element("geometry/mesh", "", READ),
    element("robot/joint", "", MOVES),
    element("joint/parent", "", READ),
    element("joint/child", "", READ),
    element("joint/axis", "", MOVES),
    attributes("joint/limit", r#"effort="0.01""#, [FORCES, Honoured, STILL, CAMERA]),
    attributes("joint/limit", r#"velocity="1""#, [FORCES, TABLE, STILL, CAMERA]),
    element("joint/limit", r#"<limit lower="-0.5" upper="0.5"/>"#, MOVES),
    Row {
        element: "joint/safety_controller",
        attributes: r#"k_position="1" k_velocity="1""#,
        example: r#"<safety_controller soft_lower_limit="-0.3" soft_upper_limit="1.35"/>"#,
        decisions: [FORCES, TABLE, STILL, CAMERA],
    },
    element(
        "joint/safety_controller",
        r#"<safety_controller soft_lower_limit="-0.3" soft_upper_limit="1.35"/>"#,
        MOVES,
    ),
    element(
        "joint/mimic",
        r#"<mimic joint="right"/>"#,
        [
            HonouredUnless {
                when: "a joint of the planning group is one of the two",
                remedy: "a map moves each joint by itself: take the joint out of the planning group, or the statement out of the file if \
                         the map may leave what follows where it is",
            },
            Honoured,
            STILL,
            CAMERA,
        ],
    ),
    element("joint/dynamics", r#"<dynamics damping="1" friction="1"/>"#, [FORCES, Honoured, STILL, CAMERA]),
    element("joint/calibration", r#"<calibration rising="0"/>"#, [OTHERS; 4]),
    element("joint/hardwareInterface", "<hardwareInterface/>", [OTHERS; 4]),
    element("*/material", r#"<material name="blue"><color rgba="0 0 1 1"/></material>"#, [SHOWN; 4]),
    element("robot/gazebo", "<gazebo><plugin name='any'/></gazebo>", [OTHERS; 4]),
    element("robot/transmission", r#"<transmission name="any"><type>any</type></transmission>"#, [OTHERS; 4]),
    element("robot/ros2_control", r#"<ros2_control name="any"/>"#, [OTHERS; 4]),
    element("robot/sensor", r#"<sensor name="any"/>"#, [OTHERS; 4]),
    element("link/sensor", r#"<sensor name="any"/>"#, [OTHERS; 4]),
    element("robot/mujoco", "", READ),
];
