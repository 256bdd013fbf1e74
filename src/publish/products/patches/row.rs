//! The row of patches in the table of products.

use super::{
    inspection::{PatchSurvey, headline, is_by_trials, types_in_words},
    page::PatchesPage,
    sheets::{PatchSheet, cards},
    templates::TEMPLATES,
};
use crate::{
    asset::{AssetKind, AssetUse},
    chart::grouped,
    inspection::Inspection,
    numbers::{NumberRow, Numbers},
    picture::Picture,
    preview::{PREVIEWED, write_patch_preview},
    product::{PICTURES, Page, ProductAssets, ProductPages, ProductWords, Survey},
    tally::SpreadRow,
    templates::page_values,
};
use format::{
    Product,
    dataset::{DatasetError, DatasetReader},
    extras::read_types,
};

/// Pages, texts and pictures of patches.
pub static PAGES: ProductPages = ProductPages {
    product: Product::PATCHES,
    words: ProductWords {
        lead: "Square patches of depth around the palm and the fingertips of grasps, with the labels of heatmaps by grasp type.",
        sample: "one grasp in the image of one camera",
        labels: "the type of the grasp and its quality or the outcome of its trials, at each of four points",
        acquisition: "Grasps of another dataset were projected into rendered images of their objects, and patches were cut out.",
        reading: "",
        legend: "From left to right: the patches around the palm and the three fingertips of one grasp.",
        regenerated: 64,
        tasks: &["robotics"],
    },
    templates: &TEMPLATES,
    survey: |reader| Ok(Box::new(PatchSurvey::of(reader)?)),
    parts: None,
    headline,
    counts_in_words: |folder, manifest| Ok(vec![types_in_words(&read_types(folder)?, is_by_trials(manifest))]),
    warnings: |_| Ok(Vec::new()),
    write_preview: |reader, _| Ok(write_patch_preview(reader, PREVIEWED)?),
    preview_shows_more: false,
    assets: ProductAssets {
        subjects: AssetKind::Object,
        objects: AssetUse::Derived,
        descriptions: AssetUse::Measured,
        shape_files: &[],
        data_files: &[],
    },
};

impl Survey for PatchSurvey {
    fn inspection(&self) -> Inspection {
        Inspection::of(&self.facts)
    }

    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError> {
        let (cards, job) = (cards(reader, self)?, reader.job_text()?);
        let shown = cards.len();
        Ok(Page { values: page_values(&PatchesPage::of(self, cards, &job)), shown })
    }

    fn add_numbers(&self, numbers: &mut Numbers) {
        let facts = &self.facts;
        let rows = &mut numbers.rows;
        let chosen_from = match facts.outcomes {
            Some(_) => "tried grasps of the dataset of grasps",
            None => "kept grasps of the dataset of grasps",
        };
        rows.extend(facts.hand.iter().map(|hand| NumberRow::new("hand", hand)));
        rows.push(NumberRow::new(chosen_from, grouped(facts.kept_grasps)));
        rows.push(NumberRow::new("different types among them", grouped(facts.different_types)));
        rows.push(NumberRow::new("types chosen", grouped(facts.types.len() as u64)));
        rows.push(NumberRow::new("patches in colour", if facts.colour { "yes" } else { "no" }));
        for (label, count) in facts.outcomes.iter().flatten() {
            rows.push(NumberRow::new(format!("label {label}"), grouped(*count)));
        }
        if let Some(visible) = facts.visible_points {
            rows.push(NumberRow::new("visible points", grouped(visible)));
        }
        let digest = facts.grasps.iter();
        rows.extend(digest.map(|grasps| NumberRow::with_code("exact digest of the dataset of grasps", "", grasps)));
        numbers.spreads =
            vec![SpreadRow::new("epsilon", 4, &facts.epsilon), SpreadRow::new("energy", 3, &facts.energy)];
    }

    fn pictures(&self, reader: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError> {
        let mut drawn = Vec::new();
        for index in self.picks.iter().filter_map(|picks| picks.first()).take(PICTURES) {
            let Some(sample) = reader.sample(*index)? else { continue };
            let sheet = PatchSheet::of(&sample)?;
            let object = self.facts.objects.iter().find(|object| object.object == sample.id.subject);
            let name = object.map_or("?", |object| object.name.as_str());
            let caption = format!("{name}, grasp of type {}", sheet.kind());
            drawn.push((caption, sheet.picture()));
        }
        Ok(drawn)
    }
}
