//! The row of amodal pairs in the table of products.

use super::{
    headline::headline,
    inspection::AmodalSurvey,
    page::{AmodalPage, cards},
    painting::{PairPictures, pair_panel},
    templates::TEMPLATES,
};
use crate::{
    asset::{AssetKind, AssetUse},
    chart::grouped,
    inspection::Inspection,
    numbers::{NumberRow, Numbers},
    picture::{Panel, Picture},
    preview::{PREVIEWED, preview_samples, write_preview},
    product::{PICTURES, Page, ProductAssets, ProductPages, ProductWords, Survey},
    scene_objects::ScenesObject,
    scene_samples::{ScenePanel, SceneSample},
    templates::page_values,
    touch::TouchFacts,
};
use format::{
    AmodalFacts, Product,
    dataset::{DatasetError, DatasetReader, Sample},
};

/// Pages, texts and pictures of amodal pairs.
pub static PAGES: ProductPages = ProductPages {
    product: Product::AMODAL,
    words: ProductWords {
        lead: "Pairs of occupancy grids of bodies in clutter: the visible part of a body in one depth image, and the whole solid, on the same grid, with the visible and solid cells of its surroundings.",
        sample: "one body of a settled scene, seen by one camera",
        labels: "the whole solid of each visible part, and the cells of other bodies, container and table, computed from meshes and poses",
        acquisition: "The depth of each body was extracted from an image of a settled scene, and grids were computed from this depth and the meshes.",
        reading: "",
        legend: "From left to right: visible cells (the body in blue, everything else in grey), the whole body (hidden cells in orange), the same from behind, and a cut with the solid surroundings in grey.",
        regenerated: 64,
        tasks: &["robotics", "image-to-3d"],
    },
    templates: &TEMPLATES,
    survey: |reader| Ok(Box::new(AmodalSurvey::of(reader)?)),
    parts: None,
    headline,
    counts_in_words: |_, _| Ok(Vec::new()),
    warnings: |_| Ok(Vec::new()),
    write_preview: |reader, _| {
        let samples = preview_samples(reader, PREVIEWED as u32)?;
        Ok(write_preview(reader.folder(), &samples)?)
    },
    preview_shows_more: false,
    assets: ProductAssets {
        subjects: AssetKind::Object,
        objects: AssetUse::Derived,
        descriptions: AssetUse::Measured,
        shape_files: &[],
        data_files: &[],
    },
};

/// Side of each part of a sample's picture in a release [px].
const SIDE: u32 = 240;

impl Survey for AmodalSurvey {
    fn inspection(&self) -> Inspection {
        Inspection::of(&self.facts)
    }

    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError> {
        let (cards, job) = (cards(reader, self)?, reader.job_text()?);
        let shown = cards.len();
        Ok(Page { values: page_values(&AmodalPage::of(self, cards, &job)), shown })
    }

    fn add_numbers(&self, numbers: &mut Numbers) {
        let facts = &self.facts;
        numbers.rows.push(NumberRow::new("scenes", grouped(facts.scenes)));
        for (words, _, kept) in facts.strata.iter().filter(|(.., kept)| *kept > 0) {
            numbers.rows.push(NumberRow::new(format!("pairs of bodies {words}"), grouped(*kept)));
        }
        numbers.rows.push(NumberRow::new("pairs of bodies that extend beyond the image", grouped(facts.truncated)));
        numbers.rows.extend(facts.touch.iter().flat_map(TouchFacts::number_rows));
        numbers.spreads = facts.spread_rows();
    }

    fn pictures(&self, reader: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError> {
        let mut drawn = Vec::new();
        for index in self.shown.iter().take(PICTURES) {
            let Some(sample) = reader.sample(*index)? else { continue };
            let (pictures, _, clutter) = PairPictures::of(&sample, SIDE)?;
            let caption =
                format!("{}, view {}", ScenesObject::name_of(&self.facts.objects, clutter.object), sample.id.item);
            drawn.push((caption, pictures.row(SIDE)));
        }
        Ok(drawn)
    }

    fn panels(&self, _: &DatasetReader, sample: &Sample, side: u32) -> Result<Vec<Panel>, DatasetError> {
        Ok(PairPictures::of(sample, side)?.0.panels())
    }

    /// Half-visible bodies come first; if a body extends beyond the image, its hidden part is not hidden by a neighbour.
    fn scene_samples(&self, reader: &DatasetReader) -> Result<Vec<SceneSample>, DatasetError> {
        SceneSample::all(reader, |row| {
            let facts = AmodalFacts::from(&row.facts);
            Some((Some(row.sample.item), (facts.visible_share - 0.5).abs() + f64::from(facts.truncated)))
        })
    }

    fn scene_panels(&self, _: &DatasetReader, sample: &Sample) -> Result<Vec<ScenePanel>, DatasetError> {
        Ok(vec![pair_panel(sample, |object| ScenesObject::name_of(&self.facts.objects, object))?])
    }
}
