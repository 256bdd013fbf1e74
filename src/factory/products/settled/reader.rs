//! Reads the scenes of a finished dataset for a job about them.

use std::path::{Path, PathBuf};

use super::found::{FoundScenes, SettledScene};
use crate::products::input::{InvalidInput, open_input};
use format::{
    Product, Scene,
    dataset::{AssetRow, AssetTable, DatasetError, Selection},
};
use kernel::words::{NumberClass, Show, Split, SplitTable};

/// Reason why a folder is no dataset of scenes that a job can be about.
#[derive(Debug, thiserror::Error)]
pub enum InvalidScenes {
    /// The folder holds no finished dataset of scenes.
    #[error(transparent)]
    Input(#[from] InvalidInput),
    /// The dataset cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// No scene was kept.
    #[error("{} has no kept scene", .0.shown())]
    Empty(PathBuf),
}

/// The kept scenes of a dataset; one chunk of a shard is in memory at a time.
///
/// # Errors
/// When the folder holds no finished dataset of scenes.
pub fn read_scenes(folder: &Path) -> Result<FoundScenes, InvalidScenes> {
    let (reader, root) = open_input(folder, Product::SCENES, NumberClass::Physics)?;
    let mut list: Vec<SettledScene> = Vec::new();
    for sample in reader.iter(Selection::default()) {
        let sample = sample?;
        let mut scene = sample.read::<Scene>()?;
        // Scenes of one job share a container, which can be a mesh.
        if let Some(last) = list.last().filter(|last| last.container == scene.container) {
            scene.container.clone_from(&last.container);
        }
        list.push(SettledScene {
            id: scene.id(),
            sample: sample.id,
            split: reader.split(sample.index).unwrap_or(Split::Training),
            number: sample.id.item.0,
            container: scene.container,
            bodies: scene.bodies.iter().map(|body| (body.object, body.world_from_object)).collect(),
        });
    }
    if list.is_empty() {
        return Err(InvalidScenes::Empty(folder.to_owned()));
    }
    let AssetTable { objects: assets, containers, .. } = reader.assets()?;
    let is_object = |object| assets.iter().any(|row| row.object == object);
    let splits = reader.splits();
    let splits = SplitTable {
        training_subsets: splits.training_subsets.clone(),
        objects: splits.objects.iter().filter(|row| is_object(row.object)).cloned().collect(),
    };
    let job_text = reader.job_text()?;
    let [assets, containers] = [assets, containers].map(|rows| rows.iter().map(AssetRow::whole).collect());
    Ok(FoundScenes { root, list, assets, containers, splits, job_text })
}
