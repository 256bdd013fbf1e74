//! One pass over a dataset: facts, distributions and the samples to show.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

use super::{
    gallery::{Candidates, Pick},
    inspection::{CompletionInspection, CompletionObjectFacts, Setup, SplitFacts},
};
use crate::{
    headline::stored_samples,
    inspection::{InspectionHeader, job_table, open_of},
    tally::Tally,
    touch::TouchFacts,
};
use format::{
    Channel, PairFacts, Product, VoxelPair,
    dataset::{AssetRow, DatasetError, DatasetReader, Fate, LedgerRow, Selection},
};
use kernel::{
    files::Folder,
    ids::{Digest, ObjectId},
    words::Split,
};

/// Profile of a job's sensor if depth has no noise.
const PERFECT_SENSOR: &str = "none";

/// Input of a report, except the pictures.
pub(crate) struct CompletionSurvey {
    pub facts: CompletionInspection,
    pub partial: Tally,
    pub complete: Tally,
    pub ratio: Tally,
    pub solid: Tally,
    pub ratio_of_split: BTreeMap<Split, Tally>,
    pub picks: Vec<Pick>,
}

/// Sums of one object during the pass.
#[derive(Default)]
struct ObjectSums {
    planned: u64,
    kept: u64,
    rejected: BTreeMap<String, u64>,
    partial: f64,
    ratio: f64,
    min_solid: Option<f64>,
}

/// Sums of one pass over the ledgers.
struct Pass {
    partial: Tally,
    complete: Tally,
    ratio: Tally,
    solid: Tally,
    hidden: Tally,
    occluded: u64,
    ratio_of_split: BTreeMap<Split, Tally>,
    objects_of_split: BTreeMap<Split, std::collections::BTreeSet<ObjectId>>,
    objects: BTreeMap<ObjectId, ObjectSums>,
    candidates: Candidates,
}

impl Pass {
    fn new() -> Self {
        Self {
            partial: Tally::with_step(1.0),
            complete: Tally::with_step(1.0),
            ratio: Tally::with_step(1e-3),
            solid: Tally::with_step(1e-3),
            hidden: Tally::with_step(1e-3),
            occluded: 0,
            ratio_of_split: BTreeMap::new(),
            objects_of_split: BTreeMap::new(),
            objects: BTreeMap::new(),
            candidates: Candidates::default(),
        }
    }

    fn row(&mut self, row: &LedgerRow, split: Split) {
        let sums = self.objects.entry(row.sample.subject).or_default();
        sums.planned += 1;
        if let Fate::Rejected { reason, .. } = &row.fate {
            match sums.rejected.get_mut(reason) {
                Some(count) => *count += 1,
                None => _ = sums.rejected.insert(reason.clone(), 1),
            }
            return;
        }
        let facts = &PairFacts::from(&row.facts);
        let (partial, complete) = (f64::from(facts.partial_cells), f64::from(facts.complete_cells));
        let (ratio, solid) = (partial / complete.max(1.0), facts.solid_share);
        sums.kept += 1;
        sums.partial += partial;
        sums.ratio += ratio;
        sums.min_solid = Some(sums.min_solid.map_or(solid, |min| min.min(solid)));
        self.partial.add(partial);
        self.complete.add(complete);
        self.ratio.add(ratio);
        self.solid.add(solid);
        if facts.occlusion.occluded > 0 {
            self.hidden.add(facts.occlusion.hidden_share);
            self.occluded += 1;
        }
        self.ratio_of_split.entry(split).or_insert_with(|| Tally::with_step(1e-3)).add(ratio);
        self.objects_of_split.entry(split).or_default().insert(row.sample.subject);
        self.candidates.offer(row, facts, split);
    }
}

impl CompletionSurvey {
    /// Reads the tables and every ledger once, and decodes the first kept sample.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let mut pass = Pass::new();
        for shard in 0..manifest.shards.len() {
            for row in reader.ledger(shard)?.rows {
                pass.row(&row, reader.split(row.index).unwrap_or(Split::Training));
            }
        }
        let assets = reader.assets()?;
        let mut objects: Vec<CompletionObjectFacts> =
            assets.objects.iter().map(|row| object_facts(reader, row, &pass)).collect();
        objects.sort_by(|a, b| a.name.cmp(&b.name));
        let names: Vec<(ObjectId, &str)> = objects.iter().map(|facts| (facts.object, facts.name.as_str())).collect();
        let picks = pass.candidates.picks(pass.partial.quantile(0.5) as u32, &names);
        let splits = Split::ALL.into_iter().map(|split| SplitFacts {
            split,
            samples: manifest.counts.splits.get(&split).copied().unwrap_or(0),
            objects: pass.objects_of_split.get(&split).map_or(0, |objects| objects.len() as u64),
            seen_ratio: pass.ratio_of_split.get(&split).map(Tally::spread).unwrap_or_default(),
        });
        let job = job_table(reader)?;
        let word = |table: &str, key: &str| job.get(table)?.get(key)?.as_str().map(str::to_owned);
        let facts = CompletionInspection {
            header: InspectionHeader::of(reader, stored_samples(reader)?)?,
            channels: manifest.channels().into_iter().map(|channel: Channel| channel.name().to_owned()).collect(),
            setup: setup_of(reader)?,
            sensor: word("sensor", "profile").filter(|profile| profile != PERFECT_SENSOR),
            truth: word("truth", "rule"),
            planned: manifest.counts.samples,
            kept: manifest.counts.kept,
            rejected: manifest.counts.rejected.clone(),
            partial_cells: pass.partial.spread(),
            complete_cells: pass.complete.spread(),
            seen_ratio: pass.ratio.spread(),
            solid_share: pass.solid.spread(),
            hidden_share: manifest.channels().contains(&Channel::OCCLUSION).then(|| pass.hidden.spread()),
            occluded: pass.occluded,
            cut_off: pass.solid.count_between(0.0, 0.99),
            touch: TouchFacts::of(reader)?,
            splits: splits.collect(),
            training_subsets: reader.splits().training_subsets.clone(),
            leaking_geometry: leaking_geometry(reader, &assets.objects),
            objects,
            refused: assets.refused.iter().map(refusal_in_words).collect(),
        };
        let Pass { partial, complete, ratio, solid, ratio_of_split, .. } = pass;
        Ok(Self { facts, partial, complete, ratio, solid, ratio_of_split, picks })
    }
}

fn setup_of(reader: &DatasetReader) -> Result<Option<Setup>, DatasetError> {
    let Some(first) = reader.indices(Selection::default()).next() else { return Ok(None) };
    let Some(sample) = reader.sample(first)? else { return Ok(None) };
    let pair = sample.read::<VoxelPair>()?;
    let camera = pair.camera;
    Ok(Some(Setup {
        resolution: pair.grid.resolution,
        width: camera.width,
        height: camera.height,
        fx: camera.fx,
        fy: camera.fy,
        cx: camera.cx,
        cy: camera.cy,
    }))
}

fn object_facts(reader: &DatasetReader, row: &AssetRow, pass: &Pass) -> CompletionObjectFacts {
    let empty = ObjectSums::default();
    let sums = pass.objects.get(&row.object).unwrap_or(&empty);
    let facts = &row.facts;
    let number = |name: &str| facts.get(name).and_then(Value::as_u64);
    let word = |name: &str| facts.get(name).and_then(Value::as_str).map(str::to_owned);
    let list = |name: &str| facts.get(name).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let extents: Vec<f64> = list("extents").iter().filter_map(Value::as_f64).collect();
    let mean = |sum: f64| if sums.kept > 0 { sum / sums.kept as f64 } else { 0.0 };
    CompletionObjectFacts {
        name: row.name.clone(),
        object: row.object,
        split: reader.splits().object(&row.object).map(|row| row.split),
        group: word("group"),
        triangles: number("triangles"),
        extents: extents.try_into().ok(),
        watertight: facts.get("watertight").and_then(Value::as_bool),
        bodies: number("bodies"),
        inside: word("inside"),
        repairs: list("repairs").iter().map(repair_in_words).collect(),
        warnings: list("warnings").iter().map(plain_text).collect(),
        licence: word("licence"),
        citation: word("citation"),
        planned: sums.planned,
        kept: sums.kept,
        rejected: sums.rejected.clone(),
        mean_partial_cells: mean(sums.partial),
        mean_seen_ratio: mean(sums.ratio),
        min_solid_share: sums.min_solid,
    }
}

fn plain_text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// Text of a repair: `{"repair": "duplicate_faces", "count": 4}` becomes "4 duplicate faces".
fn repair_in_words(value: &Value) -> String {
    match (value.get("repair").and_then(Value::as_str), value.get("count").and_then(Value::as_u64)) {
        (Some(repair), Some(count)) => format!("{count} {}", repair.replace('_', " ")),
        _ => plain_text(value),
    }
}

/// File, problem, location and remedy of a refused mesh in one line.
fn refusal_in_words(value: &Value) -> String {
    let empty = Map::new();
    let fields = value.as_object().unwrap_or(&empty);
    let field = |name: &str| fields.get(name).and_then(Value::as_str);
    match (field("file"), field("problem")) {
        (Some(file), Some(problem)) => {
            let location = field("location").map(|location| format!(" ({location})")).unwrap_or_default();
            let remedy = field("remedy").map(|remedy| format!("; {remedy}")).unwrap_or_default();
            format!("{file}: {problem}{location}{remedy}")
        }
        _ => plain_text(value),
    }
}

/// Names of objects that share their geometry but not their side of the split.
fn leaking_geometry(reader: &DatasetReader, assets: &[AssetRow]) -> Vec<Vec<String>> {
    let mut of_geometry: BTreeMap<Digest, Vec<(&str, Option<Split>)>> = BTreeMap::new();
    for row in assets {
        let geometry = row.facts.get("geometry").and_then(Value::as_str).and_then(Digest::from_hex);
        if let Some(geometry) = geometry {
            let side = reader.splits().object(&row.object).map(|row| row.split);
            of_geometry.entry(geometry).or_default().push((&row.name, side));
        }
    }
    let straddles = |members: &&Vec<(&str, Option<Split>)>| members.windows(2).any(|pair| pair[0].1 != pair[1].1);
    let mut leaks: Vec<Vec<String>> = (of_geometry.values().filter(straddles))
        .map(|members| members.iter().map(|(name, _)| (*name).to_owned()).collect())
        .collect();
    leaks.sort();
    leaks
}

/// The facts of a finished dataset of completion: reads manifest, tables and the shards' ledgers, one at a time, and one
/// sample; with touch some samples more.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_completion(folder: &Folder) -> Result<CompletionInspection, DatasetError> {
    Ok(CompletionSurvey::of(&open_of(folder, Product::COMPLETION)?)?.facts)
}
