//! The documents: every block of README.md, CONTRIBUTING.md and docs/ is accepted or run, every link has a target, and
//! statements about the program and the tests are true.

mod accepted;
mod blocks;
mod commands;
mod examples;
mod links;
mod programs;
mod running;
mod statements;
mod threats;
