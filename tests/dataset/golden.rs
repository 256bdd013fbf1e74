//! Shards of each past version stay readable or are refused with the remedy, and the present version writes the same bytes.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use graspmill::{
    files::Folder,
    format::{
        Channel, Facts, Product, Visibility, VoxelPair,
        dataset::{
            DatasetError, DatasetReader, Fate, Manifest, VerifyReport, begin_run, read_mark, scan_shards, verify,
        },
    },
    ids::{Digest, SampleIndex},
    words::{NumberClass, Split},
};
use serde_json::json;

use crate::support::{
    files::{CHECK_INSIDE, assert_intact, list_names, list_shards, read_text, repository_path},
    small_dataset::{SmallDataset, free_cells, job_digest, make_touch, unseal},
    workspace::Workspace,
};

/// Kinds of touch in the golden shards.
const TOUCH: [Channel; 3] = [Channel::TOUCH_RAYS, Channel::TOUCH_EXPLORATION, Channel::TOUCH_GRASP];

fn small() -> SmallDataset {
    let channels = [Channel::PAIR, Channel::VISIBILITY].into_iter().chain(TOUCH).collect();
    let sizes = SmallDataset { objects: 2, views: 3, shard_samples: 4, ..SmallDataset::default() };
    SmallDataset { resolution: 9, reject_every: 4, channels, ..sizes }
}

fn golden(version: &str) -> PathBuf {
    repository_path("tests/golden").join(version)
}

#[test]
fn older_versions_are_refused_with_their_number_and_the_remedy() {
    for old in [1, 2, 3] {
        let folder = golden(&format!("v{old}"));
        let assert_refused = |error: DatasetError| {
            assert!(matches!(error, DatasetError::Version { found, expected: 4, .. } if found == old), "{error}");
            let text = error.to_string();
            for part in [
                format!("has format version {old}, this program reads 4"),
                "make it again from its job with `graspmill run`".to_owned(),
                format!("read it with a graspmill of format {old}"),
            ] {
                assert!(text.contains(&part), "{part} is not in: {text}");
            }
        };
        // Every door to a dataset.
        assert_refused(DatasetReader::open(&Folder::at(&folder)).map(|_| ()).unwrap_err());
        assert_refused(Manifest::read(&Folder::at(&folder)).unwrap_err());
        assert_refused(verify(&Folder::at(&folder), CHECK_INSIDE, |_| {}).unwrap_err());
        assert_refused(read_mark(&Folder::at(&folder)).unwrap_err());
        let before = list_names(&folder);
        assert_refused(begin_run(&Folder::at(&folder), &small().mark()).unwrap_err());
        assert_eq!(list_names(&folder), before, "nothing is changed in it");
    }
}

/// One shard of version 1 under a name of version 4: the manifest does not give it away, its own header does.
#[test]
fn a_shard_of_version_1_among_others_is_refused_with_its_number() {
    let workspace = Workspace::new();
    small().finish(workspace.folder());
    let old = fs::read(&list_shards(golden("v1"))[0]).unwrap();
    let digest = Digest::hash(&old);
    let manifest = Manifest::read(&Folder::at(workspace.folder())).unwrap();
    let shard = &manifest.shards[0];
    let name = shard.file.replace(&shard.digest.short(), &digest.short());
    fs::remove_file(workspace.path(shard.path())).unwrap();
    workspace.write(Path::new("shards").join(&name), &old);
    let text = workspace.read("manifest.json").replace(&shard.file, &name);
    let text = text.replace(&shard.digest.hex(), &digest.hex());
    let text = text.replacen(&format!("\"bytes\": {}", shard.bytes), &format!("\"bytes\": {}", old.len()), 1);
    workspace.write("manifest.json", unseal(&text));
    let error = DatasetReader::open(&Folder::at(workspace.folder())).map(|_| ()).unwrap_err();
    assert!(matches!(error, DatasetError::Version { found: 1, expected: 4, .. }), "{error}");
    assert!(error.to_string().contains(&name), "{error}");
    let VerifyReport { problems, intact_shards, .. } =
        verify(&Folder::at(workspace.folder()), CHECK_INSIDE, |_| {}).unwrap();
    let named = problems.iter().filter(|problem| problem.file.ends_with(&name));
    assert!(named.into_iter().any(|problem| problem.what.contains("format version 1")), "{problems:?}");
    assert_eq!(intact_shards, 1);
}

#[test]
fn version_4_reads_back() {
    let (small, reader) = (small(), DatasetReader::open(&Folder::at(golden("v4"))).unwrap());
    let mut kept = 0;
    for index in 0..small.samples() {
        let (id, sample) = (small.id(index), reader.sample(SampleIndex(index)).unwrap());
        assert_eq!((reader.id(SampleIndex(index)), reader.find(&id)), (Some(id), Some(SampleIndex(index))));
        assert_eq!(sample.is_none(), small.is_rejected(index));
        let Some(sample) = sample else { continue };
        kept += 1;
        let pair = small.pair(index);
        assert_eq!((sample.index.0, sample.id), (index, id));
        assert_eq!(sample.channels().collect::<Vec<_>>(), small.channels);
        assert_eq!(sample.read::<VoxelPair>().unwrap(), pair);
        let visibility = sample.find::<Visibility>().unwrap().unwrap();
        assert_eq!((visibility.sample, visibility.free), (id, free_cells(&pair)));
        let touched = sample.touched().unwrap().unwrap();
        assert_eq!(touched.touch, TOUCH.map(|channel| (channel, make_touch(channel, &pair))));
    }
    assert_eq!(kept, small.samples() - 1);
    assert_intact(golden("v4"), CHECK_INSIDE);
}

#[test]
fn ledgers_of_version_4_read_back() {
    let (small, reader) = (small(), DatasetReader::open(&Folder::at(golden("v4"))).unwrap());
    let mut rows = Vec::new();
    for shard in 0..2 {
        let ledger = reader.ledger(shard).unwrap();
        assert_eq!((ledger.product, ledger.job), (Product::COMPLETION, job_digest()));
        assert_eq!((ledger.shard.0 as usize, ledger.shards, ledger.first.0), (shard, 2, 4 * shard as u64));
        assert_eq!(ledger.channels, small.channels);
        rows.extend(ledger.rows);
    }
    for (index, row) in (0..small.samples()).zip(&rows) {
        assert_eq!((row.index.0, row.sample), (index, small.id(index)));
        let Fate::Kept(digests) = &row.fate else {
            let fate = Fate::Rejected { reason: "few_cells".into(), detail: "99 cells, at least 100".into() };
            assert_eq!((index, &row.fate, row.facts.values()), (3, &fate, [0.0; 6].as_slice()));
            continue;
        };
        let (sample, pair) = (reader.sample(SampleIndex(index)).unwrap().unwrap(), small.pair(index));
        assert_eq!(row.facts, Facts::from(pair.facts()));
        for (channel, digest) in small.channels.iter().zip(digests) {
            assert_eq!(Digest::hash(sample.payload(*channel).unwrap()), *digest);
        }
    }
    assert_eq!(rows.len() as u64, small.samples());
}

#[test]
fn tables_of_version_4_read_back() {
    let (small, folder) = (small(), golden("v4"));
    let reader = DatasetReader::open(&Folder::at(&folder)).unwrap();
    let (manifest, header) = (reader.manifest(), small.header());
    assert_eq!(read_mark(&Folder::at(&folder)).unwrap(), Some(small.mark()));
    assert_eq!(scan_shards(&Folder::at(&folder), &small.mark()).unwrap().done.len(), 2);
    assert_eq!((manifest.format_version, manifest.product), (4, Product::COMPLETION));
    assert_eq!((&manifest.generator, manifest.job), (&header.generator, header.job));
    assert_eq!((&manifest.platform, &manifest.warnings), (&header.platform, &header.warnings));
    assert_eq!(manifest.channels(), small.channels);
    assert_eq!(manifest.classes.keys().collect::<Vec<_>>(), [&NumberClass::Exact, &NumberClass::Physics]);
    let topics = [&small.channels[..3], &small.channels[3..]].map(|channels| channels.iter().map(|each| each.topic));
    for (class, topics) in [NumberClass::Exact, NumberClass::Physics].into_iter().zip(topics) {
        assert_eq!(manifest.class_topics[&class], topics.collect::<Vec<_>>());
    }
    let counts = serde_json::to_value(&manifest.counts).unwrap();
    let expected = json!({
        "samples": 6, "kept": 5, "rejected": { "few_cells": 1 }, "objects": 2, "refused_meshes": 0,
        "splits": { "training": 2, "holdout": 1, "test": 2 }, "facts": {}
    });
    assert_eq!(counts, expected);
    let shards: Vec<_> = manifest.shards.iter().map(|shard| (shard.first_sample, shard.samples, shard.kept)).collect();
    assert_eq!(shards, [(0, 4, 3), (4, 2, 2)]);
    for (path, entry) in manifest.entries() {
        let bytes = fs::read(folder.join(&path)).unwrap();
        assert_eq!((entry.digest, entry.bytes), (Digest::hash(&bytes), bytes.len() as u64), "{path}");
    }
    assert_eq!(*reader.splits(), {
        let mut splits = header.splits.unwrap();
        splits.objects.sort_by_key(|row| row.object);
        splits
    });
    let held_out = (0..small.samples()).filter(|index| reader.split(SampleIndex(*index)) == Some(Split::Holdout));
    assert_eq!(held_out.collect::<Vec<_>>(), [2]);
    let assets = reader.assets().unwrap();
    let mut expected = header.assets;
    expected.sort_by_key(|row| row["object"].as_str().map(str::to_owned));
    assert_eq!(assets.objects.iter().map(|row| row.whole()).collect::<Vec<_>>(), expected);
    assert!(assets.hands.is_empty() && assets.refused.is_empty());
    assert_eq!(reader.job_text().unwrap(), header.job_text);
    let reject = json!({
        "sample_index": 3, "subject": small.id(3).subject, "item": 0, "instance": 0, "camera": 0,
        "reason": "few_cells", "detail": "99 cells, at least 100"
    });
    let line: serde_json::Value = serde_json::from_str(read_text(folder.join("rejects.jsonl")).trim()).unwrap();
    assert_eq!(line, reject);
}

/// If only this test fails, check the versions of zstd, mcap and parquet first: payload digests and the root
/// distinguish a change of packing from a change of data. A change of data needs a new FORMAT_VERSION or a CHANGELOG
/// entry with `Regenerate:`; then `GRASPMILL_WRITE_GOLDEN=1` writes the folder again.
#[test]
fn version_4_is_written_byte_for_byte() {
    let golden = golden("v4");
    if env::var_os("GRASPMILL_WRITE_GOLDEN").is_some() {
        let _ = fs::remove_dir_all(&golden);
        small().finish(&golden);
    }
    let folder = Workspace::new();
    let root = small().finish(folder.folder());
    assert_eq!(root, DatasetReader::open(&Folder::at(&golden)).unwrap().manifest().root, "the data has changed");
    for part in ["", "shards"] {
        let names = list_names(golden.join(part));
        assert_eq!(list_names(folder.path(part)), names);
        for name in names.iter().filter(|name| *name != "shards") {
            let read = |folder: &Path| fs::read(folder.join(part).join(name)).unwrap();
            assert_eq!(read(folder.folder()), read(&golden), "{name}: the packing has changed");
        }
    }
}
