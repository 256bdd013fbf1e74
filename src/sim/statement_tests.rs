//! Every row of the table of statements is tried, in a description that is the same otherwise.

use std::{collections::BTreeMap, fs, path::Path, sync::Arc};

use kernel::{description::Format, geom::Shape};

use nalgebra::IsometryMatrix3;
use robot::collision::Geometry;

use crate::{
    HandError, HandModel, HandSim, HandWorker, RobotError, RobotModel, TrialConditions, TrialSim, TrialWorker, Verdict,
    mass_of_volume, scene_camera,
    statements::{Decision, Row, Usage, rows},
    trial::usable::{mass_of_small_box, small_box},
};

/// A gripper of two fingers with a camera and a part that is only drawn or can collide, depending on `SHOWN`.
const MJCF: &str = r#"<mujoco model="base">
  <compiler angle="degree" autolimits="true"/>
  <option timestep="0.002"><flag energy="disable"/></option>
  <size nkey="1"/>
  <statistic extent="1"/>
  <visual><map zfar="50"/></visual>
  <default>
    <default class="thick"><geom quat="1 0.1 0 0"/></default>
    <default class="slow"><joint pos="0 0 0.01" damping="0.9"/></default>
  </default>
  <asset>
    <mesh name="wedge" file="sub/wedge.obj"/>
    <mesh name="other" file="sub/other.obj"/>
    <material name="paint"/>
  </asset>
  <worldbody>
    <camera name="eye" pos="0.5 0 0.5" euler="10 20 0" resolution="64 48"/>
    <body name="palm" pos="0 0 0.01">
      <geom name="palm" type="box" size="0.03 0.05 0.01" mass="0.4"/>
      <site name="approach" pos="0 0 0.02"/>
      <body name="left" pos="0 0.03 0.02">
        <joint name="left" axis="1 0 0" range="-20 80"/>
        <geom name="left" type="capsule" size="0.008 0.02" pos="0 0 0.03"/>
        <geom name="shown" type="mesh" mesh="wedge" pos="0.02 0 0.03" mass="0.1" SHOWN/>
        <site name="left_pad" pos="0 -0.008 0.04" zaxis="0 -1 0"/>
        <body name="left_tip" pos="0 0 0.06">
          <joint name="left_tip" axis="1 0 0" range="-5 40"/>
          <geom type="sphere" size="0.007" mass="0.01"/>
        </body>
      </body>
      <body name="right" pos="0 -0.03 0.02">
        <joint name="right" axis="-1 0 0" range="-20 80" damping="0.02" stiffness="0.1" frictionloss="0.01"/>
        <geom name="right" type="capsule" size="0.008 0.02" pos="0 0 0.03" euler="3 2 0"/>
        <site name="right_pad" pos="0 0.008 0.04" zaxis="0 1 0"/>
      </body>
    </body>
    <body name="post" pos="0 0 0.7"><geom name="fitted" type="box" mesh="wedge"/></body>
  </worldbody>
  <keyframe><key name="home"/></keyframe>
</mujoco>
"#;

const TABLE: &str = r#"
approach = { site = "approach" }
contacts = [
  { site = "left_pad" },
  { site = "right_pad" },
  { name = "palm", body = "palm", position = [0.0, 0.0, 0.01], normal = [0.0, 0.0, 1.0] },
]
[[driven]]
joint = "left"
opened = 0.0
closed = 1.3
speed = 2.0
torque = 0.5
[[driven]]
joint = "right"
opened = 0.0
closed = 1.3
speed = 2.0
torque = 0.5
[[driven]]
joint = "left_tip"
opened = 0.0
speed = 2.0
torque = 0.1
[eigengrasps]
origin = [0.2, 0.2, 0.0]
directions = [[1.0, 1.0, 0.0]]
"#;

const URDF: &str = r#"<robot name="base">
  <link name="palm"><collision><geometry><box size="0.06 0.1 0.02"/></geometry></collision></link>
  <joint name="left" type="revolute">
    <parent link="palm"/><child link="left"/><origin xyz="0 0.03 0.02"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1.4" effort="50" velocity="2"/>
  </joint>
  <link name="left">
    <inertial><mass value="0.05"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 0.03"/><geometry><sphere radius="0.01"/></geometry></collision>
  </link>
  <joint name="right" type="revolute">
    <parent link="palm"/><child link="right"/><origin xyz="0 -0.03 0.02"/><axis xyz="-1 0 0"/>
    <limit lower="-1" upper="1.4" effort="50" velocity="2"/>
  </joint>
  <link name="right">
    <inertial><mass value="0.05"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 0.03"/><geometry><sphere radius="0.01"/></geometry></collision>
  </link>
</robot>
"#;

const URDF_TABLE: &str = r#"
approach = { body = "palm", position = [0.0, 0.0, 0.02], z = [0.0, 0.0, 1.0], x = [1.0, 0.0, 0.0] }
contacts = [
  { name = "left", body = "left", position = [0.0, -0.01, 0.03], normal = [0.0, -1.0, 0.0] },
  { name = "right", body = "right", position = [0.0, 0.01, 0.03], normal = [0.0, 1.0, 0.0] },
]
[[driven]]
joint = "left"
opened = 0.0
closed = 1.3
speed = 2.0
torque = 0.5
[[driven]]
joint = "right"
opened = 0.0
closed = 1.3
speed = 2.0
torque = 0.5
"#;

/// Ways to give an orientation: one excludes the others.
const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];

/// Attributes that exclude each other, in addition to [`ORIENTATIONS`].
const EXCLUSIVE: [(&str, &[&str]); 4] =
    [("fromto", &["pos"]), ("vertex", &["file"]), ("builtin", &["file"]), ("density", &["mass"])];

fn tetrahedron(height: f64) -> String {
    format!("v 0 0 0\nv 0.02 0 0\nv 0 0.03 0\nv 0 0 {height}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
}

/// Everything that is read of a description for a use, as text: two readings are equal when nothing in them differs.
fn read(format: Format, usage: Usage, text: &str) -> Result<String, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(&path, text).expect("a file");
        path
    };
    for (index, name) in
        ["sub/wedge.obj", "sub/other.obj", "wedge.obj", "other.obj", "other/sub/wedge.obj", "other/sub/other.obj"]
            .iter()
            .enumerate()
    {
        write(name, &tetrahedron(0.01 + 0.01 * index as f64));
    }
    let shown = if matches!(usage, Usage::Robot | Usage::Container) { "" } else { "contype=\"0\" conaffinity=\"0\"" };
    let (ending, table) = if format == Format::Mjcf { ("xml", TABLE) } else { ("urdf", URDF_TABLE) };
    write("base.toml", table);
    let path = write(&format!("base.{ending}"), &text.replace("SHOWN", shown));
    let read = match usage {
        Usage::Robot => read_robot(format, &path),
        Usage::Hand => read_hand(&path),
        Usage::Container => {
            let model = RobotModel::open_container(&path).map_err(|error| error.to_string());
            model
                .and_then(|model| model.bodies(&[], &BTreeMap::new()).map_err(|error| error.to_string()))
                .map(|bodies| format!("{bodies:?}"))
        }
        Usage::Camera => {
            scene_camera(&path, "eye").map(|camera| format!("{camera:?}")).map_err(|error| error.to_string())
        }
    };
    read.map_err(|error| error.replace(&folder.path().display().to_string(), ""))
}

fn read_robot(format: Format, path: &Path) -> Result<String, String> {
    let (told, none) = (|error: RobotError| error.to_string(), BTreeMap::new());
    let model = RobotModel::open(path).map_err(told)?;
    let target = if format == Format::Mjcf { "left_pad" } else { "left" };
    let group = model.planning_group(&["left"], target, &none).map_err(told)?;
    // Two links, so that a child may touch its parent.
    let both: &[&str] = if format == Format::Mjcf { &["left", "left_tip"] } else { &["left"] };
    let collidable = model.collidable(both, &none).map_err(told)?;
    let frame = model.resting_frame("palm", &["left"], &none).map_err(told)?;
    Ok(format!("{group:?} {collidable:?} {frame:?}"))
}

/// The hand, how it closes on a ball, and how a trial of a grasp goes.
fn read_hand(path: &Path) -> Result<String, String> {
    let told = |error: HandError| error.to_string();
    let model = HandModel::open(path).map_err(told)?;
    model.check_solids().map_err(told)?;
    let (bodies, rules) = model.bodies().map_err(|error| error.to_string())?;
    let ball = [Geometry { shape: Shape::Sphere { radius: 0.02 }, link_from_shape: IsometryMatrix3::identity() }];
    let sim = HandSim::new(&model, &ball).map_err(told)?;
    let mut worker = HandWorker::new(&Arc::new(sim));
    worker.start(&model.hand().opened(), &IsometryMatrix3::translation(0.0, 0.0, 0.06)).map_err(told)?;
    let run = worker.close(150);
    // Fingers that meet nothing go to their limits.
    worker.start(&model.hand().opened(), &IsometryMatrix3::translation(0.0, 0.0, 1.0)).map_err(told)?;
    let free = worker.close(400);
    let sim = TrialSim::new(&model, small_box(), &mass_of_small_box()).map_err(told)?;
    let conditions = TrialConditions::new(mass_of_volume(mass_of_small_box().volume));
    let place = IsometryMatrix3::translation(0.0, 0.0, 0.07);
    let outcome = TrialWorker::new(&sim).run(&model.hand().opened(), &place, &conditions).map_err(told)?;

    let touch = sim_touch_sensors(&model)?;
    Ok(format!("{:?} {bodies:?} {rules:?} {:?} {run:?} {free:?} {outcome:?} {touch}", model.hand(), model.mass()))
}

/// Names of the touch sensors whose values trials record.
fn sim_touch_sensors(model: &HandModel) -> Result<String, String> {
    let ball = [Geometry { shape: Shape::Sphere { radius: 0.02 }, link_from_shape: IsometryMatrix3::identity() }];
    let sim = HandSim::new(model, &ball).map_err(|error| error.to_string())?;
    Ok(format!("{:?}", sim.touch_sensors().collect::<Vec<_>>()))
}

/// Where the element of a row begins in a base, as far as its attributes are set one by one.
fn anchor(element: &str, attribute: &str) -> &'static str {
    match element {
        "body/body" if attribute == "mocap" => "<body name=\"post\"",
        "body/geom" if attribute == "mesh" => "<geom name=\"shown\"",
        "body/geom" if attribute == "fitscale" => "<geom name=\"fitted\"",
        "mujoco/size" => "<size",
        "mujoco/compiler" => "<compiler",
        "mujoco/option" => "<option",
        "option/flag" => "<flag",
        "mujoco/statistic" => "<statistic",
        "visual/map" => "<map",
        "asset/mesh" => "<mesh name=\"wedge\"",
        "body/body" => "<body name=\"left\"",
        "body/joint" => "<joint name=\"left\"",
        "body/geom" => "<geom name=\"left\"",
        "body/site" => "<site name=\"left_pad\"",
        "body/camera" => "<camera name=\"eye\"",
        "keyframe/key" => "<key ",
        "actuator/*" => "<motor",
        "sensor/rangefinder" => "<rangefinder",
        "joint/limit" => "<limit",
        "joint/safety_controller" => "<safety_controller",
        other => panic!("{other} has no place in the base"),
    }
}

/// Sets an attribute of the element that begins with `anchor`; those that it excludes go.
fn with_attribute(text: &str, anchor: &str, name: &str, value: &str) -> String {
    let start = text.find(anchor).unwrap_or_else(|| panic!("{anchor} is in\n{text}"));
    let (before, rest) = text.split_at(start);
    let end = rest.find('>').expect("a tag ends");
    let (tag, after) = rest.split_at(end);
    let excluded = EXCLUSIVE.iter().filter(|(of, _)| *of == name).flat_map(|(_, others)| others.iter().copied());
    let orientations = ORIENTATIONS.iter().copied().filter(|_| ORIENTATIONS.contains(&name) || name == "fromto");
    let gone: Vec<&str> = excluded.chain(orientations).chain([name]).collect();
    let tag = gone.iter().fold(tag.to_owned(), |tag, gone| without_attribute(&tag, gone));
    let (tag, slash) = tag.strip_suffix('/').map_or((tag.as_str(), ""), |tag| (tag.trim_end(), "/"));
    format!("{before}{tag} {name}=\"{value}\"{slash}{after}")
}

fn without_attribute(tag: &str, name: &str) -> String {
    let Some((before, rest)) = tag.split_once(&format!(" {name}=\"")) else { return tag.to_owned() };
    let (_, after) = rest.split_once('"').expect("a value ends");
    format!("{before}{after}")
}

/// Puts an element into its section.
fn with_element(format: Format, text: &str, section: &str, xml: &str) -> String {
    let after = |anchor: &str| {
        let start = text.find(anchor).unwrap_or_else(|| panic!("{anchor} is in\n{text}"));
        let end = start + text[start..].find('>').expect("a tag ends") + 1;
        format!("{}{xml}{}", &text[..end], &text[end..])
    };
    let before = |tag: &str| text.replacen(tag, &format!("{xml}{tag}"), 1);
    match (format, section) {
        (Format::Urdf, "robot") => before("</robot>"),
        (Format::Urdf, "link" | "joint") => {
            // One of a kind: the base's own goes.
            let anchor = format!("<{section} name=\"left\"");
            let text = without_element(text, &anchor, xml[1..].split([' ', '>', '/']).next().expect("a name"));
            let start = text.find(&anchor).expect("the base has it");
            let end = start + text[start..].find('>').expect("a tag ends") + 1;
            format!("{}{xml}{}", &text[..end], &text[end..])
        }
        (_, "body") if xml.starts_with("<inertial") || xml.starts_with("<joint") => after("<body name=\"left\""),
        (_, "body") if xml.starts_with("<freejoint") => after("<body name=\"palm\""),
        (_, "body") => before("</worldbody>"),
        (_, "mujoco") => before("</mujoco>"),
        (_, "*") => before("</worldbody>"),
        (_, section) => {
            let end = format!("</{section}>");
            match text.contains(&end) {
                true => before(&end),
                false => text.replacen("</mujoco>", &format!("<{section}>{xml}</{section}></mujoco>"), 1),
            }
        }
    }
}

/// Takes the first element of a name out of the element that begins with `anchor`.
fn without_element(text: &str, anchor: &str, name: &str) -> String {
    let start = text.find(anchor).expect("the base has it");
    let (before, rest) = text.split_at(start);
    let section = &anchor[..anchor.find(' ').expect("a name")];
    let inside = rest.find(&section.replace('<', "</")).expect("an end");
    let Some(from) = rest[..inside].find(&format!("<{name}")) else { return text.to_owned() };
    let end = format!("</{name}>");
    let to = match rest[from..inside].find(&end) {
        Some(at) => from + at + end.len(),
        None => from + rest[from..].find("/>").expect("an end") + 2,
    };
    format!("{before}{}{}", &rest[..from], &rest[to..])
}

/// A row's statement in a base: both texts and what is stated. One for each attribute, or for the element.
fn statements(format: Format, row: &Row) -> Vec<(String, String, String)> {
    let base = if format == Format::Mjcf { MJCF } else { URDF };
    let section = row.element.split_once('/').map_or("", |(section, _)| section);
    if row.attributes.is_empty() {
        return vec![(base.to_owned(), with_element(format, base, section, row.example), row.example.to_owned())];
    }
    let base = match row.example.starts_with('<') {
        true => with_element(format, base, section, row.example),
        false => {
            let beside = Row { attributes: row.example, ..*row };
            beside.values().fold(base.to_owned(), |text, (name, value)| {
                with_attribute(&text, anchor(row.element, name), name, value)
            })
        }
    };
    let stated = |(name, value): (&str, &str)| {
        (base.clone(), with_attribute(&base, anchor(row.element, name), name, value), format!("{name}=\"{value}\""))
    };
    row.values().filter(|(_, value)| !value.is_empty()).map(stated).collect()
}

/// Fault of a row's decision for a use; `None` where it is true.
fn fault(
    before: &Result<String, String>,
    format: Format,
    usage: Usage,
    decision: Decision,
    (_, changed, stated): &(String, String, String),
) -> Option<String> {
    if let Err(error) = before {
        return Some(format!("the base is refused: {error}"));
    }
    let after = read(format, usage, changed);
    let is_refused = |remedy: &str| match &after {
        Err(error) if error.contains(remedy) => None,
        Err(error) => Some(format!("refused without its remedy: {error}")),
        Ok(_) => Some("not refused".to_owned()),
    };
    match decision {
        Decision::Honoured if after == *before => Some("nothing changes".to_owned()),
        Decision::Honoured => None,
        Decision::Ignored { .. } if after == *before => None,
        Decision::Ignored { .. } => {
            let what = after
                .as_ref()
                .map_or_else(Clone::clone, |after| first_difference(before.as_ref().expect("read"), after));
            Some(format!("it changes what is read: {what}"))
        }
        Decision::HonouredUnless { remedy, .. }
        | Decision::IgnoredUnless { remedy, .. }
        | Decision::Refused { remedy } => is_refused(remedy),
        Decision::Only { values, remedy } => {
            let (name, stated_value) = stated.split_once('=').expect("an attribute");
            let count = stated_value.split_ascii_whitespace().count();
            let allowed = values.iter().filter_map(|value| {
                let value = vec![*value; count].join(" ");
                let text = changed.replacen(stated.as_str(), &format!("{name}=\"{value}\""), 1);
                (read(format, usage, &text) != *before).then(|| format!("{value} changes what is read"))
            });
            is_refused(remedy).or_else(|| allowed.collect::<Vec<_>>().into_iter().next())
        }
    }
}

fn first_difference(one: &str, other: &str) -> String {
    let at = one.bytes().zip(other.bytes()).position(|(a, b)| a != b).unwrap_or(0);
    let around = |text: &str| text.get(at.saturating_sub(60)..(at + 40).min(text.len())).unwrap_or_default().to_owned();
    format!("...{}... becomes ...{}...", around(one), around(other))
}

/// Tries every row of a format; those without an example are sections, whose content has rows.
fn try_rows(format: Format) {
    let (mut tried, mut faults, mut bases) = (0, Vec::new(), BTreeMap::new());
    for row in rows(format).iter().filter(|row| !row.attributes.is_empty() || !row.example.is_empty()) {
        for statement in statements(format, row) {
            for usage in Usage::ALL {
                // A URDF has no cameras.
                if format == Format::Urdf && usage == Usage::Camera {
                    continue;
                }
                tried += 1;
                let base: &String = &statement.0;
                let before = bases.entry((usage as u8, base.clone())).or_insert_with(|| read(format, usage, base));
                if let Some(fault) = fault(before, format, usage, row.decision(usage), &statement) {
                    faults.push(format!("{} {} for {usage:?}: {fault}", row.element, statement.2));
                }
            }
        }
    }
    println!("{tried} statements tried");
    assert!(faults.is_empty(), "{} of {tried}:\n{}", faults.len(), faults.join("\n"));
    assert!(tried > 50);
}

#[test]
fn every_statement_of_mjcf_is_treated_as_its_row_tells() {
    try_rows(Format::Mjcf);
}

#[test]
fn every_statement_of_urdf_is_treated_as_its_row_tells() {
    try_rows(Format::Urdf);
}

/// MuJoCo writes content types where it saves a URDF as MJCF.
#[test]
fn a_content_type_that_is_the_ending_changes_nothing() {
    let stated = with_attribute(MJCF, "<mesh name=\"wedge\"", "content_type", "model/obj");
    for usage in Usage::ALL {
        assert_eq!(read(Format::Mjcf, usage, &stated), read(Format::Mjcf, usage, MJCF), "{usage:?}");
    }
}

/// Otherwise no trials would be compared.
#[test]
fn the_hand_of_the_base_holds_the_box_of_its_trial() {
    let reading = read(Format::Mjcf, Usage::Hand, MJCF).expect("a hand");
    assert!(reading.contains(&format!("verdict: {:?}", Verdict::Held)), "{reading}");
}
