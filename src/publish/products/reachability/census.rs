//! One pass over the labels and distances of a map, for charts and cross-sections.

use format::ReachabilityField;
use kernel::geom::PoseLabel;

/// Poses with each label, in the order of the labels' numbers.
pub type LabelCounts = [u64; 3];

/// Summary of the poses of one position.
#[derive(Clone, Debug, PartialEq)]
pub struct Position {
    /// The best label of the poses of each approach direction; `None` if no pose has it.
    pub approaches: [Option<PoseLabel>; 26],
    /// The smallest signed distance over all orientations.
    pub distance: f64,
}

/// Counts and summaries of the positions of a map.
pub struct Census {
    /// C order over x, y, z.
    pub positions: Vec<Position>,
    /// By cell of z.
    pub heights: Vec<LabelCounts>,
    /// By index in [`approach_directions`](kernel::geom::approach_directions).
    pub directions: [LabelCounts; 26],
}

impl Census {
    /// Counts a field.
    pub fn of(field: &ReachabilityField) -> Self {
        let grid = &field.header.grid;
        let approaches = grid.approaches();
        let height_cells = grid.position_counts()[2];
        let mut census = Self { positions: Vec::new(), heights: vec![[0; 3]; height_cells], directions: [[0; 3]; 26] };
        let blocks = field.labels.chunks(approaches.len()).zip(field.distances.chunks(approaches.len()));
        for (index, (labels, distances)) in blocks.enumerate() {
            let mut position = Position { approaches: [None; 26], distance: f64::INFINITY };
            for ((label, distance), approach) in labels.iter().zip(distances).zip(&approaches) {
                let approach = usize::from(*approach);
                let best = &mut position.approaches[approach];
                *best = Some(best.map_or(*label, |other| other.max(*label)));
                position.distance = position.distance.min(f64::from(*distance));
                census.heights[index % height_cells][*label as usize] += 1;
                census.directions[approach][*label as usize] += 1;
            }
            census.positions.push(position);
        }
        census
    }

    /// Cells of z that divide the reachable poses into equal shares, from below, without repetition.
    pub fn middle_heights(&self, count: usize) -> Vec<usize> {
        let reachable = |counts: &LabelCounts| counts[PoseLabel::Reachable as usize];
        let all: u64 = self.heights.iter().map(reachable).sum();
        let mut heights: Vec<usize> = (0..count)
            .map(|k| {
                let before = (all as f64 * (k as f64 + 0.5) / count as f64) as u64;
                let mut sum = 0;
                let found = self.heights.iter().position(|counts| {
                    sum += reachable(counts);
                    sum > before
                });
                found.unwrap_or(self.heights.len() / 2)
            })
            .collect();
        heights.dedup();
        heights
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn middle_heights_cut_even_shares() {
        let heights = |reachable: &[u64]| Census {
            positions: Vec::new(),
            heights: reachable.iter().map(|count| [9, 1, *count]).collect(),
            directions: [[0; 3]; 26],
        };
        assert_eq!(heights(&[0, 10, 10, 10, 10, 0]).middle_heights(4), [1, 2, 3, 4]);
        assert_eq!(heights(&[0, 1, 100, 1]).middle_heights(3), [2]);
        assert_eq!(heights(&[0, 0, 0]).middle_heights(2), [1]);
    }
}
