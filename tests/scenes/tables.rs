//! Tables of everything that is made of scenes: another program compares each value with what the Python package reads in the shards.

use serde_json::Value;

use super::heatmaps::{heatmaps_job, input_jobs};
use crate::support::{
    files::{copy_folder, repository_path},
    first_words::check_first_words,
    jobs::ABOUT,
    program::Program,
    robots::GRIPPER,
    workspace::Workspace,
};

/// Pairs of bodies in clutter with touch by rays.
const PAIRS: &str = "product = \"amodal\"\nseed = 3\ntouch = { random_rays = true }\n[views]\ndataset = \"views\"\n";

/// Poses of a cup on these bodies.
const SUCTION: &str =
    "product = \"suction\"\nseed = 3\n[scenes]\ndataset = \"scenes\"\n[suction]\nposes = 400\nfree = 5\n";

/// A dataset of each product that is made of scenes, made once.
fn with_all() -> Workspace {
    let hand = repository_path(GRIPPER);
    let volumes = format!(
        "product = \"volumes\"\nseed = 3\n[views]\ndataset = \"views\"\n[fusion]\nviews = [1, 3]\nper_scene = 2\nsize = 0.42\n\
         support_height = 0.05\n[picks]\ndataset = \"picks\"\n[hand]\nmodel = {hand:?}\n"
    );
    let mut jobs = input_jobs();
    let suction = SUCTION.to_owned();
    jobs.extend([
        ("amodal", PAIRS.to_owned()),
        ("volumes", volumes),
        ("heatmaps", heatmaps_job("")),
        ("suction", suction),
    ]);
    Workspace::copy_of(&Workspace::with_datasets(&jobs))
}

#[test]
#[ignore = "slow: a dataset of every product in clutter"]
fn run_inspect_report_and_card_of_scenes_begin_with_the_same_words() {
    let workspace = Workspace::beside_fixtures("scenes-words");
    copy_folder(with_all().folder(), workspace.folder());
    let about = workspace.write("about.toml", ABOUT);
    for (product, words) in [
        ("scenes", "scenes with"),
        ("views", "bodies in them are visible"),
        ("amodal", "have a pair"),
        ("volumes", "volumes fused from"),
        ("picks", "bodies have a free grasp; "),
        ("heatmaps", "images have a free grasp; "),
        ("suction", "bodies have a free suction pose; "),
    ] {
        let headline = check_first_words(&workspace.path(product), &about);
        assert!(headline.contains(words), "{product}: {headline}");
    }
}

#[test]
#[ignore = "slow: a dataset of every product in clutter"]
fn every_table_of_scenes_holds_what_the_shards_do() {
    let workspace = with_all();
    for (product, tables) in [
        ("scenes", &["scenes", "bodies", "body_contacts", "supports", "objects"][..]),
        ("views", &["views", "instances", "objects"]),
        ("amodal", &["pairs", "touch", "blocked", "objects"]),
        ("volumes", &["volumes", "volume_grasps", "bodies", "fused_views", "objects"]),
        ("picks", &["picks", "candidates", "bodies", "pick_trials", "pick_contacts", "pick_neighbours", "objects"]),
        ("heatmaps", &["heatmaps", "marks", "forbidden", "objects"]),
        ("suction", &["suction", "suction_poses", "bodies", "objects"]),
    ] {
        let (data, out) = (workspace.path(product), workspace.path(format!("{product}-tables")));
        Program::on("export", &data).args(["--to", "parquet"]).option("--out", &out).succeed();
        let python = Program::python().arg("tests/peers/tables.py").arg(&data).arg(&out);
        let rows: Value = python.env("PYTHONPATH", repository_path("python")).succeed().json();
        println!("{product}: {rows}");
        for table in tables {
            assert!(rows[table].as_u64() > Some(0), "{product}: {table}: {rows}");
        }
    }
}
