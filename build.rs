//! Generates the protobuf types of `proto/` and tells the linker where libmujoco lies beside the build.

use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    compile_protobuf()?;
    if env::var_os("CARGO_FEATURE_SIM").is_some() {
        // The program stands in target/<profile>/, test binaries one folder deeper; both find the library by
        // a path relative to themselves, so a moved checkout keeps working.
        for origin in ["$ORIGIN/../../.deps/mujoco", "$ORIGIN/../../../.deps/mujoco"] {
            println!("cargo:rustc-link-arg=-Wl,-rpath,{origin}");
        }
    }
    Ok(())
}

/// Pure Rust from `.proto` to types and to the `FileDescriptorSet` that shards carry: no `protoc` needed.
///
/// Each file becomes `<stem>.bin`, with what it imports but without comments and positions, so that rewording a comment
/// or adding another file moves no byte of a shard. The types are made of all files at once: several share a package.
fn compile_protobuf() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=proto");
    let mut files: Vec<PathBuf> = fs::read_dir("proto")?
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "proto"))
        .collect();
    files.sort();
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    for file in &files {
        let mut descriptors = protox::compile([file], ["proto"])?;
        for descriptor in &mut descriptors.file {
            descriptor.source_code_info = None;
        }
        let stem = file.file_stem().ok_or("a .proto file has a stem")?;
        fs::write(out.join(stem).with_extension("bin"), prost::Message::encode_to_vec(&descriptors))?;
    }
    // The well-known types beside ours: one message of them is no reason for another dependency.
    prost_build::Config::new().compile_well_known_types().compile_fds(protox::compile(&files, ["proto"])?)?;
    Ok(())
}
