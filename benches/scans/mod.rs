//! What the benches share: real meshes, and times of one of many.

use std::path::Path;

use graspmill::{
    assets::{MeshSource, list_folder, prepare},
    geom::TriMesh,
};

/// Eight scans spread over the set, prepared as a job does.
pub fn scans() -> Vec<TriMesh> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(".deps/ycb");
    let files = list_folder(&folder).unwrap_or_else(|error| panic!("{error}; `make setup` fetches the scans"));
    let step = files.len() / 8;
    let scans = files
        .into_iter()
        .step_by(step)
        .take(8)
        .map(|path| prepare(&MeshSource::of_file("scan", &path)).expect("a sound scan").mesh);
    scans.collect()
}

/// Runs `work` once for each of `items`; criterion is told the time of one.
pub fn average<T>(bencher: &mut criterion::Bencher<'_>, items: &[T], mut work: impl FnMut(&T)) {
    bencher.iter_custom(|count| {
        let began = std::time::Instant::now();
        for _ in 0..count {
            items.iter().for_each(&mut work);
        }
        began.elapsed() / items.len() as u32
    });
}
