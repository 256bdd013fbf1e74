//! The fuzzer: feeds the target that `GRASPMILL_FUZZ_TARGET` names.
#![no_main]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    sync::LazyLock,
};

use graspmill_fuzz::{TARGETS, Target};
use libfuzzer_sys::fuzz_target;

/// Most bytes at once: a chunk of a shard is 1 GiB at most.
const MAX: usize = 1100 << 20;

/// The system's allocator, which ends the program over a block of more than [`MAX`]. libFuzzer's own limit wants a sanitizer.
struct Bounded;

#[global_allocator]
static BOUNDED: Bounded = Bounded;

fn check(bytes: usize) {
    if bytes > MAX {
        eprintln!("a block of {bytes} bytes is more than {MAX}");
        std::process::abort();
    }
}

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Bounded {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        check(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        check(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        check(bytes);
        unsafe { System.realloc(block, layout, bytes) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        unsafe { System.dealloc(block, layout) }
    }
}

static TARGET: LazyLock<Target> = LazyLock::new(|| {
    let name = std::env::var("GRASPMILL_FUZZ_TARGET").unwrap_or_default();
    let names = TARGETS.map(|(name, _)| name).join(", ");
    let found = TARGETS.into_iter().find(|(target, _)| *target == name);
    found.unwrap_or_else(|| panic!("GRASPMILL_FUZZ_TARGET is '{name}', not one of {names}")).1
});

fuzz_target!(|input: &[u8]| TARGET(input));
