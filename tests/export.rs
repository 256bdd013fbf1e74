//! Exports, read back by NumPy, trimesh and by hand.

use std::{fs, path::Path};

use graspmill::{
    dataset::{DatasetError, DatasetReader, Selection, Split},
    export::{ExportError, ExportSelection, Format, export},
    geom::OccupancyGrid,
};
use python::PYTHON;
use shapes::{Made, Shelf};

mod python;
mod shapes;

fn shelf(folder: &Path, with_depth: bool) -> Made {
    Shelf { views: 4, with_depth }.write(&folder.join("shelf"))
}

/// One byte a cell, in C order.
fn bytes_of<'a>(grids: impl Iterator<Item = &'a OccupancyGrid>) -> Vec<u8> {
    grids
        .flat_map(|grid| {
            let n = grid.resolution();
            (0..n * n * n).map(move |i| u8::from(grid.get([i / n / n, i / n % n, i % n])))
        })
        .collect()
}

#[test]
fn numpy_reads_the_arrays_packed_and_unpacked() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let made = shelf(folder, false);
    fs::write(folder.join("partial.raw"), bytes_of(made.kept.iter().map(|(_, pair, _)| &pair.partial))).unwrap();
    fs::write(folder.join("complete.raw"), bytes_of(made.kept.iter().map(|(_, pair, _)| &pair.complete))).unwrap();
    for packed in [true, false] {
        let out = folder.join(format!("arrays_{packed}"));
        let selection = ExportSelection::default();
        let summary = export(&folder.join("shelf"), Format::Npy { packed }, &out, &selection).unwrap();
        assert_eq!((summary.samples, summary.files), (made.kept.len() as u64, 4));
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
        let text = python::run(PYTHON, |command| command.args(["-c", script]).args([&out, folder]));
        let first = &made.kept[0].1;
        assert_eq!(text.trim(), format!("{} 6 ball {}", made.manifest.root, first.grid.cell_size));
    }
}

#[test]
fn trimesh_reads_the_binvox_files() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let made = shelf(folder, false);
    let out = folder.join("binvox");
    let selection = ExportSelection { objects: vec!["mug".to_owned()], limit: Some(2), ..ExportSelection::default() };
    let summary = export(&folder.join("shelf"), Format::Binvox, &out, &selection).unwrap();
    assert_eq!(summary.samples, 2);
    let mugs: Vec<_> = made.kept.iter().filter(|(index, ..)| (8..10).contains(&index.0)).collect();
    fs::write(folder.join("partial.raw"), bytes_of(mugs.iter().map(|(_, pair, _)| &pair.partial))).unwrap();
    fs::write(folder.join("complete.raw"), bytes_of(mugs.iter().map(|(_, pair, _)| &pair.complete))).unwrap();
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
    let answer = python::run(PYTHON, |command| command.args(["-c", script]).args([&out, folder]));
    assert_eq!(answer.trim(), head);
}

#[test]
fn point_clouds_hold_cells_and_seen_points() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let made = shelf(folder, true);
    let out = folder.join("pcd");
    let selection = ExportSelection { samples: Selection::of(Split::TestModels), ..ExportSelection::default() };
    export(&folder.join("shelf"), Format::Pcd, &out, &selection).unwrap();
    let (_, pair, cloud) = made.kept.iter().find(|(index, ..)| index.0 == 17).unwrap();
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
    assert_eq!(fs::read_dir(&out).unwrap().count(), 3, "samples.csv, export.json, ring/");
}

#[test]
fn selections_hold_and_nothing_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    shelf(folder, false);
    let shelf = folder.join("shelf");
    let npy = Format::Npy { packed: true };
    let rows = |out: &Path| fs::read_to_string(out.join("samples.csv")).unwrap().lines().count() - 1;

    let reader = DatasetReader::open(&shelf).unwrap();
    let holdout = Selection::of(Split::HoldoutViews);
    let out = folder.join("holdout");
    let selection = ExportSelection { samples: holdout, ..ExportSelection::default() };
    export(&shelf, npy, &out, &selection).unwrap();
    assert_eq!(rows(&out), reader.indices(holdout).count());
    assert!(
        fs::read_to_string(out.join("samples.csv")).unwrap().lines().skip(1).all(|row| row.contains("holdout_views"))
    );

    let before = fs::read(out.join("partial.npy")).unwrap();
    let error = export(&shelf, npy, &out, &ExportSelection::default()).unwrap_err();
    assert!(matches!(error, ExportError::Dataset(DatasetError::Occupied { .. })), "{error}");
    assert_eq!(fs::read(out.join("partial.npy")).unwrap(), before);

    let unknown = ExportSelection { objects: vec!["mugg".to_owned()], ..ExportSelection::default() };
    let error = export(&shelf, npy, &folder.join("unknown"), &unknown).unwrap_err().to_string();
    assert!(error.contains("no object is called 'mugg'") && error.contains("mug, ring"), "{error}");

    let none = ExportSelection { limit: Some(0), ..ExportSelection::default() };
    let error = export(&shelf, npy, &folder.join("none"), &none).unwrap_err();
    assert!(matches!(error, ExportError::NothingSelected { .. }), "{error}");

    let file = folder.join("file");
    fs::write(&file, "x").unwrap();
    let error = export(&shelf, npy, &file, &ExportSelection::default()).unwrap_err();
    assert!(matches!(error, ExportError::Dataset(DatasetError::NotAFolder { .. })), "{error}");

    // A damaged shard: an error, and no half export left under any name.
    let shard = fs::read_dir(shelf.join("shards")).unwrap().next().unwrap().unwrap().path();
    let mut bytes = fs::read(&shard).unwrap();
    let middle = bytes.len() / 3;
    bytes[middle] ^= 0x10;
    fs::write(&shard, bytes).unwrap();
    let broken = folder.join("broken");
    export(&shelf, npy, &broken, &ExportSelection::default()).unwrap_err();
    assert!(!broken.exists());
    let left: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(!left.iter().any(|name| name.to_string_lossy().contains("tmp")), "{left:?}");
}
