//! Objects of a set that train in one of its datasets and are kept for judging in another.
//!
//! Each job splits its own objects. To train on one dataset of a set and test on another, no object, and no other one
//! of the same shape, may be in both splits.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{ProduceError, RunContext, RunError, run::TWIN_LIKENESS};
use assets::AssetRecord;
use format::{
    dataset::{AssetRow, DatasetReader, SetTable},
    extras::Shapes,
    products::grasps::SHAPES,
};
use kernel::{
    files::Folder,
    ids::ObjectId,
    voxel::{ShapeDescriptor, twins},
    words::Split,
};

/// An object on one side of a split, in one dataset.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeakSide {
    /// Name of the object.
    pub object: String,
    /// Name of the dataset.
    pub dataset: String,
    /// Split of the object there.
    pub split: Split,
}

/// An object, or two of one shape, on two sides.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Leak {
    /// The sides, the one nearer to training first.
    pub sides: [LeakSide; 2],
    /// Whether these are two objects of one shape.
    pub is_twin: bool,
}

impl fmt::Display for Leak {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [one, other] = &self.sides;
        let LeakSide { object, dataset, split } = one;
        write!(f, "{object} is in split {} of {dataset}, and ", split.name())?;
        match self.is_twin {
            true => write!(f, "{}, which has the same shape, ", other.object)?,
            false => write!(f, "the same object ")?,
        }
        write!(
            f,
            "in split {} of {}: a network trained on one and tested on the other sees it twice; give both jobs the \
             same objects and the same [split]",
            other.split.name(),
            other.dataset
        )
    }
}

/// Finds the objects of a finished set that are in two splits, and pairs with different names and one shape: rotated,
/// scaled or cut into other triangles. Shapes are compared for the objects whose meshes a dataset of the set stores.
///
/// # Errors
/// When a file is missing or damaged, or the wish to stop is heard.
pub fn find_leaks(folder: &Folder, table: &SetTable, run: &RunContext<'_>) -> Result<Vec<Leak>, RunError> {
    let mut sides: BTreeMap<ObjectId, Vec<LeakSide>> = BTreeMap::new();
    let mut meshes: BTreeMap<ObjectId, (usize, usize, AssetRow)> = BTreeMap::new();
    let mut shapes: Vec<Shapes> = Vec::new();
    for job in &table.jobs {
        let reader = DatasetReader::open(&folder.subfolder(&job.name))?;
        let mut rows = reader.assets()?.objects;
        rows.sort_by_key(|row| row.object);
        for row in &rows {
            if let Some(found) = reader.splits().object(&row.object) {
                let side = LeakSide { object: row.name.clone(), dataset: job.name.clone(), split: found.split };
                sides.entry(row.object).or_default().push(side);
            }
        }
        if reader.manifest().entries().contains_key(SHAPES) {
            // Meshes are in the order of the rows: both are sorted by content.
            for (index, row) in rows.into_iter().enumerate() {
                meshes.entry(row.object).or_insert((shapes.len(), index, row));
            }
            shapes.push(Shapes::open(reader.folder())?);
        }
    }
    let mut leaks: Vec<Leak> = sides.values().filter_map(|sides| leak(sides, sides, false)).collect();
    let splits: BTreeSet<Split> = sides.values().flatten().map(|side| side.split).collect();
    if splits.len() < 2 {
        return Ok(leaks);
    }
    // Shapes: only where there is more than one side.
    let meshes: Vec<(ObjectId, (usize, usize, AssetRow))> = meshes.into_iter().collect();
    let describe = |(object, (file, index, row)): &(ObjectId, (usize, usize, AssetRow))| {
        run.cancel.check().map_err(|_| RunError::Interrupted)?;
        let record = AssetRecord::deserialize(row.whole())
            .map_err(|error| RunError::Produce(ProduceError::unusable(row.name.clone(), error)))?;
        let mesh = shapes[*file].object(*index)?.mesh;
        Ok((*object, ShapeDescriptor::from_mesh(&mesh, record.inside.test())))
    };
    let pool = run.parallelism.pool()?;
    let described: Vec<(ObjectId, ShapeDescriptor)> =
        pool.install(|| meshes.par_iter().with_max_len(1).map(describe).collect::<Result<_, RunError>>())?;
    let (objects, descriptors): (Vec<ObjectId>, Vec<ShapeDescriptor>) = described.into_iter().unzip();
    for group in twins(&descriptors, TWIN_LIKENESS) {
        for (at, one) in group.iter().enumerate() {
            for other in &group[at + 1..] {
                let [one, other] = [one, other].map(|index| sides.get(&objects[*index]).map(Vec::as_slice));
                leaks.extend(leak(one.unwrap_or_default(), other.unwrap_or_default(), true));
            }
        }
    }
    Ok(leaks)
}

/// Two sides of which one is nearer to training than the other.
fn leak(one: &[LeakSide], other: &[LeakSide], is_twin: bool) -> Option<Leak> {
    let pairs = one.iter().flat_map(|one| other.iter().map(move |other| [one, other]));
    let mut differing = pairs.filter(|[one, other]| one.split != other.split);
    let mut sides = differing.next()?.map(LeakSide::clone);
    sides.sort_by_key(|side| side.split);
    Some(Leak { sides, is_twin })
}
