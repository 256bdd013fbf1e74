//! Looks at every mesh of a job once, on all threads: what it is, and what shape it has.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::{Cancel, Crew, Event, Listener, RunError};
use crate::{
    assets::{self, AssetRecord, MeshRefusal, MeshSource},
    produce::inside_test,
    voxel::ShapeDescriptor,
};

/// What is known of each source after preparation, in the sources' order.
pub struct PreparedAssets {
    /// The asset's row, or why it cannot be used.
    pub records: Vec<Result<AssetRecord, MeshRefusal>>,
    /// The shape of each usable asset, for the search for twins; `None` where the mesh was refused.
    pub shapes: Vec<Option<ShapeDescriptor>>,
}

/// Prepares every source; the meshes themselves are dropped again, so memory does not grow with their count.
///
/// # Errors
/// When the run is cancelled or threads can't be started; a mesh that cannot be used is not an error here.
pub fn prepare_assets(
    sources: &[MeshSource],
    crew: &Crew,
    cancel: &Cancel,
    listener: &Listener,
) -> Result<PreparedAssets, RunError> {
    let done = AtomicU64::new(0);
    let total = sources.len() as u64;
    let look_at = |source: &MeshSource| {
        if cancel.is_cancelled() {
            return Err(RunError::Interrupted);
        }
        let looked = match assets::prepare(source) {
            Ok(prepared) => {
                let shape = ShapeDescriptor::of(&prepared.mesh, inside_test(&prepared.record));
                (Ok(prepared.record), Some(shape))
            }
            Err(refusal) => (Err(refusal), None),
        };
        listener(Event::Prepared { done: done.fetch_add(1, Ordering::Relaxed) + 1, total });
        Ok(looked)
    };
    let pool = crew.pool()?;
    let looked: Vec<_> =
        pool.install(|| sources.par_iter().with_max_len(1).map(look_at).collect::<Result<_, RunError>>())?;
    let (records, shapes) = looked.into_iter().unzip();
    Ok(PreparedAssets { records, shapes })
}
