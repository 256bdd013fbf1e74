//! Exports, read back by NumPy, trimesh and by hand.

use std::{fs, path::Path};

use graspmill::{
    export::{ExportError, ExportFormat, ExportSelection, ExportSummary, export},
    files::Folder,
    format::dataset::{DatasetError, DatasetReader, Selection},
    geom::OccupancyGrid,
    words::Split,
};

use crate::support::{
    files::{flip_bit, list_names, list_shards, read_text},
    program::Program,
    shelf::{Shelf, ShelfContent},
    workspace::Workspace,
};

fn write_shelf(workspace: &Workspace, with_depth: bool) -> ShelfContent {
    Shelf { views: 4, with_depth }.write(&workspace.path("shelf"))
}

/// Exports a dataset in the format of a name.
fn export_as(
    format: &str,
    folder: &Path,
    out: &Path,
    selection: &ExportSelection,
) -> Result<ExportSummary, ExportError> {
    export(&Folder::at(folder), ExportFormat::from_name(format).expect("a format"), out, selection)
}

/// One byte per cell, in C order.
fn cell_bytes<'a>(grids: impl Iterator<Item = &'a OccupancyGrid>) -> Vec<u8> {
    grids
        .flat_map(|grid| {
            let n = grid.resolution();
            (0..n * n * n).map(move |i| u8::from(grid.get([i / n / n, i / n % n, i % n])))
        })
        .collect()
}

#[test]
fn numpy_reads_the_arrays_packed_and_unpacked() {
    let folder = Workspace::new();
    let shelf = write_shelf(&folder, false);
    folder.write("partial.raw", cell_bytes(shelf.kept.iter().map(|(_, pair, _)| &pair.partial)));
    folder.write("complete.raw", cell_bytes(shelf.kept.iter().map(|(_, pair, _)| &pair.complete)));
    for packed in [true, false] {
        let out = folder.path(format!("arrays_{packed}"));
        let selection = ExportSelection { unpacked: !packed, ..ExportSelection::default() };
        let summary = export_as("npy", &folder.path("shelf"), &out, &selection).unwrap();
        assert_eq!((summary.count, summary.files), (shelf.kept.len() as u64, 4));
        let script = r#"
import csv, json, sys, numpy as np
out, raw = sys.argv[1], sys.argv[2]
rows = list(csv.DictReader(open(out + "/samples.csv", encoding="utf-8")))
for kind in ["partial", "complete"]:
    array = np.load(out + f"/{kind}.npy", mmap_mode="r")
    if array.dtype == np.uint8:
        assert array.shape == (len(rows), 8000), array.shape
        array = np.unpackbits(array, axis=1, bitorder="little").reshape(-1, 40, 40, 40)
    else:
        assert array.dtype == np.bool_ and array.shape == (len(rows), 40, 40, 40), array.shape
    expected = np.fromfile(raw + f"/{kind}.raw", np.uint8).reshape(-1, 40, 40, 40)
    assert np.array_equal(array, expected)
    assert [int(row[kind + "_cells"]) for row in rows] == array.sum(axis=(1, 2, 3), dtype=int).tolist()
assert [row["row"] for row in rows] == [str(i) for i in range(len(rows))]
facts = json.load(open(out + "/export.json"))
assert facts["samples"] == len(rows)
print(facts["root"], len({row["object"] for row in rows}), rows[0]["object"], float(rows[0]["cell_size"]))
"#;
        let text = Program::python_lines(script).arg(&out).arg(folder.folder()).succeed().stdout;
        let first = &shelf.kept[0].1;
        assert_eq!(text.trim(), format!("{} 6 ball {}", shelf.manifest.root, first.grid.cell_size));
    }
}

#[test]
fn trimesh_reads_the_binvox_files() {
    let folder = Workspace::new();
    let shelf = write_shelf(&folder, false);
    let out = folder.path("binvox");
    let selection = ExportSelection { objects: vec!["mug".to_owned()], limit: Some(2), ..ExportSelection::default() };
    let summary = export_as("binvox", &folder.path("shelf"), &out, &selection).unwrap();
    assert_eq!(summary.count, 2);
    let mugs: Vec<_> = shelf.kept.iter().filter(|(index, ..)| (8..10).contains(&index.0)).collect();
    folder.write("partial.raw", cell_bytes(mugs.iter().map(|(_, pair, _)| &pair.partial)));
    folder.write("complete.raw", cell_bytes(mugs.iter().map(|(_, pair, _)| &pair.complete)));
    let script = r#"
import sys, numpy as np, trimesh
out, raw = sys.argv[1], sys.argv[2]
for kind in ["partial", "complete"]:
    expected = np.fromfile(raw + f"/{kind}.raw", np.uint8).reshape(-1, 40, 40, 40).astype(bool)
    for view in range(2):
        path = f"{out}/mug/view_{view:05}_{kind}.binvox"
        assert np.array_equal(trimesh.load(path).matrix, expected[view]), path
        if view == 0 and kind == "partial":
            head = open(path, "rb").read(200).split(b"\ndata\n")[0].decode().split("\n")
            print("|".join(head))
"#;
    let grid = &mugs[0].1.grid;
    let lower = grid.lower_corner();
    let head =
        format!("#binvox 1|dim 40 40 40|translate {} {} {}|scale {}", lower.x, lower.y, lower.z, 40.0 * grid.cell_size);
    let answer = Program::python_lines(script).arg(&out).arg(folder.folder()).succeed().stdout;
    assert_eq!(answer.trim(), head);
}

#[test]
fn point_clouds_hold_cells_and_seen_points() {
    let folder = Workspace::new();
    let shelf = write_shelf(&folder, true);
    let out = folder.path("pcd");
    let selection = ExportSelection { samples: Selection::from_split(Split::Test), ..ExportSelection::default() };
    export_as("pcd", &folder.path("shelf"), &out, &selection).unwrap();
    let (_, pair, cloud) = shelf.kept.iter().find(|(index, ..)| index.0 == 17).unwrap();
    // By hand, after the format's description: a text head up to DATA, then x y z as little-endian float32.
    let points = |kind: &str| -> Vec<[f32; 3]> {
        let bytes = fs::read(out.join(format!("ring/view_00001_{kind}.pcd"))).unwrap();
        let mark = b"DATA binary\n";
        let data = bytes.windows(mark.len()).position(|window| window == mark).unwrap() + mark.len();
        let head = String::from_utf8(bytes[..data].to_vec()).unwrap();
        let points: Vec<[f32; 3]> = bytes[data..]
            .chunks_exact(12)
            .map(|point| std::array::from_fn(|axis| f32::from_le_bytes(point[4 * axis..][..4].try_into().unwrap())))
            .collect();
        for line in ["VERSION 0.7", "FIELDS x y z", "SIZE 4 4 4", "TYPE F F F", "COUNT 1 1 1", "HEIGHT 1"] {
            assert!(head.lines().any(|found| found == line), "{line} is missing in {head}");
        }
        for name in ["WIDTH", "POINTS"] {
            assert!(head.contains(&format!("\n{name} {}\n", points.len())), "{head}");
        }
        points
    };
    let cells = |grid: &OccupancyGrid| -> Vec<[f32; 3]> { grid.cells().map(|cell| cell.map(|i| i as f32)).collect() };
    assert_eq!(points("x"), cells(&pair.partial));
    assert_eq!(points("y"), cells(&pair.complete));
    assert_eq!(points("pc"), cloud.points);
    // Ring is the one test model of the shelf.
    assert_eq!(list_names(&out).len(), 3, "samples.csv, export.json, ring/");
}

#[test]
fn selections_hold_and_nothing_is_overwritten() {
    let folder = Workspace::new();
    write_shelf(&folder, false);
    let shelf = folder.path("shelf");
    let rows = |out: &Path| read_text(out.join("samples.csv")).lines().count() - 1;

    let reader = DatasetReader::open(&Folder::at(&shelf)).unwrap();
    let holdout = Selection::from_split(Split::Holdout);
    let out = folder.path("holdout");
    let selection = ExportSelection { samples: holdout, ..ExportSelection::default() };
    export_as("npy", &shelf, &out, &selection).unwrap();
    assert_eq!(rows(&out), reader.indices(holdout).count());
    assert!(read_text(out.join("samples.csv")).lines().skip(1).all(|row| row.contains("holdout")));

    let before = fs::read(out.join("partial.npy")).unwrap();
    let error = export_as("npy", &shelf, &out, &ExportSelection::default()).unwrap_err();
    assert!(matches!(error, ExportError::Dataset(DatasetError::Occupied { .. })), "{error}");
    assert_eq!(fs::read(out.join("partial.npy")).unwrap(), before);

    let unknown = ExportSelection { objects: vec!["mugg".to_owned()], ..ExportSelection::default() };
    let error = export_as("npy", &shelf, &folder.path("unknown"), &unknown).unwrap_err().to_string();
    assert!(error.contains("no object has the name 'mugg'") && error.contains("mug, ring"), "{error}");

    let unpacked = ExportSelection { unpacked: true, ..ExportSelection::default() };
    let error = export_as("pcd", &shelf, &folder.path("unpacked"), &unpacked).unwrap_err().to_string();
    assert!(error.contains("pcd stores only packed bits; leave out --unpacked"), "{error}");
    let error = export_as("graspit", &shelf, &folder.path("map"), &ExportSelection::default()).unwrap_err().to_string();
    assert!(error.contains("use --to npy, parquet, webdataset, binvox or pcd"), "{error}");

    let none = ExportSelection { limit: Some(0), ..ExportSelection::default() };
    let error = export_as("npy", &shelf, &folder.path("none"), &none).unwrap_err();
    assert!(matches!(error, ExportError::NothingSelected { .. }), "{error}");

    let file = folder.write("file", "x");
    let error = export_as("npy", &shelf, &file, &ExportSelection::default()).unwrap_err();
    assert!(matches!(error, ExportError::Dataset(DatasetError::NotAFolder { .. })), "{error}");

    // A damaged shard: an error, and no half export left under any name.
    flip_bit(&list_shards(&shelf)[0]);
    let broken = folder.path("broken");
    export_as("npy", &shelf, &broken, &ExportSelection::default()).unwrap_err();
    assert!(!broken.exists());
    let left = list_names(folder.folder());
    assert!(!left.iter().any(|name| name.contains("tmp")), "{left:?}");
}
