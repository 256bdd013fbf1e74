//! The page of a dataset of views: kept and rejected views, visibility of the bodies, pictures.

use serde::Serialize;

use super::{
    inspection::ViewSurvey,
    painting::{colour_picture, depth_of_view, instance_picture, step_for, view_words},
};
use crate::{
    chart::{Bar, Ink, bar_chart, grouped, percent},
    markup::Markup,
    page::{BodyView, DatasetView, ImageView, SpeedView, StripCard, StripPicture, share_rows, split_rows},
    scene_objects::ScenesObject,
};
use format::{
    Depth, SceneColour, SceneImage, SceneInstance,
    dataset::{DatasetError, DatasetReader},
};
use kernel::words::Split;

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct ViewsPage<'a> {
    dataset: DatasetView<'a>,
    strip: Vec<StripPicture>,
    speed: Option<SpeedView>,
    numbers: HeaderNumbers,
    /// Reason, count and share.
    rejects: Vec<[String; 3]>,
    /// Split and kept views.
    splits: Vec<[String; 2]>,
    /// Bodies by visible share; `None` if no view is kept.
    bodies: Option<Markup>,
    /// Text, count and share.
    strata: Vec<[String; 3]>,
    cards: Vec<CardView>,
    /// Name and split.
    objects: Vec<[String; 2]>,
    job: &'a str,
}

/// The most important numbers.
#[derive(Serialize)]
struct HeaderNumbers {
    kept: String,
    share: String,
    scenes: String,
    bodies: String,
    /// Bodies with a visible pixel.
    seen: String,
    truncated: String,
    too_near: Option<String>,
    near_draws: String,
    unseen_draws: String,
}

/// One view.
#[derive(Clone, Serialize)]
pub(crate) struct CardView {
    title: String,
    words: String,
    instances: ImageView,
    depth: Option<ImageView>,
    colour: Option<ImageView>,
    bodies: Vec<BodyView>,
}

/// Longest side of a picture [px].
const SIDE: u32 = 640;

/// The views that a page shows.
pub(crate) fn cards(reader: &DatasetReader, survey: &ViewSurvey) -> Result<Vec<CardView>, DatasetError> {
    let mut cards = Vec::new();
    for index in &survey.shown {
        let Some(sample) = reader.sample(*index)? else { continue };
        let (image, Some(depth)) = (sample.read::<SceneImage>()?, sample.find::<Depth>()?) else { continue };
        let name_of = |object| ScenesObject::name_of(&survey.facts.objects, object).to_owned();
        let row = |(number, body): (u32, &SceneInstance)| {
            let pixels = format!("{} of {} px", grouped(body.pixels_visible.into()), grouped(body.pixels_all.into()));
            BodyView::new(number, name_of(body.object), format!("{} visible, {pixels}", percent(body.visible_share())))
        };
        let step = step_for(&image, SIDE);
        let (width, height) = (image.camera.width.div_ceil(step), image.camera.height.div_ceil(step));
        cards.push(CardView {
            title: format!("view {}, {}", sample.index, reader.splits().split_of(&sample.id).map_or("", Split::name)),
            words: view_words(&image),
            bodies: (1..).zip(&image.bodies).map(row).collect(),
            instances: ImageView::of(&instance_picture(&image, &depth, step).with_few_colours(), width, height),
            depth: depth_of_view(&image, &depth, step)
                .map(|picture| ImageView::of(&picture.with_few_colours(), width, height)),
            colour: (sample.find::<SceneColour>()?)
                .map(|colour| ImageView::of(&colour_picture(&colour, step).with_few_colours(), width, height)),
        });
    }
    Ok(cards)
}

impl<'a> ViewsPage<'a> {
    /// The page with these cards.
    pub fn of(survey: &'a ViewSurvey, cards: Vec<CardView>, job: &'a str) -> Self {
        let facts = &survey.facts;
        let strip_card = |card: &CardView| StripCard {
            caption: card.title.clone(),
            pictures: [Some(card.instances.clone()), card.depth.clone(), card.colour.clone()]
                .into_iter()
                .flatten()
                .collect(),
        };
        let bar = |(words, count): &(String, u64)| Bar { label: words.clone(), value: *count, ink: Ink::Complete };
        let bars: Vec<Bar> = facts.strata.iter().map(bar).collect();
        Self {
            dataset: DatasetView::of(&facts.header),
            strip: StripPicture::strip(&(1..).zip(cards.iter().map(strip_card)).collect::<Vec<_>>()),
            speed: SpeedView::of(&facts.header, "views"),
            numbers: HeaderNumbers {
                kept: grouped(facts.kept),
                share: percent(facts.kept as f64 / facts.samples.max(1) as f64),
                scenes: grouped(facts.scenes),
                bodies: grouped(facts.bodies),
                seen: grouped(facts.bodies.saturating_sub(facts.strata.first().map_or(0, |(_, unseen)| *unseen))),
                truncated: grouped(facts.truncated),
                too_near: (facts.too_near > 0).then(|| grouped(facts.too_near)),
                near_draws: grouped(facts.near_draws),
                unseen_draws: grouped(facts.unseen_draws),
            },
            rejects: share_rows(&facts.rejected, facts.samples),
            splits: split_rows(&facts.splits),
            bodies: (facts.bodies > 0).then(|| bar_chart("Bodies by visible share", &bars)),
            strata: facts.stratum_rows(),
            objects: ScenesObject::rows(&facts.objects),
            cards,
            job,
        }
    }
}

#[cfg(test)]
impl CardView {
    /// A card of one body of this name.
    pub fn example(name: &str) -> Self {
        let image = ImageView::of(&crate::picture::Picture::filled(1, 1, [0; 4]), 1, 1);
        Self {
            title: "view 3, training".to_owned(),
            words: "1 of 1 bodies are visible".to_owned(),
            instances: image.clone(),
            depth: Some(image.clone()),
            colour: Some(image),
            bodies: vec![BodyView::new(1, name, "100 % visible".to_owned())],
        }
    }
}
