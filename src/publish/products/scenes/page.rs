//! The page of a dataset of scenes: kept and rejected scenes, pictures from above, stability.

use serde::Serialize;

use super::{
    inspection::{SceneSurvey, ScenesInspection},
    painting::{depth_from_above, instance_picture, scene_words},
};
use crate::{
    chart::{Bar, Ink, bar_chart, grouped, percent},
    markup::Markup,
    page::{BodyView, DatasetView, ImageView, SpeedView, StripCard, StripPicture, share_rows, split_rows},
};
use format::{
    Scene, SceneOverview,
    dataset::{DatasetError, DatasetReader},
};
use kernel::words::Split;

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct ScenesPage<'a> {
    dataset: DatasetView<'a>,
    strip: Vec<StripPicture>,
    speed: Option<SpeedView>,
    numbers: HeaderNumbers,
    /// Reason, count and share.
    rejects: Vec<[String; 3]>,
    /// Split and kept scenes.
    splits: Vec<[String; 2]>,
    /// Sentence about the checks of imported scenes.
    imported: Option<String>,
    /// Kept scenes by number of bodies; `None` if none is kept.
    bodies: Option<Markup>,
    spreads: Vec<Vec<String>>,
    cards: Vec<CardView>,
    /// Name, mass and split.
    objects: Vec<[String; 3]>,
    job: &'a str,
}

/// The most important numbers.
#[derive(Serialize)]
struct HeaderNumbers {
    kept: String,
    share: String,
    bodies: String,
    objects: String,
    gone: String,
}

/// One scene.
#[derive(Clone, Serialize)]
pub(crate) struct CardView {
    title: String,
    words: String,
    instances: ImageView,
    depth: Option<ImageView>,
    bodies: Vec<BodyView>,
}

/// Zoom of the pictures on a card, and in the strip.
const ZOOM: u32 = 2;

/// The scenes that a page shows.
pub(crate) fn cards(reader: &DatasetReader, survey: &SceneSurvey) -> Result<Vec<CardView>, DatasetError> {
    let mut cards = Vec::new();
    for index in &survey.shown {
        let Some(sample) = reader.sample(*index)? else { continue };
        let (scene, Some(overview)) = (sample.read::<Scene>()?, sample.find::<SceneOverview>()?) else { continue };
        let [width, height] = overview.size;
        let name_of = |object| {
            let found = survey.facts.objects.iter().find(|row| row.object == object);
            found.map_or("?", |row| row.name.as_str()).to_owned()
        };
        let bodies = (1..).zip(&scene.bodies).map(|(number, body)| {
            let resting =
                body.resting.map(|(pose, angle)| format!("{:.0}° from resting pose {}", angle.to_degrees(), pose + 1));
            let carried = scene.supports.iter().filter(|support| support.body == number);
            let by = |support: &format::SceneSupport| match support.by {
                format::CONTAINER => format!("{} carried by the container", percent(support.share)),
                other => format!("{} by {other}", percent(support.share)),
            };
            let words: Vec<String> = resting.into_iter().chain(carried.map(by)).collect();
            BodyView::new(number, name_of(body.object), words.join(", "))
        });
        cards.push(CardView {
            title: format!("scene {}, {}", sample.index, reader.splits().split_of(&sample.id).map_or("", Split::name)),
            words: scene_words(&scene),
            bodies: bodies.collect(),
            instances: ImageView::of(&instance_picture(&overview, ZOOM), width * ZOOM / 2, height * ZOOM / 2),
            depth: depth_from_above(&overview, ZOOM)
                .map(|picture| ImageView::of(&picture, width * ZOOM / 2, height * ZOOM / 2)),
        });
    }
    Ok(cards)
}

impl<'a> ScenesPage<'a> {
    /// The page with these cards.
    pub fn of(survey: &'a SceneSurvey, cards: Vec<CardView>, job: &'a str) -> Self {
        let facts = &survey.facts;
        let strip_card = |card: &CardView| StripCard {
            caption: card.title.clone(),
            pictures: std::iter::once(card.instances.clone()).chain(card.depth.clone()).collect(),
        };
        let bars: Vec<Bar> = facts
            .by_bodies
            .iter()
            .map(|(bodies, count)| Bar { label: format!("{bodies} bodies"), value: *count, ink: Ink::Complete })
            .collect();
        Self {
            dataset: DatasetView::of(&facts.header),
            strip: StripPicture::strip(&(1..).zip(cards.iter().map(strip_card)).collect::<Vec<_>>()),
            speed: SpeedView::of(&facts.header, "scenes"),
            numbers: HeaderNumbers {
                kept: grouped(facts.kept),
                share: percent(facts.kept as f64 / facts.samples.max(1) as f64),
                bodies: grouped(facts.bodies),
                objects: grouped(facts.objects.len() as u64),
                gone: grouped(facts.gone),
            },
            rejects: share_rows(&facts.rejected, facts.samples),
            splits: split_rows(&facts.splits),
            imported: facts.imported.map(|imported| imported.words()),
            bodies: (!bars.is_empty()).then(|| bar_chart("Kept scenes by number of bodies", &bars)),
            spreads: facts.spreads().into_iter().map(|row| row.into_cells()).collect(),
            objects: objects(facts),
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
            title: "scene 3, training".to_owned(),
            words: "1 bodies".to_owned(),
            instances: image.clone(),
            depth: Some(image),
            bodies: vec![BodyView::new(1, name, "100 % carried by the container".to_owned())],
        }
    }
}

fn objects(facts: &ScenesInspection) -> Vec<[String; 3]> {
    let row = |object: &super::SceneObject| {
        let mass = object.mass.map_or_else(String::new, |mass| format!("{mass:.3} kg"));
        [object.name.clone(), mass, object.split.map_or("", Split::name).to_owned()]
    };
    facts.objects.iter().map(row).collect()
}
