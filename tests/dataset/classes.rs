//! Datasets whose channels are of two classes of numbers: a root each.

use std::{fs, path::Path};

use graspmill::{
    files::Folder,
    format::{
        Channel, TactileContacts,
        dataset::{DatasetReader, Fate, Manifest, Selection, verify},
    },
    geom::OccupancyGrid,
    ids::Digest,
    words::NumberClass,
};
use serde_json::Value;

use crate::support::{
    files::{CHECK_INSIDE, list_names, read_json, read_text},
    small_dataset::{SmallDataset, make_touch, unseal},
    workspace::Workspace,
};

fn with_channels(channels: &[Channel]) -> SmallDataset {
    SmallDataset { resolution: 12, channels: channels.to_vec(), ..SmallDataset::default() }
}

const PLAIN: [Channel; 3] = [Channel::PAIR, Channel::VISIBILITY, Channel::TOUCH_RAYS];
const BOTH: [Channel; 5] =
    [Channel::PAIR, Channel::VISIBILITY, Channel::TOUCH_RAYS, Channel::TOUCH_EXPLORATION, Channel::TOUCH_GRASP];

/// The digest of some topics of all samples, as specified in docs/format.md.
fn calculate_root(reader: &DatasetReader, topics: &[&str]) -> Digest {
    let mut leaves = Vec::new();
    for shard in 0..reader.manifest().shards.len() {
        let ledger = reader.ledger(shard).unwrap();
        for row in &ledger.rows {
            let Fate::Kept(digests) = &row.fate else { continue };
            let mut payloads: Vec<_> = ledger.channels.iter().map(|channel| channel.topic).zip(digests).collect();
            payloads.retain(|(topic, _)| topics.contains(topic));
            payloads.sort();
            let id = row.sample.to_bytes();
            let words = payloads.iter().flat_map(|(topic, digest)| [topic.as_bytes(), &digest.0]);
            leaves.push((id, Digest::hash_parts([b"sample".as_slice(), &id].into_iter().chain(words))));
        }
    }
    leaves.sort_by_key(|(id, _)| *id);
    let mut level: Vec<Digest> = leaves.into_iter().map(|(_, leaf)| leaf).collect();
    while level.len() > 1 {
        let node = |pair: &[Digest]| match pair {
            [left, right] => Digest::hash_parts([b"node".as_slice(), &left.0, &right.0]),
            single => single[0],
        };
        level = level.chunks(2).map(node).collect();
    }
    level[0]
}

#[test]
fn each_class_has_the_root_of_its_topics_alone() {
    let (plain, both) = (Workspace::new(), Workspace::new());
    with_channels(&PLAIN).finish(plain.folder());
    with_channels(&BOTH).finish(both.folder());
    let (plain, both) = (
        DatasetReader::open(&Folder::at(plain.folder())).unwrap(),
        DatasetReader::open(&Folder::at(both.folder())).unwrap(),
    );
    let (one, two) = (plain.manifest(), both.manifest());
    let hands = ["/completion/touch_exploration", "/completion/touch_grasp"];
    let rest = ["/completion/pair", "/completion/visibility", "/completion/touch_rays"];
    assert_eq!(one.classes.keys().collect::<Vec<_>>(), [&NumberClass::Exact]);
    assert!(one.class_topics.is_empty());
    assert_eq!(two.classes[&NumberClass::Exact], one.classes[&NumberClass::Exact], "hands change no other class");
    assert_eq!(two.classes[&NumberClass::Exact], calculate_root(&both, &rest));
    assert_eq!(two.classes[&NumberClass::Physics], calculate_root(&both, &hands));
    assert_eq!(two.class_topics[&NumberClass::Exact], rest);
    assert_eq!(two.class_topics[&NumberClass::Physics], hands);
    assert_eq!(two.class_of(Channel::TOUCH_GRASP), Some(NumberClass::Physics));
    assert_eq!((two.class_of(Channel::PAIR), two.class_of(Channel::CLOUD)), (Some(NumberClass::Exact), None));
    assert_eq!((one.class_of(Channel::PAIR), one.class_of(Channel::TOUCH_GRASP)), (Some(NumberClass::Exact), None));
    for reader in [&plain, &both] {
        let report = verify(reader.folder(), CHECK_INSIDE, |_| {}).unwrap();
        assert!(report.is_intact(), "{:?}", report.problems);
        assert_eq!(report.calculated, Some(reader.manifest().root));
    }
}

/// Keys that docs/format.md leaves out for datasets of one class.
#[test]
fn one_class_leaves_no_trace_of_the_others() {
    let (one, other) = (Workspace::new(), Workspace::new());
    // Hands whose class is that of all else, and a class of channels that are not stored.
    let single = SmallDataset { hands: NumberClass::Exact, ..with_channels(&BOTH) };
    single.finish(one.folder());
    with_channels(&PLAIN).finish(other.folder());
    for folder in [one.folder(), other.folder()] {
        let text = read_text(folder.join("manifest.json"));
        assert!(!text.contains("class_topics") && !text.contains("physics"), "{text}");
    }
    let reader = DatasetReader::open(&Folder::at(one.folder())).unwrap();
    let topics = BOTH.map(|channel| channel.topic);
    assert_eq!(reader.manifest().classes[&NumberClass::Exact], calculate_root(&reader, &topics));
}

fn change(folder: &Path, from: &str, to: &str) {
    let path = folder.join("manifest.json");
    let text = read_text(&path);
    assert_eq!(text.matches(from).count(), 1, "{from}");
    fs::write(path, unseal(&text).replace(from, to)).unwrap();
}

#[test]
fn a_root_that_is_not_its_classs_is_named() {
    let folder = Workspace::new();
    with_channels(&BOTH).finish(folder.folder());
    let saved = Manifest::read(&Folder::at(folder.folder())).unwrap().classes[&NumberClass::Physics];
    change(folder.folder(), &saved.hex(), &Digest::hash(b"other").hex());
    let report = verify(&Folder::at(folder.folder()), CHECK_INSIDE, |_| {}).unwrap();
    let what: Vec<&str> = report.problems.iter().map(|problem| problem.what.as_str()).collect();
    let expected =
        format!("digest of class physics: saved {}, calculated {}", Digest::hash(b"other").short(), saved.short());
    assert_eq!(what, [expected]);
}

#[test]
fn a_manifest_that_forgets_a_topics_class_is_refused() {
    for (from, to) in [
        (",\n      \"/completion/touch_grasp\"\n    ]", "\n    ]"),
        ("\"class_topics\"", "\"warnings\": [], \"class_topics\""),
    ] {
        let folder = Workspace::new();
        with_channels(&BOTH).finish(folder.folder());
        change(folder.folder(), from, to);
        assert!(Manifest::read(&Folder::at(folder.folder())).is_err(), "{to}");
    }
    let folder = Workspace::new();
    with_channels(&BOTH).finish(folder.folder());
    let path = folder.path("manifest.json");
    let mut manifest: Value = read_json(&path);
    manifest.as_object_mut().unwrap().remove("class_topics");
    manifest.as_object_mut().unwrap().remove("seal");
    fs::write(&path, manifest.to_string()).unwrap();
    let error = Manifest::read(&Folder::at(folder.folder())).unwrap_err().to_string();
    assert!(error.contains("it has roots of [Exact, Physics] and topics of []"), "{error}");
}

#[test]
fn all_kinds_of_touch_of_a_sample_are_joined() {
    let folder = Workspace::new();
    let small = with_channels(&BOTH);
    small.finish(folder.folder());
    assert_eq!(list_names(folder.path("shards")).len(), small.mark().shards as usize);
    let reader = DatasetReader::open(&Folder::at(folder.folder())).unwrap();
    let (mut samples, mut cells) = (0, 0);
    for sample in reader.iter(Selection::default()) {
        let sample = sample.unwrap();
        let touched = sample.touched().unwrap().expect("touch is stored");
        let pair = small.pair(sample.index.0);
        let kinds: Vec<(Channel, TactileContacts)> =
            [Channel::TOUCH_RAYS, Channel::TOUCH_EXPLORATION, Channel::TOUCH_GRASP]
                .map(|channel| (channel, make_touch(channel, &pair)))
                .to_vec();
        let mut tactile = OccupancyGrid::new(small.resolution);
        let cells_of = kinds.iter().flat_map(|(_, touch)| touch.contacts.iter().filter_map(|contact| contact.cell));
        cells_of.for_each(|cell| tactile.set(cell));
        assert_eq!(touched.touch, kinds);
        assert_eq!(touched.partial_or_tactile, pair.partial.either(&tactile));
        // Rays and exploration touch other cells: each kind adds its own.
        assert_eq!(tactile.count(), kinds[0].1.tactile().count() + kinds[1].1.tactile().count());
        assert_eq!((&touched.tactile, &touched.pair), (&tactile, &pair));
        (samples, cells) = (samples + 1, cells + tactile.count());
    }
    assert_eq!(samples, reader.manifest().counts.kept);
    assert!(cells > 0);
}
