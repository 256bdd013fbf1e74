//! Jobs that cannot be: nothing is begun, and the key, the scene and what is there are named.

use std::fs;

use super::{Place, command};

/// Runs the job with these overrides; what is said on stderr, after checking that nothing was begun.
fn refused(place: &Place, more: &[&str]) -> String {
    let out = place.path("never");
    let done = command(&["run"]).arg(place.path("job.toml")).arg("--out").arg(&out).args(more).output();
    let done = done.expect("graspmill starts");
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(2), "{said}");
    assert!(!out.exists() && !said.contains("panicked"), "{said}");
    said
}

#[test]
fn wrong_names_are_told_with_scene_and_what_is_there() {
    let place = Place::new();
    let cases: [(&str, &[&str]); 6] = [
        ("robot.target=wrist_rol_link", &["robot.target", "fetch.xml", "wrist_roll_link", "did you mean"]),
        ("robot.joints=['shoulder_pan_join']", &["robot.joints[0]", "fetch.xml", "elbow_flex_joint", "did you mean"]),
        ("robot.joints=['head_pan_joint']", &["robot.joints[0]", "does not move", "shoulder_lift_joint"]),
        (
            "robot.joints=['elbow_flex_joint', 'shoulder_pan_joint']",
            &["from the base outward", "shoulder_pan_joint, elbow"],
        ),
        ("robot.fixed={torso=0.1}", &["robot.fixed.torso", "torso_lift_joint"]),
        ("robot.scene=gone.xml", &["robot.scene", "gone.xml"]),
    ];
    for (change, parts) in cases {
        let said = refused(&place, &["--set", change]);
        for part in parts {
            assert!(said.contains(part), "{change}: '{part}' is not in\n{said}");
        }
    }
    let both = refused(&place, &["--set", "robot.joints=['a', 'b']", "--set", "poses.x.step=0"]);
    assert!(
        both.contains("robot.joints[0]") && both.contains("robot.joints[1]") && both.contains("3 errors"),
        "{both}"
    );
}

#[test]
fn grids_that_are_none_are_told_with_their_axis() {
    let place = Place::new();
    for (change, parts) in [
        ("poses.x.step=0", ["poses.x.step", "axis x: step = 0 must be above zero"]),
        ("poses.y.to=-5", ["poses.y.to", "at least one cell"]),
        ("poses.yaw=0", ["poses.yaw", "from 1 to 4096"]),
    ] {
        let said = refused(&place, &["--set", change]);
        assert!(parts.iter().all(|part| said.contains(part)), "{change}\n{said}");
    }
}

#[test]
fn robots_that_cannot_be_are_told_why() {
    let place = Place::new();
    let text = fs::read_to_string(place.path("fetch.xml")).expect("the robot");
    let lift = r#"<joint name="torso_lift_joint" type="slide" axis="0 0 1" range="0 0.38615"/>"#;
    let endless = text.replace(lift, r#"<joint name="torso_lift_joint" type="slide" axis="0 0 1"/>"#);
    assert_ne!(endless, text);
    fs::write(place.path("fetch.xml"), endless).expect("a robot");
    let said = refused(&place, &["--set", "robot.joints=['torso_lift_joint', 'shoulder_pan_joint']"]);
    assert!(said.contains("robot.joints[0]") && said.contains("range=\"LOW HIGH\""), "{said}");
    fs::write(place.path("fetch.xml"), "<mujoco><worldbody><body></mujoco>").expect("no robot");
    let said = refused(&place, &[]);
    assert!(said.contains("robot.scene") && said.contains("MuJoCo refuses"), "{said}");
}

#[test]
fn a_robot_that_has_changed_makes_no_sample_again() {
    let place = Place::new();
    let data = place.run("data", &[]);
    let text = fs::read_to_string(place.path("fetch.xml")).expect("the robot");
    fs::write(place.path("fetch.xml"), text.replace("-2.16 2.16", "-2.15 2.15")).expect("another robot");
    let done = command(&["verify", "--regenerate", "2"]).arg(&data).output().expect("graspmill starts");
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(!done.status.success() && said.contains("robot.content") && said.contains("has changed"), "{said}");
    // Without making samples again the dataset is as good as before.
    assert!(command(&["verify"]).arg(&data).output().expect("graspmill starts").status.success());
    let other =
        command(&["run"]).arg(place.path("job.toml")).arg("--out").arg(&data).output().expect("graspmill starts");
    assert_eq!(other.status.code(), Some(2), "the folder of another robot is left alone");
}
