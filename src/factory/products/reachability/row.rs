//! The row of reachability in the factory's table of products.

use std::path::Path;

use super::{
    check,
    spec::{PROFILES, ReachabilitySpec},
};
use crate::{
    product::{DraftWork, ProductFactory},
    sections::JobContext,
};
use form::{Checker, FormErrors, schema_of};
use format::Product;

/// Reachability as the factory makes it.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::REACHABILITY,
    keys: schema_of::<ReachabilitySpec>,
    profiles: PROFILES,
    key_hints: &[],
    hand_uses: &[],
    inputs: &[],
    draft,
};

/// Approximate default of the poses per shard.
const SHARD_POSES: u32 = 65_536;

fn draft(keys: &toml::Table, checker: Checker, folder: &Path, _: &JobContext) -> Result<DraftWork, FormErrors> {
    let (spec, mut checker) = checker.value_of::<ReachabilitySpec>(keys)?;
    let job = check::job(&mut checker, &spec, folder);
    checker.finish()?;
    let job = job.expect("faults of robot and poses were reported");
    let positions = spec.shards.positions.unwrap_or_else(|| (SHARD_POSES / job.orientations().max(1)).max(1));
    Ok(DraftWork::ready(job, positions))
}
