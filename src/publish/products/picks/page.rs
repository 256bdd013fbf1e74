//! The page of a dataset of picks: blocked grasps, outcomes of trials, pictures.

use serde::Serialize;

use super::{
    inspection::{PickSurvey, PickedObject, SampledPicks, TriedPicks, share},
    painting::Drawn,
};
use crate::{
    chart::{Bar, Ink, bar_chart, grouped},
    markup::Markup,
    page::{DatasetView, PanelView, SpeedView, StripCard, StripPicture, share_rows, split_rows},
    picture::Picture,
};
use format::{
    PickCandidates, PickObstacle, PickTrials, PickVerdict,
    dataset::{DatasetError, DatasetReader},
};
use kernel::words::Split;

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct PicksPage<'a> {
    dataset: DatasetView<'a>,
    strip: Vec<StripPicture>,
    speed: Option<SpeedView>,
    numbers: HeaderNumbers,
    /// Reason, count and share.
    rejects: Vec<[String; 3]>,
    /// Split and kept bodies.
    splits: Vec<[String; 2]>,
    /// Candidates by result; `None` if none was evaluated.
    ends: Option<Markup>,
    /// Poses; `None` if grasps are stored ones.
    poses: Option<PosesView>,
    /// Trials; `None` if nothing was tried.
    trials: Option<TrialsView>,
    cards: Vec<CardView>,
    /// Name, split, bodies, candidates, free, blocked by each obstacle, tried, held.
    objects: Vec<Vec<String>>,
    job: &'a str,
}

/// The most important numbers.
#[derive(Serialize)]
struct HeaderNumbers {
    kept: String,
    scenes: String,
    hand: String,
    with_free: String,
    candidates: String,
    free: String,
    /// Free grasps if the hand approaches opened, and on at least one of the two approaches.
    free_opened: String,
    free_either: String,
}

/// Poses of grasps that are sampled in the scene.
#[derive(Serialize)]
struct PosesView {
    poses: String,
    /// Bodies without a free grasp: too wide, and blocked for the palm alone.
    too_wide: String,
    palm_only: String,
    /// From poses to grasps that held.
    funnel: Markup,
    /// Lost poses by reason.
    lost: Markup,
    /// Bodies without a free grasp by obstacle; `None` if every body has one.
    blocked: Option<Markup>,
}

impl PosesView {
    fn of(poses: &SampledPicks, trials: Option<&TriedPicks>) -> Self {
        let bar = |(label, value): (String, u64), ink| Bar { label, value, ink };
        let funnel: Vec<Bar> = poses.funnel(trials).into_iter().map(|step| bar(step, Ink::Complete)).collect();
        let lost: Vec<Bar> = poses.lost.iter().cloned().map(|reason| bar(reason, Ink::Reject)).collect();
        let blocked = PickObstacle::NAMES.iter().zip(poses.blocked_by);
        let blocked: Vec<Bar> = blocked.map(|(name, count)| bar(((*name).to_owned(), count), Ink::Reject)).collect();
        Self {
            poses: grouped(poses.poses),
            too_wide: grouped(poses.too_wide),
            palm_only: grouped(poses.palm_only),
            funnel: bar_chart("From poses to held grasps", &funnel),
            lost: bar_chart("Lost poses by reason", &lost),
            blocked: (blocked.iter().any(|bar| bar.value > 0))
                .then(|| bar_chart("Bodies without a free grasp by obstacle", &blocked)),
        }
    }
}

/// Trials among neighbours.
#[derive(Serialize)]
struct TrialsView {
    tried: String,
    held: String,
    held_share: String,
    touching: String,
    moving: String,
    carrying: String,
    chart: Markup,
}

/// One body of a scene.
#[derive(Clone, Serialize)]
pub(crate) struct CardView {
    title: String,
    words: String,
    pictures: Vec<PanelView>,
}

/// Side of a picture [px].
const SIDE: u32 = 520;

/// Side of a picture on the page [px].
const SHOWN_SIDE: u32 = 260;

/// One line about a body.
pub(super) fn pick_words(candidates: &PickCandidates, trials: Option<&PickTrials>) -> String {
    let free = candidates.free().count();
    let all = candidates.candidates.len();
    let mut words = format!("body {} of {} · {free} of {all} grasps free", candidates.body(), candidates.bodies.len());
    if let Some(trials) = trials {
        let held = trials.trials.iter().filter(|trial| trial.verdict.is_held()).count();
        words += &format!(" · {held} of {} trials held", trials.trials.len());
    }
    words
}

/// Bodies on the page; empty if the hand has a shape that cannot be drawn.
pub(crate) fn cards(reader: &DatasetReader, survey: &PickSurvey) -> Result<Vec<CardView>, DatasetError> {
    let Some(mut drawn) = Drawn::of(reader)? else { return Ok(Vec::new()) };
    let mut cards = Vec::new();
    for index in &survey.shown {
        let Some(sample) = reader.sample(*index)? else { continue };
        let (candidates, trials) = (sample.read::<PickCandidates>()?, sample.find::<PickTrials>()?);
        let pictures = drawn.pictures(&candidates, trials.as_ref(), SIDE)?;
        let panel = |picture: &Picture, name, hint| PanelView::square(picture, SHOWN_SIDE, name, hint);
        let name = if trials.is_some() { "A grasp that held" } else { "A free grasp" };
        let held = pictures.held.as_ref().map(|picture| panel(picture, name, "blue: the closed hand"));
        let ways = panel(&pictures.ways, "All grasps", "green: free, red: blocked");
        let split = reader.splits().split_of(&sample.id).map_or("", Split::name).replace('_', " ");
        let object = survey.facts.objects.iter().find(|row| row.object == candidates.object());
        cards.push(CardView {
            title: object.map_or_else(|| "?".to_owned(), |row| row.name.clone()),
            words: format!("{split} · {}", pick_words(&candidates, trials.as_ref())),
            pictures: held.into_iter().chain([ways]).collect(),
        });
    }
    Ok(cards)
}

impl<'a> PicksPage<'a> {
    /// The page with these cards.
    pub fn of(survey: &'a PickSurvey, cards: Vec<CardView>, job: &'a str) -> Self {
        let facts = &survey.facts;
        let strip_card = |card: &CardView| StripCard {
            caption: card.title.clone(),
            pictures: card.pictures.iter().map(|panel| panel.image.clone()).collect(),
        };
        let end = |(name, count): (&str, u64)| {
            let is_free = name == "free";
            let label = if is_free { "free".to_owned() } else { format!("blocked by {name}") };
            Bar { label, value: count, ink: if is_free { Ink::Complete } else { Ink::Reject } }
        };
        let ends: Vec<Bar> = facts.ends().map(end).collect();
        let trials = facts.trials.as_ref().map(|trials| {
            let bar = |(verdict, count): (&String, &u64)| Bar {
                label: verdict.replace('_', " "),
                value: *count,
                ink: if verdict == PickVerdict::Held.name() { Ink::Complete } else { Ink::Reject },
            };
            let bars: Vec<Bar> = trials.verdicts.iter().map(bar).collect();
            TrialsView {
                tried: grouped(trials.tried),
                held: grouped(trials.held),
                held_share: share(trials.held, trials.tried),
                touching: grouped(trials.held_touching),
                moving: grouped(trials.held_moving),
                carrying: grouped(trials.held_carrying),
                chart: bar_chart("Trials by verdict", &bars),
            }
        });
        Self {
            dataset: DatasetView::of(&facts.header),
            strip: StripPicture::strip(&(1..).zip(cards.iter().map(strip_card)).collect::<Vec<_>>()),
            speed: SpeedView::of(&facts.header, "bodies"),
            numbers: HeaderNumbers {
                kept: grouped(facts.kept),
                scenes: grouped(facts.scenes),
                hand: facts.hand.clone(),
                with_free: grouped(facts.bodies_with_free),
                candidates: grouped(facts.candidates),
                free: grouped(facts.free),
                free_opened: grouped(facts.free_opened[0]),
                free_either: grouped(facts.free_opened[1]),
            },
            rejects: share_rows(&facts.rejected, facts.samples),
            splits: split_rows(&facts.splits),
            poses: facts.poses.as_ref().map(|poses| PosesView::of(poses, facts.trials.as_ref())),
            ends: (facts.candidates > 0).then(|| bar_chart("Grasps by result", &ends)),
            trials,
            objects: facts.objects.iter().map(PickedObject::cells).collect(),
            cards,
            job,
        }
    }
}

#[cfg(test)]
impl CardView {
    /// A card of one picture of this name.
    pub fn example(name: &str) -> Self {
        let picture = Picture::filled(1, 1, [0; 4]);
        Self {
            title: name.to_owned(),
            words: "training".to_owned(),
            pictures: vec![PanelView::square(&picture, 1, "A free grasp", "blue")],
        }
    }
}
