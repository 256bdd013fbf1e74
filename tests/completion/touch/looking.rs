//! Touch as readers, exports, pictures and verification show it.

use std::{collections::BTreeMap, fs};

use graspmill::{
    export::{ExportFormat, ExportSelection, export},
    files::Folder,
    publish::{TouchFacts, TouchKind, inspect_completion, report},
    runtime::{DatasetReader, Selection},
};

use crate::support::{
    files::{CHECK_INSIDE, assert_intact, read_text},
    program::Program,
    workspace::Workspace,
};

const JOB: &str = r#"
name = "touch looked at"
seed = 2
views = { even = 12 }

[[objects]]
built_in = ["cup-01", "bowl-01"]

[touch]
random_rays = true
rays = 60
"#;

#[test]
fn touch_is_read_checked_exported_and_drawn() {
    let workspace = Workspace::kept("touch");
    let data = workspace.make_dataset("data", JOB, &[]);
    let reader = DatasetReader::open(&Folder::at(&data)).expect("a dataset");
    let mut sums = TouchFacts::default();
    let mut rays = TouchKind { channel: "touch_rays".to_owned(), ..TouchKind::default() };
    let mut first = None;
    for sample in reader.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let touched = sample.touched().expect("sound records").expect("touch is stored");
        let (pair, touch) = (&touched.pair, &touched.touch[0].1);
        assert_eq!((touch.sample, touch.probes), (sample.id, 60));
        assert_eq!(
            reader.sample_of(&sample.id).expect("read").expect("kept").touched().expect("sound"),
            Some(touched.clone())
        );
        assert_eq!(touched.tactile, touch.tactile());
        assert_eq!(touched.tactile.count_both(&pair.complete), touched.tactile.count());
        let both = pair.partial.count() + touched.tactile.count() - pair.partial.count_both(&touched.tactile);
        assert_eq!(touched.partial_or_tactile.count(), both);
        sums.samples += 1;
        rays.probes += 60;
        rays.contacts += touch.contacts.len() as u64;
        rays.visible += u64::from(touch.visible());
        rays.outside += u64::from(touch.outside());
        sums.cells += u64::from(touched.tactile.count());
        sums.cells_in_partial += u64::from(touched.tactile.count_both(&pair.partial));
        first.get_or_insert(touched);
    }
    let first = first.expect("a sample");
    assert_intact(&data, CHECK_INSIDE);
    Program::on("verify", &data).option("--regenerate", "24").succeed();

    let facts = inspect_completion(&Folder::at(&data)).expect("facts");
    sums.kinds.push(rays);
    let cells = sums.cells;
    assert_eq!(facts.touch, Some(sums));
    assert!(facts.to_string().contains("of 60.0 probes per sample"), "{facts}");
    let page = read_text(report(&Folder::at(&data), None).expect("a report").path);
    for part in ["Touch points, from behind", "Partial and touch, from behind", "visible to the camera", "tactile"] {
        assert!(page.contains(part), "{part} is missing");
    }

    let bytes = fs::read(data.join("preview.mcap")).expect("a preview");
    let mut topics = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).expect("MCAP") {
        let message = message.expect("a message");
        let schema = message.channel.schema.as_ref().expect("a schema").name.clone();
        *topics.entry((message.channel.topic.clone(), schema)).or_insert(0) += 1;
    }
    assert_eq!(topics[&("/preview/touch".to_owned(), "foxglove.SceneUpdate".to_owned())], 12);

    let all = ExportSelection::default();
    export(&Folder::at(&data), ExportFormat::from_name("npy").expect("a format"), &workspace.path("npy"), &all)
        .expect("arrays");
    export(&Folder::at(&data), ExportFormat::from_name("pcd").expect("a format"), &workspace.path("pcd"), &all)
        .expect("clouds");
    export(&Folder::at(&data), ExportFormat::from_name("binvox").expect("a format"), &workspace.path("binvox"), &all)
        .expect("grids");
    let script = r#"
import sys, numpy as np
from pathlib import Path
out = Path(sys.argv[1])
grids = {kind: np.load(out / f"npy/{kind}.npy") for kind in ["partial", "complete", "tactile"]}
assert len({grid.shape for grid in grids.values()}) == 1
assert not (grids["tactile"] & ~grids["complete"]).any()
clouds = sorted(out.glob("pcd/*/*_tc.pcd"))
head, data = clouds[0].read_bytes().split(b"DATA binary\n")
assert b"FIELDS x y z normal_x normal_y normal_z\nSIZE 4 4 4 4 4 4\n" in head
rows = np.frombuffer(data, "<f4").reshape(-1, 6)
assert np.allclose(np.linalg.norm(rows[:, 3:], axis=1), 1, atol=1e-6)
print(len(clouds), len(list(out.glob("binvox/*/*_tactile.binvox"))), len(list(out.glob("pcd/*/*_t.pcd"))), int(np.unpackbits(grids["tactile"]).sum()))
"#;
    let text = Program::python_lines(script).arg(workspace.folder()).succeed().stdout;
    assert_eq!(text.trim(), format!("24 24 24 {cells}"));
    assert!(first.tactile.count() > 0);
}
