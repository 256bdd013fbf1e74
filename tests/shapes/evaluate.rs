//! Measures against trimesh and SciPy; `graspmill evaluate completion` and `graspmill complete` on a dataset.

use std::path::{Path, PathBuf};

use graspmill::{
    geom::{GridPlacement, OccupancyGrid, TriMesh},
    measure::{
        Baseline, SeenCells, SurfaceComparison, SurfaceRule, TrainingPairs, VertexComparison, geodesic_distances,
        mesh_overlap, mesh_overlap_by_thesis,
    },
    seed::Stream,
    surface::write_ply,
};
use serde_json::{Value, json};

use super::{network::MODEL, segment::read_ply};
use crate::support::{
    files::{list_names, number_at, read_json},
    meshes::built_in_mesh,
    program::Program,
    workspace::Workspace,
};

/// Distances between a can and a bottle by trimesh's closest points: means and standard errors of both directions.
const TRIMESH: &str = "
import json, sys
import numpy as np, trimesh

a, b = (trimesh.load(path, process=False) for path in sys.argv[1:3])

def distances(points, mesh):
    found = []
    for point in points:
        tiled = np.tile(point, (len(mesh.triangles), 1))
        nearest = trimesh.triangles.closest_point(mesh.triangles, tiled)
        found.append(np.linalg.norm(nearest - tiled, axis=1).min())
    return np.array(found)

answer = {}
for name, one, other in (('found_to_truth', a, b), ('truth_to_found', b, a)):
    points, _ = trimesh.sample.sample_surface(one, 600, seed=3)
    found = distances(points, other)
    answer[name] = [found.mean(), found.std() / len(found) ** 0.5]
answer['volume_ratio'] = a.volume / b.volume
print(json.dumps(answer))
";

#[test]
fn distances_are_those_of_trimesh() {
    let workspace = Workspace::new();
    let (found, truth) = (built_in_mesh("can-01@1k"), built_in_mesh("bottle-01@1k"));
    let write = |name: &str, mesh: &TriMesh| workspace.write(name, write_ply(mesh, &[]));
    let run = Program::python_lines(TRIMESH).arg(write("found.ply", &found)).arg(write("truth.ply", &truth));
    let oracle: Value = run.succeed().json();
    let ours = SurfaceComparison::new(&found, &truth, &SurfaceRule::default(), b"oracle").expect("surfaces");
    for (name, value) in [("found_to_truth", ours.found_to_truth), ("truth_to_found", ours.truth_to_found)] {
        let (mean, error) = (number_at(&oracle, &format!("/{name}/0")), number_at(&oracle, &format!("/{name}/1")));
        assert!(mean > 0.005, "shapes that differ");
        // Both means are of samples; ours has many more.
        assert!((value - mean).abs() < 3.5 * error, "{name}: {value}, not {mean} +- {error}");
    }
    let ratio = number_at(&oracle, "/volume_ratio");
    assert!((ours.volume_ratio / ratio - 1.0).abs() < 1e-5, "{} {ratio}", ours.volume_ratio);
}

/// Distances of vertices by trimesh's closest points, those that are nearer than half the diagonal of their mesh's box alone; and
/// the overlap in the second mesh's box by a sample of its 80^3 cells, which points drawn on the surface fall into or whose centre
/// is inside.
const BY_THESIS: &str = "
import json, sys
import numpy as np, trimesh

a, b = (trimesh.load(path, process=False) for path in sys.argv[1:3])

def distances(mesh, other):
    found = []
    for point in mesh.vertices:
        tiled = np.tile(point, (len(other.triangles), 1))
        nearest = trimesh.triangles.closest_point(other.triangles, tiled)
        found.append(np.linalg.norm(nearest - tiled, axis=1).min())
    found = np.array(found)
    return found[found < np.linalg.norm(np.ptp(mesh.bounds, axis=0)) / 2]

one, other = distances(a, b), distances(b, a)
answer = {'found_to_truth': one.mean(), 'truth_to_found': other.mean()}
answer['mean'] = np.concatenate([one, other]).mean()
answer['maximum'] = max(one.max(), other.max())
answer['ignored'] = len(a.vertices) + len(b.vertices) - len(one) - len(other)

low, cell = b.bounds[0], np.ptp(b.bounds, axis=0).max() / 80
cells = np.random.default_rng(7).integers(80, size=(40000, 3))

def occupied(mesh):
    points, _ = trimesh.sample.sample_surface(mesh, 2_000_000, seed=3)
    at = np.floor((points - low) / cell).astype(int)
    grid = np.zeros((80, 80, 80), bool)
    grid[tuple(at[((at >= 0) & (at < 80)).all(axis=1)].T)] = True
    return grid[tuple(cells.T)] | mesh.contains(low + (cells + 0.5) * cell)

one, other = occupied(a), occupied(b)
answer['overlap'] = float((one & other).sum() / (one | other).sum())
print(json.dumps(answer))
";

#[test]
fn the_thesis_s_rules_are_those_of_trimesh_over_vertices_and_cells() {
    let workspace = Workspace::new();
    // The bottle is shifted, so that a part of it lies outside of the can's box; some vertices are too far away to count.
    let (mut found, truth) = (built_in_mesh("bottle-01@1k"), built_in_mesh("can-01@1k"));
    found.vertices.iter_mut().for_each(|vertex| *vertex = [vertex[0] + 0.01, vertex[1], vertex[2]]);
    let write = |name: &str, mesh: &TriMesh| workspace.write(name, write_ply(mesh, &[]));
    let run = Program::python_lines(BY_THESIS).arg(write("found.ply", &found)).arg(write("truth.ply", &truth));
    let oracle: Value = run.succeed().json();
    let ours = VertexComparison::new(&found, &truth).expect("surfaces").expect("vertices near enough");
    for (name, value) in [
        ("found_to_truth", ours.found_to_truth),
        ("truth_to_found", ours.truth_to_found),
        ("mean", ours.mean),
        ("maximum", ours.maximum),
    ] {
        let wanted = number_at(&oracle, &format!("/{name}"));
        assert!((value / wanted - 1.0).abs() < 1e-6, "{name}: {value}, not {wanted}");
    }
    assert_eq!(Some(ours.ignored as u64), oracle["ignored"].as_u64());
    let (volumes, cells) = (mesh_overlap_by_thesis(&found, &truth), number_at(&oracle, "/overlap"));
    println!("{ours:?}, {volumes}, by cells {cells}; by the standard's rule {}", mesh_overlap(&found, &truth));
    assert!((volumes - cells).abs() < 0.015, "{volumes}, by cells {cells}");
    // What sticks out of the can's box is free.
    assert!(volumes > mesh_overlap(&found, &truth) + 0.05 && ours.ignored > 0, "{volumes}");
}

/// Exact geodesic distances (Mitchell, Mount and Papadimitriou 1987, by libigl) from a vertex, and the overlap of two meshes by points.
const EXACT: &str = "
import json, sys
import igl, numpy as np, trimesh

def load(path):
    mesh = trimesh.load(path, process=False)
    return mesh, np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int32)

answer = {'distances': []}
for path in sys.argv[2:]:
    _, vertices, faces = load(path)
    none, source, target = np.empty(0, np.int32), np.array([0], np.int32), np.arange(len(vertices), dtype=np.int32)
    found = igl.exact_geodesic(vertices, faces, source, none, target, none)
    answer['distances'].append(np.asarray(found).tolist())
a, b = (load(path)[0] for path in sys.argv[2:4])
low, high = np.minimum(a.bounds[0], b.bounds[0]), np.maximum(a.bounds[1], b.bounds[1])
points = np.random.default_rng(5).uniform(low, high, (int(sys.argv[1]), 3))
one, other = a.contains(points), b.contains(points)
answer['overlap'] = float((one & other).sum() / (one | other).sum())
print(json.dumps(answer))
";

#[test]
fn geodesics_are_those_of_libigl_and_volumes_overlap_as_trimesh_says() {
    let workspace = Workspace::new();
    let names = ["can-01@1k", "bottle-01@1k", "mug-01@1k", "box-01@1k"];
    let meshes = names.map(built_in_mesh);
    let paths = (0..).zip(&meshes).map(|(index, mesh)| workspace.write(format!("{index}.ply"), write_ply(mesh, &[])));
    let run = Program::python_lines(EXACT).arg("40000").args(paths.collect::<Vec<_>>());
    let exact: Value = run.succeed().json();
    for (index, mesh) in meshes.iter().enumerate() {
        let found = geodesic_distances(mesh, 0).expect("a surface");
        let known: Vec<f64> = serde_json::from_value(exact["distances"][index].clone()).expect("distances");
        let errors: Vec<f64> = (found.iter().zip(&known).filter(|(_, known)| **known > 0.01))
            .map(|(found, known)| found / known - 1.0)
            .collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let [low, high] = [f64::min, f64::max].map(|pick| errors.iter().copied().reduce(pick).expect("some are far"));
        println!("{}: {} distances, {mean:.4} too long on average, {low:.4} to {high:.4}", names[index], errors.len());
        // Paths over nodes are never shorter than the exact ones, but for the rounding of vertices.
        assert!(low > -1e-4 && mean < 0.01, "{}: {low} to {high}, mean {mean}", names[index]);
    }
    let (ours, points) = (mesh_overlap(&meshes[0], &meshes[1]), number_at(&exact, "/overlap"));
    assert!((0.05..0.95).contains(&points) && (ours - points).abs() < 0.015, "{ours}, by points {points}");
}

#[test]
fn hulls_are_those_of_scipy() {
    let mut draw = Stream::of_job(5, b"", "cells");
    let (mut cells, mut ours) = (Vec::new(), Vec::new());
    let placement = GridPlacement { resolution: 16, centre: [0.0, 0.0, 1.0].into(), cell_size: 0.01 };
    for _ in 0..20 {
        let mut grid = OccupancyGrid::new(16);
        for _ in 0..12 {
            grid.set(std::array::from_fn(|_| draw.below(16) as u32));
        }
        cells.push(grid.cells().collect::<Vec<_>>());
        let seen = SeenCells { partial: &grid, free: None, points: &[], placement: &placement, support: None };
        ours.push(Baseline::Hull.complete(&seen).cells().collect::<Vec<_>>());
    }
    let workspace = Workspace::new();
    let input = workspace.write("cells.json", json!(cells).to_string());
    let script = "import json, sys\nimport numpy as np\nfrom scipy.spatial import ConvexHull\n\
                  all_cells = np.indices((16, 16, 16)).reshape(3, -1).T\n\
                  found = []\n\
                  for cells in json.load(open(sys.argv[1])):\n    planes = ConvexHull(cells).equations\n    \
                  inside = (all_cells @ planes[:, :3].T + planes[:, 3] <= 1e-6).all(axis=1)\n    \
                  found.append(all_cells[inside].tolist())\nprint(json.dumps(found))\n";
    let theirs: Vec<Vec<[u32; 3]>> =
        serde_json::from_value(Program::python_lines(script).arg(input).succeed().json()).expect("cells");
    assert_eq!(ours, theirs);
}

#[test]
fn votes_of_the_nearest_are_those_of_the_bench() {
    // Thirty training pairs and ten questions of noise in a corner of the grid, dense enough that no two are equally near.
    let mut draw = Stream::of_job(6, b"", "pairs");
    let mut grid = || {
        let (mut grid, reach) = (OccupancyGrid::new(40), 12 + draw.below(16) as u32);
        for cell in (0..reach.pow(3)).map(|at| [at / reach / reach, at / reach % reach, at % reach]) {
            if draw.unit() < 0.8 {
                grid.set(cell);
            }
        }
        grid
    };
    let (mut pairs, mut stored) = (TrainingPairs::default(), Vec::new());
    for _ in 0..30 {
        let (partial, complete) = (grid(), grid());
        stored.push([partial.bytes().to_vec(), complete.bytes().to_vec()]);
        pairs.add(&partial, complete);
    }
    let questions: Vec<OccupancyGrid> = (0..10).map(|_| grid()).collect();
    let asked: Vec<&[u8]> = questions.iter().map(OccupancyGrid::bytes).collect();
    let workspace = Workspace::new();
    let input = workspace.write("pairs.json", json!({ "pairs": stored, "asked": asked }).to_string());
    let script = "import json, sys\nimport numpy as np\nsys.path.insert(0, 'benches')\n\
                  from data_baselines import nearest, pooled\n\
                  stored = json.load(open(sys.argv[1]))\n\
                  unpack = lambda rows: np.unpackbits(np.array(rows, np.uint8), axis=1, bitorder='little', \
                  count=64000).reshape(-1, 40, 40, 40).astype(bool)\n\
                  partial, complete = (unpack([pair[part] for pair in stored['pairs']]) for part in (0, 1))\n\
                  rows = nearest(pooled(unpack(stored['asked'])), pooled(partial), 10)\n\
                  found = [complete[row].mean(axis=0) > 0.5 for row in rows]\n\
                  print(json.dumps([np.packbits(grid.ravel(), bitorder='little').tolist() for grid in found]))\n";
    let theirs: Vec<Vec<u8>> =
        serde_json::from_value(Program::python_lines(script).arg(input).succeed().json()).expect("grids");
    for (question, theirs) in questions.iter().zip(&theirs) {
        let ours = pairs.nearest_vote(question);
        assert!(ours.count() > 100, "a vote with a result");
        assert_eq!(ours.bytes(), &theirs[..]);
    }
}

/// A dataset of six shapes, three of them for tests, with all data that a completion is compared with.
fn dataset(workspace: &Workspace, channels: &str) -> PathBuf {
    let job = format!(
        "seed = 3\nviews = {{ even = 6 }}\n{channels}\n[split]\nvalidation_objects = 0\ntest_objects = 3\n\
         [[objects]]\nbuilt_in = [\"can-01\", \"mug-01\", \"bottle-01\", \"bowl-01\", \"box-01\", \"hammer-01\"]\n"
    );
    workspace.make_dataset("data", &job, &[])
}

const CHANNELS: &str = "[channels]\nvisibility = true\ncoverage = true\ndepth = \"f32\"\n";

#[test]
#[ignore = "slow: make test-all"]
fn geodesics_rules_and_smoothing_change_what_they_are_asked_for() {
    let workspace = Workspace::new();
    let data = dataset(&workspace, CHANNELS);
    assert_geodesics(&data);
    assert_thesis_rules(&data);
    assert_smoothing(&data);
}

/// Baselines for isolated objects.
fn without_table() -> impl Iterator<Item = Baseline> {
    Baseline::ALL.into_iter().filter(|baseline| !baseline.needs_table())
}

#[test]
fn models_and_baselines_stand_in_one_table() {
    let workspace = Workspace::new();
    let data = dataset(&workspace, CHANNELS);
    let run = |threads: &str| {
        let run = Program::new("evaluate").arg("completion").arg(&data).option("--model", MODEL);
        let run = without_table().fold(run, |run, baseline| run.option("--method", baseline.name()));
        run.option("--threads", threads).option("--surface-samples", "500")
    };
    let few = |threads: &str| run(threads).args(["--limit", "4", "--json"]).succeed().json::<Value>();
    assert_eq!(few("1"), few("2"), "the same by any count of threads");
    let report: Value = run("2").arg("--json").succeed().json();
    assert_eq!((report["samples"].as_u64(), report["split"].as_str()), (Some(18), Some("test")));
    let rows = report["rows"].as_array().expect("rows");
    let row = |name: &str| rows.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("{name}: {report}"));
    rows.iter().for_each(assert_row);
    // A perfect network's surface against the objects' own meshes: every method of making meshes is distinguished.
    let distance = |detail: &str| {
        let run = Program::new("evaluate").arg("completion").arg(&data).args(["--method", "truth", "--method", "knn"]);
        let run = run.args(["--method", "mean", "--detail", detail, "--limit", "6", "--surface-samples", "500"]);
        let report: Value = run.option("--truth", workspace.folder()).arg("--json").succeed().json();
        assert_eq!(report["truth"], "the objects' meshes");
        let rows = report["rows"].as_array().expect("rows");
        assert_eq!(rows[0]["detail"], detail);
        assert_eq!(number_at(&rows[0], "/iou/mean"), 1.0);
        // Three training objects are few to learn from.
        assert!((1e-3..0.95).contains(&number_at(&rows[1], "/iou/mean")), "{report}");
        assert!((0.05..0.95).contains(&number_at(&rows[2], "/iou/mean")), "{report}");
        number_at(&rows[0], "/surface_mm/mean")
    };
    let [coverage, thesis, joined] = ["coverage", "thesis", "joined"].map(distance);
    assert!(coverage < thesis && joined < thesis, "{coverage} {thesis} {joined}");
    // Methods compared with each other: like each alone, and less the first.
    let run_of_ways = Program::new("evaluate").arg("completion").arg(&data).args(["--method", "truth", "--limit", "6"]);
    let run_of_ways = run_of_ways.args(["--detail", "fast", "--detail", "coverage", "--surface-samples", "500"]);
    let report: Value = run_of_ways.option("--truth", workspace.folder()).arg("--json").succeed().json();
    let of_row = |row: usize, name: &str| number_at(&report, &format!("/rows/{row}/{name}/mean"));
    assert_eq!(report["rows"].as_array().map(Vec::len), Some(2));
    assert_eq!((report["rows"][1]["name"].as_str(), of_row(1, "surface_mm")), (Some("truth, coverage"), coverage));
    let less = of_row(1, "surface_over_first_mm");
    assert!((less - (coverage - of_row(0, "surface_mm"))).abs() < 1e-9 && less < -0.5, "{report}");
    assert!(
        of_row(0, "bias_mm") > 0.5 && of_row(1, "bias_mm").abs() < 0.5,
        "cells are some .7 cell too large: {report}"
    );
    assert!(report["rows"][0]["geodesic_divergence"].is_null());
    // What is seen is a shell: as a completion it adds nothing, and drawn out along the rays it comes nearer to the truth.
    assert_eq!(number_at(row("partial"), "/unseen_iou/mean"), 0.0);
    assert!(number_at(row("extrude"), "/iou/mean") > number_at(row("partial"), "/iou/mean") + 0.1, "{report}");
    assert!(row("extrude")["iou_over_baseline"].is_null() && row(MODEL)["iou_over_baseline"]["mean"].is_number());
    let said = assert_pages(&workspace, run);
    for words in [
        "18 samples of 3 objects, split test",
        "IoU, unseen",
        "mirror-far",
        "minus that of the best baseline",
        "truth: coverage",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    for (option, value, says) in [
        ("--method", "magic", "one of partial, extrude"),
        ("--method", "magic+smooth", "each also with the ending +smooth"),
        ("--smooth-steps", "0", "--smooth-steps"),
        ("--split", "all", "no such split"),
        ("--model", "docs", "model.json"),
    ] {
        let said = run("1").option(option, value).expect_code(2).stderr;
        assert!(said.contains(says), "{says}: {said}");
    }
}

/// Scores of one row are of three objects, in the units of their names.
fn assert_row(row: &Value) {
    let [low, mean, high] = ["low", "mean", "high"].map(|end| number_at(row, &format!("/iou/{end}")));
    // Not everything looks like a ball, a cylinder or a box.
    assert!(0.0 < low || row["name"] == "primitive" && number_at(row, "/empty") > 0.0, "{row}");
    assert!(low <= mean && mean <= high && high < 1.0, "{row}");
    assert_eq!(row["iou"]["objects"], 3);
    let distances = ["surface_mm", "rms_mm", "percentile_95_mm", "hausdorff_mm"];
    let distances = distances.map(|name| number_at(row, &format!("/{name}/mean")));
    assert!(distances.windows(2).all(|pair| pair[0] < pair[1]), "{row}");
    // Units: millimetres, and their squares.
    let (rms, chamfer) = (distances[1], number_at(row, "/chamfer_mm2/mean"));
    assert!((1.99..50.0).contains(&(chamfer / (rms * rms))), "{row}");
    assert!(number_at(row, "/bias_mm/mean").abs() < 2.0 * distances[0], "{row}");
    for share in ["mesh_iou", "f_score_percent", "f_score_5mm", "free_space_violation"] {
        assert!((0.0..=1.0).contains(&number_at(row, &format!("/{share}/mean"))), "{share}: {row}");
    }
    let parts = ["iou_of_solid", "iou_of_hollow_or_thin"].map(|name| row[name]["objects"].as_u64().unwrap_or(0));
    assert_eq!(parts.iter().sum::<u64>(), 3, "{row}");
    assert!(number_at(row, "/surface_mm/mean") > 0.1 && number_at(row, "/volume_ratio/mean") > 0.0, "{row}");
}

/// Geodesics of the true grids' surface differ little more from the truth's than other points of the truth do.
fn assert_geodesics(data: &Path) {
    let run_of_geodesics =
        Program::new("evaluate").arg("completion").arg(data).args(["--method", "truth", "--geodesics"]);
    let run_of_geodesics = run_of_geodesics.args(["--method", "extrude", "--limit", "3", "--surface-samples", "400"]);
    let report: Value = run_of_geodesics.arg("--json").succeed().json();
    let of_row = |row: usize, name: &str| number_at(&report, &format!("/rows/{row}/{name}/mean"));
    let (floor, truth, extruded) =
        (of_row(0, "geodesic_floor"), of_row(0, "geodesic_divergence"), of_row(1, "geodesic_divergence"));
    assert!(0.0 < floor && truth < extruded && extruded < 1.0, "{floor} {truth} {extruded}");
}

/// Rules of the thesis add columns, and change no other.
fn assert_thesis_rules(data: &Path) {
    let run = |rules: &str| {
        let run =
            Program::new("evaluate").arg("completion").arg(data).args(["--method", "truth", "--method", "extrude"]);
        run.args(["--limit", "6", "--surface-samples", "400", "--rules", rules])
    };
    let [standard, thesis] = ["standard", "thesis"].map(|rules| run(rules).arg("--json").succeed().json::<Value>());
    for row in 0..2 {
        let (standard, thesis) = (&standard["rows"][row], &thesis["rows"][row]);
        for (name, value) in thesis.as_object().expect("a row") {
            if name.starts_with("thesis_") {
                assert!(standard[name].is_null() && value["objects"] == 3, "{name}: {value}");
            } else {
                assert_eq!(standard[name], *value, "{name}");
            }
        }
        let of_row = |name: &str| number_at(thesis, &format!("/{name}/mean"));
        // The true grids' own mesh is the true one.
        assert_eq!(of_row("thesis_surface_mm") == 0.0, row == 0, "{thesis}");
        assert!(of_row("thesis_surface_mm") <= of_row("thesis_hausdorff_mm"), "{thesis}");
        assert!((0.0..=1.0).contains(&of_row("thesis_mesh_iou")), "{thesis}");
    }
    let said = run("thesis").succeed().stdout;
    assert!(said.contains("thesis: mesh IoU") && said.contains("(MeshLab)"), "{said}");
}

/// Smoothing changes the meshes of a method and not its cells.
fn assert_smoothing(data: &Path) {
    let run = |options: &[&str]| -> Vec<[f64; 3]> {
        let methods = ["--method", "hull", "--method", "hull+smooth", "--limit", "6", "--surface-samples", "400"];
        let run = Program::new("evaluate").arg("completion").arg(data).args(methods).args(options.iter().copied());
        let report: Value = run.arg("--json").succeed().json();
        let rows = report["rows"].as_array().expect("rows").iter();
        let names: Vec<&str> = rows.clone().filter_map(|row| row["name"].as_str()).collect();
        assert_eq!(names, ["hull", "hull+smooth"]);
        rows.map(|row| ["iou", "mesh_iou", "volume_ratio"].map(|name| number_at(row, &format!("/{name}/mean"))))
            .collect()
    };
    let six = run(&[]);
    assert_eq!(six[0][0], six[1][0]);
    assert!(six[1][2] < six[0][2], "smoothing shrinks: {six:?}");
    let [one, cotangent] = [&["--smooth-steps", "1"][..], &["--smooth-weights", "cotangent"]].map(run);
    assert!(one[0] == six[0] && cotangent[0] == six[0]);
    assert!(six[1][2] < one[1][2] && one[1][2] < one[0][2], "{six:?} {one:?}");
    assert!(cotangent[1] != six[1] && cotangent[1][2] < six[0][2], "{six:?} {cotangent:?}");
}

/// The page has the table, and pictures of three samples of each method; the same bytes by any count of threads.
fn assert_pages(workspace: &Workspace, run: impl Fn(&str) -> Program) -> String {
    let page_of = |name: &str, run: Program| {
        let page = workspace.path(format!("page-{name}.html"));
        let said = run.option("--out", &page).succeed().stdout;
        assert!(said.contains(&format!("page: {}", page.display())), "{said}");
        (std::fs::read_to_string(page).expect("a page"), said)
    };
    let few = ["1", "2"].map(|threads| page_of(threads, run(threads).option("--limit", "4")).0);
    assert_eq!(few[0], few[1]);
    let (page, said) = page_of("all", run("2"));
    for words in ["18 samples of 3 objects", "IoU, unseen", "mirror-far", "Best: ", "Median: ", "Worst: "] {
        assert!(page.contains(words), "{words}");
    }
    assert_eq!(page.matches("src=\"data:image/png").count(), 4 * 3 * (1 + without_table().count()));
    let nowhere = workspace.path("nowhere/page.html");
    let refused = run("1").args(["--limit", "1"]).option("--out", &nowhere).expect_code(74).stderr;
    assert!(refused.contains("nowhere/page.html"), "{refused}");
    said
}

#[test]
fn stored_samples_become_meshes() {
    let workspace = Workspace::new();
    let data = dataset(&workspace, CHANNELS);
    let complete =
        |out: &str| Program::on("complete", &data).option("--model", MODEL).option("--out", workspace.path(out));
    let said = complete("meshes").args(["--split", "test", "--limit", "5"]).succeed().stdout;
    assert!(said.contains("5 meshes, 0 samples without"), "{said}");
    let report = read_json(workspace.path("meshes/samples.json"));
    let samples = report["samples"].as_array().expect("samples");
    assert_eq!(samples.len(), 5);
    for sample in samples {
        let mesh = read_ply(&workspace.path("meshes").join(sample["mesh"].as_str().expect("a mesh")));
        assert!((mesh.signed_volume() - number_at(sample, "/volume")).abs() < 1e-9 && mesh.signed_volume() > 0.0);
        assert!(number_at(sample, "/overlap/iou") > 0.1, "{sample}");
    }
    assert_eq!(list_names(workspace.path("meshes")).len(), 6);
    for (arguments, says) in [
        (&["--intrinsics", "1,2,3,4"][..], "is a dataset: leave out"),
        (&["--to", "mjcf"], "ply, obj or stl"),
        (&["--split", "all"], "no such split"),
    ] {
        let said = complete("none").args(arguments).expect_code(2).stderr;
        assert!(said.contains(says), "{says}: {said}");
    }
    let picture =
        Program::on("complete", "scenes/table.png").args(["--intrinsics", "scenes/table.json", "--model", MODEL]);
    let said = picture.option("--out", workspace.path("none")).args(["--limit", "3"]).expect_code(2).stderr;
    assert!(said.contains("is not a dataset: leave out --split and --limit"), "{said}");
}

#[test]
fn a_dataset_without_what_the_model_takes_is_refused() {
    let workspace = Workspace::new();
    let data = dataset(&workspace, "[channels]\nvisibility = false\n");
    let run = Program::new("evaluate").arg("completion").arg(&data).option("--model", MODEL);
    let said = run.expect_code(2).stderr;
    assert!(said.contains("requires the input `free`") && said.contains("channels.visibility = true"), "{said}");
    let run = Program::new("evaluate").arg("completion").arg(&data).args(["--method", "primitive"]);
    let said = run.expect_code(2).stderr;
    assert!(said.contains("stores no depth") && said.contains("channels.depth"), "{said}");
}
