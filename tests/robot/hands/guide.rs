//! `docs/hands.md`, followed to the letter: its hand is written from its own blocks, checked, and closed.

use std::{fs, path::Path, sync::Arc};

use graspmill::{
    collision::Geometry,
    geom::Shape,
    sim::{HandSim, HandWorker, RunEnd},
};
use nalgebra::IsometryMatrix3;
use serde_json::Value;

use super::link_named;
use crate::support::{
    files::read_text,
    program::Program,
    robots::{BARRETT, GRIPPER, open_hand},
    workspace::Workspace,
};

/// The first block of a language.
fn block(guide: &str, language: &str) -> String {
    let (_, rest) = guide.split_once(&format!("```{language}\n")).expect("a block");
    rest.split_once("```").expect("its end").0.to_owned()
}

#[test]
fn the_guides_hand_opens_and_closes() {
    let guide = read_text("docs/hands.md");
    let folder = Workspace::new();
    let path = folder.write("two_fingers.xml", block(&guide, "xml"));
    folder.write("two_fingers.toml", block(&guide, "toml"));
    let model = open_hand(&path);
    let ball = [Geometry { shape: Shape::Sphere { radius: 0.02 }, link_from_shape: IsometryMatrix3::identity() }];
    let mut worker = HandWorker::new(&Arc::new(HandSim::new(&model, &ball).expect("a simulation")));
    let base_from_ball = IsometryMatrix3::translation(0.0, 0.0, 0.1);
    worker.start(&model.hand().opened(), &base_from_ball).expect("a posture");
    let run = worker.close(2000);
    assert_eq!(run.end, RunEnd::AtRest, "{run:?}");
    for finger in ["left", "left_tip", "right", "right_tip"] {
        let link = link_named(model.hand(), finger);
        let touches = run.touches.iter().filter(|touch| touch.link == link);
        println!("{finger}: {:.1?} N", touches.map(|touch| touch.force).collect::<Vec<_>>());
    }
    // Both fingers hold the ball between them.
    let sides = |sign: f64| run.touches.iter().any(|touch| touch.force > 1.0 && touch.normal.y * sign > 0.3);
    assert!(sides(1.0) && sides(-1.0), "{:?}", run.touches);

    let pictures = folder.path("pictures");
    let check = Program::new("hand").arg("check").arg(&path).option("--samples", "200");
    let text = check.option("--picture", &pictures).succeed().stdout;
    for expected in [
        "two_fingers), 0.460 kg",
        "left_tip follows at 0.5000; after left stops, continues at 0.5000 until 0.2 N m",
        "width                    ",
        "left_pad                 left_tip         (0, ",
        "amplitude -0.649 .. 1.096",
        "opened, nothing touches",
        "jobs that can use this hand: touch.exploration = true, touch.grasp = true, grasps.sampler = \"annealing\", \
         grasps.sampler = \"uniform\", grasps.sampler = \"antipodal\", grasps.sampler = \"approach\", [physics]\n",
    ] {
        assert!(text.contains(expected), "{expected} is not in\n{text}");
    }
    assert!(!text.contains("move it to the surface"), "{text}");
    for name in ["opened", "half_closed", "closed"] {
        let png = fs::read(pictures.join(format!("{name}.png"))).expect("a picture");
        assert!(png.starts_with(b"\x89PNG"));
    }
}

#[test]
fn hand_check_explains_mistakes_and_prints_json() {
    let check = |file: &Path| Program::new("hand").arg("check").arg(file);
    let missing = check("scenes/no_such_hand.xml".as_ref()).expect_code(2);
    assert!(missing.stderr.contains("no_such_hand.xml"));
    let report = check(BARRETT.as_ref()).option("--samples", "300").read_json();
    assert_eq!(report["driven"].as_array().expect("driven").len(), 4);
    assert_eq!(report["driven"][1]["followers"][0]["after_breakaway"], 4.0 / 3.0);
    let off_surface = |contact: &Value| contact["off_surface"].as_f64().expect("a number").abs();
    assert!(report["contacts"].as_array().expect("contacts").iter().all(|contact| off_surface(contact) < 1e-9));
    assert_eq!(report["exclude"].as_array().expect("pairs that always touch").len(), 0);
    assert_eq!(report["touch_opened"].as_array().expect("pairs").len(), 0);
    assert_eq!(refused_settings(&report), [""; 0]);
    // The table's own path does as well.
    check(&Path::new(BARRETT).with_extension("toml")).option("--samples", "0").succeed();
}

/// Settings of jobs that cannot use a hand, as `hand check` lists them.
fn refused_settings(report: &Value) -> Vec<&str> {
    let uses = report["uses"].as_array().expect("uses").iter();
    uses.filter(|row| !row["refusal"].is_null()).filter_map(|row| row["setting"].as_str()).collect()
}

#[test]
fn hand_check_says_which_jobs_can_use_a_hand() {
    let check = |file: &Path| Program::new("hand").arg("check").arg(file).option("--samples", "0");
    assert!(refused_settings(&check(GRIPPER.as_ref()).read_json()).is_empty());
    // Two points that may touch: enough to feel with, too few to search with.
    let folder = Workspace::new();
    let path = folder.write("pincers.xml", read_text(GRIPPER));
    let table = read_text(Path::new(GRIPPER).with_extension("toml"));
    let (head, rest) = table.split_once("  { name = \"left_low\"").expect("contacts");
    let (_, tail) = rest.split_once("\n]\n").expect("their end");
    folder.write("pincers.toml", format!("{head}]\n{tail}"));
    let samplers =
        ["annealing", "uniform", "antipodal", "approach"].map(|sampler| format!("grasps.sampler = \"{sampler}\""));
    let refused = [samplers.as_slice(), &["[physics]".to_owned()]].concat();
    assert_eq!(refused_settings(&check(&path).read_json()), refused);
    let said = check(&path).succeed().stdout;
    let expected = format!("jobs that cannot: {}\n  {}: ", refused.join(", "), folder.path("pincers.toml").display());
    let touch = "jobs that can use this hand: touch.exploration = true, touch.grasp = true\n";
    for expected in [touch, &expected, "three points that may touch"] {
        assert!(said.contains(expected), "{expected} is not in\n{said}");
    }
}
