//! Which cells of a view's grid lie inside the solid.

use nalgebra::{Point3, Vector3};

use super::complete::Surface;
use crate::geom::{CameraCv, GridPlacement, Object, Pose, RenderMesh, SolidGrid};

/// Coordinates of the fine cells as a linear function of grid coordinates.
pub(super) struct FineFromGrid {
    base: Point3<f64>,
    steps: [Vector3<f64>; 3],
}

impl FineFromGrid {
    pub(super) fn new(
        solid: &SolidGrid,
        camera_from_object: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
    ) -> Self {
        let object_from_camera = camera_from_object.inverse();
        let corner = object_from_camera.point(&placement.lower_corner());
        let scale = placement.cell_size / solid.pitch;
        let rotation = object_from_camera.rotation().matrix();
        Self {
            base: Point3::from((corner - solid.origin) / solid.pitch),
            steps: std::array::from_fn(|axis| rotation.column(axis) * scale),
        }
    }

    /// Change of fine coordinates from cell to cell along z.
    pub(super) fn step_along_z(&self) -> [f64; 3] {
        self.steps[2].into()
    }

    /// Fine coordinates of a point given in grid coordinates [fine cells].
    pub(super) fn at(&self, grid: [f64; 3]) -> Point3<f64> {
        self.base + self.steps[0] * grid[0] + self.steps[1] * grid[1] + self.steps[2] * grid[2]
    }
}

/// Whether the fine cell that holds a point (in fine coordinates) is solid; nothing outside is.
pub(super) fn holds(solid: &SolidGrid, point: &Point3<f64>) -> bool {
    const SIDE: f64 = SolidGrid::SIDE as f64;
    let inside = |value: f64| (0.0..SIDE).contains(&value);
    inside(point.x)
        && inside(point.y)
        && inside(point.z)
        && solid.get(point.x as usize, point.y as usize, point.z as usize)
}

/// Adds to each row of surface cells the cells inside the solid.
///
/// No surface crosses a run of cells without surface, nor two such cells side by side, so where the mesh is closed one
/// test decides a whole region.
/// Such a cell's centre is at least half a cell from the surface; a fine cell's centre is within 0.87 fine cells of it,
/// so the test is exact from 1.75 fine cells per cell on. Below (a long object seen end-on) crossings along each column
/// decide. Where the mesh has holes, every cell is looked up.
pub(super) fn fill_interior(
    rows: &mut [u128],
    solid: &SolidGrid,
    closed: bool,
    mesh: &RenderMesh,
    surface: &Surface,
    camera_from_object: &Pose<CameraCv, Object>,
    placement: &GridPlacement,
) {
    let n = placement.resolution as usize;
    // Closed mesh, coarse solid: signed crossings along each column.
    if closed && placement.cell_size < 1.75 * solid.pitch {
        let corners = |triangle: usize| mesh.corners.each_ref().map(|corner| surface.corner(corner[triangle]));
        let winding = winding_rows((0..mesh.corners[0].len()).map(corners), n);
        for (row, inside) in rows.iter_mut().zip(winding) {
            *row |= inside;
        }
        return;
    }
    let fine = FineFromGrid::new(solid, camera_from_object, placement);
    let all = u128::MAX >> (128 - n);
    // Closed mesh: one test per region of cells without surface.
    if closed {
        let is_inside = |cell: [usize; 3]| holds(solid, &fine.at(cell.map(|index| index as f64 + 0.5)));
        fill_runs(rows, n, surface.ends_inside(n), is_inside);
        return;
    }
    // Mesh with holes: one lookup per cell.
    for (index, row) in rows.iter_mut().enumerate() {
        let mut rest = !*row & all;
        while rest != 0 {
            let z = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let cell = [index / n, index % n, z].map(|index| index as f64 + 0.5);
            *row |= u128::from(holds(solid, &fine.at(cell))) << z;
        }
    }
}

/// Decides the runs of cells without surface along z: as a neighbour in the row before along y or x with known status,
/// since no surface is between them; else by one test. `ends` are true where the mesh ends inside the grid, so that
/// cells beyond are outside: before x = 0, before y = 0, before z = 0, after the last z.
fn fill_runs(rows: &mut [u128], n: usize, ends: [bool; 4], is_inside: impl Fn([usize; 3]) -> bool) {
    if n <= 64 { fill_short_runs(rows, n, ends, is_inside) } else { fill_long_runs(rows, n, ends, is_inside) }
}

/// [`fill_runs`] over numbers of one width: up to 64 cells fit in half the work.
macro_rules! fill_runs_over {
    ($name:ident, $bits:ident) => {
        fn $name(rows: &mut [u128], n: usize, ends: [bool; 4], is_inside: impl Fn([usize; 3]) -> bool) {
            const BITS: u32 = $bits::BITS;
            let all = $bits::MAX >> (BITS - n as u32);
            let known = |end: bool| if end { all } else { 0 };
            let walls = $bits::from(ends[2]) | $bits::from(ends[3]) << (n - 1);
            // Of the row before along x, by y.
            let (mut inside, mut outside): ([$bits; MAX_SIDE], _) = ([0; MAX_SIDE], [known(ends[0]); MAX_SIDE]);
            for (x, rows) in rows.chunks_exact_mut(n).enumerate() {
                let (mut inside_before, mut outside_before) = (0, known(ends[1]));
                for (y, row) in rows.iter_mut().enumerate() {
                    let open = !(*row as $bits) & all;
                    let known_inside = inside[y] | inside_before;
                    let known_outside = outside[y] | outside_before | walls;
                    let (mut rest, mut filled) = (open, 0);
                    while rest != 0 {
                        let start = rest.trailing_zeros();
                        let length = (!(rest >> start)).trailing_zeros();
                        let run = ($bits::MAX >> (BITS - length)) << start;
                        rest &= !run;
                        if run & known_outside == 0
                            && (run & known_inside != 0 || is_inside([x, y, (start + length / 2) as usize]))
                        {
                            filled |= run;
                        }
                    }
                    *row |= u128::from(filled);
                    (inside[y], inside_before) = (filled, filled);
                    (outside[y], outside_before) = (open & !filled, open & !filled);
                }
            }
        }
    };
}

fill_runs_over!(fill_short_runs, u64);
fill_runs_over!(fill_long_runs, u128);

/// Cells along each axis, at most.
const MAX_SIDE: usize = 128;

/// Rows of cells along z, in C order, whose centre has a winding number other than 0, by signed crossings along each column.
/// Corners of the triangles in grid coordinates; they may be wound either way, all of them the same.
pub(super) fn winding_rows(triangles: impl Iterator<Item = [[f64; 3]; 3]>, n: usize) -> Vec<u128> {
    // Change of the winding number at each cell of each column.
    let mut changes = vec![0_i16; n * n * (n + 1)];
    for corners in triangles {
        // Columns whose centre lies in the triangle's range along an axis.
        let reach = |axis: usize| {
            let [a, b, c] = corners.map(|corner| corner[axis]);
            let first = (a.min(b).min(c) - 0.5).ceil().max(0.0) as usize;
            let last = (a.max(b).max(c) - 0.5).floor().min(n as f64 - 1.0);
            if last < 0.0 { 1..1 } else { first..last as usize + 1 }
        };
        // Twice the signed area of the projection along z. Vertical triangles cross no column.
        let [a, b, c] = corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0.0 {
            continue;
        }
        for x in reach(0) {
            for y in reach(1) {
                // Even-odd test of the column's centre in the projection.
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let crossed = [(&a, &b), (&b, &c), (&c, &a)].into_iter().filter(|(p0, p1)| beyond(p, p0, p1)).count();
                if crossed % 2 == 0 {
                    continue;
                }
                // Barycentric interpolation of the height at the column's centre.
                let share = |q: &[f64; 3], r: &[f64; 3]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
                let z = (share(&b, &c) * a[2] + share(&c, &a) * b[2] + share(&a, &b) * c[2]) / area;
                // First cell whose centre is not below the crossing.
                let cell = (z - 0.5).ceil().clamp(0.0, n as f64) as usize;
                changes[(x * n + y) * (n + 1) + cell] += if area > 0.0 { 1 } else { -1 };
            }
        }
    }
    // Running sum along each column: cells with a winding number other than 0.
    changes
        .chunks_exact(n + 1)
        .map(|changes| {
            let mut winding = 0;
            changes[..n].iter().enumerate().fold(0, |row, (z, change)| {
                winding += change;
                row | u128::from(winding != 0) << z
            })
        })
        .collect()
}

/// Whether the edge crosses the half line from `p` along +x; both triangles at an edge get the same answer.
fn beyond(p: [f64; 2], a: &[f64; 3], b: &[f64; 3]) -> bool {
    let (low, high) = if a[1] <= b[1] { (a, b) } else { (b, a) };
    if !(low[1] <= p[1] && p[1] < high[1]) {
        return false;
    }
    (high[0] - low[0]) * (p[1] - low[1]) > (p[0] - low[0]) * (high[1] - low[1])
}
