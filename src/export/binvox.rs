//! Grids as binvox files.

use crate::geom::{GridPlacement, OccupancyGrid};

/// A grid in binvox's run-length form: x slowest, then z, y fastest; `translate` is the lower corner and `scale` the
/// side of the whole grid, in `CameraCv` [m].
pub(super) fn encoded(grid: &OccupancyGrid, placement: &GridPlacement) -> Vec<u8> {
    let n = grid.resolution();
    let lower = placement.lower_corner();
    let mut bytes = format!(
        "#binvox 1\ndim {n} {n} {n}\ntranslate {} {} {}\nscale {}\ndata\n",
        lower.x,
        lower.y,
        lower.z,
        f64::from(n) * placement.cell_size
    )
    .into_bytes();
    let mut run: Option<(u8, u8)> = None;
    for cell in (0..n * n * n).map(|place| [place / n / n, place % n, place / n % n]) {
        let value = u8::from(grid.get(cell));
        run = match run {
            Some((held, count)) if held == value && count < 255 => Some((held, count + 1)),
            full => {
                bytes.extend(full.map(|(value, count)| [value, count]).into_iter().flatten());
                Some((value, 1))
            }
        };
    }
    bytes.extend(run.map(|(value, count)| [value, count]).into_iter().flatten());
    bytes
}
