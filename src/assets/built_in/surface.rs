//! Surfaces of rows of vertices.

/// A surface under construction [m].
#[derive(Debug, Default)]
pub(super) struct Surface {
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) faces: Vec<[u32; 3]>,
}

/// One row of a surface of rows: a closed ring of vertices, or a single one at an end.
pub(super) type Row = std::ops::Range<u32>;

impl Surface {
    /// Adds a row of vertices.
    pub(super) fn row(&mut self, positions: impl IntoIterator<Item = [f64; 3]>) -> Row {
        let start = self.positions.len() as u32;
        self.positions.extend(positions);
        start..self.positions.len() as u32
    }

    /// Joins two rows of the same length, or a row and a single vertex. Seen with the outside towards the eye and the ring
    /// running to the right, `above` lies above `below`. Vertices that the two rows share make no face.
    pub(super) fn join(&mut self, below: &[u32], above: &[u32]) {
        self.join_where(below, above, |_| true);
    }

    /// Joins two rows where `wanted` is true for the cell that starts at a column.
    pub(super) fn join_where(&mut self, below: &[u32], above: &[u32], wanted: impl Fn(usize) -> bool) {
        let count = below.len().max(above.len());
        let pick = |row: &[u32], i: usize| if row.len() == 1 { row[0] } else { row[i % count] };
        for i in (0..count).filter(|&i| wanted(i)) {
            let [a, b] = [pick(below, i), pick(below, i + 1)];
            let [c, d] = [pick(above, i + 1), pick(above, i)];
            // Alternating diagonals leave no spiral.
            let faces = if i % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            let has_area = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
            self.faces.extend(faces.into_iter().filter(has_area));
        }
    }
}

#[cfg(test)]
impl Surface {
    /// Enclosed volume [m^3].
    pub(super) fn volume(&self) -> f64 {
        let corner = |vertex: u32| nalgebra::Vector3::from(self.positions[vertex as usize]);
        let part = |face: &[u32; 3]| {
            let [a, b, c] = face.map(corner);
            a.dot(&b.cross(&c)) / 6.0
        };
        self.faces.iter().map(part).sum()
    }
}
