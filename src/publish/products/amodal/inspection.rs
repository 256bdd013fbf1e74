//! The facts of a dataset of amodal pairs: what `inspect` prints.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use super::headline::headline;
use crate::{
    chart::{grouped, percent},
    inspection::{InspectionHeader, evenly, open_of},
    scene_objects::ScenesObject,
    tally::{Spread, SpreadRow, Tally},
    touch::TouchFacts,
};
use format::{
    AmodalFacts, Product,
    dataset::{DatasetError, DatasetReader, Fate},
};
use kernel::{files::Folder, ids::SampleIndex, words::Split};

/// Content of a dataset of amodal pairs. `Display` writes text; serialising gives JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AmodalInspection {
    /// Facts that the inspections of all products share.
    #[serde(flatten)]
    pub header: InspectionHeader,
    /// Scenes of the bodies.
    pub scenes: u64,
    /// Bodies in views: kept + rejected.
    pub samples: u64,
    /// Kept pairs.
    pub kept: u64,
    /// Kept pairs by split.
    pub splits: BTreeMap<Split, u64>,
    /// Rejected bodies by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Bodies in views by visible share, smallest first: text, bodies, kept pairs.
    pub strata: Vec<(String, u64, u64)>,
    /// Kept pairs whose body extends beyond the image.
    pub truncated: u64,
    /// Occupied cells of the partial grids.
    pub partial_cells: Spread,
    /// Occupied cells of the complete grids.
    pub complete_cells: Spread,
    /// Visible shares of the silhouettes.
    pub visible_share: Spread,
    /// Shares of the solids inside the grids.
    pub solid_share: Spread,
    /// Shares of the points that were measured on the bodies.
    pub purity: Spread,
    /// Cells that meet another body, container or table.
    pub others_solid_cells: Spread,
    /// Facts of touch; `None` without touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub touch: Option<TouchFacts>,
    /// One row per object, sorted by name.
    pub objects: Vec<ScenesObject>,
}

/// Input of a page, except the pictures.
pub(crate) struct AmodalSurvey {
    pub facts: AmodalInspection,
    /// Kept pairs that a page shows.
    pub shown: Vec<SampleIndex>,
}

/// Maximum number of pairs on a page.
const SHOWN: usize = 12;

/// Strata of visibility: upper bound of the visible share, and text.
const STRATA: [(f64, &str); 5] = [
    (f64::MIN_POSITIVE, "unseen"),
    (0.1, "seen by less than 10 %"),
    (0.5, "seen by 10 to 50 %"),
    (0.9, "seen by 50 to 90 %"),
    (f64::INFINITY, "seen by 90 % or more"),
];

/// The facts of a finished dataset of amodal pairs: reads tables and ledgers; with touch some samples.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_amodal(folder: &Folder) -> Result<AmodalInspection, DatasetError> {
    Ok(AmodalSurvey::of(&open_of(folder, Product::AMODAL)?)?.facts)
}

/// Distributions of the kept pairs.
struct Tallies {
    partial: Tally,
    complete: Tally,
    visible: Tally,
    solid: Tally,
    purity: Tally,
    others: Tally,
}

impl Tallies {
    fn new() -> Self {
        let (cells, shares) = (|| Tally::with_step(1.0), || Tally::with_step(1e-3));
        Self {
            partial: cells(),
            complete: cells(),
            visible: shares(),
            solid: shares(),
            purity: shares(),
            others: cells(),
        }
    }

    fn add(&mut self, facts: &AmodalFacts) {
        self.partial.add(f64::from(facts.partial_cells));
        self.complete.add(f64::from(facts.complete_cells));
        self.visible.add(facts.visible_share);
        self.solid.add(facts.solid_share);
        self.purity.add(facts.purity);
        self.others.add(f64::from(facts.others_solid_cells));
    }
}

impl AmodalSurvey {
    /// Reads the ledgers of a dataset, one at a time.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let (mut kept, mut tallies) = (Vec::new(), Tallies::new());
        let mut strata = STRATA.map(|(_, words)| (words.to_owned(), 0, 0));
        for shard in 0..manifest.shards.len() {
            for row in reader.ledger(shard)?.rows {
                let facts = AmodalFacts::from(&row.facts);
                let stratum = STRATA.iter().position(|(below, _)| facts.visible_share < *below).unwrap_or(0);
                strata[stratum].1 += 1;
                if matches!(row.fate, Fate::Kept(_)) {
                    strata[stratum].2 += 1;
                    kept.push(row.index);
                    tallies.add(&facts);
                }
            }
        }
        let assets = reader.assets()?;
        let counts = &manifest.counts;
        let facts = AmodalInspection {
            header: InspectionHeader::of(reader, headline(reader)?)?,
            scenes: assets.subjects.len() as u64,
            samples: counts.samples,
            kept: counts.kept,
            splits: counts.splits.clone(),
            rejected: counts.rejected.clone(),
            strata: strata.to_vec(),
            truncated: counts.fact("truncated"),
            partial_cells: tallies.partial.spread(),
            complete_cells: tallies.complete.spread(),
            visible_share: tallies.visible.spread(),
            solid_share: tallies.solid.spread(),
            purity: tallies.purity.spread(),
            others_solid_cells: tallies.others.spread(),
            touch: TouchFacts::of(reader)?,
            objects: ScenesObject::all(reader)?,
        };
        Ok(Self { facts, shown: evenly(&kept, SHOWN) })
    }
}

impl AmodalInspection {
    /// Rows by visible share: text, bodies, kept pairs, share kept.
    pub(super) fn stratum_rows(&self) -> Vec<[String; 4]> {
        let row = |(words, bodies, kept): &(String, u64, u64)| {
            [words.clone(), grouped(*bodies), grouped(*kept), percent(*kept as f64 / (*bodies).max(1) as f64)]
        };
        self.strata.iter().map(row).collect()
    }

    /// Rows of the distributions of kept pairs.
    pub(super) fn spread_rows(&self) -> Vec<SpreadRow> {
        vec![
            SpreadRow::new("partial cells", 0, &self.partial_cells),
            SpreadRow::new("complete cells", 0, &self.complete_cells),
            SpreadRow::new("visible share", 3, &self.visible_share),
            SpreadRow::new("solid in the grid", 3, &self.solid_share),
            SpreadRow::new("purity", 3, &self.purity),
            SpreadRow::new("others' cells", 0, &self.others_solid_cells),
        ]
    }
}

impl fmt::Display for AmodalInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.header.write_names(f)?;
        writeln!(f, "  job       {}", self.header.job)?;
        let share = percent(self.kept as f64 / self.samples.max(1) as f64);
        writeln!(f, "  samples   {} of {} bodies in views kept ({share})", grouped(self.kept), grouped(self.samples))?;
        InspectionHeader::write_rejected(f, &self.rejected)?;
        for (split, count) in &self.splits {
            writeln!(f, "            {:>9} {}", grouped(*count), split.name())?;
        }
        writeln!(f, "  scenes    {}", grouped(self.scenes))?;
        writeln!(f, "  bodies    {} of the kept ones extend beyond the image", grouped(self.truncated))?;
        for [words, bodies, kept, share] in self.stratum_rows() {
            writeln!(f, "            {bodies:>9} {words}, {kept} kept ({share})")?;
        }
        self.header.write_shards(f)?;
        writeln!(f)?;
        writeln!(
            f,
            "\n  {:<18} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}",
            "", "min", "5 %", "median", "95 %", "max", "mean"
        )?;
        for row in self.spread_rows() {
            writeln!(f, "{row}")?;
        }
        if let Some(touch) = &self.touch {
            writeln!(f, "{touch}")?;
        }
        ScenesObject::write_all(&self.objects, f)?;
        if let Some(speed) = &self.header.notes.speed {
            writeln!(f, "\nspeed: {:.1} samples/s: {:.1} s on {} threads", speed.rate(), speed.seconds, speed.threads)?;
        }
        self.header.write_warnings(f)
    }
}
