//! Counts of free approaches to grasps.

use serde::{Deserialize, Serialize};

use crate::chart::percent;
use format::Grasp;
use kernel::words::{FreeWays, GraspVerdict};

/// Closed grasps by the approaches on which nothing blocks the hand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WayFacts {
    /// Closed grasps by the approaches that the object does not block, in the order of [`FreeWays::ALL`].
    pub in_the_air: [u64; FreeWays::ALL.len()],
    /// Closed grasps of objects that rest on a table, by the approaches that neither the object nor the table of its most likely
    /// pose blocks.
    pub on_a_table: [u64; FreeWays::ALL.len()],
}

impl WayFacts {
    /// Counts a grasp.
    pub(super) fn add(&mut self, grasp: &Grasp) {
        if grasp.verdict == GraspVerdict::Penetrates {
            return;
        }
        self.in_the_air[grasp.free_ways(None) as usize] += 1;
        if !grasp.clearances.is_empty() {
            self.on_a_table[grasp.free_ways(Some(0)) as usize] += 1;
        }
    }

    /// Name, count and share of each choice of approaches: in the air, and on a table.
    pub(super) fn rows(&self) -> Vec<WayRow> {
        let row = |ways: &FreeWays| {
            let cells = |counts: &[u64]| {
                let count = counts[*ways as usize];
                (count, percent(count as f64 / counts.iter().sum::<u64>().max(1) as f64))
            };
            WayRow { name: ways.name(), in_the_air: cells(&self.in_the_air), on_a_table: cells(&self.on_a_table) }
        };
        FreeWays::ALL.iter().rev().map(row).collect()
    }

    /// Two lines.
    pub fn in_words(&self) -> [String; 2] {
        let rows = self.rows();
        let line = |place: &str, cells: fn(&WayRow) -> &(u64, String)| {
            let shares: Vec<String> = rows.iter().map(|row| format!("{} {}", row.name, cells(row).1)).collect();
            format!("free approaches {place}: {}", shares.join(", "))
        };
        [
            line("with the object", |row| &row.in_the_air),
            line("with object and table, in the most likely pose", |row| &row.on_a_table),
        ]
    }
}

/// Grasps with the same free approaches.
pub(super) struct WayRow {
    /// Name of the approaches.
    pub name: &'static str,
    /// Count and share with the object as the only obstacle.
    pub in_the_air: (u64, String),
    /// Count and share with the table of the most likely pose as a further obstacle.
    pub on_a_table: (u64, String),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_all_closed_grasps() {
        let facts = WayFacts { in_the_air: [1, 0, 1, 6], on_a_table: [5, 0, 2, 1] };
        let [in_the_air, on_a_table] = facts.in_words();
        assert_eq!(in_the_air, "free approaches with the object: both 75.0 %, posture 12.5 %, opened 0 %, none 12.5 %");
        assert!(on_a_table.ends_with("both 12.5 %, posture 25.0 %, opened 0 %, none 62.5 %"), "{on_a_table}");
    }
}
