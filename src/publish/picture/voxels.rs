//! Occupancy grids as shaded cubes, seen from the camera's side or from behind.

use nalgebra::Vector3;

use super::{Colour, Oklab, Picture};
use kernel::geom::OccupancyGrid;

/// Subpixels along each side of a pixel.
const FINE: u32 = 2;

/// Viewpoint of a grid's picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Eye {
    /// Near the camera, a step to the right and up: shows what the camera saw.
    CameraSide,
    /// From the far side: shows what the camera could not see.
    Behind,
}

impl Eye {
    /// Angle about the vertical, from the camera's own position towards its right, and angle above [rad].
    fn angles(self) -> (f64, f64) {
        let (azimuth, elevation): (f64, f64) = match self {
            Self::CameraSide => (38.0, 27.0),
            Self::Behind => (142.0, 27.0),
        };
        (azimuth.to_radians(), elevation.to_radians())
    }
}

/// Paints grids that belong together at one place and size, so that their pictures can be compared.
pub struct VoxelPainter {
    side: u32,
    /// Screen axes in grid axes: right, down, forward (away from the eye); unit vectors.
    right: Vector3<f64>,
    down: Vector3<f64>,
    forward: Vector3<f64>,
    /// Subpixels per cell.
    scale: f64,
    /// Screen coordinates of the picture's middle [cells].
    middle: [f64; 2],
}

/// Content of a cell.
const EMPTY: u8 = 0;
const COMPLETE: u8 = 1;
const PARTIAL: u8 = 2;
const TOUCHED: u8 = 3;
const OTHERS: u8 = 4;

/// Cells with an empty border of one, and what fills them.
struct Cells {
    /// Resolution plus 2.
    n: usize,
    fill: Vec<u8>,
}

/// One visible side of a cell.
struct Face {
    cell: [usize; 3],
    /// Axis of the normal.
    axis: usize,
    /// Whether the normal points to larger coordinates.
    upper: bool,
}

/// Colour and distance of each subpixel; distance along the line of sight [cells], infinite where nothing is.
struct Canvas {
    side: u32,
    colour: Vec<[u8; 3]>,
    distance: Vec<f32>,
}

impl VoxelPainter {
    /// A painter of square pictures of `side` pixels, fitted to the cells that are occupied in any of `grids`.
    pub fn new(side: u32, eye: Eye, grids: &[&OccupancyGrid]) -> Self {
        let (azimuth, elevation) = eye.angles();
        let ((sa, ca), (se, ce)) = (libm::sincos(azimuth), libm::sincos(elevation));
        let forward = Vector3::new(-sa * ce, se, ca * ce);
        let down = (Vector3::y() - forward * forward.y).normalize();
        let right = down.cross(&forward);
        let mut painter = Self { side, right, down, forward, scale: 1.0, middle: [0.0; 2] };
        painter.fit(grids);
        painter
    }

    /// Chooses scale and middle so that the occupied cells fill the picture but for a margin.
    fn fit(&mut self, grids: &[&OccupancyGrid]) {
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for cell in grids.iter().flat_map(|grid| grid.cells()) {
            let middle = Vector3::from(cell.map(|index| f64::from(index) + 0.5));
            for (axis, screen) in [self.right, self.down].iter().enumerate() {
                // Half the extent of a unit cell along a screen axis.
                let reach = 0.5 * (screen.x.abs() + screen.y.abs() + screen.z.abs());
                let position = middle.dot(screen);
                min[axis] = min[axis].min(position - reach);
                max[axis] = max[axis].max(position + reach);
            }
        }
        let extent = (max[0] - min[0]).max(max[1] - min[1]);
        if extent > 0.0 {
            self.scale = f64::from(self.side * FINE) * 0.96 / extent;
            self.middle = [(min[0] + max[0]) / 2.0, (min[1] + max[1]) / 2.0];
        }
    }

    /// Draws the cells of `partial` in blue and those of `complete` that `partial` lacks in orange, on a clear ground.
    ///
    /// # Panics
    /// If the two grids differ in resolution.
    pub fn draw(&self, partial: Option<&OccupancyGrid>, complete: Option<&OccupancyGrid>) -> Picture {
        self.draw_cells(&Cells::new([(complete, COMPLETE), (partial, PARTIAL)]))
    }

    /// Draws as [`VoxelPainter::draw`], with the cells of `tactile` in green over both.
    ///
    /// # Panics
    /// If the grids differ in resolution.
    pub fn draw_touched(
        &self,
        partial: &OccupancyGrid,
        complete: Option<&OccupancyGrid>,
        tactile: &OccupancyGrid,
    ) -> Picture {
        self.draw_cells(&Cells::new([(complete, COMPLETE), (Some(partial), PARTIAL), (Some(tactile), TOUCHED)]))
    }

    /// Draws as [`VoxelPainter::draw`], with the cells of `others` that are in no other grid in grey.
    ///
    /// # Panics
    /// If the grids differ in resolution.
    pub fn draw_among(
        &self,
        partial: &OccupancyGrid,
        complete: Option<&OccupancyGrid>,
        others: &OccupancyGrid,
    ) -> Picture {
        self.draw_cells(&Cells::new([(Some(others), OTHERS), (complete, COMPLETE), (Some(partial), PARTIAL)]))
    }

    /// Puts a dot on a picture of this painter at each position on the grid [cells], even if it is hidden.
    pub fn dot(&self, picture: &mut Picture, colour: Colour, points: impl Iterator<Item = [f64; 3]>) {
        let pixels = self.scale / f64::from(FINE);
        // As large as a cell, within limits: to be seen in a small picture and no blot in a large one.
        let radius = (0.45 * pixels).clamp(f64::from(self.side) / 66.0, f64::from(self.side) / 50.0);
        let half = f64::from(self.side) / 2.0;
        for point in points.map(Vector3::from) {
            let x = (point.dot(&self.right) - self.middle[0]) * pixels + half;
            let y = (point.dot(&self.down) - self.middle[1]) * pixels + half;
            picture.dot([x, y], radius, colour);
        }
    }

    fn draw_cells(&self, cells: &Cells) -> Picture {
        let ramps = [Colour::COMPLETE, Colour::PARTIAL, Colour::TOUCHED, Colour::OTHERS].map(ramp);
        let mut canvas = Canvas::new(self.side * FINE);
        for face in self.faces_back_to_front(cells) {
            let fill = cells.fill[cells.index(face.cell)];
            self.paint(&mut canvas, cells, &face, &ramps[usize::from(fill - 1)]);
        }
        canvas.outline(self.scale);
        canvas.smooth()
    }

    /// Sides that face the eye and are not covered by their neighbour, farthest cell first: cells of a grid seen from
    /// afar hide each other in the order of their coordinates along each axis.
    fn faces_back_to_front(&self, cells: &Cells) -> Vec<Face> {
        let inner = cells.n - 2;
        let towards_eye: [bool; 3] = std::array::from_fn(|axis| self.forward[axis] < 0.0);
        // Larger coordinates are nearer if the eye is on their side.
        let ordered = |axis: usize, step: usize| if towards_eye[axis] { step + 1 } else { inner - step };
        let mut faces = Vec::new();
        for x in 0..inner {
            for y in 0..inner {
                for z in 0..inner {
                    let cell = [ordered(0, x), ordered(1, y), ordered(2, z)];
                    if cells.fill[cells.index(cell)] == EMPTY {
                        continue;
                    }
                    for (axis, upper) in towards_eye.into_iter().enumerate() {
                        if !cells.occupied(step(cell, axis, upper)) {
                            faces.push(Face { cell, axis, upper });
                        }
                    }
                }
            }
        }
        faces
    }

    fn paint(&self, canvas: &mut Canvas, cells: &Cells, face: &Face, ramp: &[[u8; 3]; 256]) {
        let (b, c) = ((face.axis + 1) % 3, (face.axis + 2) % 3);
        let mut corner = Vector3::from_fn(|axis, _| face.cell[axis] as f64 - 1.0);
        corner[face.axis] += f64::from(u8::from(face.upper));
        let half = f64::from(canvas.side) / 2.0;
        let screen = |v: &Vector3<f64>| [v.dot(&self.right) * self.scale, v.dot(&self.down) * self.scale];
        let at = screen(&corner);
        let o = [at[0] - self.middle[0] * self.scale + half, at[1] - self.middle[1] * self.scale + half];
        let (e, f) = (screen(&Vector3::ith(b, 1.0)), screen(&Vector3::ith(c, 1.0)));
        let area = e[0] * f[1] - e[1] * f[0];
        let distance = corner.dot(&self.forward);
        let (along_b, along_c) = (self.forward[b], self.forward[c]);

        let light = self.light(cells, face);
        let corners = cells.openness(face);
        // Lines between cells help to count them, as long as cells are more than a few pixels wide.
        let pixels = self.scale / f64::from(FINE);
        let line = ((pixels - 3.0) / 4.0).clamp(0.0, 1.0) * 0.13;
        let rim = 0.55 / pixels;

        let span = |axis: usize| {
            let (low, high) =
                (o[axis] + e[axis].min(0.0) + f[axis].min(0.0), o[axis] + e[axis].max(0.0) + f[axis].max(0.0));
            (low.max(0.0) as u32)..(high.max(0.0).ceil() as u32).min(canvas.side)
        };
        for row in span(1) {
            for column in span(0) {
                let q = [f64::from(column) + 0.5 - o[0], f64::from(row) + 0.5 - o[1]];
                let u = (q[0] * f[1] - q[1] * f[0]) / area;
                let v = (e[0] * q[1] - e[1] * q[0]) / area;
                if !((0.0..1.0).contains(&u) && (0.0..1.0).contains(&v)) {
                    continue;
                }
                let open = (corners[0] * (1.0 - u) + corners[1] * u) * (1.0 - v)
                    + (corners[2] * (1.0 - u) + corners[3] * u) * v;
                let edge = u.min(1.0 - u).min(v).min(1.0 - v) < rim;
                let shade = light * open * if edge { 1.0 - line } else { 1.0 };
                let index = (row * canvas.side + column) as usize;
                canvas.colour[index] = ramp[(shade.clamp(0.0, 1.0) * 255.0 + 0.5) as usize];
                canvas.distance[index] = (distance + u * along_b + v * along_c) as f32;
            }
        }
    }

    /// Brightness of a side, 0 to 1: a lamp above the eye's left shoulder on the side itself and, so that round shapes
    /// look round, on the surface that the cells around suggest.
    fn light(&self, cells: &Cells, face: &Face) -> f64 {
        let lamp = (self.right * -0.45 - self.down * 0.8 - self.forward * 0.55).normalize();
        let mut flat = Vector3::zeros();
        flat[face.axis] = if face.upper { 1.0 } else { -1.0 };
        let (around, certainty) = cells.normal(face.cell);
        let lit = |normal: &Vector3<f64>| 0.5 + 0.5 * normal.dot(&lamp);
        let share = 0.55 * certainty;
        0.38 + 0.62 * (lit(&flat) * (1.0 - share) + lit(&around) * share)
    }
}

/// The neighbouring cell along an axis.
fn step(mut cell: [usize; 3], axis: usize, upper: bool) -> [usize; 3] {
    cell[axis] = if upper { cell[axis] + 1 } else { cell[axis] - 1 };
    cell
}

/// From dark (0) to light (255) shades of a colour, made in Oklab so that the hue stays.
fn ramp(colour: Colour) -> [[u8; 3]; 256] {
    let Oklab { lightness, a, b } = colour.oklab();
    let (dark, bright) = (lightness * 0.36, (lightness + 0.5 * (1.0 - lightness)).min(0.93));
    std::array::from_fn(|level| {
        let l = dark + (bright - dark) * level as f64 / 255.0;
        // Very dark and very light shades carry less colour.
        let fade = (l / lightness).min((1.0 - l) / (1.0 - lightness)).clamp(0.35, 1.0);
        Oklab { lightness: l, a: a * fade, b: b * fade }.srgb().0
    })
}

impl Cells {
    /// Cells of some grids, the later over the earlier.
    fn new<const GRIDS: usize>(grids: [(Option<&OccupancyGrid>, u8); GRIDS]) -> Self {
        let resolution = grids.iter().find_map(|(grid, _)| *grid).map_or(1, OccupancyGrid::resolution);
        let n = resolution as usize + 2;
        let mut cells = Self { n, fill: vec![EMPTY; n * n * n] };
        for (grid, fill) in grids {
            let Some(grid) = grid else { continue };
            assert_eq!(grid.resolution(), resolution, "grids of one sample share their resolution");
            for cell in grid.cells() {
                let index = cells.index(cell.map(|index| index as usize + 1));
                cells.fill[index] = fill;
            }
        }
        cells
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.n + y) * self.n + z
    }

    fn occupied(&self, cell: [usize; 3]) -> bool {
        self.fill[self.index(cell)] != EMPTY
    }

    /// Openness of the space above each corner of a side, 0 to 1, corners (0, 0), (1, 0), (0, 1), (1, 1) over the two
    /// axes after the normal's: the classic corner rule of block worlds (two sides and a diagonal cover a corner).
    fn openness(&self, face: &Face) -> [f64; 4] {
        let (b, c) = ((face.axis + 1) % 3, (face.axis + 2) % 3);
        let above = step(face.cell, face.axis, face.upper);
        std::array::from_fn(|corner| {
            let (upper_b, upper_c) = (corner & 1 == 1, corner & 2 == 2);
            let side_b = self.occupied(step(above, b, upper_b));
            let side_c = self.occupied(step(above, c, upper_c));
            let diagonal = self.occupied(step(step(above, b, upper_b), c, upper_c));
            let covered = if side_b && side_c { 3 } else { u8::from(side_b) + u8::from(side_c) + u8::from(diagonal) };
            [1.0, 0.87, 0.75, 0.63][usize::from(covered)]
        })
    }

    /// Direction from full towards empty around a cell (unit length), and how clear it is, 0 to 1.
    fn normal(&self, cell: [usize; 3]) -> (Vector3<f64>, f64) {
        const REACH: usize = 2;
        let (mut sum, mut count) = ([0i64; 3], 0i64);
        let range = |axis: usize| cell[axis].saturating_sub(REACH)..(cell[axis] + REACH + 1).min(self.n);
        for x in range(0) {
            for y in range(1) {
                for z in range(2) {
                    if self.occupied([x, y, z]) {
                        count += 1;
                        for (total, (index, middle)) in sum.iter_mut().zip([x, y, z].into_iter().zip(cell)) {
                            *total += middle as i64 - index as i64;
                        }
                    }
                }
            }
        }
        let towards_empty = Vector3::from(sum.map(|total| total as f64)) / count as f64;
        let length = towards_empty.norm();
        if length < 1e-9 {
            return (Vector3::zeros(), 0.0);
        }
        // Half a block of cells pulls its middle 0.67 to 1 cells away from a flat surface.
        (towards_empty / length, (length / 0.6).min(1.0))
    }
}

impl Canvas {
    fn new(side: u32) -> Self {
        let count = side as usize * side as usize;
        Self { side, colour: vec![[0; 3]; count], distance: vec![f32::INFINITY; count] }
    }

    /// Darkens the rim of everything that is clearly in front of its surroundings.
    fn outline(&mut self, scale: f64) {
        let (side, reach) = (self.side as i64, i64::from(FINE));
        let clearly = (2.2 + 6.0 / scale) as f32;
        let rim: Vec<usize> = (0..side * side)
            .filter(|index| {
                let (row, column) = (index / side, index % side);
                let here = self.distance[*index as usize];
                here.is_finite()
                    && [(0, reach), (0, -reach), (reach, 0), (-reach, 0)].iter().any(|(down, right)| {
                        let (row, column) = (row + down, column + right);
                        let inside = (0..side).contains(&row) && (0..side).contains(&column);
                        !inside || self.distance[(row * side + column) as usize] > here + clearly
                    })
            })
            .map(|index| index as usize)
            .collect();
        for index in rim {
            self.colour[index] = self.colour[index].map(|channel| (u32::from(channel) * 9 / 20) as u8);
        }
    }

    /// Averages subpixels; what is partly covered becomes partly clear.
    fn smooth(&self) -> Picture {
        let small = self.side / FINE;
        let mut picture = Picture::filled(small, small, [0; 4]);
        for (index, pixel) in picture.pixels.iter_mut().enumerate() {
            let (row, column) = (index as u32 / small * FINE, index as u32 % small * FINE);
            let (mut sum, mut covered) = ([0u32; 3], 0u32);
            for fine in 0..FINE * FINE {
                let at = ((row + fine / FINE) * self.side + column + fine % FINE) as usize;
                if self.distance[at].is_finite() {
                    covered += 1;
                    for (total, channel) in sum.iter_mut().zip(self.colour[at]) {
                        *total += u32::from(channel);
                    }
                }
            }
            if covered > 0 {
                let [r, g, b] = sum.map(|total| ((total + covered / 2) / covered) as u8);
                *pixel = [r, g, b, (covered * 255 / (FINE * FINE)) as u8];
            }
        }
        picture
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(cells: impl IntoIterator<Item = [u32; 3]>) -> OccupancyGrid {
        let mut grid = OccupancyGrid::new(16);
        cells.into_iter().for_each(|cell| grid.set(cell));
        grid
    }

    /// Mean column and row of the pixels that pass.
    fn middle(picture: &Picture, passes: impl Fn([u8; 4]) -> bool) -> [f64; 2] {
        let indices: Vec<u32> =
            (0..).zip(&picture.pixels).filter(|(_, pixel)| passes(**pixel)).map(|(at, _)| at).collect();
        let mean = |part: &dyn Fn(u32) -> u32| {
            indices.iter().map(|index| f64::from(part(*index))).sum::<f64>() / indices.len() as f64
        };
        [mean(&|index| index % picture.width), mean(&|index| index / picture.width)]
    }

    fn is_blue([r, _, b, a]: [u8; 4]) -> bool {
        a == 255 && b > r
    }

    fn is_orange([r, _, b, a]: [u8; 4]) -> bool {
        a == 255 && r > b
    }

    /// The shadow of a unit cube along a unit vector f has the area |fx| + |fy| + |fz|.
    #[test]
    fn a_cube_covers_the_area_that_geometry_says() {
        let one = grid([[3, 9, 5]]);
        for eye in [Eye::CameraSide, Eye::Behind] {
            let painter = VoxelPainter::new(200, eye, &[&one]);
            let picture = painter.draw(Some(&one), None);
            let covered: f64 = picture.pixels.iter().map(|pixel| f64::from(pixel[3]) / 255.0).sum();
            let shadow = painter.forward.abs().sum() * (painter.scale / f64::from(FINE)).powi(2);
            assert!((covered / shadow - 1.0).abs() < 0.01, "{covered} px of {shadow}");
        }
    }

    #[test]
    fn right_is_right_and_down_is_down_from_the_camera() {
        let (left_up, right_down) = (grid([[2, 2, 8]]), grid([[12, 12, 8]]));
        let draw = |eye| VoxelPainter::new(160, eye, &[&left_up, &right_down]).draw(Some(&left_up), Some(&right_down));
        let picture = draw(Eye::CameraSide);
        let ([blue_x, blue_y], [orange_x, orange_y]) = (middle(&picture, is_blue), middle(&picture, is_orange));
        assert!(blue_x < orange_x && blue_y < orange_y);
        let behind = draw(Eye::Behind);
        assert!(middle(&behind, is_blue)[0] > middle(&behind, is_orange)[0], "from behind, sides change");
    }

    #[test]
    fn near_cells_hide_far_ones() {
        let plate = |z| grid((2..14).flat_map(move |x| (2..14).map(move |y| [x, y, z])));
        let (near, far) = (plate(6), plate(9));
        let share = |eye| {
            let picture = VoxelPainter::new(160, eye, &[&near, &far]).draw(Some(&near), Some(&far));
            let count = |passes: fn([u8; 4]) -> bool| picture.pixels.iter().filter(|pixel| passes(**pixel)).count();
            count(is_blue) as f64 / count(is_orange) as f64
        };
        assert!(share(Eye::CameraSide) > 1.2, "the near plate covers part of the far one");
        assert!(share(Eye::Behind) < 1.0 / 1.2, "and the other way round from behind");
    }

    #[test]
    fn few_colours_are_few_and_near() {
        let ball = grid(
            (0..16u32.pow(3))
                .map(|i| [i / 256, i / 16 % 16, i % 16])
                .filter(|cell| cell.iter().map(|index| (f64::from(*index) - 7.5).powi(2)).sum::<f64>() < 49.0),
        );
        let picture = VoxelPainter::new(200, Eye::CameraSide, &[&ball]).draw(None, Some(&ball));
        let few = picture.clone().with_few_colours();
        let distinct: std::collections::BTreeSet<_> = few.pixels.iter().collect();
        assert!(distinct.len() <= 256);
        let worst = (picture.pixels.iter().zip(&few.pixels))
            .filter(|(pixel, _)| pixel[3] == 255)
            .flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)))
            .max();
        assert!(worst.is_some_and(|worst| worst <= 32), "{worst:?}");
    }

    #[test]
    fn an_empty_grid_is_a_clear_picture() {
        let nothing = grid([]);
        let picture = VoxelPainter::new(32, Eye::Behind, &[&nothing]).draw(Some(&nothing), Some(&nothing));
        assert!(picture.pixels.iter().all(|pixel| *pixel == [0; 4]));
    }
}
