//! The facts of a dataset of scenes: what `inspect` prints.

use std::{collections::BTreeMap, fmt, path::Path};

use serde::{Deserialize, Serialize};

use crate::{
    chart::{grouped, percent},
    inspection::{InspectionHeader, evenly, open_of},
    tally::{Spread, SpreadRow},
};
use format::{
    Product, SceneFacts,
    dataset::{DatasetError, DatasetReader, Fate},
};
use kernel::{
    ids::{ObjectId, SampleIndex},
    words::Split,
};

/// Content of a dataset of scenes. `Display` is for people; serialised, it is for machines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScenesInspection {
    /// Facts that the inspections of all products share.
    #[serde(flatten)]
    pub header: InspectionHeader,
    /// Scenes: kept + rejected.
    pub samples: u64,
    /// Kept scenes.
    pub kept: u64,
    /// Kept scenes by split.
    pub splits: BTreeMap<Split, u64>,
    /// Rejected scenes by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Bodies of the kept scenes.
    pub bodies: u64,
    /// Bodies that left their container, of all scenes.
    pub gone: u64,
    /// Kept scenes by their count of bodies.
    pub by_bodies: BTreeMap<u32, u64>,
    /// Contacts per kept scene.
    pub contacts: Spread,
    /// Time from the last release to rest of the kept scenes [s].
    pub rest_time: Spread,
    /// Largest overlap of two bodies of each kept scene [m].
    pub depth_bodies: Spread,
    /// Largest overlap of a body and the container of each kept scene [m].
    pub depth_container: Spread,
    /// Largest motion of a centre of mass of each kept scene when it is stepped again from rest [m].
    pub drift: Spread,
    /// One row per object, sorted by name.
    pub objects: Vec<SceneObject>,
}

/// One object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneObject {
    /// Name in the job.
    pub name: String,
    /// The object by content.
    pub object: ObjectId,
    /// Split of its scenes.
    pub split: Option<Split>,
    /// Mass [kg], where the dataset says it.
    pub mass: Option<f64>,
}

/// Everything that a page needs but the pictures.
pub(crate) struct SceneSurvey {
    pub facts: ScenesInspection,
    /// Kept scenes that a page shows.
    pub shown: Vec<SampleIndex>,
}

/// Scenes that a page shows, at most.
const SHOWN: usize = 12;

/// The facts of a finished dataset of scenes: reads tables and ledgers.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_scenes(folder: &Path) -> Result<ScenesInspection, DatasetError> {
    Ok(SceneSurvey::of(&open_of(folder, Product::SCENES)?)?.facts)
}

impl SceneSurvey {
    /// Reads the ledgers of a dataset, one at a time.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let (mut kept, mut facts, mut by_bodies) = (Vec::new(), Vec::new(), BTreeMap::<u32, u64>::new());
        for shard in 0..manifest.shards.len() {
            for row in reader.ledger(shard)?.rows.iter().filter(|row| matches!(row.fate, Fate::Kept(_))) {
                let scene = SceneFacts::from(&row.facts);
                *by_bodies.entry(scene.bodies).or_default() += 1;
                kept.push(row.index);
                facts.push(scene);
            }
        }
        let spread = |of: fn(&SceneFacts) -> f64| Spread::of(facts.iter().map(of).collect());
        let objects = reader.assets()?.objects.into_iter().map(|row| SceneObject {
            split: reader.splits().object(&row.object).map(|split| split.split),
            mass: row.facts.get("mass").and_then(serde_json::Value::as_f64),
            name: row.name,
            object: row.object,
        });
        let mut objects: Vec<SceneObject> = objects.collect();
        objects.sort_by(|a, b| a.name.cmp(&b.name));
        let facts = ScenesInspection {
            header: InspectionHeader::of(reader)?,
            samples: manifest.counts.samples,
            kept: manifest.counts.kept,
            splits: manifest.counts.splits.clone(),
            rejected: manifest.counts.rejected.clone(),
            bodies: facts.iter().map(|scene| u64::from(scene.bodies)).sum(),
            gone: manifest.counts.fact("gone"),
            by_bodies,
            contacts: spread(|scene| f64::from(scene.contacts)),
            rest_time: spread(|scene| scene.rest_time),
            depth_bodies: spread(|scene| scene.depths[0]),
            depth_container: spread(|scene| scene.depths[1]),
            drift: spread(|scene| scene.drift[0]),
            objects,
        };
        Ok(Self { facts, shown: evenly(&kept, SHOWN) })
    }
}

impl ScenesInspection {
    /// Spreads of the kept scenes, lengths in millimetres.
    pub(super) fn spreads(&self) -> Vec<SpreadRow> {
        let millimetres = |spread: &Spread| {
            let Spread { min, p05, median, p95, max, mean } = *spread;
            let [min, p05, median, p95, max, mean] = [min, p05, median, p95, max, mean].map(|value| 1e3 * value);
            Spread { min, p05, median, p95, max, mean }
        };
        vec![
            SpreadRow::new("contacts", 0, &self.contacts),
            SpreadRow::new("time to rest, s", 2, &self.rest_time),
            SpreadRow::new("body in body, mm", 3, &millimetres(&self.depth_bodies)),
            SpreadRow::new("in container, mm", 3, &millimetres(&self.depth_container)),
            SpreadRow::new("drift, mm", 3, &millimetres(&self.drift)),
        ]
    }
}

impl fmt::Display for ScenesInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.header.write_names(f)?;
        writeln!(f, "  job       {}", self.header.job)?;
        let share = percent(self.kept as f64 / self.samples.max(1) as f64);
        writeln!(f, "  samples   {} of {} scenes kept ({share})", grouped(self.kept), grouped(self.samples))?;
        InspectionHeader::write_rejected(f, &self.rejected)?;
        for (split, count) in &self.splits {
            writeln!(f, "            {:>9} {}", grouped(*count), split.name())?;
        }
        let [bodies, gone] = [self.bodies, self.gone].map(grouped);
        writeln!(f, "  bodies    {bodies}; {gone} left their container")?;
        self.header.write_shards(f)?;
        writeln!(f)?;
        writeln!(f, "\n                            min        5 %     median       95 %        max       mean")?;
        for row in self.spreads() {
            writeln!(f, "{row}")?;
        }
        let wide = self.objects.iter().map(|object| object.name.chars().count()).max().unwrap_or(0).clamp(6, 40);
        writeln!(f, "\n{:<wide$}   mass, kg  split", "object")?;
        for SceneObject { name, split, mass, .. } in &self.objects {
            let mass = mass.map_or_else(String::new, |mass| format!("{mass:.3}"));
            writeln!(f, "{name:<wide$}  {mass:>9}  {}", split.map_or("", Split::name))?;
        }
        if let Some(speed) = &self.header.notes.speed {
            writeln!(f, "\nspeed: {:.1} scenes/s: {:.1} s on {} threads", speed.rate(), speed.seconds, speed.threads)?;
        }
        self.header.write_warnings(f)
    }
}
