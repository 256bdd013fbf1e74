//! The charts of a dataset of completion.

use super::{
    inspection::{CompletionInspection, CompletionObjectFacts},
    survey::CompletionSurvey,
};
use crate::{
    chart::{Bar, Column, Figure, Histogram, Ink, bar_chart, columns, percent, round_step},
    markup::Markup,
    tally::{Spread, Tally},
};

/// Distributions of stored samples.
pub(crate) fn of_stored(survey: &CompletionSurvey) -> Vec<Figure> {
    let facts = &survey.facts;
    let cells = [
        (&survey.partial, &facts.partial_cells, Ink::Partial, "Partial: occupied cells"),
        (&survey.complete, &facts.complete_cells, Ink::Complete, "Complete: occupied cells"),
    ];
    let cells = cells.map(|(tally, spread, ink, title)| Figure {
        svg: cell_histogram(tally, spread, ink, title).svg(),
        caption: title.to_owned(),
    });
    let ratio = ratio_histogram(&survey.ratio, "Partial cells over complete cells", facts.seen_ratio.max);
    let cut_off = percent(facts.cut_off as f64 / facts.kept as f64);
    let mut figures = Vec::from(cells);
    figures
        .push(Figure { svg: ratio.svg(), caption: "Share of the shape's cells that the camera observed".to_owned() });
    figures.push(Figure {
        svg: bar_chart("share of the solid inside the grid", &solid_bars(&survey.solid)),
        caption: format!("Share of the solid inside the grid ({cut_off} of the kept samples have less than 99 %)"),
    });
    figures
}

/// Share of the shape's cells that the camera observed, in each split.
pub(crate) fn of_splits(survey: &CompletionSurvey) -> Vec<Figure> {
    let end = survey.facts.seen_ratio.max;
    let figure = |name: String, tally: &Tally| Figure { svg: ratio_histogram(tally, &name, end).svg(), caption: name };
    let splits = survey.ratio_of_split.iter();
    splits.map(|(split, tally)| figure(split.name().replace('_', " "), tally)).collect()
}

/// Rejects by reason.
pub(crate) fn rejects(facts: &CompletionInspection) -> Markup {
    let bar =
        |(reason, count): (&String, &u64)| Bar { label: reason.replace('_', " "), value: *count, ink: Ink::Reject };
    bar_chart("rejects by reason", &facts.rejected.iter().map(bar).collect::<Vec<_>>())
}

/// Kept and rejected views of each object, fewest kept first.
pub(crate) fn objects(facts: &CompletionInspection) -> Markup {
    let mut objects: Vec<&CompletionObjectFacts> = facts.objects.iter().collect();
    objects.sort_by_key(|object| (object.kept, object.planned));
    let bars: Vec<Column> = objects
        .into_iter()
        .map(|object| Column { name: object.name.clone(), kept: object.kept, rejected: object.planned - object.kept })
        .collect();
    columns("kept views of each object", "objects, fewest kept views first", "views", &bars)
}

fn cell_histogram(tally: &Tally, spread: &Spread, ink: Ink, title: &str) -> Histogram {
    let width = round_step(((spread.max - spread.min) / 40.0).max(1.0));
    let start = (spread.min / width).floor() * width;
    let bins = (((spread.max - start) / width).floor() as usize + 1).min(64);
    Histogram {
        title: title.to_owned(),
        x_label: "occupied cells".to_owned(),
        y_label: "samples".to_owned(),
        start,
        width,
        counts: tally.bins(start, width, bins),
        y_end: None,
        ink,
        mark: Some((spread.median, "median".to_owned())),
    }
}

fn ratio_histogram(tally: &Tally, title: &str, end: f64) -> Histogram {
    let spread = tally.spread();
    let width = round_step((end / 40.0).max(0.001));
    Histogram {
        title: title.to_owned(),
        x_label: "partial cells / complete cells".to_owned(),
        y_label: "samples".to_owned(),
        start: 0.0,
        width,
        counts: tally.bins(0.0, width, (end / width).floor() as usize + 1),
        y_end: None,
        ink: Ink::Neutral,
        mark: Some((spread.median, "median".to_owned())),
    }
}

fn solid_bars(tally: &Tally) -> Vec<Bar> {
    [
        ("all of it", 1.0, 2.0),
        ("99 % to 100 %", 0.99, 1.0),
        ("95 % to 99 %", 0.95, 0.99),
        ("90 % to 95 %", 0.9, 0.95),
        ("75 % to 90 %", 0.75, 0.9),
        ("less than 75 %", 0.0, 0.75),
    ]
    .into_iter()
    .map(|(label, low, high)| Bar {
        label: label.to_owned(),
        value: tally.count_between(low, high),
        ink: if low >= 0.99 { Ink::Neutral } else { Ink::Reject },
    })
    .collect()
}
