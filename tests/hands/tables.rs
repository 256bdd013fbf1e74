//! Tables with mistakes: file, place, what is wrong, how to mend it.

use std::{fs, path::Path, sync::Arc};

use graspmill::{
    collision::Geometry,
    geom::Shape,
    sim::{HandError, HandModel, HandSim, HandWorker, RunEnd},
};
use nalgebra::{IsometryMatrix3, Translation3};

use super::{BARRETT, GRIPPER};

/// What opening a hand says when its table, or its description, has a line replaced.
fn refusal(scene: &str, table: &[(&str, &str)], description: &[(&str, &str)]) -> String {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("hand.xml");
    let changed = |path: &Path, changes: &[(&str, &str)]| {
        let mut text = fs::read_to_string(path).expect("a file");
        for (from, to) in changes {
            assert!(text.contains(from), "{from:?} is not there");
            text = text.replacen(from, to, 1);
        }
        text
    };
    fs::write(&path, changed(Path::new(scene), description)).expect("a file");
    let table = changed(&Path::new(scene).with_extension("toml"), table);
    fs::write(path.with_extension("toml"), table).expect("a file");
    let error = HandModel::open(&path).err().expect("a mistake");
    assert!(matches!(error, HandError::Table(_) | HandError::Coupling { .. } | HandError::Robot(_)));
    error.to_string().replace(&folder.path().display().to_string(), "DIR")
}

#[test]
fn mistakes_are_placed_and_explained() {
    for (table, expected) in [
        (
            ("joint = \"proximal_1\"", "joint = \"proximal1\""),
            "DIR/hand.toml:40:9: no joint is named \"proximal1\"; did you mean \"proximal_1\"? the hand has spread_1, \
             proximal_1, distal_1, spread_2, proximal_2, distal_2, proximal_3, distal_3",
        ),
        (("speed = 2.0", "sped = 2.0"), "unknown key `sped`; did you mean \"speed\"? the keys here are joint, name"),
        (("speed = 2.0", "speed = -2.0"), "DIR/hand.toml:43:9: speed = -2; it has to be a number above 0"),
        (("speed = 2.0", ""), "missing field `speed`"),
        (("speed = 2.0", "speed = \"fast\""), "expected"),
        (("{ site = \"palm_2\" }", "{ site = \"palm_9\" }"), "no site is named \"palm_9\"; did you mean \"palm_1\"?"),
        (("{ site = \"palm_2\" }", "{ site = \"palm_1\" }"), "contact \"palm_1\" stands twice"),
        (("{ site = \"palm_2\" }", "{ name = \"a\" }"), "give site (and a name, if you like), or name, body, position"),
        (
            (
                "{ site = \"palm_2\" }",
                "{ name = \"a\", body = \"medial\", position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }",
            ),
            "no body is named \"medial\"; did you mean \"medial_1\"?",
        ),
        (
            (
                "{ site = \"palm_2\" }",
                "{ name = \"a\", body = \"palm\", position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 0.0] }",
            ),
            "normal gives no direction",
        ),
        (
            ("approach = { site = \"approach\" }", "approach = { body = \"palm\" }"),
            "give site, or body, position, z and x",
        ),
        (
            ("[0.0, 1.0, 1.0, 1.0]]", "[0.0, 1.0, 1.0]]"),
            "3 values; there are 4 driven joints: spread, finger_1, finger_2, finger_3",
        ),
        (
            ("closed = 2.443460952792061", "closed = 2.6"),
            "closed = 2.6, but joint \"proximal_1\", with what follows it, goes",
        ),
        (
            ("joint = \"distal_1\", ratio", "joint = \"distal_2\", ratio"),
            "\"distal_2\" does not follow \"proximal_1\"; those that do: distal_1",
        ),
        (("ratio = 1.3333333333333333", "ratio = 0.0"), "ratio = 0; it has to be finite and not 0"),
        (("closed = 2.443460952792061", ""), "a breakaway needs `closed`"),
        (
            ("joint = \"spread_1\"", "joint = \"spread_2\""),
            "joint \"spread_2\" follows \"spread_1\" by <equality><joint>; drive that",
        ),
        (("joint = \"proximal_2\"", "joint = \"proximal_1\""), "driven joint \"proximal_1\" stands twice"),
        (("name = \"finger_2\"", "name = \"finger_1\""), "driven name \"finger_1\" stands twice"),
        (("origin = [", "origin = "), "DIR/hand.toml:68"),
    ] {
        let found = refusal(BARRETT, &[table], &[]);
        assert!(found.contains(expected), "{table:?} says\n{found}\nand not\n{expected}");
        assert!(found.starts_with("DIR/hand.toml:"), "{found}");
    }
}

/// All of it at once, in the table's order.
#[test]
fn every_mistake_is_told() {
    let found = refusal(
        BARRETT,
        &[
            ("torque = 0.5", "torque = 0.0"),
            ("{ site = \"palm_4\" }", "{ site = \"plam_4\" }"),
            ("origin = [1.13, ", "origin = [1.13, 0.0, "),
        ],
        &[],
    );
    let lines: Vec<&str> = found.lines().collect();
    assert_eq!(lines.len(), 3, "{found}");
    assert!(lines[0].contains("plam_4") && lines[1].contains("torque = 0") && lines[2].contains("5 values"), "{found}");
}

#[test]
fn a_width_needs_two_contacts_of_the_hand() {
    let found = refusal(GRIPPER, &[("width = [\"pad_left\"", "width = [\"pad_lift\"")], &[]);
    assert!(found.contains("no contact is named \"pad_lift\"; did you mean \"pad_left\"?"), "{found}");
}

/// What the description says wrongly, or leaves out.
#[test]
fn descriptions_that_make_no_hand() {
    let mirror = "<joint name=\"mirror\" joint1=\"right\" joint2=\"left\"/>";
    for (description, expected) in [
        ((mirror, ""), "joint \"right\" is neither driven nor does it follow a driven one"),
        ((mirror, "<joint joint1=\"right\" joint2=\"left\" polycoef=\"0 1 2 0 0\"/>"), "\"right\" follows by a curve"),
        ((mirror, "<joint joint1=\"right\"/>"), "\"right\" is held at a value"),
        (("<joint name=\"right\" axis", "<joint axis"), "hand.xml"),
        (("<joint name=\"left\" axis=\"0 1 0\"/>", "<freejoint name=\"left\"/>"), "hand.xml"),
    ] {
        let found = refusal(GRIPPER, &[], &[description]);
        assert!(found.contains(expected), "{description:?}: {found}");
    }
    let lonely = tempfile::tempdir().expect("a temporary folder");
    let path = lonely.path().join("hand.xml");
    fs::copy(GRIPPER, &path).expect("a copy");
    let error = HandModel::open(&path).err().expect("no table").to_string();
    assert!(error.contains("hand.toml: ") && error.contains("docs/hands.md"), "{error}");
}

/// A hand that floats in its file is the same hand that stands.
#[test]
fn a_floating_hand_stands_still() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("hand.xml");
    let text = fs::read_to_string(GRIPPER).expect("a description");
    let floating =
        text.replace("<body name=\"palm\">", "<body name=\"palm\" pos=\"0 0 0.1\"><freejoint name=\"root\"/>");
    let keyed = floating.replace("</mujoco>", "<keyframe><key qpos=\"0 0 1 1 0 0 0 0.01 0.01\"/></keyframe></mujoco>");
    fs::write(&path, keyed).expect("a file");
    fs::copy(Path::new(GRIPPER).with_extension("toml"), path.with_extension("toml")).expect("a copy");
    let (floats, stands) = (HandModel::open(&path).unwrap_or_else(|error| panic!("{error}")), super::open(GRIPPER));
    assert_eq!(floats.hand().links(), stands.hand().links());
    assert_eq!(floats.hand().tree().len(), 2);
    let raised = Translation3::new(0.0, 0.0, 0.1);
    for values in [[0.0, 0.0], [0.03, 0.03]] {
        let [ours, theirs] = [&floats, &stands].map(|model| model.hand().link_frames(&values));
        for (one, other) in ours.iter().zip(&theirs) {
            assert!((one.to_homogeneous() - (raised * other).to_homogeneous()).amax() < 1e-12);
        }
    }
    let ball = [Geometry { shape: Shape::Sphere { radius: 0.02 }, link_from_shape: IsometryMatrix3::identity() }];
    let mut worker = HandWorker::new(&Arc::new(HandSim::new(&floats, &ball).expect("a simulation")));
    worker.start(&floats.hand().opened(), &IsometryMatrix3::translation(0.0, 0.0, 0.205)).expect("a posture");
    let run = worker.close(2000);
    assert_eq!(run.end, RunEnd::AtRest, "{run:?}");
    let width = floats.hand().width(&floats.hand().link_frames(&run.joints)).expect("a gripper");
    assert!((width - 0.04).abs() < 1e-3, "{width}");
}
