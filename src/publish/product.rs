//! Publication of products: rows of a table. Reports, inspections, releases and previews know only these rows.

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

/// Texts, pages and pictures of a product: one row of the table of products.
pub struct ProductPages {
    /// The product.
    pub product: Product,
    /// Sentences about the product.
    pub(super) words: ProductWords,
    /// Templates of the product's pages.
    pub(super) templates: &'static PageTemplates,
    /// Passes over a finished dataset.
    pub(super) survey: fn(&DatasetReader) -> Result<Box<dyn Survey>, DatasetError>,
    /// Parts of each sample, if users count those.
    pub(super) parts: Option<SampleParts>,
    /// Headline of a finished dataset; `run`, `inspect`, pages and cards start with it.
    pub(super) headline: fn(&DatasetReader) -> Result<String, DatasetError>,
    /// Further lines with counts of this product.
    pub(super) counts_in_words: fn(&Folder, &Manifest) -> Result<Vec<String>, DatasetError>,
    /// Warnings from the samples, each with its remedy.
    pub(super) warnings: fn(&DatasetReader) -> Result<Vec<String>, DatasetError>,
    /// Writes the preview.
    pub(super) write_preview: WritePreview,
    /// Whether the preview of a run shows more than the dataset stores; a release then keeps it.
    pub(super) preview_shows_more: bool,
    /// Assets of the product's datasets, and files that show them.
    pub(super) assets: ProductAssets,
}

/// Writes `preview.mcap` into the folder of a dataset; depth images that the dataset does not store come from the source, if
/// there is one.
pub type WritePreview = fn(&DatasetReader, Option<&mut dyn DepthSource>) -> Result<PathBuf, PreviewError>;

/// Sentences about a product. Text between backticks is code.
pub(super) struct ProductWords {
    /// Content of a dataset, one sentence.
    pub lead: &'static str,
    /// One sample, after "is": "one object seen from one side".
    pub sample: &'static str,
    /// Labels of the samples.
    pub labels: &'static str,
    /// Sentence about how the samples are made.
    pub acquisition: &'static str,
    /// Further ways to read a dataset; may be empty.
    pub reading: &'static str,
    /// Parts of each picture of a release, and the meaning of their colours.
    pub legend: &'static str,
    /// Recommended number of samples to regenerate.
    pub regenerated: u32,
    /// Categories of tasks by the names of Hugging Face.
    pub tasks: &'static [&'static str],
}

/// Parts that a sample consists of, such as the poses at one position.
pub(super) struct SampleParts {
    /// Singular and plural noun of the parts.
    pub noun: Noun,
    /// Parts of all stored samples.
    pub count: fn(&Manifest) -> u64,
}

/// Assets of a product's datasets.
pub(super) struct ProductAssets {
    /// Kind of the subjects.
    pub subjects: AssetKind,
    /// Part of an object's shape that a dataset contains.
    pub objects: AssetUse,
    /// Part of a hand's or a robot's shape that a dataset contains.
    pub descriptions: AssetUse,
    /// Extra files with copies of shapes.
    pub shape_files: &'static [&'static str],
    /// Extra files with data made from the assets.
    pub data_files: &'static [&'static str],
}

/// Maximum number of pictures in a release.
pub(super) const PICTURES: usize = 4;

/// Facts, distributions and choices from one pass over a dataset, for page, card and inspection.
pub(super) trait Survey {
    /// The facts, as text or JSON.
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

    /// Draws one sample in panels, each at most `side` pixels wide and high; empty if the product has no such panels.
    ///
    /// # Errors
    /// When a file of the dataset is missing or damaged.
    fn panels(&self, _reader: &DatasetReader, _sample: &Sample, _side: u32) -> Result<Vec<Panel>, DatasetError> {
        Ok(Vec::new())
    }

    /// Samples for the first picture of a set, which shows one scene from several datasets; empty if the product does not show
    /// scenes.
    ///
    /// # Errors
    /// When a file of the dataset is missing or damaged.
    fn scene_samples(&self, _reader: &DatasetReader) -> Result<Vec<SceneSample>, DatasetError> {
        Ok(Vec::new())
    }

    /// Counts from candidates to held grasps, for the page of a set; `None` if the product has no grasps in scenes.
    fn funnel(&self) -> Option<GraspFunnel> {
        None
    }

    /// Draws one of these samples for that picture.
    ///
    /// # Errors
    /// When a file of the dataset is missing or damaged.
    fn scene_panels(&self, _reader: &DatasetReader, _sample: &Sample) -> Result<Vec<ScenePanel>, DatasetError> {
        Ok(Vec::new())
    }
}

/// Counts of the grasps of one hand in scenes, each a part of the one before.
pub(super) struct GraspFunnel {
    /// Name of the hand.
    pub hand: String,
    /// Bodies whose grasps were evaluated.
    pub bodies: u64,
    /// Bodies with a free grasp.
    pub bodies_with_free: u64,
    /// Poses drawn, or stored grasps evaluated.
    pub candidates: u64,
    /// Free grasps.
    pub free: u64,
    /// Trials, those that lifted the body, and those that held it; `None` without trials.
    pub trials: Option<[u64; 3]>,
}

/// A page of a report.
pub(super) struct Page {
    /// Values for the first of [`ProductPages::templates`].
    pub values: Value,
    /// Number of items that the page shows in pictures.
    pub shown: usize,
}
