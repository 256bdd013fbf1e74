//! The row of heatmaps in the table of products.

use super::{
    headline::headline,
    inspection::HeatmapSurvey,
    page::{HeatmapsPage, cards},
    painting::{heatmap_panel, heatmap_words, marked_picture, patches_picture},
    templates::TEMPLATES,
};
use crate::{
    asset::{AssetKind, AssetUse},
    chart::grouped,
    inspection::Inspection,
    numbers::{NumberRow, Numbers},
    picture::{Panel, Picture},
    preview::write_heatmap_preview,
    product::{PICTURES, Page, ProductAssets, ProductPages, ProductWords, SampleParts, Survey},
    scene_samples::{ScenePanel, SceneSample},
    templates::page_values,
};
use format::{
    Depth, HeatmapFacts, Noun, Product, SceneHeatmap,
    dataset::{DatasetError, DatasetReader, Sample},
};

/// Pages, texts and pictures of heatmaps.
pub static PAGES: ProductPages = ProductPages {
    product: Product::HEATMAPS,
    words: ProductWords {
        lead: "Images of settled scenes with the grasps of all bodies: the positions of palm and fingertips in the image, and the outcomes of trials among the neighbours.",
        sample: "one image of one settled scene, with the grasps that approach from the camera's side",
        labels: "for each grasp its type, body and label, whether it held, failed or was not tried, and for each of its points the pixel and its visibility; forbidden grasps are background",
        acquisition: "Grasps of another dataset, with the outcomes of their trials, were projected into depth images of the scenes, \
                      which were rendered again from the poses of a third dataset.",
        reading: "",
        legend: "Each picture shows one image: depth in grey, near light; points of held grasps are green, of failed ones red, of untried ones blue; small dark dots are palms of forbidden grasps.",
        regenerated: 64,
        tasks: &["robotics"],
    },
    templates: &TEMPLATES,
    survey: |reader| Ok(Box::new(HeatmapSurvey::of(reader)?)),
    parts: Some(SampleParts {
        noun: Noun { one: "free grasp", many: "free grasps" },
        count: |manifest| ["untried", "held", "failed"].iter().map(|fact| manifest.counts.fact(fact)).sum(),
    }),
    headline,
    counts_in_words: |_, _| Ok(Vec::new()),
    warnings: |_| Ok(Vec::new()),
    write_preview: |reader, _| Ok(write_heatmap_preview(reader)?),
    preview_shows_more: false,
    assets: ProductAssets {
        subjects: AssetKind::Object,
        objects: AssetUse::Derived,
        descriptions: AssetUse::Measured,
        shape_files: &[],
        data_files: &[],
    },
};

/// Longest side of the pictures of a release [px].
const SIDE: u32 = 480;

impl Survey for HeatmapSurvey {
    fn inspection(&self) -> Inspection {
        Inspection::of(&self.facts)
    }

    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError> {
        let (cards, job) = (cards(reader, self)?, reader.job_text()?);
        let shown = cards.len();
        Ok(Page { values: page_values(&HeatmapsPage::of(self, cards, &job)), shown })
    }

    fn add_numbers(&self, numbers: &mut Numbers) {
        let facts = &self.facts;
        let mut add = |name: String, count: u64| numbers.rows.push(NumberRow::new(name, grouped(count)));
        add("scenes".to_owned(), facts.scenes);
        add("images with a free grasp".to_owned(), facts.images_with_grasps);
        for (name, count) in facts.ends() {
            add(format!("grasps {name}"), count);
        }
        add("points in the images".to_owned(), facts.points_in_images);
        add("visible points".to_owned(), facts.visible_points);
        add("grasps with patches".to_owned(), facts.patches);
    }

    fn pictures(&self, reader: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError> {
        let mut drawn = Vec::new();
        for index in self.shown.iter().take(PICTURES) {
            let Some(sample) = reader.sample(*index)? else { continue };
            if let Some(depth) = sample.find::<Depth>()? {
                let heatmap = sample.read::<SceneHeatmap>()?;
                drawn.push((heatmap_words(&heatmap), marked_picture(&heatmap, &depth, SIDE).with_few_colours()));
            }
        }
        Ok(drawn)
    }

    fn panels(&self, _: &DatasetReader, sample: &Sample, side: u32) -> Result<Vec<Panel>, DatasetError> {
        let Some(depth) = sample.find::<Depth>()? else { return Ok(Vec::new()) };
        let heatmap = sample.read::<SceneHeatmap>()?;
        let panel = |caption: &str, picture| Panel { caption: caption.to_owned(), picture };
        let patches = patches_picture(&heatmap, &depth).filter(|picture| picture.width.max(picture.height) <= side);
        let patches = patches.map(|picture| panel("patches of a grasp", picture));
        let marked = panel("grasps", marked_picture(&heatmap, &depth, side));
        Ok([marked].into_iter().chain(patches).collect())
    }

    /// Images with a free grasp, those with the most first.
    fn scene_samples(&self, reader: &DatasetReader) -> Result<Vec<SceneSample>, DatasetError> {
        SceneSample::all(reader, |row| {
            let grasps = HeatmapFacts::from(&row.facts).grasps();
            (grasps > 0).then(|| (Some(row.sample.item), 1.0 / f64::from(grasps)))
        })
    }

    fn scene_panels(&self, _: &DatasetReader, sample: &Sample) -> Result<Vec<ScenePanel>, DatasetError> {
        let Some(depth) = sample.find::<Depth>()? else { return Ok(Vec::new()) };
        Ok(vec![heatmap_panel(&sample.read::<SceneHeatmap>()?, &depth)])
    }
}
