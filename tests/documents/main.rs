//! The documents: every block of README.md, CONTRIBUTING.md and docs/ is accepted or run, every link leads somewhere, and what they say of the
//! program and of the tests is so.

mod accepted;
mod blocks;
mod commands;
mod examples;
mod links;
mod programs;
mod running;
mod statements;
#[path = "../support/mod.rs"]
mod support;
mod threats;
