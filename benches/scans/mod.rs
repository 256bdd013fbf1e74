//! Real meshes for the benches, and times per item of many.

use graspmill::geom::TriMesh;

use crate::support::meshes::{prepare_scan, scan_files};

/// Eight scans spread over the set, prepared as a job does.
pub fn scans() -> Vec<TriMesh> {
    let files = scan_files();
    files.iter().step_by(files.len() / 8).take(8).map(|file| prepare_scan(file)).collect()
}

/// Runs `work` once for each of `items`; criterion gets the time per item.
pub fn average<T>(bencher: &mut criterion::Bencher<'_>, items: &[T], mut work: impl FnMut(&T)) {
    bencher.iter_custom(|count| {
        let began = std::time::Instant::now();
        for _ in 0..count {
            items.iter().for_each(&mut work);
        }
        began.elapsed() / items.len() as u32
    });
}
