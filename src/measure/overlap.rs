//! Overlaps of grids.

use kernel::geom::OccupancyGrid;

/// Agreement of a completed grid with the true one.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct GridOverlap {
    /// Intersection over union of the occupied cells; 1 where both grids are empty.
    pub iou: f64,
    /// Intersection over union of the cells that hold no seen point: what a completion adds.
    pub unseen: f64,
}

impl GridOverlap {
    /// Compares by counts of cells.
    ///
    /// # Panics
    /// If the grids' resolutions differ.
    pub fn new(found: &OccupancyGrid, truth: &OccupancyGrid, partial: &OccupancyGrid) -> Self {
        assert!(
            found.resolution() == truth.resolution() && truth.resolution() == partial.resolution(),
            "grids of one sample share their resolution"
        );
        let (mut both, mut either, mut both_unseen, mut either_unseen) = (0, 0, 0, 0);
        for ((found, truth), partial) in found.bytes().iter().zip(truth.bytes()).zip(partial.bytes()) {
            both += (found & truth).count_ones();
            either += (found | truth).count_ones();
            both_unseen += (found & truth & !partial).count_ones();
            either_unseen += ((found | truth) & !partial).count_ones();
        }
        Self { iou: ratio(both, either), unseen: ratio(both_unseen, either_unseen) }
    }
}

fn ratio(both: u32, either: u32) -> f64 {
    if either == 0 { 1.0 } else { f64::from(both) / f64::from(either) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn grid(cells: &[[u32; 3]]) -> OccupancyGrid {
        let mut grid = OccupancyGrid::new(5);
        cells.iter().for_each(|cell| grid.set(*cell));
        grid
    }

    #[test]
    fn overlaps_of_known_grids() {
        let truth = grid(&[[0, 0, 0], [0, 0, 1], [0, 0, 2], [4, 4, 4]]);
        let partial = grid(&[[0, 0, 0]]);
        assert_eq!(GridOverlap::new(&truth, &truth, &partial), GridOverlap { iou: 1.0, unseen: 1.0 });
        assert_eq!(GridOverlap::new(&partial, &truth, &partial), GridOverlap { iou: 0.25, unseen: 0.0 });
        let found = grid(&[[0, 0, 0], [0, 0, 1], [1, 1, 1]]);
        assert_eq!(GridOverlap::new(&found, &truth, &partial), GridOverlap { iou: 0.4, unseen: 0.25 });
        assert_eq!(GridOverlap::new(&grid(&[]), &grid(&[]), &partial), GridOverlap { iou: 1.0, unseen: 1.0 });
    }

    proptest! {
        #[test]
        fn overlaps_follow_the_definition(cells in prop::collection::vec((prop::array::uniform3(0_u32..5), 0_u32..8), 0..90)) {
            let of = |bit: u32| -> Vec<[u32; 3]> {
                cells.iter().filter(|(_, bits)| bits >> bit & 1 == 1).map(|(cell, _)| *cell).collect()
            };
            let (found, truth, partial) = (grid(&of(0)), grid(&of(1)), grid(&of(2)));
            let overlap = GridOverlap::new(&found, &truth, &partial);
            let count = |test: &dyn Fn([u32; 3]) -> bool| {
                (0..125).filter(|at| test([at / 25, at / 5 % 5, at % 5])).count() as f64
            };
            let share = |both: f64, either: f64| if either == 0.0 { 1.0 } else { both / either };
            let all = share(count(&|c| found.get(c) && truth.get(c)), count(&|c| found.get(c) || truth.get(c)));
            let unseen = share(
                count(&|c| !partial.get(c) && found.get(c) && truth.get(c)),
                count(&|c| !partial.get(c) && (found.get(c) || truth.get(c))),
            );
            prop_assert_eq!((overlap.iou, overlap.unseen), (all, unseen));
            prop_assert_eq!(GridOverlap::new(&truth, &found, &partial), overlap);
        }
    }
}
