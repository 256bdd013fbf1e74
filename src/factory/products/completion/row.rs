//! The row of completion in the factory's table of products.

use std::path::Path;

use nalgebra::{Point3, Vector3};

use super::{
    check,
    scene::{reach_of, shortest_distance},
    settings::{CompletionJob, CompletionSettings, Renderer},
    spec::{CompletionSpec, PROFILES},
};
use crate::{
    product::{DraftWork, ProductFactory, default_shard_samples},
    products::pair::touch::HAND_USES,
    sections::{JobContext, JobObject, JobObjects, ObjectsDraft, describe_cameras, describe_sensors},
};
use form::{Checker, FormErrors, Schema, schema_of};
use format::{PARTIAL_INSIDE_COMPLETE, Product};
use kernel::{
    geom::{Aabb, GridPlacement},
    render::SensorModel,
    voxel::Truth,
    words::counted,
};

/// Completion as the factory makes it.
pub static FACTORY: ProductFactory = ProductFactory {
    product: Product::COMPLETION,
    keys,
    profiles: PROFILES,
    key_hints: &[(
        "camera.fovy",
        "give `camera.horizontal_fov` in radians: 2 atan(width / height * tan(fovy / 2)), or a camera of an MJCF file \
         by `camera.scene`",
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
        notes.extend(nearer_than_sensor(&objects, &settings));
        CompletionJob { objects, settings }
    });
    let rules = if obeys { vec![PARTIAL_INSIDE_COMPLETE] } else { Vec::new() };
    Ok(DraftWork { draws_colours, rules, ..work })
}

/// A warning about objects that come nearer to the camera than the sensor measures: a part of their depth is lost.
fn nearer_than_sensor(objects: &JobObjects, settings: &CompletionSettings) -> Option<String> {
    let [measures_from, _] = settings.sensor.as_ref()?.range();
    // Nearest depth of each object over all rotations, and by how much the sensor misses it.
    let depth = |object: &JobObject| {
        let (min, extents) = (Point3::from(object.asset.lower), Vector3::from(object.asset.extents));
        let bounds = Aabb { min, max: min + extents };
        shortest_distance(settings, &bounds) - reach_of(settings.pivot, &bounds)
    };
    let near: Vec<(f64, &JobObject)> =
        objects.list.iter().map(|object| (depth(object), object)).filter(|(depth, _)| *depth < measures_from).collect();
    let (nearest, object) = near.iter().min_by(|(one, _), (other, _)| one.total_cmp(other))?;
    let farther = ((measures_from - nearest) * 100.0).ceil() / 100.0;
    let other = SensorModel::profiles().filter_map(SensorModel::profile).find(|model| model.range()[0] <= *nearest);
    let other = other.map_or_else(String::new, |model| {
        format!(", or set `sensor.profile = \"{}\"`, which measures from {} m", model.profile_name(), model.range()[0])
    });
    Some(format!(
        "{} of {} can be nearer to the camera than the sensor measures ({measures_from} m), so that part of their \
         depth is lost (nearest: `{}`, {nearest:.3} m); to keep it, increase `distance` by {farther:.2} m{other}",
        near.len(),
        counted(objects.list.len() as u64, "object"),
        object.source.name,
    ))
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
         partials are dotted (smallest: `{}`, {:.0} mm); use a shorter `distance`, or `distance = {{ fit = 0.3 }}`",
        small.len(),
        counted(objects.list.len() as u64, "object"),
        if small.len() == 1 { "is" } else { "are" },
        pixel * cells * 1e3,
        smallest.source.name,
        side(&smallest) * 1e3,
    ))
}
