//! The fuzzer: feeds the target that `GRASPMILL_FUZZ_TARGET` names.
#![no_main]

use std::sync::LazyLock;

use graspmill_fuzz::{TARGETS, Target};
use libfuzzer_sys::fuzz_target;

static TARGET: LazyLock<Target> = LazyLock::new(|| {
    let name = std::env::var("GRASPMILL_FUZZ_TARGET").unwrap_or_default();
    let names = TARGETS.map(|(name, _)| name).join(", ");
    let found = TARGETS.into_iter().find(|(target, _)| *target == name);
    found.unwrap_or_else(|| panic!("GRASPMILL_FUZZ_TARGET is '{name}', not one of {names}")).1
});

fuzz_target!(|input: &[u8]| TARGET(input));
