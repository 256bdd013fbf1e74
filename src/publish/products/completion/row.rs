//! The row of completion in the table of products.

use std::{collections::BTreeSet, path::PathBuf};

use super::{
    card::{picture_of, sample_panels},
    page::{CompletionPage, cards},
    survey::CompletionSurvey,
    templates::TEMPLATES,
};
use crate::{
    asset::{AssetKind, AssetUse},
    chart::percent,
    headline::stored_samples,
    inspection::Inspection,
    numbers::{NumberRow, Numbers, SplitCounts},
    picture::{Panel, Picture},
    preview::{PREVIEWED, PreviewError, preview_samples, write_preview as write_samples},
    product::{PICTURES, Page, ProductAssets, ProductPages, ProductWords, Survey},
    tally::SpreadRow,
    templates::page_values,
};
use format::{
    Product,
    dataset::{DatasetError, DatasetReader, Sample},
};
use kernel::{ids::ObjectId, render::DepthSource};

/// Pages, texts and pictures of completion.
pub static PAGES: ProductPages = ProductPages {
    product: Product::COMPLETION,
    words: ProductWords {
        lead: "Pairs of occupancy grids: the part of an object that one depth camera observes, and the whole solid, on the same grid.",
        sample: "one object seen from one side",
        labels: "the whole solid of each observed part, computed from the mesh",
        acquisition: "Depth of each object was rendered or cast from its mesh, and grids were computed from depth and mesh.",
        reading: "`graspmill export . --to npy --out ../arrays` writes NumPy arrays, `--to binvox` and `--to pcd` files per sample.",
        legend: "From left to right: depth (near is light), observed cells (blue), the whole solid (orange), and both from behind.",
        regenerated: 64,
        tasks: &["robotics", "image-to-3d"],
    },
    templates: &TEMPLATES,
    survey: |reader| Ok(Box::new(CompletionSurvey::of(reader)?)),
    parts: None,
    headline: stored_samples,
    counts_in_words: |_, _| Ok(Vec::new()),
    warnings: |_| Ok(Vec::new()),
    write_preview,
    preview_shows_more: true,
    assets: ProductAssets {
        subjects: AssetKind::Object,
        objects: AssetUse::Derived,
        descriptions: AssetUse::Measured,
        shape_files: &[],
        data_files: &[],
    },
};

/// Side of each part of a sample's picture [px].
const SIDE: u32 = 240;

/// Writes a few samples; depth that the dataset does not store is made again.
fn write_preview(reader: &DatasetReader, mut source: Option<&mut dyn DepthSource>) -> Result<PathBuf, PreviewError> {
    let mut samples = preview_samples(reader, PREVIEWED as u32)?;
    for sample in samples.iter_mut().filter(|sample| sample.depth.is_none()) {
        if let Some(source) = &mut source {
            sample.depth = source.depth(&sample.pair.sample).map_err(PreviewError::Depth)?;
        }
    }
    Ok(write_samples(reader.folder(), &samples)?)
}

impl Survey for CompletionSurvey {
    fn inspection(&self) -> Inspection {
        Inspection::of(&self.facts)
    }

    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError> {
        let (cards, job) = (cards(reader, self)?, reader.job_text()?);
        Ok(Page { values: page_values(&CompletionPage::of(self, cards, &job)), shown: self.picks.len() })
    }

    fn add_numbers(&self, numbers: &mut Numbers) {
        let facts = &self.facts;
        if let Some(setup) = &facts.setup {
            let n = setup.resolution;
            let camera = format!("{} x {} px, focal length {:.2} px", setup.width, setup.height, setup.fx);
            numbers.rows.push(NumberRow::new("grid", format!("{n} x {n} x {n} cells")));
            numbers.rows.push(NumberRow::new("camera", camera));
        }
        if facts.kept > 0 {
            let share = percent(facts.cut_off as f64 / facts.kept as f64);
            numbers.rows.push(NumberRow::new("stored with less than 99 % of the solid inside the grid", share));
        }
        if let Some(touch) = &facts.touch {
            numbers.rows.extend(touch.number_rows());
        }
        numbers.spreads = vec![
            SpreadRow::new("partial cells", 0, &facts.partial_cells),
            SpreadRow::new("complete cells", 0, &facts.complete_cells),
            SpreadRow::new("partial / complete", 3, &facts.seen_ratio),
            SpreadRow::new("share of the solid inside the grid", 3, &facts.solid_share),
        ];
        let counts = facts.splits.iter();
        numbers.splits = counts
            .map(|row| SplitCounts { split: row.split, samples: row.samples, objects: Some(row.objects) })
            .collect();
        numbers.leaks = facts.leaking_geometry.iter().map(|names| names.join(" = ")).collect();
    }

    fn pictures(&self, reader: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError> {
        let mut drawn = Vec::new();
        let mut seen: BTreeSet<ObjectId> = BTreeSet::new();
        for pick in &self.picks {
            let Some(sample) = reader.sample(pick.index)? else { continue };
            if drawn.len() < PICTURES && seen.insert(sample.id.subject) {
                let object = self.facts.objects.iter().find(|object| object.object == sample.id.subject);
                let name = object.map_or("?", |object| object.name.as_str());
                drawn.push((format!("{name}, view {}", sample.id.item), picture_of(&sample, SIDE)?));
            }
        }
        Ok(drawn)
    }

    fn panels(&self, _: &DatasetReader, sample: &Sample, side: u32) -> Result<Vec<Panel>, DatasetError> {
        sample_panels(sample, side)
    }
}
