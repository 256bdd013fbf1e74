//! Lets all programs that cargo runs find libmujoco: tests and doctests of every crate above.

use std::{env, error::Error, fs, os::unix::fs::symlink, path::PathBuf};

/// Cargo lets programs that it starts find libraries in the folder of a build script: this adds a link to ours there.
fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=MUJOCO_DYNAMIC_LINK_DIR");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    println!("cargo:rustc-link-search=native={}", out.display());
    // Without a library, building fails later, with a message that explains how to get it.
    let entries = env::var_os("MUJOCO_DYNAMIC_LINK_DIR").and_then(|folder| fs::read_dir(folder).ok());
    for entry in entries.into_iter().flatten() {
        let entry = entry?;
        if entry.file_name().to_string_lossy().starts_with("libmujoco.so") {
            let link = out.join(entry.file_name());
            // A link of an earlier build may point to nowhere.
            if link.symlink_metadata().is_ok() {
                fs::remove_file(&link)?;
            }
            symlink(fs::canonicalize(entry.path())?, link)?;
        }
    }
    Ok(())
}
