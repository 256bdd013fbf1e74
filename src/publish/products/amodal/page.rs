//! The page of a dataset of amodal pairs: kept and rejected samples, distributions, pictures.

use serde::Serialize;

use super::{inspection::AmodalSurvey, painting::PairPictures};
use crate::{
    chart::{Bar, Ink, bar_chart, grouped, percent},
    markup::Markup,
    page::{DatasetView, PanelView, SpeedView, StripCard, StripPicture, share_rows, split_rows},
    picture::Picture,
    scene_objects::ScenesObject,
    tally::SpreadRow,
};
use format::dataset::{DatasetError, DatasetReader};
use kernel::words::Split;

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct AmodalPage<'a> {
    dataset: DatasetView<'a>,
    strip: Vec<StripPicture>,
    speed: Option<SpeedView>,
    numbers: HeaderNumbers,
    /// Reason, count and share.
    rejects: Vec<[String; 3]>,
    /// Split and kept pairs.
    splits: Vec<[String; 2]>,
    /// Kept pairs by visible share of the body; `None` if no pair is kept.
    bodies: Option<Markup>,
    /// Text, bodies, kept pairs and share.
    strata: Vec<[String; 4]>,
    spreads: Vec<Vec<String>>,
    /// Facts of touch, as `inspect` prints them.
    touch: Option<String>,
    cards: Vec<CardView>,
    /// Name and split.
    objects: Vec<[String; 2]>,
    job: &'a str,
}

/// The most important numbers.
#[derive(Serialize)]
struct HeaderNumbers {
    kept: String,
    samples: String,
    scenes: String,
    truncated: String,
}

/// One pair.
#[derive(Clone, Serialize)]
pub(crate) struct CardView {
    title: String,
    words: String,
    /// Name, hint and picture.
    pictures: Vec<PanelView>,
}

/// Side of a picture [px]: twice its size on the page, so that it is sharp on high-resolution screens.
const SIDE: u32 = 400;

/// Side of a picture on the page [px].
const SHOWN_SIDE: u32 = 200;

/// The pairs that a page shows.
pub(crate) fn cards(reader: &DatasetReader, survey: &AmodalSurvey) -> Result<Vec<CardView>, DatasetError> {
    let mut cards = Vec::new();
    for index in &survey.shown {
        let Some(sample) = reader.sample(*index)? else { continue };
        let (pictures, pair, clutter) = PairPictures::of(&sample, SIDE)?;
        let panel = |picture: &Picture, name, hint: &str| PanelView::square(picture, SHOWN_SIDE, name, hint);
        let touch = pictures.touch.as_ref().map(|touch| {
            [
                panel(&touch.cells, "Partial and touch, from behind", touch.cells_hint.as_str()),
                panel(&touch.points, "Touch points, from behind", touch.points_hint.as_str()),
            ]
        });
        let split = reader.splits().split_of(&sample.id).map_or("", Split::name).replace('_', " ");
        cards.push(CardView {
            title: format!("{}, body {} in view {}", ScenesObject::name_of(&survey.facts.objects, clutter.object), sample.id.instance, sample.id.item),
            words: format!(
                "{split} · sample {} · {} of the silhouette is visible ({} of {} px) · {} partial of {} complete cells · {} of the \
                 solid inside the grid · cell {:.2} mm · purity {}",
                sample.index,
                percent(clutter.visible_share()),
                grouped(clutter.pixels_visible.into()),
                grouped(clutter.pixels_all.into()),
                pair.partial_cells,
                pair.complete_cells,
                percent(pair.solid_share),
                pair.grid.cell_size * 1e3,
                percent(clutter.purity()),
            ),
            pictures: [
                panel(&pictures.seen, "Visible part", "blue the body, grey everything else"),
                panel(&pictures.whole, "Whole body", "orange is hidden"),
                panel(&pictures.behind, "Whole body, from behind", "orange is hidden"),
            ]
            .into_iter()
            .chain(touch.into_iter().flatten())
            .chain([
                panel(&pictures.slices.front, "Slice across the view", "x right, y down"),
                panel(&pictures.slices.side, "Slice from the side", "z right, y down"),
                panel(&pictures.slices.top, "Slice from above", "x right, z up"),
            ])
            .collect(),
        });
    }
    Ok(cards)
}

impl<'a> AmodalPage<'a> {
    /// The page with these cards.
    pub fn of(survey: &'a AmodalSurvey, cards: Vec<CardView>, job: &'a str) -> Self {
        let facts = &survey.facts;
        let strip_card = |card: &CardView| StripCard {
            caption: card.title.clone(),
            pictures: card.pictures.iter().take(2).map(|panel| panel.image.clone()).collect(),
        };
        let bar =
            |(words, _, kept): &(String, u64, u64)| Bar { label: words.clone(), value: *kept, ink: Ink::Complete };
        let bars: Vec<Bar> = facts.strata.iter().map(bar).collect();
        Self {
            dataset: DatasetView::of(&facts.header),
            strip: StripPicture::strip(&(1..).zip(cards.iter().map(strip_card)).collect::<Vec<_>>()),
            speed: SpeedView::of(&facts.header, "samples"),
            numbers: HeaderNumbers {
                kept: grouped(facts.kept),
                samples: grouped(facts.samples),
                scenes: grouped(facts.scenes),
                truncated: grouped(facts.truncated),
            },
            rejects: share_rows(&facts.rejected, facts.samples),
            splits: split_rows(&facts.splits),
            bodies: (facts.kept > 0).then(|| bar_chart("Pairs by visible share of the body", &bars)),
            strata: facts.stratum_rows(),
            spreads: facts.spread_rows().into_iter().map(SpreadRow::into_cells).collect(),
            touch: facts.touch.as_ref().map(|touch| touch.to_string().trim_start().to_owned()),
            objects: ScenesObject::rows(&facts.objects),
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
            pictures: vec![PanelView::square(&picture, 1, "Visible part", "blue the body")],
        }
    }
}
