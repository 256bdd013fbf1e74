//! Samples of scenes that can stand in the first picture of a set, where one scene is shown as several datasets know it.

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
    /// Number of the view that the sample is of; `None` if it is of the scene as a whole.
    pub view: Option<ItemId>,
    /// Distance from the sample that shows most, 0 or more: of several samples the nearest is shown.
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
    /// The stored samples of a dataset for which `of` has a view and a distance, in order. Reads the ledgers, one at a time.
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
