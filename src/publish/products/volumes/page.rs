//! The page of a dataset of volumes: kept and rejected volumes, distributions, pictures.

use serde::Serialize;

use super::{
    inspection::{VolumeSurvey, images_in_words},
    painting::VolumePictures,
};
use crate::{
    chart::{Bar, Ink, bar_chart, grouped, percent},
    markup::Markup,
    page::{DatasetView, PanelView, SpeedView, StripCard, StripPicture, share_rows, split_rows},
    picture::Picture,
    scene_objects::ScenesObject,
    tally::SpreadRow,
};
use format::{
    SceneVolume, VolumeTruth,
    dataset::{DatasetError, DatasetReader},
};
use kernel::words::{Split, number_ranges};

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct VolumesPage<'a> {
    dataset: DatasetView<'a>,
    strip: Vec<StripPicture>,
    speed: Option<SpeedView>,
    numbers: HeaderNumbers,
    /// Reason, count and share.
    rejects: Vec<[String; 3]>,
    /// Split and kept volumes.
    splits: Vec<[String; 2]>,
    /// Kept volumes by the number of images; `None` if no volume is kept.
    images: Option<Markup>,
    spreads: Vec<Vec<String>>,
    /// Grasps by state; `None` if the dataset has none.
    grasps: Option<Markup>,
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
    images: String,
    bodies: String,
    inside: String,
}

/// One volume.
#[derive(Clone, Serialize)]
pub(crate) struct CardView {
    title: String,
    words: String,
    pictures: Vec<PanelView>,
}

/// Side of a picture [px]: twice its size on the page, so that it is sharp on high-resolution screens.
const SIDE: u32 = 400;

/// Side of a picture on the page [px].
const SHOWN_SIDE: u32 = 200;

/// One line about a volume.
pub(super) fn volume_words(volume: &SceneVolume, truth: &VolumeTruth) -> String {
    let views: Vec<u32> = volume.views.iter().map(|view| view.view).collect();
    format!(
        "{} (views {}) · {} of {} bodies inside · {} of {} voxels observed · voxel {:.2} mm",
        images_in_words(views.len() as u32),
        number_ranges(&views).join(", "),
        truth.bodies_inside(),
        truth.bodies.len(),
        grouped(volume.observed().into()),
        grouped(volume.grid.voxels() as u64),
        volume.grid.voxel() * 1e3,
    )
}

/// The volumes that a page shows.
pub(crate) fn cards(reader: &DatasetReader, survey: &VolumeSurvey) -> Result<Vec<CardView>, DatasetError> {
    let mut cards = Vec::new();
    for index in &survey.shown {
        let Some(sample) = reader.sample(*index)? else { continue };
        let (pictures, volume, truth) = VolumePictures::of(&sample, SIDE)?;
        let panel = |picture: &Picture, name, hint| PanelView::square(picture, SHOWN_SIDE, name, hint);
        let split = reader.splits().split_of(&sample.id).map_or("", Split::name).replace('_', " ");
        cards.push(CardView {
            title: format!("volume {}", sample.index),
            words: format!("{split} · {}", volume_words(&volume, &truth)),
            pictures: vec![
                panel(&pictures.seen, "Fused surface", "blue: observed in an image"),
                panel(&pictures.truth, "True bodies", "orange, without the container"),
                panel(&pictures.side, "Distances, from the side", "x right, z up"),
                panel(&pictures.true_side, "Truth, from the side", "x right, z up"),
                panel(&pictures.top, "Distances, from above", "x right, y up"),
                panel(&pictures.true_top, "Truth, from above", "x right, y up"),
            ]
            .into_iter()
            .chain(
                pictures
                    .grasps
                    .as_ref()
                    .map(|picture| panel(picture, "Grasps, from above", "green: held, red: failed, blue: untried")),
            )
            .collect(),
        });
    }
    Ok(cards)
}

impl<'a> VolumesPage<'a> {
    /// The page with these cards.
    pub fn of(survey: &'a VolumeSurvey, cards: Vec<CardView>, job: &'a str) -> Self {
        let facts = &survey.facts;
        let strip_card = |card: &CardView| StripCard {
            caption: card.title.clone(),
            pictures: card.pictures.iter().take(2).map(|panel| panel.image.clone()).collect(),
        };
        let bar =
            |(images, count): (&u32, &u64)| Bar { label: images_in_words(*images), value: *count, ink: Ink::Complete };
        let bars: Vec<Bar> = facts.by_images.iter().map(bar).collect();
        Self {
            dataset: DatasetView::of(&facts.header),
            strip: StripPicture::strip(&(1..).zip(cards.iter().map(strip_card)).collect::<Vec<_>>()),
            speed: SpeedView::of(&facts.header, "volumes"),
            numbers: HeaderNumbers {
                kept: grouped(facts.kept),
                share: percent(facts.kept as f64 / facts.samples.max(1) as f64),
                scenes: grouped(facts.scenes),
                images: grouped(facts.images),
                bodies: grouped(facts.bodies),
                inside: grouped(facts.bodies_inside),
            },
            rejects: share_rows(&facts.rejected, facts.samples),
            splits: split_rows(&facts.splits),
            images: (facts.kept > 0).then(|| bar_chart("Volumes by the number of images fused", &bars)),
            spreads: facts.spread_rows().into_iter().map(SpreadRow::into_cells).collect(),
            grasps: facts.grasps.as_ref().map(|grasps| {
                let bars = grasps.rows().into_iter().map(|(label, value)| Bar { label, value, ink: Ink::Complete });
                bar_chart("Grasps in the volumes", &bars.collect::<Vec<_>>())
            }),
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
            pictures: vec![PanelView::square(&picture, 1, "Fused surface", "blue")],
        }
    }
}
