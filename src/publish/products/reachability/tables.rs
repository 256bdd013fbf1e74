//! Counts of a map by label, proof, height and direction, for the page's template.

use serde::Serialize;

use super::inspection::ReachabilityFacts;
use super::{
    census::{Census, LabelCounts},
    labels::{ORDER, in_words},
    section::class,
};
use crate::{
    chart::{Bar, Ink, StackedRow, bar_chart, grouped, percent, stacked_rows},
    markup::Markup,
};
use format::ReachabilityField;
use kernel::geom::{PoseLabel, Proof, approach_directions};

/// Charts of counts.
#[derive(Serialize)]
pub(crate) struct CountsView {
    labels: Markup,
    proofs: Markup,
    heights: Markup,
}

impl CountsView {
    pub fn of(facts: &ReachabilityFacts, field: &ReachabilityField, census: &Census) -> Self {
        let labels = ORDER.map(|label| {
            let count = facts.labels.get(label.name()).copied().unwrap_or(0);
            StackedRow { name: in_words(label).to_owned(), parts: vec![(class(label), count)] }
        });
        let proofs: Vec<Bar> = (Proof::ALL.iter())
            .map(|proof| Bar {
                label: proof_in_words(*proof).to_owned(),
                value: facts.proofs.get(proof.name()).copied().unwrap_or(0),
                ink: if *proof == Proof::Searched { Ink::Reject } else { Ink::Neutral },
            })
            .collect();
        let axis = &field.header.grid.position_axes()[2];
        let heights: Vec<StackedRow> = (census.heights.iter().enumerate().rev())
            .map(|(cell, counts)| StackedRow {
                name: format!("{:.2} m", axis.centre(cell) + 0.0),
                parts: ORDER[..2].iter().map(|label| (class(*label), counts[*label as usize])).collect(),
            })
            .collect();
        let per_height = (facts.poses / axis.count.max(1) as u64).max(1);
        Self {
            labels: stacked_rows("poses by label", &labels, facts.poses),
            proofs: bar_chart("poses by proof", &proofs),
            heights: stacked_rows("poses by height", &heights, per_height),
        }
    }
}

fn proof_in_words(proof: Proof) -> &'static str {
    match proof {
        Proof::Bound => "a bound",
        Proof::IntervalEnds => "ends of all intervals",
        Proof::Swept => "certificate over a sweep",
        Proof::Searched => "searched only",
        Proof::Witness => "joint values (witness)",
    }
}

/// A map of the sphere, and all numbers.
#[derive(Serialize)]
pub(crate) struct DirectionsView {
    up: SphereCell,
    /// Rings of eight directions, from above.
    rings: [SphereRing; 3],
    down: SphereCell,
    /// Direction, reachable, colliding, no solution and share.
    rows: Vec<[String; 5]>,
}

/// Directions of one elevation.
#[derive(Serialize)]
struct SphereRing {
    name: &'static str,
    cells: Vec<SphereCell>,
}

/// One direction.
#[derive(Serialize)]
struct SphereCell {
    share: String,
    /// Strength of the cell's colour [%]; `None` without poses.
    strength: Option<String>,
}

impl DirectionsView {
    pub fn of(census: &Census) -> Self {
        let largest = census.directions.iter().filter_map(reachable_share).fold(0.0, f64::max);
        let cell = |index: usize| SphereCell::of(&census.directions[index], largest);
        let ring = |(ring, name): (usize, &'static str)| SphereRing {
            name,
            cells: (0..8).map(|azimuth| cell(1 + 8 * ring + azimuth)).collect(),
        };
        let rows = approach_directions().into_iter().zip(&census.directions).map(|(direction, counts)| {
            let vector = [direction.x, direction.y, direction.z].map(|part| format!("{:.2}", part + 0.0)).join(", ");
            let [reachable, colliding, no_solution] = ORDER.map(|label| grouped(counts[label as usize]));
            let share = reachable_share(counts).map_or_else(|| "-".to_owned(), percent);
            [vector.replace("-0.00", "0.00"), reachable, colliding, no_solution, share]
        });
        Self {
            up: cell(25),
            rings: [(2, "45° up"), (1, "level"), (0, "45° down")].map(ring),
            down: cell(0),
            rows: rows.collect(),
        }
    }
}

impl SphereCell {
    /// The cell of a direction; `largest` is the largest share of all directions.
    fn of(counts: &LabelCounts, largest: f64) -> Self {
        match reachable_share(counts) {
            None => Self { share: "-".to_owned(), strength: None },
            Some(share) => {
                let strength = if largest > 0.0 { share / largest * 75.0 } else { 0.0 };
                Self { share: percent(share), strength: Some(format!("{strength:.0}")) }
            }
        }
    }
}

/// Share of the poses that are reachable; `None` without poses.
fn reachable_share(counts: &LabelCounts) -> Option<f64> {
    let all: u64 = counts.iter().sum();
    (all > 0).then(|| counts[PoseLabel::Reachable as usize] as f64 / all as f64)
}
