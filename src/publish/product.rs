//! Products as people meet them: rows of a table. Reports, inspections, releases and previews know the rows alone.

use std::path::PathBuf;

use minijinja::Value;

use super::{
    asset::{AssetKind, AssetUse},
    inspection::Inspection,
    numbers::Numbers,
    picture::{Panel, Picture},
    scene_samples::{ScenePanel, SceneSample},
    templates::PageTemplates,
};
use crate::preview::PreviewError;
use format::{
    Noun, Product,
    dataset::{DatasetError, DatasetReader, Manifest, Sample},
};
use kernel::{files::Folder, render::DepthSource};

/// A product as people meet it: one row of the table of products.
pub struct ProductPages {
    /// The product.
    pub product: Product,
    /// Sentences about it.
    pub(super) words: ProductWords,
    /// Templates of its pages.
    pub(super) templates: &'static PageTemplates,
    /// Passes over a finished dataset.
    pub(super) survey: fn(&DatasetReader) -> Result<Box<dyn Survey>, DatasetError>,
    /// Parts that each sample consists of, where people count those.
    pub(super) parts: Option<SampleParts>,
    /// Headline of a finished dataset, the first thing that its user wants to know: `run`, `inspect`, pages and cards begin with it.
    pub(super) headline: fn(&DatasetReader) -> Result<String, DatasetError>,
    /// Further lines with counts that only this product has.
    pub(super) counts_in_words: fn(&Folder, &Manifest) -> Result<Vec<String>, DatasetError>,
    /// Warnings of what the samples show, each with its remedy.
    pub(super) warnings: fn(&DatasetReader) -> Result<Vec<String>, DatasetError>,
    /// Writes the preview.
    pub(super) write_preview: WritePreview,
    /// Whether the preview of a run shows more than the dataset stores, so that a release keeps it.
    pub(super) preview_shows_more: bool,
    /// Assets of its datasets, and files that show them.
    pub(super) assets: ProductAssets,
}

/// Writes `preview.mcap` into the folder of a dataset; depth images that the dataset does not store come from the source,
/// where there is one.
pub type WritePreview = fn(&DatasetReader, Option<&mut dyn DepthSource>) -> Result<PathBuf, PreviewError>;

/// Sentences about a product. Text between backticks is code.
pub(super) struct ProductWords {
    /// Content of a dataset, one sentence.
    pub lead: &'static str,
    /// One sample, after "is": "one object seen from one side".
    pub sample: &'static str,
    /// Labels of the samples.
    pub labels: &'static str,
    /// Making of the samples, a sentence.
    pub acquisition: &'static str,
    /// Further methods to read a dataset; empty where there are none.
    pub reading: &'static str,
    /// Parts of each picture of a release, and the meaning of their colours.
    pub legend: &'static str,
    /// Samples that a reader is advised to regenerate.
    pub regenerated: u32,
    /// Categories of tasks by the names of Hugging Face.
    pub tasks: &'static [&'static str],
}

/// Parts that a sample consists of, such as the poses at one position.
pub(super) struct SampleParts {
    /// Noun of one part and of several.
    pub noun: Noun,
    /// Parts of all stored samples.
    pub count: fn(&Manifest) -> u64,
}

/// Assets of a product's datasets.
pub(super) struct ProductAssets {
    /// Kind of the subjects.
    pub subjects: AssetKind,
    /// Part of an object's shape that stands in a dataset.
    pub objects: AssetUse,
    /// Part of a hand's or a robot's shape that stands in a dataset.
    pub descriptions: AssetUse,
    /// Extra files with copies of shapes.
    pub shape_files: &'static [&'static str],
    /// Extra files with data made of the assets.
    pub data_files: &'static [&'static str],
}

/// Pictures of a release, at most.
pub(super) const PICTURES: usize = 4;

/// Facts, distributions and choices out of one pass over a dataset: all that page, card and inspection need.
pub(super) trait Survey {
    /// The facts, for people and machines.
    fn inspection(&self) -> Inspection;

    /// The page of a report.
    ///
    /// # Errors
    /// When a file of the dataset is missing or damaged.
    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError>;

    /// Adds numbers of the product to those of the card.
    fn add_numbers(&self, numbers: &mut Numbers);

    /// Draws a few pictures, at most [`PICTURES`], with their captions, plain text.
    ///
    /// # Errors
    /// When a file of the dataset is missing or damaged.
    fn pictures(&self, reader: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError>;

    /// Draws one sample in panels, each at most `side` pixels wide and high; none where the product has no such panels.
    ///
    /// # Errors
    /// When a file of the dataset is missing or damaged.
    fn panels(&self, _reader: &DatasetReader, _sample: &Sample, _side: u32) -> Result<Vec<Panel>, DatasetError> {
        Ok(Vec::new())
    }

    /// Samples that can stand in the first picture of a set, where one scene is shown as several datasets know it; none where
    /// the product has nothing to show of a scene.
    ///
    /// # Errors
    /// When a file of the dataset is missing or damaged.
    fn scene_samples(&self, _reader: &DatasetReader) -> Result<Vec<SceneSample>, DatasetError> {
        Ok(Vec::new())
    }

    /// Draws one of these samples for that picture.
    ///
    /// # Errors
    /// When a file of the dataset is missing or damaged.
    fn scene_panels(&self, _reader: &DatasetReader, _sample: &Sample) -> Result<Vec<ScenePanel>, DatasetError> {
        Ok(Vec::new())
    }
}

/// A page of a report.
pub(super) struct Page {
    /// Values for the first of [`ProductPages::templates`].
    pub values: Value,
    /// Things that it shows in pictures.
    pub shown: usize,
}
