//! Tables with mistakes: errors with the file, its line, the fault and the remedy.

use std::{fs, path::Path, sync::Arc};

use graspmill::{
    collision::Geometry,
    geom::Shape,
    sim::{HandError, HandModel, HandSim, HandWorker, RunEnd},
};
use nalgebra::{IsometryMatrix3, Translation3};

use crate::support::{
    files::read_text,
    robots::{BARRETT, GRIPPER, open_hand},
    workspace::Workspace,
};

/// The error of a hand whose table, or whose description, has lines replaced.
fn refusal(scene: &str, table: &[(&str, &str)], description: &[(&str, &str)]) -> String {
    let folder = Workspace::new();
    let changed = |path: &Path, changes: &[(&str, &str)]| {
        let mut text = read_text(path);
        for (from, to) in changes {
            assert!(text.contains(from), "{from:?} is not there");
            text = text.replacen(from, to, 1);
        }
        text
    };
    let path = folder.write("hand.xml", changed(Path::new(scene), description));
    folder.write("hand.toml", changed(&Path::new(scene).with_extension("toml"), table));
    let error = HandModel::open(&path).err().expect("a mistake");
    assert!(matches!(error, HandError::Table(_) | HandError::Coupling { .. } | HandError::Robot(_)));
    error.to_string().replace(&folder.folder().display().to_string(), "DIR")
}

/// Checks the message for the Barrett's table with one line replaced.
fn assert_says(change: (&str, &str), expected: &str) {
    let found = refusal(BARRETT, &[change], &[]);
    assert!(found.contains(expected), "{change:?} prints\n{found}\nand not\n{expected}");
    assert!(found.starts_with("DIR/hand.toml:"), "{found}");
}

#[test]
fn mistakes_of_motors_are_placed_and_explained() {
    for (change, expected) in [
        (
            ("joint = \"proximal_1\"", "joint = \"proximal1\""),
            "DIR/hand.toml:41:9: driven[1].joint: joint not found: `proximal1`; the hand has spread_1, proximal_1, \
             distal_1, spread_2, proximal_2, distal_2, proximal_3, distal_3; did you mean `proximal_1`?",
        ),
        (("speed = 2.0", "sped = 2.0"), "driven[1].sped: unknown key `sped`; did you mean `speed`?"),
        (
            ("speed = 2.0", "speed = -2.0"),
            "DIR/hand.toml:44:9: driven[1].speed: expected a number above 0 [rad/s or m/s], found -2",
        ),
        (("speed = 2.0", ""), "driven[1].speed: missing: expected a number above 0 [rad/s or m/s]"),
        (
            ("speed = 2.0", "speed = \"fast\""),
            "driven[1].speed: expected a number above 0 [rad/s or m/s], found the string \"fast\"",
        ),
        (
            ("closed = 2.443460952792061", "closed = 2.6"),
            "driven[1].closed: expected a number from 0 to 2.443460952792061 [rad], found 2.6; the range of joint \
             `proximal_1` and of what follows it",
        ),
        (
            ("joint = \"distal_1\", ratio", "joint = \"distal_2\", ratio"),
            "driven[1].breakaway.joint: expected a joint that follows `proximal_1`, found `distal_2`; those that do: \
             distal_1",
        ),
        (
            ("ratio = 1.3333333333333333", "ratio = 0.0"),
            "driven[1].breakaway.ratio: expected a number other than 0, found 0",
        ),
        (
            ("holding_torque = 1.0", "holding_torque = 0.4"),
            "driven[1].breakaway.holding_torque: expected at least `torque`, found 0.4; a joint that gives way below 0.5 is \
             never stopped by that load",
        ),
        (("ratio = 1.3333333333333333", "ratio = inf"), "driven[1].breakaway.ratio: expected a number, found inf"),
        (("closed = 2.443460952792061", ""), "driven[1].closed: expected a value other than `opened`, found none"),
        (
            ("joint = \"spread_1\"", "joint = \"spread_2\""),
            "driven[0].joint: expected a joint that follows no other, found `spread_2`, which follows `spread_1` by \
             <equality><joint>; drive `spread_1`",
        ),
        (
            ("joint = \"proximal_2\"", "joint = \"proximal_1\""),
            "driven[2].joint: expected a joint that no other motor drives, found `proximal_1` a second time",
        ),
        (
            ("name = \"finger_2\"", "name = \"finger_1\""),
            "driven[2].name: expected a name that no other motor has, found `finger_1` a second time",
        ),
    ] {
        assert_says(change, expected);
    }
}

#[test]
fn mistakes_of_frames_and_postures_are_placed_and_explained() {
    for (change, expected) in [
        (
            ("{ site = \"palm_2\" }", "{ site = \"palm_9\" }"),
            "contacts[1].site: site not found: `palm_9`; the hand has approach, ",
        ),
        (("{ site = \"palm_2\" }", "{ site = \"palm_9\" }"), "did you mean `palm_1`?"),
        (
            ("{ site = \"palm_2\" }", "{ site = \"palm_1\" }"),
            "contacts[1].site: expected a name that no other contact has, found `palm_1` a second time",
        ),
        (
            ("{ site = \"palm_2\" }", "{ name = \"a\" }"),
            "contacts[1]: expected `site` (and a `name`, if you like), or `name`, `body`, `position` and `normal`, found \
             a table with the keys name",
        ),
        (
            (
                "{ site = \"palm_2\" }",
                "{ name = \"a\", body = \"medial\", position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }",
            ),
            "did you mean `medial_1`?",
        ),
        (
            (
                "{ site = \"palm_2\" }",
                "{ name = \"a\", body = \"palm\", position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 0.0] }",
            ),
            "contacts[1].normal: expected a direction, found [0.0, 0.0, 0.0]",
        ),
        (
            ("approach = { site = \"approach\" }", "approach = { body = \"palm\" }"),
            "approach: expected `site`, or `body`, `position`, `z` and `x`, found a table with the keys body",
        ),
        (
            ("[0.0, 1.0, 1.0, 1.0]]", "[0.0, 1.0, 1.0]]"),
            "eigengrasps.directions[1]: expected 4 values, one per driven joint: spread, finger_1, finger_2, finger_3, \
             found 3",
        ),
        (("origin = [", "origin = "), "DIR/hand.toml:69"),
    ] {
        assert_says(change, expected);
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
    for (line, word) in lines.iter().zip(["contacts[3].site: ", "driven[1].breakaway.torque: ", "eigengrasps.origin: "])
    {
        assert!(line.contains(word), "{found}");
    }
}

#[test]
fn a_width_needs_two_contacts_of_the_hand() {
    let found = refusal(GRIPPER, &[("width = [\"pad_left\"", "width = [\"pad_lift\"")], &[]);
    let expected = "DIR/hand.toml:17:10: width[0]: contact not found: `pad_lift`; the hand has pad_left, pad_right, ";
    assert!(found.starts_with(expected) && found.ends_with("; did you mean `pad_left`?"), "{found}");
}

/// Mistakes of the description, and what it leaves out.
#[test]
fn descriptions_that_make_no_hand() {
    let mirror = "<joint name=\"mirror\" joint1=\"right\" joint2=\"left\"/>";
    for (description, expected) in [
        ((mirror, ""), "driven: missing: expected a motor for each joint that follows none: nothing moves `right`"),
        ((mirror, "<joint joint1=\"right\" joint2=\"left\" polycoef=\"0 1 2 0 0\"/>"), "\"right\" follows by a curve"),
        ((mirror, "<joint joint1=\"right\"/>"), "\"right\" is held at a value"),
        (("<joint name=\"right\" axis", "<joint axis"), "hand.xml"),
        (("<joint name=\"left\" axis=\"0 1 0\"/>", "<freejoint name=\"left\"/>"), "hand.xml"),
    ] {
        let found = refusal(GRIPPER, &[], &[description]);
        assert!(found.contains(expected), "{description:?}: {found}");
    }
    let lonely = Workspace::new();
    let path = lonely.path("hand.xml");
    fs::copy(GRIPPER, &path).expect("a copy");
    let error = HandModel::open(&path).err().expect("no table").to_string();
    assert!(error.contains("hand.toml: ") && error.contains("docs/hands.md"), "{error}");
}

/// A hand that floats in its file equals the same hand with a fixed base.
#[test]
fn a_floating_hand_stands_still() {
    let folder = Workspace::new();
    let text = read_text(GRIPPER);
    let floating =
        text.replace("<body name=\"palm\">", "<body name=\"palm\" pos=\"0 0 0.1\"><freejoint name=\"root\"/>");
    let keyed = floating.replace("</mujoco>", "<keyframe><key qpos=\"0 0 1 1 0 0 0 0.01 0.01\"/></keyframe></mujoco>");
    let path = folder.write("hand.xml", keyed);
    fs::copy(Path::new(GRIPPER).with_extension("toml"), path.with_extension("toml")).expect("a copy");
    let (floats, stands) = (open_hand(&path), open_hand(GRIPPER));
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
