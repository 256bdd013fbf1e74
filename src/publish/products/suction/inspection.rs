//! The facts of a dataset of suction: what `inspect` prints.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use crate::{
    chart::{grouped, percent},
    headline::count_kept,
    inspection::{InspectionHeader, evenly, open_of},
};
use format::{
    PickObstacle, Product, SuctionFacts, SuctionPoses,
    dataset::{Counts, DatasetError, DatasetReader, Fate},
};
use kernel::{
    files::Folder,
    ids::{Digest, ObjectId, SampleIndex},
    words::{Show, Split},
};

/// Content of a dataset of suction. `Display` writes text; serialising gives JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SuctionInspection {
    /// Facts that the inspections of all products share.
    #[serde(flatten)]
    pub header: InspectionHeader,
    /// Scenes of the bodies.
    pub scenes: u64,
    /// Bodies.
    pub samples: u64,
    /// Kept bodies.
    pub kept: u64,
    /// Kept bodies by split.
    pub splits: BTreeMap<Split, u64>,
    /// Bodies with a free pose.
    pub bodies_with_free: u64,
    /// Poses drawn.
    pub poses: u64,
    /// Poses by reason for which they were lost, in the order of the tests.
    pub lost: Vec<(String, u64)>,
    /// Poses like a free pose that was found before.
    pub alike: u64,
    /// Free poses, unlike each other.
    pub free: u64,
    /// Free poses that hold in at least half of the poses with errors.
    pub robust: u64,
    /// One row per object, sorted by name.
    pub objects: Vec<CupObject>,
}

/// An object of the scenes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CupObject {
    /// Name in the job of the scenes.
    pub name: String,
    /// The object by content.
    pub object: ObjectId,
    /// Split of its scenes.
    pub split: Option<Split>,
    /// Bodies of this object, and those with a free pose.
    pub bodies: [u64; 2],
    /// Poses drawn.
    pub poses: u64,
    /// Poses that leak, that are too weak, that are blocked, that are free.
    pub results: [u64; 4],
}

/// Input of a page, except the pictures.
pub(crate) struct SuctionSurvey {
    pub facts: SuctionInspection,
    /// Bodies on the page: with a free pose, or else any.
    pub shown: Vec<SampleIndex>,
}

/// Maximum number of bodies on a page.
const SHOWN: usize = 6;

/// Bodies with a free pose, and the free poses.
pub(super) fn headline(reader: &DatasetReader) -> Result<String, DatasetError> {
    let counts = &reader.manifest().counts;
    let with_free = count_kept(reader, |row| SuctionFacts::from(&row.facts).with_free > 0)?;
    let [with_free, bodies, free] = [with_free, counts.kept, counts.fact("free")].map(grouped);
    Ok(format!("{with_free} of {bodies} bodies have a free suction pose; {free} poses are free"))
}

/// The facts of a finished dataset of suction: reads tables and ledgers.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_suction(folder: &Folder) -> Result<SuctionInspection, DatasetError> {
    Ok(SuctionSurvey::of(&open_of(folder, Product::SUCTION)?)?.facts)
}

impl SuctionSurvey {
    /// Reads the ledgers of a dataset, one at a time.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let assets = reader.assets()?;
        let bodies: BTreeMap<ObjectId, Vec<ObjectId>> =
            assets.subjects.iter().map(|row| (row.object, objects_of(row.facts.get("objects")))).collect();
        let row = |row: format::dataset::AssetRow| CupObject {
            split: reader.splits().object(&row.object).map(|split| split.split),
            object: row.object,
            name: row.name,
            bodies: [0; 2],
            poses: 0,
            results: [0; 4],
        };
        let mut objects: BTreeMap<ObjectId, CupObject> =
            assets.objects.into_iter().map(|asset| (asset.object, row(asset))).collect();
        let (mut with_free, mut all) = (Vec::new(), Vec::new());
        for shard in 0..manifest.shards.len() {
            for row in reader.ledger(shard)?.rows {
                let facts = SuctionFacts::from(&row.facts);
                let of = bodies.get(&row.sample.subject).and_then(|bodies| bodies.get(row.sample.item.0 as usize));
                if let Some(object) = of.and_then(|object| objects.get_mut(object)) {
                    object.add(&facts);
                }
                if matches!(row.fate, Fate::Kept(_)) {
                    all.push(row.index);
                    with_free.extend((facts.with_free > 0).then_some(row.index));
                }
            }
        }
        let mut objects: Vec<CupObject> = objects.into_values().collect();
        objects.sort_by(|a, b| a.name.cmp(&b.name));
        let counts = &manifest.counts;
        let facts = SuctionInspection {
            header: InspectionHeader::of(reader, headline(reader)?)?,
            scenes: bodies.len() as u64,
            samples: counts.samples,
            kept: counts.kept,
            splits: counts.splits.clone(),
            bodies_with_free: with_free.len() as u64,
            poses: counts.fact("poses"),
            lost: lost(counts),
            alike: counts.fact("poses_alike"),
            free: counts.fact("free"),
            robust: counts.fact("robust"),
            objects,
        };
        let shown = if with_free.is_empty() { all } else { with_free };
        Ok(Self { facts, shown: evenly(&shown, SHOWN) })
    }
}

/// The objects of a scene's bodies, in order.
fn objects_of(field: Option<&serde_json::Value>) -> Vec<ObjectId> {
    let digests = field.and_then(serde_json::Value::as_array).into_iter().flatten();
    digests.filter_map(|digest| digest.as_str().and_then(Digest::from_hex).map(ObjectId)).collect()
}

/// Lost poses by reason, with words for people.
fn lost(counts: &Counts) -> Vec<(String, u64)> {
    let leaking = SuctionPoses::SEAL_LIMITS.map(|limit| (format!("leaking: {limit}"), format!("leaking_{limit}")));
    let weak = SuctionPoses::STRENGTHS.map(|strength| (format!("too weak: {strength}"), format!("weak_{strength}")));
    let blocked = PickObstacle::NAMES
        .map(|name| (format!("path blocked by {name}"), format!("blocked_by_{}", name.replace(' ', "_"))));
    let tilted = ("beyond the half angle".to_owned(), "poses_tilted".to_owned());
    let all = [tilted].into_iter().chain(leaking).chain(weak).chain(blocked);
    all.map(|(words, fact)| (words, counts.fact(&fact))).collect()
}

impl CupObject {
    fn add(&mut self, facts: &SuctionFacts) {
        let sum = |counts: &[u32]| counts.iter().copied().map(u64::from).sum::<u64>();
        let draws = &facts.draws;
        self.bodies[0] += 1;
        self.bodies[1] += u64::from(facts.with_free);
        self.poses += u64::from(draws.drawn);
        let found = [sum(&draws.leaking), sum(&draws.weak), sum(&draws.blocked), u64::from(draws.free)];
        self.results.iter_mut().zip(found).for_each(|(all, count)| *all += count);
    }

    /// Cells of a row: name, split, bodies, those with a free pose, poses, leaking, weak, blocked and free ones.
    pub(super) fn cells(&self) -> Vec<String> {
        let Self { name, split, bodies, poses, results, .. } = self;
        let counts = bodies.iter().chain([poses]).chain(results).copied();
        [name.clone(), split.map_or("", Split::name).to_owned()].into_iter().chain(counts.map(grouped)).collect()
    }
}

/// A share of a count as text.
pub(super) fn share(part: u64, all: u64) -> String {
    percent(part as f64 / all.max(1) as f64)
}

impl SuctionInspection {
    /// Lost poses whose reason begins with some words.
    fn lost_to(&self, reason: &str) -> u64 {
        self.lost.iter().filter(|(words, _)| words.starts_with(reason)).map(|(_, count)| count).sum()
    }

    /// From poses to robust ones: poses that pass each group of tests.
    pub(super) fn funnel(&self) -> [(&'static str, u64); 5] {
        let [leaking, weak, tilted] = ["leaking", "too weak", "beyond"].map(|reason| self.lost_to(reason));
        let within = self.poses.saturating_sub(tilted);
        [
            ("poses within the half angle", within),
            ("the cup seals", within.saturating_sub(leaking)),
            ("and holds the body", within.saturating_sub(leaking + weak)),
            ("free, unlike each other", self.free),
            ("of these robust", self.robust),
        ]
    }
}

impl fmt::Display for SuctionInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.header.write_names(f)?;
        writeln!(f, "  job       {}", self.header.job)?;
        let kept = share(self.kept, self.samples);
        writeln!(f, "  samples   {} of {} bodies kept ({kept})", grouped(self.kept), grouped(self.samples))?;
        for (split, count) in &self.splits {
            writeln!(f, "            {:>9} {}", grouped(*count), split.name())?;
        }
        writeln!(f, "  scenes    {}", grouped(self.scenes))?;
        writeln!(f, "  bodies    {} with a free pose", grouped(self.bodies_with_free))?;
        writeln!(f, "  poses     {} drawn", grouped(self.poses))?;
        let others = [("like a free pose before", self.alike), ("free", self.free), ("of these robust", self.robust)];
        let others = others.map(|(words, count)| (words.to_owned(), count));
        for (words, count) in self.lost.iter().chain(&others).filter(|(_, count)| *count > 0) {
            writeln!(f, "            {:>9} {words} ({})", grouped(*count), share(*count, self.poses))?;
        }
        self.header.write_shards(f)?;
        writeln!(f)?;
        let wide = self.objects.iter().map(|object| object.name.chars().count()).max().unwrap_or(0).clamp(6, 40);
        let heads = ["bodies", "with free", "poses", "leaking", "weak", "blocked", "free"];
        write!(f, "\n{:<wide$}  {:<10}", "object", "split")?;
        heads.iter().try_for_each(|head| write!(f, " {head:>9}"))?;
        writeln!(f)?;
        for object in &self.objects {
            let cells = object.cells();
            write!(f, "{:<wide$}  {:<10}", object.name.shown(), cells[1])?;
            cells[2..].iter().try_for_each(|cell| write!(f, " {cell:>9}"))?;
            writeln!(f)?;
        }
        if let Some(speed) = &self.header.notes.speed {
            writeln!(f, "\nspeed: {:.1} bodies/s: {:.1} s on {} threads", speed.rate(), speed.seconds, speed.threads)?;
        }
        self.header.write_warnings(f)
    }
}
