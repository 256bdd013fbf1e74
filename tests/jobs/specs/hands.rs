//! Touch by hands: kinds of touch, hands, and mistakes with their locations.

use std::{fs, path::Path};

use graspmill::{
    factory::{
        ProduceError,
        job::Job,
        products::{
            completion::{CompletionSettings, channels_of},
            pair::touch::{Exploration, ExplorationTarget, TouchByHand},
        },
        work::Opening,
    },
    format::Channel,
    geom::SimdLevel,
    words::NumberClass,
};

use super::{MINIMAL, assert_same_job, completion, completion_settings, read, resolve, tables};
use crate::support::{files::read_text, workspace::Workspace};

const BARRETT: &str = "../scenes/barrett_bh8_280.xml";

fn with_hand(more: &str) -> String {
    format!("{MINIMAL}[touch]\nhand = {{ model = \"{BARRETT}\" }}\n{more}")
}

fn settings(text: &str, overrides: &[&str]) -> CompletionSettings {
    let draft = read(text, overrides).unwrap_or_else(|errors| panic!("{}", errors.render()));
    completion_settings(draft)
}

fn job(overrides: &[&str]) -> Job {
    let draft = read(&with_hand("exploration = true\n"), overrides);
    resolve(draft.unwrap_or_else(|errors| panic!("{}", errors.render())))
}

#[test]
fn each_kind_is_asked_for_alone() {
    for (more, exploration, grasp, channels) in [
        ("exploration = true\n", Some(6), false, &[Channel::TOUCH_EXPLORATION][..]),
        (
            "exploration = true\napproaches = 9\ngrasp = true\n",
            Some(9),
            true,
            &[Channel::TOUCH_EXPLORATION, Channel::TOUCH_GRASP],
        ),
        ("grasp = true\nrandom_rays = true\n", None, true, &[Channel::TOUCH_RAYS, Channel::TOUCH_GRASP]),
    ] {
        let settings = settings(&with_hand(more), &[]);
        let touch = settings.touch.by_hand.as_ref().expect("a hand touches");
        let approaches = touch.exploration.map(|exploration| exploration.approaches);
        assert_eq!((approaches, touch.grasp), (exploration, grasp), "{more}");
        assert_eq!(touch.approaches(), exploration.unwrap_or(0) + u32::from(grasp));
        assert_eq!(touch.hand.file, Path::new("scenes/barrett_bh8_280.xml"));
        let stored: Vec<Channel> = channels_of(&settings).into_iter().filter(|channel| channel.is_touch()).collect();
        assert_eq!(stored, channels);
    }
    let none = settings(&with_hand("exploration = false\ngrasp = false\napproaches = 3\n"), &[]);
    assert_eq!((none.touch.by_hand, none.touch.random_rays), (None, None));
}

#[test]
fn mistakes_about_hands_say_what_was_meant() {
    let scene = format!("touch.hand.model={BARRETT}");
    let pinned = "touch.hand.content='0000000000000000000000000000000000000000000000000000000000000000'";
    for (overrides, key, parts) in [
        (&["touch.grasp=true"][..], "touch.hand", &["expected the hand that touches", "docs/hands.md"][..]),
        (&["touch.exploration=true"], "touch.hand", &["model = "]),
        (&["touch.approaches=3"], "touch.exploration", &["`exploration = true` beside `approaches`"]),
        (&[&scene], "touch.exploration", &["`exploration = true` or `grasp = true` beside `hand`"]),
        (&[&scene, "touch.grasp=true", "touch.approaches=3"], "touch.exploration", &["beside `approaches`"]),
        (&[&scene, "touch.exploration=true", "touch.approaches=0"], "touch.approaches", &["from 1 to 1000"]),
        (&[&scene, "touch.exploraton=true"], "touch.exploraton", &["did you mean `exploration`?"]),
        (&["touch={grasp=true, hand='a.xml'}"], "touch.hand", &["a table with model"]),
        (
            &["touch.grasp=true", "touch.hand.model=none.xml"],
            "touch.hand.model",
            &["hand not found: jobs/none.xml", "the path: it starts at the job file's folder"],
        ),
        (
            &["touch.grasp=true", "touch.hand.model=../scenes/fetch.xml"],
            "touch.hand.model",
            &["scenes/fetch.toml", "docs/hands.md"],
        ),
        (
            &["touch.grasp=true", "touch.hand.model=../scenes/barrett_bh8_280.toml"],
            "touch.hand.model",
            &["expected the hand's description"],
        ),
        (&[&scene, "touch.grasp=true", pinned], "touch.hand.content", &["scenes/barrett_bh8_280.xml has changed"]),
    ] {
        let errors = read(MINIMAL, overrides).expect_err(overrides[0]);
        assert!(errors.list().iter().any(|error| error.key == key), "{overrides:?}\n{}", errors.render());
        let said = errors.render();
        assert!(parts.iter().all(|part| said.contains(part)), "{overrides:?}: {parts:?} are not in\n{said}");
    }
}

#[test]
fn a_hand_that_the_simulator_refuses_is_named_at_its_key() {
    let folder = Workspace::new();
    folder.write("hand.xml", "<mujoco model=\"claw\"><worldbody><body/></mujoco>");
    folder.write("hand.toml", read_text("scenes/parallel_gripper.toml"));
    let scene = format!("touch.hand.model={}", folder.path("hand.xml").display());
    let errors = read(&with_hand("grasp = true\n"), &[&scene]).expect_err("a fault");
    assert!(errors.list().iter().all(|error| error.key == "touch.hand.model"), "{}", errors.render());
    assert!(errors.render().contains("hand.xml"), "{}", errors.render());
}

#[test]
fn an_exploration_goes_to_unseen_cells_or_as_the_thesis_does() {
    for (overrides, target) in [
        (&[][..], ExplorationTarget::UnseenCells),
        (&["profile=thesis"], ExplorationTarget::FacingAway),
        (&["touch.exploration_target=facing_away"], ExplorationTarget::FacingAway),
        (&["profile=thesis", "touch.exploration_target=unseen_cells"], ExplorationTarget::UnseenCells),
    ] {
        let settings = settings(&with_hand("exploration = true\n"), overrides);
        let exploration = settings.touch.by_hand.and_then(|by_hand| by_hand.exploration).expect("an exploration");
        assert_eq!(exploration, Exploration { approaches: 6, target }, "{overrides:?}");
    }
    let [unseen, facing] = ["unseen_cells", "facing_away"].map(|target| format!("touch.exploration_target={target}"));
    assert_eq!(job(&[&unseen]).digest(), job(&[]).digest());
    assert_ne!(job(&[&facing]).digest(), job(&[]).digest());
    assert_eq!(
        job(&[&facing, "touch={exploration=false, grasp=true}"]).digest(),
        job(&["touch={exploration=false, grasp=true}"]).digest()
    );
}

#[test]
fn a_resolved_job_pins_its_hand_and_reads_back() {
    let plain = job(&[]);
    for overrides in [
        vec![],
        vec!["touch.grasp=true", "touch.random_rays=true"],
        vec!["touch={exploration=false, grasp=true}"],
        vec!["touch.exploration_target=facing_away"],
    ] {
        let job = job(&overrides);
        let text = job.to_toml(Path::new("jobs"));
        let TouchByHand { hand, .. } = completion(&job).settings.touch.by_hand.as_ref().expect("a hand");
        assert!(text.contains(&format!("[touch.hand]\ncontent = \"{}\"\nmodel = \"{BARRETT}\"\n", hand.id)), "{text}");
        let again = resolve(read(&text, &[]).unwrap_or_else(|errors| panic!("{}\n{text}", errors.render())));
        assert_same_job(&again, &job);
    }
    for same in ["touch.hand.model=../scenes/../scenes/barrett_bh8_280.xml", "touch.approaches=6", "name=other"] {
        assert_eq!(job(&[same]).digest(), plain.digest(), "{same}");
    }
    for other in ["touch.approaches=7", "touch.grasp=true", "touch.hand.model=../scenes/parallel_gripper.xml", "seed=2"]
    {
        assert_ne!(job(&[other]).digest(), plain.digest(), "{other}");
        assert_ne!(job(&[other]).sample_settings(), plain.sample_settings(), "{other}");
    }
    // A job without a hand has the same digest as before, and the text, which has every key, names no hand.
    let without = resolve(read(MINIMAL, &[]).expect("a job"));
    let meant = resolve(read(MINIMAL, &["touch.exploration=false", "touch.approaches=3"]).expect("a job"));
    assert_eq!(meant.digest(), without.digest());
    assert!(!meant.to_toml(Path::new("jobs")).contains("[touch.hand]"));
    let mut settings = completion(&plain).settings.clone();
    assert!(settings.touch.by_hand.take().is_some());
    assert_eq!(settings, completion(&without).settings);
}

#[test]
fn a_datasets_tables_name_the_hand_and_the_class_of_what_it_felt() {
    for (renderer, pairs, hands) in [
        ("raster", NumberClass::Exact, NumberClass::Physics),
        ("mujoco-ray", NumberClass::Physics, NumberClass::Physics),
        ("mujoco-gl", NumberClass::Colour, NumberClass::Colour),
    ] {
        let job = job(&["touch.grasp=true", "touch.random_rays=true", &format!("renderer={renderer}")]);
        let header = tables(&job);
        let by_hand = [Channel::TOUCH_EXPLORATION, Channel::TOUCH_GRASP].map(|channel| (channel, hands));
        assert_eq!((header.class, header.channel_classes), (pairs, by_hand.into()), "{renderer}");
        let hand = &completion(&job).settings.touch.by_hand.as_ref().expect("a hand").hand;
        assert_eq!(header.hands, [serde_json::json!({ "object": hand.id, "name": hand.name })]);
        assert!(header.platform.contains_key("libmujoco"), "{renderer}");
    }
    let job = resolve(read(MINIMAL, &[]).expect("a job"));
    let header = tables(&job);
    assert!(header.hands.is_empty() && header.channel_classes.is_empty() && header.platform.is_empty());
}

#[test]
fn a_hand_that_goes_or_changes_while_a_run_goes_on_stops_it() {
    let folder = Workspace::new();
    let file = |ending: &str| folder.path("hand").with_extension(ending);
    for ending in ["xml", "toml"] {
        let own = Path::new("scenes/parallel_gripper").with_extension(ending);
        fs::copy(own, file(ending)).expect("a copy");
    }
    let scene = format!("touch.hand.model={}", file("xml").display());
    let job = job(&[&scene]);
    let opening = Opening { seed: 0, level: SimdLevel::detect(), splits: None };
    let open = || job.work.open(opening).and_then(|work| work.producer().map(drop));
    open().expect("nothing has changed");
    let table = read_text(file("toml"));
    fs::write(file("toml"), table.clone() + "\n").expect("another table");
    let error = open().expect_err("another table");
    assert!(matches!(error, ProduceError::Changed { .. }) && error.to_string().contains("hand.xml: changed during"));
    fs::remove_file(file("toml")).expect("no table");
    let error = open().expect_err("no table");
    assert!(matches!(error, ProduceError::Gone(_)) && error.to_string().contains("restore it"), "{error}");
    fs::write(file("toml"), table).expect("the table again");
    open().expect("as it was");
}
