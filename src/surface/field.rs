//! Cubes of numbers.

use kernel::geom::OccupancyGrid;

/// One number per cell of a cubic grid.
///
/// Shape (side, side, side) indexed (x, y, z), C order; the centre of cell (x, y, z) lies at (x, y, z) + 0.5.
#[derive(Clone, Debug, PartialEq)]
pub struct CubeField {
    side: usize,
    values: Vec<f32>,
}

impl CubeField {
    /// A field that is the same everywhere.
    pub fn filled(side: usize, value: f32) -> Self {
        Self { side, values: vec![value; side.pow(3)] }
    }

    /// From values in C order; `None` when their count does not fit the side.
    pub fn from_values(side: usize, values: Vec<f32>) -> Option<Self> {
        (values.len() == side.pow(3)).then_some(Self { side, values })
    }

    /// 1 where a cell is occupied, 0 elsewhere.
    pub fn from_grid(grid: &OccupancyGrid) -> Self {
        let mut field = Self::filled(grid.resolution() as usize, 0.0);
        grid.cells().for_each(|cell| *field.at_mut(cell.map(|index| index as usize)) = 1.0);
        field
    }

    /// Cells whose number is above a threshold.
    pub fn grid_above(&self, threshold: f32) -> OccupancyGrid {
        let mut grid = OccupancyGrid::new(self.side as u32);
        let cells = self.cells().zip(&self.values).filter(|(_, value)| **value > threshold);
        cells.for_each(|(cell, _)| grid.set(cell.map(|index| index as u32)));
        grid
    }

    /// Cells along each axis.
    pub fn side(&self) -> usize {
        self.side
    }

    /// The numbers in C order.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The number of a cell.
    pub fn at(&self, [x, y, z]: [usize; 3]) -> f32 {
        self.values[(x * self.side + y) * self.side + z]
    }

    /// The number of a cell, to be changed.
    pub fn at_mut(&mut self, [x, y, z]: [usize; 3]) -> &mut f32 {
        &mut self.values[(x * self.side + y) * self.side + z]
    }

    /// All cells in C order.
    pub fn cells(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        let side = self.side;
        (0..side.pow(3)).map(move |index| [index / side / side, index / side % side, index % side])
    }

    /// The largest value of each cell's block of 3 x 3 x 3 cells; a block ends at the grid's border.
    pub fn block_maximum(&self) -> Self {
        let (n, mut values) = (self.side, self.values.clone());
        for stride in [1, n, n * n] {
            let before = values.clone();
            for (index, value) in values.iter_mut().enumerate() {
                let along = index / stride % n;
                if along > 0 {
                    *value = value.max(before[index - stride]);
                }
                if along + 1 < n {
                    *value = value.max(before[index + stride]);
                }
            }
        }
        Self { side: n, values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_reaches_one_cell_in_each_direction() {
        let mut field = CubeField::filled(5, -1.0);
        *field.at_mut([0, 2, 4]) = 3.0;
        let blocks = field.block_maximum();
        for [x, y, z] in field.cells() {
            let near = x <= 1 && y.abs_diff(2) <= 1 && z >= 3;
            assert_eq!(blocks.at([x, y, z]), if near { 3.0 } else { -1.0 }, "{x} {y} {z}");
        }
    }
}
