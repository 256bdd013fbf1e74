//! Generates from `proto/` the content of the crates' folders `generated/`: Rust types, and the `FileDescriptorSet`s
//! that shards carry. They are committed, so that a build of the program needs no compiler of schemas.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use prost::Message;

/// The folder of the types that shards hold.
const OURS: &str = "src/format/generated";

/// The folder of Foxglove's types for previews; their schemas have its name.
const FOXGLOVE: &str = "src/publish/generated";

/// All generated files of a repository, by their paths from its root, made from its folder `proto/`.
pub fn generate(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let schemas = root.join("proto");
    let found = fs::read_dir(&schemas).expect("a folder").map(|entry| entry.expect("an entry").path());
    let mut found: Vec<PathBuf> = found.collect();
    found.sort();
    let is_foxglove =
        |path: &PathBuf| path.file_stem().is_some_and(|stem| stem.to_string_lossy().starts_with("foxglove"));
    let (foxglove, ours): (Vec<_>, Vec<_>) = found.into_iter().partition(is_foxglove);
    let mut files = BTreeMap::new();
    generate_into(&schemas, &ours, Path::new(OURS), &mut files);
    generate_into(&schemas, &foxglove, Path::new(FOXGLOVE), &mut files);
    files
}

/// Each schema becomes `STEM.bin`, with what it imports but without comments and positions, so that rewording a comment or
/// adding another schema moves no byte of a shard. The types are made from all schemas at once: several share a package.
fn generate_into(schemas: &Path, wanted: &[PathBuf], folder: &Path, files: &mut BTreeMap<PathBuf, Vec<u8>>) {
    for schema in wanted {
        let mut descriptors = protox::compile([schema], [schemas]).expect("a schema");
        descriptors.file.iter_mut().for_each(|descriptor| descriptor.source_code_info = None);
        let name = Path::new(schema.file_stem().expect("a stem")).with_extension("bin");
        files.insert(folder.join(name), descriptors.encode_to_vec());
    }
    let out = tempfile::tempdir().expect("a temporary folder");
    // The well-known types together with ours: one message of them does not justify another dependency.
    prost_build::Config::new()
        .compile_well_known_types()
        .out_dir(out.path())
        .compile_fds(protox::compile(wanted, [schemas]).expect("schemas"))
        .expect("types");
    for entry in fs::read_dir(out.path()).expect("a folder") {
        let path = entry.expect("an entry").path();
        files.insert(folder.join(path.file_name().expect("a name")), fs::read(&path).expect("a file"));
    }
}
