//! Messages about damaged files have remedies that give the dataset back.

use std::{fs, io::ErrorKind, path::Path};

use crate::support::{
    files::{copy_folder, digest_dataset, flip_bit, list_names, list_shards},
    jobs::NO_SPLIT,
    program::Program,
    workspace::Workspace,
};

/// Three views of a box in two shards.
const JOB: &str = "objects = [{ built_in = [\"box-01\"] }]\nviews = { even = 3 }\ngrid = { resolution = 12 }\n\
                   gate = { min_partial_cells = 1 }\nshards = { samples = 2 }\n";

/// Damages a file.
type Damage = fn(&Path);

const DAMAGES: [(&str, Damage); 3] = [
    ("a flipped bit", |file| flip_bit(file)),
    ("a lost file", |file| fs::remove_file(file).expect("a file")),
    ("an empty file", |file| fs::write(file, "").expect("a file")),
];

#[test]
fn what_is_damaged_comes_back_as_the_message_tells() {
    let workspace = Workspace::new();
    let data = workspace.make_dataset("data", &format!("{JOB}{NO_SPLIT}"), &[]);
    let expected = digest_dataset(&data);
    let shard = list_shards(&data)[1].strip_prefix(&data).expect("inside").to_owned();
    let tables = list_names(&data).into_iter().filter(|name| data.join(name).is_file());
    for file in tables.map(Into::into).chain([shard]) {
        for (what, damage) in DAMAGES {
            // A table of no rows is empty; what is no part of the dataset may be lost.
            if fs::metadata(data.join(&file)).expect("a file").len() == 0 {
                continue;
            }
            // Both commands name a remedy, and each remedy alone gives the dataset back.
            for verb in ["verify", "inspect"] {
                let copy = workspace.path("copy");
                copy_folder(&data, &copy);
                damage(&copy.join(&file));
                let outcome = Program::on(verb, &copy).finish();
                let message = outcome.text();
                let message = match message.contains("`graspmill verify` of the dataset explains how") {
                    true => Program::on("verify", &copy).expect_code(4).text(),
                    false => message,
                };
                if outcome.code != Some(0) || message.contains("is damaged") {
                    follow(&message, &copy, &file);
                    workspace.run_job("data", "copy").succeed();
                    Program::on("verify", &copy).succeed();
                    assert!(digest_dataset(&copy) == expected, "{verb} of {}: {what}: {message}", file.display());
                }
                fs::remove_dir_all(&copy).expect("a copy");
            }
        }
    }
}

/// Deletes what a message names, unless it is lost already.
fn follow(message: &str, dataset: &Path, file: &Path) {
    let delete = |path: &Path| match fs::remove_file(dataset.join(path)) {
        Err(error) if error.kind() != ErrorKind::NotFound => panic!("{}: {error}", path.display()),
        _ => (),
    };
    if message.contains("delete manifest.json and `run` the job again") {
        delete(Path::new("manifest.json"));
    } else if message.contains("delete this shard if it exists") {
        let named = message.split_whitespace().find_map(|word| word.find("shards/").map(|at| &word[at..]));
        delete(Path::new(named.expect("a shard").trim_end_matches(':')));
    } else {
        let remedy = message.contains("delete it") || message.contains("to resume");
        assert!(remedy, "no remedy for {}: {message}", file.display());
        delete(file);
    }
}
