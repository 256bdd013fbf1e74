//! The page of a dataset of suction: the funnel of poses, pictures.

use serde::Serialize;

use super::{
    inspection::{CupObject, SuctionSurvey, share},
    painting::Drawn,
};
use crate::{
    chart::{Bar, Ink, bar_chart, grouped},
    markup::Markup,
    page::{DatasetView, PanelView, SpeedView, StripCard, StripPicture, split_rows},
    picture::Picture,
};
use format::{
    SuctionPoses,
    dataset::{DatasetError, DatasetReader},
};
use kernel::words::Split;

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct SuctionPage<'a> {
    dataset: DatasetView<'a>,
    strip: Vec<StripPicture>,
    speed: Option<SpeedView>,
    numbers: HeaderNumbers,
    /// Reason, count and share: none, every body is kept.
    rejects: Vec<[String; 3]>,
    /// Split and kept bodies.
    splits: Vec<[String; 2]>,
    /// From poses to robust ones, and lost poses by reason; `None` if none was drawn.
    funnel: Option<[Markup; 2]>,
    cards: Vec<CardView>,
    /// Name, split, bodies, those with a free pose, poses, leaking, weak, blocked and free ones.
    objects: Vec<Vec<String>>,
    job: &'a str,
}

/// The most important numbers.
#[derive(Serialize)]
struct HeaderNumbers {
    kept: String,
    scenes: String,
    with_free: String,
    with_free_share: String,
    poses: String,
    free: String,
    robust: String,
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
pub(super) fn suction_words(poses: &SuctionPoses) -> String {
    format!(
        "body {} of {} · {} free poses of {} drawn · {:.0} g",
        poses.body(),
        poses.bodies.len(),
        poses.draws.free,
        poses.draws.drawn,
        1000.0 * poses.mass
    )
}

/// Bodies on the page.
pub(crate) fn cards(reader: &DatasetReader, survey: &SuctionSurvey) -> Result<Vec<CardView>, DatasetError> {
    let mut drawn = Drawn::of(reader)?;
    let mut cards = Vec::new();
    for index in &survey.shown {
        let Some(sample) = reader.sample(*index)? else { continue };
        let poses = sample.read::<SuctionPoses>()?;
        let pictures = drawn.pictures(&poses, SIDE)?;
        let panel = |picture: &Picture, name, hint| PanelView::square(picture, SHOWN_SIDE, name, hint);
        let cup = pictures.cup.as_ref().map(|picture| panel(picture, "A free pose", "blue: cup and tube"));
        let hint = "green: free, red: leaking, blue: too weak or blocked";
        let all = panel(&pictures.poses, "Stored poses", hint);
        let split = reader.splits().split_of(&sample.id).map_or("", Split::name).replace('_', " ");
        let object = survey.facts.objects.iter().find(|row| row.object == poses.object());
        cards.push(CardView {
            title: object.map_or_else(|| "?".to_owned(), |row| row.name.clone()),
            words: format!("{split} · {}", suction_words(&poses)),
            pictures: cup.into_iter().chain([all]).collect(),
        });
    }
    Ok(cards)
}

impl<'a> SuctionPage<'a> {
    /// The page with these cards.
    pub fn of(survey: &'a SuctionSurvey, cards: Vec<CardView>, job: &'a str) -> Self {
        let facts = &survey.facts;
        let strip_card = |card: &CardView| StripCard {
            caption: card.title.clone(),
            pictures: card.pictures.iter().map(|panel| panel.image.clone()).collect(),
        };
        let steps = facts.funnel().map(|(label, value)| Bar { label: label.to_owned(), value, ink: Ink::Complete });
        let lost = facts.lost.iter().filter(|(_, count)| *count > 0);
        let lost: Vec<Bar> =
            lost.map(|(label, value)| Bar { label: label.clone(), value: *value, ink: Ink::Reject }).collect();
        let charts = || [bar_chart("From poses to robust ones", &steps), bar_chart("Lost poses by reason", &lost)];
        Self {
            dataset: DatasetView::of(&facts.header),
            strip: StripPicture::strip(&(1..).zip(cards.iter().map(strip_card)).collect::<Vec<_>>()),
            speed: SpeedView::of(&facts.header, "bodies"),
            numbers: HeaderNumbers {
                kept: grouped(facts.kept),
                scenes: grouped(facts.scenes),
                with_free: grouped(facts.bodies_with_free),
                with_free_share: share(facts.bodies_with_free, facts.kept),
                poses: grouped(facts.poses),
                free: grouped(facts.free),
                robust: grouped(facts.robust),
            },
            rejects: Vec::new(),
            splits: split_rows(&facts.splits),
            funnel: (facts.poses > 0).then(charts),
            objects: facts.objects.iter().map(CupObject::cells).collect(),
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
            pictures: vec![PanelView::square(&picture, 1, "A free pose", "blue")],
        }
    }
}
