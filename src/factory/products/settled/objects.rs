//! Meshes of the objects of settled scenes: found again as the job of the scenes found them.

use std::path::Path;

use super::{found::FoundScenes, source::SCENES};
use crate::{
    ProduceError,
    clock::timed,
    objects::{measured, prepared, triangles_per},
    sections::{
        JobContext, JobObject, JobObjects, ObjectsDraft,
        spec::{ObjectsSpec, SplitSpec},
    },
    work::SideCost,
};
use form::{Checker, Document, FormErrors};
use format::{ObjectShape, Product, dataset::layout::JOB, extras::ShapesWriter};
use kernel::{files::Folder, ids::JobDigest};

/// Keys of the scenes' job that define the objects.
pub struct ObjectKeys {
    split: SplitSpec,
    objects: Vec<ObjectsSpec>,
}

/// The keys of the job of the scenes; `None` when it has none, which is reported.
pub fn object_keys(checker: &mut Checker, scenes: &FoundScenes) -> Option<ObjectKeys> {
    let read = || -> Result<_, toml::de::Error> {
        let mut keys: toml::Table = scenes.job_text.parse()?;
        let mut take = |key: &str| keys.remove(key).unwrap_or(toml::Value::Boolean(false));
        Ok(ObjectKeys { split: take("split").try_into()?, objects: take("objects").try_into()? })
    };
    read().map_err(|error| report_job(checker, &error.to_string())).ok()
}

/// Rolling friction among the bodies of the scenes [m]; `None` when their job has none, which is reported.
pub fn rolling_friction(checker: &mut Checker, scenes: &FoundScenes) -> Option<f64> {
    let keys: Option<toml::Table> = scenes.job_text.parse().ok();
    let rolling = keys.as_ref().and_then(|keys| keys.get("physics")?.get("rolling"));
    let found =
        rolling.and_then(|rolling| rolling.as_float().or_else(|| rolling.as_integer().map(|whole| whole as f64)));
    if found.is_none() {
        report_job(checker, "it has no `physics.rolling`");
    }
    found
}

/// Reports that the job of the scenes is not as it should be.
fn report_job(checker: &mut Checker, detail: &str) {
    let key = format!("{}.dataset", SCENES.name);
    let report = checker.not_found(key.as_str(), "job of the scenes", format!("its {JOB}: {detail}"));
    report.help("`verify` the dataset of scenes, and make it again");
}

/// The meshes, found as the job of the scenes in a folder found them, and notes for the user.
///
/// # Errors
/// When that job is not as it was.
pub fn draft_objects(
    keys: &ObjectKeys,
    scenes: &FoundScenes,
    dataset: &Path,
    context: &JobContext,
) -> Result<(ObjectsDraft, Vec<String>), FormErrors> {
    let (document, syntax) = Document::read(&dataset.join(JOB).display().to_string(), &scenes.job_text, &[]);
    let checker = Checker::new(document.named("the job of the scenes"), syntax);
    ObjectsDraft::read(checker, &keys.split, &keys.objects, dataset, context)
}

/// The objects, sorted by content.
pub fn by_content(objects: &JobObjects) -> Vec<&JobObject> {
    let mut sorted: Vec<&JobObject> = objects.list.iter().collect();
    sorted.sort_by_key(|object| object.id());
    sorted
}

/// Adds the meshes of objects that are sorted by content, one in memory at a time.
///
/// # Errors
/// When one is gone or another one than when the job was resolved, or the file cannot be written.
pub fn add_meshes(writer: &mut ShapesWriter, objects: &[&JobObject]) -> Result<(), ProduceError> {
    for object in objects {
        writer.object(&ObjectShape { object: object.id(), mesh: prepared(object)?.mesh().clone() })?;
    }
    Ok(())
}

/// Writes the file of the meshes of objects that are sorted by content, of a product without hands; its size [bytes].
///
/// # Errors
/// When one is gone or another one than when the job was resolved, or the file cannot be written.
pub fn write_meshes(
    objects: &[&JobObject],
    folder: &Folder,
    job: &JobDigest,
    product: Product,
) -> Result<u64, ProduceError> {
    let mut writer = ShapesWriter::of_objects(folder, job, product)?;
    add_meshes(&mut writer, objects)?;
    Ok(writer.finish(None)?)
}

/// Expected cost of the file of all meshes, by that of a few, which `write` writes.
///
/// # Errors
/// When a few cannot be written.
pub fn cost_of_meshes(
    objects: &JobObjects,
    write: impl FnOnce(&[&JobObject]) -> Result<u64, ProduceError>,
) -> Result<SideCost, ProduceError> {
    let all = by_content(objects);
    let few = measured(&all);
    let times = triangles_per(&all, &few);
    let (bytes, seconds) = timed(|| write(&few));
    Ok(SideCost { bytes: bytes? as f64 * times, seconds: seconds * times })
}
