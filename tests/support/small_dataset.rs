//! A small dataset made by hand, and the records that it must read back as.

use std::path::Path;

use graspmill::{
    files::Folder,
    format::{
        Approach, ApproachEnd, Channel, HandTouch, LinkContact, PairFacts, Product, TactileContacts, TouchContact,
        Visibility, VoxelPair,
        dataset::{DatasetHeader, FinishedShard, RunMark, ShardHeader, ShardWriter, begin_run, finish_dataset},
    },
    geom::{GridPlacement, Intrinsics, OccupancyGrid, Pose, rotation_from_rpy},
    ids::{Digest, ItemId, JobDigest, ObjectId, SampleId, SampleIndex, ShardId},
    tables::ParquetIndex,
    words::{NumberClass, ObjectSplit, Split, SplitTable},
};
use nalgebra::{Point3, Vector3};

/// A small dataset made by hand: ellipsoids, with a camera that points along z.
#[derive(Clone)]
pub struct SmallDataset {
    pub objects: u64,
    pub views: u32,
    pub shard_samples: u32,
    pub resolution: u32,
    /// The last of every `reject_every` samples is rejected.
    pub reject_every: u64,
    pub channels: Vec<Channel>,
    /// The class of numbers of touch by hands.
    pub hands: NumberClass,
}

impl Default for SmallDataset {
    fn default() -> Self {
        let channels = vec![Channel::PAIR, Channel::VISIBILITY];
        let hands = NumberClass::Physics;
        Self { objects: 3, views: 11, shard_samples: 8, resolution: 40, reject_every: 7, channels, hands }
    }
}

impl SmallDataset {
    pub fn samples(&self) -> u64 {
        self.objects * u64::from(self.views)
    }

    pub fn mark(&self) -> RunMark {
        let shards = self.samples().div_ceil(u64::from(self.shard_samples)) as u32;
        RunMark::new(Product::COMPLETION, job_digest(), self.samples(), shards, self.shard_samples)
    }

    pub fn object(&self, object: u64) -> ObjectId {
        ObjectId(Digest::hash(&object.to_le_bytes()))
    }

    pub fn id(&self, index: u64) -> SampleId {
        let views = u64::from(self.views);
        SampleId::of_object(self.object(index / views), ItemId((index % views) as u32))
    }

    pub fn is_rejected(&self, index: u64) -> bool {
        index % self.reject_every == self.reject_every - 1
    }

    /// The pair of a sample: ellipsoids of many shapes, so that a swapped axis shows.
    pub fn pair(&self, index: u64) -> VoxelPair {
        let resolution = self.resolution;
        let (mut partial, mut complete) = (OccupancyGrid::new(resolution), OccupancyGrid::new(resolution));
        let n = f64::from(resolution);
        let radii = [0.4 * n, (0.2 + 0.02 * (index % 9) as f64) * n, (0.15 + 0.03 * (index % 7) as f64) * n];
        for x in 0..resolution {
            for y in 0..resolution {
                let mut seen = false;
                for z in 0..resolution {
                    let at = [x, y, z].map(|cell| f64::from(cell) + 0.5 - 0.5 * n);
                    let inside = at.iter().zip(radii).map(|(at, radius)| (at / radius).powi(2)).sum::<f64>() <= 1.0;
                    if inside {
                        complete.set([x, y, z]);
                        if !seen {
                            partial.set([x, y, z]);
                        }
                        seen = true;
                    }
                }
            }
        }
        let (partial_cells, complete_cells) = (partial.count(), complete.count());
        let world_from_object =
            Pose::new(rotation_from_rpy(0.1 * index as f64, 0.2, 0.3), Vector3::new(1.0, 0.01 * index as f64, 0.2));
        let world_from_camera = Pose::new(rotation_from_rpy(-1.5, 0.0, -1.5), Vector3::new(0.0, 0.0, 0.5));
        VoxelPair {
            sample: self.id(index),
            grid: GridPlacement { resolution, centre: Point3::new(0.01, -0.02, 0.9), cell_size: 0.003 },
            camera: Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).unwrap(),
            camera_from_object: world_from_camera.inverse() * world_from_object,
            world_from_object,
            world_from_camera,
            both_cells: partial.count_both(&complete),
            partial,
            complete,
            partial_cells,
            complete_cells,
            solid_share: 0.99,
        }
    }

    pub fn shard_header(&self, shard: u32) -> ShardHeader {
        let first = u64::from(shard * self.shard_samples);
        ShardHeader {
            product: Product::COMPLETION,
            job: job_digest(),
            shard: ShardId(shard),
            shards: self.mark().shards,
            samples: first..(first + u64::from(self.shard_samples)).min(self.samples()),
            channels: self.channels.clone(),
        }
    }

    pub fn write_shard(&self, folder: &Path, shard: u32) -> FinishedShard {
        let header = self.shard_header(shard);
        let mut writer = ShardWriter::create(&Folder::at(folder.join("shards")), &header).unwrap();
        let mut payload = Vec::new();
        for index in header.samples {
            let (sample, id) = (SampleIndex(index), self.id(index));
            if self.is_rejected(index) {
                writer.reject(sample, &id, PairFacts::default(), "few_cells", "99 cells, at least 100").unwrap();
                continue;
            }
            let pair = self.pair(index);
            for channel in &self.channels {
                payload.clear();
                match *channel {
                    Channel::PAIR => pair.encode(&mut payload),
                    Channel::VISIBILITY => Visibility::encode_parts(&id, &free_cells(&pair), &mut payload),
                    channel if channel.is_touch() => make_touch(channel, &pair).encode(&mut payload),
                    other => panic!("{other:?} is no channel of this dataset"),
                }
                writer.write(sample, &id, *channel, &payload).unwrap();
            }
            writer.keep(sample, &id, pair.facts()).unwrap();
        }
        writer.finish().unwrap()
    }

    pub fn header(&self) -> DatasetHeader {
        let split = |object| ObjectSplit {
            object: self.object(object),
            split: if object + 1 == self.objects { Split::Test } else { Split::Training },
            holdout_items: if object + 1 == self.objects { vec![] } else { vec![2, 5] },
            subset: (object == 0).then_some(0),
        };
        let asset = |object| {
            let (name, volume) = (format!("thing {object}"), 0.1 + object as f64);
            serde_json::json!({ "name": name, "object": self.object(object), "volume": volume })
        };
        DatasetHeader {
            product: Product::COMPLETION,
            generator: "graspmill test".to_owned(),
            job: job_digest(),
            job_text: "seed = 1\n".to_owned(),
            class: NumberClass::Exact,
            channel_classes: [Channel::TOUCH_EXPLORATION, Channel::TOUCH_GRASP]
                .map(|channel| (channel, self.hands))
                .into(),
            platform: Default::default(),
            assets: (0..self.objects).map(asset).collect(),
            subjects: vec![],
            hands: vec![],
            containers: Vec::new(),
            refused: vec![],
            splits: Some(SplitTable { training_subsets: vec![1], objects: (0..self.objects).map(split).collect() }),
            warnings: vec![],
        }
    }

    pub fn write(&self, folder: &Path) -> Vec<FinishedShard> {
        begin_run(&Folder::at(folder), &self.mark()).unwrap();
        (0..self.mark().shards).map(|shard| self.write_shard(folder, shard)).collect()
    }

    pub fn finish(&self, folder: &Path) -> Digest {
        self.write(folder);
        finish_dataset(&Folder::at(folder), &self.header(), &ParquetIndex).unwrap().root
    }
}

pub fn job_digest() -> JobDigest {
    JobDigest(Digest::hash(b"job"))
}

/// Touch of every seventh cell of the far side, in its middle. A hand finds these in its first approach of three, nothing
/// in the second, and blows up in the third.
pub fn make_touch(channel: Channel, pair: &VoxelPair) -> TactileContacts {
    let (n, lower) = (pair.grid.resolution, pair.grid.lower_corner());
    let first = if channel == Channel::TOUCH_EXPLORATION { 0 } else { 3 };
    let mut touch = TactileContacts { resolution: n, probes: 3, ..TactileContacts::none(pair.sample) };
    for [x, y, z] in pair.complete.cells().filter(|[x, y, z]| (x + 3 * y) % 7 == first && *z > n / 2) {
        let middle = lower + Vector3::from([x, y, z].map(|index| f64::from(index) + 0.5)) * pair.grid.cell_size;
        touch.contacts.push(TouchContact {
            probe: 0,
            position: middle.coords.map(|part| part as f32).into(),
            normal: [0.0, 0.0, 1.0],
            distance: 0.01,
            visible: x == 0,
            cell: Some([x, y, z]),
        });
    }
    let missed = if touch.contacts.is_empty() { 3 } else { 2 };
    touch.misses = vec![[0.0, 0.0, 1.0]; missed];
    if channel.is_touch_by_hand() {
        let contacts =
            (0..touch.contacts.len() as u32).map(|k| LinkContact { link: k % 2, force: k as f32, gap: -1e-5 });
        let ends = [ApproachEnd::AtRest, ApproachEnd::Missed, ApproachEnd::Unstable];
        let approach = |end| Approach { camera_from_hand: Pose::identity(), joints: vec![0.1], end };
        touch.hand = Some(HandTouch {
            hand: "claw".to_owned(),
            links: vec!["palm".to_owned(), "tip".to_owned()],
            joints: vec!["finger".to_owned()],
            contacts: contacts.collect(),
            approaches: ends.map(approach).to_vec(),
        });
    }
    touch
}

/// The cells in front of those of `partial`: known to be free.
pub fn free_cells(pair: &VoxelPair) -> OccupancyGrid {
    let mut free = OccupancyGrid::new(pair.grid.resolution);
    for cell in pair.partial.cells() {
        (0..cell[2]).for_each(|z| free.set([cell[0], cell[1], z]));
    }
    free
}

/// A manifest, or the table of a set, without its seal: as written by a program without seals.
pub fn unseal(text: &str) -> String {
    let (keys, _) = text.split_once(",\n  \"seal\"").expect("a seal");
    format!("{keys}\n}}\n")
}
