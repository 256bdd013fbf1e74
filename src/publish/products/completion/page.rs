//! The page of a dataset of completion: definition of a sample, pictures of samples, distributions, splits and objects.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::{
    card::CardView,
    charts,
    inspection::{CompletionInspection, CompletionObjectFacts},
    survey::CompletionSurvey,
};
use crate::{
    chart::{Figure, grouped, percent, short},
    markup::Markup,
    page::{DatasetView, SpeedView, StripPicture},
    picture::{Colour, SLICE_COLOURS},
    tally::SpreadRow,
    touch::TouchFacts,
};
use format::{
    ArrayFormat,
    dataset::{DatasetError, DatasetReader},
};
use kernel::{ids::ObjectId, words::is_note};

/// Rule of a job by which every cell that a perfect camera observes is solid.
const ALL_OF_SURFACE: &str = "any_overlap";
/// Maximum number of warnings shown in the header; more are folded.
const OPEN_WARNINGS: usize = 4;

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct CompletionPage<'a> {
    dataset: DatasetView<'a>,
    strip: Vec<StripPicture>,
    numbers: HeaderNumbers,
    speed: Option<SpeedView>,
    meaning: MeaningView,
    cards: Vec<CardView>,
    distributions: DistributionsView,
    splits: SplitsView,
    objects: ObjectsView<'a>,
    job: &'a str,
}

impl<'a> CompletionPage<'a> {
    /// The page with these cards.
    pub fn of(survey: &'a CompletionSurvey, cards: Vec<CardView>, job: &'a str) -> Self {
        let facts = &survey.facts;
        Self {
            dataset: DatasetView::of(&facts.header),
            strip: strip(&cards),
            numbers: HeaderNumbers::of(facts),
            speed: SpeedView::of(&facts.header, "samples"),
            meaning: MeaningView::of(facts),
            distributions: DistributionsView::of(survey),
            splits: SplitsView::of(survey),
            objects: ObjectsView::of(facts, &cards),
            cards,
            job,
        }
    }
}

/// The cards of the picked samples.
pub(super) fn cards(reader: &DatasetReader, survey: &CompletionSurvey) -> Result<Vec<CardView>, DatasetError> {
    let names: BTreeMap<ObjectId, &str> =
        survey.facts.objects.iter().map(|object| (object.object, object.name.as_str())).collect();
    let mut cards = Vec::new();
    for pick in &survey.picks {
        if let Some(sample) = reader.sample(pick.index)? {
            let name = names.get(&sample.id.subject).copied().unwrap_or("?");
            cards.push(CardView::of(&sample, pick, name, reader.split(pick.index))?);
        }
    }
    Ok(cards)
}

/// The strip on top: the first card of each object, then the others.
fn strip(cards: &[CardView]) -> Vec<StripPicture> {
    let mut objects = BTreeSet::new();
    let (first, others): (Vec<_>, Vec<_>) =
        (1..).zip(cards).partition(|(_, card): &(usize, &CardView)| objects.insert(card.object.as_str()));
    let few = first.len() < StripPicture::MAX;
    let shown = first.into_iter().chain(others.into_iter().filter(|_| few));
    StripPicture::strip(&shown.map(|(number, card)| (number, card.for_strip())).collect::<Vec<_>>())
}

/// The most important numbers.
#[derive(Serialize)]
struct HeaderNumbers {
    kept: String,
    /// Kept and rejected samples with their sum.
    sum: String,
    /// Whether the sum differs from the plan.
    is_short: bool,
    objects: String,
    bytes: Option<String>,
    resolution: Option<u32>,
    contacts: Option<String>,
    /// Number of warnings, if there are many.
    warnings: Option<String>,
}

impl HeaderNumbers {
    fn of(facts: &CompletionInspection) -> Self {
        let rejected = facts.rejected.values().sum::<u64>();
        let warnings = facts.header.warnings.iter().filter(|warning| !is_note(warning)).count();
        let contacts = |touch: &TouchFacts| format!("{:.1}", TouchFacts::share(touch.contacts(), touch.samples));
        Self {
            kept: grouped(facts.kept),
            sum: format!("{} + {} = {}", grouped(facts.kept), grouped(rejected), grouped(facts.planned)),
            is_short: facts.kept + rejected != facts.planned,
            objects: grouped(facts.objects.len() as u64),
            bytes: facts.header.shard_bytes.checked_div(facts.kept).map(grouped),
            resolution: facts.setup.map(|setup| setup.resolution),
            contacts: facts.touch.as_ref().map(contacts),
            warnings: (warnings > OPEN_WARNINGS).then(|| grouped(warnings as u64)),
        }
    }
}

/// Meaning of the channels: axes, frames, units.
#[derive(Serialize)]
struct MeaningView {
    resolution: u32,
    /// Cells along the longest side of the bounding box of the observed points.
    r#box: String,
    /// Grid coordinate of the middle of that box.
    anchor: String,
    colours: Vec<ColourView>,
    /// Name, shape and meaning of the channels' arrays.
    channels: Vec<[String; 3]>,
}

/// A colour of the pictures.
#[derive(Serialize)]
struct ColourView {
    hex: String,
    name: String,
}

impl MeaningView {
    fn of(facts: &CompletionInspection) -> Self {
        let resolution = facts.setup.map_or(40, |setup| setup.resolution);
        Self {
            resolution,
            r#box: short(0.8 * f64::from(resolution)),
            anchor: [0.5, 0.5, 0.45].map(|share| short(share * f64::from(resolution))).join(", "),
            colours: colours(facts),
            channels: channel_rows(facts, resolution),
        }
    }
}

/// Meaning of observed cells that are not solid: noise that the job requests is not a mistake.
fn seen_outside_in_words(facts: &CompletionInspection) -> String {
    match (&facts.sensor, &facts.truth) {
        (Some(sensor), _) => format!("observed outside the solid: noise of the sensor ({sensor})"),
        (None, Some(truth)) if truth != ALL_OF_SURFACE => {
            format!("observed outside the solid, allowed by the truth rule {truth}")
        }
        _ => "observed outside the solid (an error in standard data)".to_owned(),
    }
}

fn colours(facts: &CompletionInspection) -> Vec<ColourView> {
    let colours = SLICE_COLOURS;
    let stored = facts.channels.iter().any(|channel| channel == "visibility");
    let seen_outside = &seen_outside_in_words(facts);
    let unseen = if stored { "not solid, not observed" } else { "not solid (free space is not stored)" };
    let rows = [
        (Some(colours.partial), "partial: observed by the camera"),
        (Some(colours.complete), "complete: solid, hidden from the camera"),
        (facts.touch.is_some().then_some(Colour::TOUCHED), "touched (in the pictures from behind)"),
        (stored.then_some(colours.free), "observed free space"),
        (Some(colours.unseen), unseen),
        (Some(colours.wrong), seen_outside),
    ];
    let view = |(colour, name): (Option<Colour>, &str)| Some(ColourView { hex: colour?.hex(), name: name.to_owned() });
    rows.into_iter().filter_map(view).collect()
}

/// Name, shape and meaning of the arrays of the stored channels; `N` in a shape is the resolution.
fn channel_rows(facts: &CompletionInspection, resolution: u32) -> Vec<[String; 3]> {
    let stored =
        facts.header.product.channels().filter(|channel| facts.channels.iter().any(|name| name == channel.name()));
    let row = |array: &ArrayFormat| {
        let ArrayFormat { name, shape, meaning } = array;
        [(*name).to_owned(), shape.replace('N', &resolution.to_string()), (*meaning).to_owned()]
    };
    stored.flat_map(|channel| channel.arrays).map(row).collect()
}

/// Histograms and rejects.
#[derive(Serialize)]
struct DistributionsView {
    /// Distributions of stored samples; `None` if none is stored.
    stored: Option<StoredView>,
    /// Facts of touch, as `inspect` prints them.
    touch: Option<String>,
    /// Rejects by reason; `None` without rejects.
    rejects: Option<Markup>,
    /// Kept and rejected views of each object.
    objects: Markup,
}

/// Distributions of stored samples.
#[derive(Serialize)]
struct StoredView {
    charts: Vec<Figure>,
    spreads: Vec<Vec<String>>,
}

impl DistributionsView {
    fn of(survey: &CompletionSurvey) -> Self {
        let facts = &survey.facts;
        Self {
            stored: (facts.kept > 0).then(|| StoredView { charts: charts::of_stored(survey), spreads: spreads(facts) }),
            touch: facts.touch.as_ref().map(|touch| touch.to_string().trim_start().to_owned()),
            rejects: (!facts.rejected.is_empty()).then(|| charts::rejects(facts)),
            objects: charts::objects(facts),
        }
    }
}

fn spreads(facts: &CompletionInspection) -> Vec<Vec<String>> {
    let rows = [
        SpreadRow::new("partial cells", 0, &facts.partial_cells),
        SpreadRow::new("complete cells", 0, &facts.complete_cells),
        SpreadRow::new("partial / complete", 3, &facts.seen_ratio),
        SpreadRow::new("share of the solid inside the grid", 3, &facts.solid_share),
    ];
    rows.map(SpreadRow::into_cells).into()
}

/// Split of objects and views, and leaks between its sides.
#[derive(Serialize)]
struct SplitsView {
    rows: Vec<SplitRow>,
    charts: Vec<Figure>,
    /// Sizes of the nested training subsets.
    subsets: Option<String>,
    /// Names of objects of equal geometry on different sides of the split.
    leaking: Vec<String>,
    counted: Vec<LeakRow>,
}

/// One split.
#[derive(Serialize)]
struct SplitRow {
    name: String,
    samples: String,
    /// Share of the stored samples [%].
    width: String,
    share: String,
    objects: u64,
    median: String,
}

/// A count of the leak check.
#[derive(Serialize)]
struct LeakRow {
    count: String,
    what: String,
    is_alarming: bool,
}

impl SplitsView {
    fn of(survey: &CompletionSurvey) -> Self {
        let facts = &survey.facts;
        let rows = facts.splits.iter().map(|row| {
            let share = row.samples as f64 / facts.kept.max(1) as f64;
            SplitRow {
                name: row.split.name().replace('_', " "),
                samples: grouped(row.samples),
                width: format!("{:.1}", share * 100.0),
                share: percent(share),
                objects: row.objects,
                median: format!("{:.3}", row.seen_ratio.median),
            }
        });
        let sizes: Vec<String> = facts.training_subsets.iter().map(u32::to_string).collect();
        let notes = &facts.header.notes;
        let counted = notes.leaks.iter().map(|(name, count)| LeakRow {
            count: grouped(*count),
            what: notes.leak_in_words(name),
            is_alarming: notes.is_leak(name, *count),
        });
        Self {
            rows: rows.collect(),
            charts: charts::of_splits(survey),
            subsets: (!sizes.is_empty()).then(|| sizes.join(", ")),
            leaking: facts.leaking_geometry.iter().map(|names| names.join(", ")).collect(),
            counted: counted.collect(),
        }
    }
}

/// The asset table.
#[derive(Serialize)]
struct ObjectsView<'a> {
    rows: Vec<ObjectRow<'a>>,
    refused: &'a [String],
    refused_count: usize,
    citations: Vec<&'a str>,
}

/// One object.
#[derive(Serialize)]
struct ObjectRow<'a> {
    id: String,
    name: &'a str,
    /// Number of its first card; `None` without one.
    card: Option<usize>,
    /// Triangles, longest side, closed, kept of planned, mean partial cells, smallest share inside the grid, split.
    figures: [String; 7],
    licence: &'a str,
    remarks: Vec<RemarkView>,
}

/// A repair, a warning or a count of rejects.
#[derive(Serialize)]
struct RemarkView {
    class: Option<&'static str>,
    text: String,
}

impl<'a> ObjectsView<'a> {
    fn of(facts: &'a CompletionInspection, cards: &[CardView]) -> Self {
        let card = |name: &str| Some(1 + cards.iter().position(|card| card.object == name)?);
        let mut citations: Vec<&str> = facts.objects.iter().filter_map(|object| object.citation.as_deref()).collect();
        citations.sort_unstable();
        citations.dedup();
        Self {
            rows: facts.objects.iter().map(|object| ObjectRow::of(object, card(&object.name))).collect(),
            refused: &facts.refused,
            refused_count: facts.refused.len(),
            citations,
        }
    }
}

impl<'a> ObjectRow<'a> {
    fn of(object: &'a CompletionObjectFacts, card: Option<usize>) -> Self {
        let unknown = || "?".to_owned();
        Self {
            id: object.object.to_string(),
            name: &object.name,
            card,
            figures: [
                object.triangles.map_or_else(unknown, grouped),
                object.longest_side().map_or_else(unknown, |side| format!("{:.1} mm", side * 1e3)),
                object.watertight.map_or("?", |closed| if closed { "yes" } else { "no" }).to_owned(),
                format!("{} of {}", grouped(object.kept), grouped(object.planned)),
                format!("{:.0}", object.mean_partial_cells),
                object.min_solid_share.map_or_else(unknown, percent),
                object.split.map_or_else(unknown, |split| split.name().replace('_', " ")),
            ],
            licence: object.licence.as_deref().unwrap_or("?"),
            remarks: remarks(object),
        }
    }
}

fn remarks(object: &CompletionObjectFacts) -> Vec<RemarkView> {
    let repairs = object.repairs.iter().map(|repair| RemarkView { class: None, text: format!("repaired: {repair}") });
    let warnings = object
        .warnings
        .iter()
        .map(|text| RemarkView { class: Some(if is_note(text) { "quiet" } else { "alarm" }), text: text.clone() });
    let rejects = object.rejected.iter().map(|(reason, count)| RemarkView {
        class: Some("quiet"),
        text: format!("{} rejected: {}", grouped(*count), reason.replace('_', " ")),
    });
    repairs.chain(warnings).chain(rejects).collect()
}
