//! Reads views from a finished dataset.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::found::{FoundViews, ViewedScene};
use crate::{
    ProduceError,
    products::input::{InvalidInput, open_input},
};
use format::{
    Product, SceneImage,
    dataset::{DatasetError, DatasetReader, Sample, Selection},
};
use kernel::{
    ids::{ObjectId, SampleId, SampleIndex},
    words::{NumberClass, Show},
};

/// Reason why samples cannot be made from a folder as a dataset of views.
#[derive(Debug, thiserror::Error)]
pub enum InvalidViews {
    /// The folder holds no finished dataset of views.
    #[error(transparent)]
    Input(#[from] InvalidInput),
    /// The dataset cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// No view was kept.
    #[error("{} has no kept view", .0.shown())]
    Empty(PathBuf),
    /// A scene is not in the table of assets, or its row does not list its bodies.
    #[error(
        "{}: assets.json does not list the objects of scene {}; `verify` the dataset, and make it again",
        folder.shown(), scene.0.short()
    )]
    UnknownScene {
        /// Folder of the dataset.
        folder: PathBuf,
        /// The scene.
        scene: ObjectId,
    },
}

/// Scenes, views, objects and splits of a dataset; of its images the first alone is read.
///
/// # Errors
/// When the folder holds no finished dataset of views.
pub fn read_views(folder: &Path) -> Result<FoundViews, InvalidViews> {
    let (reader, root) = open_input(folder, Product::VIEWS, NumberClass::Exact)?;
    let first = reader.iter(Selection::default()).next().ok_or_else(|| InvalidViews::Empty(folder.to_owned()))??;
    let image = first.read::<SceneImage>()?;
    let (measured, container) = (image.point_instances.is_some(), image.container);
    let assets = reader.assets()?;
    let rows: BTreeMap<ObjectId, _> = assets.subjects.iter().map(|row| (row.object, row)).collect();
    let mut scenes: Vec<ViewedScene> = Vec::new();
    for view in (0..reader.manifest().counts.samples).filter_map(|index| reader.id(SampleIndex(index))) {
        // Views of a scene are adjacent, in order.
        if scenes.last().is_none_or(|scene| scene.id != view.subject) {
            let row = rows.get(&view.subject).and_then(|row| Some((row, row.facts.get("objects")?.as_array()?.len())));
            let (row, bodies) =
                row.ok_or_else(|| InvalidViews::UnknownScene { folder: folder.to_owned(), scene: view.subject })?;
            let (name, bodies) = (row.name.clone(), bodies as u32);
            scenes.push(ViewedScene { id: view.subject, name, bodies, cameras: Vec::new() });
        }
        scenes.last_mut().expect("one was added").cameras.push(view.camera);
    }
    Ok(FoundViews {
        root,
        scenes,
        measured,
        container,
        assets: assets.objects.iter().map(|row| row.whole()).collect(),
        containers: assets.containers.iter().map(|row| row.whole()).collect(),
        subjects: assets.subjects.iter().map(|row| row.whole()).collect(),
        splits: reader.splits().clone(),
    })
}

/// Opens a dataset of views that a job has read before.
///
/// # Errors
/// When it is gone or another one than when the job was resolved.
pub fn open_views(dataset: &Path, views: &FoundViews) -> Result<DatasetReader, ProduceError> {
    let name = || dataset.display().to_string();
    let opened = open_input(dataset, Product::VIEWS, NumberClass::Exact);
    let (reader, root) = opened.map_err(|error| ProduceError::unusable(name(), error))?;
    if root == views.root {
        return Ok(reader);
    }
    let (found, expected) = (ObjectId(root), ObjectId(views.root));
    Err(ProduceError::Changed { name: name(), found, expected })
}

/// The error of a view that is not what it was.
pub fn changed_view(view: &Sample, what: &str) -> ProduceError {
    let SampleId { subject, item, .. } = view.id;
    let name = format!("view {item} of scene {}", subject.0.short());
    ProduceError::unusable(name, format!("{what}; `verify` the dataset of views, and make it again with this version"))
}
