//! The facts of a dataset of patches, from its tables and ledgers.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use crate::{
    chart::{grouped, percent},
    grasp_types::TypeFacts,
    headline::{count_kept, stored_samples},
    inspection::{InspectionHeader, open_of},
    tally::{Spread, SpreadRow},
};
use format::{
    Channel, GraspLabel, HeatmapPatch, PATCH_POINTS, PatchFacts, Product,
    dataset::{DatasetError, DatasetReader, Fate, Manifest},
    extras::read_types,
};
use kernel::{
    files::Folder,
    ids::{Digest, ObjectId, SampleIndex},
    words::{GraspTypeCounts, Show},
};

/// Content of a dataset of patches. `Display` writes text; serialising gives JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PatchesInspection {
    /// Facts that the inspections of all products share.
    #[serde(flatten)]
    pub header: InspectionHeader,
    /// Root digest of the exact numbers of the grasps; `None` if no sample was kept.
    pub grasps: Option<Digest>,
    /// The hand.
    pub hand: Option<String>,
    /// Selectable grasps of that dataset, of any type or none: the kept ones, or the tried ones if labels come from trials.
    pub kept_grasps: u64,
    /// Number of different types among them.
    pub different_types: u64,
    /// Selectable grasps without a type.
    pub without_type: u64,
    /// Grasps of the chosen types: kept + rejected.
    pub samples: u64,
    /// Stored samples, of four patches each.
    pub kept: u64,
    /// Grasps that were not stored, by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Whether patches also have colours.
    pub colour: bool,
    /// Stored samples by label; `None` if labels do not come from trials.
    pub outcomes: Option<BTreeMap<String, u64>>,
    /// Visible points of the stored samples; `None` if points are not marked.
    pub visible_points: Option<u64>,
    /// The chosen types, the most common first.
    pub types: Vec<ChosenType>,
    /// Epsilon of the stored samples.
    pub epsilon: Spread,
    /// Energy of the stored samples.
    pub energy: Spread,
    /// One row per object, sorted by name.
    pub objects: Vec<PatchObjectFacts>,
}

/// One of the chosen types.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChosenType {
    /// The type, with the number of its kept grasps in the dataset of grasps.
    #[serde(flatten)]
    pub facts: TypeFacts,
    /// Stored samples of the type.
    pub kept: u64,
}

/// One object.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PatchObjectFacts {
    /// Name in the job for grasps.
    pub name: String,
    /// The object by content.
    pub object: ObjectId,
    /// Number of the object's grasps of the chosen types.
    pub samples: u64,
    /// Stored grasps.
    pub kept: u64,
}

/// Input of a page, except the pictures.
pub(crate) struct PatchSurvey {
    pub facts: PatchesInspection,
    /// Epsilons of the stored samples.
    pub epsilons: Vec<f64>,
    /// For each chosen type the stored samples with the highest epsilon, best first, of different objects; those that held come
    /// before all others.
    pub picks: Vec<Vec<SampleIndex>>,
}

/// Samples per type on the page.
const SHOWN: usize = 3;

/// The facts of a finished dataset of patches: reads tables, ledgers and one sample.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_patches(folder: &Folder) -> Result<PatchesInspection, DatasetError> {
    Ok(PatchSurvey::of(&open_of(folder, Product::PATCHES)?)?.facts)
}

/// Sums of one pass over the ledgers.
#[derive(Default)]
struct Pass {
    objects: BTreeMap<ObjectId, [u64; 2]>,
    types: BTreeMap<u32, u64>,
    epsilons: Vec<f64>,
    energies: Vec<f64>,
    /// Stored samples by label from trials.
    outcomes: BTreeMap<GraspLabel, u64>,
    visible: u64,
    /// The best stored sample of each chosen type and object: whether it held, and its epsilon.
    best: BTreeMap<(u32, ObjectId), ((bool, f64), SampleIndex)>,
    first: Option<SampleIndex>,
}

impl Pass {
    fn keep(&mut self, object: ObjectId, index: SampleIndex, facts: &PatchFacts) {
        *self.types.entry(facts.kind).or_default() += 1;
        self.epsilons.push(facts.epsilon);
        self.energies.push(facts.energy);
        self.first.get_or_insert(index);
        if let Some(outcome) = facts.outcome {
            *self.outcomes.entry(outcome).or_default() += 1;
        }
        self.visible += u64::from(facts.visible);
        let rating = (facts.outcome == Some(GraspLabel::Held), facts.epsilon);
        let best = self.best.entry((facts.type_index, object)).or_insert((rating, index));
        if rating > best.0 {
            *best = (rating, index);
        }
    }

    fn picks(&self, types: usize) -> Vec<Vec<SampleIndex>> {
        let mut picks = vec![Vec::new(); types];
        for ((type_index, _), best) in &self.best {
            if let Some(picks) = picks.get_mut(*type_index as usize) {
                picks.push(*best);
            }
        }
        let mut picks: Vec<Vec<((bool, f64), SampleIndex)>> = picks;
        picks.iter_mut().for_each(|picks| {
            picks.sort_by(|a, b| b.0.0.cmp(&a.0.0).then(b.0.1.total_cmp(&a.0.1)).then(a.1.cmp(&b.1)));
            picks.truncate(SHOWN);
        });
        picks.into_iter().map(|picks| picks.into_iter().map(|(_, index)| index).collect()).collect()
    }
}

impl PatchSurvey {
    /// Reads the ledgers of a dataset, one at a time.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let mut pass = Pass::default();
        for shard in 0..manifest.shards.len() {
            for row in reader.ledger(shard)?.rows {
                let kept = matches!(row.fate, Fate::Kept(_));
                let [samples, stored] = pass.objects.entry(row.sample.subject).or_default();
                *samples += 1;
                *stored += u64::from(kept);
                if kept {
                    pass.keep(row.sample.subject, row.index, &PatchFacts::from(&row.facts));
                }
            }
        }
        let facts = facts(reader, &pass)?;
        let picks = pass.picks(facts.types.len());
        Ok(Self { facts, epsilons: pass.epsilons, picks })
    }
}

fn facts(reader: &DatasetReader, pass: &Pass) -> Result<PatchesInspection, DatasetError> {
    let manifest = reader.manifest();
    let types = read_types(reader.folder())?;
    let first = match pass.first {
        Some(index) => reader.sample(index)?.map(|sample| sample.read::<HeatmapPatch>()).transpose()?,
        None => None,
    };
    let mut objects: Vec<PatchObjectFacts> = Vec::new();
    for row in reader.assets()?.objects {
        let [samples, kept] = pass.objects.get(&row.object).copied().unwrap_or_default();
        objects.push(PatchObjectFacts { name: row.name, object: row.object, samples, kept });
    }
    objects.sort_by(|a, b| a.name.cmp(&b.name));
    let GraspTypeCounts { counts, without, chosen } = &types;
    let of_type = |kind: &u32| ChosenType {
        facts: TypeFacts::new(*kind, [counts.get(kind).copied().unwrap_or(0), 0]),
        kept: pass.types.get(kind).copied().unwrap_or(0),
    };
    Ok(PatchesInspection {
        header: InspectionHeader::of(reader, headline(reader)?)?,
        grasps: first.as_ref().map(|patch| patch.grasps),
        hand: first.map(|patch| patch.hand),
        kept_grasps: types.grasps(),
        different_types: counts.len() as u64,
        without_type: *without,
        samples: manifest.counts.samples,
        kept: manifest.counts.kept,
        rejected: manifest.counts.rejected.clone(),
        colour: manifest.channels().contains(&Channel::PATCH_COLOUR),
        outcomes: is_by_trials(manifest).then(|| {
            let count = |label| pass.outcomes.get(&label).copied().unwrap_or_default();
            GraspLabel::ALL.into_iter().map(|label| (label.name().to_owned(), count(label))).collect()
        }),
        visible_points: manifest.channels().contains(&Channel::PATCH_VISIBILITY).then_some(pass.visible),
        types: chosen.iter().map(of_type).collect(),
        epsilon: Spread::of(pass.epsilons.clone()),
        energy: Spread::of(pass.energies.clone()),
        objects,
    })
}

/// Stored grasps, and the outcomes of their trials.
pub(super) fn headline(reader: &DatasetReader) -> Result<String, DatasetError> {
    let manifest = reader.manifest();
    let patched = stored_samples(reader)?;
    if !is_by_trials(manifest) {
        return Ok(patched);
    }
    let with_label = |label: GraspLabel| count_kept(reader, |row| PatchFacts::from(&row.facts).outcome == Some(label));
    let [held, failed] = [with_label(GraspLabel::Held)?, with_label(GraspLabel::Failed)?].map(grouped);
    Ok(format!("{patched}: {held} held, {failed} failed"))
}

/// Whether the labels of a dataset come from trials.
pub(super) fn is_by_trials(manifest: &Manifest) -> bool {
    manifest.channels().contains(&Channel::PATCH_TRIAL)
}

/// Line with the number of chosen types, and the share of grasps that they cover.
pub(super) fn types_in_words(types: &GraspTypeCounts, is_by_trials: bool) -> String {
    format!(
        "{} of {} {} grasps are of the {} most common of {} types: {}",
        grouped(types.covered()),
        grouped(types.grasps()),
        if is_by_trials { "tried" } else { "kept" },
        types.chosen.len(),
        grouped(types.counts.len() as u64),
        percent(types.covered() as f64 / types.grasps().max(1) as f64),
    )
}

impl fmt::Display for PatchesInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.header.write_names(f)?;
        writeln!(f, "  job       {}", self.header.job)?;
        for (name, value) in [("hand", self.hand.clone()), ("grasps", self.grasps.map(|root| root.to_string()))] {
            if let Some(value) = value {
                writeln!(f, "  {name:<9} {}", value.shown())?;
            }
        }
        let [all, samples, kept] = [self.kept_grasps, self.samples, self.kept].map(grouped);
        writeln!(f, "  samples   {kept} of {samples} grasps of the chosen types, {all} of any")?;
        InspectionHeader::write_rejected(f, &self.rejected)?;
        writeln!(f, "  colour    {}", if self.colour { "yes" } else { "no" })?;
        if let Some(outcomes) = &self.outcomes {
            let counts = outcomes.iter().map(|(label, count)| format!("{} {label}", grouped(*count)));
            writeln!(f, "  labels    {}", counts.collect::<Vec<_>>().join(", "))?;
        }
        if let Some(visible) = self.visible_points {
            let points = PATCH_POINTS as u64 * self.kept;
            let share = percent(visible as f64 / points.max(1) as f64);
            writeln!(f, "  points    {} of {} visible: {share}", grouped(visible), grouped(points))?;
        }
        self.header.write_shards(f)?;
        writeln!(f)?;
        writeln!(f, "\n                         min        5 %     median       95 %        max       mean")?;
        for (name, spread) in [("epsilon", &self.epsilon), ("energy", &self.energy)] {
            writeln!(f, "{}", SpreadRow::new(name, 4, spread))?;
        }
        writeln!(f, "\ntype      grasps     kept  of all  spread  proximal  distal  roll")?;
        for ChosenType { facts: TypeFacts { kind, grasps, digits, .. }, kept } in &self.types {
            let [spread, a, b, c, d, e, g, roll] = digits;
            let share = percent(*grasps as f64 / self.kept_grasps.max(1) as f64);
            let [grasps, kept] = [*grasps, *kept].map(grouped);
            write!(f, "{kind:>6} {grasps:>9} {kept:>8}  {share:>6}  {spread:>6}  ")?;
            writeln!(f, "{a:>4} {b} {c}  {d:>2} {e} {g}  {roll:>4}")?;
        }
        let wide = self.objects.iter().map(|object| object.name.chars().count()).max().unwrap_or(0).clamp(6, 40);
        writeln!(f, "\n{:<wide$}   grasps     kept", "object")?;
        for PatchObjectFacts { name, samples, kept, .. } in &self.objects {
            let [samples, kept] = [*samples, *kept].map(grouped);
            writeln!(f, "{:<wide$}  {samples:>7}  {kept:>7}", name.shown())?;
        }
        if let Some(speed) = &self.header.notes.speed {
            writeln!(f, "\nspeed: {:.1} grasps/s: {:.1} s on {} threads", speed.rate(), speed.seconds, speed.threads)?;
        }
        self.header.write_warnings(f)
    }
}
