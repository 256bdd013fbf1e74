//! An adversary who alters one sample and recomputes all digests: only making samples again detects that.

use std::{collections::BTreeMap, fs, path::Path};

use graspmill::{
    files::Folder,
    format::{
        Channel, Facts, GraspFacts, GraspRun, HeatmapPatch, PatchFacts, Product, ReachabilityBlock, VoxelPair,
        dataset::{DatasetHeader, DatasetReader, Fate, Selection, ShardHeader, ShardWriter, finish_dataset},
    },
    tables::ParquetIndex,
};

use crate::integrity::verification::Verification;
use crate::support::{
    files::repository_path,
    jobs::{NO_SPLIT, copy_small_dataset, make_small_datasets, small_job},
    meshes::pyramid_off,
    workspace::Workspace,
};

/// Alters the leading message of a sample by the last bit of one number; its facts follow. `None` where it has none to alter.
fn alter(product: Product, payload: &[u8]) -> Option<(Vec<u8>, Facts)> {
    let mut bytes = Vec::new();
    let facts = match product {
        Product::COMPLETION => {
            let mut pair = VoxelPair::decode(payload).expect("a pair");
            pair.solid_share = pair.solid_share.next_down();
            pair.encode(&mut bytes);
            pair.facts().into()
        }
        Product::REACHABILITY => {
            let mut block = ReachabilityBlock::decode(payload).expect("a block");
            let witness = block.witnesses.first_mut()?;
            *witness = witness.next_up();
            block.encode(&mut bytes);
            block.facts().into()
        }
        Product::GRASPS => {
            let mut run = GraspRun::decode(payload).expect("a run");
            let grasp = run.grasps.last_mut()?;
            grasp.contact_energy = grasp.contact_energy.next_up();
            run.encode(&mut bytes);
            run.facts().into()
        }
        Product::PATCHES => {
            let mut patch = HeatmapPatch::decode(payload).expect("patches");
            patch.energy = patch.energy.next_up();
            patch.encode(&mut bytes);
            patch.facts().into()
        }
        other => panic!("no message of {other} is altered here"),
    };
    Some((bytes, facts))
}

/// The header that a dataset was closed with.
pub fn header_of(reader: &DatasetReader) -> DatasetHeader {
    let manifest = reader.manifest();
    let product = manifest.product;
    let assets = reader.assets().expect("assets");
    let splits = product.has_splits.then(|| reader.splits().clone());
    let of_classes = manifest
        .class_topics
        .iter()
        .flat_map(|(class, topics)| topics.iter().map(|topic| (Channel::from_topic(topic).expect("a topic"), *class)));
    DatasetHeader {
        product,
        generator: manifest.generator.clone(),
        job: manifest.job,
        job_text: reader.job_text().expect("a job"),
        class: manifest.class_of(product.leading()).expect("a class"),
        channel_classes: of_classes.collect::<BTreeMap<_, _>>(),
        platform: manifest.platform.clone(),
        assets: assets.objects.iter().map(|row| row.whole()).collect(),
        subjects: assets.subjects.iter().map(|row| row.whole()).collect(),
        hands: assets.hands.iter().map(|row| row.whole()).collect(),
        containers: assets.containers.iter().map(|row| row.whole()).collect(),
        refused: assets.refused.clone(),
        splits,
        warnings: manifest.warnings.clone(),
    }
}

/// Rewrites the shard of one sample with another number in it, and then index, tables and manifest: every digest fits.
/// Returns the index of the sample.
fn forge(folder: &Path) -> u64 {
    let reader = DatasetReader::open(&Folder::at(folder)).expect("a dataset");
    let manifest = reader.manifest().clone();
    let product = manifest.product;
    let leading = product.leading();
    let change = |payload: &[u8]| alter(product, payload);
    let mut kept = reader.iter(Selection::default()).map(|sample| sample.expect("readable"));
    let target = kept
        .find(|sample| change(sample.payload(leading).expect("the leading message")).is_some())
        .expect("a sample that can be altered");
    let shard = manifest.shard_of(target.index.0).expect("a shard");
    let ledger = reader.ledger(shard).expect("a ledger");
    let entry = &manifest.shards[shard];
    let header = ShardHeader {
        product,
        job: manifest.job,
        shard: ledger.shard,
        shards: ledger.shards,
        samples: entry.first_sample..entry.first_sample + entry.samples,
        channels: ledger.channels.clone(),
    };
    let mut writer = ShardWriter::create(&Folder::at(folder.join("shards")), &header).expect("a shard");
    for row in &ledger.rows {
        match &row.fate {
            Fate::Rejected { reason, detail } => {
                writer.reject(row.index, &row.sample, row.facts.clone(), reason, detail)
            }
            Fate::Kept(_) => {
                let sample = reader.sample(row.index).expect("readable").expect("kept");
                let mut facts = row.facts.clone();
                for channel in sample.channels() {
                    let payload = sample.payload(channel).expect("stored").to_vec();
                    let forged = (row.index == target.index && channel == leading).then(|| change(&payload)).flatten();
                    let payload = match forged {
                        Some((bytes, new)) => {
                            // The facts of trials and of marks are stated by other messages, which stay.
                            facts = match product {
                                Product::GRASPS => {
                                    let trials = GraspFacts::from(&facts).trials;
                                    GraspFacts { trials, ..GraspFacts::from(&new) }.into()
                                }
                                Product::PATCHES => {
                                    let PatchFacts { outcome, visible, .. } = PatchFacts::from(&facts);
                                    PatchFacts { outcome, visible, ..PatchFacts::from(&new) }.into()
                                }
                                _ => new,
                            };
                            bytes
                        }
                        None => payload,
                    };
                    writer.write(row.index, &row.sample, channel, &payload).expect("written");
                }
                writer.keep(row.index, &row.sample, facts)
            }
        }
        .expect("accounted for");
    }
    fs::remove_file(manifest.shard_path(folder, shard)).expect("the true shard goes");
    writer.finish().expect("a forged shard");
    let header = header_of(&reader);
    drop(reader);
    let forged = finish_dataset(&Folder::at(folder), &header, &ParquetIndex).expect("a forged dataset");
    assert_ne!(forged.root, manifest.root, "the root names what is there");
    target.index.0
}

#[test]
fn samples_of_completion_are_made_again_and_a_forged_one_is_found() {
    let workspace = Workspace::beside_fixtures("forged-completion");
    check_regenerated("completion", &copy_small_dataset("completion", &workspace.path("completion")));
}

#[test]
#[ignore = "slow: makes every sample of every product again"]
fn samples_of_all_products_are_made_again_and_a_forged_one_is_found() {
    let workspace = Workspace::new();
    // Patches first: their grasps are read when they are made again.
    let mut datasets = make_small_datasets(&workspace);
    datasets.reverse();
    for (name, folder) in datasets {
        check_regenerated(name, &folder);
    }
}

/// Makes all samples of a dataset again; then those of the dataset with one forged sample, which is found.
#[track_caller]
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn check_regenerated(name: &str, folder: &Path) {
    let regenerate = || Verification::run(folder, &["--regenerate", "1000", "--seed", "5"]);
    let Verification { code, report, stderr } = regenerate();
    assert_eq!(code, 0, "{name}: {report} {stderr}");
    let samples = report["regenerated"]["samples"].as_u64().expect("a count");
    assert_eq!(Some(samples), report["samples"].as_u64(), "{name}: all of them");
    let index = forge(folder);
    let forged = Verification::run(folder, &[]);
    assert_eq!(
        (forged.code, forged.problems()),
        (0, vec![]),
        "{name}: a perfect forgery passes hashes and structure: {}",
        forged.stderr
    );
    let Verification { code, report, .. } = regenerate();
    let differences = report["regenerated"]["differences"].as_array().cloned().unwrap_or_default();
    assert_eq!((code, differences.len()), (4, 1), "{name}: {report}");
    assert_eq!(differences[0]["sample"].as_u64(), Some(index), "{name}");
    assert!(differences[0]["what"].as_str().is_some_and(|what| what.contains("other bytes")), "{report}");
    println!("{name}: {samples} samples made again, sample {index} found to be forged");
}

#[test]
fn a_missing_mesh_is_named_with_the_place_where_it_is_expected() {
    let workspace = Workspace::new();
    let pyramid = workspace.write("meshes/pyramid.off", pyramid_off([0.05, 0.05, 0.1]));
    workspace.write("meshes/block.off", pyramid_off([0.02, 0.02, 0.15]));
    let job = format!("views = {{ even = 3 }}\n[[objects]]\nfolder = \"meshes\"\n{NO_SPLIT}");
    let folder = workspace.make_dataset("data", &job, &[]);
    fs::remove_file(&pyramid).expect("the mesh goes");
    assert_eq!(Verification::run(&folder, &[]).code, 0, "checking needs no mesh");
    let regenerate = || Verification::run(&folder, &["--regenerate", "3"]);
    let Verification { code, report, stderr: said } = regenerate();
    println!("exit code {code}: {said} {report}");
    let meshes = workspace.path("meshes").display().to_string();
    assert!(code != 0 && said.contains("pyramid.off") && said.contains(&meshes), "{code}: {said}");
    // Another mesh of this name is not that mesh either.
    workspace.write("meshes/pyramid.off", pyramid_off([0.05, 0.05, 0.1]).replace(".1 0 0", ".11 0 0"));
    let Verification { code, stderr: said, .. } = regenerate();
    assert!(
        code == 4 && said.contains("files differ from those of the dataset") && said.contains("pyramid"),
        "{code}: {said}"
    );
    assert!(!said.contains("block"), "{said}");
}

#[test]
#[ignore = "slow: makes several datasets"]
fn a_dataset_that_was_moved_is_told_where_its_hand_is() {
    let workspace = Workspace::new();
    let data = workspace.make_dataset("grasps", &small_job("grasps"), &[]);
    // Deeper than it was: the paths of its job lead nowhere.
    let moved = workspace.make_folder("a/b").join("c");
    fs::rename(data, &moved).expect("moved");
    let Verification { code, stderr: said, .. } = Verification::run(&moved, &["--regenerate", "2"]);
    assert!(code == 2 && said.contains("barrett_bh8_280.xml"), "{code}: {said}");
    let with_hand = |name: &str| {
        let hand = format!("hand.model={}", repository_path("scenes").join(name).display());
        Verification::run(&moved, &["--regenerate", "2", "--set", &hand])
    };
    let Verification { code, report, stderr } = with_hand("barrett_bh8_280.xml");
    assert_eq!((code, report["regenerated"]["differences"].as_array().map(Vec::len)), (0, Some(0)), "{stderr}");
    let Verification { code, stderr, .. } = with_hand("fetch_gripper.xml");
    assert!(code == 4 || code == 2, "another hand is refused: {code}: {stderr}");
}
