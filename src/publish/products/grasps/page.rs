//! The page of a dataset of grasps: counts, distributions, types, the progress of the annealing, and pictures of grasps.

use serde::Serialize;

use super::{
    gallery::CardView,
    inspection::{
        GraspObjectFacts, GraspSurvey, GraspsInspection, SHOWN_TYPES, TableFacts, found_and_kept,
        grasp_counts_in_words, more_types_in_words,
    },
    replayed::ReplayView,
    trials::TrialsView,
    ways::WayRow,
};
use crate::{
    chart::{Bar, Ink, bar_chart, grouped, percent, value_histogram},
    markup::Markup,
    page::{DatasetView, SpeedView, StripPicture},
};
use format::{FORCE, GraspMethod, HandNames};
use kernel::words::{GraspVerdict, STRETCHES, counted};

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct GraspsPage<'a> {
    dataset: DatasetView<'a>,
    strip: Vec<StripPicture>,
    numbers: HeaderNumbers,
    hand: &'a str,
    /// Name of the sampler.
    sampler: &'a str,
    speed: Option<SpeedView>,
    method: Option<MethodView<'a>>,
    /// Name and meaning of each verdict.
    verdicts: Vec<[String; 2]>,
    /// `None` if the hand has a shape that cannot be drawn.
    gallery: Option<GalleryView>,
    distributions: DistributionsView,
    table: TableView,
    /// Approaches, with count and share without a table, and on the table of the most likely pose.
    ways: Vec<[String; 5]>,
    trials: Option<TrialsView>,
    replay: Option<ReplayView>,
    course: Vec<CourseRow>,
    /// `None` if no kept grasp has a type.
    types: Option<TypesView>,
    objects: Vec<ObjectRow<'a>>,
    job: &'a str,
}

/// Pictures of grasps.
#[derive(Serialize)]
struct GalleryView {
    cards: Vec<CardView>,
}

impl<'a> GraspsPage<'a> {
    /// The page with these cards, or with none if the hand has a shape that cannot be drawn.
    pub fn of(survey: &'a GraspSurvey, cards: Option<Vec<CardView>>, replay: Option<ReplayView>, job: &'a str) -> Self {
        let facts = &survey.facts;
        Self {
            dataset: DatasetView::of(&facts.header),
            strip: strip(cards.as_deref().unwrap_or_default()),
            objects: objects(facts, cards.as_deref().unwrap_or_default()),
            numbers: HeaderNumbers::of(facts),
            hand: facts.hand.as_deref().unwrap_or("a hand"),
            sampler: survey.method.as_ref().map_or("annealing", |(method, _)| &method.sampler),
            speed: SpeedView::of(&facts.header, "runs"),
            method: survey.method.as_ref().map(|(method, hand)| MethodView::of(method, hand)),
            verdicts: GraspVerdict::ALL.map(|verdict| [in_words(verdict), why(verdict).to_owned()]).into(),
            gallery: cards.map(|cards| GalleryView { cards }),
            distributions: DistributionsView::of(survey),
            table: TableView::of(&facts.table),
            ways: facts.ways.rows().into_iter().map(way_cells).collect(),
            trials: facts.trials.as_ref().map(TrialsView::of),
            replay,
            course: (0..STRETCHES).map(|tenth| CourseRow::of(facts, tenth)).collect(),
            types: (!facts.types.is_empty()).then(|| TypesView::of(facts)),
            job,
        }
    }
}

/// The strip at the top: a picture of each object in turn.
fn strip(cards: &[CardView]) -> Vec<StripPicture> {
    StripPicture::strip(&(1..).zip(cards.iter().map(CardView::for_strip)).collect::<Vec<_>>())
}

/// The most important numbers.
#[derive(Serialize)]
struct HeaderNumbers {
    kept: String,
    /// States that are not kept.
    not_kept: String,
    objects: usize,
    runs: String,
    /// Runs without a legal state; `None` if each found one.
    rejected: Option<String>,
    given_up: String,
    /// Closed states.
    found: String,
    /// Types of kept grasps; `None` of a hand without types.
    types: Option<String>,
}

impl HeaderNumbers {
    fn of(facts: &GraspsInspection) -> Self {
        let [found, kept] = found_and_kept(&facts.verdicts);
        let rejected: u64 = facts.rejected.values().sum();
        Self {
            kept: grouped(kept),
            not_kept: grouped(found - kept),
            objects: facts.objects.len(),
            runs: grouped(facts.runs),
            rejected: Some(rejected).filter(|rejected| *rejected > 0).map(grouped),
            given_up: grouped(facts.given_up),
            found: grouped(found),
            types: (!facts.types.is_empty()).then(|| grouped(facts.types.len() as u64)),
        }
    }
}

/// Parameters of energies and qualities.
#[derive(Serialize)]
struct MethodView<'a> {
    hand: &'a str,
    joints: usize,
    /// Joints with motors.
    driven: usize,
    energy: String,
    energy_friction: String,
    energy_space: &'static str,
    /// Torsion of soft fingers; `None` of hard points.
    torsion: Option<String>,
    friction: String,
    edges: u32,
    min_epsilon: String,
    space: &'static str,
}

impl<'a> MethodView<'a> {
    fn of(method: &GraspMethod, hand: &'a HandNames) -> Self {
        Self {
            hand: &hand.name,
            joints: hand.joints.len(),
            driven: hand.driven.len(),
            energy: method.energy.replace('_', " "),
            energy_friction: method.energy_friction.to_string(),
            energy_space: space_in_words(&method.energy_space),
            torsion: (method.contact_model == "soft_finger").then(|| method.torsion.to_string()),
            friction: method.friction.to_string(),
            edges: method.edges,
            min_epsilon: method.min_epsilon.to_string(),
            space: space_in_words(&method.space),
        }
    }
}

fn space_in_words(space: &str) -> &'static str {
    if space == FORCE { "forces" } else { "forces and torques" }
}

fn in_words(verdict: GraspVerdict) -> String {
    verdict.name().replace('_', " ")
}

fn why(verdict: GraspVerdict) -> &'static str {
    match verdict {
        GraspVerdict::Kept => "the contacts resist every disturbance well enough",
        GraspVerdict::Penetrates => "the hand penetrates the true mesh before it closes",
        GraspVerdict::OpenHand => "the closed hand touches with at most one link",
        GraspVerdict::NoForceClosure => "the contacts do not resist some disturbance",
        GraspVerdict::LowQuality => "the contacts resist every disturbance, but some only weakly",
        GraspVerdict::BelowTable => "the hand would be below the table in every resting pose of the object",
    }
}

/// Histograms of states and grasps.
#[derive(Serialize)]
struct DistributionsView {
    counts: String,
    verdicts: Markup,
    energy: Markup,
    /// `None` if no grasp was kept.
    epsilon: Option<Markup>,
}

impl DistributionsView {
    fn of(survey: &GraspSurvey) -> Self {
        let facts = &survey.facts;
        let bars = GraspVerdict::ALL.map(|verdict| Bar {
            label: in_words(verdict),
            value: facts.verdicts.get(verdict.name()).copied().unwrap_or(0),
            ink: if verdict == GraspVerdict::Kept { Ink::Partial } else { Ink::Reject },
        });
        let energy = value_histogram(
            &survey.energies,
            &facts.energy,
            "Energy of all states",
            ["energy", "grasps"],
            Ink::Neutral,
        );
        let epsilon = || {
            value_histogram(
                &survey.epsilons,
                &facts.epsilon,
                "Epsilon of kept grasps",
                ["epsilon", "grasps"],
                Ink::Partial,
            )
        };
        Self {
            counts: grasp_counts_in_words(&facts.verdicts),
            verdicts: bar_chart("states by verdict", &bars),
            energy: energy.svg(),
            epsilon: (!survey.epsilons.is_empty()).then(|| epsilon().svg()),
        }
    }
}

/// Kept grasps that can be executed on a table, as count and share.
#[derive(Serialize)]
struct TableView {
    somewhere: [String; 2],
    opened: [String; 2],
    likely: [String; 2],
}

impl TableView {
    fn of(table: &TableFacts) -> Self {
        let TableFacts { grasps, somewhere, likely, opened } = *table;
        let cells = |count: u64| [grouped(count), percent(count as f64 / grasps.max(1) as f64)];
        Self { somewhere: cells(somewhere), opened: cells(opened), likely: cells(likely) }
    }
}

fn way_cells(WayRow { name, in_the_air, on_a_table }: WayRow) -> [String; 5] {
    [name.to_owned(), grouped(in_the_air.0), in_the_air.1, grouped(on_a_table.0), on_a_table.1]
}

/// One tenth of the search.
#[derive(Serialize)]
struct CourseRow {
    /// First and last step [% of all].
    from: usize,
    to: usize,
    /// Share of accepted steps.
    accepted: String,
    /// Width of the bar of this share [%].
    width: String,
    /// Mean energy.
    energy: String,
}

impl CourseRow {
    fn of(facts: &GraspsInspection, tenth: usize) -> Self {
        let share = facts.acceptance[tenth];
        Self {
            from: tenth * 100 / STRETCHES,
            to: (tenth + 1) * 100 / STRETCHES,
            accepted: percent(share),
            width: format!("{:.1}", share * 100.0),
            energy: facts.course[tenth].map_or_else(|| "-".to_owned(), |energy| format!("{energy:.3}")),
        }
    }
}

/// The most common types.
#[derive(Serialize)]
struct TypesView {
    /// Count of all types.
    count: String,
    /// Kept grasps with a type.
    grasps: String,
    /// Type, grasps, share, digits; with trials the count that held.
    rows: Vec<Vec<String>>,
    /// Types without a row, and their grasps; `None` if each has one.
    more: Option<String>,
}

impl TypesView {
    fn of(facts: &GraspsInspection) -> Self {
        let all: u64 = facts.types.iter().map(|row| row.grasps).sum();
        let rows = facts.types.iter().take(SHOWN_TYPES).map(|row| {
            let mut cells = vec![row.kind.to_string(), grouped(row.grasps), percent(row.grasps as f64 / all as f64)];
            cells.extend(row.digits_in_words());
            cells.extend(held_cell(facts, row.held, row.grasps));
            cells
        });
        Self {
            count: counted(facts.types.len() as u64, "type"),
            grasps: grouped(all),
            rows: rows.collect(),
            more: more_types_in_words(&facts.types),
        }
    }
}

/// Count and share of tried grasps that held; `None` without trials.
fn held_cell(facts: &GraspsInspection, held: u64, tried: u64) -> Option<String> {
    facts.trials.as_ref().map(|_| match tried {
        0 => "-".to_owned(),
        _ => format!("{} ({})", grouped(held), percent(held as f64 / tried as f64)),
    })
}

/// One object.
#[derive(Serialize)]
struct ObjectRow<'a> {
    id: String,
    name: &'a str,
    /// Number of its card; `None` without one.
    card: Option<usize>,
    figures: Vec<String>,
}

fn objects<'a>(facts: &'a GraspsInspection, cards: &[CardView]) -> Vec<ObjectRow<'a>> {
    facts.objects.iter().map(|object| ObjectRow::of(facts, object, cards)).collect()
}

impl<'a> ObjectRow<'a> {
    fn of(facts: &GraspsInspection, object: &'a GraspObjectFacts, cards: &[CardView]) -> Self {
        let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4}"));
        let GraspObjectFacts { name, object: id, verdicts, trials, resting, likely, table, .. } = object;
        let mut figures: Vec<String> =
            [object.runs, object.rejected, object.given_up, object.found()].map(grouped).into();
        figures.extend(verdicts.iter().map(|count| grouped(*count)));
        figures.extend(held_cell(facts, trials[1], trials[0]));
        figures.extend([
            resting.to_string(),
            likely.map_or_else(|| "-".to_owned(), percent),
            grouped(table.somewhere),
            grouped(table.likely),
            number(object.best_energy),
            number(object.best_epsilon),
        ]);
        let card = cards.iter().position(|card| card.object == *name).map(|index| 1 + index);
        Self { id: id.to_string(), name, card, figures }
    }
}
