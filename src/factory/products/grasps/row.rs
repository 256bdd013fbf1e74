//! The row of grasps in the factory's table of products.

use std::path::Path;

use super::{
    check,
    hand::HAND_USES,
    settings::GraspJob,
    spec::{GraspsSpec, PROFILES},
};
use crate::{
    product::{DraftWork, ProductFactory},
    sections::{JobContext, ObjectsDraft},
};
use form::{Checker, FormErrors, schema_of};
use format::Product;

/// Grasps as the factory makes them.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::GRASPS,
    keys: schema_of::<GraspsSpec>,
    profiles: PROFILES,
    key_hints: &[("grasps.runs", "`grasps.seeds` sets the number of runs per object")],
    hand_uses: HAND_USES,
    inputs: &[],
    draft,
};

fn draft(keys: &toml::Table, checker: Checker, folder: &Path, context: &JobContext) -> Result<DraftWork, FormErrors> {
    let (spec, mut checker) = checker.value_of::<GraspsSpec>(keys)?;
    let (settings, hand) = check::settings(&mut checker, &spec, folder);
    let objects = ObjectsDraft::read(checker, &spec.split, &spec.objects, folder, context)?;
    let hand = hand.expect("a fault of the hand was reported");
    let shard_samples = spec.shards.runs.unwrap_or(settings.seeds);
    let with_masses = settings.asks_for_masses();
    let work = DraftWork::of_objects(objects, shard_samples, |objects, _| GraspJob { objects, hand, settings });
    Ok(DraftWork { with_masses, with_solids: true, of_one_body: true, ..work })
}
