//! The command line: the only room that prints, reads the environment and picks exit codes.

use std::process::ExitCode;

/// Parses the arguments, runs the command, returns its exit code.
pub fn main() -> ExitCode {
    ExitCode::from(2)
}
