//! From `.proto` files to Rust types and to the `FileDescriptorSet`s that shards carry, for the build scripts of crates: pure
//! Rust, no `protoc` needed.

use std::{
    env,
    error::Error,
    fs,
    path::{Path, PathBuf},
};

/// Compiles the files of `proto/` whose stem is wanted, for a crate two folders below the repository's root.
///
/// Each file becomes `<stem>.bin`, with what it imports but without comments and positions, so that rewording a comment
/// or adding another file moves no byte of a shard. The types are made of all files at once: several share a package.
pub fn compile(is_wanted: fn(&str) -> bool) -> Result<(), Box<dyn Error>> {
    let folder =
        Path::new(&env::var_os("CARGO_MANIFEST_DIR").ok_or("cargo sets CARGO_MANIFEST_DIR")?).join("../../proto");
    println!("cargo:rerun-if-changed={}", folder.display());
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    let mut files = Vec::new();
    for entry in fs::read_dir(&folder)? {
        let path = entry?.path();
        let is_schema = path.extension().is_some_and(|extension| extension == "proto");
        if is_schema && path.file_stem().is_some_and(|stem| is_wanted(&stem.to_string_lossy())) {
            files.push(path);
        }
    }
    files.sort();
    for file in &files {
        let mut descriptors = protox::compile([file], [&folder])?;
        for descriptor in &mut descriptors.file {
            descriptor.source_code_info = None;
        }
        let stem = file.file_stem().ok_or("a .proto file has a stem")?;
        fs::write(out.join(stem).with_extension("bin"), prost::Message::encode_to_vec(&descriptors))?;
    }
    // The well-known types beside ours: one message of them is no reason for another dependency.
    prost_build::Config::new().compile_well_known_types().compile_fds(protox::compile(&files, [&folder])?)?;
    Ok(())
}
