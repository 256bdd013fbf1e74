//! Charts as inline SVG: they take text colour and fonts from the page, so they read in light and in dark.

use std::fmt::Write as _;

use serde::Serialize;

use super::{escape::html as escaped, markup::Markup, tally::Spread};

/// A chart with its caption.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Figure {
    /// The chart.
    pub svg: Markup,
    /// Caption below the chart.
    pub caption: String,
}

/// Meaning of a mark in a chart; the page's style gives each a colour-blind safe colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// Partial grids, kept samples.
    Partial,
    /// Complete grids.
    Complete,
    /// Anything else.
    Neutral,
    /// Rejects.
    Reject,
}

impl Ink {
    fn class(self) -> &'static str {
        match self {
            Self::Partial => "ink-partial",
            Self::Complete => "ink-complete",
            Self::Neutral => "ink-neutral",
            Self::Reject => "ink-reject",
        }
    }
}

/// A histogram: counts over bins of equal width.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Text for readers who cannot see the chart.
    pub title: String,
    /// Label of the horizontal axis, with its unit.
    pub x_label: String,
    /// Counted things.
    pub y_label: String,
    /// Lower edge of the first bin.
    pub start: f64,
    /// Width of a bin.
    pub width: f64,
    /// Count in each bin.
    pub counts: Vec<u64>,
    /// Upper end of the vertical axis, for charts to compare; the highest count if `None`.
    pub y_end: Option<u64>,
    /// Colour.
    pub ink: Ink,
    /// A value to mark, with its name, such as the median.
    pub mark: Option<(f64, String)>,
}

/// Width and height of a chart, and its margins [px].
const WIDTH: f64 = 400.0;
const HEIGHT: f64 = 190.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 20.0;
const BOTTOM: f64 = 40.0;

impl Histogram {
    /// The chart as an `<svg>` element.
    pub fn svg(&self) -> Markup {
        let max = self.y_end.unwrap_or_else(|| self.counts.iter().copied().max().unwrap_or(0)).max(1);
        let end = self.start + self.width * self.counts.len() as f64;
        let scale = Scales::new((self.start, end.max(self.start + self.width)), max as f64);
        let mut svg = opening(&self.title, WIDTH, HEIGHT);
        scale.grid(&mut svg, &self.x_label, &self.y_label);
        for (index, count) in self.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            let low = self.start + self.width * index as f64;
            let (left, right) = (scale.x(low), scale.x(low + self.width));
            let top = scale.y(*count as f64).min(scale.y(0.0) - 0.7);
            let gap = if right - left > 3.0 { 1.0 } else { 0.0 };
            let _ = write!(
                svg,
                r#"<rect class="{}" x="{:.1}" y="{top:.1}" width="{:.1}" height="{:.1}"><title>{} to {}: {}</title></rect>"#,
                self.ink.class(),
                left,
                right - left - gap,
                scale.y(0.0) - top,
                short(low),
                short(low + self.width),
                grouped(*count),
            );
        }
        if let Some((value, name)) = &self.mark {
            let x = scale.x(*value);
            let anchor = if x > WIDTH * 0.6 { "end" } else { "start" };
            let shift = if anchor == "end" { -4.0 } else { 4.0 };
            let _ = write!(
                svg,
                r#"<path class="mark" d="M{x:.1} {TOP}V{:.1}"/><text x="{:.1}" y="{:.1}" text-anchor="{anchor}">{} {}</text>"#,
                scale.y(0.0),
                x + shift,
                TOP - 6.0,
                escaped(name),
                short(*value),
            );
        }
        svg.push_str("</svg>");
        Markup(svg)
    }
}

/// One bar of a bar chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// Name of the bar.
    pub label: String,
    /// Length of the bar.
    pub value: u64,
    /// Colour.
    pub ink: Ink,
}

/// Horizontal bars with their names and values.
pub fn bar_chart(title: &str, bars: &[Bar]) -> Markup {
    const ROW: f64 = 24.0;
    const NAMES: f64 = 168.0;
    let height = ROW * bars.len() as f64 + 4.0;
    let max = bars.iter().map(|bar| bar.value).max().unwrap_or(0).max(1) as f64;
    let total = bars.iter().map(|bar| bar.value).sum::<u64>().max(1) as f64;
    let mut svg = opening(title, WIDTH, height);
    for (index, bar) in bars.iter().enumerate() {
        let y = ROW * index as f64 + 3.0;
        let length = (bar.value as f64 / max * (WIDTH - NAMES - 110.0)).max(if bar.value > 0 { 1.0 } else { 0.0 });
        let _ = write!(
            svg,
            concat!(
                r#"<text x="{:.1}" y="{:.1}" text-anchor="end">{}</text>"#,
                r#"<rect class="{}" x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}"/>"#,
                r#"<text class="quiet" x="{:.1}" y="{:.1}">{} ({})</text>"#
            ),
            NAMES - 8.0,
            y + ROW * 0.62,
            escaped(&bar.label),
            bar.ink.class(),
            NAMES,
            y + 2.0,
            length,
            ROW - 8.0,
            NAMES + length + 6.0,
            y + ROW * 0.62,
            grouped(bar.value),
            percent(bar.value as f64 / total),
        );
    }
    svg.push_str("</svg>");
    Markup(svg)
}

/// One row of [`stacked_rows`].
#[derive(Clone, Debug, PartialEq)]
pub struct StackedRow {
    /// Name of the row.
    pub name: String,
    /// Parts from the left: the page's name of a colour, and a count.
    pub parts: Vec<(&'static str, u64)>,
}

/// Horizontal bars with several parts, the count of the first part, and its share of `whole`, the largest possible count of a
/// row. The longest bar fills the width.
pub fn stacked_rows(title: &str, rows: &[StackedRow], whole: u64) -> Markup {
    const ROW: f64 = 18.0;
    const NAMES: f64 = 76.0;
    let sum = |row: &StackedRow| row.parts.iter().map(|(_, count)| count).sum::<u64>();
    let max = rows.iter().map(sum).max().unwrap_or(0).max(1) as f64;
    let mut svg = opening(title, WIDTH, ROW * rows.len() as f64 + 4.0);
    for (index, row) in rows.iter().enumerate() {
        let y = ROW * index as f64 + 2.0;
        let middle = y + ROW * 0.62;
        let _ = write!(
            svg,
            r#"<text x="{:.1}" y="{middle:.1}" text-anchor="end">{}</text>"#,
            NAMES - 8.0,
            escaped(&row.name)
        );
        let mut x = NAMES;
        for (class, count) in &row.parts {
            let width = *count as f64 / max * (WIDTH - NAMES - 110.0);
            let height = ROW - 4.0;
            let _ =
                write!(svg, r#"<rect class="{class}" x="{x:.1}" y="{y:.1}" width="{width:.1}" height="{height}"/>"#);
            x += width;
        }
        let first = row.parts.first().map_or(0, |(_, count)| *count);
        let share = percent(first as f64 / whole.max(1) as f64);
        let _ = write!(
            svg,
            r#"<text class="quiet" x="{:.1}" y="{middle:.1}">{} ({share})</text>"#,
            x + 6.0,
            grouped(first)
        );
    }
    svg.push_str("</svg>");
    Markup(svg)
}

/// One column of [`columns`]: a name, and the counts of kept and rejected items.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name of the column, shown as a tooltip.
    pub name: String,
    /// Lower part.
    pub kept: u64,
    /// Upper part.
    pub rejected: u64,
}

/// Columns side by side, rejected on top of kept, for any number of objects.
pub fn columns(title: &str, x_label: &str, y_label: &str, bars: &[Column]) -> Markup {
    const WIDE: f64 = 820.0;
    let max = bars.iter().map(|bar| bar.kept + bar.rejected).max().unwrap_or(0).max(1);
    let scale =
        Scales { end: (WIDE - RIGHT, HEIGHT - BOTTOM), ..Scales::new((0.0, bars.len().max(1) as f64), max as f64) };
    let mut svg = opening(title, WIDE, HEIGHT);
    scale.horizontal_lines(&mut svg, y_label);
    // A few objects do not become wide blocks.
    let step = (scale.x(1.0) - scale.x(0.0)).min(26.0);
    let width = if step > 3.0 { step - 1.0 } else { step };
    for (index, bar) in bars.iter().enumerate() {
        let (x, base, kept) = (LEFT + step * index as f64, scale.y(0.0), scale.y(bar.kept as f64));
        let top = scale.y((bar.kept + bar.rejected) as f64);
        let _ = write!(
            svg,
            concat!(
                r#"<g><title>{}: {} kept, {} rejected</title>"#,
                r#"<rect class="ink-partial" x="{:.2}" y="{:.1}" width="{:.2}" height="{:.1}"/>"#
            ),
            escaped(&bar.name),
            grouped(bar.kept),
            grouped(bar.rejected),
            x,
            kept,
            width,
            base - kept,
        );
        if bar.rejected > 0 {
            let _ = write!(
                svg,
                r#"<rect class="ink-reject" x="{x:.2}" y="{top:.1}" width="{width:.2}" height="{:.1}"/>"#,
                (kept - top).max(0.6),
            );
        }
        svg.push_str("</g>");
    }
    let _ = write!(
        svg,
        r#"<text class="quiet" x="{:.1}" y="{:.1}" text-anchor="middle">{}</text></svg>"#,
        (LEFT + WIDE - RIGHT) / 2.0,
        HEIGHT - BOTTOM + 18.0,
        escaped(x_label),
    );
    Markup(svg)
}

/// Mapping from data to positions on a chart.
struct Scales {
    x_range: (f64, f64),
    y_max: f64,
    /// Right and lower end of the plot [px].
    end: (f64, f64),
}

impl Scales {
    fn new(x_range: (f64, f64), y_max: f64) -> Self {
        Self { x_range, y_max, end: (WIDTH - RIGHT, HEIGHT - BOTTOM) }
    }

    fn x(&self, value: f64) -> f64 {
        let (low, high) = self.x_range;
        LEFT + (value - low) / (high - low) * (self.end.0 - LEFT)
    }

    fn y(&self, value: f64) -> f64 {
        self.end.1 - value / self.y_max * (self.end.1 - TOP)
    }

    fn grid(&self, svg: &mut String, x_label: &str, y_label: &str) {
        self.horizontal_lines(svg, y_label);
        let (low, high) = self.x_range;
        for tick in ticks(low, high, 6) {
            let x = self.x(tick);
            let _ = write!(
                svg,
                r#"<path class="tick" d="M{x:.1} {:.1}v4"/><text x="{x:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
                self.end.1,
                self.end.1 + 16.0,
                short(tick),
            );
        }
        let _ = write!(
            svg,
            r#"<text class="quiet" x="{:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
            (LEFT + self.end.0) / 2.0,
            self.end.1 + 33.0,
            escaped(x_label),
        );
    }

    fn horizontal_lines(&self, svg: &mut String, y_label: &str) {
        // Counts are whole numbers.
        for tick in ticks(0.0, self.y_max, 4).into_iter().filter(|tick| *tick == tick.trunc()) {
            let y = self.y(tick);
            let _ = write!(
                svg,
                r#"<path class="{}" d="M{LEFT} {y:.1}H{:.1}"/><text x="{:.1}" y="{:.1}" text-anchor="end">{}</text>"#,
                if tick == 0.0 { "axis" } else { "grid" },
                self.end.0,
                LEFT - 6.0,
                y + 4.0,
                short(tick),
            );
        }
        let _ = write!(
            svg,
            r#"<text class="quiet" transform="translate(11 {:.1}) rotate(-90)" text-anchor="middle">{}</text>"#,
            (TOP + self.end.1) / 2.0,
            escaped(y_label),
        );
    }
}

pub(super) fn opening(title: &str, width: f64, height: f64) -> String {
    format!(
        r#"<svg class="chart" viewBox="0 0 {width} {height}" role="img" aria-label="{0}"><title>{0}</title>"#,
        escaped(title)
    )
}

/// The smallest of 1, 2, 5 times a power of ten that is at least `min`.
pub(super) fn round_step(min: f64) -> f64 {
    let mut power = 1e-9;
    while power < 1e15 {
        for factor in [1.0, 2.0, 5.0] {
            if factor * power >= min * (1.0 - 1e-12) {
                return factor * power;
            }
        }
        power *= 10.0;
    }
    min
}

/// Round numbers from `low` to `high`, at most about `count` of them.
fn ticks(low: f64, high: f64, count: usize) -> Vec<f64> {
    let step = round_step((high - low) / count as f64);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|tick| tick as f64 * step).collect()
}

/// A count with thin spaces between thousands, because no country uses them as a decimal sign.
pub(super) fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('\u{2009}');
        }
        text.push(digit);
    }
    text
}

/// A number for a tick: no more digits than needed, thousands as k, millions as M.
pub(super) fn short(value: f64) -> String {
    let magnitude = value.abs();
    let trimmed = |number: f64, digits: usize| {
        let text = format!("{number:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    };
    if magnitude >= 1e6 {
        format!("{}M", trimmed(value / 1e6, 2))
    } else if magnitude >= 1e4 {
        format!("{}k", trimmed(value / 1e3, 1))
    } else if magnitude >= 100.0 {
        trimmed(value, 0)
    } else {
        trimmed(value, 3)
    }
}

/// A share in percent, with enough digits to distinguish "all" and "none" from "almost".
pub(super) fn percent(share: f64) -> String {
    let value = share * 100.0;
    match value {
        _ if share == 0.0 => "0 %".to_owned(),
        _ if share == 1.0 => "100 %".to_owned(),
        _ if value >= 99.95 => "> 99.9 %".to_owned(),
        _ if value < 0.05 => "< 0.1 %".to_owned(),
        _ => format!("{value:.1} %"),
    }
}

/// A histogram of values from the smallest to 1.5 times the range below the 95th percentile.
pub(super) fn value_histogram(
    values: &[f64],
    spread: &Spread,
    title: &str,
    [x_label, y_label]: [&str; 2],
    ink: Ink,
) -> Histogram {
    let end = spread.max.min(spread.p95 + 0.5 * (spread.p95 - spread.min));
    let width = round_step(((end - spread.min) / 40.0).max(1e-6));
    let start = (spread.min / width).floor() * width;
    let bins = (((end - start) / width).floor() as usize + 1).min(64);
    let mut counts = vec![0; bins];
    for value in values {
        if let Some(count) = counts.get_mut(((value - start) / width).max(0.0) as usize) {
            *count += 1;
        }
    }
    Histogram {
        title: title.to_owned(),
        x_label: x_label.to_owned(),
        y_label: y_label.to_owned(),
        start,
        width,
        counts,
        y_end: None,
        ink,
        mark: Some((spread.median, "median".to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(0.0, 1000.0, 4), [0.0, 500.0, 1000.0]);
        assert_eq!(ticks(0.0, 7.0, 4), [0.0, 2.0, 4.0, 6.0]);
        assert_eq!(ticks(130.0, 910.0, 6), [200.0, 400.0, 600.0, 800.0]);
        assert_eq!(ticks(0.0, 1.0, 6).len(), 6);
    }

    #[test]
    fn numbers_for_people() {
        assert_eq!(grouped(441_408), "441\u{2009}408");
        assert_eq!(grouped(999), "999");
        assert_eq!(short(0.25), "0.25");
        assert_eq!(short(12_500.0), "12.5k");
        assert_eq!(short(200.0), "200");
        assert_eq!(short(2_000_000.0), "2M");
        assert_eq!(percent(0.5), "50.0 %");
        assert_eq!(percent(0.999_99), "> 99.9 %");
        assert_eq!(percent(1.0), "100 %");
    }

    #[test]
    fn bars_are_as_long_as_their_counts() {
        let chart = Histogram {
            title: "t".to_owned(),
            x_label: "<x>".to_owned(),
            y_label: "views".to_owned(),
            start: 0.0,
            width: 10.0,
            counts: vec![0, 5, 10],
            y_end: None,
            ink: Ink::Partial,
            mark: None,
        };
        let Markup(svg) = chart.svg();
        let heights: Vec<f64> = svg
            .split("<rect ")
            .skip(1)
            .filter_map(|rect| rect.split("height=\"").nth(1)?.split('"').next()?.parse().ok())
            .collect();
        assert_eq!(heights, [(HEIGHT - BOTTOM - TOP) / 2.0, HEIGHT - BOTTOM - TOP]);
        assert!(svg.contains("&lt;x&gt;") && !svg.contains("<x>"));
    }
}
