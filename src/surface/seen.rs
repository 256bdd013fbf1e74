//! One object as a camera saw it, pixel by pixel, as evidence about points in space.

use kernel::geom::Intrinsics;
use nalgebra::{Point3, Vector3};

/// Pixels around a pixel over which its surface's slope is measured: depths are noisy.
const SLOPE_REACH: u32 = 3;
/// Neighbouring pixels further apart in depth than this many footprints of a pixel see two surfaces.
const JUMP: f64 = 3.0;
/// Distances from the silhouette are measured up to this [px].
const MAX_APART: usize = 12;
/// Points behind a seen surface up to this far take part in it [voxels].
const BEHIND: f64 = 0.5;
/// Points that lie as far outside as this need no more precision [voxels].
const IN_FRONT: f64 = 1.0;
/// A step to the next voxel goes along the axes on which a direction has at least this share: half of the way to a corner.
const STEP_SHARE: f64 = 0.38;
/// Standard deviation over the median of the absolute second differences of white noise: 1 / (0.6745 sqrt(6)).
const SIGMA_OF_BENDS: f64 = 0.605;

/// Evidence of a pixel. The type is small, because points in space access pixels all over the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SeenPixel {
    /// No evidence: an outlier, or a pixel outside the picture.
    Doubtful,
    /// The object: one of its facets, by index.
    Object(u32),
    /// Another thing at this depth [m], so far from the object's silhouette, squared [px^2].
    Other { depth: f32, apart: u8 },
    /// Neither the pixel nor its eight neighbours have a return; so far from the object's silhouette, squared [px^2].
    Empty { apart: u8 },
}

/// The plane through a seen point at this depth [m]: points with normal . p = offset, the normal towards the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Facet {
    normal: [f64; 3],
    offset: f64,
    depth: f64,
}

/// Knowledge about a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Evidence {
    /// Nothing.
    Unknown,
    /// Depth below the seen surface, negative outside [voxels], and the voxel next to it that lies inward.
    Surface(f64, [i8; 3]),
    /// The camera sees through it: its distance from the object is at least this, negative [voxels].
    Free(f64),
    /// No ray came back: it is probably outside, at least this far, negative [voxels].
    Weak(f64),
}

/// One object as a camera saw it.
///
/// Lengths are metres in `CameraCv`.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenObject {
    camera: Intrinsics,
    pixels: Vec<SeenPixel>,
    facets: Vec<Facet>,
    /// Points of the object.
    points: Vec<[f32; 3]>,
    /// Standard deviation of the object's depths [m], as far as neighbouring pixels tell.
    noise: f64,
}

impl SeenObject {
    /// From a depth picture [m], NaN = no return, shape (height, width), row-major; the object's pixels by index, in order;
    /// and pixels to ignore, such as flying ones.
    ///
    /// # Panics
    /// If the picture's size is not the camera's, or a pixel of the object is outside of it.
    pub fn new(camera: &Intrinsics, depth: &[f32], object: &[u32], doubtful: &[u32]) -> Self {
        let (width, height) = (camera.width as usize, camera.height as usize);
        assert_eq!(depth.len(), width * height, "a depth per pixel");
        let mut is_object = vec![false; depth.len()];
        object.iter().for_each(|pixel| is_object[*pixel as usize] = true);
        let apart = squared_distances(&is_object, width);
        let mut pixels = vec![SeenPixel::Doubtful; depth.len()];
        for (index, pixel) in pixels.iter_mut().enumerate() {
            *pixel = if !depth[index].is_nan() {
                SeenPixel::Other { depth: depth[index], apart: apart[index] }
            } else if around(index, width, height).all(|other| depth[other].is_nan()) {
                SeenPixel::Empty { apart: apart[index] }
            } else {
                SeenPixel::Doubtful
            };
        }
        doubtful.iter().for_each(|pixel| pixels[*pixel as usize] = SeenPixel::Doubtful);
        let picture = ObjectPicture { camera, depth, is_object: &is_object };
        let (mut points, mut facets) = (Vec::with_capacity(object.len()), Vec::with_capacity(object.len()));
        for pixel in object {
            let point = picture.point(*pixel);
            // Where the surface falls off too steeply to have a slope, it is only known what lies before it.
            pixels[*pixel as usize] = match picture.normal(*pixel, &point) {
                Some(normal) => {
                    let offset = normal.dot(&point.coords);
                    facets.push(Facet { normal: normal.into(), offset, depth: point.z });
                    SeenPixel::Object(facets.len() as u32 - 1)
                }
                None => SeenPixel::Other { depth: depth[*pixel as usize], apart: 0 },
            };
            points.push(point.coords.map(|value| value as f32).into());
        }
        Self { camera: *camera, pixels, facets, points, noise: picture.noise(object) }
    }

    /// The object's seen points [m].
    pub fn points(&self) -> &[[f32; 3]] {
        &self.points
    }

    /// Positions [m] and unit normals, towards the camera, of the seen points at which the surface has a slope.
    pub fn oriented_points(&self) -> impl Iterator<Item = ([f64; 3], [f64; 3])> + '_ {
        let width = self.camera.width as usize;
        self.pixels.iter().enumerate().filter_map(move |(index, pixel)| match pixel {
            SeenPixel::Object(facet) => {
                let Facet { normal, depth, .. } = self.facets[*facet as usize];
                let (column, row) = ((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
                Some((self.camera.unproject(column, row, depth).into(), normal))
            }
            _ => None,
        })
    }

    /// Standard deviation of the object's depths [m], from the second differences of neighbouring pixels. Noise that is
    /// correlated over several pixels looks smaller.
    pub fn noise(&self) -> f64 {
        self.noise
    }

    /// Knowledge about points along a line parallel to the optical axis, at (x, y) and depths z [m]; lengths of the answers are
    /// in voxels of this side [m].
    pub(crate) fn evidence(&self, [x, y]: [f64; 2], depths: &[Depth], voxel: f64, out: &mut [Evidence]) {
        let (width, height) = (f64::from(self.camera.width), f64::from(self.camera.height));
        let (along_x, along_y) = (self.camera.fx * x, self.camera.fy * y);
        for (out, Depth { z, inverse }) in out.iter_mut().zip(depths) {
            let (u, v) = (along_x * inverse + self.camera.cx, along_y * inverse + self.camera.cy);
            let is_inside = *z > 0.0 && u >= 0.0 && v >= 0.0 && u < width && v < height;
            *out = if is_inside {
                let index = v as usize * self.camera.width as usize + u as usize;
                self.at_pixel(index, [x, y, *z], *inverse, voxel)
            } else {
                Evidence::Unknown
            };
        }
    }

    /// Whether the camera sees through all of what is within half a voxel beside a point [m]: a part that is thinner than a
    /// voxel may lie beside its centre.
    pub(crate) fn sees_through(&self, [x, y, z]: [f64; 3], voxel: f64) -> bool {
        let camera = &self.camera;
        let (u, v) = camera.project(&Point3::new(x, y, z));
        let span = |middle: f64, focal: f64, end: u32| {
            let reach = 0.5 * voxel * focal / z;
            (middle - reach).max(0.0) as u32..=((middle + reach).max(0.0) as u32).min(end - 1)
        };
        let columns = span(u, camera.fx, camera.width);
        let mut around = span(v, camera.fy, camera.height)
            .flat_map(|row| columns.clone().map(move |column| (row * camera.width + column) as usize));
        around.all(|pixel| match self.pixels[pixel] {
            SeenPixel::Doubtful => false,
            SeenPixel::Empty { .. } => true,
            SeenPixel::Object(facet) => z < self.facets[facet as usize].depth - 0.5 * voxel,
            SeenPixel::Other { depth, .. } => z < f64::from(depth) - 0.5 * voxel,
        })
    }

    fn at_pixel(&self, index: usize, [x, y, z]: [f64; 3], inverse: f64, voxel: f64) -> Evidence {
        // The silhouette runs half a pixel beyond the last pixel's centre.
        let beside = |apart: u8| {
            let apart = f64::from(apart).sqrt();
            let pixel = 1.0 / (inverse * self.camera.fx.max(self.camera.fy) * voxel);
            -((apart - 0.5) * pixel).clamp(0.0, IN_FRONT)
        };
        match self.pixels[index] {
            SeenPixel::Doubtful => Evidence::Unknown,
            SeenPixel::Empty { apart } => Evidence::Weak(beside(apart)),
            SeenPixel::Object(facet) => {
                let Facet { normal: [a, b, c], offset, .. } = self.facets[facet as usize];
                let inside = (offset - (a * x + b * y + c * z)) / voxel;
                if inside < -IN_FRONT {
                    Evidence::Free(-IN_FRONT)
                } else if inside < BEHIND {
                    let step = |share: f64| {
                        if share.abs() < STEP_SHARE {
                            0
                        } else if share > 0.0 {
                            -1
                        } else {
                            1
                        }
                    };
                    Evidence::Surface(inside, [a, b, c].map(step))
                } else {
                    Evidence::Unknown
                }
            }
            SeenPixel::Other { depth, .. } if z > f64::from(depth) - voxel => Evidence::Unknown,
            SeenPixel::Other { apart, .. } => Evidence::Free(beside(apart)),
        }
    }
}

/// A depth with its inverse.
pub(crate) struct Depth {
    pub(crate) z: f64,
    pub(crate) inverse: f64,
}

struct ObjectPicture<'a> {
    camera: &'a Intrinsics,
    depth: &'a [f32],
    is_object: &'a [bool],
}

impl ObjectPicture<'_> {
    fn point(&self, pixel: u32) -> Point3<f64> {
        let (column, row) = (pixel % self.camera.width, pixel / self.camera.width);
        let depth = f64::from(self.depth[pixel as usize]);
        self.camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, depth)
    }

    /// The pixel up to `most` steps away that is connected to this one by pixels of one surface, or the last one before a jump.
    fn last_joined(&self, pixel: u32, step: i64, most: u32) -> u32 {
        let mut at = pixel;
        for _ in 0..most.min(SLOPE_REACH) {
            let next = (i64::from(at) + step) as usize;
            let (from, to) = (f64::from(self.depth[at as usize]), f64::from(self.depth[next]));
            let footprint = from.min(to) / self.camera.fx.min(self.camera.fy);
            if !self.is_object[next] || (from - to).abs() > JUMP * footprint {
                break;
            }
            at = next as u32;
        }
        at
    }

    /// The surface's unit normal, towards the camera; `None` if no neighbour along an axis is of the same surface.
    fn normal(&self, pixel: u32, point: &Point3<f64>) -> Option<Vector3<f64>> {
        let (width, height) = (self.camera.width, self.camera.height);
        let (column, row) = (pixel % width, pixel / width);
        let slope = |step: i64, before: u32, after: u32| {
            let (first, last) = (self.last_joined(pixel, -step, before), self.last_joined(pixel, step, after));
            self.point(last) - self.point(first)
        };
        let across = slope(1, column, width - 1 - column);
        let down = slope(i64::from(width), row, height - 1 - row);
        let normal = across.cross(&down).try_normalize(1e-12)?;
        Some(if normal.dot(&point.coords) > 0.0 { -normal } else { normal })
    }

    /// By the median of the absolute second differences along rows.
    fn noise(&self, object: &[u32]) -> f64 {
        let width = self.camera.width;
        let is_inner = |pixel: &&u32| {
            let column = **pixel % width;
            column > 0
                && column + 1 < width
                && self.is_object[**pixel as usize - 1]
                && self.is_object[**pixel as usize + 1]
        };
        let bend = |pixel: &u32| {
            let at = |index: u32| f64::from(self.depth[index as usize]);
            (at(pixel - 1) - 2.0 * at(*pixel) + at(pixel + 1)).abs()
        };
        let mut bends: Vec<f64> = object.iter().filter(is_inner).map(bend).collect();
        bends.sort_by(f64::total_cmp);
        bends.get(bends.len() / 2).map_or(0.0, |median| SIGMA_OF_BENDS * median)
    }
}

/// Indices of a pixel's eight neighbours inside of the picture.
fn around(index: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let (column, row) = (index % width, index / width);
    let rows = row.saturating_sub(1)..=(row + 1).min(height - 1);
    let columns = column.saturating_sub(1)..=(column + 1).min(width - 1);
    rows.flat_map(move |row| columns.clone().map(move |column| row * width + column)).filter(move |at| *at != index)
}

/// Squared distance of each pixel to the nearest marked one [px^2], at most that of [`MAX_APART`].
fn squared_distances(marked: &[bool], width: usize) -> Vec<u8> {
    const FAR: usize = MAX_APART * MAX_APART;
    let height = marked.len() / width;
    let mut in_row = vec![FAR as u8; marked.len()];
    for (index, _) in marked.iter().enumerate().filter(|(_, marked)| **marked) {
        let (column, start) = (index % width, index - index % width);
        for other in column.saturating_sub(MAX_APART)..=(column + MAX_APART).min(width - 1) {
            let square = other.abs_diff(column).pow(2) as u8;
            in_row[start + other] = in_row[start + other].min(square);
        }
    }
    let mut squares = in_row.clone();
    for (index, square) in in_row.iter().enumerate().filter(|(_, square)| usize::from(**square) < FAR) {
        let (column, row) = (index % width, index / width);
        for other in row.saturating_sub(MAX_APART)..=(row + MAX_APART).min(height - 1) {
            let square = usize::from(*square) + other.abs_diff(row).pow(2);
            let at = &mut squares[other * width + column];
            *at = (*at).min(square.min(FAR) as u8);
        }
    }
    squares
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Intrinsics {
        Intrinsics { width: 40, height: 30, fx: 40.0, fy: 40.0, cx: 20.0, cy: 15.0, near: 0.1 }
    }

    #[test]
    fn distances_from_marked_pixels_are_those_of_the_definition() {
        let marked: Vec<bool> = (0..40 * 30).map(|index| [403_usize, 817, 1199].contains(&index)).collect();
        for (index, found) in squared_distances(&marked, 40).iter().enumerate() {
            let apart =
                |other: usize| (other % 40).abs_diff(index % 40).pow(2) + (other / 40).abs_diff(index / 40).pow(2);
            let wanted = [403, 817, 1199].map(apart).into_iter().fold(MAX_APART * MAX_APART, usize::min);
            assert_eq!(usize::from(*found), wanted, "{index}");
        }
    }

    #[test]
    fn a_slanted_plane_is_seen_where_it_is() {
        // The plane z = 1 + x / 2 fills columns 10 to 29; behind it is a wall at 3 m, with a hole that nothing comes back from.
        let camera = camera();
        let slope = 0.5;
        let depth_at = |column: usize| {
            let x = (column as f64 + 0.5 - camera.cx) / camera.fx;
            (1.0 / (1.0 - slope * x)) as f32
        };
        let is_hole = |column: usize, row: usize| column >= 36 && row < 5;
        let depth: Vec<f32> = (0..40 * 30)
            .map(|index| match (index % 40, index / 40) {
                (column, row) if is_hole(column, row) => f32::NAN,
                (column @ 10..30, _) => depth_at(column),
                _ => 3.0,
            })
            .collect();
        let object: Vec<u32> = (0..40 * 30).filter(|pixel| (10..30).contains(&(pixel % 40))).collect();
        let seen = SeenObject::new(&camera, &depth, &object, &[3]);
        assert_eq!(seen.points().len(), object.len());
        let voxel = 0.05;
        let ask = |[x, y, z]: [f64; 3]| {
            let mut found = [Evidence::Unknown];
            seen.evidence([x, y], &[Depth { z, inverse: 1.0 / z }], voxel, &mut found);
            found[0]
        };
        // Distances from the plane are exact, also off the pixels' centres.
        let normal = (1.0_f64 + slope * slope).sqrt();
        for (x, y, inside) in [(0.013, 0.02, 0.3), (-0.1, -0.09, -0.8), (0.02, 0.11, 0.0)] {
            let z = 1.0 + slope * x + inside * voxel * normal;
            let Evidence::Surface(found, inward) = ask([x, y, z]) else { panic!("{:?}", ask([x, y, z])) };
            assert_eq!(inward, [-1, 0, 1]);
            assert!((found - inside).abs() < 1e-4, "{found}, not {inside}");
        }
        assert_eq!(ask([0.0, 0.0, 0.8]), Evidence::Free(-1.0));
        assert_eq!(ask([0.0, 0.0, 1.1]), Evidence::Unknown, "behind what is seen");
        // Beside the silhouette: a pixel away from it at 2 m is 0.05 m.
        let Evidence::Free(found) = ask([2.0 * (30.5 - 20.0) / 40.0, 0.0, 2.0]) else { panic!("free") };
        assert!((found + 0.5).abs() < 1e-9, "{found}");
        assert_eq!(ask([0.95, 0.0, 2.0]), Evidence::Free(-1.0));
        assert_eq!(ask([1.4, 0.0, 2.99]), Evidence::Unknown, "at the wall");
        assert_eq!(ask([2.0 * 18.5 / 40.0, 2.0 * -13.0 / 40.0, 2.0]), Evidence::Weak(-1.0));
        assert_eq!(ask([2.0 * -16.5 / 40.0, 2.0 * -14.5 / 40.0, 2.0]), Evidence::Unknown, "the doubtful pixel");
        assert_eq!(ask([0.0, 0.0, -1.0]), Evidence::Unknown);
        // Beside the silhouette half a voxel decides, and so it does within the object.
        assert!(seen.sees_through([0.0, 0.0, 0.8], voxel) && !seen.sees_through([0.0, 0.0, 0.98], voxel));
        let beside = |columns: f64| [2.0 * (30.0 + columns - 20.0) / 40.0, 0.0, 2.0];
        assert!(seen.sees_through(beside(0.6), voxel) && !seen.sees_through(beside(0.4), voxel));
        assert!(seen.noise() < 2e-3, "{}", seen.noise());
    }
}
