//! Picks whose grasps are sampled in the scene, from the job file to the reader: in bins, on tables, and as inputs of other products.

use std::{collections::BTreeMap, path::Path};

use graspmill::{
    files::Folder,
    format::{
        PickFacts, PickSampling, TakenGrasps,
        dataset::{DatasetReader, Sample},
    },
};

use super::{
    heatmaps::heatmaps_job,
    picks::{candidates, samples, trials},
};
use crate::support::{
    files::{FULL_CHECK, assert_intact, repository_path},
    jobs::NO_SPLIT,
    program::{Program, print_root},
    robots::GRIPPER,
    workspace::Workspace,
};

/// A shallow bin of three of four shapes.
const BIN: &str = "product = \"scenes\"\nseed = 5\nmode = \"bin\"\ncount = 3\ncontainer = { inner_size = [0.4, 0.4, 0.06] }\n\
                   scenes = { training = 1 }\n[[objects]]\nbuilt_in = [\"bottle-01\", \"box-01\", \"can-01\", \"cup-01\"]\n";

/// Shapes of the bin on a table: alone, and close together.
const ALONE: &str = "product = \"scenes\"\nseed = 5\nmode = \"table\"\ncount = 1\nscenes = { training = 2 }\n[[objects]]\n\
                     built_in = [\"bottle-01\", \"cup-01\"]\n";
const PACKED: &str = "product = \"scenes\"\nseed = 5\nmode = \"packed\"\ncount = 3\nscenes = { training = 1 }\n[[objects]]\n\
                      built_in = [\"bottle-01\", \"box-01\", \"can-01\", \"cup-01\"]\n";

fn job(scenes: &str, picks: &str) -> String {
    format!(
        "product = \"picks\"\nseed = 3\n[scenes]\ndataset = \"{scenes}\"\n[hand]\nmodel = {:?}\n\
         [picks]\nposes = 3000\ncandidates = 40\n{picks}\n[shards]\nsamples = 2\n",
        repository_path(GRIPPER)
    )
}

fn sampling(sample: &Sample) -> PickSampling {
    sample.find::<PickSampling>().expect("readable").expect("sampled")
}

/// Facts of all samples: those of the records, equal to those of the tables; and the bodies with a free grasp.
fn counted(folder: &Path) -> (BTreeMap<&'static str, u64>, usize) {
    let reader = DatasetReader::open(&Folder::at(folder)).expect("a dataset");
    let (mut sums, mut with_free) = (BTreeMap::new(), 0);
    for sample in samples(folder) {
        let (record, sampling) = (candidates(&sample), sampling(&sample));
        assert_eq!((record.take, record.stored, record.rolls), (TakenGrasps::Sampled, 0, 1));
        assert_eq!(sampling.check_beside(&record), Ok(()));
        assert_eq!((sampling.budget, sampling.friction), (3000, 0.4));
        assert!((sampling.half_angle.to_degrees() - 60.0).abs() < 1e-9);
        let facts = PickFacts::from_candidates(&record, None, Some(&sampling));
        assert_eq!(facts.free + facts.lost.iter().sum::<u32>(), facts.candidates);
        with_free += usize::from(facts.free > 0);
        let poses = facts.sampling.poses;
        for (name, count) in [
            ("free", facts.free),
            ("poses", poses.poses),
            ("poses_alike", poses.alike),
            ("poses_rejected_by_container", poses.rejected[1]),
            ("blocked_by_neighbour", facts.sampling.blocked_by[3]),
        ] {
            *sums.entry(name).or_insert(0) += u64::from(count);
        }
        // A body without a free grasp states what blocks it, unless no pose met anything.
        let is_blocked = facts.sampling.blocked_by.iter().sum::<u32>() == 1;
        let meets = poses.rejected.iter().chain(&poses.blocked).any(|count| *count > 0);
        assert_eq!(is_blocked, facts.free == 0 && meets, "{facts:?}");
    }
    for (name, sum) in &sums {
        assert_eq!(reader.manifest().counts.fact(name), *sum, "{name}");
    }
    (sums, with_free)
}

/// Prints what the Python package reads of sampled picks.
const READ: &str = "\
import json, sys, graspmill, numpy as np
data = graspmill.Dataset(sys.argv[1], graspmill.PickSample)
free = 0
for sample in data:
    sampling, n = sample.sampling, len(sample.runs)
    lost = sampling.unopposed + sampling.too_wide + sampling.tilted + sampling.too_low + sampling.alike
    assert sampling.poses == lost + sum(sampling.rejected.values()) + sum(sampling.blocked.values()) + sampling.free
    assert sampling.free == sample.free.sum() and (sample.ranks < sampling.poses).all()
    assert sampling.points.shape == (n, 2, 3) and sampling.openings.shape == sampling.depths.shape == (n,)
    assert (sampling.schemes < len(graspmill.PICK_SCHEMES)).all() and (sampling.blocked_by is None or sampling.free == 0)
    widths = np.linalg.norm(sampling.points[:, 1] - sampling.points[:, 0], axis=1)
    assert (widths < sampling.openings).all() and (sampling.depths >= 0.003).all()
    free += int(sampling.free)
print(json.dumps([free, int(data.column('free').sum()), int(data.column('poses').sum())]))
";

#[test]
fn grasps_are_sampled_in_a_bin_and_used_by_other_products() {
    let inputs = [("scenes", format!("{BIN}{NO_SPLIT}"))];
    let workspace = Workspace::copy_of(&Workspace::with_datasets(&inputs));
    let picks = workspace.make_dataset("picks", &job("scenes", "trials = 1"), &[]);
    assert_intact(&picks, FULL_CHECK);
    Program::on("verify", &picks).option("--regenerate", "3").succeed();
    Program::run_job(workspace.path("picks.toml"), workspace.path("one")).option("--threads", "1").succeed();
    assert_eq!(print_root(&picks), print_root(workspace.path("one")));
    let (sums, with_free) = counted(&picks);
    assert!(with_free >= 1 && sums["poses_rejected_by_container"] > 0, "{sums:?}");
    // The only trial of a body is of a free grasp.
    assert!(samples(&picks).iter().all(|sample| trials(sample).check_beside(&candidates(sample)).is_ok()));
    assert!(workspace.read("picks/job.toml").contains("sampler = \"scene\""));

    let read: [u64; 3] =
        Program::python_lines(READ).arg(&picks).env("PYTHONPATH", repository_path("python")).succeed().json();
    assert_eq!(read, [sums["free"], sums["free"], sums["poses"]]);
    let inspected = Program::on("inspect", &picks).succeed().text();
    assert!(inspected.contains("rejected by container"), "{inspected}");
    Program::on("report", &picks).succeed();
    let page = workspace.read("picks/report.html");
    assert!(page.contains("From poses to held grasps") && page.contains("Lost poses by reason"));

    // Images and volumes mark the same grasps, without a dataset of grasps.
    let views = "product = \"views\"\nseed = 3\n[scenes]\ndataset = \"scenes\"\n[views]\nmin_pixels = 50\n\
                 cameras = [{ overhead = { height = 0.5 }, width = 320, height = 240, fx = 300.0 }]\n";
    workspace.make_dataset("views", views, &[]);
    let heatmaps = workspace.make_dataset("heatmaps", &heatmaps_job("label = \"free\""), &[]);
    assert_intact(&heatmaps, FULL_CHECK);
    let volumes = format!(
        "product = \"volumes\"\nseed = 3\n[views]\ndataset = \"views\"\n[fusion]\nviews = [1, 1]\nresolution = 32\nsize = 0.45\n\
         [picks]\ndataset = \"picks\"\n[hand]\nmodel = {:?}\n",
        repository_path(GRIPPER)
    );
    let volumes = workspace.make_dataset("volumes", &volumes, &[]);
    assert_intact(&volumes, FULL_CHECK);
}

#[test]
fn grasps_are_sampled_on_tables() {
    for (name, scenes) in [("alone", ALONE), ("packed", PACKED)] {
        let workspace = Workspace::copy_of(&Workspace::with_datasets(&[(name, format!("{scenes}{NO_SPLIT}"))]));
        let picks = workspace.make_dataset("picks", &job(name, "trials = 0"), &[]);
        assert_intact(&picks, FULL_CHECK);
        let (sums, with_free) = counted(&picks);
        assert!(with_free >= 2 && sums["free"] > 10, "{name} {sums:?}");
        assert_eq!(sums["poses_rejected_by_container"], 0);
    }
}

#[test]
fn mistakes_of_samplers_are_said_with_key_and_remedy() {
    let inputs = [("scenes", format!("{BIN}{NO_SPLIT}"))];
    let workspace = Workspace::copy_of(&Workspace::with_datasets(&inputs));
    let said = |text: &str| {
        let file = workspace.write("job.toml", text);
        Program::run_job(file, workspace.path("none")).expect_code(2).stderr
    };
    let fine = job("scenes", "sampler = \"scene\"");
    let barrett = fine.replace("parallel_gripper", "barrett_bh8_280");
    for (text, expected) in [
        (barrett.clone(), ["picks.sampler", "grasps.dataset"]),
        // Without a dataset of grasps, sampling is what a job is about.
        (barrett.replace("sampler = \"scene\"\n", ""), ["picks.sampler", "grasps.dataset"]),
        (fine.replace("\"scene\"\n", "\"transferred\"\n"), ["grasps.dataset", "make one first"]),
        (
            fine.replace("[hand]", "[grasps]\ndataset = \"grasps\"\n[hand]"),
            ["grasps.dataset", "remove `grasps.dataset`"],
        ),
        (fine.replace("[shards]", "rolls = 4\n[shards]"), ["picks.rolls", "remove `picks.rolls`"]),
        (fine.replace("[shards]", "grasps = \"held\"\n[shards]"), ["picks.grasps", "remove `picks.grasps`"]),
        (fine.replace("[shards]", "half_angle_deg = 91\n[shards]"), ["picks.half_angle_deg", "90"]),
    ] {
        let found = said(&text);
        assert!(expected.iter().all(|words| found.contains(words)), "{expected:?}\n{found}");
    }
}
