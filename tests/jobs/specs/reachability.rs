//! Reachability jobs: defaults, grids, and mistakes with their locations.

use std::{f64::consts::PI, path::Path};

use graspmill::{
    factory::{
        job::Job,
        plan::Plan,
        products::reachability::{CollisionTest, IkSolver, ReachabilityJob},
    },
    format::Product,
    geom::FieldMetric,
};

use super::{MINIMAL, assert_same_job, items, read, work_of};
use crate::support::{
    files::read_text,
    robots::{FETCH_ARM, FETCH_SITE},
    workspace::Workspace,
};

/// A job for the Fetch's arm.
fn fetch() -> String {
    format!(
        r#"
product = "reachability"
[robot]
model = "../scenes/fetch.xml"
joints = {FETCH_ARM:?}
target = "{FETCH_SITE}"
[poses]
x = {{ from = 0.0, to = 1.2, step = 0.1 }}
y = {{ from = -1.1, to = 1.1, step = 0.1 }}
z = {{ from = 0.0, to = 2.0, step = 0.1 }}
roll = 2
pitch = 8
yaw = 8
"#
    )
}

fn job(overrides: &[&str]) -> Job {
    let draft = read(&fetch(), overrides);
    let draft = draft.unwrap_or_else(|errors| panic!("{}", errors.render()));
    draft.resolve(Vec::new()).expect("nothing is left to be read")
}

fn work(job: &Job) -> &ReachabilityJob {
    work_of(job)
}

fn mistakes(text: &str, overrides: &[&str]) -> Vec<(u32, String, &'static str)> {
    let errors = read(text, overrides).expect_err("mistakes");
    errors.list().iter().map(|error| (error.location.line, error.key.clone(), error.problem.code())).collect()
}

#[test]
fn the_grid_of_the_thesis_has_its_count() {
    let job = job(&[]);
    assert_eq!((job.product(), items(&job), job.shard_samples), (Product::REACHABILITY, vec![5280], 512));
    let work = work(&job);
    assert_eq!(work.poses.shape(), [12, 22, 20, 2, 8, 8]);
    assert_eq!((work.poses.cells(), work.orientations()), (675_840, 128));
    assert_eq!((work.solver, work.collisions), (IkSolver::Auto, CollisionTest::Exact));
    assert_eq!(work.metric, FieldMetric::Metres { rho: 0.127 });
    assert_eq!(work.robot.name, "fetch");
    let last = work.poses.pose(675_839);
    let expected = [1.1, 1.0, 1.9, 0.0, 0.75 * PI, 0.75 * PI];
    assert!(last.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-12), "{last:?}");
    let plan = Plan::new(&job.work.subjects(), job.shard_samples);
    assert_eq!((plan.samples, plan.shards.len(), plan.shards[10].samples.clone()), (5280, 11, 5120..5280));

    let half = ["poses.x.step=0.05", "poses.y.step=0.05", "poses.z.step=0.05", "poses.pitch=16", "poses.yaw=16"];
    let half = self::job(&half);
    assert_eq!((items(&half)[0], self::work(&half).poses.cells(), half.shard_samples), (42_240, 21_626_880, 128));
    let odd = self::job(&["poses.x={from=0.0, to=0.35, step=0.1}"]);
    assert_eq!(self::work(&odd).poses.shape()[0], 4, "0, 0.1, 0.2, 0.3");
}

#[test]
fn directions_take_the_place_of_pitch_and_yaw() {
    let directed = fetch().replace("pitch = 8\nyaw = 8", "directions = { healpix = 2 }");
    let read_directed = |overrides: &[&str]| read(&directed, overrides);
    let job = read_directed(&["poses.roll=8"]).unwrap_or_else(|errors| panic!("{}", errors.render()));
    let job = job.resolve(Vec::new()).expect("nothing is left to be read");
    let poses = &work(&job).poses;
    assert_eq!((poses.shape(), poses.cells()), (vec![12, 22, 20, 48, 8], 2_027_520));
    assert_eq!((items(&job)[0], job.shard_samples), (5280, 170));
    let covering = poses.covering().to_string();
    assert!(covering.starts_with("no rotation is more than 32.5 deg from an orientation"), "{covering}");
    let text = job.to_toml(Path::new("jobs"));
    let again = read(&text, &[]).unwrap_or_else(|errors| panic!("{}", errors.render()));
    let again = again.resolve(Vec::new()).expect("nothing is left to be read");
    assert_same_job(&again, &job);
    for other in ["poses.roll=9", "poses.directions.healpix=3"] {
        let other = read_directed(&["poses.roll=8", other]).expect("a job").resolve(Vec::new()).expect("a job");
        assert_ne!(other.digest(), job.digest());
    }
}

#[test]
fn mistakes_about_directions_are_shown_at_once() {
    let directed = fetch().replace("yaw = 8", "directions = { healpix = 2 }");
    let found = mistakes(&directed, &["field.profile=thesis", "poses.x.step=0"]);
    let found: Vec<(&str, &str)> = found.iter().map(|(_, key, code)| (key.as_str(), *code)).collect();
    assert_eq!(
        found,
        [("poses.pitch", "contradiction"), ("field.profile", "contradiction"), ("poses.x.step", "invalid")]
    );
    let said = |text: &str, overrides: &[&str]| read(text, overrides).expect_err("mistakes").render();
    let both = said(&directed, &["field.profile=thesis"]);
    for part in ["contradicts `poses.directions`: directions replace pitch and yaw", "`field.profile = \"standard\"`"] {
        assert!(both.contains(part), "{part} is not in\n{both}");
    }
    let neither = fetch().replace("pitch = 8\nyaw = 8\n", "");
    assert_eq!(
        mistakes(&neither, &[]).into_iter().map(|(_, key, code)| (key, code)).collect::<Vec<_>>(),
        [("poses.pitch".to_owned(), "missing"), ("poses.yaw".to_owned(), "missing")]
    );
    assert!(said(&neither, &[]).contains("directions = { healpix = 2 }"), "{}", said(&neither, &[]));
    let directed = directed.replace("pitch = 8\n", "");
    for (change, part) in [
        ("poses.directions.healpix=0", "from 1 to 16"),
        ("poses.directions.healpix=17", "from 1 to 16"),
        ("poses.directions={ fibonacci = 100 }", "unknown key `fibonacci`"),
        ("poses.roll=400", "more than 16384 orientations"),
    ] {
        let said = said(&directed, &[change]);
        assert!(said.contains(part) && said.contains("1 error"), "{change}: {part} is not in\n{said}");
    }
}

#[test]
fn the_thesis_profile_counts_in_cells() {
    assert_eq!(work(&job(&["profile=thesis"])).metric, FieldMetric::Cells);
    assert_eq!(work(&job(&["profile=thesis", "field.profile=standard"])).metric, FieldMetric::Metres { rho: 0.127 });
    assert_eq!(work(&job(&["field.radian_weight=0.2"])).metric, FieldMetric::Metres { rho: 0.2 });
    assert_eq!(mistakes(&fetch(), &["field={profile='thesis', radian_weight=0.2}"])[0].2, "contradiction");
}

#[test]
fn all_mistakes_are_shown_at_once_with_their_places() {
    let text = r#"product = "reachability"
solver = "closed"
collisions = true
[robot]
model = "../scenes/fetch.xml"
joints = ["a", "b", "a"]
target = "tool"
fixed = { b = 0.0 }
[poses]
x = { from = 0.0, to = 1.0, step = 0.0 }
y = { from = 1.0, to = 0.5, step = 0.1 }
z = { from = 0.0, to = 1.0, step = -0.1 }
roll = 2
pitch = 8
yaw = 8
[grid]
resolution = 40
"#;
    let found = mistakes(text, &["objects=[{built_in=3}]"]);
    let expected = [
        (2, "solver", "not_a_choice"),
        (3, "collisions", "wrong_type"),
        (6, "robot.joints[2]", "invalid"),
        (7, "robot.target", "not_found"),
        (8, "robot.fixed.b", "contradiction"),
        (10, "poses.x.step", "invalid"),
        (11, "poses.y.to", "invalid"),
        (12, "poses.z.step", "invalid"),
        (16, "grid", "unknown_key"),
        (1, "objects", "unknown_key"),
    ];
    let found: Vec<(u32, &str, &str)> = found.iter().map(|(line, key, code)| (*line, key.as_str(), *code)).collect();
    assert_eq!(found, expected);
    let said = read(text, &[]).expect_err("mistakes").render();
    for part in ["step = 0 must be above zero", "`grid` is a key of completion jobs", "did you mean `closed_form`?"] {
        assert!(said.contains(part), "{part} is not in\n{said}");
    }
}

/// A robot whose meshes are a package that was not fetched.
#[test]
fn a_missing_package_is_named_with_the_command_that_fetches_it() {
    let folder = Workspace::new();
    let text = r#"<mujoco><asset><mesh file=".deps/panda/none.stl"/></asset></mujoco>"#;
    let scene = folder.write("robot.xml", text);
    let change = format!("robot.model={}", scene.display());
    assert_eq!(mistakes(&fetch(), &[&change]).iter().map(|found| found.2).collect::<Vec<_>>(), ["not_found"]);
    let said = read(&fetch(), &[&change]).expect_err("a mistake").render();
    assert!(said.contains("none.stl") && said.contains("run `make robots`, which fetches it"), "{said}");
}

#[test]
fn what_is_missing_or_too_much_is_said() {
    assert_eq!(
        mistakes("product = \"reachability\"\n", &[]).into_iter().map(|(_, key, _)| key).collect::<Vec<_>>(),
        ["poses", "robot"]
    );
    let far = ["poses.x.step=0.0000001", "poses.y.step=0.0000001"];
    assert_eq!(mistakes(&fetch(), &far), [(7, "poses".to_owned(), "invalid")]);
    let many = ["poses.x.step=0.01", "poses.y.step=0.01", "poses.z.step=0.01"];
    let said = read(&fetch(), &many).expect_err("too many").render();
    assert!(said.contains("at most 100000000 poses"), "{said}");
    for (change, code) in [
        ("poses.roll=0", "out_of_range"),
        ("poses.x.from=nan", "out_of_range"),
        ("robot.model=none.xml", "not_found"),
        ("robot.joints=[]", "out_of_range"),
        ("robot.content=12", "wrong_type"),
        ("robot.content='0000000000000000000000000000000000000000000000000000000000000000'", "invalid"),
        ("shards.positions=0", "out_of_range"),
        ("shards.samples=10", "unknown_key"),
        ("product=reachabilty", "not_a_choice"),
    ] {
        let found = mistakes(&fetch(), &[change]);
        assert_eq!(found.iter().map(|found| found.2).collect::<Vec<_>>(), [code], "{change}");
    }
    let short = fetch().replacen(", step = 0.1", "", 1);
    assert_eq!(mistakes(&short, &[]), [(8, "poses.x.step".to_owned(), "missing")]);
    let said = read(&format!("[robot]\nmodel = \"x\"\n{MINIMAL}"), &[]).expect_err("a mistake").render();
    assert!(said.contains("`robot` is a key of reachability jobs"), "{said}");
}

#[test]
fn faults_of_the_robot_stand_at_their_keys() {
    for (right, wrong, location) in [
        ("elbow_flex_joint", "elbow_flex_jnt", (5, "robot.joints[3]")),
        (FETCH_SITE, "wrist_rol_link", (6, "robot.target")),
    ] {
        let text = fetch().replace(&format!("\"{right}\""), &format!("\"{wrong}\""));
        let errors = read(&text, &[]).expect_err("a fault");
        let found: Vec<_> = errors.list().iter().map(|error| (error.location.line, error.key.as_str())).collect();
        assert_eq!(found, [location]);
        let said = errors.render();
        for part in [format!("did you mean `{right}`?"), "scenes/fetch.xml".to_owned()] {
            assert!(said.contains(&part), "{part} is not in\n{said}");
        }
    }
    let errors = read(&fetch(), &["robot.model=../scenes/parallel_gripper.toml"]).expect_err("no robot");
    assert!(errors.list().iter().all(|error| error.key == "robot.model"), "{}", errors.render());
}

#[test]
fn a_resolved_job_reads_back_and_its_digest_knows_what_labels_depend_on() {
    let plain = job(&[]);
    for overrides in [
        vec![],
        vec!["profile=thesis", "solver=numeric", "collisions=none"],
        vec!["poses.x={from=0.05,to=1.1,step=0.07}", "robot.fixed={torso_lift_joint=0.1}", "field.radian_weight=0.3"],
        vec!["robot.frame=base_link"],
    ] {
        let job = job(&overrides);
        let text = job.to_toml(Path::new("jobs"));
        let again = read(&text, &[]).unwrap_or_else(|errors| panic!("{}\n{text}", errors.render()));
        let again = again.resolve(Vec::new()).expect("nothing is left to be read");
        assert_same_job(&again, &job);
        assert_eq!(again.to_toml(Path::new("jobs")), text);
    }
    for same in
        ["name=other", "shards.positions=10", "robot.model=../scenes/../scenes/fetch.xml", "field.radian_weight=0.127"]
    {
        assert_eq!(job(&[same]).digest(), plain.digest(), "{same}");
    }
    let folder = Workspace::new();
    let scene =
        folder.write("fetch.xml", read_text("scenes/fetch.xml").replace("</mujoco>", "<!-- another -->\n</mujoco>"));
    let other_scene = format!("robot.model={}", scene.display());
    for other in [
        "seed=1",
        "poses.yaw=4",
        "poses.x.to=1.3",
        "collisions=none",
        "solver=numeric",
        "field.profile=thesis",
        "robot.joints=['shoulder_pan_joint', 'elbow_flex_joint']",
        "robot.frame=base_link",
        "robot.fixed={torso_lift_joint=0.1}",
        &other_scene,
    ] {
        assert_ne!(job(&[other]).digest(), plain.digest(), "{other}");
    }
}
