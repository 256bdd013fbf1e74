//! The one printer: results to stdout, messages to stderr.

use std::{
    io::{self, IsTerminal, Write},
    sync::atomic::{AtomicBool, Ordering},
};

use serde::Serialize;

use super::exit::Failure;

/// Where everything that the program says goes.
#[derive(Default)]
pub struct Printer {
    has_lost_output: AtomicBool,
}

impl Printer {
    /// A result, to stdout. A reader that went away (`| head`) is no error.
    pub fn result(&self, text: &str) {
        let mut out = io::stdout().lock();
        let end = if text.ends_with('\n') { "" } else { "\n" };
        match write!(out, "{text}{end}").and_then(|()| out.flush()) {
            // No reader is left when the pipe is closed.
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                self.has_lost_output.store(true, Ordering::Relaxed);
                self.say(&format!("graspmill: writing the output: {error}"));
            }
            _ => {}
        }
    }

    /// Whether a result could not be written, such as to a full disk.
    pub fn has_lost_output(&self) -> bool {
        self.has_lost_output.load(Ordering::Relaxed)
    }

    /// A result for machines, to stdout.
    pub fn json(&self, value: &impl Serialize) -> Result<(), Failure> {
        self.result(&serde_json::to_string_pretty(value)?);
        Ok(())
    }

    /// A line of talk, to stderr.
    pub fn say(&self, text: &str) {
        let _ = writeln!(io::stderr().lock(), "{text}");
    }

    /// An error with its causes, to stderr.
    pub fn error(&self, failure: &Failure) {
        let mut text = format!("graspmill: {}", failure.error);
        for cause in failure.error.chain().skip(1).map(ToString::to_string) {
            // Many messages end with their cause already, before the remedy.
            if !text.contains(&cause) {
                text = format!("{text}: {cause}");
            }
        }
        self.say(&text);
    }

    /// Whether a person watches stderr.
    pub fn watched(&self) -> bool {
        io::stderr().is_terminal()
    }
}
