//! The row of volumes in the factory's table of products.

use std::path::Path;

use super::{
    check,
    settings::VolumeJob,
    spec::{PROFILES, VolumesSpec},
};
use crate::{
    product::{DraftWork, InputDataset, ProductFactory, ShardSamples},
    sections::JobContext,
};
use form::{Checker, FormErrors, Schema, schema_of};
use format::Product;

/// Volumes as the factory makes them.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::VOLUMES,
    keys,
    profiles: PROFILES,
    key_hints: &[
        ("objects", "the objects are those of the dataset of views"),
        ("sensor", "the sensor is that of the job of the views"),
        ("scenes", "name a dataset of views of the objects: `views.dataset`"),
        ("grasps", "name a dataset of these grasps among the bodies of the scenes: `picks.dataset`"),
        ("grid", "the cube is `fusion`: `size`, `resolution`, `truncation_voxels`"),
        ("volume", "the cube is `fusion`: `size`, `resolution`, `truncation_voxels`"),
    ],
    hand_uses: &[],
    inputs: &[
        InputDataset { section: "views", product: Product::VIEWS },
        InputDataset { section: "picks", product: Product::PICKS },
    ],
    draft,
};

fn keys(title: &str) -> Schema {
    schema_of::<VolumesSpec>(title)
}

fn draft(keys: &toml::Table, checker: Checker, folder: &Path, _: &JobContext) -> Result<DraftWork, FormErrors> {
    let (spec, mut checker) = checker.value_of::<VolumesSpec>(keys)?;
    let settings = check::settings(&mut checker, &spec);
    let dataset = check::dataset(&mut checker, &spec, folder);
    let views = dataset.as_ref().and_then(|dataset| check::views(&mut checker, &spec, &settings, dataset));
    let grasps = views.as_ref().and_then(|views| check::grasps(&mut checker, &spec, folder, views));
    checker.finish()?;
    let (dataset, views) = (dataset.expect("a missing one was reported"), views.expect("mistakes were reported"));
    Ok(DraftWork::ready(
        VolumeJob { dataset, views, settings, grasps },
        ShardSamples::or_share(spec.shards.samples, 8..=256),
    ))
}
