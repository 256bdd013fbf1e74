//! What damage looks like, and that it is named exactly.

use std::{fs, path::Path};

use graspmill::{
    dataset::{
        DatasetError, DatasetReader, ShardHeader, ShardWriter, VerifyLevel, VerifyOptions, VerifyReport, begin_run,
        clear_away, finish_dataset, scan_shards, verify,
    },
    geom::OccupancyGrid,
    ids::{SampleIndex, ShardId},
    record::{Channel, PairFacts, VoxelPair},
};

use crate::made::{Made, pair};

const FULL: VerifyOptions = VerifyOptions { level: VerifyLevel::Full, partial_inside_complete: true, threads: 2 };
const HASHES: VerifyOptions = VerifyOptions { level: VerifyLevel::Hashes, ..FULL };

fn report(folder: &Path, options: VerifyOptions) -> VerifyReport {
    verify(folder, options, |_| {}).unwrap()
}

fn lines(report: &VerifyReport) -> String {
    report.problems.iter().map(|problem| format!("{problem}\n")).collect()
}

#[test]
fn an_intact_dataset_is_intact_at_every_level_and_thread_count() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    let root = made.finish(folder.path());
    for options in [FULL, HASHES, VerifyOptions { threads: 1, ..FULL }] {
        let mut steps = 0;
        let report = verify(folder.path(), options, |_| steps += 1).unwrap();
        assert!(report.is_intact(), "{}", lines(&report));
        assert_eq!((report.saved, report.calculated), (root, Some(root)));
        assert_eq!((report.intact_shards, report.checked.samples, steps), (5, made.samples(), 5));
        assert_eq!(report.payloads, if options.level == VerifyLevel::Full { 2 * 29 } else { 0 });
    }
}

#[test]
fn a_flipped_byte_anywhere_names_its_shard_and_no_other() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    made.finish(folder.path());
    let shard = DatasetReader::open(folder.path()).unwrap().manifest().shard_path(folder.path(), 2);
    let whole = fs::read(&shard).unwrap();
    let mut named_chunks = 0;
    for place in (0..whole.len()).step_by(41) {
        let mut bytes = whole.clone();
        bytes[place] ^= 0x10;
        fs::write(&shard, &bytes).unwrap();
        for options in [FULL, HASHES] {
            let report = report(folder.path(), options);
            assert!(!report.problems.is_empty(), "byte {place} passed");
            assert!(report.problems.iter().all(|problem| problem.shard == Some(ShardId(2))), "{}", lines(&report));
            assert_eq!(report.intact_shards, 4);
            named_chunks += usize::from(lines(&report).contains("chunk"));
        }
        let reader = DatasetReader::open(folder.path()).unwrap();
        assert!(reader.sample(SampleIndex(0)).unwrap().is_some(), "the other shards read on");
    }
    assert!(named_chunks > 10, "{named_chunks} flips were traced to a chunk");
}

#[test]
fn a_truncated_a_missing_and_a_foreign_file_are_told_apart() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    made.finish(folder.path());
    let reader = DatasetReader::open(folder.path()).unwrap();
    let path = |shard| reader.manifest().shard_path(folder.path(), shard);
    let whole = fs::read(path(1)).unwrap();
    fs::write(path(1), &whole[..whole.len() * 6 / 10]).unwrap();
    fs::remove_file(path(3)).unwrap();
    fs::write(folder.path().join("shards/completion-00000-of-00005-0123456789abcdef.mcap"), "?").unwrap();
    let report = report(folder.path(), FULL);
    let lines = lines(&report);
    assert!(lines.contains("may be cut short"), "{lines}");
    assert!(lines.contains("the file is missing"), "{lines}");
    assert!(lines.contains("does not know this file"), "{lines}");
    assert_eq!(report.intact_shards, 3);
    assert_eq!(report.calculated, None);
    let error = DatasetReader::open(folder.path()).unwrap().sample(SampleIndex(9)).unwrap_err().to_string();
    assert!(error.contains("completion-00001-of-00005") && error.contains("bytes"), "{error}");
    // The remedy: set aside, make only what is missing, close again.
    clear_away(&scan_shards(folder.path(), &made.mark()).unwrap()).unwrap();
    for shard in [1, 3] {
        made.write_shard(folder.path(), shard);
    }
    finish_dataset(folder.path(), &made.header()).unwrap();
    let mended = verify(folder.path(), FULL, |_| {}).unwrap();
    assert!(mended.is_intact(), "{:?}", mended.problems);
    assert_eq!(mended.notes.len(), 2, "{:?}", mended.notes);
}

#[test]
fn changed_tables_are_named() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    made.finish(folder.path());
    for (name, from, to) in [("assets.json", "thing 1", "thing 9"), ("splits.json", "5", "6"), ("job.toml", "1", "2")] {
        let path = folder.path().join(name);
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let report = report(folder.path(), HASHES);
        assert!(report.problems[0].file == name, "{}", lines(&report));
        fs::write(&path, text).unwrap();
    }
    let path = folder.path().join("manifest.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("\"format_version\": 1", "\"format_version\": 2", 1)).unwrap();
    let error = verify(folder.path(), HASHES, |_| {}).unwrap_err();
    assert!(matches!(error, DatasetError::Version { found: 2, expected: 1, .. }), "{error}");
    fs::write(&path, text.replacen("\"kept\": 29", "\"kept\": 28", 1)).unwrap();
    assert!(matches!(verify(folder.path(), HASHES, |_| {}).unwrap_err(), DatasetError::Invalid { .. }));
    fs::write(&path, text.replacen("\"root\": \"", "\"root\": \"00", 1).replacen("00\",", "\",", 1)).unwrap();
    assert!(verify(folder.path(), HASHES, |_| {}).is_err(), "a digest of 66 digits is none");
    fs::remove_file(&path).unwrap();
    let error = DatasetReader::open(folder.path()).map(|_| ()).unwrap_err();
    assert!(matches!(error, DatasetError::Unfinished { .. }), "{error}");
}

/// A shard whose bytes and digests are all right, but whose content is not.
fn write_lie(made: &Made, folder: &Path, change: impl Fn(&mut VoxelPair)) {
    begin_run(folder, &made.mark()).unwrap();
    let mut writer = ShardWriter::create(&folder.join("shards"), &made.shard_header(0)).unwrap();
    for index in 0..made.samples() {
        let mut pair = pair(made.id(index), index, made.resolution);
        if index == 4 {
            change(&mut pair);
        }
        let mut payload = Vec::new();
        pair.encode(&mut payload);
        writer.write(SampleIndex(index), &made.id(index), Channel::Pair, &payload).unwrap();
        writer.keep(SampleIndex(index), &made.id(index), pair.facts()).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn a_well_formed_lie_is_found_in_its_sample() {
    let made = Made { objects: 1, shard_samples: 11, channels: vec![Channel::Pair], ..Made::default() };
    type Lie = (&'static str, fn(&mut VoxelPair));
    let lies: [Lie; 6] = [
        ("partial_cells says", |pair| pair.partial_cells += 1),
        ("partial cells are not in complete", |pair| {
            pair.complete = OccupancyGrid::new(pair.grid.resolution);
            pair.complete_cells = 0;
            pair.both_cells = 0;
        }),
        ("cell_size = -1", |pair| pair.grid.cell_size = -1.0),
        ("centre_y = NaN", |pair| pair.grid.centre.y = f64::NAN),
        ("do not close", |pair| {
            pair.world_from_camera = pair.world_from_camera
                * graspmill::geom::Pose::new(nalgebra::Rotation3::identity(), nalgebra::Vector3::new(0.0, 0.0, 1e-6));
        }),
        ("it is of sample", |pair| pair.sample.view.0 = 10),
    ];
    for (expected, change) in lies {
        let folder = tempfile::tempdir().unwrap();
        write_lie(&made, folder.path(), change);
        finish_dataset(folder.path(), &made.header()).unwrap();
        let report = report(folder.path(), FULL);
        let lines = lines(&report);
        assert!(lines.contains(expected) && lines.contains("sample 4"), "{expected}: {lines}");
        assert_eq!(report.problems.len(), 1, "{lines}");
    }
}

#[test]
fn a_sample_that_stands_twice_is_refused() {
    // Two shards of the same object: every view twice.
    let made = Made { objects: 1, shard_samples: 11, channels: vec![Channel::Pair], ..Made::default() };
    let twice = Made { objects: 2, ..made.clone() };
    let folder = tempfile::tempdir().unwrap();
    begin_run(folder.path(), &twice.mark()).unwrap();
    for shard in 0..2 {
        let header = twice.shard_header(shard);
        let mut writer = ShardWriter::create(&folder.path().join("shards"), &header).unwrap();
        for index in header.samples {
            writer.reject(SampleIndex(index), &made.id(index % 11), PairFacts::default(), "few_cells", "").unwrap();
        }
        writer.finish().unwrap();
    }
    let error = finish_dataset(folder.path(), &twice.header()).unwrap_err();
    assert!(
        matches!(error, DatasetError::DuplicateSample { first: SampleIndex(0), second: SampleIndex(11), .. }),
        "{error}"
    );
}

#[test]
fn a_shard_of_another_job_with_a_fitting_name_is_refused() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    let mut shards = made.write(folder.path());
    let job = graspmill::ids::JobDigest(graspmill::ids::Digest::of(b"another"));
    let header = ShardHeader { job, ..made.shard_header(4) };
    fs::remove_file(shards.pop().unwrap().path).unwrap();
    let mut writer = ShardWriter::create(&folder.path().join("shards"), &header).unwrap();
    writer.reject(SampleIndex(32), &made.id(32), PairFacts::default(), "few_cells", "").unwrap();
    writer.finish().unwrap();
    let error = finish_dataset(folder.path(), &made.header()).unwrap_err().to_string();
    assert!(error.contains("completion-00004-of-00005") && error.contains("belongs to job"), "{error}");
}

/// Half of the next test, which runs it in a process that may write files of 8 KiB at most.
#[test]
fn write_under_a_limit() {
    let Ok(folder) = std::env::var("GRASPMILL_TEST_FOLDER") else { return };
    let channels = vec![Channel::Pair];
    let made = Made { shard_samples: 33, resolution: 64, reject_every: 1000, channels, ..Made::default() };
    let write = || -> Result<(), DatasetError> {
        let mut writer = ShardWriter::create(Path::new(&folder), &made.shard_header(0))?;
        let mut payload = Vec::new();
        for index in 0..made.samples() {
            let pair = pair(made.id(index), index, made.resolution);
            payload.clear();
            pair.encode(&mut payload);
            writer.write(SampleIndex(index), &made.id(index), Channel::Pair, &payload)?;
            writer.keep(SampleIndex(index), &made.id(index), pair.facts())?;
        }
        writer.finish().map(|_| ())
    };
    let error = write().unwrap_err();
    assert!(error.is_io() && error.to_string().contains("completion-00000-of-00001"), "{error}");
    assert_eq!(crate::made::names(Path::new(&folder)), [""; 0], "a writer that fails leaves nothing behind");
}

#[test]
fn a_disk_that_takes_no_more_is_an_io_error_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let program = std::env::current_exe().unwrap();
    let limited = "trap '' XFSZ; ulimit -f 8; exec \"$0\" --exact damage::write_under_a_limit";
    let output = std::process::Command::new("bash")
        .args(["-c", limited])
        .arg(program)
        .env("GRASPMILL_TEST_FOLDER", folder.path())
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && text.contains("1 passed"), "{text}");
}

#[test]
fn a_folder_that_is_not_there_is_an_io_error_with_its_path() {
    let made = Made::default();
    let file = tempfile::NamedTempFile::new().unwrap();
    let error = begin_run(&file.path().join("dataset"), &made.mark()).unwrap_err();
    assert!(error.is_io() && error.to_string().contains("dataset"), "{error}");
}
