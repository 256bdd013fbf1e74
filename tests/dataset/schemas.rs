//! The generated files of the crates are those that `proto/` makes.

use std::{fs, path::Path};

use super::support::{files::repository_path, schemas::generate};

/// `make schemas` writes them anew, which this test then finds equal.
#[test]
fn generated_files_are_those_of_the_schemas() {
    let root = repository_path("");
    let files = generate(&root);
    let folders = files.keys().map(|path| path.parent().expect("a folder").to_owned());
    for folder in folders.collect::<std::collections::BTreeSet<_>>() {
        for entry in fs::read_dir(root.join(&folder)).expect("a folder of generated files") {
            let path = folder.join(entry.expect("an entry").file_name());
            assert!(files.contains_key(&path), "{} belongs to no schema: delete it", path.display());
        }
    }
    for (path, content) in &files {
        write_if_asked(&root.join(path), content);
        let found = fs::read(root.join(path)).unwrap_or_default();
        assert!(found == *content, "{} is not what proto/ makes: run `make schemas`", path.display());
    }
}

fn write_if_asked(path: &Path, content: &[u8]) {
    if std::env::var_os("GRASPMILL_WRITE_SCHEMAS").is_some() {
        fs::write(path, content).expect("a file of the checkout");
    }
}
