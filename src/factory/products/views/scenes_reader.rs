//! Reads the scenes of a finished dataset for a job for views.

use std::path::{Path, PathBuf};

use super::settings::{FoundScenes, ViewScene};
use format::{
    Product,
    dataset::{DatasetError, DatasetReader, Manifest, Selection},
};
use kernel::words::{NumberClass, Split, SplitTable};

/// Reason why a folder is no dataset of scenes that can be looked at.
#[derive(Debug, thiserror::Error)]
pub enum InvalidScenes {
    /// The dataset cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The dataset's product is another one.
    #[error("{} is a dataset of {product}, not of scenes", folder.display())]
    Product {
        /// Folder of the dataset.
        folder: PathBuf,
        /// Product of the dataset.
        product: Product,
    },
    /// The dataset has no digest of its poses.
    #[error("{} has no numbers of physics", .0.display())]
    NoPoses(PathBuf),
    /// No scene was kept.
    #[error("{} has no kept scene", .0.display())]
    Empty(PathBuf),
}

/// The kept scenes of a dataset; one chunk of a shard is in memory at a time.
///
/// # Errors
/// When the folder holds no finished dataset of scenes.
pub fn read_scenes(folder: &Path) -> Result<FoundScenes, InvalidScenes> {
    let manifest = Manifest::read(folder)?;
    if manifest.product != Product::SCENES {
        return Err(InvalidScenes::Product { folder: folder.to_owned(), product: manifest.product });
    }
    let reader = DatasetReader::open(folder)?;
    let root = manifest.classes.get(&NumberClass::Physics);
    let root = *root.ok_or_else(|| InvalidScenes::NoPoses(folder.to_owned()))?;
    let mut list = Vec::new();
    for sample in reader.iter(Selection::default()) {
        let sample = sample?;
        let scene = sample.scene()?;
        list.push(ViewScene {
            id: scene.id(),
            split: reader.split(sample.index).unwrap_or(Split::Training),
            number: sample.id.item.0,
            container: scene.container,
            bodies: scene.bodies.iter().map(|body| (body.object, body.world_from_object)).collect(),
        });
    }
    if list.is_empty() {
        return Err(InvalidScenes::Empty(folder.to_owned()));
    }
    let assets = reader.assets()?.objects;
    let is_object = |object| assets.iter().any(|row| row.object == object);
    let splits = reader.splits();
    let splits = SplitTable {
        training_subsets: splits.training_subsets.clone(),
        objects: splits.objects.iter().filter(|row| is_object(row.object)).cloned().collect(),
    };
    let job_text = reader.job_text()?;
    Ok(FoundScenes { root, list, assets: assets.iter().map(|row| row.whole()).collect(), splits, job_text })
}
