//! Readers that are not ours.

use std::path::Path;

use graspmill::dataset::{DatasetReader, PreviewSample, Selection, preview_samples, write_preview};

use crate::{
    made::{Made, pair},
    python::{self, PYTHON},
};

#[test]
fn python_reads_our_shards_by_reflection() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    made.finish(folder.path());
    let facts = python::run(PYTHON, |command| command.arg("tests/dataset/read_shard.py").arg(folder.path()));
    let facts: serde_json::Value = serde_json::from_str(&facts).unwrap();
    let facts = facts.as_array().unwrap();
    let pairs: Vec<_> = facts.iter().filter(|row| row["topic"] == "/completion/pair").collect();
    assert_eq!((pairs.len(), facts.len()), (29, 58));
    for row in pairs {
        let index = row["index"].as_u64().unwrap();
        let id = made.id(index);
        let expected = pair(id, index, made.resolution);
        assert_eq!(row["subject"], id.subject.to_string());
        assert_eq!(row["view"], id.view.0);
        // Asymmetric shapes: a swapped axis or bit order shows.
        assert_eq!(row["first"], serde_json::json!(expected.complete.cells().next().unwrap()));
        assert_eq!(row["last"], serde_json::json!(expected.partial.cells().last().unwrap()));
        assert_eq!(row["pose"], serde_json::json!(expected.camera_from_object.to_rows()));
    }
}

/// A dataset's preview, with a depth image made by hand.
fn preview(folder: &Path) -> Vec<PreviewSample> {
    let made = Made::default();
    made.finish(folder);
    let reader = DatasetReader::open(folder).unwrap();
    let mut samples = preview_samples(&reader, 8).unwrap();
    assert_eq!(samples.len(), 8);
    for sample in &mut samples {
        let depth = (0..200).map(|pixel| if pixel % 7 == 0 { f32::NAN } else { 0.9 + pixel as f32 * 1e-4 }).collect();
        sample.depth = Some(graspmill::geom::DepthCrop { left: 300, top: 200, width: 20, height: 10, depth });
    }
    write_preview(folder, &samples).unwrap();
    assert!(reader.indices(Selection::default()).count() > 8);
    samples
}

#[test]
fn a_preview_holds_well_known_schemas_at_one_time_a_sample() {
    let folder = tempfile::tempdir().unwrap();
    let samples = preview(folder.path());
    let bytes = std::fs::read(folder.path().join("preview.mcap")).unwrap();
    let mut topics = std::collections::BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        assert!(message.log_time % 1_000_000_000 == 0 && message.log_time / 1_000_000_000 < 8);
        let schema = message.channel.schema.as_ref().unwrap();
        *topics.entry((message.channel.topic.clone(), schema.name.clone())).or_insert(0) += 1;
    }
    let expected = [
        ("/preview/camera", "CameraCalibration", 8),
        ("/preview/complete", "PointCloud", 8),
        ("/preview/depth", "RawImage", 8),
        ("/preview/partial", "PointCloud", 8),
        ("/preview/tf", "FrameTransform", 16),
    ];
    let expected = expected.map(|(topic, schema, count)| ((topic.to_owned(), format!("foxglove.{schema}")), count));
    assert_eq!(topics.into_iter().collect::<Vec<_>>(), expected);
    let again = tempfile::tempdir().unwrap();
    write_preview(again.path(), &samples).unwrap();
    assert_eq!(std::fs::read(again.path().join("preview.mcap")).unwrap(), bytes);
}

#[test]
#[ignore = "slow: needs rerun-sdk (100 MB)"]
fn rerun_opens_a_preview() {
    let folder = tempfile::tempdir().unwrap();
    preview(folder.path());
    let path = folder.path().join("preview.mcap");
    let (path, out) = (path.to_str().unwrap(), folder.path().join("preview.rrd"));
    let rerun = |arguments: &[&str]| python::run("peers/bin/rerun", |command| command.args(arguments));
    rerun(&["analytics", "disable"]);
    rerun(&["mcap", "check", path]);
    rerun(&["mcap", "convert", path, "-o", out.to_str().unwrap()]);
    let printed = rerun(&["rrd", "print", "-vv", out.to_str().unwrap()]);
    for kind in ["Points3D", "Pinhole", "Transform3D", "Image"] {
        assert!(printed.contains(kind), "no {kind} in {printed}");
    }
}
