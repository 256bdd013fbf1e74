//! The row of scenes in the table of products.

use super::{
    headline::{BODIES, headline},
    inspection::SceneSurvey,
    page::{ScenesPage, cards},
    painting::{instance_picture, scene_words},
    templates::TEMPLATES,
};
use crate::{
    asset::{AssetKind, AssetUse},
    chart::grouped,
    inspection::Inspection,
    numbers::{NumberRow, Numbers},
    picture::{Panel, Picture},
    preview::write_scene_preview,
    product::{PICTURES, Page, ProductAssets, ProductPages, ProductWords, SampleParts, Survey},
    templates::page_values,
};
use format::{
    Product, Scene, SceneOverview,
    dataset::{DatasetError, DatasetReader, Sample},
    products::grasps::SHAPES,
};

/// Pages, texts and pictures of scenes.
pub static PAGES: ProductPages = ProductPages {
    product: Product::SCENES,
    words: ProductWords {
        lead: "Bodies dropped or put down and settled on their true meshes, in a bin or on a plane, with poses, contacts, forces and support relations.",
        sample: "one settled scene",
        labels: "the pose of every body, contacts with their forces, and the share of each body's weight that another carries",
        acquisition: "Bodies were released in MuJoCo with contacts of the true meshes, and scenes were kept if they came to rest and stay at rest when simulated again from the stored poses.",
        reading: "`shapes.mcap` contains the objects' meshes, so that scenes can be loaded into any simulator.",
        legend: "Each picture shows a scene from above: one colour per body, lighter where it is higher; walls are grey.",
        regenerated: 16,
        tasks: &["robotics"],
    },
    templates: &TEMPLATES,
    survey: |reader| Ok(Box::new(SceneSurvey::of(reader)?)),
    parts: Some(SampleParts { noun: BODIES, count: |manifest| manifest.counts.fact("bodies") }),
    headline,
    counts_in_words: |_, _| Ok(Vec::new()),
    warnings: |_| Ok(Vec::new()),
    write_preview: |reader, _| Ok(write_scene_preview(reader)?),
    preview_shows_more: false,
    assets: ProductAssets {
        subjects: AssetKind::Object,
        objects: AssetUse::Copied,
        descriptions: AssetUse::Measured,
        shape_files: &[SHAPES],
        data_files: &[],
    },
};

/// Zoom of the pictures of a release.
const ZOOM: u32 = 2;

impl Survey for SceneSurvey {
    fn inspection(&self) -> Inspection {
        Inspection::of(&self.facts)
    }

    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError> {
        let (cards, job) = (cards(reader, self)?, reader.job_text()?);
        let shown = cards.len();
        Ok(Page { values: page_values(&ScenesPage::of(self, cards, &job)), shown })
    }

    fn add_numbers(&self, numbers: &mut Numbers) {
        let facts = &self.facts;
        numbers.rows.push(NumberRow::new("bodies at rest", grouped(facts.bodies)));
        numbers.rows.push(NumberRow::new("bodies that left their container", grouped(facts.gone)));
        numbers.spreads = facts.spreads();
    }

    fn pictures(&self, reader: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError> {
        let mut drawn = Vec::new();
        for index in self.shown.iter().take(PICTURES) {
            let Some(sample) = reader.sample(*index)? else { continue };
            if let Some(overview) = sample.find::<SceneOverview>()? {
                drawn.push((scene_words(&sample.read::<Scene>()?), instance_picture(&overview, ZOOM)));
            }
        }
        Ok(drawn)
    }

    fn panels(&self, _: &DatasetReader, sample: &Sample, side: u32) -> Result<Vec<Panel>, DatasetError> {
        let Some(overview) = sample.find::<SceneOverview>()? else { return Ok(Vec::new()) };
        let zoom = (side / overview.size[0].max(overview.size[1])).max(1);
        Ok(vec![Panel { caption: "from above".to_owned(), picture: instance_picture(&overview, zoom) }])
    }
}
