//! The row of heatmaps in the factory's table of products.

use std::path::Path;

use super::{
    check,
    spec::{HeatmapsSpec, PROFILES},
};
use crate::{
    product::{DraftWork, InputDataset, ProductFactory, ShardSamples},
    sections::JobContext,
};
use form::{Checker, FormErrors, schema_of};
use format::Product;

/// Heatmaps as the factory makes them.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::HEATMAPS,
    keys: schema_of::<HeatmapsSpec>,
    profiles: PROFILES,
    key_hints: &[
        ("objects", "the objects are those of the dataset of views"),
        ("scenes", "name a dataset of views of the objects, and one of picks: `views.dataset`, `picks.dataset`"),
        ("grasps", "name a dataset of these grasps among the bodies of the scenes: `picks.dataset`"),
        ("camera", "the cameras are those of the dataset of views"),
        ("render", "heatmaps of scenes have no colours"),
        ("images", "every image stores its depth: `heatmaps.depth_step`; the angle is `heatmaps.max_angle`"),
    ],
    hand_uses: &[],
    inputs: &[
        InputDataset { section: "views", product: Product::VIEWS },
        InputDataset { section: "picks", product: Product::PICKS },
    ],
    draft,
};

fn draft(keys: &toml::Table, checker: Checker, folder: &Path, _: &JobContext) -> Result<DraftWork, FormErrors> {
    let (spec, mut checker) = checker.value_of::<HeatmapsSpec>(keys)?;
    let job = check::job(&mut checker, &spec, folder);
    checker.finish()?;
    Ok(DraftWork::ready(job.expect("mistakes were reported"), ShardSamples::or_share(spec.shards.samples, 8..=64)))
}
