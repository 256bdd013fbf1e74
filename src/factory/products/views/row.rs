//! The row of views in the factory's table of products.

use std::path::Path;

use super::{
    check,
    settings::ViewJob,
    spec::{PROFILES, ViewsSpec},
};
use crate::{
    product::{DraftWork, InputDataset, ProductFactory, ShardSamples},
    products::settled::{draft_objects, object_keys},
    sections::{JobContext, describe_cameras, describe_sensors},
};
use form::{Checker, FormErrors, Schema, schema_of};
use format::Product;

/// Views as the factory makes them.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::VIEWS,
    keys,
    profiles: PROFILES,
    key_hints: &[
        ("cameras", "`views.cameras` lists the cameras"),
        ("camera", "`views.cameras` lists the cameras"),
        ("objects", "the objects are those of the dataset of scenes"),
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
    let keys = scenes.as_ref().and_then(|scenes| object_keys(&mut checker, scenes));
    checker.finish()?;
    let (dataset, scenes) = (dataset.expect("a missing one was reported"), scenes.expect("mistakes were reported"));
    let keys = keys.expect("mistakes of the job of the scenes were reported");
    let objects = draft_objects(&keys, &scenes, &dataset, context)?;
    Ok(DraftWork::of_objects(objects, ShardSamples::or_share(spec.shards.samples, 32..=256), move |objects, _| {
        ViewJob { dataset, scenes, objects, settings }
    }))
}
