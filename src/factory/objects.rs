//! Meshes and hands of a job, read again and compared with it; objects as a dataset records them.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde_json::{Map, Value};

use crate::{
    ProduceError, RunError,
    clock::timed,
    sections::{JobHand, JobObject, JobObjects, Weight},
    work::{Closing, SideCost},
};
use assets::object::PreparedObject;
use format::dataset::{ObjectFacts, add_symmetries};
use kernel::{
    description::Description,
    ids::{Digest, ObjectId},
    words::MassSource,
};

/// Prepares an object again and checks that it is still the one of the job.
///
/// # Errors
/// When it can't be prepared any more, or is another one.
pub fn prepared(object: &JobObject) -> Result<PreparedObject, ProduceError> {
    let prepared = PreparedObject::prepare(&object.source).map_err(ProduceError::gone)?;
    let (found, expected) = (prepared.id(), object.id());
    if found == expected {
        return Ok(prepared);
    }
    Err(ProduceError::Changed { name: object.source.name.clone(), found, expected })
}

/// Conditions of a job's trials that apply to every object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrialObject {
    /// Mass of every object [kg]; `None`: each has its own.
    pub mass: Option<f64>,
    /// Coefficient of friction against the hand.
    pub friction: f64,
}

/// Adds to the row of an object what it weighs and is, for a job with trials in these: its facts and its symmetries.
pub fn describe(
    object: &JobObject,
    prepared: &PreparedObject,
    trials: Option<TrialObject>,
    row: &mut Map<String, Value>,
) {
    let given = trials.and_then(|trials| trials.mass);
    let given = given.map(|kilograms| Weight { kilograms, from: MassSource::Job, source: String::new() });
    let Weight { kilograms, from, source } = given.unwrap_or_else(|| object.weight(prepared));
    let facts = ObjectFacts {
        category: object.known.category.clone(),
        material: object.known.made_of.map(|made_of| made_of.material.name.to_owned()),
        mass: kilograms,
        mass_from: from.name().to_owned(),
        mass_source: source,
        friction: trials.map(|trials| trials.friction),
        solid: prepared.mass().copied(),
    };
    facts.add_to(row);
    if let Some(symmetries) = prepared.symmetries() {
        add_symmetries(row, &symmetries);
    }
}

/// Adds to the rows of the asset table what every object weighs and is.
///
/// # Errors
/// When an object is gone or another one than when the job was resolved, or the run is cancelled.
pub fn describe_all(objects: &JobObjects, closing: &mut Closing<'_>) -> Result<(), RunError> {
    let described = |object: &JobObject| {
        if closing.cancel.is_cancelled() {
            return Err(RunError::Interrupted);
        }
        let mut row = Map::new();
        describe(object, &prepared(object)?, None, &mut row);
        Ok((object.id(), row))
    };
    let pool = closing.parallelism.pool()?;
    let rows: Result<BTreeMap<_, _>, RunError> =
        pool.install(|| objects.list.par_iter().with_max_len(1).map(described).collect());
    let mut rows = rows?;
    add_to_assets(closing, |object| rows.remove(&object));
    Ok(())
}

/// Bytes of what is added to a row of the asset table.
pub fn bytes_of_row(row: Map<String, Value>) -> f64 {
    serde_json::to_string_pretty(&serde_json::json!({ "objects": [row] })).map_or(0.0, |text| text.len() as f64)
}

/// Objects whose facts an estimate measures.
const MEASURED_OBJECTS: usize = 12;

/// Some of these objects, spread evenly over them: the time to compute facts differs a hundredfold between objects.
pub fn measured<T: Copy>(all: &[T]) -> Vec<T> {
    let count = all.len().min(MEASURED_OBJECTS);
    (0..count).map(|index| all[index * all.len() / count]).collect()
}

/// Triangles of all objects for one of these: meshes in files grow with them.
pub fn triangles_per(all: &[&JobObject], few: &[&JobObject]) -> f64 {
    let count = |objects: &[&JobObject]| objects.iter().map(|object| object.asset.triangles as f64).sum::<f64>();
    count(all) / count(few).max(1.0)
}

/// Cost of what [`describe_all`] adds, by a few of the objects, given by their indices.
///
/// # Errors
/// When an object is gone or another one than when the job was resolved.
pub fn cost_of_descriptions(objects: &JobObjects, visited: &[usize]) -> Result<SideCost, ProduceError> {
    let measured = measured(visited);
    let (bytes, seconds) = timed(|| {
        measured.iter().try_fold(0.0, |bytes, index| {
            let (object, mut row) = (&objects.list[*index], Map::new());
            describe(object, &prepared(object)?, None, &mut row);
            Ok::<_, ProduceError>(bytes + bytes_of_row(row))
        })
    });
    let times = objects.list.len() as f64 / measured.len().max(1) as f64;
    Ok(SideCost { bytes: bytes? * times, seconds: seconds * times })
}

/// Adds more to the rows of the asset table, by object.
pub fn add_to_assets(closing: &mut Closing<'_>, mut more: impl FnMut(ObjectId) -> Option<Map<String, Value>>) {
    for row in &mut closing.header.assets {
        let object = row["object"].as_str().and_then(Digest::from_hex).map(ObjectId);
        if let (Some(row), Some(more)) = (row.as_object_mut(), object.and_then(&mut more)) {
            row.extend(more);
        }
    }
}

/// Reads the hand's files again and checks that they are still those of the job.
///
/// # Errors
/// When one is gone, or they are others than when the job was resolved.
pub fn check_hand(hand: &JobHand) -> Result<(), ProduceError> {
    let description = Description::of_hand(&hand.file).map_err(ProduceError::gone)?;
    let (found, expected) = (ObjectId(description.digest), hand.id);
    if found == expected {
        return Ok(());
    }
    Err(ProduceError::Changed { name: hand.file.display().to_string(), found, expected })
}
