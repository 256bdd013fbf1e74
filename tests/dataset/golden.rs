//! Shards of each past version stay readable, and the present version writes the same bytes.

use std::{
    fs,
    path::{Path, PathBuf},
};

use graspmill::{
    dataset::{DatasetReader, VerifyLevel, VerifyOptions, verify},
    ids::SampleIndex,
};

use crate::made::{Made, names, pair, unsealed};

fn made() -> Made {
    Made { objects: 2, views: 3, shard_samples: 4, resolution: 9, reject_every: 4, ..Made::default() }
}

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/v1")
}

#[test]
fn version_1_reads_back() {
    let reader = DatasetReader::open(&golden()).unwrap();
    for index in 0..made().samples() {
        let sample = reader.sample(SampleIndex(index)).unwrap();
        assert_eq!(sample.is_none(), made().rejected(index));
        if let Some(sample) = sample {
            assert_eq!(sample.pair().unwrap(), pair(made().id(index), index, 9));
        }
    }
    let options = VerifyOptions { level: VerifyLevel::Full, partial_inside_complete: true, threads: 1 };
    assert!(verify(&golden(), options, |_| {}).unwrap().is_intact());
}

/// When only this fails, look at the versions of zstd, mcap and parquet first: payload digests and the root tell a
/// change of packing from a change of data. A change of data needs a new FORMAT_VERSION or a CHANGELOG entry with
/// `Regenerate:`; then `GRASPMILL_WRITE_GOLDEN=1` writes the folder anew.
#[test]
fn version_1_is_written_byte_for_byte() {
    if std::env::var_os("GRASPMILL_WRITE_GOLDEN").is_some() {
        let _ = fs::remove_dir_all(golden());
        made().finish(&golden());
        let manifest = golden().join("manifest.json");
        fs::write(&manifest, unsealed(&fs::read_to_string(&manifest).unwrap())).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let root = made().finish(folder.path());
    assert_eq!(root, DatasetReader::open(&golden()).unwrap().manifest().root, "the data has changed");
    for place in ["", "shards"] {
        assert_eq!(names(&folder.path().join(place)), names(&golden().join(place)));
        for name in names(&golden().join(place)).iter().filter(|name| *name != "shards") {
            let read = |folder: &Path| fs::read(folder.join(place).join(name)).unwrap();
            let mut written = read(folder.path());
            // The golden manifest is of a time before seals.
            if name == "manifest.json" {
                written = unsealed(&String::from_utf8(written).unwrap()).into_bytes();
            }
            assert_eq!(written, read(&golden()), "{name}: the packing has changed");
        }
    }
}
