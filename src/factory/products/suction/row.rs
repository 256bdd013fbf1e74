//! The row of suction in the factory's table of products.

use std::path::Path;

use super::{
    check,
    settings::SuctionJob,
    spec::{PROFILES, SuctionJobSpec},
};
use crate::{
    product::{DraftWork, InputDataset, ProductFactory, ShardSamples},
    products::settled::draft_objects,
    sections::JobContext,
};
use form::{Checker, FormErrors, schema_of};
use format::Product;

/// Suction as the factory makes it.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::SUCTION,
    keys: schema_of::<SuctionJobSpec>,
    profiles: PROFILES,
    key_hints: &[
        ("objects", "the objects are those of the dataset of scenes"),
        ("physics", "masses are those of the dataset of scenes; friction of the lip is `cup.friction`"),
        ("hand", "the tool is a suction cup: `[cup]`"),
        ("sampling", "poses are drawn by the keys of `[suction]`"),
    ],
    hand_uses: &[],
    inputs: &[InputDataset { section: "scenes", product: Product::SCENES }],
    draft,
};

fn draft(keys: &toml::Table, checker: Checker, folder: &Path, context: &JobContext) -> Result<DraftWork, FormErrors> {
    let (spec, mut checker) = checker.value_of::<SuctionJobSpec>(keys)?;
    let checked = check::checked(&mut checker, &spec, folder);
    checker.finish()?;
    let check::Checked { scenes_folder, scenes, keys, cup } = checked.expect("mistakes were reported");
    let objects = draft_objects(&keys, &scenes, &scenes_folder, context)?;
    let settings = spec.suction.into();
    Ok(DraftWork::of_objects(objects, ShardSamples::or_share(spec.shards.samples, 8..=64), move |objects, _| {
        SuctionJob { scenes_folder, scenes, objects, cup, settings }
    }))
}
