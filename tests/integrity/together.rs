//! Two runs in one folder at the same time: each ends well, with one dataset.

use std::path::Path;

use crate::support::{
    products::{MadeProduct, made_products, small_product},
    program::{Program, print_root},
    workspace::Workspace,
};

/// Runs a job twice at the same time into a folder, so often; each time both must end well and agree.
#[track_caller]
fn run_together(made: &MadeProduct, times: usize) {
    for time in 0..times {
        let workspace = Workspace::new();
        let folder = workspace.path("data");
        let script = format!(
            "{0} & first=$!; {0} & second=$!; wait $first; echo exit $?; wait $second; echo exit $?",
            made.shell_words(&folder.display().to_string())
        );
        let said = Program::of_system("bash").option("-c", script).arg(env!("CARGO_BIN_EXE_graspmill")).finish().text();
        let codes: Vec<&str> = said.lines().filter_map(|line| line.strip_prefix("exit ")).collect();
        assert!(
            codes.len() == 2 && codes.iter().all(|code| ["0", "3"].contains(code)),
            "{} {time}: {said}",
            made.product
        );
        assert_eq!(print_root(&folder), made.root, "{} {time}", made.product);
        assert_no_leftover(&folder);
    }
}

/// Neither the folder nor its shards hold a temporary file, or one that was set aside.
#[track_caller]
fn assert_no_leftover(folder: &Path) {
    for folder in [folder.to_owned(), folder.join("shards")] {
        for name in crate::support::files::list_names(&folder) {
            assert!(!name.ends_with(".tmp") && !name.ends_with(".bad"), "{}: {name}", folder.display());
        }
    }
}

#[test]
fn two_runs_at_once_end_well_and_agree() {
    for product in ["completion", "patches"] {
        run_together(&small_product(product), 3);
    }
}

#[test]
#[ignore = "fifty times two runs of completion and patches, ten of every other product: half an hour of two cores"]
fn two_runs_at_once_end_well_and_agree_fifty_times() {
    for made in made_products() {
        let times = if ["completion", "patches"].contains(&made.product) { 50 } else { 10 };
        run_together(made, times);
        println!("{:14} {times} tried", made.product);
    }
}
