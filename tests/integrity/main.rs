//! Damage, forgery, differences and full disks are found and reported; kept inputs of the fuzzer are taken.

mod difference;
mod disk;
mod evil_input;
mod facts;
mod flips;
mod forged;
mod forger;
mod fuzz_corpus;
mod irregular;
mod panics;
mod remedies;
#[path = "../support/mod.rs"]
mod support;
mod surroundings;
mod verification;
mod wire_tree;
