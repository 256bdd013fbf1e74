//! Maps over directions and roll: every verb, refusals, and whether such a map answers better.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use graspmill::{
    factory::products::reachability::{IkSolver, LabelledPosition, PoseLabeller, Scratch},
    files::Folder,
    format::{
        ReachabilityBlock,
        dataset::{DatasetReader, Selection},
        extras::read_field,
    },
    geom::{EndEffector, Pose, PoseGrid, PoseLabel, SimdLevel, World, super_fibonacci},
    runtime::ReachabilityMap,
    seed::Stream,
};
use serde_json::Value;

use super::{assert_regenerates, query, run, write_job};
use crate::support::{
    files::{digest_dataset, read_text},
    program::{Program, print_root},
    robots::{FETCH, FETCH_ARM, FETCH_SITE, max_difference, open_robot},
    workspace::Workspace,
};

/// 12 directions and 6 rolls, so 3 x 3 x 4 x 72 poses.
const DIRECTIONS: &str = "directions = { healpix = 1 }\nroll = 6\n";

fn make_map() -> (Workspace, PathBuf) {
    let workspace = write_job(DIRECTIONS);
    let data = run(&workspace, "data", &["--threads", "1"]);
    (workspace, data)
}

#[test]
fn threads_change_no_byte_and_shards_no_root() {
    let (workspace, first) = make_map();
    assert_eq!(digest_dataset(run(&workspace, "second", &["--threads", "2"])), digest_dataset(&first));
    assert_eq!(print_root(run(&workspace, "other", &["--set", "shards.positions=36"])), print_root(&first));
    assert_ne!(print_root(run(&workspace, "finer", &["--set", "poses.roll=7"])), print_root(&first));
}

#[test]
fn every_verb_knows_directions() {
    let (workspace, data) = make_map();
    assert_regenerates(&data, 9);
    let facts = Program::on("inspect", &data).read_json();
    assert_eq!((&facts["poses"], &facts["positions"]), (&2592.into(), &36.into()));
    let axes = facts["axes"].as_array().expect("axes");
    let named: Vec<(&str, u64, &str)> = axes
        .iter()
        .map(|axis| {
            let text = |key: &str| axis[key].as_str().expect("text");
            (text("name"), axis["count"].as_u64().expect("a count"), text("unit"))
        })
        .collect();
    assert_eq!(named[3..], [("direction", 12, "healpix"), ("roll", 6, "rad")]);
    let radius = facts["covering"]["radius"].as_f64().expect("a radius").to_degrees();
    assert!((radius - 56.29).abs() < 0.01, "{radius}");
    assert!((facts["covering"]["directions"].as_f64().expect("a radius").to_degrees() - 48.19).abs() < 0.01);
    let (job, text) = (workspace.path("job.toml"), |verb: &str, path: &Path| Program::on(verb, path).succeed().stdout);
    let words = "no rotation is more than 56.3 deg from an orientation";
    assert!(text("inspect", &data).contains(words) && text("inspect", &data).contains("12 of the x axis"));
    assert!(text("estimate", &job).contains(words));
    assert!(Program::on("estimate", &job).read_json()["figures"]["covering_radius"].as_f64() > Some(0.98));
    text("report", &data);
    let page = read_text(data.join("report.html"));
    assert!(page.contains(words) && page.contains("HEALPix") && !page.contains("NaN") && !page.contains("graspit"));
    assert!(data.join("preview.mcap").exists());
    let never = workspace.path("never");
    let said = Program::on("export", &data).args(["--to", "graspit"]).option("--out", &never).fail().stderr;
    assert!(said.contains("directions") && !never.exists(), "{said}");
    let said = workspace.run_job("job", "never").set(["field.profile=thesis"]).expect_code(2).stderr;
    assert!(said.contains("field.profile") && !never.exists(), "{said}");
}

/// Cells are position, direction, roll; each witness brings the robot to its cell, and a query finds it there.
#[test]
fn what_is_stored_is_what_the_robot_does() {
    let (workspace, data) = make_map();
    let field = read_field(&Folder::at(&data)).expect("a field");
    let header = &field.header;
    assert!(matches!(&header.grid, PoseGrid::Sphere(_)));
    assert_eq!(header.grid.shape(), [3, 3, 4, 12, 6]);
    assert_eq!(field.distances, header.distances(&field.labels));
    let robot = open_robot(workspace.path("fetch.xml"));
    let mut map = ReachabilityMap::open(&Folder::at(&data)).expect("a map");
    map.read_witnesses(&Folder::at(&data)).expect("witnesses");
    let (mut cell, mut counts) = (0, BTreeMap::new());
    for sample in DatasetReader::open(&Folder::at(&data)).expect("a dataset").iter(Selection::default()) {
        let block = sample.expect("a sample").read::<ReachabilityBlock>().expect("a block");
        for orientation in 0..block.labels.len() {
            *counts.entry(block.labels[orientation]).or_insert(0) += 1;
            let nearest = map.nearest_cell(&header.grid.pose(cell)).expect("a cell");
            assert_eq!((nearest.cell, nearest.witness), (cell, block.witness(orientation)));
            assert!((map.distance(&header.grid.pose(cell)) - f64::from(field.distances[cell])).abs() < 1e-9);
            if let Some(witness) = block.witness(orientation) {
                let wanted = Pose::<World, EndEffector>::from_xyz_rpy(header.grid.pose(cell));
                let values: Vec<(&str, f64)> = FETCH_ARM.into_iter().zip(witness.iter().copied()).collect();
                let found = robot.target_pose(&header.target, &values).expect("a pose");
                assert!(max_difference(&wanted, &found) < 1e-6, "cell {cell}");
            }
            cell += 1;
        }
    }
    assert_eq!(cell, header.grid.cells());
    assert!(PoseLabel::ALL.iter().all(|label| counts.get(label) > Some(&20)), "{counts:?}");
    let free = field.labels.iter().position(|label| *label == PoseLabel::Reachable).expect("a reachable cell");
    let pose = header.grid.pose(free).map(|value| value.to_string()).join(",");
    let answers: Value = query(&data, &[&format!("--pose={pose}")]).read_json();
    assert_eq!(answers["poses"][0]["nearest"]["cell"], free);
    assert_eq!(answers["poses"][0]["nearest"]["witness"].as_array().map(Vec::len), Some(FETCH_ARM.len()));
}

/// Counts of wrong answers of a map about whether a pose is reachable.
#[derive(Default)]
struct Wrong {
    /// Poses that are not reachable and count as such, by the sign of the distance.
    falsely_in: u32,
    /// Poses that are reachable and do not count as such.
    falsely_out: u32,
    /// Nearest cells with another label.
    cells: u32,
}

/// The thesis's grid and the even one with the same positions, at rotations and positions between all cells, against the
/// labeller's own answer there.
#[test]
#[ignore = "slow: make test-all"]
fn evenly_spread_orientations_answer_better() {
    const POSITIONS: usize = 600;
    let workspace = Workspace::new();
    let maps = ["fetch-reachability", "fetch-reachability-sphere"].map(|name| {
        let out = workspace.path(name);
        Program::run_job(format!("jobs/{name}.toml"), &out).succeed();
        ReachabilityMap::open(&Folder::at(&out)).expect("a map")
    });
    let rotations: Vec<_> = (0..61).map(|index| super_fibonacci(index, 61)).collect();
    let (robot, fixed) = (open_robot(FETCH), BTreeMap::new());
    let group = robot.planning_group(&FETCH_ARM, FETCH_SITE, &fixed).expect("an arm");
    let bodies = robot.bodies(&FETCH_ARM, &fixed).expect("bodies");
    let labeller =
        PoseLabeller::of_parts(&group, Some((&bodies, SimdLevel::detect())), &rotations, IkSolver::ClosedForm, 1)
            .expect("an arm");
    let (mut scratch, mut truth, mut draw) =
        (Scratch::default(), LabelledPosition::default(), Stream::of_job(1, b"", "poses"));
    let (mut wrong, mut poses, mut reachable) = ([Wrong::default(), Wrong::default()], 0, 0);
    for _ in 0..POSITIONS {
        let at = [draw.unit() * 1.1, draw.unit() * 2.1 - 1.1, draw.unit() * 1.9];
        labeller.label(&mut scratch, at, &mut truth);
        for (rotation, label) in rotations.iter().zip(&truth.labels) {
            let pose = Pose::<World, EndEffector>::new(*rotation, at.into()).xyz_rpy();
            let inside = *label == PoseLabel::Reachable;
            (poses, reachable) = (poses + 1, reachable + u32::from(inside));
            for (map, wrong) in maps.iter().zip(&mut wrong) {
                let said = map.distance(&pose) < 0.0;
                wrong.falsely_in += u32::from(said && !inside);
                wrong.falsely_out += u32::from(!said && inside);
                let cell = map.nearest_cell(&pose).expect("a cell").label == PoseLabel::Reachable;
                wrong.cells += u32::from(cell != inside);
            }
        }
    }
    for (map, wrong) in ["six axes", "directions"].iter().zip(&wrong) {
        let Wrong { falsely_in, falsely_out, cells } = wrong;
        println!(
            "{map}: of {poses} poses, {reachable} of them reachable, {falsely_in} falsely in, {falsely_out} falsely out; \
             {cells} nearest cells with another label"
        );
    }
    let [axes, directions] = wrong;
    assert!(directions.falsely_in + directions.falsely_out < axes.falsely_in + axes.falsely_out);
    assert!(directions.cells < axes.cells);
}
