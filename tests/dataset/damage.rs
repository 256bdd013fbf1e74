//! Damage, and that it is named exactly.

use std::{env, fs, path::Path};

use graspmill::{
    files::Folder,
    format::{
        Channel, PairFacts, VoxelPair,
        dataset::{
            DatasetError, DatasetReader, ShardHeader, ShardWriter, VerifyLevel, VerifyOptions, VerifyReport, begin_run,
            clear_away, finish_dataset, scan_shards, verify,
        },
    },
    geom::{OccupancyGrid, Pose},
    ids::{Digest, JobDigest, SampleIndex, ShardId},
    tables::ParquetIndex,
};
use nalgebra::{Rotation3, Vector3};

use crate::support::{
    files::{CHECK_INSIDE, list_names, read_text},
    program::Program,
    small_dataset::SmallDataset,
    workspace::Workspace,
};

const HASHES: VerifyOptions = VerifyOptions { level: VerifyLevel::Hashes, ..CHECK_INSIDE };

fn report(folder: &Path, options: VerifyOptions) -> VerifyReport {
    verify(&Folder::at(folder), options, |_| {}).unwrap()
}

fn lines(report: &VerifyReport) -> String {
    report.problems.iter().map(|problem| format!("{problem}\n")).collect()
}

#[test]
fn an_intact_dataset_is_intact_at_every_level_and_thread_count() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    let root = small.finish(folder.folder());
    for options in [CHECK_INSIDE, HASHES, VerifyOptions { threads: 1, ..CHECK_INSIDE }] {
        let mut steps = 0;
        let report = verify(&Folder::at(folder.folder()), options, |_| steps += 1).unwrap();
        assert!(report.is_intact(), "{}", lines(&report));
        assert_eq!((report.saved, report.calculated), (root, Some(root)));
        assert_eq!((report.intact_shards, report.checked.samples, steps), (5, small.samples(), 5));
        assert_eq!(report.payloads, if options.level == VerifyLevel::Full { 2 * 29 } else { 0 });
    }
}

#[test]
fn a_flipped_byte_anywhere_names_its_shard_and_no_other() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    small.finish(folder.folder());
    let shard = DatasetReader::open(&Folder::at(folder.folder())).unwrap().manifest().shard_path(folder.folder(), 2);
    let whole = fs::read(&shard).unwrap();
    let (mut named_chunks, mut opened) = (0, 0);
    for index in (0..whole.len()).step_by(41) {
        let mut bytes = whole.clone();
        bytes[index] ^= 0x10;
        fs::write(&shard, &bytes).unwrap();
        for options in [CHECK_INSIDE, HASHES] {
            let report = report(folder.folder(), options);
            assert!(!report.problems.is_empty(), "byte {index} passed");
            assert!(report.problems.iter().all(|problem| problem.shard == Some(ShardId(2))), "{}", lines(&report));
            assert_eq!(report.intact_shards, 4);
            named_chunks += usize::from(lines(&report).contains("chunk"));
        }
        // Only ledgers contain the identities of samples: a shard with a damaged ledger is named, and the others are
        // read past every other damage.
        match DatasetReader::open(&Folder::at(folder.folder())) {
            Ok(reader) => {
                assert!(reader.sample(SampleIndex(0)).unwrap().is_some(), "the other shards read on");
                opened += 1;
            }
            Err(error) => {
                let name = shard.file_name().unwrap().to_string_lossy();
                assert!(error.to_string().contains(&*name), "byte {index}: {error}");
            }
        }
    }
    assert!(named_chunks > 10, "{named_chunks} flips were traced to a chunk");
    assert!(opened > named_chunks / 2, "{opened} of {named_chunks} / 2 datasets with a damaged chunk could be opened");
}

#[test]
fn a_truncated_a_missing_and_a_foreign_file_are_told_apart() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    small.finish(folder.folder());
    let reader = DatasetReader::open(&Folder::at(folder.folder())).unwrap();
    let path = |shard| reader.manifest().shard_path(folder.folder(), shard);
    let whole = fs::read(path(1)).unwrap();
    fs::write(path(1), &whole[..whole.len() * 6 / 10]).unwrap();
    fs::remove_file(path(3)).unwrap();
    fs::write(folder.path("shards/completion-00000-of-00005-0123456789abcdef.mcap"), "?").unwrap();
    let report = report(folder.folder(), CHECK_INSIDE);
    let lines = lines(&report);
    assert!(lines.contains("may be cut short"), "{lines}");
    assert!(lines.contains("the file is missing"), "{lines}");
    assert!(lines.contains("this file is not in the manifest"), "{lines}");
    assert_eq!(report.intact_shards, 3);
    assert_eq!(report.calculated, None);
    let error = DatasetReader::open(&Folder::at(folder.folder())).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("completion-00001-of-00005") && error.contains("bytes"), "{error}");
    // The remedy: set aside, make only what is missing, close again.
    let dataset = Folder::at(folder.folder());
    clear_away(&dataset, &scan_shards(&dataset, &small.mark()).unwrap()).unwrap();
    for shard in [1, 3] {
        small.write_shard(folder.folder(), shard);
    }
    finish_dataset(&Folder::at(folder.folder()), &small.header(), &ParquetIndex).unwrap();
    let mended = verify(&Folder::at(folder.folder()), CHECK_INSIDE, |_| {}).unwrap();
    assert!(mended.is_intact(), "{:?}", mended.problems);
    assert_eq!(mended.notes.len(), 2, "{:?}", mended.notes);
}

#[test]
fn changed_tables_are_named() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    small.finish(folder.folder());
    for (name, from, to) in [("assets.json", "thing 1", "thing 9"), ("splits.json", "5", "6"), ("job.toml", "1", "2")] {
        let path = folder.path(name);
        let text = read_text(&path);
        fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let report = report(folder.folder(), HASHES);
        assert!(report.problems[0].file == name, "{}", lines(&report));
        fs::write(&path, text).unwrap();
    }
    let path = folder.path("manifest.json");
    let text = read_text(&path);
    fs::write(&path, text.replacen("\"format_version\": 4", "\"format_version\": 5", 1)).unwrap();
    let error = verify(&Folder::at(folder.folder()), HASHES, |_| {}).unwrap_err();
    assert!(matches!(error, DatasetError::Version { found: 5, expected: 4, .. }), "{error}");
    fs::write(&path, text.replacen("\"kept\": 29", "\"kept\": 28", 1)).unwrap();
    assert!(matches!(verify(&Folder::at(folder.folder()), HASHES, |_| {}).unwrap_err(), DatasetError::Invalid { .. }));
    fs::write(&path, text.replacen("\"root\": \"", "\"root\": \"00", 1).replacen("00\",", "\",", 1)).unwrap();
    assert!(verify(&Folder::at(folder.folder()), HASHES, |_| {}).is_err(), "66 digits are not a digest");
    fs::remove_file(&path).unwrap();
    let error = DatasetReader::open(&Folder::at(folder.folder())).map(|_| ()).unwrap_err();
    assert!(matches!(error, DatasetError::Unfinished { .. }), "{error}");
}

/// A shard whose bytes and digests are all right, but whose content is not.
fn write_lie(small: &SmallDataset, folder: &Path, change: impl Fn(&mut VoxelPair)) {
    begin_run(&Folder::at(folder), &small.mark()).unwrap();
    let mut writer = ShardWriter::create(&Folder::at(folder.join("shards")), &small.shard_header(0)).unwrap();
    for index in 0..small.samples() {
        let mut pair = small.pair(index);
        if index == 4 {
            change(&mut pair);
        }
        let mut payload = Vec::new();
        pair.encode(&mut payload);
        writer.write(SampleIndex(index), &small.id(index), Channel::PAIR, &payload).unwrap();
        writer.keep(SampleIndex(index), &small.id(index), pair.facts()).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn a_well_formed_lie_is_found_in_its_sample() {
    let small =
        SmallDataset { objects: 1, shard_samples: 11, channels: vec![Channel::PAIR], ..SmallDataset::default() };
    type Lie = (&'static str, fn(&mut VoxelPair));
    let lies: [Lie; 6] = [
        ("partial_cells states", |pair| pair.partial_cells += 1),
        ("partial cells are not in complete", |pair| {
            pair.complete = OccupancyGrid::new(pair.grid.resolution);
            pair.complete_cells = 0;
            pair.both_cells = 0;
        }),
        ("cell_size = -1", |pair| pair.grid.cell_size = -1.0),
        ("centre_y = NaN", |pair| pair.grid.centre.y = f64::NAN),
        ("poses are inconsistent", |pair| {
            pair.world_from_camera =
                pair.world_from_camera * Pose::new(Rotation3::identity(), Vector3::new(0.0, 0.0, 1e-6));
        }),
        ("it is of sample", |pair| pair.sample.item.0 = 10),
    ];
    for (expected, change) in lies {
        let folder = Workspace::new();
        write_lie(&small, folder.folder(), change);
        finish_dataset(&Folder::at(folder.folder()), &small.header(), &ParquetIndex).unwrap();
        let report = report(folder.folder(), CHECK_INSIDE);
        let lines = lines(&report);
        assert!(lines.contains(expected) && lines.contains("sample 4"), "{expected}: {lines}");
        assert_eq!(report.problems.len(), 1, "{lines}");
    }
}

#[test]
fn a_sample_that_stands_twice_is_refused() {
    // Two shards of the same object: every view twice.
    let small =
        SmallDataset { objects: 1, shard_samples: 11, channels: vec![Channel::PAIR], ..SmallDataset::default() };
    let twice = SmallDataset { objects: 2, ..small.clone() };
    let folder = Workspace::new();
    begin_run(&Folder::at(folder.folder()), &twice.mark()).unwrap();
    for shard in 0..2 {
        let header = twice.shard_header(shard);
        let mut writer = ShardWriter::create(&Folder::at(folder.path("shards")), &header).unwrap();
        for index in header.samples {
            writer.reject(SampleIndex(index), &small.id(index % 11), PairFacts::default(), "few_cells", "").unwrap();
        }
        writer.finish().unwrap();
    }
    let error = finish_dataset(&Folder::at(folder.folder()), &twice.header(), &ParquetIndex).unwrap_err();
    assert!(
        matches!(error, DatasetError::DuplicateSample { first: SampleIndex(0), second: SampleIndex(11), .. }),
        "{error}"
    );
}

#[test]
fn a_shard_of_another_job_with_a_fitting_name_is_refused() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    let mut shards = small.write(folder.folder());
    let job = JobDigest(Digest::hash(b"another"));
    let header = ShardHeader { job, ..small.shard_header(4) };
    fs::remove_file(shards.pop().unwrap().path).unwrap();
    let mut writer = ShardWriter::create(&Folder::at(folder.path("shards")), &header).unwrap();
    writer.reject(SampleIndex(32), &small.id(32), PairFacts::default(), "few_cells", "").unwrap();
    writer.finish().unwrap();
    let error = finish_dataset(&Folder::at(folder.folder()), &small.header(), &ParquetIndex).unwrap_err().to_string();
    assert!(error.contains("completion-00004-of-00005") && error.contains("belongs to job"), "{error}");
}

/// One half of the next test, which runs it in a process that may write files of 8 KiB at most.
#[test]
fn write_under_a_limit() {
    let Ok(folder) = env::var("GRASPMILL_TEST_FOLDER") else { return };
    let channels = vec![Channel::PAIR];
    let small =
        SmallDataset { shard_samples: 33, resolution: 64, reject_every: 1000, channels, ..SmallDataset::default() };
    let write = || -> Result<(), DatasetError> {
        let mut writer = ShardWriter::create(&Folder::at(Path::new(&folder)), &small.shard_header(0))?;
        let mut payload = Vec::new();
        for index in 0..small.samples() {
            let pair = small.pair(index);
            payload.clear();
            pair.encode(&mut payload);
            writer.write(SampleIndex(index), &small.id(index), Channel::PAIR, &payload)?;
            writer.keep(SampleIndex(index), &small.id(index), pair.facts())?;
        }
        writer.finish().map(|_| ())
    };
    let error = write().unwrap_err();
    assert!(error.is_io() && error.to_string().contains("completion-00000-of-00001"), "{error}");
    assert_eq!(list_names(&folder), [""; 0], "a writer that fails leaves nothing behind");
}

#[test]
fn a_disk_that_takes_no_more_is_an_io_error_and_leaves_nothing() {
    let folder = Workspace::new();
    let limited = "trap '' XFSZ; ulimit -f 8; exec \"$0\" --exact dataset::damage::write_under_a_limit";
    let bash = Program::of_system("bash").option("-c", limited).arg(env::current_exe().unwrap());
    let text = bash.env("GRASPMILL_TEST_FOLDER", folder.folder()).succeed().stdout;
    assert!(text.contains("1 passed"), "{text}");
}

#[test]
fn a_folder_that_is_not_there_is_an_io_error_with_its_path() {
    let small = SmallDataset::default();
    let file = tempfile::NamedTempFile::new().unwrap();
    let error = begin_run(&Folder::at(file.path().join("dataset")), &small.mark()).unwrap_err();
    assert!(error.is_io() && error.to_string().contains("dataset"), "{error}");
}
