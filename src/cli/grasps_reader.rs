//! Reads what a job for patches takes from a finished dataset of grasps.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use crate::{
    dataset::{DatasetError, DatasetReader, Manifest, NumberClass, Selection, Split},
    ids::{ObjectId, Product},
    job::{ChosenGrasp, FoundGrasps, GraspedObject, ObjectSide, TypeChoice},
    record::{Grasp, GraspVerdict, WRENCH},
};

/// The grasps of the `types` most common types in a dataset; two passes over its runs, one chunk at a time.
pub fn grasps(folder: &Path, types: u32) -> Result<FoundGrasps, String> {
    // A dataset of another product has no index as the reader wants it.
    let manifest = Manifest::read(folder).map_err(in_words)?;
    if manifest.product != Product::Grasps {
        return Err(format!("{} is a dataset of {}, not of grasps", folder.display(), manifest.product));
    }
    let reader = DatasetReader::open(folder).map_err(in_words)?;
    let root = manifest.classes.get(&NumberClass::Exact);
    let root = *root.ok_or_else(|| format!("{} has no exact numbers", folder.display()))?;
    let (counts, without, space) = counted(&reader).map_err(in_words)?;
    let types = TypeChoice::new(counts, without, types);
    let objects = objects(&reader, &types).map_err(in_words)?;
    let assets = reader.assets().map_err(in_words)?;
    let hand = assets.hands.first().ok_or_else(|| format!("{} names no hand", folder.display()))?.object;
    let training_subsets = reader.splits().training_subsets.clone();
    Ok(FoundGrasps { root, hand, space, types, objects, training_subsets })
}

fn in_words(error: DatasetError) -> String {
    error.to_string()
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

fn objects(reader: &DatasetReader, types: &TypeChoice) -> Result<Vec<GraspedObject>, DatasetError> {
    let mut chosen: BTreeMap<ObjectId, Vec<ChosenGrasp>> = BTreeMap::new();
    for sample in reader.iter(Selection::default()) {
        let run = sample?.grasp_run()?;
        let grasps = chosen.entry(run.sample.subject).or_default();
        for (rank, grasp) in (0..).zip(&run.grasps) {
            let kind = grasp.kind.filter(|kind| types.index_of(*kind).is_some());
            if let (GraspVerdict::Kept, Some(kind)) = (grasp.verdict, kind) {
                let epsilon = grasp.epsilon(&run.method);
                grasps.push(of_grasp(grasp, [run.sample.view.0, rank, kind], epsilon));
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
            side: match split.map(|split| split.models) {
                Some(Split::ValidationModels) => ObjectSide::Validation,
                Some(Split::TestModels) => ObjectSide::Test,
                _ => ObjectSide::Training,
            },
            holdout_runs: split.map_or_else(BTreeSet::new, |split| split.holdout_views.iter().copied().collect()),
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
