//! Something between the camera and an object that hides a stated share of the object's pixels.
//!
//! An occluder is a convex solid that is completely nearer than the visible part of the object: a random piece, moved
//! across the object until it hides the required share, or a slab whose one edge crosses the whole image. It depends
//! only on the image of the object and on the stream.

use std::f64::consts::{PI, TAU};

use nalgebra::{Rotation3, Vector3};

use super::Rasteriser;
use crate::{
    geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose, RenderMesh, TriMesh, rotation_from_quaternion},
    seed::Stream,
};

/// Distance from the occluder's far end to the object's nearest pixel, in widths of the object's visible part.
const GAP: [f64; 2] = [0.1, 1.0];
/// Radius of a piece, in widths of the object's visible part.
const RADIUS: [f64; 2] = [0.25, 0.75];
/// Half axes of a piece, before it is brought to its radius.
const HALF_AXIS: [f64; 2] = [0.3, 1.0];
/// Distance at which a piece's way passes by the middle of the visible object, in widths of that.
const ASIDE: [f64; 2] = [-0.3, 0.3];
/// Share of the room between the near plane and the object that gap and piece may fill.
const FILLED: f64 = 0.9;
/// A piece that hides too little even in the middle grows by this factor, at most `MAX_GROWTHS` times.
const GROWTH: f64 = 1.5;
const MAX_GROWTHS: usize = 8;
/// Positions that are tried along a piece's way, and the error of the hidden share that ends the search.
const MAX_POSITIONS: usize = 14;
const GOOD_SHARE: f64 = 0.005;
/// Front of a slab over its back, in depth: its side faces run along the lines of sight.
const SLAB: f64 = 0.99;

/// Kind of an occluder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OccluderKind {
    /// A box, cylinder, frustum or superquadric at random, somewhere in front of the object.
    Neighbour,
    /// Everything on one side of a line at random across the image.
    HalfSpace,
}

/// Rule by which occluders are drawn: how often there is one, and how much it hides.
#[derive(Clone, Debug, PartialEq)]
pub struct OccluderModel {
    /// Kinds that are drawn from, each as often as the others; at least one.
    pub kinds: Vec<OccluderKind>,
    /// Share of the views with an occluder, 0 to 1.
    pub share: f64,
    /// Smallest and largest share of the object's pixels that it hides, 0 to 1.
    pub hidden: [f64; 2],
}

/// An occluder in front of an object in one view.
#[derive(Clone, Debug)]
pub struct Occluder {
    /// Kind of the occluder.
    pub kind: OccluderKind,
    /// Corners, whose convex hull it is, in `CameraCv` [m].
    pub corners: Vec<[f32; 3]>,
    /// Depth image of only the occluder, from our own rasteriser.
    pub depth: DepthCrop,
    /// Pixels of the object without an occluder in front.
    pub object_pixels: u32,
    /// Pixels of these that see the occluder instead.
    pub hidden_pixels: u32,
    /// Nearest depth of the occluder [m].
    pub nearest: f64,
    /// Depth half way between the occluder and the object [m]: nearer measurements belong to the occluder.
    pub split: f64,
}

impl OccluderModel {
    /// Draws an occluder in front of an object in a view: `None` in the views that stay free, and where the object is
    /// not visible. `object` is the perfect depth image of the object without occluders.
    ///
    /// The share that is hidden is as near to the drawn one as a search in a few steps brings it. It can lie outside of
    /// [`OccluderModel::hidden`] where an object has few pixels or there is no room in front of it.
    pub fn draw(
        &self,
        rasteriser: &mut Rasteriser,
        camera: &Intrinsics,
        object: &DepthCrop,
        stream: &mut Stream,
    ) -> Option<Occluder> {
        let seen = SeenObject::new(camera, object)?;
        if stream.unit() >= self.share {
            return None;
        }
        let kind = self.kinds[stream.below(self.kinds.len() as u64) as usize];
        let wanted = stream.uniform(self.hidden[0], self.hidden[1]);
        let gap = seen.size * stream.uniform(GAP[0], GAP[1]);
        let mesh = match kind {
            OccluderKind::Neighbour => self.slide_piece(rasteriser, camera, object, &seen, wanted, gap, stream),
            OccluderKind::HalfSpace => half_space(camera, object, &seen, wanted, gap, stream.uniform(0.0, TAU)),
        };
        let depth = rasteriser.render(&RenderMesh::new(&mesh, false), camera, &Pose::identity()).clone();
        let ends = |pick: fn(f64, f64) -> f64, start: f64| {
            mesh.vertices.iter().map(|vertex| f64::from(vertex[2])).fold(start, pick)
        };
        Some(Occluder {
            kind,
            object_pixels: seen.pixels,
            hidden_pixels: count_hidden(object, &depth),
            nearest: ends(f64::min, f64::INFINITY),
            split: (ends(f64::max, 0.0) + seen.nearest) / 2.0,
            depth,
            corners: mesh.vertices,
        })
    }

    /// A piece at random, at the position of a line across the image where it hides about `wanted` of the object.
    #[expect(clippy::too_many_arguments, reason = "all of a draw")]
    fn slide_piece(
        &self,
        rasteriser: &mut Rasteriser,
        camera: &Intrinsics,
        object: &DepthCrop,
        seen: &SeenObject,
        wanted: f64,
        gap: f64,
        stream: &mut Stream,
    ) -> TriMesh {
        // Shape, direction of the line across the image, its offset from the middle, and size.
        let unit = unit_piece(stream);
        let (sin, cos) = libm::sincos(stream.uniform(0.0, TAU));
        let aside = seen.width * stream.uniform(ASIDE[0], ASIDE[1]);
        let mut radius = seen.size * stream.uniform(RADIUS[0], RADIUS[1]);
        let room = FILLED * (seen.nearest - camera.near);
        let total = f64::from(seen.pixels);
        for growth in 0.. {
            // A piece that finds no room between the camera and the object comes nearer and is smaller.
            let shrink = (room / (gap + 2.0 * radius)).min(1.0);
            let (gap, radius_that_fits) = (gap * shrink, radius * shrink);
            let depth = seen.nearest - gap - radius_that_fits;
            let piece = scaled(&unit, radius_that_fits);
            let laid_out = RenderMesh::new(&piece, false);
            // Image position `way` pixels from the middle along the line, and that position in space.
            let position = |way: f64| {
                let (u, v) = (seen.middle[0] + way * cos - aside * sin, seen.middle[1] + way * sin + aside * cos);
                camera.unproject(u, v, depth).coords
            };
            let mut share_at = |way: f64| {
                let pose: Pose<CameraCv, Object> = Pose::new(Rotation3::identity(), position(way));
                f64::from(count_hidden(object, rasteriser.render(&laid_out, camera, &pose))) / total
            };
            let error = |share: f64| {
                let outside = share < self.hidden[0] || share > self.hidden[1];
                (share - wanted).abs() + f64::from(u8::from(outside))
            };
            // A piece that hides too little even in the middle grows.
            let middle = share_at(0.0);
            if middle < wanted && growth < MAX_GROWTHS {
                radius *= GROWTH;
                continue;
            }
            // Bisection from the middle to where the piece hides nothing.
            let outline = camera.fx.max(camera.fy) * radius_that_fits / (depth - radius_that_fits);
            let (mut near, mut far) = (0.0, seen.width + seen.height + outline);
            let mut best = (error(middle), near);
            for _ in 0..MAX_POSITIONS {
                if best.0 <= GOOD_SHARE {
                    break;
                }
                let way = (near + far) / 2.0;
                let share = share_at(way);
                if error(share) < best.0 {
                    best = (error(share), way);
                }
                if share >= wanted { near = way } else { far = way }
            }
            return moved(&piece, &position(best.1));
        }
        unreachable!("a piece stops growing")
    }
}

impl Occluder {
    /// Share of the object's pixels that are hidden, 0 to 1.
    pub fn hidden_share(&self) -> f64 {
        f64::from(self.hidden_pixels) / f64::from(self.object_pixels)
    }

    /// Depth of the object's crop, widened by `margin` pixels inside the image, with the occluder in front.
    pub fn scene(&self, camera: &Intrinsics, object: &DepthCrop, margin: u32) -> DepthCrop {
        let (left, top) = (object.left.saturating_sub(margin), object.top.saturating_sub(margin));
        let right = (object.left + object.width).saturating_add(margin).min(camera.width);
        let bottom = (object.top + object.height).saturating_add(margin).min(camera.height);
        composed([left, top, right, bottom], &self.depth, object)
    }

    /// Removes pixels nearer than half way to the object, which belong to the occluder, and crops the rest tightly.
    pub fn without_occluder(&self, scene: &DepthCrop) -> DepthCrop {
        let split = self.split as f32;
        let far = |depth: &f32| if *depth >= split { *depth } else { f32::NAN };
        DepthCrop { depth: scene.depth.iter().map(far).collect(), ..*scene }.trimmed()
    }

    /// Depth at which each line of sight ends: at the exact surface of the occluder, elsewhere at `scene` as measured.
    pub fn sight(&self, scene: &DepthCrop) -> DepthCrop {
        let front = &self.depth;
        if front.width == 0 || scene.width == 0 {
            return if scene.width == 0 { front.clone() } else { scene.clone() };
        }
        let ends = |crop: &DepthCrop| [crop.left + crop.width, crop.top + crop.height];
        let ([right, bottom], [far_right, far_bottom]) = (ends(front), ends(scene));
        let (left, top) = (front.left.min(scene.left), front.top.min(scene.top));
        composed([left, top, right.max(far_right), bottom.max(far_bottom)], front, scene)
    }
}

/// The part of an image from (left, top) to before (right, bottom): `front` where it has a return, else `behind`.
fn composed([left, top, right, bottom]: [u32; 4], front: &DepthCrop, behind: &DepthCrop) -> DepthCrop {
    let (width, height) = (right - left, bottom - top);
    let mut depth = vec![f32::NAN; width as usize * height as usize];
    for crop in [behind, front] {
        for (y, line) in crop.depth.chunks_exact(crop.width.max(1) as usize).enumerate() {
            let row = crop.top + y as u32;
            if !(top..bottom).contains(&row) {
                continue;
            }
            let line_out = &mut depth[(row - top) as usize * width as usize..][..width as usize];
            let first = crop.left.max(left);
            let last = (crop.left + crop.width).min(right);
            if first >= last {
                continue;
            }
            let from = &line[(first - crop.left) as usize..(last - crop.left) as usize];
            for (to, from) in line_out[(first - left) as usize..].iter_mut().zip(from) {
                if !from.is_nan() {
                    *to = *from;
                }
            }
        }
    }
    DepthCrop { left, top, width, height, depth }
}

/// The visible part of an object in an image.
struct SeenObject {
    /// Pixels that see it, at least one.
    pixels: u32,
    /// Mean of these pixels' centres [px].
    middle: [f64; 2],
    /// Box of these pixels [px].
    width: f64,
    height: f64,
    /// Nearest depth [m].
    nearest: f64,
    /// Longer side of the box at that depth [m].
    size: f64,
}

impl SeenObject {
    fn new(camera: &Intrinsics, object: &DepthCrop) -> Option<Self> {
        let (mut pixels, mut sums, mut nearest) = (0_u32, [0_u64; 2], f32::INFINITY);
        for (y, line) in object.depth.chunks_exact(object.width.max(1) as usize).enumerate() {
            for (x, depth) in line.iter().enumerate().filter(|(_, depth)| !depth.is_nan()) {
                pixels += 1;
                sums = [sums[0] + x as u64, sums[1] + y as u64];
                nearest = nearest.min(*depth);
            }
        }
        let mean = |sum: u64, first: u32| f64::from(first) + sum as f64 / f64::from(pixels) + 0.5;
        let (width, height, nearest) = (f64::from(object.width), f64::from(object.height), f64::from(nearest));
        (pixels > 0).then(|| Self {
            pixels,
            middle: [mean(sums[0], object.left), mean(sums[1], object.top)],
            width,
            height,
            nearest,
            size: (width / camera.fx).max(height / camera.fy) * nearest,
        })
    }
}

/// Pixels of an object that an occluder in front of it hides.
fn count_hidden(object: &DepthCrop, occluder: &DepthCrop) -> u32 {
    let (left, right) =
        (object.left.max(occluder.left), (object.left + object.width).min(occluder.left + occluder.width));
    let (top, bottom) =
        (object.top.max(occluder.top), (object.top + object.height).min(occluder.top + occluder.height));
    let mut hidden = 0;
    for row in top..bottom.max(top) {
        let line = |crop: &DepthCrop| {
            let first = (row - crop.top) as usize * crop.width as usize;
            first + (left - crop.left) as usize..first + (right.max(left) - crop.left) as usize
        };
        if left < right {
            let pairs = object.depth[line(object)].iter().zip(&occluder.depth[line(occluder)]);
            hidden += pairs.map(|(a, b)| u32::from(!a.is_nan() & !b.is_nan())).sum::<u32>();
        }
    }
    hidden
}

/// A slab over the side of a line across the image that holds about `wanted` of the object's pixels; the line's normal
/// points along `angle`.
fn half_space(
    camera: &Intrinsics,
    object: &DepthCrop,
    seen: &SeenObject,
    wanted: f64,
    gap: f64,
    angle: f64,
) -> TriMesh {
    let (sin, cos) = libm::sincos(angle);
    // Positions of the object's pixels along the normal: the line runs between the last pixel that stays visible and
    // the next.
    let mut along: Vec<f64> = Vec::with_capacity(seen.pixels as usize);
    for (index, _) in object.depth.iter().enumerate().filter(|(_, depth)| !depth.is_nan()) {
        let (x, y) = (index % object.width as usize, index / object.width as usize);
        along.push((f64::from(object.left) + x as f64 + 0.5) * cos + (f64::from(object.top) + y as f64 + 0.5) * sin);
    }
    along.sort_unstable_by(f64::total_cmp);
    let spared = along.len() - (wanted * along.len() as f64) as usize;
    let line = match along.get(spared) {
        Some(next) => (along[spared - 1] + next) / 2.0,
        None => along[along.len() - 1] + 0.5,
    };
    // The image with a margin of a pixel, cut at the line (Sutherland and Hodgman 1974).
    let (right, bottom) = (f64::from(camera.width) + 1.0, f64::from(camera.height) + 1.0);
    let image = [[-1.0, -1.0], [right, -1.0], [right, bottom], [-1.0, bottom]];
    let over = |corner: &[f64; 2]| corner[0] * cos + corner[1] * sin - line;
    let mut outline = Vec::new();
    for (index, a) in image.iter().enumerate() {
        let b = &image[(index + 1) % image.len()];
        if over(a) >= 0.0 {
            outline.push(*a);
        }
        if (over(a) >= 0.0) != (over(b) >= 0.0) {
            let part = over(a) / (over(a) - over(b));
            outline.push([a[0] + (b[0] - a[0]) * part, a[1] + (b[1] - a[1]) * part]);
        }
    }
    let shrink = (FILLED * (seen.nearest - camera.near) / gap).min(1.0);
    let back = seen.nearest - gap * shrink;
    // Its front stays beyond the near plane.
    let front = (back * SLAB).max((camera.near + back) / 2.0);
    let ring = |depth: f64| outline.iter().map(move |[u, v]| camera.unproject(*u, *v, depth).coords).collect();
    stacked(&[ring(front), ring(back)])
}

/// A convex piece whose farthest corner is 1 from the origin, rotated at random.
fn unit_piece(stream: &mut Stream) -> TriMesh {
    let round = |columns: usize| {
        (0..columns).map(move |column| libm::sincos(TAU * column as f64 / columns as f64)).map(|(sin, cos)| [cos, sin])
    };
    // Outline of the cross-section, and height and width of each ring.
    let (outline, rings): (Vec<[f64; 2]>, Vec<[f64; 2]>) = match stream.below(4) {
        0 => (vec![[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]], vec![[-1.0, 1.0], [1.0, 1.0]]),
        1 => (round(24).collect(), vec![[-1.0, 1.0], [1.0, 1.0]]),
        2 => (round(24).collect(), vec![[-1.0, 1.0], [1.0, stream.uniform(0.2, 0.9)]]),
        _ => {
            // Barr's spherical product of two superellipses, without its poles: rings of one shape are planar trapezoids.
            let [meridian, around] = [stream.uniform(0.3, 1.2), stream.uniform(0.3, 1.2)];
            let reach = |sin: f64, cos: f64, exponent: f64| {
                let power = |x: f64| libm::pow(libm::fabs(x), 2.0 / exponent);
                libm::pow(power(sin) + power(cos), -exponent / 2.0)
            };
            let outline = round(16).map(|[cos, sin]| [cos, sin].map(|v| v * reach(sin, cos, around))).collect();
            let latitudes = (-3..=3).map(|row| libm::sincos(f64::from(row) * PI / 7.0));
            (outline, latitudes.map(|(sin, cos)| [sin, cos].map(|v| v * reach(sin, cos, meridian))).collect())
        }
    };
    let axes: [f64; 3] = std::array::from_fn(|_| stream.uniform(HALF_AXIS[0], HALF_AXIS[1]));
    let rotation = rotation_from_quaternion(std::array::from_fn(|_| stream.normal()));
    let corner = |[height, width]: [f64; 2], [x, y]: [f64; 2]| {
        rotation * Vector3::new(axes[0] * width * x, axes[1] * width * y, axes[2] * height)
    };
    let rings: Vec<Vec<Vector3<f64>>> =
        rings.iter().map(|ring| outline.iter().map(|at| corner(*ring, *at)).collect()).collect();
    let far = rings.iter().flatten().map(|corner| corner.norm()).fold(0.0, f64::max);
    scaled(&stacked(&rings), 1.0 / far)
}

/// The solid between rings of equally many corners, counter-clockwise seen from the last; both ends are flat.
fn stacked(rings: &[Vec<Vector3<f64>>]) -> TriMesh {
    let columns = rings[0].len() as u32;
    let mut mesh = TriMesh {
        vertices: rings.iter().flatten().map(|corner| [corner.x as f32, corner.y as f32, corner.z as f32]).collect(),
        triangles: Vec::new(),
    };
    for low in 0..rings.len() as u32 - 1 {
        for column in 0..columns {
            let next = (column + 1) % columns;
            let [a, b, c, d] = [
                low * columns + column,
                low * columns + next,
                (low + 1) * columns + next,
                (low + 1) * columns + column,
            ];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let last = (rings.len() as u32 - 1) * columns;
    for corner in 1..columns.max(2) - 1 {
        mesh.triangles.extend([[0, corner + 1, corner], [last, last + corner, last + corner + 1]]);
    }
    mesh
}

fn scaled(mesh: &TriMesh, factor: f64) -> TriMesh {
    changed(mesh, |corner| corner * factor)
}

fn moved(mesh: &TriMesh, by: &Vector3<f64>) -> TriMesh {
    changed(mesh, |corner| corner + by)
}

fn changed(mesh: &TriMesh, change: impl Fn(Vector3<f64>) -> Vector3<f64>) -> TriMesh {
    let change = |vertex: &[f32; 3]| {
        let corner = change(Vector3::from(vertex.map(f64::from)));
        [corner.x as f32, corner.y as f32, corner.z as f32]
    };
    TriMesh { vertices: mesh.vertices.iter().map(change).collect(), triangles: mesh.triangles.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::SimdLevel;

    fn camera() -> Intrinsics {
        Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).expect("a camera")
    }

    /// A disc at 1 m with a dent, 120 pixels wide, off the middle of the image.
    fn disc() -> DepthCrop {
        let inside = |x: i32, y: i32| (x - 60).pow(2) + (y - 50).pow(2) < 2400;
        let depth = (0..100).flat_map(|y| (0..120).map(move |x| (x, y)));
        let depth = depth.map(|(x, y)| if inside(x, y) { 1.0 + 0.0004 * (x - 60).abs() as f32 } else { f32::NAN });
        DepthCrop { left: 200, top: 260, width: 120, height: 100, depth: depth.collect() }.trimmed()
    }

    fn draws(kind: OccluderKind, hidden: [f64; 2], count: u64) -> Vec<Occluder> {
        let model = OccluderModel { kinds: vec![kind], share: 1.0, hidden };
        let (camera, object) = (camera(), disc());
        let mut rasteriser = Rasteriser::new(SimdLevel::detect());
        let mut draw = |index: u64| {
            model.draw(&mut rasteriser, &camera, &object, &mut Stream::of_job(index, b"", "occluder")).expect("one")
        };
        (0..count).map(&mut draw).collect()
    }

    #[test]
    fn the_hidden_share_is_the_one_drawn() {
        for kind in [OccluderKind::Neighbour, OccluderKind::HalfSpace] {
            let shares: Vec<f64> = draws(kind, [0.1, 0.5], 300).iter().map(Occluder::hidden_share).collect();
            // To a few pixels of some 2,300.
            assert!(shares.iter().all(|share| (0.097..=0.503).contains(share)), "{kind:?}: {shares:?}");
            let mean = shares.iter().sum::<f64>() / 300.0;
            // Uniform: mean 0.3, standard error 0.0067.
            assert!((mean - 0.3).abs() < 0.03, "{kind:?}: mean {mean}");
        }
    }

    #[test]
    fn occluders_stand_between_the_camera_and_the_object() {
        let whole = disc();
        for kind in [OccluderKind::Neighbour, OccluderKind::HalfSpace] {
            for occluder in draws(kind, [0.1, 0.5], 100) {
                assert!(occluder.nearest > 0.1, "{}", occluder.nearest);
                assert!(occluder.corners.iter().all(|corner| f64::from(corner[2]) < occluder.split));
                assert!(occluder.split < 1.0);
                assert!(occluder.corners.len() >= 6, "a solid");
                let seen = occluder.without_occluder(&occluder.scene(&camera(), &whole, 0));
                assert_eq!(seen.returns() as u32, occluder.object_pixels - occluder.hidden_pixels);
                for (column, row) in
                    (0..640).step_by(7).flat_map(|column| (0..480).step_by(7).map(move |row| (column, row)))
                {
                    let (front, object, left) =
                        (occluder.depth.at(column, row), whole.at(column, row), seen.at(column, row));
                    assert_eq!(left.is_nan(), object.is_nan() || !front.is_nan());
                }
            }
        }
    }

    #[test]
    fn levels_draw_the_same_bits() {
        let model = OccluderModel { kinds: vec![OccluderKind::Neighbour], share: 1.0, hidden: [0.2, 0.4] };
        let found: Vec<Vec<u32>> = SimdLevel::available()
            .map(|level| {
                let mut stream = Stream::of_job(3, b"", "occluder");
                let occluder = model.draw(&mut Rasteriser::new(level), &camera(), &disc(), &mut stream).expect("one");
                occluder.depth.depth.iter().map(|depth| depth.to_bits()).collect()
            })
            .collect();
        assert!(found.windows(2).all(|pair| pair[0] == pair[1]) && found[0].len() > 100);
    }

    #[test]
    fn crops_beside_each_other_are_put_together_with_nothing_between() {
        let crop = |left, top, depth| DepthCrop { left, top, width: 2, height: 1, depth: vec![depth, f32::NAN] };
        let (near, far) = (crop(10, 5, 1.0), crop(3, 8, 2.0));
        for (front, behind) in [(&near, &far), (&far, &near)] {
            let image = composed([3, 5, 12, 9], front, behind);
            assert_eq!((image.at(10, 5), image.at(3, 8), image.returns()), (1.0, 2.0, 2));
            // Crops outside of the part are left out, on each side of it.
            let part = composed([5, 5, 9, 9], front, behind);
            assert_eq!(part.returns(), 0);
        }
    }

    #[test]
    fn a_share_of_the_views_stays_free() {
        let model = OccluderModel { kinds: vec![OccluderKind::HalfSpace], share: 0.25, hidden: [0.0, 0.5] };
        let mut rasteriser = Rasteriser::new(SimdLevel::detect());
        let mut drawn = |seed: u64| {
            let mut stream = Stream::of_job(seed, b"", "occluder");
            model.draw(&mut rasteriser, &camera(), &disc(), &mut stream).is_some()
        };
        let count = (0..400).filter(|seed| drawn(*seed)).count();
        // Binomial: 100 with a standard deviation of 8.7.
        assert!((70..130).contains(&count), "{count} of 400");
        let nothing = DepthCrop::default();
        let mut stream = Stream::of_job(0, b"", "occluder");
        assert!(model.draw(&mut rasteriser, &camera(), &nothing, &mut stream).is_none());
    }
}
