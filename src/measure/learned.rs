//! Baselines that remember training pairs: the vote of the nearest, and the mean grid.

use kernel::geom::OccupancyGrid;

/// Training pairs whose vote counts.
const NEIGHBOURS: usize = 10;
/// Side of the blocks in which seen cells are counted [cells].
const BLOCK: u32 = 4;

/// Training pairs, as both baselines want them.
#[derive(Clone, Debug, Default)]
pub struct TrainingPairs {
    resolution: u32,
    features: Vec<Vec<f32>>,
    complete: Vec<OccupancyGrid>,
}

impl TrainingPairs {
    /// Adds a pair.
    ///
    /// # Panics
    /// If its resolution is not that of the pairs before, or no multiple of 4.
    pub fn add(&mut self, partial: &OccupancyGrid, complete: OccupancyGrid) {
        assert!(
            self.complete.is_empty() || self.resolution == complete.resolution(),
            "pairs of one dataset share their resolution"
        );
        self.resolution = complete.resolution();
        self.features.push(pooled(partial));
        self.complete.push(complete);
    }

    /// Count of pairs.
    pub fn len(&self) -> usize {
        self.complete.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.complete.is_empty()
    }

    /// `knn`: cells that more than half of the ten pairs hold whose seen cells, counted in blocks of 4 x 4 x 4, are nearest
    /// to these: distances of the counts' roots, so that no filled block drowns others. Of equally near ones the first counts.
    pub fn nearest_vote(&self, partial: &OccupancyGrid) -> OccupancyGrid {
        let wanted = pooled(partial);
        let square = |feature: &Vec<f32>| feature.iter().zip(&wanted).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
        let mut order: Vec<(f32, usize)> =
            self.features.iter().enumerate().map(|(index, feature)| (square(feature), index)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let voters: Vec<usize> = order.iter().take(NEIGHBOURS).map(|(_, index)| *index).collect();
        let mut found = OccupancyGrid::new(partial.resolution());
        let counts = self.counts(voters.iter().copied());
        let cells = counts.iter().enumerate().filter(|(_, count)| 2 * **count as usize > voters.len());
        cells.for_each(|(cell, _)| found.set(cell_at(cell, partial.resolution())));
        found
    }

    /// `mean`: cells that at least this share of all pairs hold, whatever was seen.
    pub fn mean_grid(&self, share: f64) -> OccupancyGrid {
        let mut found = OccupancyGrid::new(self.resolution);
        let wanted = share * self.len() as f64;
        let counts = self.counts(0..self.len());
        let cells = counts.iter().enumerate().filter(|(_, count)| **count > 0 && f64::from(**count) >= wanted);
        cells.for_each(|(cell, _)| found.set(cell_at(cell, self.resolution)));
        found
    }

    /// Count of these pairs that hold each cell.
    fn counts(&self, pairs: impl Iterator<Item = usize>) -> Vec<u32> {
        let mut counts = vec![0; (self.resolution as usize).pow(3)];
        for pair in pairs {
            for (byte, bits) in self.complete[pair].bytes().iter().enumerate().filter(|(_, bits)| **bits != 0) {
                (0..8).filter(|bit| bits >> bit & 1 == 1).for_each(|bit| counts[8 * byte + bit] += 1);
            }
        }
        counts
    }
}

fn cell_at(index: usize, n: u32) -> [u32; 3] {
    let index = index as u32;
    [index / n / n, index / n % n, index % n]
}

/// Roots of the counts of seen cells in each block.
fn pooled(partial: &OccupancyGrid) -> Vec<f32> {
    let n = partial.resolution();
    assert!(n.is_multiple_of(BLOCK), "blocks fill the grid");
    let blocks = n / BLOCK;
    let mut counts = vec![0_u32; (blocks as usize).pow(3)];
    for [x, y, z] in partial.cells().map(|cell| cell.map(|index| index / BLOCK)) {
        counts[((x * blocks + y) * blocks + z) as usize] += 1;
    }
    counts.into_iter().map(|count| (f64::from(count)).sqrt() as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(cells: &[[u32; 3]]) -> OccupancyGrid {
        let mut grid = OccupancyGrid::new(8);
        cells.iter().for_each(|cell| grid.set(*cell));
        grid
    }

    #[test]
    fn the_nearest_vote_and_the_mean_counts_all() {
        let mut pairs = TrainingPairs::default();
        assert!(pairs.is_empty());
        // Twelve pairs seen at one corner, of which seven hold a cell; three others seen at the opposite one.
        for index in 0..12 {
            let complete = if index < 7 { vec![[0, 0, 0], [5, 5, 5]] } else { vec![[0, 0, 0]] };
            pairs.add(&grid(&[[0, 0, 0]]), grid(&complete));
        }
        (0..3).for_each(|_| pairs.add(&grid(&[[7, 7, 7]]), grid(&[[7, 7, 7]])));
        assert_eq!(pairs.len(), 15);
        // Ten of the twelve vote, the first ones: seven of ten are more than half.
        assert_eq!(pairs.nearest_vote(&grid(&[[1, 1, 1]])), grid(&[[0, 0, 0], [5, 5, 5]]));
        assert_eq!(pairs.mean_grid(0.5), grid(&[[0, 0, 0]]));
        assert_eq!(pairs.mean_grid(7.0 / 15.0), grid(&[[0, 0, 0], [5, 5, 5]]));
        assert_eq!(pairs.mean_grid(0.2), grid(&[[0, 0, 0], [5, 5, 5], [7, 7, 7]]));
    }
}
