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
/// No surface crosses a run of cells without surface, so where the mesh is closed one look at its middle decides it.
/// Such a cell's centre is at least half a cell from the surface; a fine cell's centre is within 0.87 fine cells of it,
/// so the look is exact from 1.75 fine cells a cell on. Below (a long object seen end-on) crossings along each column
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
    if closed && placement.cell_size < 1.75 * solid.pitch {
        let winding = winding_rows(mesh, surface, n);
        for (row, inside) in rows.iter_mut().zip(winding) {
            *row |= inside;
        }
        return;
    }
    let fine = FineFromGrid::new(solid, camera_from_object, placement);
    let all = u128::MAX >> (128 - n);
    for (place, row) in rows.iter_mut().enumerate() {
        let (x, y) = ((place / n) as f64 + 0.5, (place % n) as f64 + 0.5);
        let look = |z: f64| holds(solid, &fine.at([x, y, z]));
        let mut rest = !*row & all;
        while rest != 0 {
            let start = rest.trailing_zeros();
            let length = (!(rest >> start)).trailing_zeros();
            let run = (u128::MAX >> (128 - length)) << start;
            rest &= !run;
            if closed {
                if look(f64::from(start + length / 2) + 0.5) {
                    *row |= run;
                }
            } else {
                for z in start..start + length {
                    *row |= u128::from(look(f64::from(z) + 0.5)) << z;
                }
            }
        }
    }
}

/// Cells whose centre has a winding number other than 0, by signed crossings along each column.
fn winding_rows(mesh: &RenderMesh, surface: &Surface, n: usize) -> Vec<u128> {
    let mut changes = vec![0_i16; n * n * (n + 1)];
    for triangle in 0..mesh.corners[0].len() {
        let corners = mesh.corners.each_ref().map(|corner| surface.corner(corner[triangle]));
        let reach = |axis: usize| {
            let [a, b, c] = corners.map(|corner| corner[axis]);
            let first = (a.min(b).min(c) - 0.5).ceil().max(0.0) as usize;
            let last = (a.max(b).max(c) - 0.5).floor().min(n as f64 - 1.0);
            if last < 0.0 { 1..1 } else { first..last as usize + 1 }
        };
        let [a, b, c] = corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0.0 {
            continue;
        }
        for x in reach(0) {
            for y in reach(1) {
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let crossed = [(&a, &b), (&b, &c), (&c, &a)].into_iter().filter(|(p0, p1)| beyond(p, p0, p1)).count();
                if crossed % 2 == 0 {
                    continue;
                }
                let share = |q: &[f64; 3], r: &[f64; 3]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
                let z = (share(&b, &c) * a[2] + share(&c, &a) * b[2] + share(&a, &b) * c[2]) / area;
                let cell = (z - 0.5).ceil().clamp(0.0, n as f64) as usize;
                changes[(x * n + y) * (n + 1) + cell] += if area > 0.0 { 1 } else { -1 };
            }
        }
    }
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
