//! Checks mesh files: what each is, what is repaired, and why one is refused.
//!
//! From the root of the repository:
//!
//! ```text
//! cargo run --release --example check_meshes                  # the meshes of this repository
//! cargo run --release --example check_meshes -- my-meshes mug.stl
//! ```

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use std::{env, path::PathBuf};

use graspmill::make::{ScaleRule, SizeRule, check_report};

fn main() {
    let mut paths: Vec<PathBuf> = env::args_os().skip(1).map(PathBuf::from).collect();
    if paths.is_empty() {
        paths.push("meshes".into());
    }

    // The numbers of the files are metres: `MetresPerUnit(0.001)` reads millimetres, `LongestSide(0.2)` scales each mesh.
    let report = check_report(&paths, ScaleRule::MetresPerUnit(1.0), SizeRule::default());
    for mesh in &report.meshes {
        if let Some(record) = &mesh.record {
            let [x, y, z] = record.extents.map(|side| 100.0 * side);
            println!("{}: {} triangles, {x:.1} x {y:.1} x {z:.1} cm", mesh.file, record.triangles);
            println!("    watertight: {}, repairs: {}", record.watertight, record.repairs.len());
        }
        if let Some(refusal) = &mesh.refusal {
            println!("{}: refused: {}; {}", mesh.file, refusal.problem, refusal.remedy);
        }
    }
    let counts = &report.counts;
    println!("{} meshes: {} fine, {} repaired, {} refused", counts.total, counts.fine, counts.repaired, counts.refused);
}
