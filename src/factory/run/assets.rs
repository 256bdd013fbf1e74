//! Prepares every mesh of a job once, on all threads: its row in the asset table, and its shape.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::contain::contain;
use crate::{Event, ProduceError, RunContext, RunError};
use assets::{AssetRecord, MeshRefusal, MeshSource, object::PreparedObject};
use kernel::voxel::ShapeDescriptor;

/// Results of preparation, in the order of the sources.
pub struct PreparedAssets {
    /// The asset's row, or the reason why it cannot be used.
    pub records: Vec<Result<AssetRecord, MeshRefusal>>,
    /// The shape of each usable asset, for the search for twins; `None` where the mesh was refused.
    pub shapes: Vec<Option<ShapeDescriptor>>,
}

/// Prepares every source; the meshes themselves are dropped again, so memory does not grow with their count. `with_solids`:
/// whether a mesh without a solid cell is refused.
///
/// # Errors
/// When the run is cancelled or threads can't be started; a mesh that cannot be used is not an error here.
pub fn prepare_assets(
    sources: &[MeshSource],
    with_solids: bool,
    context: &RunContext<'_>,
) -> Result<PreparedAssets, RunError> {
    let done = AtomicU64::new(0);
    let total = sources.len() as u64;
    let prepare = |source: &MeshSource| {
        if context.cancel.is_cancelled() {
            return Err(RunError::Interrupted);
        }
        let prepare_one = || {
            let object = match PreparedObject::prepare(source) {
                Ok(object) => object,
                Err(refusal) => return Ok(Err(refusal)),
            };
            if let Some(times) = object.record().solid_effort {
                (context.listener)(Event::CostlyMesh { mesh: source.name.clone(), times });
            }
            if let Some(Err(refusal)) = with_solids.then(|| object.check_solid(source)) {
                return Ok(Err(refusal));
            }
            context.cancel.check()?;
            let shape = ShapeDescriptor::from_mesh(object.mesh(), object.inside_test());
            Ok::<_, ProduceError>(Ok((object.record().clone(), shape)))
        };
        let prepared = contain(|| format!("preparing the mesh `{}`", source.name), prepare_one)?;
        (context.listener)(Event::Prepared { done: done.fetch_add(1, Ordering::Relaxed) + 1, total });
        Ok(match prepared {
            Ok((record, shape)) => (Ok(record), Some(shape)),
            Err(refusal) => (Err(refusal), None),
        })
    };
    let pool = context.parallelism.pool()?;
    let prepared: Vec<_> =
        pool.install(|| sources.par_iter().with_max_len(1).map(prepare).collect::<Result<_, RunError>>())?;
    let (records, shapes) = prepared.into_iter().unzip();
    Ok(PreparedAssets { records, shapes })
}
