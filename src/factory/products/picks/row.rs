//! The row of picks in the factory's table of products.

use std::path::Path;

use super::{
    check,
    settings::PickJob,
    spec::{PROFILES, PicksSpec},
};
use crate::{
    product::{DraftWork, InputDataset, ProductFactory, ShardSamples},
    products::settled::draft_objects,
    sections::JobContext,
};
use form::{Checker, FormErrors, schema_of};
use format::Product;

/// Picks as the factory makes them.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::PICKS,
    keys: schema_of::<PicksSpec>,
    profiles: PROFILES,
    key_hints: &[
        ("objects", "the objects are those of the dataset of scenes"),
        ("physics", "friction is that of the dataset of scenes; `picks.trials` sets the number of grasps to try"),
        ("clutter", "scenes and grasps are separate datasets: `scenes.dataset`, `grasps.dataset`"),
        ("sampling", "grasps are sampled by the keys of `[picks]`: `picks.sampler`, `picks.poses`"),
    ],
    hand_uses: &[],
    inputs: &[
        InputDataset { section: "scenes", product: Product::SCENES },
        InputDataset { section: "grasps", product: Product::GRASPS },
    ],
    draft,
};

fn draft(keys: &toml::Table, checker: Checker, folder: &Path, context: &JobContext) -> Result<DraftWork, FormErrors> {
    let (spec, mut checker) = checker.value_of::<PicksSpec>(keys)?;
    let checked = check::checked(&mut checker, &spec, folder);
    checker.finish()?;
    let check::Checked { scenes_folder, scenes, rolling, keys, source, hand, settings } =
        checked.expect("mistakes were reported");
    let objects = draft_objects(&keys, &scenes, &scenes_folder, context)?;
    Ok(DraftWork::of_objects(objects, ShardSamples::or_share(spec.shards.samples, 8..=64), move |objects, _| PickJob {
        scenes_folder,
        scenes,
        rolling,
        objects,
        source,
        hand,
        settings,
    }))
}
