//! Bodies that are nearer than the sensor's range.

use crate::{chart::grouped, inspection::job_table};
use format::{
    ViewFacts,
    dataset::{DatasetError, DatasetReader, Fate, layout::JOB},
};
use kernel::render::SensorModel;

/// Cameras are moved back by whole centimetres [m].
const STEP: f64 = 0.01;

/// Warning about bodies that are too near for the sensor, with the distance by which to move the cameras back; `None`
/// without such bodies.
///
/// # Errors
/// When a ledger or the job is missing or damaged.
pub(super) fn nearness_warning(reader: &DatasetReader) -> Result<Option<String>, DatasetError> {
    let manifest = reader.manifest();
    let too_near = manifest.counts.fact("too_near");
    if too_near == 0 {
        return Ok(None);
    }
    let mut nearest = f64::INFINITY;
    for shard in 0..manifest.shards.len() {
        for row in reader.ledger(shard)?.rows.iter().filter(|row| matches!(row.fate, Fate::Kept(_))) {
            let facts = ViewFacts::from(&row.facts);
            nearest = if facts.nearest > 0.0 { nearest.min(facts.nearest) } else { nearest };
        }
    }
    let measures_from = measures_from(reader)?;
    let seen = manifest.counts.fact("bodies") - manifest.counts.fact("unseen");
    let back = ((measures_from - nearest) / STEP).ceil() * STEP;
    let other = SensorModel::profiles().filter_map(SensorModel::profile).find(|model| model.range()[0] <= nearest);
    let other = other.map_or_else(String::new, |model| {
        format!(
            "; or use a sensor with a shorter minimum range: `sensor.profile = \"{}\"` measures from {} m",
            model.profile_name(),
            model.range()[0]
        )
    });
    Ok(Some(format!(
        "{} of {} bodies in the images have no depth on at least half of their pixels, which are nearer than the sensor's minimum range ({measures_from} m): the nearest pixel of a body is at {nearest:.3} m. Move the cameras of `views.cameras` back by {back:.2} m: \
         add it to both numbers of `shell.radius`, or to `overhead.height`{other}",
        grouped(too_near),
        grouped(seen)
    )))
}

/// Nearest depth that the sensor of the job returns [m].
fn measures_from(reader: &DatasetReader) -> Result<f64, DatasetError> {
    let job = job_table(reader)?;
    let constant = job.get("sensor").and_then(|sensor| sensor.get("constants")?.get("min_range_m")?.as_float());
    constant.ok_or_else(|| DatasetError::Invalid {
        path: reader.folder().path_of(JOB),
        problem: "it has no `sensor.constants.min_range_m`".to_owned(),
        remedy: "`verify` the dataset, and make it again",
    })
}
