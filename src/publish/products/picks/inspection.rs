//! The facts of a dataset of picks: what `inspect` prints.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use super::headline::headline;
use crate::{
    chart::{grouped, percent},
    inspection::{InspectionHeader, evenly, open_of},
};
use format::{
    Channel, PickFacts, PickObstacle, PickVerdict, Product,
    dataset::{Counts, DatasetError, DatasetReader, Fate},
};
use kernel::{
    files::Folder,
    ids::{Digest, ObjectId, SampleIndex},
    words::{Show, Split},
};

/// Content of a dataset of picks. `Display` writes text; serialising gives JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PicksInspection {
    /// Facts that the inspections of all products share.
    #[serde(flatten)]
    pub header: InspectionHeader,
    /// Name of the hand.
    pub hand: String,
    /// Scenes of the bodies.
    pub scenes: u64,
    /// Bodies: kept + rejected.
    pub samples: u64,
    /// Kept bodies.
    pub kept: u64,
    /// Kept bodies by split.
    pub splits: BTreeMap<Split, u64>,
    /// Rejected bodies by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Kept bodies with a free grasp.
    pub bodies_with_free: u64,
    /// Evaluated grasps.
    pub candidates: u64,
    /// Free grasps, for the hand that approaches in its posture.
    pub free: u64,
    /// Blocked grasps by obstacle, in the order of [`PickObstacle::NAMES`].
    pub lost: [u64; 4],
    /// Grasps that are free if the hand approaches opened, and on at least one of the two approaches.
    pub free_opened: [u64; 2],
    /// Poses by result, where grasps are sampled in the scene.
    pub poses: Option<SampledPicks>,
    /// Outcomes of trials; `None` if nothing was tried.
    pub trials: Option<TriedPicks>,
    /// One row per object, sorted by name.
    pub objects: Vec<PickedObject>,
}

/// Poses of grasps that are sampled in the scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampledPicks {
    /// Poses drawn.
    pub poses: u64,
    /// Poses by reason for which they were lost, in the order of the tests.
    pub lost: Vec<(String, u64)>,
    /// Poses like a free grasp that was found before.
    pub alike: u64,
    /// Free grasps, unlike each other.
    pub free: u64,
    /// Bodies without a free grasp that are wider than the hand opens.
    pub too_wide: u64,
    /// Bodies without a free grasp for which a pose was rejected for the palm alone.
    pub palm_only: u64,
    /// Bodies without a free grasp by the obstacle of most poses, in the order of [`PickObstacle::NAMES`].
    pub blocked_by: [u64; 4],
}

/// Outcomes of trials among neighbours.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriedPicks {
    /// Free grasps that were tried.
    pub tried: u64,
    /// Trials by verdict, without unused verdicts.
    pub verdicts: BTreeMap<String, u64>,
    /// Trials that held.
    pub held: u64,
    /// Trials that held in which the hand also pressed on something else.
    pub held_touching: u64,
    /// Trials that held in which a neighbour moved.
    pub held_moving: u64,
    /// Trials that held in which a neighbour was lifted, too.
    pub held_carrying: u64,
}

/// An object of the scenes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PickedObject {
    /// Name in the job of the scenes.
    pub name: String,
    /// The object by content.
    pub object: ObjectId,
    /// Split of its scenes.
    pub split: Option<Split>,
    /// Bodies of this object, kept or rejected.
    pub bodies: u64,
    /// Evaluated grasps.
    pub candidates: u64,
    /// Free grasps.
    pub free: u64,
    /// Blocked grasps by obstacle.
    pub lost: [u64; 4],
    /// Free grasps that were tried, and that held.
    pub trials: [u64; 2],
}

/// Input of a page, except the pictures.
pub(crate) struct PickSurvey {
    pub facts: PicksInspection,
    /// Kept bodies on the page: with a grasp that held, or without trials with a free one.
    pub shown: Vec<SampleIndex>,
}

/// Maximum number of bodies on a page.
const SHOWN: usize = 6;

/// The facts of a finished dataset of picks: reads tables and ledgers.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_picks(folder: &Folder) -> Result<PicksInspection, DatasetError> {
    Ok(PickSurvey::of(&open_of(folder, Product::PICKS)?)?.facts)
}

impl PickSurvey {
    /// Reads the ledgers of a dataset, one at a time.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let assets = reader.assets()?;
        let bodies: BTreeMap<ObjectId, Vec<ObjectId>> =
            assets.subjects.iter().map(|row| (row.object, objects_of(row.facts.get("objects")))).collect();
        let row = |row: format::dataset::AssetRow| PickedObject {
            split: reader.splits().object(&row.object).map(|split| split.split),
            object: row.object,
            name: row.name,
            bodies: 0,
            candidates: 0,
            free: 0,
            lost: [0; 4],
            trials: [0; 2],
        };
        let mut objects: BTreeMap<ObjectId, PickedObject> =
            assets.objects.into_iter().map(|asset| (asset.object, row(asset))).collect();
        let (mut with_free, mut with_held, mut free_bodies) = (Vec::new(), Vec::new(), 0);
        for shard in 0..manifest.shards.len() {
            for row in reader.ledger(shard)?.rows {
                let facts = PickFacts::from(&row.facts);
                let of = bodies.get(&row.sample.subject).and_then(|bodies| bodies.get(row.sample.item.0 as usize));
                if let Some(object) = of.and_then(|object| objects.get_mut(object)) {
                    object.add(&facts);
                }
                if matches!(row.fate, Fate::Kept(_)) && facts.free > 0 {
                    free_bodies += 1;
                    with_free.push(row.index);
                    if facts.trials.held() > 0 {
                        with_held.push(row.index);
                    }
                }
            }
        }
        let mut objects: Vec<PickedObject> = objects.into_values().collect();
        objects.sort_by(|a, b| a.name.cmp(&b.name));
        let counts = &manifest.counts;
        let has_trials = PickVerdict::ALL.iter().any(|verdict| counts.facts.contains_key(verdict.name()));
        let verdicts = PickVerdict::ALL.map(|verdict| (verdict.name().to_owned(), counts.fact(verdict.name())));
        let is_sampled = manifest.channels().contains(&Channel::PICK_SAMPLING);
        let trials = has_trials.then(|| TriedPicks {
            tried: verdicts.iter().map(|(_, count)| count).sum(),
            held: counts.fact(PickVerdict::Held.name()),
            held_touching: counts.fact("held_touching"),
            held_moving: counts.fact("held_moving"),
            held_carrying: counts.fact("held_carrying"),
            verdicts: verdicts.into_iter().filter(|(_, count)| *count > 0).collect(),
        });
        let facts = PicksInspection {
            header: InspectionHeader::of(reader, headline(reader)?)?,
            hand: assets.hands.first().map_or_else(String::new, |hand| hand.name.clone()),
            scenes: bodies.len() as u64,
            samples: counts.samples,
            kept: counts.kept,
            splits: counts.splits.clone(),
            rejected: counts.rejected.clone(),
            bodies_with_free: free_bodies,
            candidates: counts.fact("candidates"),
            free: counts.fact("free"),
            lost: ["ground", "container", "own_object", "neighbour"].map(|to| counts.fact(&format!("lost_to_{to}"))),
            free_opened: ["free_opened", "free_either"].map(|name| counts.fact(name)),
            poses: is_sampled.then(|| SampledPicks::of(counts)),
            trials,
            objects,
        };
        let shown = if with_held.is_empty() { with_free } else { with_held };
        Ok(Self { facts, shown: evenly(&shown, SHOWN) })
    }
}

/// The objects of a scene's bodies, in order.
fn objects_of(field: Option<&serde_json::Value>) -> Vec<ObjectId> {
    let digests = field.and_then(serde_json::Value::as_array).into_iter().flatten();
    digests.filter_map(|digest| digest.as_str().and_then(Digest::from_hex).map(ObjectId)).collect()
}

/// Facts of lost poses, with words for people.
const LOST: [(&str, &str); 12] = [
    ("poses_unopposed", "without an opposite point"),
    ("poses_too_wide", "wider than the hand opens"),
    ("poses_tilted", "beyond the half angle"),
    ("poses_too_low", "without room above the floor"),
    ("poses_rejected_by_ground", "rejected by ground"),
    ("poses_rejected_by_container", "rejected by container"),
    ("poses_rejected_by_neighbour", "rejected by neighbour"),
    ("poses_rejected_by_own_object", "rejected by own object"),
    ("poses_blocked_by_ground", "path blocked by ground"),
    ("poses_blocked_by_container", "path blocked by container"),
    ("poses_blocked_by_own_object", "path blocked by own object"),
    ("poses_blocked_by_neighbour", "path blocked by neighbour"),
];

impl SampledPicks {
    fn of(counts: &Counts) -> Self {
        let obstacles = ["ground", "container", "own_object", "neighbour"];
        Self {
            poses: counts.fact("poses"),
            lost: LOST.iter().map(|(fact, words)| ((*words).to_owned(), counts.fact(fact))).collect(),
            alike: counts.fact("poses_alike"),
            free: counts.fact("free"),
            too_wide: counts.fact("too_wide"),
            palm_only: counts.fact("palm_only"),
            blocked_by: obstacles.map(|obstacle| counts.fact(&format!("blocked_by_{obstacle}"))),
        }
    }

    /// From poses to grasps that held: poses that pass each group of tests, then free, tried and held grasps.
    pub(super) fn funnel(&self, trials: Option<&TriedPicks>) -> Vec<(String, u64)> {
        let lost = |groups: &[&str]| -> u64 {
            let of_group = |(words, _): &&(String, u64)| groups.iter().any(|group| words.starts_with(group));
            self.lost.iter().filter(of_group).map(|(_, count)| count).sum()
        };
        let rejected = lost(&["rejected"]);
        let blocked = lost(&["path"]);
        let posed = self.poses.saturating_sub(lost(&[""]).saturating_sub(rejected + blocked));
        let steps = [
            ("poses", self.poses),
            ("hand fits the pair above the floor", posed),
            ("pass the yes-or-no tests", posed.saturating_sub(rejected)),
            ("unlike the free ones before", posed.saturating_sub(rejected + self.alike)),
            ("free", self.free),
        ];
        let tried = trials.into_iter().flat_map(|trials| [("tried", trials.tried), ("held", trials.held)]);
        steps.into_iter().chain(tried).map(|(step, count)| (step.to_owned(), count)).collect()
    }

    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "  poses     {} drawn", grouped(self.poses))?;
        let alike = ("like a free grasp before".to_owned(), self.alike);
        for (words, count) in self.lost.iter().chain([&alike]).filter(|(_, count)| *count > 0) {
            writeln!(f, "            {:>9} {words} ({})", grouped(*count), share(*count, self.poses))?;
        }
        let blocked = PickObstacle::NAMES.iter().zip(self.blocked_by);
        let blocked = blocked.map(|(name, count)| (format!("mostly blocked by {name}"), count));
        let others = [("too wide for the hand", self.too_wide), ("blocked for the palm alone", self.palm_only)];
        let others = others.map(|(words, count)| (words.to_owned(), count));
        for (words, count) in blocked.chain(others).filter(|(_, count)| *count > 0) {
            writeln!(f, "            {:>9} bodies without a free grasp: {words}", grouped(count))?;
        }
        Ok(())
    }
}

impl TriedPicks {
    /// Trials that lifted the body, whether or not they held it in the end.
    pub(super) fn lifted(&self) -> u64 {
        let lifted = [PickVerdict::Held, PickVerdict::LostHolding, PickVerdict::LetGo];
        lifted.iter().filter_map(|verdict| self.verdicts.get(verdict.name())).sum()
    }
}

impl PickedObject {
    fn add(&mut self, facts: &PickFacts) {
        self.bodies += 1;
        self.candidates += u64::from(facts.candidates);
        self.free += u64::from(facts.free);
        self.lost.iter_mut().zip(facts.lost).for_each(|(all, lost)| *all += u64::from(lost));
        self.trials[0] += u64::from(facts.trials.tried());
        self.trials[1] += u64::from(facts.trials.held());
    }

    /// Cells of a row: name, split, bodies, candidates, free ones, blocked ones by obstacle, tried and held ones.
    pub(super) fn cells(&self) -> Vec<String> {
        let Self { name, split, bodies, candidates, free, lost, trials, .. } = self;
        let counts = [*bodies, *candidates, *free].into_iter().chain(*lost).chain(*trials);
        [name.clone(), split.map_or("", Split::name).to_owned()].into_iter().chain(counts.map(grouped)).collect()
    }
}

/// A share of a count as text.
pub(super) fn share(part: u64, all: u64) -> String {
    percent(part as f64 / all.max(1) as f64)
}

impl PicksInspection {
    /// Candidates by result: free, then blocked by obstacle.
    pub(super) fn ends(&self) -> impl Iterator<Item = (&'static str, u64)> {
        std::iter::once(("free", self.free)).chain(PickObstacle::NAMES.into_iter().zip(self.lost))
    }
}

impl fmt::Display for PicksInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.header.write_names(f)?;
        writeln!(f, "  job       {}", self.header.job)?;
        writeln!(f, "  hand      {}", self.hand.shown())?;
        let kept = share(self.kept, self.samples);
        writeln!(f, "  samples   {} of {} bodies kept ({kept})", grouped(self.kept), grouped(self.samples))?;
        InspectionHeader::write_rejected(f, &self.rejected)?;
        for (split, count) in &self.splits {
            writeln!(f, "            {:>9} {}", grouped(*count), split.name())?;
        }
        writeln!(f, "  scenes    {}", grouped(self.scenes))?;
        writeln!(f, "  bodies    {} with a free grasp", grouped(self.bodies_with_free))?;
        writeln!(f, "  grasps    {} evaluated", grouped(self.candidates))?;
        for (name, count) in self.ends() {
            let words = if name == "free" { "free".to_owned() } else { format!("blocked by {name}") };
            writeln!(f, "            {:>9} {words} ({})", grouped(count), share(count, self.candidates))?;
        }
        let [opened, either] = self.free_opened;
        for (count, words) in
            [(opened, "free if the hand approaches opened"), (either, "free on at least one of the two approaches")]
        {
            writeln!(f, "            {:>9} {words} ({})", grouped(count), share(count, self.candidates))?;
        }
        if let Some(poses) = &self.poses {
            poses.write(f)?;
        }
        if let Some(trials) = &self.trials {
            writeln!(f, "  trials    {} of free grasps", grouped(trials.tried))?;
            for (verdict, count) in &trials.verdicts {
                writeln!(f, "            {:>9} {verdict} ({})", grouped(*count), share(*count, trials.tried))?;
            }
            for (count, words) in [
                (trials.held_touching, "held and also pressed on something else"),
                (trials.held_moving, "held and moved a neighbour by more than 1 cm"),
                (trials.held_carrying, "held and carried a neighbour along"),
            ] {
                writeln!(f, "            {:>9} {words}", grouped(count))?;
            }
        }
        self.header.write_shards(f)?;
        writeln!(f)?;
        let wide = self.objects.iter().map(|object| object.name.chars().count()).max().unwrap_or(0).clamp(6, 40);
        writeln!(
            f,
            "\n{:<wide$}  {:<10} {:>6} {:>10} {:>8} {:>8} {:>9} {:>8} {:>9} {:>6} {:>6}",
            "object",
            "split",
            "bodies",
            "evaluated",
            "free",
            "ground",
            "container",
            "own",
            "neighbour",
            "tried",
            "held"
        )?;
        for object in &self.objects {
            let cells = object.cells();
            write!(f, "{:<wide$}  {:<10}", cells[0].shown(), cells[1])?;
            for (cell, width) in cells[2..].iter().zip([6, 10, 8, 8, 9, 8, 9, 6, 6]) {
                write!(f, " {cell:>width$}")?;
            }
            writeln!(f)?;
        }
        if let Some(speed) = &self.header.notes.speed {
            writeln!(f, "\nspeed: {:.1} bodies/s: {:.1} s on {} threads", speed.rate(), speed.seconds, speed.threads)?;
        }
        self.header.write_warnings(f)
    }
}
