//! Write, close, read back.

use std::fs;

use graspmill::{
    dataset::{
        Begun, DatasetError, DatasetReader, Fate, RunMark, Selection, ShardWriter, Split, begin_run, clear_away,
        finish_dataset, scan_shards,
    },
    ids::{Digest, JobDigest, SampleId, SampleIndex, ViewId},
    record::PairFacts,
};

use crate::made::{Made, free, job, names, pair};

#[test]
fn every_sample_reads_back_by_id_and_by_index() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    made.finish(folder.path());
    let reader = DatasetReader::open(folder.path()).unwrap();
    for index in 0..made.samples() {
        let (place, id) = (SampleIndex(index), made.id(index));
        assert_eq!(reader.find(&id), Some(place));
        assert_eq!(reader.id(place), Some(id));
        let sample = reader.sample(place).unwrap();
        if made.rejected(index) {
            assert!(sample.is_none());
            continue;
        }
        let sample = sample.unwrap();
        let expected = pair(id, index, made.resolution);
        assert_eq!(sample.pair().unwrap(), expected);
        assert_eq!(sample.visibility().unwrap().unwrap().free, free(&expected));
        assert!(sample.depth().unwrap().is_none());
    }
    assert_eq!(reader.find(&SampleId::of_object(made.object(0), ViewId(made.views))), None);
    assert!(reader.sample(SampleIndex(made.samples())).unwrap().is_none());
    let counts = &reader.manifest().counts;
    assert_eq!((counts.samples, counts.kept, counts.rejected["few_cells"]), (33, 29, 4));
}

#[test]
fn the_order_of_shards_and_another_folder_change_no_byte() {
    let made = Made::default();
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let root = made.finish(one.path());
    begin_run(two.path(), &made.mark()).unwrap();
    for shard in (0..made.mark().shards).rev() {
        made.write_shard(two.path(), shard);
    }
    assert_eq!(finish_dataset(two.path(), &made.header()).unwrap().root, root);
    assert_eq!(names(one.path()), names(two.path()));
    assert_eq!(names(&one.path().join("shards")), names(&two.path().join("shards")));
    for name in ["manifest.json", "index.parquet", "assets.json", "splits.json", "rejects.jsonl", "run.json"] {
        assert_eq!(fs::read(one.path().join(name)).unwrap(), fs::read(two.path().join(name)).unwrap(), "{name}");
    }
}

#[test]
fn the_root_does_not_know_how_shards_were_cut() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let roots = [8, 33].map(|shard_samples| Made { shard_samples, ..Made::default() }).into_iter().zip(&folders);
    let roots: Vec<_> = roots.map(|(made, folder)| made.finish(folder.path())).collect();
    assert_eq!(roots[0], roots[1]);
    let fewer = tempfile::tempdir().unwrap();
    assert_ne!(Made { objects: 2, ..Made::default() }.finish(fewer.path()), roots[0]);
}

#[test]
fn splits_select_and_shuffling_only_reorders() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    made.finish(folder.path());
    let reader = DatasetReader::open(folder.path()).unwrap();
    let mut seen = 0;
    for split in Split::ALL {
        let indices: Vec<_> = reader.indices(Selection::of(split)).collect();
        let read: Vec<_> = reader.iter(Selection::of(split)).map(|sample| sample.unwrap().index).collect();
        assert_eq!(read, indices);
        assert!(indices.iter().all(|index| reader.split(*index) == Some(split)));
        assert_eq!(reader.manifest().counts.splits.get(&split).copied().unwrap_or(0), indices.len() as u64);
        let mut shuffled: Vec<_> =
            reader.shuffled(Selection::of(split), 7).map(|sample| sample.unwrap().index).collect();
        let again: Vec<_> = reader.shuffled(Selection::of(split), 7).map(|sample| sample.unwrap().index).collect();
        assert_eq!(shuffled, again);
        shuffled.sort();
        assert_eq!(shuffled, indices);
        seen += indices.len();
    }
    assert_eq!(seen as u64, reader.manifest().counts.kept);
    let subset: Vec<_> = reader.indices(Selection::training_subset(0)).collect();
    assert!(!subset.is_empty() && subset.iter().all(|index| reader.id(*index).unwrap().subject == made.object(0)));
    let order: Vec<_> = reader.shuffled(Selection::default(), 1).map(|sample| sample.unwrap().index).collect();
    assert_ne!(order, reader.indices(Selection::default()).collect::<Vec<_>>());
}

#[test]
fn another_job_and_other_shards_are_refused_with_both_numbers() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    assert_eq!(begin_run(folder.path(), &made.mark()).unwrap(), Begun::New);
    assert_eq!(begin_run(folder.path(), &made.mark()).unwrap(), Begun::Again);
    let other = JobDigest(Digest::of(b"other"));
    let error = begin_run(folder.path(), &RunMark { job: other, ..made.mark() }).unwrap_err();
    assert!(matches!(error, DatasetError::ForeignJob { found, expected, .. } if found == job() && expected == other));
    let error = begin_run(folder.path(), &RunMark { shards: 9, ..made.mark() }).unwrap_err();
    assert!(matches!(error, DatasetError::OtherShards { .. }), "{error}");
    let strange = tempfile::tempdir().unwrap();
    fs::write(strange.path().join("thesis.tex"), "").unwrap();
    let error = begin_run(strange.path(), &made.mark()).unwrap_err();
    assert!(error.to_string().contains("thesis.tex"), "{error}");
    made.finish(folder.path());
    assert_eq!(begin_run(folder.path(), &made.mark()).unwrap(), Begun::Finished);
}

#[test]
fn a_scan_knows_done_bad_and_leftover_files() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    let shards = made.write(folder.path());
    let mut bytes = fs::read(&shards[1].path).unwrap();
    bytes[100] ^= 1;
    fs::write(&shards[1].path, &bytes).unwrap();
    fs::write(&shards[3].path, &fs::read(&shards[3].path).unwrap()[..500]).unwrap();
    let place = folder.path().join("shards");
    fs::write(place.join("notes.txt"), "").unwrap();
    fs::write(place.join(".completion-00004-of-00005.1-2-3.tmp"), "").unwrap();
    let scan = scan_shards(folder.path(), &made.mark()).unwrap();
    let done: Vec<_> = scan.done.keys().map(|shard| shard.0).collect();
    assert_eq!(done, [0, 2, 4]);
    let bad: Vec<_> = scan.bad.iter().map(|bad| bad.shard.map(|shard| shard.0)).collect();
    assert_eq!(bad, [Some(1), Some(3), None]);
    assert_eq!(scan.leftovers.len(), 1);
    let error = finish_dataset(folder.path(), &made.header()).unwrap_err();
    assert!(matches!(&error, DatasetError::MissingShards { missing, .. } if *missing == [1, 3]), "{error}");
    clear_away(&scan).unwrap();
    let again = scan_shards(folder.path(), &made.mark()).unwrap();
    assert!(again.bad.is_empty() && again.leftovers.is_empty() && again.done == scan.done);
    made.write_shard(folder.path(), 1);
    made.write_shard(folder.path(), 3);
    let whole = tempfile::tempdir().unwrap();
    assert_eq!(finish_dataset(folder.path(), &made.header()).unwrap().root, made.finish(whole.path()));
}

#[test]
fn a_writer_that_is_given_up_leaves_nothing_and_one_at_work_is_no_leftover() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    begin_run(folder.path(), &made.mark()).unwrap();
    let place = folder.path().join("shards");
    let mut writer = ShardWriter::create(&place, &made.shard_header(0)).unwrap();
    assert!(scan_shards(folder.path(), &made.mark()).unwrap().leftovers.is_empty());
    let error = writer.keep(SampleIndex(0), &made.id(0), PairFacts::default()).unwrap_err();
    assert!(matches!(error, DatasetError::Sequence { .. }), "{error}");
    assert!(writer.reject(SampleIndex(1), &made.id(1), PairFacts::default(), "few_cells", "").is_err());
    assert!(writer.finish().is_err());
    assert_eq!(names(&place), [""; 0]);
}

#[test]
fn ledgers_say_what_became_of_every_sample() {
    let (made, folder) = (Made::default(), tempfile::tempdir().unwrap());
    made.finish(folder.path());
    let reader = DatasetReader::open(folder.path()).unwrap();
    let mut rows = Vec::new();
    for shard in 0..reader.manifest().shards.len() {
        rows.extend(reader.ledger(shard).unwrap().rows);
    }
    assert_eq!(rows.len() as u64, made.samples());
    for (index, row) in (0..).zip(rows) {
        assert_eq!((row.index.0, row.sample), (index, made.id(index)));
        match row.fate {
            Fate::Rejected { reason, .. } => assert!(made.rejected(index) && reason == "few_cells"),
            Fate::Kept(digests) => {
                let pair = pair(row.sample, index, made.resolution);
                let mut payload = Vec::new();
                pair.encode(&mut payload);
                assert_eq!(digests[0], Digest::of(&payload));
                assert_eq!(row.facts, pair.facts().into());
            }
        }
    }
}
