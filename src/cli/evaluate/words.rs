//! The comparison as text, and as a page.

use std::fmt::Write as _;

use super::comparison::{Report, Row};
use crate::exit::Failure;
use format::dataset::DatasetReader;
use measure::Interval;
use publish::{EvaluatedMethod, Evaluation, dataset_name};

/// Heads of the table's columns, and the widths of all but the first in text.
const COLUMNS: [(&str, usize); 9] = [
    ("", 0),
    ("IoU", 20),
    ("IoU, unseen", 20),
    ("surface [mm]", 20),
    ("F, 1 %", 6),
    ("mesh IoU", 8),
    ("volume", 6),
    ("bias", 6),
    ("free", 6),
];
/// Additional columns by the thesis's rules.
const THESIS_COLUMNS: [(&str, usize); 2] = [("thesis: mesh IoU", 20), ("thesis: surface [mm]", 20)];

/// Columns of a comparison.
fn columns(report: &Report) -> Vec<(&'static str, usize)> {
    let thesis: &[(&str, usize)] = if report.has_thesis_rules { &THESIS_COLUMNS } else { &[] };
    [&COLUMNS, thesis].concat()
}

/// The row as the table shows it.
fn cells(report: &Report, row: &Row) -> Vec<String> {
    let show = |interval: &Option<Interval>, words: &dyn Fn(&Interval) -> String| {
        interval.as_ref().map_or("-".to_owned(), words)
    };
    let three = |interval| show(interval, &|found| format!("{:.3} [{:.3}, {:.3}]", found.mean, found.low, found.high));
    let two = |interval| show(interval, &|found| format!("{:.2} [{:.2}, {:.2}]", found.mean, found.low, found.high));
    let one = |interval| show(interval, &|found| format!("{:.3}", found.mean));
    let mut cells = vec![
        row.name.clone(),
        three(&row.iou),
        three(&row.unseen_iou),
        two(&row.surface_mm),
        one(&row.f_score_percent),
        one(&row.mesh_iou),
        one(&row.volume_ratio),
        show(&row.bias_mm, &|found| format!("{:+.2}", found.mean)),
        show(&row.free_space_violation, &|found| format!("{:.1} %", 100.0 * found.mean)),
    ];
    if report.has_thesis_rules {
        cells.extend([three(&row.thesis_mesh_iou), two(&row.thesis_surface_mm)]);
    }
    cells
}

/// Samples, objects and split of a comparison.
fn lead(report: &Report) -> String {
    let objects = report.rows.first().and_then(|row| row.iou).map_or(0, |interval| interval.objects);
    format!(
        "{} samples of {objects} objects, split {}; means of objects with 95 % intervals over objects",
        report.samples, report.split
    )
}

/// Lines below the table.
fn notes(report: &Report) -> Vec<String> {
    let mut notes = Vec::new();
    for Row { name, iou_of_solid, iou_of_hollow_or_thin, .. } in &report.rows {
        if let (Some(solid), Some(hollow)) = (iou_of_solid, iou_of_hollow_or_thin) {
            notes.push(format!(
                "{name}: IoU {:.3} [{:.3}, {:.3}] of {} solid objects, {:.3} [{:.3}, {:.3}] of {} hollow or thin ones",
                solid.mean, solid.low, solid.high, solid.objects, hollow.mean, hollow.low, hollow.high, hollow.objects
            ));
        }
    }
    for Row { name, geodesic_divergence, geodesic_floor, .. } in &report.rows {
        if let (Some(found), Some(floor)) = (geodesic_divergence, geodesic_floor) {
            notes.push(format!(
                "{name}: geodesic divergence {:.3} [{:.3}, {:.3}], of the truth from itself {:.3}",
                found.mean, found.low, found.high, floor.mean
            ));
        }
    }
    let claim = |low: f64, high: f64| if low > 0.0 || high < 0.0 { "" } else { ": no difference is shown" };
    for Row { name, surface_over_first_mm, .. } in &report.rows {
        if let Some(Interval { mean, low, high, .. }) = surface_over_first_mm {
            notes.push(format!(
                "{name}: surface minus that of the first --detail {mean:+.2} [{low:+.2}, {high:+.2}] mm, paired by object{}",
                claim(*low, *high)
            ));
        }
    }
    for Row { name, iou_over_baseline, empty, .. } in &report.rows {
        if let Some(Interval { mean, low, high, .. }) = iou_over_baseline {
            notes.push(format!(
                "{name}: IoU minus that of the best baseline {mean:+.3} [{low:+.3}, {high:+.3}], paired by object{}",
                claim(*low, *high)
            ));
        }
        if *empty > 0 {
            notes.push(format!("{name}: nothing was completed in {empty} samples"));
        }
    }
    for Row { name, in_bodies, loose_area, loose_volume, .. } in &report.rows {
        if let (1.., Some(area), Some(volume)) = (in_bodies, loose_area, loose_volume) {
            notes.push(format!(
                "{name}: {in_bodies} of {} meshes have disconnected bodies; {:.1} % of all area and {:.1} % of all volume outside the largest",
                report.samples,
                100.0 * area.mean,
                100.0 * volume.mean
            ));
        }
    }
    if report.surface_samples > 0 {
        notes.push(format!("surfaces: {} points per mesh; truth: {}", report.surface_samples, report.truth));
    }
    if report.has_thesis_rules {
        notes.push(
            "thesis: volumes only in a cube over the true mesh's box, counting surface cells (binvox); distances of vertices, ignoring those beyond half the diagonal of their mesh's box (MeshLab)"
                .to_owned(),
        );
    }
    notes
}

/// The comparison for a terminal.
pub(super) fn text(report: &Report) -> String {
    let mut text = lead(report) + "\n";
    let first = report.rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0).max(10);
    let columns = columns(report);
    let heads = columns.iter().map(|(head, _)| (*head).to_owned()).collect();
    for cells in std::iter::once(heads).chain(report.rows.iter().map(|row| cells(report, row))) {
        let padded = cells.iter().zip(&columns).map(|(cell, (_, width))| {
            let width = if *width == 0 { first } else { *width };
            format!("{cell:width$}")
        });
        _ = writeln!(text, "{}", padded.collect::<Vec<_>>().join("  "));
    }
    text + &notes(report).join("\n")
}

/// The comparison as a page, with samples to show.
pub(super) fn evaluation(
    report: &Report,
    reader: &DatasetReader,
    methods: Vec<EvaluatedMethod>,
) -> Result<Evaluation, Failure> {
    Ok(Evaluation {
        dataset: dataset_name(reader)?,
        root: report.dataset.clone(),
        lead: lead(report),
        head: columns(report).into_iter().map(|(head, _)| head.to_owned()).collect(),
        rows: report.rows.iter().map(|row| cells(report, row)).collect(),
        notes: notes(report),
        methods,
    })
}
