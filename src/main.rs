//! The `graspmill` program: parse, run, exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    graspmill::cli::main()
}
