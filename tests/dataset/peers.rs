//! Readers that are not ours.

use std::{collections::BTreeMap, fs, path::Path};

use graspmill::{
    files::Folder,
    format::dataset::{DatasetReader, Selection},
    geom::DepthCrop,
    preview::{PreviewSample, preview_samples, write_preview},
};
use serde_json::{Value, json};

use crate::support::{
    program::{Program, print_by_rerun},
    small_dataset::SmallDataset,
    workspace::Workspace,
};

#[test]
fn python_reads_our_shards_by_reflection() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    small.finish(folder.folder());
    let facts: Vec<Value> = Program::python().arg("tests/peers/read_shard.py").arg(folder.folder()).succeed().json();
    let pairs: Vec<_> = facts.iter().filter(|row| row["topic"] == "/completion/pair").collect();
    assert_eq!((pairs.len(), facts.len()), (29, 58));
    for row in pairs {
        let index = row["index"].as_u64().unwrap();
        let (id, expected) = (small.id(index), small.pair(index));
        assert_eq!(row["subject"], id.subject.to_string());
        assert_eq!(row["item"], id.item.0);
        // Asymmetric shapes: a swapped axis or bit order shows.
        assert_eq!(row["first"], json!(expected.complete.cells().next().unwrap()));
        assert_eq!(row["last"], json!(expected.partial.cells().last().unwrap()));
        assert_eq!(row["pose"], json!(expected.camera_from_object.to_rows()));
    }
}

/// A dataset's preview, with a depth image made by hand.
fn preview(folder: &Path) -> Vec<PreviewSample> {
    SmallDataset::default().finish(folder);
    let reader = DatasetReader::open(&Folder::at(folder)).unwrap();
    let mut samples = preview_samples(&reader, 8).unwrap();
    assert_eq!(samples.len(), 8);
    for sample in &mut samples {
        let depth = (0..200).map(|pixel| if pixel % 7 == 0 { f32::NAN } else { 0.9 + pixel as f32 * 1e-4 }).collect();
        sample.depth = Some(DepthCrop { left: 300, top: 200, width: 20, height: 10, depth });
    }
    write_preview(&Folder::at(folder), &samples).unwrap();
    assert!(reader.indices(Selection::default()).count() > 8);
    samples
}

#[test]
fn a_preview_holds_well_known_schemas_at_one_time_a_sample() {
    let folder = Workspace::new();
    let samples = preview(folder.folder());
    let bytes = fs::read(folder.path("preview.mcap")).unwrap();
    let mut topics = BTreeMap::new();
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
    let again = Workspace::new();
    write_preview(&Folder::at(again.folder()), &samples).unwrap();
    assert_eq!(fs::read(again.path("preview.mcap")).unwrap(), bytes);
}

#[test]
#[ignore = "slow: needs rerun-sdk (100 MB)"]
fn rerun_opens_a_preview() {
    let folder = Workspace::new();
    preview(folder.folder());
    let printed = print_by_rerun(&folder.path("preview.mcap"));
    for kind in ["Points3D", "Pinhole", "Transform3D", "Image"] {
        assert!(printed.contains(kind), "no {kind} in {printed}");
    }
}
