//! The row of completion in the factory's table of products.

use std::path::Path;

use super::{
    check,
    settings::{CompletionJob, CompletionSettings, Renderer},
    spec::{CompletionSpec, PROFILES},
};
use crate::{
    job::{
        DraftWork, JobContext, JobObject, JobObjects, ObjectsDraft, default_shard_samples, describe_cameras,
        describe_sensors,
    },
    product::ProductFactory,
    products::pair::touch::HAND_USES,
};
use form::{Checker, FormErrors, Schema, schema_of};
use format::{PARTIAL_INSIDE_COMPLETE, Product};
use kernel::{geom::GridPlacement, voxel::Truth, words::counted};

/// Completion as the factory makes it.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::COMPLETION,
    keys,
    profiles: PROFILES,
    other_words: &[(
        "camera.fovy",
        "give `camera.horizontal_fov` in radians: 2 atan(width / height * tan(fovy / 2)), or a camera of an MJCF file by \
         `camera.scene`",
    )],
    hand_uses: HAND_USES,
    inputs: &[],
    draft,
};

fn keys(title: &str) -> Schema {
    let mut schema = schema_of::<CompletionSpec>(title);
    describe_sensors(&mut schema.value_mut()["properties"]["sensor"]["properties"]);
    describe_cameras(&mut schema.value_mut()["properties"]["camera"]["properties"]["preset"]);
    schema
}

fn draft(keys: &toml::Table, checker: Checker, folder: &Path, context: &JobContext) -> Result<DraftWork, FormErrors> {
    let (spec, mut checker) = checker.value_of::<CompletionSpec>(keys)?;
    let settings = check::settings(&mut checker, &spec, folder);
    let objects = ObjectsDraft::read(checker, &spec.split, &spec.objects, folder, context)?;
    let shard_samples = spec.shards.samples.unwrap_or_else(|| default_shard_samples(settings.views.len() as u32));
    let draws_colours = settings.renderer == Renderer::MujocoGl;
    let obeys = settings.truth == Truth::AnyOverlap && settings.sensor.is_none() && !settings.drop_index_zero;
    let work = DraftWork::of_objects(objects, shard_samples, |objects, notes| {
        notes.extend(dotted_partials(&objects, &settings));
        CompletionJob { objects, settings }
    });
    let rules = if obeys { vec![PARTIAL_INSIDE_COMPLETE] } else { Vec::new() };
    Ok(DraftWork { draws_colours, rules, ..work })
}

/// A warning about objects whose grid cells are narrower than a pixel: their partial grids come out dotted.
fn dotted_partials(objects: &JobObjects, settings: &CompletionSettings) -> Option<String> {
    let distance = settings.distance.farthest()?;
    let pixel = distance / settings.camera.fx.min(settings.camera.fy);
    let cells = GridPlacement::FILL * f64::from(settings.resolution);
    let side = |object: &&JobObject| object.asset.extents.into_iter().fold(0.0, f64::max);
    let small: Vec<&JobObject> = objects.list.iter().filter(|object| side(object) < pixel * cells).collect();
    let smallest = small.iter().copied().min_by(|a, b| side(a).total_cmp(&side(b)))?;
    Some(format!(
        "{} of {} {} under {:.0} mm: at {distance} m their grid cells are narrower than a pixel, so their \
         partials are dotted (smallest: `{}`, {:.0} mm); a shorter `distance`, or `distance = {{ fit = 0.3 }}`, mends it",
        small.len(),
        counted(objects.list.len() as u64, "object"),
        if small.len() == 1 { "is" } else { "are" },
        pixel * cells * 1e3,
        smallest.source.name,
        side(&smallest) * 1e3,
    ))
}
