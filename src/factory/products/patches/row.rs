//! The row of patches in the factory's table of products.

use std::path::Path;

use super::{
    check,
    spec::{PROFILES, PatchesSpec},
};
use crate::{
    product::{DraftWork, InputDataset, ProductFactory},
    sections::JobContext,
};
use form::{Checker, FormErrors, schema_of};
use format::Product;

/// Patches as the factory makes them.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::PATCHES,
    keys: schema_of::<PatchesSpec>,
    profiles: PROFILES,
    key_hints: &[],
    hand_uses: &[],
    inputs: &[InputDataset { section: "grasps", product: Product::GRASPS }],
    draft,
};

fn draft(keys: &toml::Table, checker: Checker, folder: &Path, _: &JobContext) -> Result<DraftWork, FormErrors> {
    let (spec, mut checker) = checker.value_of::<PatchesSpec>(keys)?;
    let job = check::job(&mut checker, &spec, folder);
    checker.finish()?;
    let job = job.expect("faults of grasps, hand and camera were reported");
    let draws_colours = job.settings.colour.is_some();
    Ok(DraftWork { draws_colours, ..DraftWork::ready(job, spec.shards.samples) })
}
