//! The table of MJCF.

use super::row::{
    Decision::{self, Honoured, HonouredUnless, Ignored, IgnoredUnless, Only, Refused},
    Row,
};

/// A map is kinematics.
const FORCES: Decision = Ignored { reason: "no force and no mass decides which poses are reached" };
/// Nothing in a container moves.
const STILL: Decision = Ignored { reason: "a container is fixed" };
/// The camera of a scene is read, nothing else.
const CAMERA: Decision = Ignored { reason: "the camera alone is read" };
const SHOWN: Decision = Ignored { reason: "it is only drawn" };
const NAME: Decision = Ignored { reason: "a name alone" };
const USER: Decision = Ignored { reason: "nothing reads it" };
/// Actuators of the file are switched off.
const SERVOS: Decision = Ignored { reason: "the simulation adds its own servo for each joint, from the hand's table" };
/// Options that the simulation of a hand sets.
const OWN: Decision = Ignored { reason: "the simulation of a hand has its own" };
const UNUSED: Decision = Ignored { reason: "it does not affect what is read" };
const SIZED: Decision = Ignored { reason: "memory is sized by what the model needs" };
const ALWAYS: Decision = Ignored { reason: "the simulation of a hand always has it on" };

const PLUGIN: Decision = Refused { remedy: "no plugin is loaded: take it out" };
const SOFT: Decision = Refused { remedy: "soft bodies are not understood: use rigid geoms" };

const fn all(decision: Decision) -> [Decision; 4] {
    [decision; 4]
}

/// An element with all attributes that no other row names.
const fn element(element: &'static str, example: &'static str, decisions: [Decision; 4]) -> Row {
    Row { element, attributes: "", example, decisions }
}

/// Attributes of an element, each with a value that makes a difference.
const fn attributes(element: &'static str, attributes: &'static str, decisions: [Decision; 4]) -> Row {
    Row { element, attributes, example: "", decisions }
}

/// Attributes of an element that make a difference only with other attributes.
const fn attributes_beside(
    element: &'static str,
    attributes: &'static str,
    example: &'static str,
    decisions: [Decision; 4],
) -> Row {
    Row { element, attributes, example, decisions }
}

/// Equalities and tendons of a robot, ignored as long as they tie fixed parts.
const fn tie_of_robot(remedy: &'static str) -> Decision {
    IgnoredUnless {
        reason: "the parts that it ties are fixed",
        when: "it ties parts that the joints of the planning group move against each other",
        remedy,
    }
}

const CHAIN: &str = "a map moves each joint by itself: take the statement out if the map may do so";

const fn tie_of_hand(remedy: &'static str) -> Decision {
    IgnoredUnless { reason: "what it ties does not move", when: "it ties links that move against each other", remedy }
}

const FOLLOW: &str = "write each joint that follows as <equality><joint joint1=\"FOLLOWER\" joint2=\"DRIVEN\" \
                      polycoef=\"OFFSET RATIO 0 0 0\"/>, drive the other in the table, and take this out (docs/hands.md)";

const TENDON_OF_ROBOT: Decision = IgnoredUnless {
    reason: "without limits it is a force",
    when: "it limits or ties joints of the planning group",
    remedy: CHAIN,
};

const TENDON_OF_HAND: Decision = IgnoredUnless {
    reason: "it measures a length",
    when: "it moves, ties, limits or loads joints of the hand",
    remedy: FOLLOW,
};

/// Statements of MJCF: single attributes before their elements.
pub(super) const ROWS: &[Row] = &[
    element("/mujoco", "", all(NAME)),
    element("*/include", "", all(Honoured)),
    // How the rest is understood.
    attributes("mujoco/compiler", r#"angle="radian" eulerseq="zyx""#, all(Honoured)),
    attributes("mujoco/compiler", r#"autolimits="false""#, all(Honoured)),
    attributes(
        "mujoco/compiler",
        r#"assetdir="other" meshdir="other" strippath="true""#,
        [Honoured, Honoured, Honoured, CAMERA],
    ),
    attributes("mujoco/compiler", r#"fitaabb="true""#, [Honoured, Honoured, Honoured, CAMERA]),
    attributes("mujoco/compiler", r#"fusestatic="true""#, [Honoured, Honoured, Honoured, CAMERA]),
    attributes("mujoco/compiler", r#"discardvisual="true""#, [SHOWN, Honoured, SHOWN, SHOWN]),
    attributes("mujoco/compiler", r#"texturedir="other""#, all(SHOWN)),
    attributes(
        "mujoco/compiler",
        r#"balanceinertia="" boundinertia="1" boundmass="1" inertiafromgeom="true" inertiagrouprange="" settotalmass="2""#,
        [FORCES, Honoured, STILL, CAMERA],
    ),
    attributes(
        "mujoco/compiler",
        r#"alignfree="true" conflict="merge" coordinate="local" passthrough="textures" savecanonical="true" savecompiled="true" saveinertial="true" usethread="false""#,
        all(UNUSED),
    ),
    element("mujoco/compiler", "", all(UNUSED)),
    element("compiler/lengthrange", r#"<lengthrange mode="all" inttotal="1"/>"#, all(SERVOS)),
    // The engine.
    attributes(
        "mujoco/option",
        r#"density="1" viscosity="1" wind="1 0 0""#,
        [
            FORCES,
            Only { values: &["0"], remedy: "trials of grasps are without air and water: take it out" },
            STILL,
            CAMERA,
        ],
    ),
    attributes(
        "mujoco/option",
        r#"timestep="0.01" integrator="RK4" gravity="0 0 1" cone="pyramidal" impratio="3" noslip_iterations="9" actuatorgroupdisable="1""#,
        [FORCES, OWN, STILL, CAMERA],
    ),
    attributes(
        "mujoco/option",
        r#"iterations="1" tolerance="1" solver="CG" jacobian="sparse" ls_tolerance="0.1" noslip_tolerance="1e-3""#,
        [FORCES, Honoured, STILL, CAMERA],
    ),
    attributes(
        "mujoco/option",
        r#"ccd_iterations="7" ccd_tolerance="1e-3" ls_iterations="40" magnetic="1 0 0" o_friction="1" o_margin="1" o_solimp="0.5" o_solref="0.1" sdf_initpoints="4" sdf_iterations="4" sleep_tolerance="1""#,
        all(UNUSED),
    ),
    element("mujoco/option", "", all(UNUSED)),
    attributes("option/flag", r#"filterparent="disable""#, [Honoured, Honoured, STILL, CAMERA]),
    attributes(
        "option/flag",
        r#"constraint="disable" gravity="disable""#,
        [FORCES, Only { values: &["enable"], remedy: "trials of grasps need it: take it out" }, STILL, CAMERA],
    ),
    attributes(
        "option/flag",
        r#"override="enable" sleep="enable""#,
        [
            FORCES,
            Only { values: &["disable"], remedy: "the simulation of a hand has its own contacts: remove it" },
            STILL,
            CAMERA,
        ],
    ),
    attributes(
        "option/flag",
        r#"ipc="enable""#,
        all(Only { values: &["disable"], remedy: "soft bodies are not understood: take it out" }),
    ),
    attributes(
        "option/flag",
        r#"contact="disable" actuation="disable" limit="disable" sensor="disable""#,
        [Ignored { reason: "`collisions` of the job decides what collides" }, ALWAYS, STILL, CAMERA],
    ),
    attributes(
        "option/flag",
        r#"damper="disable" spring="disable" frictionloss="disable" warmstart="disable" diagexact="enable" island="disable" midphase="disable""#,
        [FORCES, Honoured, STILL, CAMERA],
    ),
    attributes(
        "option/flag",
        r#"autoreset="disable" clampctrl="disable" energy="enable" equality="disable" eulerdamp="disable" fwdinv="enable" invdiscrete="enable" multiccd="enable" nativeccd="disable" refsafe="disable""#,
        all(UNUSED),
    ),
    element("option/flag", "", all(UNUSED)),
    attributes(
        "mujoco/size",
        r#"memory="1M" nconmax="99" njmax="99" nkey="3" nstack="99" nuser_actuator="1" nuser_body="1" nuser_cam="1" nuser_geom="1" nuser_jnt="1" nuser_sensor="1" nuser_site="1" nuser_tendon="1" nuserdata="4""#,
        all(SIZED),
    ),
    element("mujoco/size", "", all(SIZED)),
    attributes("mujoco/statistic", r#"extent="3""#, [UNUSED, UNUSED, STILL, Honoured]),
    element(
        "mujoco/statistic",
        r#"<statistic center="1 1 1" meaninertia="9" meanmass="3" meansize="2"/>"#,
        all(UNUSED),
    ),
    attributes("visual/map", r#"znear="0.2""#, [SHOWN, SHOWN, SHOWN, Honoured]),
    element("mujoco/visual", r#"<visual><global fovy="20"/></visual>"#, all(SHOWN)),
    element("visual/*", r#"<quality shadowsize="9"/>"#, all(SHOWN)),
    // Defaults: each is the element that it is a default of.
    element("mujoco/default", "", all(Honoured)),
    element("default/default", r#"<default class="of no element"/>"#, all(UNUSED)),
    element("mujoco/extension", "", all(Honoured)),
    element("extension/plugin", r#"<plugin plugin="mujoco.none"/>"#, all(PLUGIN)),
    element("*/plugin", r#"<plugin plugin="mujoco.none"/>"#, all(PLUGIN)),
    element("plugin/*", "", all(PLUGIN)),
    element("instance/config", "", all(PLUGIN)),
    // Assets.
    element("mujoco/asset", "", all(Honoured)),
    attributes(
        "asset/mesh",
        r#"file="other.obj" scale="2 1 1" refpos="0 0 1" refquat="1 1 0 0""#,
        [Honoured, Honoured, Honoured, CAMERA],
    ),
    attributes("asset/mesh", r#"inertia="shell""#, [Honoured, Honoured, Honoured, CAMERA]),
    attributes(
        "asset/mesh",
        r#"vertex="0 0 0 1 0 0 0 1 0 0 0 1" face="" builtin="" params="""#,
        [
            HonouredUnless {
                when: "a geom that can collide shows it",
                remedy: "write the mesh to an STL, OBJ, PLY or OFF file and name that",
            },
            Honoured,
            HonouredUnless {
                when: "a geom that can collide shows it",
                remedy: "write the mesh to an STL, OBJ, PLY or OFF file and name that",
            },
            CAMERA,
        ],
    ),
    attributes(
        "asset/mesh",
        r#"content_type="model/stl""#,
        all(IgnoredUnless {
            reason: "the file's ending is its format",
            when: "it is another format than the file's ending",
            remedy: "give the file the ending of its format, and leave this out",
        }),
    ),
    attributes(
        "asset/mesh",
        r#"maxhullvert="8" smoothnormal="true" normal="0 0 1" texcoord="" material="paint""#,
        [
            Ignored { reason: "the triangles of the file count; hulls count with collisions = \"mujoco\" alone" },
            SHOWN,
            SHOWN,
            CAMERA,
        ],
    ),
    element("asset/mesh", "", [Honoured, Honoured, Honoured, CAMERA]),
    element("asset/hfield", r#"<hfield name="hills" nrow="3" ncol="3" size="1 1 1 1"/>"#, all(UNUSED)),
    element("asset/texture", r#"<texture name="paint" type="2d" builtin="flat" width="4" height="4"/>"#, all(SHOWN)),
    element("asset/material", r#"<material name="shine" specular="1"/>"#, all(SHOWN)),
    element("material/layer", "", all(SHOWN)),
    element("asset/model", "", all(Honoured)),
    element(
        "asset/skin",
        r#"<skin vertex="0 0 0 1 0 0 0 1 0" face="0 1 2"><bone body="left" bindpos="0 0 0" bindquat="1 0 0 0" vertid="0 1 2" vertweight="1 1 1"/></skin>"#,
        all(SHOWN),
    ),
    element("*/skin", "", all(SHOWN)),
    element("skin/bone", "", all(SHOWN)),
    // Bodies.
    element("mujoco/worldbody", "", all(Honoured)),
    attributes(
        "body/body",
        r#"pos="0 0.031 0.02" quat="1 0.1 0 0" axisangle="1 0 0 9" euler="9 0 0" xyaxes="1 0 0 0 1 0.1" zaxis="0 0.1 1""#,
        [Honoured, Honoured, Honoured, CAMERA],
    ),
    attributes("body/body", r#"name="renamed" childclass="thick""#, [Honoured, Honoured, Honoured, CAMERA]),
    attributes("body/body", r#"gravcomp="1""#, [FORCES, Honoured, STILL, CAMERA]),
    attributes("body/body", r#"fuse="false" simple="false" sleep="never" user="1""#, all(UNUSED)),
    attributes("body/body", r#"mocap="true""#, all(Ignored { reason: "a mocap body stays where the file has it" })),
    element("body/body", "", [Honoured, Honoured, Honoured, CAMERA]),
    element(
        "body/frame",
        r#"<frame pos="0 0 0.5"><geom size="0.01"/></frame>"#,
        [Honoured, Honoured, Honoured, CAMERA],
    ),
    element(
        "body/replicate",
        r#"<replicate count="2" offset="0 0 0.1"><geom pos="0 0 0.5" size="0.01"/></replicate>"#,
        [Honoured, Honoured, Honoured, CAMERA],
    ),
    element("body/attach", "", [Honoured, Honoured, Honoured, CAMERA]),
    element(
        "body/inertial",
        r#"<inertial pos="0 0 0.02" mass="0.3" diaginertia="1e-3 1e-3 1e-3"/>"#,
        [FORCES, Honoured, STILL, CAMERA],
    ),
    attributes(
        "body/joint",
        r#"type="slide" axis="1 0.2 0" pos="0 0 0.01" range="-30 60" limited="false" ref="5""#,
        [Honoured, Honoured, STILL, CAMERA],
    ),
    attributes("body/joint", r#"name="renamed" class="slow""#, [Honoured, Honoured, STILL, CAMERA]),
    attributes(
        "body/joint",
        r#"armature="0.5" damping="0.5" frictionloss="0.3" stiffness="3" springdamper="0.1 1" actuatorfrcrange="-0.01 0.01" margin="9""#,
        [FORCES, Honoured, STILL, CAMERA],
    ),
    attributes_beside("body/joint", r#"springref="50""#, r#"stiffness="3""#, [FORCES, Honoured, STILL, CAMERA]),
    attributes_beside(
        "body/joint",
        r#"solreffriction="0.5 1" solimpfriction="0.1 0.2 0.1""#,
        r#"frictionloss="0.3""#,
        [FORCES, Honoured, STILL, CAMERA],
    ),
    attributes_beside(
        "body/joint",
        r#"solreflimit="0.5 1" solimplimit="0.1 0.2 0.1""#,
        r#"margin="9""#,
        [FORCES, Honoured, STILL, CAMERA],
    ),
    attributes_beside(
        "body/joint",
        r#"actuatorfrclimited="false""#,
        r#"actuatorfrcrange="-0.01 0.01""#,
        [FORCES, Honoured, STILL, CAMERA],
    ),
    attributes("body/joint", r#"actuatorgravcomp="true" group="2" user="1""#, all(UNUSED)),
    element("body/joint", "", [Honoured, Honoured, STILL, CAMERA]),
    element("body/freejoint", "", all(Ignored { reason: "what floats stays where the file has it" })),
    attributes(
        "body/geom",
        r#"size="0.009 0.03" pos="0 0.001 0.03" quat="1 0.1 0 0" axisangle="1 0 0 9" euler="9 0 0" xyaxes="1 0 0 0 1 0.1" zaxis="0 0.1 1" fromto="0 0 0 0 0 0.06" class="thick""#,
        [Honoured, Honoured, Honoured, CAMERA],
    ),
    attributes_beside("body/geom", r#"contype="0""#, r#"conaffinity="0""#, [Honoured, Honoured, Honoured, CAMERA]),
    attributes_beside(
        "body/geom",
        r#"conaffinity="2""#,
        r#"contype="2""#,
        [
            Honoured,
            HonouredUnless {
                when: "it can touch, but not what has contype 1 and conaffinity 1, as objects have",
                remedy: "set the lowest bit of its contype or conaffinity, or both to 0",
            },
            STILL,
            CAMERA,
        ],
    ),
    attributes_beside(
        "body/geom",
        r#"type="ellipsoid""#,
        r#"size="0.008 0.02 0.02""#,
        [
            HonouredUnless {
                when: "it can collide and is a plane, an ellipsoid, a height field or a distance field",
                remedy: "use a box, a sphere, a capsule, a cylinder or a mesh",
            },
            HonouredUnless {
                when: "it can collide and is a plane, an ellipsoid, a height field or a distance field",
                remedy: "use a box, a sphere, a capsule or a cylinder",
            },
            HonouredUnless {
                when: "it can collide and is round, a plane, a height field or a distance field",
                remedy: "use a box or a mesh",
            },
            CAMERA,
        ],
    ),
    attributes("body/geom", r#"mesh="other""#, [Honoured, Honoured, Honoured, CAMERA]),
    attributes("body/geom", r#"fitscale="2""#, [Honoured, Honoured, Honoured, CAMERA]),
    attributes("body/geom", r#"hfield="""#, all(UNUSED)),
    attributes("body/geom", r#"mass="0.2" density="9" shellinertia="true""#, [FORCES, Honoured, STILL, CAMERA]),
    attributes("body/geom", r#"friction="5 0.1 0.1" condim="6""#, [FORCES, Honoured, STILL, CAMERA]),
    attributes(
        "body/geom",
        r#"solref="0.1 1" solimp="0.1 0.2 0.1" solmix="3" priority="5""#,
        [FORCES, OWN, STILL, CAMERA],
    ),
    attributes(
        "body/geom",
        r#"margin="0.01" gap="0.01""#,
        [
            Ignored { reason: "solids touch where they meet" },
            Only { values: &["0"], remedy: "solids touch where they meet: make the geom larger, or take it out" },
            STILL,
            CAMERA,
        ],
    ),
    attributes(
        "body/geom",
        r#"adhesion="1" surfacevel="1 0 0 0 0 0""#,
        [FORCES, Only { values: &["0"], remedy: "suction and belts are not understood: take it out" }, STILL, CAMERA],
    ),
    attributes(
        "body/geom",
        r#"fluidcoef="1 1 1 1 1" fluidshape="ellipsoid" group="2" material="paint" name="renamed" rgba="1 0 0 1" user="1""#,
        all(UNUSED),
    ),
    element("body/geom", r#"<geom size="0.01" pos="0 0 0.5"/>"#, [Honoured, Honoured, Honoured, CAMERA]),
    attributes(
        "body/site",
        r#"pos="0 -0.007 0.03" quat="1 0 0.1 0" axisangle="0 1 0 9" euler="9 0 0" xyaxes="1 0.1 0 0 0 1"  zaxis="0 -1 0.1" class="""#,
        [Honoured, Honoured, STILL, CAMERA],
    ),
    attributes_beside(
        "body/site",
        r#"fromto="0 0 0 0 0.1 0.1""#,
        r#"type="capsule" size="0.001 0.001""#,
        [Honoured, Honoured, STILL, CAMERA],
    ),
    attributes("body/site", r#"name="renamed""#, [Honoured, Honoured, STILL, CAMERA]),
    attributes(
        "body/site",
        r#"group="2" material="paint" mesh="" rgba="1 0 0 1" size="0.1" type="box" user="1""#,
        all(UNUSED),
    ),
    element("body/site", "", [Honoured, Honoured, STILL, CAMERA]),
    attributes(
        "body/camera",
        r#"pos="0.5 0 0.4" quat="1 0 0.1 0" axisangle="0 1 0 9" euler="9 0 0" xyaxes="1 0.1 0 0 0 1" zaxis="0 -1 0.1"  fovy="40" resolution="80 48" class="""#,
        [UNUSED, UNUSED, STILL, Honoured],
    ),
    attributes_beside("body/camera", r#"mode="targetbody""#, r#"target="left""#, [UNUSED, UNUSED, STILL, Honoured]),
    attributes("body/camera", r#"target="""#, [UNUSED, UNUSED, STILL, Honoured]),
    attributes_beside(
        "body/camera",
        r#"focal="0.005 0.004" focalpixel="40 40" principal="1e-4 0" principalpixel="3 0" sensorsize="0.006 0.005""#,
        r#"sensorsize="0.005 0.004" focal="0.004 0.004""#,
        [UNUSED, UNUSED, STILL, Honoured],
    ),
    attributes(
        "body/camera",
        r#"projection="orthographic""#,
        [
            UNUSED,
            UNUSED,
            STILL,
            HonouredUnless { when: "it is not `perspective`", remedy: "a perspective camera is needed" },
        ],
    ),
    attributes("body/camera", r#"name="renamed""#, [UNUSED, UNUSED, STILL, Honoured]),
    attributes("body/camera", r#"ipd="1" output="depth" user="1""#, all(UNUSED)),
    element("body/camera", r#"<camera name="more"/>"#, all(UNUSED)),
    element("body/light", r#"<light pos="0 0 1"/>"#, all(SHOWN)),
    // Made of many bodies.
    element(
        "body/composite",
        r#"<composite type="cable" curve="s" count="4 1 1" size="1 0 0" prefix="c"><joint kind="main"/><geom type="capsule" size="0.01"/></composite>"#,
        [Honoured, Refused { remedy: "a hand has hinges and slides: write its bodies one by one" }, Honoured, CAMERA],
    ),
    element("composite/*", "", all(Honoured)),
    element(
        "body/flexcomp",
        r#"<flexcomp name="cloth" type="grid" count="2 2 1" dim="2" spacing="0.1 0.1 0.1" radius="0.001" pos="0 0 0.5"/>"#,
        [SOFT, SOFT, SOFT, CAMERA],
    ),
    element("flexcomp/*", "", [SOFT, SOFT, SOFT, CAMERA]),
    element("mujoco/deformable", "", all(Honoured)),
    element(
        "deformable/flex",
        r#"<flex name="sheet" dim="2" body="left" vertex="0 0 0 1 0 0 0 1 0" element="0 1 2"/>"#,
        [SOFT, SOFT, SOFT, CAMERA],
    ),
    element("flex/*", "", [SOFT, SOFT, SOFT, CAMERA]),
    // Contacts.
    element("mujoco/contact", "", all(Honoured)),
    element("contact/exclude", r#"<exclude body1="left" body2="right"/>"#, [Honoured, Honoured, STILL, CAMERA]),
    element(
        "contact/pair",
        r#"<pair geom1="left" geom2="right"/>"#,
        [
            Refused { remedy: "select the geoms that may touch by contype, conaffinity and <contact><exclude>" },
            Refused { remedy: "select the geoms that may touch by contype, conaffinity and <contact><exclude>" },
            Refused { remedy: "select the geoms that may touch by contype and conaffinity" },
            CAMERA,
        ],
    ),
    // Ties.
    element("mujoco/tendon", "", all(Honoured)),
    element(
        "tendon/fixed",
        r#"<fixed name="cable" limited="true" range="-1 1"><joint joint="left" coef="1"/></fixed>"#,
        [TENDON_OF_ROBOT, TENDON_OF_HAND, STILL, CAMERA],
    ),
    element(
        "tendon/spatial",
        r#"<spatial name="string" limited="true" range="0 1"><site site="approach"/><site site="left_pad"/></spatial>"#,
        [TENDON_OF_ROBOT, TENDON_OF_HAND, STILL, CAMERA],
    ),
    element("default/tendon", "", all(Honoured)),
    element("fixed/joint", "", all(Honoured)),
    element("spatial/*", "", all(Honoured)),
    element("mujoco/equality", "", all(Honoured)),
    element("default/equality", "", all(Honoured)),
    element(
        "equality/joint",
        r#"<joint joint1="left" joint2="right" polycoef="0 1 1 0 0"/>"#,
        [
            HonouredUnless {
                when: "a joint of the planning group is one of the two",
                remedy: "a map moves each joint by itself: take the joint out of the planning group, or the statement out of the file if \
                         the map may leave what follows where it is",
            },
            HonouredUnless {
                when: "it is curved, holds one joint, or makes a joint follow two or one that follows",
                remedy: "only polycoef=\"OFFSET RATIO 0 0 0\" is read",
            },
            STILL,
            CAMERA,
        ],
    ),
    element(
        "equality/connect",
        r#"<connect body1="left" body2="palm" anchor="0 0 0.01"/>"#,
        [tie_of_robot(CHAIN), tie_of_hand(FOLLOW), STILL, CAMERA],
    ),
    element(
        "equality/weld",
        r#"<weld body1="left" body2="palm"/>"#,
        [
            tie_of_robot("take out the joint that does not move, or the statement"),
            tie_of_hand("take out the joint that does not move, and this"),
            STILL,
            CAMERA,
        ],
    ),
    element("equality/tendon", "", [tie_of_robot(CHAIN), tie_of_hand(FOLLOW), STILL, CAMERA]),
    element("equality/flex", "", [SOFT, SOFT, SOFT, CAMERA]),
    element("equality/flexvert", "", [SOFT, SOFT, SOFT, CAMERA]),
    element("equality/flexstrain", "", [SOFT, SOFT, SOFT, CAMERA]),
    // Motors.
    element("mujoco/actuator", "", all(Honoured)),
    attributes_beside(
        "actuator/*",
        r#"armature="0.5" damping="0.5""#,
        r#"<motor name="own" joint="left"/>"#,
        [FORCES, Honoured, STILL, CAMERA],
    ),
    element(
        "actuator/adhesion",
        r#"<adhesion body="left" ctrlrange="0 1"/>"#,
        [FORCES, Refused { remedy: "suction is not understood: take it out" }, STILL, CAMERA],
    ),
    element("actuator/*", r#"<motor joint="left" gear="5"/>"#, [FORCES, SERVOS, STILL, CAMERA]),
    // Measurements and notes.
    element("mujoco/sensor", "", all(Honoured)),
    attributes_beside(
        "sensor/rangefinder",
        r#"camera="eye""#,
        r#"<rangefinder site="approach"/>"#,
        all(Refused { remedy: "it would cast a ray for each pixel, and nothing reads it: take it out" }),
    ),
    element("sensor/touch", r#"<touch name="felt" site="left_pad"/>"#, [UNUSED, Honoured, STILL, CAMERA]),
    element("sensor/*", r#"<jointpos joint="left"/>"#, all(USER)),
    element("mujoco/custom", "", all(USER)),
    element("custom/*", r#"<numeric name="version" data="3"/>"#, all(USER)),
    element("tuple/element", "", all(USER)),
    element("mujoco/keyframe", "", all(Honoured)),
    attributes_beside("keyframe/key", r#"qpos="0.1 0""#, r#"name="home""#, [Honoured, UNUSED, STILL, CAMERA]),
    element("keyframe/key", r#"<key name="other" time="1"/>"#, all(UNUSED)),
];
