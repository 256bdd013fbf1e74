//! Samples of scenes for the first picture of a set, which shows one scene from several datasets.

use super::picture::Picture;
use format::dataset::{DatasetError, DatasetReader, Fate, LedgerRow};
use kernel::ids::{ItemId, ObjectId, SampleIndex};

/// A stored sample of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SceneSample {
    /// Index in its dataset.
    pub index: SampleIndex,
    /// The scene by content.
    pub scene: ObjectId,
    /// Number of the sample's view; `None` if the sample belongs to the whole scene.
    pub view: Option<ItemId>,
    /// Rating, 0 or more: the sample with the smallest value is shown.
    pub distance: f64,
}

/// One part of the first picture of a set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ScenePanel {
    /// One sentence.
    pub caption: String,
    /// Pictures from left to right.
    pub pictures: Vec<Picture>,
}

impl SceneSample {
    /// The stored samples of a dataset for which `of` returns a view and a rating, in order. Reads the ledgers, one at a time.
    ///
    /// # Errors
    /// When a shard is missing or damaged.
    pub fn all(
        reader: &DatasetReader,
        of: impl Fn(&LedgerRow) -> Option<(Option<ItemId>, f64)>,
    ) -> Result<Vec<Self>, DatasetError> {
        let mut samples = Vec::new();
        for shard in 0..reader.manifest().shards.len() {
            for row in reader.ledger(shard)?.rows.iter().filter(|row| matches!(row.fate, Fate::Kept(_))) {
                if let Some((view, distance)) = of(row) {
                    samples.push(Self { index: row.index, scene: row.sample.subject, view, distance });
                }
            }
        }
        Ok(samples)
    }
}
