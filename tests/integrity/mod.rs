//! Damage, forgery, differences and full disks are found and reported; kept inputs of the fuzzer are taken.

mod bounds;
mod descriptions;
mod difference;
mod disk;
mod evil_input;
mod facts;
mod flips;
mod forged;
mod forger;
mod fuzz_corpus;
mod irregular;
mod links;
mod names;
mod panics;
mod places;
mod remedies;
mod surroundings;
mod together;
mod verification;
mod wire_tree;
