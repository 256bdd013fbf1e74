//! Touch by hands: what is asked of which hand, and mistakes with their places.

use std::{fs, path::Path};

use graspmill::{
    dataset::NumberClass,
    job::{
        Completion, Job, JobDraft, JobErrors, JobHand, JobText, Surroundings, TouchByHand, expected_bytes, no_hands,
        seconds_of_hands,
    },
    produce::{ProduceError, check_hand, completion::channels_of},
    record::Channel,
    run::dataset_header,
};

use super::{MINIMAL, completion, draft_of, read, resolve, surroundings};

const BARRETT: &str = "../scenes/barrett_bh8_280.xml";

fn with_hand(more: &str) -> String {
    format!("{MINIMAL}[touch]\nhand = {{ scene = \"{BARRETT}\" }}\n{more}")
}

fn settings(text: &str, overrides: &[&str]) -> Completion {
    let draft = read(text, overrides).unwrap_or_else(|errors| panic!("{}", errors.render()));
    draft_of(&draft).settings.clone()
}

fn job(overrides: &[&str]) -> Job {
    let draft = read(&with_hand("exploration = true\n"), overrides);
    resolve(draft.unwrap_or_else(|errors| panic!("{}", errors.render())))
}

fn read_with(text: &str, hands: &dyn Fn(&JobHand) -> Result<(), String>) -> Result<JobDraft, JobErrors> {
    let (label, folder, overrides) = ("test.toml".to_owned(), "jobs".into(), Vec::new());
    let job = JobText { label, folder, text: text.to_owned(), overrides };
    JobDraft::read(&job, &Surroundings { hands, ..surroundings("no/such/folder") })
}

#[test]
fn each_kind_is_asked_for_alone() {
    for (more, exploration, grasp, channels) in [
        ("exploration = true\n", Some(6), false, &[Channel::TouchExploration][..]),
        (
            "exploration = true\napproaches = 9\ngrasp = true\n",
            Some(9),
            true,
            &[Channel::TouchExploration, Channel::TouchGrasp],
        ),
        ("grasp = true\nrandom_rays = true\n", None, true, &[Channel::TouchRays, Channel::TouchGrasp]),
    ] {
        let settings = settings(&with_hand(more), &[]);
        let touch = settings.touch.by_hand.as_ref().expect("a hand touches");
        assert_eq!((touch.exploration, touch.grasp), (exploration, grasp), "{more}");
        assert_eq!(touch.approaches(), exploration.unwrap_or(0) + u32::from(grasp));
        assert_eq!(touch.hand.scene, Path::new("scenes/barrett_bh8_280.xml"));
        let stored: Vec<Channel> = channels_of(&settings).into_iter().filter(|channel| channel.is_touch()).collect();
        assert_eq!(stored, channels);
    }
    let none = settings(&with_hand("exploration = false\ngrasp = false\napproaches = 3\n"), &[]);
    assert_eq!((none.touch.by_hand, none.touch.random_rays), (None, None));
}

#[test]
fn mistakes_about_hands_say_what_was_meant() {
    let scene = format!("touch.hand.scene={BARRETT}");
    let pinned = "touch.hand.content='0000000000000000000000000000000000000000000000000000000000000000'";
    for (overrides, key, parts) in [
        (&["touch.grasp=true"][..], "touch.hand", &["expected the hand that touches", "docs/hands.md"][..]),
        (&["touch.exploration=true"], "touch.hand", &["scene = "]),
        (&["touch.approaches=3"], "touch.exploration", &["`exploration = true` beside `approaches`"]),
        (&[&scene], "touch.exploration", &["`exploration = true` or `grasp = true` beside `hand`"]),
        (&[&scene, "touch.grasp=true", "touch.approaches=3"], "touch.exploration", &["beside `approaches`"]),
        (&[&scene, "touch.exploration=true", "touch.approaches=0"], "touch.approaches", &["from 1 to 1000"]),
        (&[&scene, "touch.exploraton=true"], "touch.exploraton", &["did you mean `exploration`?"]),
        (&["touch={grasp=true, hand='a.xml'}"], "touch.hand", &["a table with scene"]),
        (
            &["touch.grasp=true", "touch.hand.scene=none.xml"],
            "touch.hand.scene",
            &["hand not found: jobs/none.xml", "the path: it starts at the job file's folder"],
        ),
        (
            &["touch.grasp=true", "touch.hand.scene=../scenes/fetch.xml"],
            "touch.hand.scene",
            &["scenes/fetch.toml", "docs/hands.md"],
        ),
        (
            &["touch.grasp=true", "touch.hand.scene=../scenes/barrett_bh8_280.toml"],
            "touch.hand.scene",
            &["expected the hand's MJCF file"],
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
    let text = with_hand("grasp = true\n");
    let refused = |hand: &JobHand| Err(format!("{}: {}: no palm", hand.scene.display(), hand.name));
    let said = read_with(&text, &refused).expect_err("a fault").render();
    assert!(said.contains("touch.hand.scene") && said.contains("barrett_bh8_280.xml: barrett"), "{said}");
    let said = read_with(&text, &no_hands).expect_err("no simulator").render();
    assert!(said.contains("this build has no simulator to read a hand with (feature `sim`)"), "{said}");
}

#[test]
fn a_resolved_job_pins_its_hand_and_reads_back() {
    let plain = job(&[]);
    for overrides in
        [vec![], vec!["touch.grasp=true", "touch.random_rays=true"], vec!["touch={exploration=false, grasp=true}"]]
    {
        let job = job(&overrides);
        let text = job.to_toml(Path::new("jobs"));
        let TouchByHand { hand, .. } = completion(&job).settings.touch.by_hand.as_ref().expect("a hand");
        assert!(text.contains(&format!("[touch.hand]\nscene = \"{BARRETT}\"\ncontent = \"{}\"\n", hand.id)), "{text}");
        let again = resolve(read(&text, &[]).unwrap_or_else(|errors| panic!("{}\n{text}", errors.render())));
        assert_eq!(again, job, "{text}");
        assert_eq!((again.digest(), again.to_toml(Path::new("jobs"))), (job.digest(), text));
    }
    for same in ["touch.hand.scene=../scenes/../scenes/barrett_bh8_280.xml", "touch.approaches=6", "name=other"] {
        assert_eq!(job(&[same]).digest(), plain.digest(), "{same}");
    }
    for other in ["touch.approaches=7", "touch.grasp=true", "touch.hand.scene=../scenes/parallel_gripper.xml", "seed=2"]
    {
        assert_ne!(job(&[other]).digest(), plain.digest(), "{other}");
        assert_ne!(job(&[other]).sample_settings(), plain.sample_settings(), "{other}");
    }
    // Asking for no hand leaves no trace, in text or digest.
    let without = resolve(read(MINIMAL, &[]).expect("a job"));
    let meant = resolve(read(MINIMAL, &["touch.exploration=false", "touch.approaches=3"]).expect("a job"));
    assert_eq!(meant.digest(), without.digest());
    assert!(!meant.to_toml(Path::new("jobs")).contains("[touch"));
    let mut settings = completion(&plain).without_hands().settings;
    assert_eq!(settings.touch.by_hand.take(), None);
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
        let header = dataset_header(&job, None, Path::new("jobs"));
        let by_hand = [Channel::TouchExploration, Channel::TouchGrasp].map(|channel| (channel, hands));
        assert_eq!((header.class, header.channel_classes), (pairs, by_hand.into()), "{renderer}");
        let hand = &completion(&job).settings.touch.by_hand.as_ref().expect("a hand").hand;
        assert_eq!(header.hands, [serde_json::json!({ "object": hand.id, "name": hand.name })]);
        assert_eq!(header.platform.contains_key("libmujoco"), cfg!(feature = "sim"), "{renderer}");
    }
    let job = resolve(read(MINIMAL, &[]).expect("a job"));
    let header = dataset_header(&job, None, Path::new("jobs"));
    assert!(header.hands.is_empty() && header.channel_classes.is_empty() && header.platform.is_empty());
}

#[test]
fn hands_are_expected_to_take_their_time_and_their_bytes() {
    let plain = resolve(read(MINIMAL, &[]).expect("a job"));
    let both = job(&["touch.grasp=true"]);
    assert_eq!((seconds_of_hands(&plain), seconds_of_hands(&both.without_hands())), (0.0, 0.0));
    // Six approaches take what taking hold takes six times; an object is prepared once.
    let more = |settings: &[&str]| seconds_of_hands(&job(settings)) - seconds_of_hands(&job(&[]));
    assert!((more(&["touch.approaches=12"]) / more(&["touch.grasp=true"]) - 6.0).abs() < 1e-9);
    assert!(seconds_of_hands(&job(&[])) > more(&["touch.approaches=12"]));
    let bytes = |job: &Job| expected_bytes(job, 0.0);
    assert_eq!(bytes(&both.without_hands()), bytes(&plain));
    assert!(bytes(&both) > bytes(&job(&[])) && bytes(&job(&["touch.approaches=12"])) > bytes(&both));
}

#[test]
fn a_hand_that_goes_or_changes_while_a_run_goes_on_stops_it() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let file = |ending: &str| folder.path().join("hand").with_extension(ending);
    for ending in ["xml", "toml"] {
        let own = Path::new("scenes/parallel_gripper").with_extension(ending);
        fs::copy(own, file(ending)).expect("a copy");
    }
    let scene = format!("touch.hand.scene={}", file("xml").display());
    let job = job(&[&scene]);
    let hand = &completion(&job).settings.touch.by_hand.as_ref().expect("a hand").hand;
    check_hand(hand).expect("nothing has changed");
    let table = fs::read_to_string(file("toml")).expect("the table");
    fs::write(file("toml"), table.clone() + "\n").expect("another table");
    let error = check_hand(hand).expect_err("another table");
    assert!(matches!(error, ProduceError::HandChanged { .. }) && error.to_string().contains("hand.xml: changed while"));
    fs::remove_file(file("toml")).expect("no table");
    let error = check_hand(hand).expect_err("no table");
    assert!(matches!(error, ProduceError::HandGone { .. }) && error.to_string().contains("put it back"), "{error}");
    fs::write(file("toml"), table).expect("the table again");
    check_hand(hand).expect("as it was");
}
