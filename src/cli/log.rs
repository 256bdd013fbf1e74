//! Log of a command: its messages and progress as plain lines in a file.

use std::{
    fs::File,
    io::{self, Write},
    path::Path,
    sync::{Mutex, PoisonError},
    time::SystemTime,
};

use chrono::{DateTime, SecondsFormat, Utc};

/// Severity of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Something happened.
    Info,
    /// Something that the user should know.
    Warning,
    /// Something failed, or a check found a fault.
    Error,
}

impl Level {
    /// Level of a line of a result, from its first word: lines about faults begin with a word such as `problem`.
    pub fn of_result(line: &str) -> Self {
        match line.split_once(": ") {
            Some(("warning", _)) => Self::Warning,
            Some(("problem" | "differs", _)) => Self::Error,
            _ => Self::Info,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// An open log. A repeated command appends to the same file.
pub struct Log {
    state: Mutex<State>,
}

struct State {
    file: File,
    /// The first line, written together with the next one, so that a program that restarts itself writes it once.
    first: Option<String>,
}

impl Log {
    /// Opens or creates the log of a command. `command` is the command line.
    ///
    /// # Errors
    /// When the path is not a regular file, or the file cannot be written.
    pub fn open(path: &Path, command: String) -> io::Result<Self> {
        let file = kernel::files::open_log(path)?;
        Ok(Self { state: Mutex::new(State { file, first: Some(command) }) })
    }

    /// Adds the lines of a text.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, level: impl Fn(&str) -> Level, text: &str) -> io::Result<()> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let time = DateTime::<Utc>::from(SystemTime::now()).to_rfc3339_opts(SecondsFormat::Millis, true);
        let written = |level: Level, line: &str| format!("{time} {:7} {line}\n", level.name());
        let mut lines = state.first.take().map_or_else(String::new, |first| written(Level::Info, &first));
        lines.extend(text.lines().filter(|line| !line.is_empty()).map(|line| written(level(line), line)));
        // One call for all lines, so that lines of two tasks that write to the same file do not mix.
        state.file.write_all(lines.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn lines_have_a_time_and_a_level_and_a_log_grows() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.log");
        for _ in 0..2 {
            let log = Log::open(&path, "a command".to_owned()).expect("a log");
            log.write(Level::of_result, "two\n\nproblem: lines").expect("room");
            log.write(|_| Level::Warning, "one").expect("room");
        }
        let text = fs::read_to_string(&path).expect("text");
        let mut lines = Vec::new();
        for line in text.lines() {
            let (time, rest) = line.split_once(' ').expect("a time");
            assert!(DateTime::parse_from_rfc3339(time).is_ok() && time.ends_with('Z'), "{line}");
            lines.push(rest);
        }
        let written = ["info    a command", "info    two", "error   problem: lines", "warning one"];
        assert_eq!(lines, [written, written].concat());
        assert!(Log::open(folder.path(), String::new()).is_err(), "a folder is no log");
    }
}
