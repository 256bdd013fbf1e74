//! Impossible jobs: no work is started, and the key, the scene and the available names are reported.

use super::{ORIENTATIONS, change_robot, run, write_job};
use crate::support::{program::Program, workspace::Workspace};

/// Runs the job with these settings; the error, after checking that nothing was begun.
fn refused(workspace: &Workspace, settings: &[&str]) -> String {
    let said = workspace.run_job("job", "never").set(settings).expect_code(2).stderr;
    assert!(!workspace.path("never").exists() && !said.contains("panicked"), "{said}");
    said
}

#[test]
fn wrong_names_are_told_with_scene_and_what_is_there() {
    let workspace = write_job(ORIENTATIONS);
    let cases: [(&str, &[&str]); 6] = [
        ("robot.target=wrist_rol_link", &["robot.target", "fetch.xml", "wrist_roll_link", "did you mean"]),
        ("robot.joints=['shoulder_pan_join']", &["robot.joints[0]", "fetch.xml", "elbow_flex_joint", "did you mean"]),
        ("robot.joints=['head_pan_joint']", &["robot.joints[0]", "does not move", "shoulder_lift_joint"]),
        (
            "robot.joints=['elbow_flex_joint', 'shoulder_pan_joint']",
            &["from the base outward", "shoulder_pan_joint, elbow"],
        ),
        ("robot.fixed={torso=0.1}", &["robot.fixed.torso", "torso_lift_joint"]),
        ("robot.model=gone.xml", &["robot.model", "gone.xml"]),
    ];
    for (change, parts) in cases {
        let said = refused(&workspace, &[change]);
        for part in parts {
            assert!(said.contains(part), "{change}: '{part}' is not in\n{said}");
        }
    }
    let both = refused(&workspace, &["robot.joints=['a', 'b']", "poses.x.step=0"]);
    assert!(
        both.contains("robot.joints[0]") && both.contains("robot.joints[1]") && both.contains("3 errors"),
        "{both}"
    );
}

#[test]
fn grids_that_are_none_are_told_with_their_axis() {
    let workspace = write_job(ORIENTATIONS);
    for (change, parts) in [
        ("poses.x.step=0", ["poses.x.step", "axis x: step = 0 must be above zero"]),
        ("poses.y.to=-5", ["poses.y.to", "at least one cell"]),
        ("poses.yaw=0", ["poses.yaw", "from 1 to 4096"]),
    ] {
        let said = refused(&workspace, &[change]);
        assert!(parts.iter().all(|part| said.contains(part)), "{change}\n{said}");
    }
}

#[test]
fn robots_that_cannot_be_are_told_why() {
    let workspace = write_job(ORIENTATIONS);
    let lift = r#"<joint name="torso_lift_joint" type="slide" axis="0 0 1" range="0 0.38615"/>"#;
    change_robot(&workspace, lift, r#"<joint name="torso_lift_joint" type="slide" axis="0 0 1"/>"#);
    let said = refused(&workspace, &["robot.joints=['torso_lift_joint', 'shoulder_pan_joint']"]);
    assert!(said.contains("robot.joints[0]") && said.contains("range=\"LOW HIGH\""), "{said}");
    workspace.write("fetch.xml", "<mujoco><worldbody><body></mujoco>");
    let said = refused(&workspace, &[]);
    assert!(said.contains("robot.model") && said.contains("fetch.xml:1: </mujoco> closes <body>"), "{said}");
}

#[test]
fn a_robot_that_has_changed_makes_no_sample_again() {
    let workspace = write_job(ORIENTATIONS);
    let data = run(&workspace, "data", &[]);
    change_robot(&workspace, "-2.16 2.16", "-2.15 2.15");
    let said = Program::on("verify", &data).option("--regenerate", "2").fail().stderr;
    assert!(said.contains("robot.content") && said.contains("has changed"), "{said}");
    // Without making samples again the dataset is as good as before.
    Program::on("verify", &data).succeed();
    // The folder of another robot is not changed.
    workspace.run_job("job", "data").expect_code(2);
}
