//! The facts of a dataset of views: what `inspect` prints.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use super::{headline::headline, nearness::nearness_warning};
use crate::{
    chart::{grouped, percent},
    inspection::{InspectionHeader, evenly, open_of},
    scene_objects::ScenesObject,
};
use format::{
    Product,
    dataset::{DatasetError, DatasetReader, Fate},
};
use kernel::{files::Folder, ids::SampleIndex, words::Split};

/// Content of a dataset of views. `Display` writes text; serialising gives JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewsInspection {
    /// Facts that the inspections of all products share.
    #[serde(flatten)]
    pub header: InspectionHeader,
    /// Scenes of the views.
    pub scenes: u64,
    /// Views: kept + rejected.
    pub samples: u64,
    /// Kept views.
    pub kept: u64,
    /// Kept views by split.
    pub splits: BTreeMap<Split, u64>,
    /// Rejected views by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Bodies of the kept views, counted in each view.
    pub bodies: u64,
    /// Bodies by visible share, smallest first: name and count.
    pub strata: Vec<(String, u64)>,
    /// Bodies that extend beyond the image.
    pub truncated: u64,
    /// Bodies with at least half of their visible pixels nearer than the sensor's range.
    pub too_near: u64,
    /// Cameras that were resampled because something was too close.
    pub near_draws: u64,
    /// Cameras that were resampled because they saw too little.
    pub unseen_draws: u64,
    /// One row per object, sorted by name.
    pub objects: Vec<ScenesObject>,
}

/// Input of a page, except the pictures.
pub(crate) struct ViewSurvey {
    pub facts: ViewsInspection,
    /// Kept views that a page shows.
    pub shown: Vec<SampleIndex>,
}

/// Maximum number of views on a page.
const SHOWN: usize = 12;

/// Strata of visibility: the fact that counts each, and its text.
const STRATA: [(&str, &str); 5] = [
    ("unseen", "unseen"),
    ("hidden", "seen by less than 10 %"),
    ("mostly_hidden", "seen by 10 to 50 %"),
    ("partly_hidden", "seen by 50 to 90 %"),
    ("clear", "seen by 90 % or more"),
];

/// The facts of a finished dataset of views: reads tables and ledgers.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_views(folder: &Folder) -> Result<ViewsInspection, DatasetError> {
    Ok(ViewSurvey::of(&open_of(folder, Product::VIEWS)?)?.facts)
}

impl ViewSurvey {
    /// Reads the ledgers of a dataset, one at a time.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let mut kept = Vec::new();
        for shard in 0..manifest.shards.len() {
            let rows = reader.ledger(shard)?.rows;
            kept.extend(rows.iter().filter(|row| matches!(row.fate, Fate::Kept(_))).map(|row| row.index));
        }
        let assets = reader.assets()?;
        let counts = &manifest.counts;
        let mut header = InspectionHeader::of(reader, headline(reader)?)?;
        header.warnings.extend(nearness_warning(reader)?);
        let facts = ViewsInspection {
            header,
            scenes: assets.subjects.len() as u64,
            samples: counts.samples,
            kept: counts.kept,
            splits: counts.splits.clone(),
            rejected: counts.rejected.clone(),
            bodies: counts.fact("bodies"),
            strata: STRATA.map(|(fact, words)| (words.to_owned(), counts.fact(fact))).to_vec(),
            truncated: counts.fact("truncated"),
            too_near: counts.fact("too_near"),
            near_draws: counts.fact("near_draws"),
            unseen_draws: counts.fact("unseen_draws"),
            objects: ScenesObject::all(reader)?,
        };
        Ok(Self { facts, shown: evenly(&kept, SHOWN) })
    }
}

impl ViewsInspection {
    /// Rows by visible share: text, count, share.
    pub(super) fn stratum_rows(&self) -> Vec<[String; 3]> {
        let share = |count: u64| percent(count as f64 / self.bodies.max(1) as f64);
        let row = |(words, count): &(String, u64)| [words.clone(), grouped(*count), share(*count)];
        self.strata.iter().map(row).collect()
    }
}

impl fmt::Display for ViewsInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.header.write_names(f)?;
        writeln!(f, "  job       {}", self.header.job)?;
        let share = percent(self.kept as f64 / self.samples.max(1) as f64);
        writeln!(f, "  samples   {} of {} views kept ({share})", grouped(self.kept), grouped(self.samples))?;
        InspectionHeader::write_rejected(f, &self.rejected)?;
        for (split, count) in &self.splits {
            writeln!(f, "            {:>9} {}", grouped(*count), split.name())?;
        }
        let [near, unseen] = [self.near_draws, self.unseen_draws].map(grouped);
        writeln!(f, "  scenes    {}", grouped(self.scenes))?;
        writeln!(f, "  cameras   resampled: {near} too close to something, {unseen} that saw too little")?;
        let [bodies, truncated] = [self.bodies, self.truncated].map(grouped);
        writeln!(f, "  bodies    {bodies} in all views, {truncated} of them extend beyond the image")?;
        if self.too_near > 0 {
            writeln!(f, "            {:>9} at least half nearer than the sensor's range", grouped(self.too_near))?;
        }
        for [words, count, share] in self.stratum_rows() {
            writeln!(f, "            {count:>9} {words} ({share})")?;
        }
        self.header.write_shards(f)?;
        writeln!(f)?;
        ScenesObject::write_all(&self.objects, f)?;
        if let Some(speed) = &self.header.notes.speed {
            writeln!(f, "\nspeed: {:.1} views/s: {:.1} s on {} threads", speed.rate(), speed.seconds, speed.threads)?;
        }
        self.header.write_warnings(f)
    }
}
