//! The row of amodal pairs in the factory's table of products.

use std::path::Path;

use super::{
    check,
    settings::AmodalJob,
    spec::{AmodalSpec, PROFILES},
};
use crate::{
    product::{DraftWork, InputDataset, ProductFactory, ShardSamples},
    products::pair::touch::EXPLORES,
    sections::JobContext,
};
use form::{Checker, FormErrors, Schema, schema_of};
use format::{PARTIAL_INSIDE_COMPLETE, Product};
use kernel::voxel::Truth;

/// Amodal pairs as the factory makes them.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::AMODAL,
    keys,
    profiles: PROFILES,
    key_hints: &[
        ("objects", "the objects are those of the dataset of views"),
        ("sensor", "the sensor is that of the job of the views"),
        ("scenes", "name a dataset of views of the objects: `views.dataset`"),
    ],
    hand_uses: &[EXPLORES],
    inputs: &[InputDataset { section: "views", product: Product::VIEWS }],
    draft,
};

fn keys(title: &str) -> Schema {
    schema_of::<AmodalSpec>(title)
}

fn draft(keys: &toml::Table, checker: Checker, folder: &Path, _: &JobContext) -> Result<DraftWork, FormErrors> {
    let (spec, mut checker) = checker.value_of::<AmodalSpec>(keys)?;
    let settings = check::settings(&mut checker, &spec, folder);
    let dataset = check::dataset(&mut checker, &spec, folder);
    let views = dataset.as_ref().and_then(|dataset| check::views(&mut checker, &spec, dataset));
    checker.finish()?;
    let (dataset, views) = (dataset.expect("a missing one was reported"), views.expect("mistakes were reported"));
    let rules = &settings.rules;
    let obeys = rules.truth == Truth::AnyOverlap && !rules.drop_index_zero && !views.measured;
    let rules = if obeys { vec![PARTIAL_INSIDE_COMPLETE] } else { Vec::new() };
    // A shard holds the bodies of one view at least.
    let most = views.scenes.iter().map(|scene| scene.bodies).max().unwrap_or(1);
    let work = DraftWork::ready(
        AmodalJob { dataset, views, settings },
        ShardSamples::or_share(spec.shards.samples, 64..=4096).at_least(most),
    );
    Ok(DraftWork { rules, ..work })
}
