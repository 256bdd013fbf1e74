//! Datasets for people and planners: answers, reports, previews, and files for other programs.

use graspmill::{
    files::Folder,
    format::{
        ReachabilityBlock,
        dataset::{DatasetReader, Selection},
        extras::read_field,
    },
    geom::PoseLabel,
    runtime::ReachabilityMap,
};
use serde_json::Value;

use super::{ORIENTATIONS, query, run, write_job};
use crate::support::{
    files::read_text,
    program::{Program, print_by_rerun},
    robots::FETCH_ARM,
};

#[test]
fn a_map_opens_with_the_datasets_labels_distances_and_witnesses() {
    let workspace = write_job(ORIENTATIONS);
    let data = run(&workspace, "data", &[]);
    let mut map = ReachabilityMap::open(&Folder::at(&data)).expect("a map");
    let field = read_field(&Folder::at(&data)).expect("a field");
    assert_eq!((map.labels(), map.distances()), (field.labels.as_slice(), field.distances.as_slice()));
    assert_eq!((map.robot().joints.as_slice(), map.has_witnesses()), (&FETCH_ARM.map(str::to_owned)[..], false));
    map.read_witnesses(&Folder::at(&data)).expect("witnesses");
    let mut cell = 0;
    for sample in DatasetReader::open(&Folder::at(&data)).expect("a dataset").iter(Selection::default()) {
        let block = sample.expect("a sample").read::<ReachabilityBlock>().expect("a block");
        for angle in 0..block.labels.len() {
            assert_eq!(map.witness(cell), block.witness(angle), "cell {cell}");
            cell += 1;
        }
    }
    assert_eq!(cell, map.grid().cells());
    // Witnesses of another robot's map, and of none.
    let other = run(&workspace, "other", &["--set", "poses.z.from=0.6"]);
    let error = ReachabilityMap::open(&Folder::at(&other))
        .expect("a map")
        .read_witnesses(&Folder::at(&data))
        .unwrap_err()
        .to_string();
    assert!(error.contains("does not belong to the field of this map"), "{error}");
    let error = ReachabilityMap::open(&Folder::at(workspace.path("nowhere"))).err().expect("no map").to_string();
    assert!(error.contains("field.mcap") && error.contains("run"), "{error}");
}

#[test]
fn poses_are_asked_for_on_the_command_line_and_in_files() {
    let workspace = write_job(ORIENTATIONS);
    let data = run(&workspace, "data", &[]);
    let field = read_field(&Folder::at(&data)).expect("a field");
    let (grid, labels) = (&field.header.grid, &field.labels);
    let cell_of = |wanted| labels.iter().position(|label| *label == wanted).expect("a cell of each label");
    let ask = |arguments: &[&str]| query(&data, arguments);
    let (free, never) = (cell_of(PoseLabel::Reachable), cell_of(PoseLabel::NoSolution));
    let [free_text, never_text] = [free, never].map(|cell| grid.pose(cell).map(|value| value.to_string()).join(","));
    let csv = format!("x,y,z,roll,pitch,yaw\n{never_text}\n-3,0.1,0.9,0,0.5,0.2\n");
    let path = workspace.write("poses.csv", csv).display().to_string();
    let answers: Value = ask(&["--pose", &free_text, "--csv", &path, "--json"]).succeed().json();
    let [inside, outside, far] = answers["poses"].as_array().expect("poses").as_slice() else { panic!("{answers}") };
    for (answer, cell) in [(inside, free), (outside, never)] {
        assert_eq!((&answer["nearest"]["cell"], &answer["inside_grid"]), (&cell.into(), &true.into()), "{answer}");
        assert_eq!(answer["nearest"]["label"], labels[cell].name());
        let distance = answer["distance"].as_f64().expect("a distance");
        assert!((distance - f64::from(field.distances[cell])).abs() < 1e-6, "{answer}");
        assert_eq!(answer["gradient"].as_array().map(Vec::len), Some(6));
    }
    assert_eq!(inside["nearest"]["witness"].as_array().map(Vec::len), Some(FETCH_ARM.len()));
    assert!(outside["nearest"].get("witness").is_none());
    assert_eq!((far["inside_grid"].as_bool(), &answers["unit"]), (Some(false), &"metres".into()));
    assert!(far["distance"].as_f64() > Some(3.0), "{far}");

    let said = ask(&["--pose=-3,0.1,0.9,0,0.5,0.2", "--pose", &free_text]).succeed().stdout;
    assert!(said.contains("OUTSIDE THE GRID") && said.contains("elbow_flex_joint"), "{said}");
    for (arguments, says) in [
        (vec!["--pose", "1,2,3"], "--pose 1,2,3 (number 1): 3 values; give six numbers"),
        (vec!["--pose", "1,2,3,0,0,north"], "yaw = 'north' is not a finite number"),
        (vec!["--csv", "missing.csv"], "missing.csv"),
        (vec![], "--csv"),
    ] {
        let refused = ask(&arguments).expect_code(2);
        assert!(refused.stdout.is_empty() && refused.stderr.contains(says), "{}", refused.text());
    }
    workspace.write("poses.csv", "0.5,0,1,0,0,0\n0.5,0,1,0,0\n");
    let said = ask(&["--csv", &path]).expect_code(2).stderr;
    assert!(said.contains("poses.csv:2: 5 values"), "{said}");
}

#[test]
fn numpy_reads_the_files_of_the_thesis() {
    let workspace = write_job(ORIENTATIONS);
    let data = run(&workspace, "data", &["--set", "field.profile=thesis"]);
    let out = workspace.path("graspit");
    Program::on("export", &data).args(["--to", "graspit"]).option("--out", &out).succeed();
    let field = read_field(&Folder::at(&data)).expect("a field");
    let bytes: Vec<u8> = field.labels.iter().map(|label| *label as u8).collect();
    workspace.write("raw.labels", bytes);
    let bytes: Vec<u8> = field.distances.iter().flat_map(|distance| distance.to_le_bytes()).collect();
    workspace.write("raw.distances", bytes);
    let script = r#"
import json, sys, numpy as np
out, raw = sys.argv[1], sys.argv[2]
row = lambda name: np.loadtxt(f"{out}/reach_data.{name}", delimiter=",")
dims, mins, step = row("dims").astype(int), row("mins"), row("step")
assert dims.tolist() == [3, 3, 4, 2, 4, 4], dims
full = np.fromfile(out + "/reach_data.full").reshape(dims)
sdf = np.fromfile(out + "/reach_data.sdf").reshape(dims)
labels = np.fromfile(raw + ".labels", np.uint8).reshape(dims)
assert np.array_equal(full, labels == 2)
assert np.array_equal(sdf, -np.fromfile(raw + ".distances", "<f4").astype(float).reshape(dims))
assert (sdf[full == 1] > 0).all() and (sdf[full == 0] < 0).all()
rows = np.loadtxt(out + "/reach_data.csv")
index = np.stack(np.unravel_index(np.arange(full.size), dims), axis=1)
assert np.array_equal(rows[:, 0], np.arange(full.size)) and np.array_equal(rows[:, 7], full.ravel())
assert np.allclose(rows[:, 1:7], mins + index * step, rtol=0, atol=1e-12)
facts = json.load(open(out + "/export.json"))
assert facts["sign"] == "positive where reachable" and facts["unit"] == "cells"
print(int(full.sum()))
"#;
    let answer = Program::python_lines(script).arg(&out).arg(workspace.path("raw")).succeed().stdout;
    let reachable = field.labels.iter().filter(|label| **label == PoseLabel::Reachable).count();
    assert_eq!(answer.trim(), reachable.to_string());

    let refused =
        |arguments: &[&str]| Program::on("export", &data).args(["--out", "x"]).args(arguments).expect_code(2).stderr;
    let said = refused(&["--to", "npy"]);
    assert!(said.contains("reachability") && said.contains("use --to parquet or graspit"), "{said}");
    let said = refused(&["--to", "graspit", "--limit", "3"]);
    assert!(said.contains("leave out --split"), "{said}");
}

#[test]
#[ignore = "slow: needs rerun-sdk (100 MB)"]
fn rerun_draws_the_reachable_positions() {
    let workspace = write_job(ORIENTATIONS);
    let printed = print_by_rerun(&run(&workspace, "data", &[]).join("preview.mcap"));
    for kind in ["Points3D:positions", "Points3D:colors"] {
        assert!(printed.contains(kind), "no {kind} in {printed}");
    }
}

#[test]
fn a_report_is_one_page_with_every_count_and_every_arrow() {
    let workspace = write_job(ORIENTATIONS);
    let data = run(&workspace, "data", &["--set", "name=a <b> & c"]);
    Program::on("report", &data).succeed();
    let page = read_text(data.join("report.html"));
    assert!(page.len() < 1 << 20, "{} bytes", page.len());
    for outside in ["http://", "https://", "<script", "url(", "<b>", "NaN", "inf"] {
        assert!(!page.contains(outside), "the page has {outside}");
    }
    let manifest = DatasetReader::open(&Folder::at(&data)).expect("a dataset").manifest().clone();
    for part in [manifest.root.hex().as_str(), "a &lt;b&gt; &amp; c", "wrist_flex_joint", "searched only", "y = 0 m"] {
        assert!(page.contains(part), "{part} is missing");
    }
    for label in PoseLabel::ALL {
        assert!(page.contains(&manifest.counts.fact(label.name()).to_string()), "{label:?}");
    }
    // Four pitches and yaws: up, down and four level directions; each section shows four of them as arrows. Where the
    // poses of a direction have no solution, the arrow is red.
    let field = read_field(&Folder::at(&data)).expect("a field");
    let approaches = field.header.grid.approaches();
    let sections: Vec<&str> = page.split("<figure class=\"section ").skip(1).collect();
    assert!(sections.len() > 2 && sections[0].starts_with("upright"), "{}", sections.len());
    let arrows = |class: &str| {
        let start = sections[0].find(&format!("<g class=\"{class}\"><path class=\"stroke\" d=\"")).expect("a group");
        // An arrow is one stroke of one step; rings have arcs.
        sections[0][start..]
            .split('"')
            .nth(5)
            .expect("a path")
            .split('M')
            .skip(1)
            .filter(|mark| !mark.contains('a'))
            .count()
    };
    let [_, ny, nz] = field.header.grid.position_counts();
    let middle = field.header.grid.axes()[1].nearest(0.0);
    let mut expected = [0; 3];
    for (position, labels) in field.labels.chunks(approaches.len()).enumerate() {
        if position / nz % ny != middle {
            continue;
        }
        // Straight down, ahead, back and straight up lie in the plane of x and z.
        for direction in [0, 9, 13, 25] {
            let of = labels.iter().zip(&approaches).filter(|(_, approach)| **approach == direction);
            expected[of.map(|(label, _)| *label as usize).max().expect("poses of each direction")] += 1;
        }
    }
    assert_eq!([arrows("pose-never"), arrows("pose-colliding"), arrows("pose-free")], expected);
    let again = workspace.path("again.html");
    Program::on("report", &data).option("--out", &again).succeed();
    assert_eq!(read_text(again), page, "same bytes again");
}

#[test]
fn a_report_of_nothing_reachable_stands() {
    let workspace = write_job(ORIENTATIONS);
    let data = run(&workspace, "far", &["--set", "poses.x.from=4.0", "--set", "poses.x.to=4.6"]);
    Program::on("report", &data).succeed();
    let page = read_text(data.join("report.html"));
    assert!(page.contains("all labels are equal") && !page.contains("NaN"), "no numbers without numbers");
    let answers: Value = query(&data, &["--pose", "4,0,1,0,0,0"]).read_json();
    assert!(answers["poses"][0]["distance"].is_null(), "{answers}");
}

#[test]
fn a_preview_holds_a_point_for_each_reachable_position_and_arrows() {
    let workspace = write_job(ORIENTATIONS);
    let data = run(&workspace, "data", &[]);
    let field = read_field(&Folder::at(&data)).expect("a field");
    let bytes: Vec<u8> = field.labels.iter().map(|label| *label as u8).collect();
    let raw = workspace.write("labels", bytes);
    let script = r#"
import sys, numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
labels = np.fromfile(sys.argv[2], np.uint8).reshape(36, 32)
seen = {}
for schema, channel, message, decoded in make_reader(
        open(sys.argv[1], "rb"), decoder_factories=[DecoderFactory()]).iter_decoded_messages():
    seen[channel.topic] = schema.name, decoded
schema, cloud = seen["/preview/reachable"]
assert schema == "foxglove.PointCloud" and cloud.frame_id == "world"
points = np.frombuffer(cloud.data, [(n, "<f4") for n in ("x", "y", "z", "share")] + [("colour", "u1", 4)])
assert points.itemsize == cloud.point_stride
share = (labels == 2).mean(axis=1)
assert np.allclose(points["share"], share[share > 0]) and (points["colour"][:, 3] == 255).all()
place = np.stack(np.meshgrid([.4, .6, .8], [-.3, 0, .3], [.4, .6, .8, 1.], indexing="ij"), -1).reshape(-1, 3)
assert np.allclose(np.stack([points[n] for n in "xyz"], 1), place[share > 0])
schema, scene = seen["/preview/directions"]
arrows = scene.entities[0].arrows
assert schema == "foxglove.SceneUpdate" and len(scene.entities) == 1
# Yaw pi/2 apart, pitch pi/2 apart: x axes along the axes of the world.
yaw, pitch = [(np.arange(4) - 2) * np.pi / 2] * 2
p, y = np.meshgrid(pitch, yaw, indexing="ij")
axes = np.tile(np.stack([np.cos(p) * np.cos(y), np.cos(p) * np.sin(y), -np.sin(p)], -1).reshape(-1, 3), (2, 1))
wanted = set()
for at, row in zip(place, labels):
    for axis in np.unique(axes.round(6) + 0.0, axis=0):
        best = row[np.abs(axes - axis).max(axis=1) < 1e-3].max()
        if best:
            wanted.add((*(at.round(4) + 0.0), *(axis.round(4) + 0.0), int(best)))
found = set()
for arrow in arrows:
    q, at = arrow.pose.orientation, arrow.pose.position
    x = np.array([1 - 2 * (q.y**2 + q.z**2), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y)])
    found.add((*(np.round([at.x, at.y, at.z], 4) + 0.0), *(x.round(4) + 0.0), 2 if arrow.color.r == 0 else 1))
assert found == wanted, (len(found), len(wanted), sorted(found ^ wanted)[:6])
print(len(arrows) == len(found))
"#;
    let preview = data.join("preview.mcap");
    let answer = Program::python_lines(script).args([&preview, &raw]).succeed().stdout;
    assert_eq!(answer.trim(), "True");
}
