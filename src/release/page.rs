//! The page around a report, what reports share, and text inside HTML.

use std::fmt::Display;

use super::{Speed, chart::grouped};

/// `text` with the characters that HTML and SVG give a meaning to spelled out.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            other => out.push(other),
        }
    }
    out
}

/// A whole page that needs nothing outside it; the title is text, the body HTML.
pub(super) fn shell(title: &str, body: &str) -> String {
    format!(
        concat!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n",
            "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n",
            "<meta name=\"color-scheme\" content=\"light dark\">\n",
            "<title>{} · graspmill report</title>\n<style>\n{}</style></head>\n<body><main>\n{}\n</main></body></html>\n"
        ),
        escaped(title),
        include_str!("report.css"),
        body,
    )
}

/// The end of a header's list of numbers, which stands open, and the warnings below it.
pub(super) fn numbers_and_warnings(numbers: &[(impl Display, String)], warnings: &[String]) -> String {
    let number = |(name, value): &(_, String)| format!("<div><dt>{name}</dt><dd>{value}</dd></div>");
    let warning = |warning: &String| format!("<p class=\"alarm\">{}</p>", escaped(warning));
    let numbers: String = numbers.iter().map(number).collect();
    format!("{numbers}</dl>{}", warnings.iter().map(warning).collect::<String>())
}

/// How fast the run was; `what` is what it made.
pub(super) fn speed(speed: Option<&Speed>, what: &str) -> String {
    let text = match speed {
        Some(speed) => format!(
            "{} {what} in {:.1} s on {} threads{}. Part of no digest.",
            grouped(speed.samples),
            speed.seconds,
            speed.threads,
            speed.peak_memory.map_or_else(String::new, |bytes| format!(", peak memory {}", bytes_in_words(bytes))),
        ),
        None => "The run left no figures.".to_owned(),
    };
    format!("<section id=\"speed\"><h2>Speed</h2><p>{text}</p></section>")
}

/// A size for people.
pub(super) fn bytes_in_words(bytes: u64) -> String {
    let value = bytes as f64;
    match bytes {
        0..10_000 => format!("{bytes} B"),
        10_000..1_000_000 => format!("{:.1} kB", value / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", value / 1e6),
        _ => format!("{:.2} GB", value / 1e9),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn no_tag_gets_through() {
        assert_eq!(super::escaped("<b a=\"x\">&'é"), "&lt;b a=&quot;x&quot;&gt;&amp;&#39;é");
    }
}
