//! Three orthogonal cuts through a sample's grids.

use super::{Colour, Picture};
use kernel::geom::OccupancyGrid;

/// Colours of the kinds of cells.
#[derive(Clone, Copy, Debug)]
pub struct SliceColours {
    /// Seen by the camera.
    pub partial: Colour,
    /// Solid, not seen.
    pub complete: Colour,
    /// Seen to be free.
    pub free: Colour,
    /// Neither solid nor seen to be free (or: nothing known, when visibility is not stored).
    pub unseen: Colour,
    /// Seen by the camera but outside the solid: never in `standard` data.
    pub wrong: Colour,
}

/// The colours of every slice.
pub const SLICE_COLOURS: SliceColours = SliceColours {
    partial: Colour::PARTIAL,
    complete: Colour([0xf0, 0xb4, 0x33]),
    free: Colour([0xfb, 0xfb, 0xf8]),
    unseen: Colour([0xc9, 0xca, 0xce]),
    wrong: Colour([0xc2, 0x2e, 0x86]),
};

/// Cuts through one cell, `zoom` pixels per cell, with hair lines between cells and marks at the rim where the other two
/// cuts lie.
#[derive(Clone, Debug, PartialEq)]
pub struct Slices {
    /// Across the line of sight: x to the right, y down.
    pub front: Picture,
    /// From the side: z (away from the camera) to the right, y down.
    pub side: Picture,
    /// From above: x to the right, z (away from the camera) up.
    pub top: Picture,
}

/// The occupied cell coordinates' mean, rounded down to a cell; the grid's middle when it is empty.
pub fn centre_of_mass(grid: &OccupancyGrid) -> [u32; 3] {
    let (mut sum, mut count) = ([0u64; 3], 0u64);
    for cell in grid.cells() {
        count += 1;
        for (total, index) in sum.iter_mut().zip(cell) {
            *total += u64::from(index);
        }
    }
    if count == 0 { [grid.resolution() / 2; 3] } else { sum.map(|total| (total / count) as u32) }
}

impl Slices {
    /// Cuts through cell `at`. `free` holds the cells that the camera sees to be free, where that is stored.
    ///
    /// # Panics
    /// If the grids differ in resolution or `at` lies outside.
    pub fn new(
        partial: &OccupancyGrid,
        complete: &OccupancyGrid,
        free: Option<&OccupancyGrid>,
        at: [u32; 3],
        zoom: u32,
    ) -> Self {
        let n = partial.resolution();
        assert!(complete.resolution() == n && free.is_none_or(|free| free.resolution() == n), "grids of one sample");
        let colour = |cell: [u32; 3]| {
            let colours = &SLICE_COLOURS;
            match (partial.get(cell), complete.get(cell), free.is_some_and(|free| free.get(cell))) {
                (true, true, _) => colours.partial,
                (true, false, _) => colours.wrong,
                (false, true, _) => colours.complete,
                (false, false, true) => colours.free,
                (false, false, false) => colours.unseen,
            }
        };
        Self::of(n, at, zoom, colour)
    }

    /// Cuts as [`Slices::new`] through the grids of a pair in clutter: cells that `others` fill are grey but where the pair's own
    /// grids have them.
    ///
    /// # Panics
    /// If the grids differ in resolution or `at` lies outside.
    pub fn among(
        [partial, complete, others]: [&OccupancyGrid; 3],
        free: Option<&OccupancyGrid>,
        at: [u32; 3],
        zoom: u32,
    ) -> Self {
        let n = partial.resolution();
        let has_size = |grid: &OccupancyGrid| grid.resolution() == n;
        assert!(has_size(complete) && has_size(others) && free.is_none_or(has_size), "grids of one sample");
        let colour = |cell: [u32; 3]| {
            let colours = &SLICE_COLOURS;
            match (partial.get(cell), complete.get(cell), others.get(cell)) {
                (true, true, _) => colours.partial,
                (true, false, _) => colours.wrong,
                (false, true, _) => colours.complete,
                (false, false, true) => Colour::OTHERS,
                (false, false, false) if free.is_some_and(|free| free.get(cell)) => colours.free,
                (false, false, false) => colours.unseen,
            }
        };
        Self::of(n, at, zoom, colour)
    }

    fn of(n: u32, [x, y, z]: [u32; 3], zoom: u32, colour: impl Fn([u32; 3]) -> Colour) -> Self {
        assert!([x, y, z].iter().all(|index| *index < n), "cut outside the grid");
        Self {
            front: cut(n, zoom, [x, y], |column, row| colour([column, row, z])),
            side: cut(n, zoom, [z, y], |column, row| colour([x, row, column])),
            top: cut(n, zoom, [x, n - 1 - z], |column, row| colour([column, y, n - 1 - row])),
        }
    }
}

fn cut(n: u32, zoom: u32, marks: [u32; 2], colour: impl Fn(u32, u32) -> Colour) -> Picture {
    let mut picture = Picture::filled(n * zoom, n * zoom, [0; 4]);
    for row in 0..n {
        for column in 0..n {
            let (left, top) = (column * zoom, row * zoom);
            let Colour(channels) = colour(column, row);
            let [r, g, b] = channels;
            picture.fill(left..left + zoom, top..top + zoom, [r, g, b, 255]);
            if zoom >= 5 {
                let [r, g, b] = channels.map(|channel| (u32::from(channel) * 15 / 16) as u8);
                picture.fill(left..left + zoom, top..top + 1, [r, g, b, 255]);
                picture.fill(left..left + 1, top..top + zoom, [r, g, b, 255]);
            }
        }
    }
    // Marks: one cell long, at the four ends of the lines along which the other two planes cut this one.
    let (size, ink) = (n * zoom, [0x33, 0x33, 0x33, 255]);
    let thin = (zoom / 4).max(1);
    let [across, down] = marks.map(|mark| mark * zoom + zoom / 2 - thin / 2);
    for (start, end) in [(0, zoom), (size - zoom, size)] {
        picture.fill(across..across + thin, start..end, ink);
        picture.fill(start..end, down..down + thin, ink);
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One cell of each kind, each in its place in the three cuts.
    #[test]
    fn each_axis_points_where_it_should() {
        let n = 8;
        let (mut partial, mut complete, mut free) =
            (OccupancyGrid::new(n), OccupancyGrid::new(n), OccupancyGrid::new(n));
        partial.set([2, 5, 1]);
        complete.set([2, 5, 1]);
        complete.set([2, 5, 3]);
        partial.set([6, 5, 3]);
        free.set([2, 1, 3]);
        let slices = Slices::new(&partial, &complete, Some(&free), [2, 5, 3], 4);
        let at = |picture: &Picture, column: u32, row: u32| picture.at(column * 4 + 3, row * 4 + 3);
        let colours = SLICE_COLOURS;
        assert_eq!(at(&slices.front, 2, 5), colours.complete.opaque());
        assert_eq!(at(&slices.front, 6, 5), colours.wrong.opaque());
        assert_eq!(at(&slices.front, 2, 1), colours.free.opaque());
        assert_eq!(at(&slices.front, 4, 4), colours.unseen.opaque());
        assert_eq!(at(&slices.side, 1, 5), colours.partial.opaque());
        assert_eq!(at(&slices.side, 3, 5), colours.complete.opaque());
        assert_eq!(at(&slices.side, 3, 1), colours.free.opaque());
        assert_eq!(at(&slices.top, 2, 7 - 1), colours.partial.opaque());
        assert_eq!(at(&slices.top, 6, 7 - 3), colours.wrong.opaque());
        // What surrounds the solid is grey, but not where the pair's own cells are.
        let mut others = OccupancyGrid::new(n);
        [[2, 5, 3], [6, 5, 3], [2, 1, 3], [4, 4, 3]].into_iter().for_each(|cell| others.set(cell));
        let among = Slices::among([&partial, &complete, &others], Some(&free), [2, 5, 3], 4);
        assert_eq!(at(&among.front, 2, 5), colours.complete.opaque());
        assert_eq!(at(&among.front, 6, 5), colours.wrong.opaque());
        assert_eq!([at(&among.front, 2, 1), at(&among.front, 4, 4)], [Colour::OTHERS.opaque(); 2]);
        assert_eq!(at(&among.side, 1, 5), colours.partial.opaque());
    }

    #[test]
    fn middle_of_mass() {
        let mut grid = OccupancyGrid::new(10);
        assert_eq!(centre_of_mass(&grid), [5; 3]);
        grid.set([0, 4, 9]);
        grid.set([2, 5, 9]);
        assert_eq!(centre_of_mass(&grid), [1, 4, 9]);
    }
}
