//! Reads the grasps of a finished dataset for a job for patches.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use super::settings::{ChosenGrasp, FoundGrasps, GraspedObject};
use format::{
    Grasp, Product, WRENCH,
    dataset::{DatasetError, DatasetReader, Manifest, Selection},
};
use kernel::{
    ids::ObjectId,
    words::{GraspTypeCounts, GraspVerdict, NumberClass, Split},
};

/// Reason why a folder is no dataset of grasps that patches can be made of.
#[derive(Debug, thiserror::Error)]
pub enum InvalidGrasps {
    /// The dataset cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The dataset's product is another one.
    #[error("{} is a dataset of {product}, not of grasps", folder.display())]
    Product {
        /// Folder of the dataset.
        folder: PathBuf,
        /// Product of the dataset.
        product: Product,
    },
    /// The dataset has no digest of exact numbers.
    #[error("{} has no exact numbers", .0.display())]
    NoExactNumbers(PathBuf),
    /// The dataset's table of assets names no hand.
    #[error("{} names no hand", .0.display())]
    NoHand(PathBuf),
}

/// The grasps of the `max_types` most common types in a dataset; two passes over its runs, one chunk at a time.
///
/// # Errors
/// When the folder holds no finished dataset of grasps of a known hand.
pub fn read_grasps(folder: &Path, max_types: u32) -> Result<FoundGrasps, InvalidGrasps> {
    let manifest = Manifest::read(folder)?;
    if manifest.product != Product::GRASPS {
        return Err(InvalidGrasps::Product { folder: folder.to_owned(), product: manifest.product });
    }
    let reader = DatasetReader::open(folder)?;
    let root = manifest.classes.get(&NumberClass::Exact);
    let root = *root.ok_or_else(|| InvalidGrasps::NoExactNumbers(folder.to_owned()))?;
    let (counts, without, space) = counted(&reader)?;
    let types = GraspTypeCounts::choose(counts, without, max_types);
    let objects = objects(&reader, &types)?;
    let assets = reader.assets()?;
    let hand = assets.hands.first().ok_or_else(|| InvalidGrasps::NoHand(folder.to_owned()))?.object;
    let training_subsets = reader.splits().training_subsets.clone();
    Ok(FoundGrasps { root, hand, space, types, objects, training_subsets })
}

/// Kept grasps by type, those without one, and the space that was asked for.
fn counted(reader: &DatasetReader) -> Result<(BTreeMap<u32, u64>, u64, String), DatasetError> {
    let (mut counts, mut without, mut space) = (BTreeMap::new(), 0, None);
    for sample in reader.iter(Selection::default()) {
        let run = sample?.grasp_run()?;
        for grasp in run.kept() {
            match grasp.kind {
                Some(kind) => *counts.entry(kind).or_default() += 1,
                None => without += 1,
            }
        }
        space.get_or_insert(run.method.space);
    }
    Ok((counts, without, space.unwrap_or_else(|| WRENCH.to_owned())))
}

fn objects(reader: &DatasetReader, types: &GraspTypeCounts) -> Result<Vec<GraspedObject>, DatasetError> {
    let mut chosen: BTreeMap<ObjectId, Vec<ChosenGrasp>> = BTreeMap::new();
    for sample in reader.iter(Selection::default()) {
        let run = sample?.grasp_run()?;
        let grasps = chosen.entry(run.sample.subject).or_default();
        for (rank, grasp) in (0..).zip(&run.grasps) {
            let kind = grasp.kind.filter(|kind| types.index_of(*kind).is_some());
            if let (GraspVerdict::Kept, Some(kind)) = (grasp.verdict, kind) {
                let epsilon = grasp.epsilon(&run.method);
                grasps.push(of_grasp(grasp, [run.sample.item.0, rank, kind], epsilon));
            }
        }
    }
    let mut objects: Vec<GraspedObject> = Vec::new();
    for row in reader.assets()?.objects {
        let split = reader.splits().object(&row.object);
        let mut grasps = chosen.remove(&row.object).unwrap_or_default();
        grasps.sort_by_key(|grasp| (grasp.run, grasp.rank));
        objects.push(GraspedObject {
            id: row.object,
            split: split.map_or(Split::Training, |split| split.split),
            holdout_runs: split.map_or_else(BTreeSet::new, |split| split.holdout_items.iter().copied().collect()),
            subset: split.and_then(|split| split.subset),
            asset: row.whole(),
            name: row.name,
            grasps,
        });
    }
    objects.sort_by_key(|object| object.id);
    Ok(objects)
}

fn of_grasp(grasp: &Grasp, [run, rank, kind]: [u32; 3], epsilon: f64) -> ChosenGrasp {
    ChosenGrasp {
        run,
        rank,
        kind,
        object_from_approach: grasp.object_from_approach,
        object_from_base: grasp.object_from_base,
        joints: grasp.joints.clone(),
        energy: grasp.energy,
        epsilon,
    }
}
