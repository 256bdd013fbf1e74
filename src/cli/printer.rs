//! The only printer: writes results to stdout, messages to stderr, and both to the log if there is one. It escapes control
//! characters, which come from foreign names.

use std::{
    fmt::Display,
    io::{self, IsTerminal, Write},
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
};

use serde::Serialize;

use super::{
    exit::Failure,
    log::{Level, Log},
};
use kernel::words::{Show, shown_json, shown_lines};

/// Longest error message [bytes]. Longer ones, such as a foreign file's list of a million names, are cut.
const LONGEST_ERROR: usize = 1 << 20;

/// Destination of all output of the program.
#[derive(Default)]
pub struct Printer {
    has_lost_output: AtomicBool,
    log: Option<Log>,
    has_lost_log: AtomicBool,
}

impl Printer {
    /// Also writes a log of this command.
    pub fn open_log(&mut self, path: &Path, command: String) -> Result<(), Failure> {
        let failed = |error| {
            let what = format!("--log {}: {error}", path.shown());
            Failure::from(anyhow::Error::new(error).context(what))
        };
        self.log = Some(Log::open(path, command).map_err(failed)?);
        Ok(())
    }

    /// Writes lines only to the log.
    pub fn log(&self, level: Level, text: &str) {
        self.log_by(|_| level, text);
    }

    fn log_by(&self, level: impl Fn(&str) -> Level, text: &str) {
        let written = self.log.as_ref().map_or(Ok(()), |log| log.write(level, &shown_lines(text)));
        // A failing log does not end the run, and is reported once.
        if let Err(error) = written
            && !self.has_lost_log.swap(true, Ordering::Relaxed)
        {
            self.show(format_args!("graspmill: cannot write the log: {error}; continuing without it"));
        }
    }

    /// Prints a result to stdout.
    pub fn result(&self, text: &str) {
        self.print(text);
        self.log_by(Level::of_result, text);
    }

    /// A closed pipe (`| head`) is not an error.
    fn print(&self, text: &str) {
        let text = shown_lines(text);
        let mut out = io::stdout().lock();
        let end = if text.ends_with('\n') { "" } else { "\n" };
        match write!(out, "{text}{end}").and_then(|()| out.flush()) {
            // The reader of the pipe has closed it.
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                self.has_lost_output.store(true, Ordering::Relaxed);
                self.say(&format!("graspmill: cannot write the output: {error}"));
            }
            _ => {}
        }
    }

    /// Whether a result could not be written, such as to a full disk.
    pub fn has_lost_output(&self) -> bool {
        self.has_lost_output.load(Ordering::Relaxed)
    }

    /// Prints a result as JSON to stdout.
    pub fn json(&self, value: &impl Serialize) -> Result<(), Failure> {
        self.print(&shown_json(&serde_json::to_string_pretty(value)?));
        self.log(Level::Info, &shown_json(&serde_json::to_string(value)?));
        Ok(())
    }

    /// Prints a message to stderr.
    pub fn say(&self, text: &str) {
        self.show(text);
        self.log(Level::Info, text);
    }

    /// Prints a line of progress to stderr; the log has separate lines.
    pub fn show(&self, text: impl Display) {
        let _ = writeln!(io::stderr().lock(), "{}", shown_lines(&text.to_string()));
    }

    /// Prints an error with its causes to stderr.
    pub fn error(&self, failure: &Failure) {
        let text = format!("graspmill: {}", failure.text());
        let text = cut(text);
        self.show(&text);
        self.log(Level::Error, &text);
    }

    /// Whether a person watches stderr.
    pub fn watched(&self) -> bool {
        io::stderr().is_terminal()
    }
}

/// Cuts a text to [`LONGEST_ERROR`] and states how much was cut.
fn cut(mut text: String) -> String {
    if text.len() > LONGEST_ERROR {
        let kept = text.floor_char_boundary(LONGEST_ERROR);
        let more = text.len() - kept;
        text.truncate(kept);
        text.push_str(&format!(" ... and {more} more bytes"));
    }
    text
}
