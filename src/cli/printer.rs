//! The one printer: results to stdout, messages to stderr, both to the log where there is one. Control characters in them, which
//! come from names of others, are escaped here.

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

/// Longest message of an error [bytes]: what a stranger's file says, such as a list of a million names, is cut.
const LONGEST_ERROR: usize = 1 << 20;

/// Where everything that the program says goes.
#[derive(Default)]
pub struct Printer {
    has_lost_output: AtomicBool,
    log: Option<Log>,
    has_lost_log: AtomicBool,
}

impl Printer {
    /// Writes a log, too, of a command in these words.
    pub fn open_log(&mut self, path: &Path, command: String) -> Result<(), Failure> {
        let failed = |error| {
            let what = format!("--log {}: {error}", path.shown());
            Failure::from(anyhow::Error::new(error).context(what))
        };
        self.log = Some(Log::open(path, command).map_err(failed)?);
        Ok(())
    }

    /// Lines for the log alone.
    pub fn log(&self, level: Level, text: &str) {
        self.log_by(|_| level, text);
    }

    fn log_by(&self, level: impl Fn(&str) -> Level, text: &str) {
        let written = self.log.as_ref().map_or(Ok(()), |log| log.write(level, &shown_lines(text)));
        // A run does not end for its log's sake; once is enough said.
        if let Err(error) = written
            && !self.has_lost_log.swap(true, Ordering::Relaxed)
        {
            self.show(format_args!("graspmill: writing the log: {error}; going on without it"));
        }
    }

    /// A result, to stdout.
    pub fn result(&self, text: &str) {
        self.print(text);
        self.log_by(Level::of_result, text);
    }

    /// A reader that went away (`| head`) is no error.
    fn print(&self, text: &str) {
        let text = shown_lines(text);
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
        self.print(&shown_json(&serde_json::to_string_pretty(value)?));
        self.log(Level::Info, &shown_json(&serde_json::to_string(value)?));
        Ok(())
    }

    /// A message, to stderr.
    pub fn say(&self, text: &str) {
        self.show(text);
        self.log(Level::Info, text);
    }

    /// A line of progress, to stderr: the log has lines of its own.
    pub fn show(&self, text: impl Display) {
        let _ = writeln!(io::stderr().lock(), "{}", shown_lines(&text.to_string()));
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
        let text = cut(text);
        self.show(&text);
        self.log(Level::Error, &text);
    }

    /// Whether a person watches stderr.
    pub fn watched(&self) -> bool {
        io::stderr().is_terminal()
    }
}

/// A text that is not longer than [`LONGEST_ERROR`], and how much was cut.
fn cut(mut text: String) -> String {
    if text.len() > LONGEST_ERROR {
        let kept = text.floor_char_boundary(LONGEST_ERROR);
        let more = text.len() - kept;
        text.truncate(kept);
        text.push_str(&format!(" ... and {more} bytes more"));
    }
    text
}
