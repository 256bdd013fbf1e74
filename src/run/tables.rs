//! What a dataset's tables say of a job: plain data, since the dataset knows no job.

use std::{collections::BTreeMap, path::Path};

use serde_json::Value;

#[cfg(feature = "sim")]
use crate::sim::{gl_facts, sim_facts};
use crate::{
    dataset::{DatasetHeader, NumberClass, ObjectSplit, Split, SplitTable as StoredSplits},
    ids::ViewId,
    job::{Job, Renderer},
    plan::{LeakReport, ModelRole, SampleRole, SplitTable},
};

/// The tables of the dataset that `job` makes in `folder`.
pub fn dataset_header(job: &Job, splits: &SplitTable, leaks: &LeakReport, folder: &Path) -> DatasetHeader {
    DatasetHeader {
        generator: concat!("graspmill ", env!("CARGO_PKG_VERSION")).to_owned(),
        job: job.digest(),
        job_text: job.to_toml(folder),
        class: match job.completion.renderer {
            Renderer::Raster => NumberClass::Exact,
            Renderer::MujocoRay => NumberClass::Physics,
            Renderer::MujocoGl => NumberClass::Colour,
        },
        platform: platform(job.completion.renderer),
        assets: job.objects.iter().map(|object| json(&object.asset)).collect(),
        refused: job.refused.iter().map(json).collect(),
        splits: stored_splits(job, splits),
        warnings: warnings(job, splits, leaks),
    }
}

/// What the numbers depend on beside our own code; empty for class `exact`.
fn platform(renderer: Renderer) -> BTreeMap<String, String> {
    match renderer {
        Renderer::Raster => BTreeMap::new(),
        #[cfg(feature = "sim")]
        Renderer::MujocoRay => sim_facts().platform(None),
        #[cfg(feature = "sim")]
        Renderer::MujocoGl => sim_facts().platform(gl_facts().ok().as_ref()),
        // Such a job is refused before it is run.
        #[cfg(not(feature = "sim"))]
        Renderer::MujocoRay | Renderer::MujocoGl => BTreeMap::new(),
    }
}

fn json(value: &impl serde::Serialize) -> Value {
    serde_json::to_value(value).expect("tables are plain data with string keys")
}

fn stored_splits(job: &Job, splits: &SplitTable) -> StoredSplits {
    let views = job.completion.views.len() as u32;
    let objects = job.objects.iter().enumerate().map(|(place, object)| {
        let models = match splits.models[place] {
            ModelRole::Training => Split::Training,
            ModelRole::Validation => Split::ValidationModels,
            ModelRole::Test => Split::TestModels,
        };
        let held_out = |view: &u32| splits.role(place, ViewId(*view)) == SampleRole::HoldoutView;
        ObjectSplit {
            object: object.id(),
            models,
            holdout_views: (0..views).filter(held_out).collect(),
            subset: splits.subsets.iter().position(|subset| subset.contains(&place)).map(|subset| subset as u32),
        }
    });
    let mut objects: Vec<_> = objects.collect();
    objects.sort_by_key(|row| row.object);
    let training_subsets = splits.subsets.iter().map(|subset| subset.len() as u32).collect();
    StoredSplits { training_subsets, objects }
}

/// Things a user should know, in words; numbers only from the job and its meshes.
fn warnings(job: &Job, splits: &SplitTable, leaks: &LeakReport) -> Vec<String> {
    let mut warnings: Vec<String> = job.notes.clone();
    warnings.extend(job.refused.iter().map(|refusal| format!("refused: {refusal}")));
    for object in &job.objects {
        let name = &object.source.name;
        warnings.extend(object.asset.warnings.iter().map(|warning| format!("{name}: {warning}")));
    }
    warnings.extend(splits.notes.iter().cloned());
    let mut leak = |count: u64, what: &str| {
        if count > 0 {
            warnings.push(format!("leak: {count} {what}"));
        }
    };
    leak(leaks.straddling_views, "holdout views have the rotation of a training view of the same object");
    leak(leaks.objects_straddling.into(), "objects stand on more than one side of the split");
    leak(leaks.geometries_straddling.into(), "geometries stand on more than one side of the split");
    leak(leaks.twin_groups_straddling.into(), "groups of objects of the same shape stand on more than one side");
    warnings
}
