//! `docs/hands.md`, followed to the letter: its hand is written from its own blocks, looked at, and closed.

use std::{fs, path::Path, process::Command, sync::Arc};

use graspmill::{
    collision::Geometry,
    geom::Shape,
    sim::{HandModel, HandSim, HandWorker, RunEnd},
};
use nalgebra::IsometryMatrix3;

use super::{BARRETT, link};

/// The first block of a language.
fn block(guide: &str, language: &str) -> String {
    let (_, rest) = guide.split_once(&format!("```{language}\n")).expect("a block");
    rest.split_once("```").expect("its end").0.to_owned()
}

#[test]
fn the_guides_hand_opens_and_closes() {
    let guide = fs::read_to_string("docs/hands.md").expect("the guide");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("two_fingers.xml");
    fs::write(&path, block(&guide, "xml")).expect("a file");
    fs::write(path.with_extension("toml"), block(&guide, "toml")).expect("a file");
    let model = HandModel::open(&path).unwrap_or_else(|error| panic!("{error}"));
    let ball = [Geometry { shape: Shape::Sphere { radius: 0.02 }, link_from_shape: IsometryMatrix3::identity() }];
    let mut worker = HandWorker::new(&Arc::new(HandSim::new(&model, &ball).expect("a simulation")));
    let place = IsometryMatrix3::translation(0.0, 0.0, 0.1);
    worker.start(&model.hand().opened(), &place).expect("a posture");
    let run = worker.close(2000);
    assert_eq!(run.end, RunEnd::AtRest, "{run:?}");
    for finger in ["left", "left_tip", "right", "right_tip"] {
        let link = link(model.hand(), finger);
        let touches = run.touches.iter().filter(|touch| touch.link == link);
        println!("{finger}: {:.1?} N", touches.map(|touch| touch.force).collect::<Vec<_>>());
    }
    // Both fingers hold the ball between them.
    let sides = |sign: f64| run.touches.iter().any(|touch| touch.force > 1.0 && touch.normal.y * sign > 0.3);
    assert!(sides(1.0) && sides(-1.0), "{:?}", run.touches);

    let pictures = folder.path().join("pictures");
    let output = Command::new(env!("CARGO_BIN_EXE_graspmill"))
        .args(["hand", "check"])
        .arg(&path)
        .args(["--samples", "200", "--picture"])
        .arg(&pictures)
        .output()
        .expect("graspmill starts");
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for expected in [
        "two_fingers), 0.460 kg",
        "left_tip follows at 0.5000; when left is stopped, goes on at 0.5000 until 0.2 N m",
        "width                    ",
        "left_pad                 left_tip         (0, ",
        "amplitude -0.649 .. 1.096",
        "opened, nothing touches",
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
    let check = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_graspmill")).args(arguments).output().expect("graspmill starts")
    };
    let missing = check(&["hand", "check", "scenes/no_such_hand.xml"]);
    assert_eq!(missing.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&missing.stderr).contains("no_such_hand.xml"));
    let json = check(&["hand", "check", BARRETT, "--samples", "300", "--json"]);
    assert!(json.status.success());
    let report: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
    assert_eq!(report["driven"].as_array().expect("driven").len(), 4);
    assert_eq!(report["driven"][1]["followers"][0]["after_breakaway"], 4.0 / 3.0);
    assert!(
        report["contacts"]
            .as_array()
            .expect("contacts")
            .iter()
            .all(|contact| { contact["off_surface"].as_f64().expect("a number").abs() < 1e-9 })
    );
    assert_eq!(report["exclude"].as_array().expect("pairs that always touch").len(), 0);
    assert_eq!(report["touch_opened"].as_array().expect("pairs").len(), 0);
    // The table's own path does as well.
    let table = Path::new(BARRETT).with_extension("toml");
    assert!(check(&["hand", "check", table.to_str().expect("text"), "--samples", "0"]).status.success());
}
