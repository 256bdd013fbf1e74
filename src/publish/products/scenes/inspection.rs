//! The facts of a dataset of scenes: what `inspect` prints.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use super::headline::headline;
use crate::{
    chart::{grouped, percent},
    inspection::{InspectionHeader, evenly, open_of},
    tally::{Spread, SpreadRow},
};
use format::{
    Product, Scene, SceneFacts, SceneMode,
    dataset::{DatasetError, DatasetReader, Fate},
};
use kernel::{
    files::Folder,
    ids::{ObjectId, SampleIndex},
    words::{MAX_DEPTHS, MAX_DRIFT, Show, Split},
};

/// Content of a dataset of scenes. `Display` writes text; serialising gives JSON.
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
    /// Bodies that left their container, in all scenes.
    pub gone: u64,
    /// Kept scenes by number of bodies.
    pub by_bodies: BTreeMap<u32, u64>,
    /// Contacts per kept scene.
    pub contacts: Spread,
    /// Time from the last release to rest of the kept scenes [s].
    pub rest_time: Spread,
    /// Largest overlap of two bodies of each kept scene [m].
    pub depth_bodies: Spread,
    /// Largest overlap of a body and the container of each kept scene [m].
    pub depth_container: Spread,
    /// Largest motion of a centre of mass of each kept scene when it is simulated again from rest [m].
    pub drift: Spread,
    /// Checks of imported scenes, which reject none; `None` for settled scenes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imported: Option<ImportedChecks>,
    /// One row per object, sorted by name.
    pub objects: Vec<SceneObject>,
}

/// Imported scenes that would be rejected if they were settled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImportedChecks {
    /// Scenes in which two bodies, or a body and the table, overlap by more than is allowed.
    pub too_deep: u64,
    /// Scenes in which a body moves by more than is allowed when they are simulated from rest.
    pub moved: u64,
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
    /// Mass [kg], if the dataset states it.
    pub mass: Option<f64>,
}

/// Input of a page, except the pictures.
pub(crate) struct SceneSurvey {
    pub facts: ScenesInspection,
    /// Kept scenes that a page shows.
    pub shown: Vec<SampleIndex>,
}

/// Maximum number of scenes on a page.
const SHOWN: usize = 12;

/// The facts of a finished dataset of scenes: reads tables and ledgers.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_scenes(folder: &Folder) -> Result<ScenesInspection, DatasetError> {
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
        let imported = match kept.first().map(|index| reader.sample(*index)).transpose()?.flatten() {
            Some(first) if first.read::<Scene>()?.mode == SceneMode::Imported => Some(ImportedChecks::of(&facts)),
            _ => None,
        };
        let objects = reader.assets()?.objects.into_iter().map(|row| SceneObject {
            split: reader.splits().object(&row.object).map(|split| split.split),
            mass: row.facts.get("mass").and_then(serde_json::Value::as_f64),
            name: row.name,
            object: row.object,
        });
        let mut objects: Vec<SceneObject> = objects.collect();
        objects.sort_by(|a, b| a.name.cmp(&b.name));
        let facts = ScenesInspection {
            header: InspectionHeader::of(reader, headline(reader)?)?,
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
            imported,
            objects,
        };
        Ok(Self { facts, shown: evenly(&kept, SHOWN) })
    }
}

impl ImportedChecks {
    fn of(scenes: &[SceneFacts]) -> Self {
        let exceeds =
            |values: &[f64; 2], bounds: &[f64; 2]| values.iter().zip(bounds).any(|(value, bound)| value > bound);
        let count = |is_counted: &dyn Fn(&SceneFacts) -> bool| scenes.iter().filter(|scene| is_counted(scene)).count();
        Self {
            too_deep: count(&|scene| exceeds(&scene.depths, &MAX_DEPTHS)) as u64,
            moved: count(&|scene| exceeds(&scene.drift, &MAX_DRIFT)) as u64,
        }
    }

    /// A sentence.
    pub(super) fn words(&self) -> String {
        let [body, table] = MAX_DEPTHS.map(|depth| 1e3 * depth);
        let [drift, turn] = [1e3 * MAX_DRIFT[0], MAX_DRIFT[1].to_degrees()];
        format!(
            "In {} of the scenes bodies overlap by more than {body} mm ({table} mm with the table), and in {} a body moves by {drift} mm or {turn:.0} degrees when they are simulated from rest.",
            grouped(self.too_deep),
            grouped(self.moved)
        )
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
        if let Some(imported) = &self.imported {
            writeln!(f, "  imported  {}", imported.words())?;
        }
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
            writeln!(f, "{:<wide$}  {mass:>9}  {}", name.shown(), split.map_or("", Split::name))?;
        }
        if let Some(speed) = &self.header.notes.speed {
            writeln!(f, "\nspeed: {:.1} scenes/s: {:.1} s on {} threads", speed.rate(), speed.seconds, speed.threads)?;
        }
        self.header.write_warnings(f)
    }
}
