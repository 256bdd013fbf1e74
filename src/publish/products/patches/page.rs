//! The page of a dataset of patches: chosen types, rejects, and sheets of patches.

use serde::Serialize;

use super::{
    inspection::{PatchSurvey, PatchesInspection},
    sheets::CardView,
};
use crate::{
    chart::{Ink, grouped, percent, value_histogram},
    markup::Markup,
    page::{DatasetView, StripPicture, share_rows},
};
use format::PATCH_POINTS;

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct PatchesPage<'a> {
    dataset: DatasetView<'a>,
    strip: Vec<StripPicture>,
    /// Whether patches also have colours.
    in_colour: bool,
    numbers: HeaderNumbers,
    /// Whether labels come from trials.
    by_trials: bool,
    /// Label, count and share; empty if labels do not come from trials.
    outcomes: Vec<[String; 3]>,
    /// Visible points, and their share; `None` if points are not marked.
    visible: Option<[String; 2]>,
    /// Root digest of the exact numbers of the grasps.
    grasps: Option<String>,
    types: TypesView,
    cards: Vec<CardView>,
    /// Epsilon of the stored grasps; `None` if none is stored.
    epsilon: Option<Markup>,
    /// Reason, count and share.
    rejects: Vec<[String; 3]>,
    objects: Vec<ObjectRow<'a>>,
    job: &'a str,
}

impl<'a> PatchesPage<'a> {
    /// The page with these cards.
    pub fn of(survey: &'a PatchSurvey, cards: Vec<CardView>, job: &'a str) -> Self {
        let facts = &survey.facts;
        let epsilon = || {
            value_histogram(
                &survey.epsilons,
                &facts.epsilon,
                "Epsilon of the stored grasps",
                ["epsilon", "grasps"],
                Ink::Partial,
            )
        };
        Self {
            dataset: DatasetView::of(&facts.header),
            strip: StripPicture::strip(&(1..).zip(cards.iter().map(CardView::for_strip)).collect::<Vec<_>>()),
            in_colour: facts.colour,
            numbers: HeaderNumbers::of(facts),
            by_trials: facts.outcomes.is_some(),
            outcomes: facts.outcomes.as_ref().map_or_else(Vec::new, |outcomes| share_rows(outcomes, facts.kept)),
            visible: facts.visible_points.map(|visible| {
                let all = PATCH_POINTS as u64 * facts.kept;
                [grouped(visible), percent(visible as f64 / all.max(1) as f64)]
            }),
            grasps: facts.grasps.map(|root| root.to_string()),
            types: TypesView::of(facts),
            objects: objects(facts, &cards),
            cards,
            epsilon: (!survey.epsilons.is_empty()).then(|| epsilon().svg()),
            rejects: share_rows(&facts.rejected, facts.samples),
            job,
        }
    }
}

/// The most important numbers.
#[derive(Serialize)]
struct HeaderNumbers {
    /// Stored grasps.
    kept: String,
    /// Objects with stored grasps.
    objects: String,
    /// Kept grasps of the dataset of grasps.
    grasps: String,
    /// Grasps of the chosen types, and their share.
    chosen: String,
    rejected: String,
    patches: String,
}

impl HeaderNumbers {
    fn of(facts: &PatchesInspection) -> Self {
        let share = facts.samples as f64 / facts.kept_grasps.max(1) as f64;
        Self {
            kept: grouped(facts.kept),
            objects: grouped(facts.objects.iter().filter(|object| object.kept > 0).count() as u64),
            grasps: grouped(facts.kept_grasps),
            chosen: format!("{} · {}", grouped(facts.samples), percent(share)),
            rejected: grouped(facts.samples - facts.kept),
            patches: grouped(4 * facts.kept),
        }
    }
}

/// The chosen types.
#[derive(Serialize)]
struct TypesView {
    chosen: usize,
    /// Different types of all kept grasps.
    different: String,
    /// Index, type, grasps, share, coverage, stored and digits.
    rows: Vec<Vec<String>>,
}

impl TypesView {
    fn of(facts: &PatchesInspection) -> Self {
        let all = facts.kept_grasps.max(1) as f64;
        let mut covered = 0;
        let rows = facts.types.iter().enumerate().map(|(index, chosen)| {
            let row = &chosen.facts;
            covered += row.grasps;
            let mut cells = vec![
                index.to_string(),
                row.kind.to_string(),
                grouped(row.grasps),
                percent(row.grasps as f64 / all),
                percent(covered as f64 / all),
                grouped(chosen.kept),
            ];
            cells.extend(row.digits_in_words());
            cells
        });
        Self { rows: rows.collect(), chosen: facts.types.len(), different: grouped(facts.different_types) }
    }
}

/// One object.
#[derive(Serialize)]
struct ObjectRow<'a> {
    id: String,
    name: &'a str,
    /// Number of its first card; `None` without one.
    card: Option<usize>,
    samples: String,
    kept: String,
}

fn objects<'a>(facts: &'a PatchesInspection, cards: &[CardView]) -> Vec<ObjectRow<'a>> {
    let rows = facts.objects.iter().map(|object| ObjectRow {
        id: object.object.to_string(),
        name: &object.name,
        card: cards.iter().position(|card| card.object == object.name).map(|index| 1 + index),
        samples: grouped(object.samples),
        kept: grouped(object.kept),
    });
    rows.collect()
}
