//! Every kept input of the fuzzer, replayed without it: none may panic, hang or take memory beyond a bound. Inputs that
//! once did are named `crash-...`.

#[path = "fuzz_seeds.rs"]
pub mod seeds;
#[path = "../../fuzz/targets/mod.rs"]
pub mod targets;

use std::{fs, panic, time::Instant};

use targets::{ARRANGEMENTS, CAMERAS, MESHES, MODELS, PICTURES, TABLES, TARGETS, count_records, parts};

use crate::support::files::{list_names, repository_path};

/// Slowest input in a release build, on a machine that does something else [s].
const SLOWEST: f64 = 5.0;

#[test]
fn every_kept_input_is_taken() {
    for (name, target) in TARGETS {
        let folder = repository_path("fuzz/corpus").join(name);
        let inputs = list_names(&folder);
        assert!(!inputs.is_empty(), "{name} has no inputs");
        let mut slowest = 0.0f64;
        for file in &inputs {
            let input = fs::read(folder.join(file)).expect("an input");
            let began = Instant::now();
            // A panic does not name its input.
            let taken = panic::catch_unwind(|| target(&input));
            assert!(taken.is_ok(), "{name}/{file}: the target panicked");
            slowest = slowest.max(began.elapsed().as_secs_f64());
        }
        println!("{name:14} {:4} inputs, the slowest {slowest:.3} s", inputs.len());
        assert!(slowest < SLOWEST, "{name}: {slowest} s");
    }
}

/// Inputs that the fuzzer never keeps: nothing, and one byte of each kind.
#[test]
fn inputs_of_no_and_one_byte_are_taken() {
    let kinds = [TABLES.len(), MESHES.len(), ARRANGEMENTS.len(), CAMERAS.len(), MODELS.len(), PICTURES.len()];
    let kinds = kinds.into_iter().fold(count_records(), usize::max) as u8;
    for (_, target) in TARGETS {
        target(&[]);
        (0..kinds).for_each(|kind| target(&[kind]));
    }
    TARGETS.iter().find(|(name, _)| *name == "shard_content").expect("a target").1(&parts([&[]; 3], &[]));
}

/// `make fuzz-seeds`: not a check, so it does nothing unless requested.
#[test]
fn seeds_are_written_where_asked_for() {
    if std::env::var_os("GRASPMILL_WRITE_SEEDS").is_some() {
        seeds::write();
    }
}
