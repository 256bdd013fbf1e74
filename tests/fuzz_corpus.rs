//! Every kept input of the fuzzer, replayed without it: none may panic, hang or take memory beyond a bound. Inputs that once
//! did are named `crash-...`.

use std::{fs, path::Path, time::Instant};

#[cfg(feature = "sim")]
#[path = "products/mod.rs"]
mod products;
#[cfg(feature = "sim")]
#[path = "fuzz_seeds/mod.rs"]
mod seeds;
#[path = "../fuzz/targets/mod.rs"]
mod targets;

use targets::{MESHES, RECORDS, TABLES, TARGETS, parts};

/// Slowest input in a release build, on a machine that does something else [s].
const SLOWEST: f64 = 5.0;

#[test]
fn every_kept_input_is_taken() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    for (name, target) in TARGETS {
        let mut inputs: Vec<_> = fs::read_dir(corpus.join(name))
            .unwrap_or_else(|error| panic!("fuzz/corpus/{name}: {error}"))
            .map(|entry| entry.expect("an input").path())
            .collect();
        inputs.sort();
        assert!(!inputs.is_empty(), "{name} has no inputs");
        let mut slowest = 0.0f64;
        for path in &inputs {
            let input = fs::read(path).expect("an input");
            let began = Instant::now();
            // What fails says its own name only where it is told.
            let taken = std::panic::catch_unwind(|| target(&input));
            assert!(taken.is_ok(), "{}: the target panicked", path.display());
            slowest = slowest.max(began.elapsed().as_secs_f64());
        }
        println!("{name:14} {:4} inputs, the slowest {slowest:.3} s", inputs.len());
        assert!(slowest < SLOWEST, "{name}: {slowest} s");
    }
}

/// What the fuzzer never keeps: nothing, and one byte of each kind.
#[test]
fn inputs_of_no_and_one_byte_are_taken() {
    let kinds = RECORDS.max(TABLES.len()).max(MESHES.len()) as u8;
    for (_, target) in TARGETS {
        target(&[]);
        (0..kinds).for_each(|kind| target(&[kind]));
    }
    targets::TARGETS.iter().find(|(name, _)| *name == "shard_content").expect("a target").1(&parts(&[], &[]));
}

/// `make fuzz-seeds`: not a check, so nothing happens unless it is asked for.
#[cfg(feature = "sim")]
#[test]
fn seeds_are_written_where_asked_for() {
    if std::env::var_os("GRASPMILL_WRITE_SEEDS").is_some() {
        seeds::write();
    }
}
