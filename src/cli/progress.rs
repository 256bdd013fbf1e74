//! Shows a run's events: a bar on a terminal, plain lines elsewhere, JSON lines on request.

use std::{
    sync::{
        Mutex, OnceLock,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};

use super::{
    args::ProgressMode,
    exit::{Exit, Failure},
    log::Level,
    printer::Printer,
};
use assets::effort_words;
use factory::{Event, Progress};
use format::Product;
use kernel::words::{counted, shown_json};

/// Time between two plain or JSON lines.
const PAUSE: Duration = Duration::from_secs(2);
/// Time between two lines of progress in a log, which may be of days.
const LOG_PAUSE: Duration = Duration::from_secs(10);

/// Progress display of one run.
pub struct ProgressView {
    display: Display,
    pace: Pace,
    log_pace: Pace,
    /// Product of the samples, known once the plan is made.
    product: OnceLock<Product>,
    /// Samples made, in finished and unfinished shards.
    made: AtomicU64,
    /// Samples in finished shards.
    safe: AtomicU64,
}

enum Display {
    Bar(ProgressBar),
    Plain,
    Json,
    Silent,
}

impl ProgressView {
    /// Creates a display in this mode.
    pub fn new(mode: ProgressMode, printer: &Printer) -> Self {
        let display = match mode {
            ProgressMode::Auto if printer.watched() => Display::Bar(ProgressBar::no_length()),
            ProgressMode::Auto | ProgressMode::Plain => Display::Plain,
            ProgressMode::Json => Display::Json,
            ProgressMode::None => Display::Silent,
        };
        Self {
            display,
            pace: Pace::new(PAUSE),
            log_pace: Pace::new(LOG_PAUSE),
            product: OnceLock::new(),
            made: AtomicU64::new(0),
            safe: AtomicU64::new(0),
        }
    }

    /// Prints the name of one of several runs.
    pub fn name(&self, printer: &Printer, name: &str) {
        match &self.display {
            Display::Bar(_) | Display::Plain => printer.show(name),
            Display::Json => {
                printer.show(shown_json(&serde_json::json!({ "event": "dataset", "name": name }).to_string()))
            }
            Display::Silent => {}
        }
        printer.log(Level::Info, &format!("dataset {name}"));
    }

    /// Shows one event.
    pub fn show(&self, printer: &Printer, event: &Event) {
        match event {
            Event::Planned { product, .. } => drop(self.product.set(*product)),
            Event::Progress(progress) => self.made.store(progress.made, Ordering::Relaxed),
            Event::ShardFinished { samples, .. } => drop(self.safe.fetch_add(*samples, Ordering::Relaxed)),
            Event::Prepared { .. } | Event::CostlyMesh { .. } | Event::Finishing => {}
        }
        let product = self.product.get().copied();
        match &self.display {
            Display::Silent => {}
            Display::Json => {
                if self.pace.is_due(event)
                    && let Ok(line) = serde_json::to_string(event)
                {
                    printer.show(shown_json(&line));
                }
            }
            Display::Plain => {
                if !matches!(event, Event::ShardFinished { .. }) && self.pace.is_due(event) {
                    printer.show(plain_line(event, product));
                }
            }
            Display::Bar(bar) => show_bar(bar, event, product),
        }
        if self.log_pace.is_due(event) {
            printer.log(Level::Info, &plain_line(event, product));
        }
    }

    /// Clears the bar, so that further output starts on a new line. After an interruption, reports which samples are kept: a
    /// shard is kept as a whole or not at all.
    pub fn finish<T>(&self, printer: &Printer, outcome: &Result<T, Failure>) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
        let is_interrupted = outcome.as_ref().is_err_and(|failure| failure.exit == Exit::Interrupted);
        if is_interrupted && let Some(product) = self.product.get() {
            let (made, safe) = (self.made.load(Ordering::Relaxed), self.safe.load(Ordering::Relaxed));
            printer.say(&kept_words(made, safe, *product));
        }
    }
}

/// Time of the next line of progress.
struct Pace {
    pause: Duration,
    last: Mutex<Option<Instant>>,
}

impl Pace {
    fn new(pause: Duration) -> Self {
        Self { pause, last: Mutex::new(None) }
    }

    /// Returns true for rare events, and for frequent ones after a pause and at their end.
    fn is_due(&self, event: &Event) -> bool {
        let is_last = match event {
            Event::Prepared { done, total } => done == total,
            Event::Progress(progress) => progress.made == progress.to_make,
            _ => return true,
        };
        let Ok(mut last) = self.last.lock() else { return false };
        let is_due = is_last || last.is_none_or(|at| at.elapsed() >= self.pause);
        if is_due {
            *last = Some(Instant::now());
        }
        is_due
    }
}

/// Text about the samples that an interrupted run keeps: those of finished shards.
fn kept_words(made: u64, safe: u64, product: Product) -> String {
    let lost = made.saturating_sub(safe);
    let counted = |count: u64| format!("{count} {}", product.samples.for_count(count));
    match lost {
        0 => format!("kept: {}", counted(safe)),
        _ => format!("kept: {}; lost: {} of unfinished shards", counted(safe), counted(lost)),
    }
}

fn plain_line(event: &Event, product: Option<Product>) -> String {
    let samples = plural(product);
    match event {
        Event::Prepared { done, total } => format!("meshes {done}/{total}"),
        Event::CostlyMesh { mesh, times } => format!("warning: {mesh}: {}", effort_words(*times)),
        Event::Planned { product: _, samples: count, samples_before, shards, shards_before, threads } => {
            let before = if *shards_before > 0 {
                format!(", {samples_before} of them in {} finished before", counted(*shards_before, "shard"))
            } else {
                String::new()
            };
            let (shards, threads) = (counted(*shards, "shard"), counted(*threads as u64, "thread"));
            format!("{count} {samples} in {shards}{before}; {threads}")
        }
        Event::Progress(progress) => progress_text(progress, product),
        Event::ShardFinished { file, samples: count, .. } => format!("finished {file}: {count} {samples}"),
        Event::Finishing => "writing index and manifest".to_owned(),
    }
}

fn progress_text(progress: &Progress, product: Option<Product>) -> String {
    let samples = plural(product);
    let rejected = match progress.rejected {
        0 => String::new(),
        rejected => format!("{rejected} rejected, "),
    };
    let share = 100.0 * progress.made as f64 / progress.to_make.max(1) as f64;
    let left = progress.time_left().map_or_else(String::new, |left| format!(", {} left", duration_text(left)));
    format!(
        "{}/{} {samples} ({share:.0} %), {rejected}{} {samples}/s{left}",
        progress.made,
        progress.to_make,
        rate_text(progress.rate())
    )
}

/// A rate with at least two digits: `1250`, `12`, `0.85`.
pub fn rate_text(rate: f64) -> String {
    if rate < 10.0 { format!("{rate:.2}") } else { format!("{rate:.0}") }
}

/// `1 h 02 min`, `3 min 05 s` or `12 s`.
pub fn duration_text(duration: Duration) -> String {
    let seconds = duration.as_secs_f64().ceil() as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s:02} s"),
        (h, m, _) => format!("{h} h {m:02} min"),
    }
}

/// Plural noun of the product's samples; `samples` before the plan is made.
fn plural(product: Option<Product>) -> &'static str {
    product.map_or("samples", |product| product.samples.many)
}

fn show_bar(bar: &ProgressBar, event: &Event, product: Option<Product>) {
    let samples = plural(product);
    let style =
        |template: &str| ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    match event {
        Event::Prepared { done, total } => {
            bar.set_style(style("meshes   {wide_bar} {pos}/{len}"));
            bar.set_length(*total);
            bar.set_position(*done);
        }
        Event::CostlyMesh { .. } => bar.println(plain_line(event, product)),
        Event::Planned { samples: count, samples_before, .. } => {
            bar.set_style(style(&format!("{samples:<9}{{wide_bar}}  {{msg}}")));
            bar.set_length(count - samples_before);
            bar.set_position(0);
        }
        Event::Progress(progress) => {
            bar.set_position(progress.made);
            bar.set_message(progress_text(progress, product));
        }
        Event::ShardFinished { .. } => {}
        Event::Finishing => bar.set_message("writing index and manifest"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interrupted_run_says_what_it_keeps() {
        let product = Product::all().next().expect("a product");
        assert_eq!(kept_words(8, 8, product), format!("kept: 8 {}", product.samples.many));
        let (one, many) = (product.samples.one, product.samples.many);
        let said = format!("kept: 1 {one}; lost: 7 {many} of unfinished shards");
        assert_eq!(kept_words(8, 1, product), said);
    }

    #[test]
    fn durations_read_as_people_say_them() {
        assert_eq!(duration_text(Duration::from_millis(11_200)), "12 s");
        assert_eq!(duration_text(Duration::from_secs(185)), "3 min 05 s");
        assert_eq!(duration_text(Duration::from_secs(3725)), "1 h 02 min");
    }
}
