//! The row of scenes in the factory's table of products.

use std::path::Path;

use super::{
    check, import, loaded,
    settings::SceneJob,
    spec::{PROFILES, ScenesSpec},
};
use crate::{
    product::{DraftWork, ProductFactory, ShardSamples},
    sections::{JobContext, ObjectsDraft},
};
use form::{Checker, FormErrors, Mistakes, schema_of};
use format::Product;

/// Scenes as the factory makes them.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::SCENES,
    keys: schema_of::<ScenesSpec>,
    profiles: PROFILES,
    key_hints: &[
        ("bodies", "`count` sets the number of bodies per scene"),
        ("scenes.count", "`count` sets the number of bodies per scene, `scenes.training` the number of scenes"),
        ("bin", "`container` sets the size of the bin"),
    ],
    hand_uses: &[],
    inputs: &[],
    draft,
};

fn draft(keys: &toml::Table, checker: Checker, folder: &Path, context: &JobContext) -> Result<DraftWork, FormErrors> {
    let (spec, mut checker) = checker.value_of::<ScenesSpec>(keys)?;
    let mut settings = check::settings(&mut checker, &spec, folder);
    let document = checker.document().clone();
    let objects = ObjectsDraft::read(checker, &spec.split, &spec.objects, folder, context)?;
    if let Some(spec) = &spec.import {
        // Arrangements name the objects that were found.
        let names: Vec<&str> = objects.0.sources().map(|source| source.name.as_str()).collect();
        let mut checker = Checker::new(document, Mistakes::default());
        let import = import::read(&mut checker, spec, folder, &names, settings.is_contained());
        checker.finish()?;
        settings = settings.with_import(import.expect("mistakes were reported"));
    }
    let work = DraftWork::of_objects(objects, ShardSamples::or_share(spec.shards.scenes, 4..=64), |objects, notes| {
        if settings.import.is_none() {
            notes.extend(loaded::too_large_notes(&objects, &settings));
        }
        SceneJob { objects, settings }
    });
    Ok(DraftWork { with_masses: true, with_solids: true, of_one_body: true, ..work })
}
