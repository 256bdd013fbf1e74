//! Jobs for grasps: defaults of both profiles, mistakes with their locations, and digests.

use std::path::Path;

use graspmill::{
    factory::{job::Job, plan::Plan, products::grasps::GraspJob},
    format::{Channel, Product},
    grasp::{AmplitudeRange, EnergyKind, PairHold, RestingChoice, Sampler, SearchFrame, Support, WrenchSpace},
    words::NumberClass,
};

use super::{items, read, resolve, tables, work_of};
use crate::support::{files::read_text, workspace::Workspace};

const BARRETT: &str = "../scenes/barrett_bh8_280.xml";
const PARALLEL_GRIPPER: &str = "../scenes/parallel_gripper.xml";
/// The setting of a hand that is a gripper.
const GRIPPER: &str = "hand.model=../scenes/parallel_gripper.xml";

fn text(more: &str) -> String {
    format!(
        "product = \"grasps\"\n[hand]\nmodel = \"{BARRETT}\"\n[[objects]]\nbuilt_in = [\"can-*\", \"bowl-*\"]\n{more}"
    )
}

fn job(overrides: &[&str]) -> Job {
    resolve(read(&text(""), overrides).unwrap_or_else(|errors| panic!("{}", errors.render())))
}

fn work(job: &Job) -> &GraspJob {
    work_of(job)
}

#[test]
fn the_smallest_job_has_the_standard_defaults_and_the_thesis_its_own() {
    let standard = job(&[]);
    assert_eq!((standard.product(), items(&standard)), (Product::GRASPS, vec![20; 4]));
    assert_eq!(standard.shard_samples, 20, "the runs of one object");
    let plan = Plan::new(&standard.work.subjects(), standard.shard_samples);
    assert_eq!((plan.samples, plan.shards.len()), (80, 4));
    let settings = &work(&standard).settings;
    let (annealing, keeping) = (&settings.annealing, &settings.keeping);
    assert_eq!((annealing.steps, annealing.energy), (5_000, EnergyKind::ContactAndPotential));
    assert_eq!((annealing.space, annealing.frame), (WrenchSpace::Wrench, SearchFrame::Seed));
    assert_eq!((annealing.potential_scale, annealing.whole_schedule, annealing.descent), (100.0, true, false));
    assert_eq!((annealing.amplitudes, annealing.best, annealing.max_failures), (AmplitudeRange::Joints, 20, 100));
    assert_eq!((annealing.friction, keeping.friction, keeping.edges, keeping.torsion), (0.2, 0.5, 16, None));
    assert_eq!((keeping.space, keeping.min_epsilon, keeping.advance), (WrenchSpace::Wrench, 0.01, 0.03));

    let thesis = job(&["profile=thesis"]);
    let settings = &work(&thesis).settings;
    let (annealing, keeping) = (&settings.annealing, &settings.keeping);
    assert_eq!((annealing.steps, annealing.potential_scale, annealing.whole_schedule), (70_000, 1.0, false));
    assert_eq!((annealing.space, annealing.frame), (WrenchSpace::Force, SearchFrame::Object));
    assert_eq!(annealing.amplitudes, AmplitudeRange::Clamped(4.0));
    assert_eq!((keeping.space, keeping.friction, keeping.advance), (WrenchSpace::Force, 0.2, 0.0));
    // Each switch can be set alone.
    let mixed = job(&["profile=thesis", "annealing.frame=seed", "annealing.amplitudes=joints", "keep.torsion=0.1"]);
    let settings = &work(&mixed).settings;
    assert_eq!((settings.annealing.frame, settings.annealing.amplitudes), (SearchFrame::Seed, AmplitudeRange::Joints));
    assert_eq!(settings.keeping.torsion, Some(0.1));
}

#[test]
fn mistakes_are_shown_at_once_with_their_places() {
    let wrong = concat!(
        "product = \"grasps\"\n[[objects]]\nbuilt_in = 3\n[annealing]\nenergy = \"contacts\"\nstep = 10\nfriction = 0\n",
        "amplitudes = { clamp = 4.0 }\n[keep]\ncone_edges = 2\nspace = \"wrench\"\n[grasps]\nviews = 3\n"
    );
    let errors = read(wrong, &[]).expect_err("mistakes");
    let found: Vec<(&str, &str)> =
        errors.list().iter().map(|error| (error.key.as_str(), error.problem.code())).collect();
    for key in [
        "hand",
        "annealing.energy",
        "annealing.step",
        "annealing.friction",
        "annealing.amplitudes.clamp",
        "keep.cone_edges",
        "grasps.views",
    ] {
        assert!(found.iter().any(|(found, _)| *found == key), "{key} is not in {found:?}");
    }
    let said = errors.render();
    for part in ["did you mean `contact`?", "did you mean `steps`?", "expected one of clamped", "a table with model"] {
        assert!(said.contains(part), "{part} is not in\n{said}");
    }
    for (overrides, key, part) in [
        (
            &["annealing.energy=contact", "annealing.potential_scale=2.0"][..],
            "annealing.potential_scale",
            "no potential",
        ),
        (&["grasps.sampler=uniform", "annealing.steps=50"], "annealing.steps", "there is no search"),
        (&["grasps.sampler=uniform", "uniform.rolls=[nan]"], "uniform.rolls[0]", "a number"),
        (&["uniform.grasps=50"], "uniform", "settings of another sampler"),
        (&["grasps.sampler=antipodal", "uniform={poses=\"any\"}"], "uniform", "settings of another sampler"),
        (&[GRIPPER, "grasps.sampler=antipodal", "keep.advance=0.01"], "keep.advance", "stays at its drawn depth"),
        (
            &[GRIPPER, "grasps.sampler=antipodal", "antipodal.margin=0.01"],
            "antipodal.margin",
            "no table to keep away from",
        ),
        (
            &[GRIPPER, "grasps.sampler=antipodal", "antipodal.resting_pose=most_likely"],
            "antipodal.resting_pose",
            "no table to rest on",
        ),
        (
            &[GRIPPER, "grasps.sampler=antipodal", "antipodal={depth=\"middle\",support=\"table\"}"],
            "antipodal.support",
            "a table needs \"any\"",
        ),
        (&["grasps.sampler=approach", "antipodal.best=5"], "antipodal", "settings of another sampler"),
        (&["approach.draws=5"], "approach", "settings of another sampler"),
        (&["grasps.sampler=approach", "keep.advance=0.01"], "keep.advance", "as far as it can"),
        (&["annealing.steps=50", "annealing.max_failures=60"], "annealing.max_failures", "no seed is ever abandoned"),
        (&["annealing.amplitudes={clamped=0.0}"], "annealing.amplitudes.clamped", "above 0"),
        (&["keep.torsion=0"], "keep.torsion", "above 0"),
        (&["hand.model=../scenes/barrett_bh8_280.toml"], "hand.model", "the hand's description"),
        (&["hand.model=../scenes/none.xml"], "hand.model", "none.xml"),
        (&[&format!("hand.content=\"{}\"", "0".repeat(64))[..]], "hand.content", "has changed"),
        (&["robot=7"], "robot", "key of reachability jobs"),
    ] {
        let errors = read(&text(""), overrides).expect_err("a mistake");
        assert!(errors.list().iter().any(|error| error.key == key), "{overrides:?}\n{}", errors.render());
        assert!(errors.render().contains(part), "{overrides:?}\n{}", errors.render());
    }
    for (physics, key) in
        [("friction=-1", "friction"), ("mass=\"heavy\"", "mass"), ("rollout_share=0\nrollouts=3", "rollouts")]
    {
        let errors = read(&text(&format!("[physics]\n{physics}\n")), &[]).expect_err("a mistake");
        let key = format!("physics.{key}");
        assert!(errors.list().iter().any(|error| error.key == key), "{key}\n{}", errors.render());
    }
    // A short run needs no remark about when it gives up.
    assert_eq!(work(&job(&["annealing.steps=50"])).settings.annealing.max_failures, 100);
    let said = read("product = \"grasp\"\n", &[]).expect_err("a misspelt product").render();
    assert!(said.contains("did you mean `grasps`?") && said.contains("objects"), "{said}");
}

#[test]
fn a_hand_that_cannot_grasp_is_named_at_its_key() {
    let folder = Workspace::new();
    folder.write("hand.xml", read_text("scenes/parallel_gripper.xml"));
    folder.write("hand.toml", "");
    let scene = format!("hand.model={}", folder.path("hand.xml").display());
    let errors = read(&text(""), &[&scene]).expect_err("a fault");
    assert!(errors.list().iter().all(|error| error.key == "hand.model"), "{}", errors.render());
    assert!(errors.render().contains("hand.toml"), "{}", errors.render());
}

#[test]
fn a_resolved_job_reads_back_and_its_digest_knows_what_grasps_depend_on() {
    let plain = job(&[]);
    for overrides in [
        vec![],
        vec!["profile=thesis", "keep.torsion=0.02", "split.test_objects=[\"can-*\"]"],
        vec!["physics={}"],
        vec!["physics={tried=\"kept\",variant_share=0.5,table=false}"],
        vec![
            "physics={friction=0.2,mass=0.3,perturbed_runs=0,rollout_share=0.1,rollouts=4,gravity=\"six_directions\"}",
        ],
        vec!["annealing.energy=contact", "annealing.descent=true", "grasps.seeds=7", "shards.runs=5"],
        vec!["grasps.sampler=uniform", "profile=thesis"],
        vec!["grasps.sampler=uniform", "uniform={grasps=7,poses=\"any\",rolls=[0.5]}", "annealing.energy=contact"],
        vec![GRIPPER, "grasps.sampler=antipodal", "antipodal={pairs=70,friction=0.3,best=5}", "annealing.friction=0.5"],
        vec![GRIPPER, "grasps.sampler=antipodal", "antipodal={support=\"table\",margin=0.01}"],
        vec![GRIPPER, "grasps.sampler=antipodal", "antipodal.depth=middle", "keep.advance=0.01"],
        vec![GRIPPER, "grasps.sampler=antipodal", "profile=thesis"],
    ] {
        let job = job(&overrides);
        let text = job.to_toml(Path::new("jobs"));
        let again = resolve(read(&text, &[]).unwrap_or_else(|errors| panic!("{}\n{text}", errors.render())));
        // A scale of nothing has its default again.
        assert_eq!(again.digest(), job.digest(), "{text}");
        assert_eq!(again.to_toml(Path::new("jobs")), text);
        let scene = if overrides.contains(&GRIPPER) { PARALLEL_GRIPPER } else { BARRETT };
        assert!(
            text.contains(&format!("[hand]\ncontent = \"{}\"\nmodel = \"{scene}\"\n", work(&job).hand.id)),
            "{text}"
        );
    }
    for same in ["name=other", "shards.runs=3", "hand.model=../scenes/../scenes/barrett_bh8_280.xml"] {
        assert_eq!(job(&[same]).digest(), plain.digest(), "{same}");
    }
    for other in [
        "seed=1",
        "grasps.seeds=21",
        "annealing.steps=9999",
        "annealing.energy=contact",
        "annealing.space=force",
        "annealing.friction=0.3",
        "annealing.potential_scale=1.0",
        "annealing.whole_schedule=false",
        "annealing.descent=true",
        "annealing.frame=object",
        "annealing.amplitudes={clamped=4.0}",
        "annealing.best=10",
        "annealing.max_failures=10",
        "keep.friction=0.2",
        "keep.cone_edges=8",
        "keep.torsion=0.002",
        "keep.space=force",
        "keep.min_epsilon=0.0",
        "keep.advance=0.0",
        "keep.max_penetration=0.001",
        "keep.table=true",
        GRIPPER,
        "physics={}",
        "physics.friction=0.2",
        "grasps.sampler=uniform",
    ] {
        assert_ne!(job(&[other]).digest(), plain.digest(), "{other}");
        assert_ne!(job(&[other]).sample_settings(), plain.sample_settings(), "{other}");
    }
    for other in ["uniform.grasps=21", "uniform.poses=any", "uniform.rolls=[0.1]", "annealing.energy=contact"] {
        let uniform = "grasps.sampler=uniform";
        assert_ne!(job(&[uniform, other]).digest(), job(&[uniform]).digest(), "{other}");
    }
    let split = job(&["split.test_objects=2"]);
    assert_ne!(split.digest(), plain.digest());
    assert_eq!(split.sample_settings(), plain.sample_settings());
    for other in [
        "tried=\"kept\"",
        "confirm=\"failed\"",
        "variant_share=0",
        "series_share=0",
        "table=false",
        "table_friction=0.3",
        "perturbed_runs=0",
    ] {
        let physics = format!("physics={{{other}}}");
        assert_ne!(job(&[&physics]).digest(), job(&["physics={}"]).digest(), "{other}");
    }
}

#[test]
fn the_digest_depends_on_every_setting_of_approaches() {
    let whole = job(&["grasps.sampler=approach", "approach={draws=70,cone=0.2,friction=0.3,best=5}"]);
    let text = whole.to_toml(Path::new("jobs"));
    let again = resolve(read(&text, &[]).unwrap_or_else(|errors| panic!("{}\n{text}", errors.render())));
    assert_eq!((again.digest(), again.to_toml(Path::new("jobs"))), (whole.digest(), text));
    for other in ["approach.draws=70", "approach.cone=0.2", "approach.friction=0.3", "approach.best=5"] {
        let approach = "grasps.sampler=approach";
        assert_ne!(job(&[approach, other]).digest(), job(&[approach]).digest(), "{other}");
    }
}

/// Antipodal grasps are of grippers alone, and their settings count.
#[test]
fn pairs_are_taken_along_the_pads_unless_the_thesis_is_asked() {
    let antipodal = "grasps.sampler=antipodal";
    assert_ne!(job(&[GRIPPER, antipodal]).digest(), job(&[GRIPPER]).digest());
    for other in [
        "antipodal.pairs=70",
        "antipodal.friction=0.25",
        "antipodal.best=7",
        "antipodal.depth=middle",
        "antipodal.support=table",
    ] {
        assert_ne!(job(&[GRIPPER, antipodal, other]).digest(), job(&[GRIPPER, antipodal]).digest(), "{other}");
    }
    let table = [GRIPPER, antipodal, "antipodal.support=table"];
    for other in ["antipodal.margin=0.01", "antipodal.resting_pose=most_likely"] {
        assert_ne!(job(&[&table[..], &[other]].concat()).digest(), job(&table).digest(), "{other}");
    }
    // The profile of the thesis takes pairs half way along the pads, as before there was a choice.
    let hold = |overrides: &[&str]| match &work(&job(overrides)).settings.sampler {
        Sampler::Antipodal(antipodal) => antipodal.hold,
        other => panic!("{other:?}"),
    };
    assert_eq!(hold(&[GRIPPER, antipodal]), PairHold::Along(Support::Air));
    assert_eq!(hold(&table), PairHold::Along(Support::Table { margin: 0.002, resting: RestingChoice::Drawn }));
    assert_eq!(hold(&[GRIPPER, antipodal, "profile=thesis"]), PairHold::Middle);
}

#[test]
fn tables_name_the_hand_and_costs_grow_with_the_steps() {
    let plain = job(&[]);
    let header = tables(&plain);
    let hand = &work(&plain).hand;
    assert_eq!(header.hands, [serde_json::json!({ "object": hand.id, "name": hand.name })]);
    assert_eq!((header.class, header.assets.len()), (NumberClass::Exact, 4));
    assert!(header.channel_classes.is_empty() && header.platform.is_empty());
    let tried = job(&["physics={}"]);
    let physics = work(&tried).settings.physics.expect("physics");
    assert_eq!((physics.friction, physics.mass, physics.perturbed_runs), (0.5, None, 2));
    assert_eq!((physics.rollouts, physics.rollout_share, physics.six_directions), (10, 0.04, false));
    assert_eq!(work(&plain).settings.physics, None);
    let header = tables(&tried);
    assert_eq!(header.channel_classes, [(Channel::GRASP_TRIALS, NumberClass::Physics)].into_iter().collect());
}
