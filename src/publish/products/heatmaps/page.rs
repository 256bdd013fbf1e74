//! The page of a dataset of heatmaps: the grasps in the images, and pictures.

use serde::Serialize;

use super::{
    inspection::HeatmapSurvey,
    painting::{heatmap_words, marked_picture, patches_picture},
};
use crate::{
    chart::{Bar, Ink, bar_chart, grouped, percent},
    markup::Markup,
    page::{DatasetView, ImageView, SpeedView, StripCard, StripPicture, share_rows, split_rows},
    scene_objects::ScenesObject,
};
use format::{
    Depth, SceneHeatmap,
    dataset::{DatasetError, DatasetReader},
};
use kernel::words::Split;

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct HeatmapsPage<'a> {
    dataset: DatasetView<'a>,
    strip: Vec<StripPicture>,
    speed: Option<SpeedView>,
    numbers: HeaderNumbers,
    /// Root digest of the exact numbers of the picks.
    picks: Option<String>,
    /// Reason, count and share.
    rejects: Vec<[String; 3]>,
    /// Split and kept images.
    splits: Vec<[String; 2]>,
    /// Grasps by state and obstacle; `None` if no image is kept.
    ends: Option<Markup>,
    /// Index, type and digits of the chosen types; empty for a hand without types.
    types: Vec<Vec<String>>,
    cards: Vec<CardView>,
    /// Name and split.
    objects: Vec<[String; 2]>,
    job: &'a str,
}

/// The most important numbers.
#[derive(Serialize)]
struct HeaderNumbers {
    kept: String,
    /// Images with a free grasp.
    with_grasps: String,
    scenes: String,
    hand: String,
    /// Names of the hand's points.
    points: String,
    grasps: String,
    held: String,
    failed: String,
    forbidden: String,
    visible: String,
    all_points: String,
    visible_share: String,
    patches: String,
    share: String,
}

/// One image.
#[derive(Clone, Serialize)]
pub(crate) struct CardView {
    title: String,
    words: String,
    marked: ImageView,
    /// The patches of one grasp.
    patches: Option<ImageView>,
}

/// Longest side of a picture [px].
const SIDE: u32 = 640;

/// Width of a picture on the page [px].
const SHOWN_WIDTH: u32 = 480;

/// The images that a page shows.
pub(crate) fn cards(reader: &DatasetReader, survey: &HeatmapSurvey) -> Result<Vec<CardView>, DatasetError> {
    let mut cards = Vec::new();
    for index in &survey.shown {
        let Some(sample) = reader.sample(*index)? else { continue };
        let (heatmap, Some(depth)) = (sample.read::<SceneHeatmap>()?, sample.find::<Depth>()?) else { continue };
        let marked = marked_picture(&heatmap, &depth, SIDE).with_few_colours();
        let width = marked.width.min(SHOWN_WIDTH);
        let height = marked.height * width / marked.width.max(1);
        cards.push(CardView {
            title: format!("image {}, {}", sample.index, reader.splits().split_of(&sample.id).map_or("", Split::name)),
            words: heatmap_words(&heatmap),
            marked: ImageView::of(&marked, width, height),
            patches: patches_picture(&heatmap, &depth)
                .map(|picture| ImageView::of(&picture, picture.width, picture.height)),
        });
    }
    Ok(cards)
}

impl<'a> HeatmapsPage<'a> {
    /// The page with these cards.
    pub fn of(survey: &'a HeatmapSurvey, cards: Vec<CardView>, job: &'a str) -> Self {
        let facts = &survey.facts;
        let strip_card =
            |card: &CardView| StripCard { caption: card.title.clone(), pictures: vec![card.marked.clone()] };
        let bars = facts.ends().into_iter().map(|(label, value)| Bar { label, value, ink: Ink::Complete });
        let bars: Vec<Bar> = bars.collect();
        let [untried, held, failed] = facts.states;
        Self {
            dataset: DatasetView::of(&facts.header),
            strip: StripPicture::strip(&(1..).zip(cards.iter().map(strip_card)).collect::<Vec<_>>()),
            speed: SpeedView::of(&facts.header, "images"),
            numbers: HeaderNumbers {
                kept: grouped(facts.kept),
                with_grasps: grouped(facts.images_with_grasps),
                scenes: grouped(facts.scenes),
                hand: facts.hand.clone(),
                points: facts.points.join(", "),
                grasps: grouped(untried + held + failed),
                held: grouped(held),
                failed: grouped(failed),
                forbidden: grouped(facts.forbidden.iter().sum()),
                visible: grouped(facts.visible_points),
                all_points: grouped(facts.points_in_images),
                visible_share: facts.visible_share(),
                patches: grouped(facts.patches),
                share: percent(facts.kept as f64 / facts.samples.max(1) as f64),
            },
            picks: facts.picks.map(|root| root.to_string()),
            rejects: share_rows(&facts.rejected, facts.samples),
            splits: split_rows(&facts.splits),
            ends: (facts.kept > 0).then(|| bar_chart("Grasps that approach from the camera's side", &bars)),
            types: facts.type_rows(),
            objects: ScenesObject::rows(&facts.objects),
            cards,
            job,
        }
    }
}

#[cfg(test)]
impl CardView {
    /// A card of an image, with these words.
    pub fn example(words: &str) -> Self {
        let image = ImageView::of(&crate::picture::Picture::filled(1, 1, [0; 4]), 1, 1);
        Self {
            title: "image 3, training".to_owned(),
            words: words.to_owned(),
            marked: image.clone(),
            patches: Some(image),
        }
    }
}
