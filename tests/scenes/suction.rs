//! Suction from the job file to the reader: the same bytes on any number of threads, forces by their closed form, and exports.

use std::{f64::consts::PI, path::Path};

use graspmill::{
    files::Folder,
    format::{
        SuctionFacts, SuctionPoses, SuctionResult,
        dataset::{DatasetReader, Selection},
    },
};

use crate::support::{
    files::{FULL_CHECK, assert_intact, read_json, repository_path},
    jobs::NO_SPLIT,
    meshes::{centred_block, round, write_stl},
    program::{Program, print_root},
    workspace::Workspace,
};

const JOB: &str = "product = \"suction\"\nseed = 3\n[scenes]\ndataset = \"scenes\"\n[suction]\nposes = 400\nfree = 5\n\
                   [shards]\nsamples = 2\n";

/// Tables of a block of 100 x 80 x 60 mm and of a ball of 30 mm, each alone.
fn scenes() -> Workspace {
    let workspace = Workspace::new();
    write_stl(&workspace.path("block.stl"), &centred_block([0.05, 0.04, 0.03]));
    write_stl(&workspace.path("ball.stl"), &round(16, |_, _| 0.015));
    let job = format!(
        "product = \"scenes\"\nseed = 5\nmode = \"table\"\ncount = 1\nscenes = {{ training = 4 }}\n[[objects]]\n\
         list = [\"block.stl\", \"ball.stl\"]\nunit = \"m\"\nmeshes = {{ block = {{ mass = 0.05 }}, ball = {{ mass = 0.02 }} }}\n{NO_SPLIT}"
    );
    workspace.make_dataset("scenes", &job, &[]);
    workspace
}

fn records(folder: &Path) -> Vec<SuctionPoses> {
    let reader = DatasetReader::open(&Folder::at(folder)).expect("a dataset");
    let samples = reader.iter(Selection::default());
    samples.map(|sample| sample.expect("readable").read::<SuctionPoses>().expect("poses")).collect()
}

/// Names of the objects of a dataset by digest.
fn name_of(folder: &Path, record: &SuctionPoses) -> String {
    let assets = read_json(folder.join("assets.json"));
    let rows = assets["objects"].as_array().expect("objects").iter();
    let row = rows.clone().find(|row| row["object"] == record.object().to_string()).expect("the object");
    row["name"].as_str().expect("a name").to_owned()
}

/// Prints what NumPy reads of the labels for SuctionNet, beside the Python package: bodies, free poses, poses with a free path.
const READ: &str = "\
import csv, json, sys, graspmill, numpy as np
from pathlib import Path
data, out = graspmill.Dataset(sys.argv[1], graspmill.SuctionSample), Path(sys.argv[2])
bodies, free, clear = list(csv.DictReader(open(out / 'bodies.csv'))), 0, 0
assert len(bodies) == len(data)
for sample, row in zip(data, bodies):
    n = len(sample.numbers)
    assert sample.object_from_cup.shape == (n, 4, 4) and sample.surfaces.shape == (n, 11) and sample.used.shape == (n, 4)
    counts = sample.counts
    parts = sum(sum(counts[key].values()) for key in ('leaking', 'weak', 'blocked'))
    assert counts['drawn'] == parts + counts['tilted'] + counts['alike'] + counts['free'] and counts['free'] == sample.free.sum()
    assert ((sample.results == 3) == (sample.seal_margins < 0)).all() and ((sample.results == 3) == np.isnan(sample.forces)).all()
    assert (np.isnan(sample.robustness) == ~sample.free).all() and (sample.obstacles[sample.free] == 0).all()
    assert (np.diff(sample.numbers.astype(int)) > 0).all() and sample.cup.radius == 0.01
    seal = np.load(out / f\"seal_label/{int(row['object_id']):03d}_seal.npz\")
    assert np.allclose(seal['points'], sample.object_from_cup[:, :3, 3]) and np.allclose(seal['normals'], -sample.object_from_cup[:, :3, 2])
    assert np.allclose(seal['scores'], sample.suctionnet_seals)
    scene, place = int(row['scene_id']), row['place']
    wrench = np.load(out / f'wrench_label/{scene:04d}_wrench.npz')['arr_' + place]
    hit = np.load(out / f'suction_collision_label/{scene:04d}_collision.npz')['arr_' + place]
    assert np.allclose(wrench, sample.suctionnet_wrenches) and hit.dtype == bool and (hit == (sample.obstacles > 0)).all()
    ids = (out / f'scenes/scene_{scene:04d}/object_id_list.txt').read_text().split()
    assert ids[int(place)] == row['object_id']
    free, clear = free + int(sample.free.sum()), clear + int((~hit).sum())
print(json.dumps([len(data), free, clear, int(data.column('free').sum())]))
";

#[test]
fn cups_hold_flat_tops_by_the_closed_form_and_leak_on_small_balls() {
    let workspace = scenes();
    let suction = workspace.make_dataset("suction", JOB, &[]);
    assert_intact(&suction, FULL_CHECK);
    Program::on("verify", &suction).option("--regenerate", "2").succeed();
    Program::run_job(workspace.path("suction.toml"), workspace.path("one")).option("--threads", "1").succeed();
    assert_eq!(print_root(&suction), print_root(workspace.path("one")));

    let (mut blocks, mut balls, mut free) = (0, 0, 0);
    let reader = DatasetReader::open(&Folder::at(&suction)).expect("a dataset");
    for record in records(&suction) {
        let results = |result| record.poses.iter().filter(|pose| pose.result() == result).count() as u32;
        assert_eq!(results(SuctionResult::Free), SuctionFacts::from_poses(&record).draws.free);
        if name_of(&suction, &record) == "ball" {
            balls += 1;
            // The smallest radius on which the cup seals is 20 mm.
            assert_eq!(record.draws.free + record.draws.blocked.iter().sum::<u32>(), 0, "{:?}", record.draws);
            assert!(record.draws.leaking.iter().sum::<u32>() > 0);
            continue;
        }
        blocks += 1;
        free += u64::from(record.draws.free);
        assert!((3..=5).contains(&record.draws.free), "{:?}", record.draws);
        for pose in record.free() {
            // A force of 60 kPa over a circle of 10 mm, less 200 N/m times the compression.
            let (hold, surface) = (pose.hold.expect("it holds"), pose.surface.expect("no ray misses"));
            let force = 60e3 * PI * 0.01 * 0.01 - 200.0 * surface.compression;
            assert!((hold.force - force).abs() < 1e-9, "{} {force}", hold.force);
            assert!(surface.curvatures.iter().all(|curvature| curvature.abs() < 1e-6), "{surface:?}");
            assert!(pose.robustness.is_some_and(|share| (0.0..=1.0).contains(&share)));
            // The pull is that of the weight along the axis, times the safety.
            let world_from_cup = record.world_from_object().isometry() * pose.object_from_cup.isometry();
            let down = -(world_from_cup.rotation * nalgebra::Vector3::z()).z;
            let pull = record.mass * 1.5 * 9.81 * down / force;
            assert!((hold.used[0] - pull.max(0.0)).abs() < 1e-9, "{} {pull}", hold.used[0]);
        }
    }
    assert!(blocks > 0 && balls > 0, "{blocks} {balls}");
    let counts = &reader.manifest().counts;
    assert_eq!((counts.fact("with_free"), counts.fact("free")), (blocks, free));

    let out = workspace.path("labels");
    Program::on("export", &suction).args(["--to", "suctionnet"]).option("--out", &out).succeed();
    let read: [u64; 4] = Program::python_lines(READ)
        .arg(&suction)
        .arg(&out)
        .env("PYTHONPATH", repository_path("python"))
        .succeed()
        .json();
    assert_eq!((read[0], read[1], read[3]), (blocks + balls, free, free));
    assert!(read[2] >= read[1]);
    let inspected = Program::on("inspect", &suction).succeed().text();
    assert!(inspected.contains("with a free pose") && inspected.contains("leaking: curvature"), "{inspected}");
    Program::on("report", &suction).succeed();
    let page = workspace.read("suction/report.html");
    assert!(page.contains("From poses to robust ones") && page.contains("Lost poses by reason"));
}

#[test]
fn mistakes_of_cups_are_reported_with_key_and_range() {
    let workspace = scenes();
    for (text, expected) in [
        (JOB.replace("[suction]", "[cup]\nstroke = 0.05\n[suction]"), ["cup.stroke", "at most the cup's height"]),
        (JOB.replace("[suction]", "[cup]\nradius = 0\n[suction]"), ["cup.radius", "above 0"]),
        (JOB.replace("free = 5", "free = 0"), ["suction.free", "1"]),
        (JOB.replace("dataset = \"scenes\"", "dataset = \"nowhere\""), ["scenes.dataset", "make one first"]),
        (JOB.replace("[suction]", "[hand]\nmodel = \"a.xml\"\n[suction]"), ["hand", "`[cup]`"]),
    ] {
        let file = workspace.write("job.toml", &text);
        let found = Program::run_job(file, workspace.path("none")).expect_code(2).stderr;
        assert!(expected.iter().all(|words| found.contains(words)), "{expected:?}\n{found}");
    }
}
