//! Pictures and reports of shapes that are known in closed form.

use std::collections::BTreeSet;

use graspmill::{
    files::Folder,
    geom::OccupancyGrid,
    publish::{
        CompletionInspection, RunNotes, Speed, inspect_completion,
        picture::{Eye, Slices, VoxelPainter, centre_of_mass},
        report,
    },
};

use crate::support::{files::read_text, shelf::Shelf, workspace::Workspace};

/// A solid shape of 40^3 cells, the cells of it that an orthographic camera at -z sees, and those that it sees to be free.
fn shape(inside: impl Fn(f64, f64, f64) -> bool) -> [OccupancyGrid; 3] {
    let n = 40;
    let [mut partial, mut complete, mut free] = [0; 3].map(|_| OccupancyGrid::new(n));
    for x in 0..n {
        for y in 0..n {
            let mut seen = false;
            for z in 0..n {
                let [a, b, c] = [x, y, z].map(|index| f64::from(index) + 0.5);
                if inside(a - 20.0, b - 20.0, c - 20.0) {
                    complete.set([x, y, z]);
                    if !seen {
                        partial.set([x, y, z]);
                    }
                    seen = true;
                } else if !seen {
                    free.set([x, y, z]);
                }
            }
        }
    }
    [partial, complete, free]
}

fn mug(x: f64, y: f64, z: f64) -> bool {
    let r = x.hypot(z);
    let wall = r < 11.0 && r > 8.6 && y.abs() < 14.0;
    let floor = r < 11.0 && y > 11.5 && y < 14.0;
    let handle = ((x - 11.0).hypot(y) - 7.0).hypot(z) < 2.0 && x > 9.5;
    wall || floor || handle
}

#[test]
fn pictures() {
    let out = Workspace::kept("pictures");
    let revolved = |f: fn(f64, f64, f64) -> bool| {
        move |x: f64, y: f64, z: f64| {
            let (x, z) = (0.6 * x + 0.8 * z, -0.8 * x + 0.6 * z);
            let (y, z) = (0.866 * y - 0.5 * z, 0.5 * y + 0.866 * z);
            f(x, y, z)
        }
    };
    for (name, grids) in [
        ("sphere", shape(|x, y, z| x * x + y * y + z * z < 16.0 * 16.0)),
        ("torus", shape(revolved(|x, y, z| (x.hypot(y) - 12.0).hypot(z) < 4.5))),
        ("mug", shape(revolved(mug))),
    ] {
        let [partial, complete, free] = grids;
        for (eye_name, eye) in [("front", Eye::CameraSide), ("behind", Eye::Behind)] {
            let painter = VoxelPainter::new(400, eye, &[&complete, &partial]);
            for (kind, p, c) in [
                ("overlay", Some(&partial), Some(&complete)),
                ("partial", Some(&partial), None),
                ("complete", None, Some(&complete)),
            ] {
                let png = painter.draw(p, c).with_few_colours().to_png();
                assert!(png.len() < 80_000, "{name} {eye_name} {kind}: {} bytes", png.len());
                out.write(format!("{name}_{eye_name}_{kind}.png"), png);
            }
        }
        let slices = Slices::new(&partial, &complete, Some(&free), centre_of_mass(&complete), 8);
        for (cut, picture) in [("front", slices.front), ("side", slices.side), ("top", slices.top)] {
            out.write(format!("{name}_slice_{cut}.png"), picture.to_png());
        }
    }
}

#[test]
fn a_report_is_one_file_that_needs_nothing_else() {
    let out = Workspace::kept("reports");
    for (name, with_depth) in [("depth", true), ("default", false)] {
        let folder = out.path(name);
        let shelf = Shelf { views: if with_depth { 5 } else { 3 }, with_depth }.write(&folder);
        let summary = report(&Folder::at(&folder), None).unwrap();
        let page = read_text(&summary.path);
        assert_eq!(summary.path, folder.join("report.html"));
        assert_eq!(summary.bytes, page.len() as u64);
        assert!(page.len() < 5 << 20, "{} bytes", page.len());
        for outside in ["http://", "https://", "<script", "url("] {
            assert!(!page.contains(outside), "the page names {outside}");
        }
        for part in
            [shelf.manifest.root.hex().as_str(), "Ölflasche", "&lt;care&gt; &amp; &quot;quotes&quot;", "broken.stl"]
        {
            assert!(page.contains(part), "{part} is missing");
        }
        assert!(!page.contains("<care>"), "names are text, not markup");
        let again = out.path(format!("{name}.again.html"));
        report(&Folder::at(&folder), Some(&again)).unwrap();
        assert_eq!(read_text(again), page, "same bytes again");
    }
}

#[test]
fn overlaps_that_a_job_is_about_are_no_alarm() {
    let workspace = Workspace::new();
    let folder = workspace.path("shelf");
    Shelf { views: 2, with_depth: false }.write(&folder);
    let name = "twin_groups_straddling".to_owned();
    let leaks = [(name.clone(), 6), ("groups_straddling".to_owned(), 1)].into();
    let mut notes = RunNotes { leaks, ..RunNotes::default() };
    let rendered = |notes: &RunNotes| {
        notes.write(&Folder::at(&folder)).expect("notes");
        let page = report(&Folder::at(&folder), None).expect("a report").path;
        (read_text(page), inspect_completion(&Folder::at(&folder)).expect("facts").to_string())
    };
    let (page, text) = rendered(&notes);
    let twins = "6 groups of objects of the same shape on more than one side of the split";
    assert!(page.contains(&format!("<li class=\"alarm\">{twins}</li>")), "{page}");
    // Not split by groups, these may be in any subset.
    assert!(page.contains("<li>1 groups named by the job on more than one side of the split</li>"), "{page}");
    assert!(text.contains(&format!("{twins}\n")), "{text}");
    notes.intended.insert(name);
    let (page, text) = rendered(&notes);
    assert!(page.contains(&format!("<li>{twins}, intended by the job</li>")), "{page}");
    assert!(text.contains(&format!("{twins}, intended by the job\n")), "{text}");
}

#[test]
fn inspection_counts_what_stands_in_the_dataset() {
    let workspace = Workspace::new();
    let folder = workspace.path("shelf");
    let shelf = Shelf { views: 6, with_depth: false }.write(&folder);
    RunNotes {
        speed: Some(Speed { samples: 36, seconds: 0.5, threads: 2, peak_memory: None }),
        leaks: [("twin_groups_straddling".to_owned(), 0)].into(),
        intended: BTreeSet::new(),
    }
    .write(&Folder::at(&folder))
    .unwrap();
    let facts = inspect_completion(&Folder::at(&folder)).unwrap();
    assert_eq!((facts.planned, facts.kept), (36, shelf.kept.len() as u64));
    assert_eq!(facts.kept + facts.rejected.values().sum::<u64>(), facts.planned);
    let cells: Vec<f64> = shelf.kept.iter().map(|(_, pair, _)| f64::from(pair.partial_cells)).collect();
    assert_eq!(facts.partial_cells.max, cells.iter().copied().fold(0.0, f64::max));
    assert!((facts.partial_cells.mean - cells.iter().sum::<f64>() / cells.len() as f64).abs() < 1e-9);
    let cut_off = shelf.kept.iter().filter(|(_, pair, _)| pair.solid_share < 0.99).count() as u64;
    assert_eq!(facts.cut_off, cut_off);
    assert_eq!(facts.objects.len(), 6);
    let ring = facts.objects.iter().find(|object| object.name == "ring").unwrap();
    assert_eq!((ring.watertight, ring.repairs.as_slice()), (Some(false), ["4 duplicate faces".to_owned()].as_slice()));
    assert_eq!(facts.splits.iter().map(|split| split.samples).sum::<u64>(), facts.kept);
    let text = facts.to_string();
    for part in [
        "36 planned",
        "72 samples/s",
        "broken.stl: 84 bytes of 50 084; copy the file again",
        "0 groups of objects of the same shape on more than one side of the split",
    ] {
        assert!(text.contains(part), "'{part}' is missing in\n{text}");
    }
    let json = serde_json::to_string(&facts).unwrap();
    assert_eq!(serde_json::from_str::<CompletionInspection>(&json).unwrap(), facts);
}
