//! Write, close, read back.

use std::fs;

use graspmill::{
    files::Folder,
    format::{
        Depth, PairFacts, Visibility, VoxelPair,
        dataset::{
            Begun, DatasetError, DatasetReader, Fate, RunMark, Selection, ShardWriter, begin_run, clear_away,
            finish_dataset, scan_shards,
        },
    },
    ids::{Digest, ItemId, JobDigest, SampleId, SampleIndex},
    tables::ParquetIndex,
    words::Split,
};

use crate::support::{
    files::list_names,
    small_dataset::{SmallDataset, free_cells, job_digest},
    workspace::Workspace,
};

#[test]
fn every_sample_reads_back_by_id_and_by_index() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    small.finish(folder.folder());
    let reader = DatasetReader::open(&Folder::at(folder.folder())).unwrap();
    for index in 0..small.samples() {
        let (sample, id) = (SampleIndex(index), small.id(index));
        assert_eq!(reader.find(&id), Some(sample));
        assert_eq!(reader.id(sample), Some(id));
        let sample = reader.sample(sample).unwrap();
        if small.is_rejected(index) {
            assert!(sample.is_none());
            continue;
        }
        let sample = sample.unwrap();
        let expected = small.pair(index);
        assert_eq!(sample.read::<VoxelPair>().unwrap(), expected);
        assert_eq!(sample.find::<Visibility>().unwrap().unwrap().free, free_cells(&expected));
        assert!(sample.find::<Depth>().unwrap().is_none());
    }
    assert_eq!(reader.find(&SampleId::of_object(small.object(0), ItemId(small.views))), None);
    assert!(reader.sample(SampleIndex(small.samples())).unwrap().is_none());
    let counts = &reader.manifest().counts;
    assert_eq!((counts.samples, counts.kept, counts.rejected["few_cells"]), (33, 29, 4));
}

#[test]
fn the_order_of_shards_and_another_folder_change_no_byte() {
    let small = SmallDataset::default();
    let (one, two) = (Workspace::new(), Workspace::new());
    let root = small.finish(one.folder());
    begin_run(&Folder::at(two.folder()), &small.mark()).unwrap();
    for shard in (0..small.mark().shards).rev() {
        small.write_shard(two.folder(), shard);
    }
    assert_eq!(finish_dataset(&Folder::at(two.folder()), &small.header(), &ParquetIndex).unwrap().root, root);
    assert_eq!(list_names(one.folder()), list_names(two.folder()));
    assert_eq!(list_names(one.path("shards")), list_names(two.path("shards")));
    for name in ["manifest.json", "index.parquet", "assets.json", "splits.json", "rejects.jsonl", "run.json"] {
        assert_eq!(fs::read(one.path(name)).unwrap(), fs::read(two.path(name)).unwrap(), "{name}");
    }
}

#[test]
fn the_root_does_not_know_how_shards_were_cut() {
    let folders = [Workspace::new(), Workspace::new()];
    let roots = [8, 33]
        .map(|shard_samples| SmallDataset { shard_samples, ..SmallDataset::default() })
        .into_iter()
        .zip(&folders);
    let roots: Vec<_> = roots.map(|(small, folder)| small.finish(folder.folder())).collect();
    assert_eq!(roots[0], roots[1]);
    let fewer = Workspace::new();
    assert_ne!(SmallDataset { objects: 2, ..SmallDataset::default() }.finish(fewer.folder()), roots[0]);
}

#[test]
fn splits_select_and_shuffling_only_reorders() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    small.finish(folder.folder());
    let reader = DatasetReader::open(&Folder::at(folder.folder())).unwrap();
    let mut seen = 0;
    for split in Split::ALL {
        let indices: Vec<_> = reader.indices(Selection::from_split(split)).collect();
        let read: Vec<_> = reader.iter(Selection::from_split(split)).map(|sample| sample.unwrap().index).collect();
        assert_eq!(read, indices);
        assert!(indices.iter().all(|index| reader.split(*index) == Some(split)));
        assert_eq!(reader.manifest().counts.splits.get(&split).copied().unwrap_or(0), indices.len() as u64);
        let mut shuffled: Vec<_> =
            reader.shuffled(Selection::from_split(split), 7).map(|sample| sample.unwrap().index).collect();
        let again: Vec<_> =
            reader.shuffled(Selection::from_split(split), 7).map(|sample| sample.unwrap().index).collect();
        assert_eq!(shuffled, again);
        shuffled.sort();
        assert_eq!(shuffled, indices);
        seen += indices.len();
    }
    assert_eq!(seen as u64, reader.manifest().counts.kept);
    let subset: Vec<_> = reader.indices(Selection::training_subset(0)).collect();
    assert!(!subset.is_empty() && subset.iter().all(|index| reader.id(*index).unwrap().subject == small.object(0)));
    let order: Vec<_> = reader.shuffled(Selection::default(), 1).map(|sample| sample.unwrap().index).collect();
    assert_ne!(order, reader.indices(Selection::default()).collect::<Vec<_>>());
}

#[test]
fn another_job_and_other_shards_are_refused_with_both_numbers() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    assert_eq!(begin_run(&Folder::at(folder.folder()), &small.mark()).unwrap(), Begun::New);
    assert_eq!(begin_run(&Folder::at(folder.folder()), &small.mark()).unwrap(), Begun::Again);
    let other = JobDigest(Digest::hash(b"other"));
    let error = begin_run(&Folder::at(folder.folder()), &RunMark { job: other, ..small.mark() }).unwrap_err();
    assert!(
        matches!(error, DatasetError::ForeignJob { found, expected, .. } if found == job_digest() && expected == other)
    );
    let error = begin_run(&Folder::at(folder.folder()), &RunMark { shards: 9, ..small.mark() }).unwrap_err();
    assert!(matches!(error, DatasetError::OtherShards { .. }), "{error}");
    let strange = Workspace::new();
    strange.write("thesis.tex", "");
    let error = begin_run(&Folder::at(strange.folder()), &small.mark()).unwrap_err();
    assert!(error.to_string().contains("thesis.tex"), "{error}");
    small.finish(folder.folder());
    assert_eq!(begin_run(&Folder::at(folder.folder()), &small.mark()).unwrap(), Begun::Finished);
}

#[test]
fn a_scan_knows_done_bad_and_leftover_files() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    let shards = small.write(folder.folder());
    let mut bytes = fs::read(&shards[1].path).unwrap();
    bytes[100] ^= 1;
    fs::write(&shards[1].path, &bytes).unwrap();
    fs::write(&shards[3].path, &fs::read(&shards[3].path).unwrap()[..500]).unwrap();
    folder.write("shards/notes.txt", "");
    folder.write("shards/.completion-00004-of-00005.1-2-3.tmp", "");
    let scan = scan_shards(&Folder::at(folder.folder()), &small.mark()).unwrap();
    let done: Vec<_> = scan.done.keys().map(|shard| shard.0).collect();
    assert_eq!(done, [0, 2, 4]);
    let bad: Vec<_> = scan.bad.iter().map(|bad| bad.shard.0).collect();
    assert_eq!(bad, [1, 3]);
    assert_eq!(scan.strange, ["notes.txt"]);
    assert_eq!(scan.leftovers, ["shards/.completion-00004-of-00005.1-2-3.tmp"]);
    let error = finish_dataset(&Folder::at(folder.folder()), &small.header(), &ParquetIndex).unwrap_err();
    assert!(matches!(&error, DatasetError::MissingShards { missing, .. } if *missing == [1, 3]), "{error}");
    let dataset = Folder::at(folder.folder());
    let aside = clear_away(&dataset, &scan).unwrap();
    assert_eq!(aside, [&shards[1], &shards[3]].map(|shard| format!("{}.bad", shard.file_name())));
    // Another run may have cleared away the same files.
    assert_eq!(clear_away(&dataset, &scan).unwrap(), [""; 0]);
    let again = scan_shards(&dataset, &small.mark()).unwrap();
    assert!(again.bad.is_empty() && again.leftovers.is_empty() && again.done == scan.done);
    assert_eq!(folder.read("shards/notes.txt"), "", "what is not of a run stays under its name");
    small.write_shard(folder.folder(), 1);
    small.write_shard(folder.folder(), 3);
    let whole = Workspace::new();
    assert_eq!(
        finish_dataset(&Folder::at(folder.folder()), &small.header(), &ParquetIndex).unwrap().root,
        small.finish(whole.folder())
    );
}

#[test]
fn a_writer_that_is_given_up_leaves_nothing_and_one_at_work_is_no_leftover() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    begin_run(&Folder::at(folder.folder()), &small.mark()).unwrap();
    let shards = folder.path("shards");
    let mut writer = ShardWriter::create(&Folder::at(&shards), &small.shard_header(0)).unwrap();
    assert!(scan_shards(&Folder::at(folder.folder()), &small.mark()).unwrap().leftovers.is_empty());
    let error = writer.keep(SampleIndex(0), &small.id(0), PairFacts::default()).unwrap_err();
    assert!(matches!(error, DatasetError::Sequence { .. }), "{error}");
    assert!(writer.reject(SampleIndex(1), &small.id(1), PairFacts::default(), "few_cells", "").is_err());
    assert!(writer.finish().is_err());
    assert_eq!(list_names(&shards), [""; 0]);
}

#[test]
fn ledgers_say_what_became_of_every_sample() {
    let (small, folder) = (SmallDataset::default(), Workspace::new());
    small.finish(folder.folder());
    let reader = DatasetReader::open(&Folder::at(folder.folder())).unwrap();
    let mut rows = Vec::new();
    for shard in 0..reader.manifest().shards.len() {
        rows.extend(reader.ledger(shard).unwrap().rows);
    }
    assert_eq!(rows.len() as u64, small.samples());
    for (index, row) in (0..).zip(rows) {
        assert_eq!((row.index.0, row.sample), (index, small.id(index)));
        match row.fate {
            Fate::Rejected { reason, .. } => assert!(small.is_rejected(index) && reason == "few_cells"),
            Fate::Kept(digests) => {
                let pair = small.pair(index);
                let mut payload = Vec::new();
                pair.encode(&mut payload);
                assert_eq!(digests[0], Digest::hash(&payload));
                assert_eq!(row.facts, pair.facts().into());
            }
        }
    }
}
