//! An adversary who alters one sample and hashes everything anew: only making samples again finds that.

use std::{collections::BTreeMap, fs, path::Path};

use graspmill::{
    dataset::{
        DatasetHeader, DatasetReader, Fate, ProductTables, Selection, ShardHeader, ShardWriter, finish_dataset,
        read_field,
    },
    ids::Product,
    record::{Channel, GraspRun, HeatmapPatch, ReachabilityBlock, SampleFacts, VoxelPair},
};

use crate::{all_products, problems, run, verify};

/// Alters the leading message of a sample by the last bit of one number; its facts follow. `None` where it has none to alter.
fn altered(product: Product, payload: &[u8]) -> Option<(Vec<u8>, SampleFacts)> {
    let mut bytes = Vec::new();
    let facts = match product {
        Product::Completion => {
            let mut pair = VoxelPair::decode(payload).expect("a pair");
            pair.solid_share = pair.solid_share.next_down();
            pair.encode(&mut bytes);
            pair.facts().into()
        }
        Product::Reachability => {
            let mut block = ReachabilityBlock::decode(payload).expect("a block");
            let witness = block.witnesses.first_mut()?;
            *witness = witness.next_up();
            block.encode(&mut bytes);
            block.facts().into()
        }
        Product::Grasps => {
            let mut run = GraspRun::decode(payload).expect("a run");
            let grasp = run.grasps.last_mut()?;
            grasp.contact_energy = grasp.contact_energy.next_up();
            run.encode(&mut bytes);
            run.facts().into()
        }
        Product::Patches => {
            let mut patch = HeatmapPatch::decode(payload).expect("patches");
            patch.energy = patch.energy.next_up();
            patch.encode(&mut bytes);
            patch.facts().into()
        }
    };
    Some((bytes, facts))
}

/// Writes the shard of one sample anew with another number in it, and index, tables and manifest after it: every digest
/// fits. Returns the place of the sample.
fn forge(folder: &Path) -> u64 {
    let reader = DatasetReader::open(folder).expect("a dataset");
    let manifest = reader.manifest().clone();
    let product = manifest.product;
    let leading = Channel::leading(product);
    let change = |payload: &[u8]| altered(product, payload);
    let mut kept = reader.iter(Selection::default()).map(|sample| sample.expect("readable"));
    let target = kept
        .find(|sample| change(sample.payload(leading).expect("the leading message")).is_some())
        .expect("a sample that can be altered");
    let place = manifest.shard_of(target.index.0).expect("a shard");
    let ledger = reader.ledger(place).expect("a ledger");
    let entry = &manifest.shards[place];
    let header = ShardHeader {
        product,
        job: manifest.job,
        shard: ledger.shard,
        shards: ledger.shards,
        samples: entry.first_sample..entry.first_sample + entry.samples,
        channels: ledger.channels.clone(),
    };
    let mut writer = ShardWriter::create(&folder.join("shards"), &header).expect("a shard");
    for row in &ledger.rows {
        match &row.fate {
            Fate::Rejected { reason, detail } => writer.reject(row.index, &row.sample, row.facts, reason, detail),
            Fate::Kept(_) => {
                let sample = reader.sample(row.index).expect("readable").expect("kept");
                let mut facts = row.facts;
                for channel in sample.channels() {
                    let payload = sample.payload(channel).expect("stored").to_vec();
                    let forged = (row.index == target.index && channel == leading).then(|| change(&payload)).flatten();
                    if let (Some((_, SampleFacts::Grasps(new))), SampleFacts::Grasps(old)) = (&forged, facts) {
                        facts = graspmill::record::GraspFacts { trials: old.trials, ..*new }.into();
                    } else if let Some((_, new)) = forged {
                        facts = new;
                    }
                    let payload = forged.map_or(payload, |(bytes, _)| bytes);
                    writer.write(row.index, &row.sample, channel, &payload).expect("written");
                }
                writer.keep(row.index, &row.sample, facts)
            }
        }
        .expect("accounted for");
    }
    fs::remove_file(manifest.shard_path(folder, place)).expect("the true shard goes");
    writer.finish().expect("a forged shard");
    let (assets, splits) = (reader.assets().expect("assets"), reader.splits().clone());
    let tables = match product {
        Product::Completion => ProductTables::Completion { splits },
        Product::Grasps => ProductTables::Grasps { splits },
        Product::Patches => {
            ProductTables::Patches { splits, types: manifest.counts.types.clone().expect("counts of types") }
        }
        Product::Reachability => {
            ProductTables::Reachability { field: Box::new(read_field(folder).expect("a field").header) }
        }
    };
    let of_classes = manifest
        .class_topics
        .iter()
        .flat_map(|(class, topics)| topics.iter().map(|topic| (Channel::from_topic(topic).expect("a topic"), *class)));
    let header = DatasetHeader {
        generator: manifest.generator.clone(),
        job: manifest.job,
        job_text: reader.job_text().expect("a job"),
        class: manifest.class_of(leading).expect("a class"),
        channel_classes: of_classes.collect::<BTreeMap<_, _>>(),
        platform: manifest.platform.clone(),
        assets: assets.objects.iter().map(|row| row.whole()).collect(),
        hands: assets.hands.iter().map(|row| row.whole()).collect(),
        refused: assets.refused.clone(),
        tables,
        warnings: manifest.warnings.clone(),
    };
    drop(reader);
    let forged = finish_dataset(folder, &header).expect("a forged dataset");
    assert_ne!(forged.root, manifest.root, "the root names what is there");
    target.index.0
}

#[test]
fn samples_of_all_products_are_made_again_and_a_forged_one_is_found() {
    let place = tempfile::tempdir().expect("a scratch folder");
    // Patches first: their grasps are read when they are made again.
    let mut datasets = all_products(place.path());
    datasets.reverse();
    for (name, folder) in datasets {
        let (exit, report, said) = verify(&folder, &["--regenerate", "1000", "--seed", "5"]);
        let report = report.unwrap_or_default();
        assert_eq!(exit, 0, "{name}: {report} {said}");
        let samples = report["regenerated"]["samples"].as_u64().expect("a count");
        assert_eq!(Some(samples), report["samples"].as_u64(), "{name}: all of them");
        let index = forge(&folder);
        let (exit, report, said) = verify(&folder, &[]);
        let report = report.unwrap_or_default();
        assert_eq!(
            (exit, problems(&report)),
            (0, vec![]),
            "{name}: a perfect forgery passes hashes and structure: {said}"
        );
        let (exit, report, _) = verify(&folder, &["--regenerate", "1000", "--seed", "5"]);
        let report = report.unwrap_or_default();
        let differences = report["regenerated"]["differences"].as_array().cloned().unwrap_or_default();
        assert_eq!((exit, differences.len()), (4, 1), "{name}: {report}");
        assert_eq!(differences[0]["sample"].as_u64(), Some(index), "{name}");
        assert!(differences[0]["what"].as_str().is_some_and(|what| what.contains("other bytes")), "{report}");
        println!("{name}: {samples} samples made again, sample {index} found to be forged");
    }
}

#[test]
fn a_missing_mesh_is_named_with_the_place_where_it_is_expected() {
    let place = tempfile::tempdir().expect("a scratch folder");
    let meshes = place.path().join("meshes");
    fs::create_dir(&meshes).expect("a folder");
    let pyramid = "OFF\n5 6 0\n0 0 0\n.1 0 0\n.1 .1 0\n0 .1 0\n.05 .05 .1\n3 0 2 1\n3 0 3 2\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n";
    let block = pyramid.replace(".05 .05 .1", ".02 .02 .15");
    fs::write(meshes.join("pyramid.off"), pyramid).expect("a mesh");
    fs::write(meshes.join("block.off"), block).expect("a mesh");
    let job =
        "views = { even = 3 }\n[[objects]]\nfolder = \"meshes\"\n[split]\nvalidation_models = 0\ntest_models = 0\n";
    let folder = run(job, place.path(), "data");
    fs::remove_file(meshes.join("pyramid.off")).expect("the mesh goes");
    let (exit, _, _) = verify(&folder, &[]);
    assert_eq!(exit, 0, "checking needs no mesh");
    let (exit, report, said) = verify(&folder, &["--regenerate", "3"]);
    println!("exit code {exit}: {said} {report:?}");
    assert!(
        exit != 0 && said.contains("pyramid.off") && said.contains(&meshes.display().to_string()),
        "{exit}: {said}"
    );
    // Another mesh of the same name is not that mesh either.
    fs::write(meshes.join("pyramid.off"), pyramid.replace(".1 0 0", ".11 0 0")).expect("another mesh");
    let (exit, _, said) = verify(&folder, &["--regenerate", "3"]);
    assert!(
        exit == 4 && said.contains("other content than that of the dataset") && said.contains("pyramid"),
        "{exit}: {said}"
    );
    assert!(!said.contains("block"), "{said}");
}

#[test]
fn a_dataset_that_was_moved_is_told_where_its_hand_is() {
    let place = tempfile::tempdir().expect("a temporary folder");
    let jobs = super::products::jobs(Path::new(super::ROOT), place.path());
    let (name, text) = jobs.into_iter().find(|(name, _)| *name == "grasps").expect("a job");
    let made = super::run(&text, place.path(), name);
    // Deeper than it was: the paths of its job lead nowhere.
    let moved = place.path().join("a/b/c");
    fs::create_dir_all(moved.parent().expect("a parent")).expect("folders");
    fs::rename(made, &moved).expect("moved");
    let (code, _, said) = super::verify(&moved, &["--regenerate", "2"]);
    assert!(code == 2 && said.contains("barrett_bh8_280.xml"), "{code}: {said}");
    let given = |scene: &str| format!("hand.scene={}", Path::new(super::ROOT).join("scenes").join(scene).display());
    let (code, report, said) = super::verify(&moved, &["--regenerate", "2", "--set", &given("barrett_bh8_280.xml")]);
    let report = report.unwrap_or_else(|| panic!("{said}"));
    assert_eq!((code, report["regenerated"]["differences"].as_array().map(Vec::len)), (0, Some(0)), "{said}");
    let (code, _, said) = super::verify(&moved, &["--regenerate", "2", "--set", &given("fetch_gripper.xml")]);
    assert!(code == 4 || code == 2, "another hand is refused: {code}: {said}");
}
