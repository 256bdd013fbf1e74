//! The row of views in the table of products.

use super::{
    headline::headline,
    inspection::ViewSurvey,
    nearness::nearness_warning,
    page::{ViewsPage, cards},
    painting::{colour_picture, depth_of_view, instance_picture, step_for, view_panels, view_words},
    templates::TEMPLATES,
};
use crate::{
    asset::{AssetKind, AssetUse},
    chart::grouped,
    inspection::Inspection,
    numbers::{NumberRow, Numbers},
    picture::{Panel, Picture},
    preview::write_view_preview,
    product::{PICTURES, Page, ProductAssets, ProductPages, ProductWords, SampleParts, Survey},
    scene_samples::{ScenePanel, SceneSample},
    templates::page_values,
};
use format::{
    Depth, Noun, Product, SceneColour, SceneImage, ViewFacts,
    dataset::{DatasetError, DatasetReader, Sample},
    products::grasps::SHAPES,
};

/// Pages, texts and pictures of views.
pub static PAGES: ProductPages = ProductPages {
    product: Product::VIEWS,
    words: ProductWords {
        lead: "Images of settled scenes: depth, the body at each pixel, and the full silhouette of every body, with poses of camera and bodies.",
        sample: "one settled scene in the image of one camera",
        labels: "the body at each pixel, the full silhouette of each body with its boxes and its visible share, and the pose of every body",
        acquisition: "Every body of a scene was rendered alone, and the nearest surface was taken for each pixel; if the job has a sensor, its model was applied to the whole image.",
        reading: "",
        legend: "Each picture shows one view: one colour per body, lighter where it is nearer; walls are grey.",
        regenerated: 64,
        tasks: &["image-segmentation", "robotics"],
    },
    templates: &TEMPLATES,
    survey: |reader| Ok(Box::new(ViewSurvey::of(reader)?)),
    parts: Some(SampleParts {
        noun: Noun { one: "body", many: "bodies" },
        count: |manifest| manifest.counts.fact("bodies"),
    }),
    headline,
    counts_in_words: |_, _| Ok(Vec::new()),
    warnings: |reader| Ok(nearness_warning(reader)?.into_iter().collect()),
    write_preview: |reader, _| Ok(write_view_preview(reader)?),
    preview_shows_more: false,
    assets: ProductAssets {
        subjects: AssetKind::Object,
        objects: AssetUse::Copied,
        descriptions: AssetUse::Measured,
        shape_files: &[SHAPES],
        data_files: &[],
    },
};

/// Longest side of the pictures of a release [px].
const SIDE: u32 = 480;

impl Survey for ViewSurvey {
    fn inspection(&self) -> Inspection {
        Inspection::of(&self.facts)
    }

    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError> {
        let (cards, job) = (cards(reader, self)?, reader.job_text()?);
        let shown = cards.len();
        Ok(Page { values: page_values(&ViewsPage::of(self, cards, &job)), shown })
    }

    fn add_numbers(&self, numbers: &mut Numbers) {
        let facts = &self.facts;
        numbers.rows.push(NumberRow::new("scenes", grouped(facts.scenes)));
        for (words, count) in &facts.strata {
            numbers.rows.push(NumberRow::new(format!("bodies {words}"), grouped(*count)));
        }
        numbers.rows.push(NumberRow::new("bodies that extend beyond the image", grouped(facts.truncated)));
        if facts.too_near > 0 {
            let row = NumberRow::new("bodies at least half nearer than the sensor's range", grouped(facts.too_near));
            numbers.rows.push(row);
        }
    }

    fn pictures(&self, reader: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError> {
        let mut drawn = Vec::new();
        for index in self.shown.iter().take(PICTURES) {
            let Some(sample) = reader.sample(*index)? else { continue };
            if let Some(depth) = sample.find::<Depth>()? {
                let image = sample.read::<SceneImage>()?;
                drawn.push((view_words(&image), instance_picture(&image, &depth, step_for(&image, SIDE))));
            }
        }
        Ok(drawn)
    }

    fn panels(&self, _: &DatasetReader, sample: &Sample, side: u32) -> Result<Vec<Panel>, DatasetError> {
        let Some(depth) = sample.find::<Depth>()? else { return Ok(Vec::new()) };
        let image = sample.read::<SceneImage>()?;
        let step = step_for(&image, side);
        let bodies = Panel { caption: "bodies".to_owned(), picture: instance_picture(&image, &depth, step) };
        let depth = depth_of_view(&image, &depth, step);
        let colour = sample.find::<SceneColour>()?.map(|colour| colour_picture(&colour, step));
        let panel = |caption: &str, picture: Option<Picture>| {
            picture.map(|picture| Panel { caption: caption.to_owned(), picture })
        };
        Ok([bodies].into_iter().chain(panel("depth", depth)).chain(panel("colours", colour)).collect())
    }

    /// Views with a visible body, those with the most bodies first.
    fn scene_samples(&self, reader: &DatasetReader) -> Result<Vec<SceneSample>, DatasetError> {
        SceneSample::all(reader, |row| {
            let facts = ViewFacts::from(&row.facts);
            let seen = facts.bodies.saturating_sub(facts.unseen);
            (seen > 0).then(|| (Some(row.sample.item), 1.0 / f64::from(seen)))
        })
    }

    fn scene_panels(&self, _: &DatasetReader, sample: &Sample) -> Result<Vec<ScenePanel>, DatasetError> {
        let Some(depth) = sample.find::<Depth>()? else { return Ok(Vec::new()) };
        Ok(view_panels(&sample.read::<SceneImage>()?, &depth, sample.find::<SceneColour>()?.as_ref()))
    }
}
