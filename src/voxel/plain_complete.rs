//! The solid object on a sample's grid.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::geom::{CameraCv, GridPlacement, Object, OccupancyGrid, Pose, SolidGrid};

/// How far a cell's box reaches beyond itself when it is tested against the surface: single precision places a vertex
/// and a depth point within this of the truth [m], so that a point seen by the camera never falls into a cell that
/// the surface was found not to meet.
const REACH: f32 = 1e-6;
/// The same for grid coordinates, whose own rounding does not shrink with the cell [cells].
const REACH_CELLS: f32 = 2e-5;

/// One thread's memory for complete grids.
#[derive(Default)]
pub struct PlainComplete {
    /// Vertices in grid coordinates [cells].
    vertices: Vec<[f32; 3]>,
    /// Cells of each vertex less and plus the reach.
    cells: Vec<[[i16; 3]; 2]>,
    /// Occupied cells of each (x, y), bit z.
    rows: Vec<u128>,
}

/// The map from grid coordinates to fine cells of the object's solid.
struct FineFromGrid {
    rotation: Matrix3<f64>,
    offset: Vector3<f64>,
}

impl FineFromGrid {
    fn of(solid: &SolidGrid, camera_from_object: &Pose<CameraCv, Object>, placement: &GridPlacement) -> Self {
        let object_from_camera = camera_from_object.inverse();
        let corner = object_from_camera.point(&placement.lower_corner());
        Self {
            rotation: object_from_camera.rotation().matrix() * (placement.cell_size / solid.pitch),
            offset: (corner - solid.origin) / solid.pitch,
        }
    }

    /// Whether the fine cell around a point given in grid coordinates is solid.
    fn is_solid(&self, solid: &SolidGrid, point: [f64; 3]) -> bool {
        let fine = self.rotation * Vector3::from(point) + self.offset;
        let side = SolidGrid::SIDE as f64;
        if fine.iter().all(|index| *index >= 0.0 && *index < side) {
            solid.get(fine.x as usize, fine.y as usize, fine.z as usize)
        } else {
            false
        }
    }
}

impl PlainComplete {
    /// Cells whose closed box meets the solid: the surface passes through them, or their centre is inside.
    ///
    /// `camera` are the mesh's vertices in `CameraCv` [m], each axis apart. Where `closed`, no surface crosses a run of
    /// cells without surface, and one look into the solid decides all of it; else each cell is looked up.
    #[expect(clippy::too_many_arguments, reason = "each is a part of the sample; a struct would only rename them")]
    pub fn any_overlap(
        &mut self,
        camera: &[Vec<f32>; 3],
        triangles: &[[u32; 3]],
        solid: &SolidGrid,
        closed: bool,
        camera_from_object: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
        grid: &mut OccupancyGrid,
    ) {
        let n = placement.resolution as usize;
        self.rows.clear();
        self.rows.resize(n * n, 0);
        self.place_vertices(camera, placement);
        self.mark_surface(triangles, n as i16, REACH / placement.cell_size as f32 + REACH_CELLS);
        let fine = FineFromGrid::of(solid, camera_from_object, placement);
        let all = if n == 128 { u128::MAX } else { (1 << n) - 1 };
        for (place, row) in self.rows.iter_mut().enumerate() {
            let (x, y) = (place / n, place % n);
            let is_solid = |z: usize| fine.is_solid(solid, [x as f64 + 0.5, y as f64 + 0.5, z as f64 + 0.5]);
            let mut free = !*row & all;
            while free != 0 {
                let start = free.trailing_zeros() as usize;
                let length = if closed { (free >> start).trailing_ones() as usize } else { 1 };
                let run = if length == 128 { u128::MAX } else { ((1 << length) - 1) << start };
                if is_solid(start + length / 2) {
                    *row |= run;
                }
                free &= !run;
            }
        }
        pack(&self.rows, placement.resolution, grid);
    }

    /// Cells whose centre is inside the solid.
    pub fn centre_inside(
        &mut self,
        solid: &SolidGrid,
        camera_from_object: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
        grid: &mut OccupancyGrid,
    ) {
        let n = placement.resolution as usize;
        let fine = FineFromGrid::of(solid, camera_from_object, placement);
        self.rows.clear();
        self.rows.extend((0..n * n).map(|place| {
            let (x, y) = (place / n, place % n);
            (0..n)
                .filter(|z| fine.is_solid(solid, [x as f64 + 0.5, y as f64 + 0.5, *z as f64 + 0.5]))
                .fold(0u128, |row, z| row | 1 << z)
        }));
        pack(&self.rows, placement.resolution, grid);
    }

    fn place_vertices(&mut self, camera: &[Vec<f32>; 3], placement: &GridPlacement) {
        let scale = (1.0 / placement.cell_size) as f32;
        let corner = placement.lower_corner().map(|coordinate| coordinate as f32);
        let reach = REACH * scale + REACH_CELLS;
        let [x, y, z] = camera;
        self.vertices.clear();
        self.vertices.extend(
            x.iter()
                .zip(y)
                .zip(z)
                .map(|((x, y), z)| [(x - corner[0]) * scale, (y - corner[1]) * scale, (z - corner[2]) * scale]),
        );
        let cell = |coordinate: f32| coordinate.floor().clamp(-2.0, 200.0) as i16;
        self.cells.clear();
        self.cells.extend(
            self.vertices.iter().map(|vertex| [vertex.map(|c| cell(c - reach)), vertex.map(|c| cell(c + reach))]),
        );
    }

    fn mark_surface(&mut self, triangles: &[[u32; 3]], n: i16, reach: f32) {
        for triangle in triangles {
            let corners = triangle.map(|vertex| vertex as usize);
            let low: [i16; 3] =
                std::array::from_fn(|axis| corners.iter().map(|v| self.cells[*v][0][axis]).min().unwrap_or(0).max(0));
            let high: [i16; 3] = std::array::from_fn(|axis| {
                corners.iter().map(|v| self.cells[*v][1][axis]).max().unwrap_or(0).min(n - 1)
            });
            let spans = (0..3).filter(|axis| low[*axis] < high[*axis]).count();
            if (0..3).any(|axis| low[axis] > high[axis]) {
                continue;
            }
            let corners = corners.map(|vertex| self.vertices[vertex]);
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    let row = x as usize * n as usize + y as usize;
                    for z in low[2]..=high[2] {
                        // A triangle that spans one axis only meets every cell between its ends.
                        let marked = self.rows[row] >> z & 1 != 0;
                        if !marked && (spans <= 1 || meets(&corners, [x, y, z], reach)) {
                            self.rows[row] |= 1 << z;
                        }
                    }
                }
            }
        }
    }
}

/// Whether a triangle meets the closed unit cell at `cell`, grown by `reach` on all sides: the separating axes of
/// Akenine-Moeller (2001), "Fast 3D triangle-box overlap testing". The axes of the cell itself were tested before.
fn meets(corners: &[[f32; 3]; 3], cell: [i16; 3], reach: f32) -> bool {
    let half = 0.5 + reach;
    let [a, b, c] = corners.map(|corner| {
        let relative: [f32; 3] = std::array::from_fn(|axis| corner[axis] - (f32::from(cell[axis]) + 0.5));
        Vector3::from(relative)
    });
    let edges = [b - a, c - b, a - c];
    let normal = edges[0].cross(&edges[1]);
    if normal.dot(&a).abs() > half * (normal.x.abs() + normal.y.abs() + normal.z.abs()) {
        return false;
    }
    for edge in &edges {
        for axis in 0..3 {
            let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
            // The axis is unit(axis) x edge: it has -edge[q] at p and edge[p] at q.
            let along = |v: &Vector3<f32>| edge[p] * v[q] - edge[q] * v[p];
            let [i, j, k] = [along(&a), along(&b), along(&c)];
            let radius = half * (edge[p].abs() + edge[q].abs());
            if i.min(j).min(k) > radius || i.max(j).max(k) < -radius {
                return false;
            }
        }
    }
    true
}

/// Rows of up to 128 bits, (x, y) in C order, into the packed grid.
fn pack(rows: &[u128], resolution: u32, grid: &mut OccupancyGrid) {
    grid.reset(resolution);
    let n = resolution as usize;
    let bytes = grid.bytes_mut();
    for (place, row) in rows.iter().enumerate() {
        let bit = place * n;
        let (byte, shift) = (bit / 8, bit % 8);
        let (low, high) = (row << shift, if shift == 0 { 0 } else { row >> (128 - shift) });
        let count = (n + shift).div_ceil(8);
        for (target, value) in
            bytes[byte..].iter_mut().zip(low.to_le_bytes().into_iter().chain([high as u8])).take(count)
        {
            *target |= value;
        }
    }
}

/// Cells whose centre the camera sees to be free: it projects to a pixel with a farther return, or with none.
pub fn free_cells(
    crop: &crate::geom::DepthCrop,
    camera: &crate::geom::Intrinsics,
    placement: &GridPlacement,
    grid: &mut OccupancyGrid,
) {
    let n = placement.resolution;
    grid.reset(n);
    let corner = placement.lower_corner();
    for x in 0..n {
        for y in 0..n {
            for z in 0..n {
                let offset = [x, y, z].map(|index| (f64::from(index) + 0.5) * placement.cell_size);
                let centre = Point3::new(corner.x + offset[0], corner.y + offset[1], corner.z + offset[2]);
                if centre.z < camera.near {
                    continue;
                }
                let (u, v) = camera.project(&centre);
                let in_image = u >= 0.0 && v >= 0.0 && u < f64::from(camera.width) && v < f64::from(camera.height);
                if in_image {
                    let depth = crop.at(u as u32, v as u32);
                    if depth.is_nan() || f64::from(depth) > centre.z {
                        grid.set([x, y, z]);
                    }
                }
            }
        }
    }
}
