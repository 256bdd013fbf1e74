//! The row of views in the factory's table of products.

use std::path::Path;

use super::{
    check,
    settings::{FoundScenes, ViewJob},
    spec::{PROFILES, ViewsSpec},
};
use crate::{
    job::{
        DraftWork, JobContext, ObjectsDraft, describe_cameras, describe_sensors,
        spec::{ObjectsSpec, SplitSpec},
    },
    product::{InputDataset, ProductFactory},
};
use form::{Checker, Document, FormErrors, Schema, schema_of};
use format::{Product, dataset::layout::JOB};

/// Views as the factory makes them.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::VIEWS,
    keys,
    profiles: PROFILES,
    other_words: &[
        ("cameras", "`views.cameras` lists the cameras"),
        ("camera", "`views.cameras` lists the cameras"),
        ("objects", "the dataset of scenes says what its objects are"),
    ],
    hand_uses: &[],
    inputs: &[InputDataset { section: "scenes", product: Product::SCENES }],
    draft,
};

fn keys(title: &str) -> Schema {
    let mut schema = schema_of::<ViewsSpec>(title);
    let properties = &mut schema.value_mut()["properties"];
    describe_sensors(&mut properties["sensor"]["properties"]);
    describe_cameras(&mut properties["views"]["properties"]["cameras"]["items"]["properties"]["preset"]);
    schema
}

fn draft(keys: &toml::Table, checker: Checker, folder: &Path, context: &JobContext) -> Result<DraftWork, FormErrors> {
    let (spec, mut checker) = checker.value_of::<ViewsSpec>(keys)?;
    let settings = check::settings(&mut checker, &spec, folder);
    let dataset = check::dataset(&mut checker, &spec, folder);
    let scenes = dataset.as_ref().and_then(|dataset| check::scenes(&mut checker, &spec, dataset));
    let objects = scenes.as_ref().and_then(|scenes| objects_of(&mut checker, scenes));
    checker.finish()?;
    let (dataset, scenes) = (dataset.expect("a missing one was reported"), scenes.expect("mistakes were reported"));
    let (split, objects) = objects.expect("mistakes of the job of the scenes were reported");
    // The meshes are found as the job of the scenes found them.
    let (document, syntax) = Document::read(&dataset.join(JOB).display().to_string(), &scenes.job_text, &[]);
    let of_scenes = Checker::new(document.named("the job of the scenes"), syntax);
    let objects = ObjectsDraft::read(of_scenes, &split, &objects, &dataset, context)?;
    Ok(DraftWork::of_objects(objects, spec.shards.samples, move |objects, _| ViewJob {
        dataset,
        scenes,
        objects,
        settings,
    }))
}

/// Objects and split of the job of the scenes; `None` when it has none, which is reported.
fn objects_of(checker: &mut Checker, scenes: &FoundScenes) -> Option<(SplitSpec, Vec<ObjectsSpec>)> {
    let read = || -> Result<_, toml::de::Error> {
        let mut keys: toml::Table = scenes.job_text.parse()?;
        let mut take = |key: &str| keys.remove(key).unwrap_or(toml::Value::Boolean(false));
        Ok((take("split").try_into()?, take("objects").try_into()?))
    };
    match read() {
        Ok(found) => Some(found),
        Err(error) => {
            let detail = format!("its {JOB}: {error}");
            let report = checker.not_found("scenes.dataset", "job of the scenes", detail);
            report.help("`verify` the dataset of scenes, and make it again");
            None
        }
    }
}
