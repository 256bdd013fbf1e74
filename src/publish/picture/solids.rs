//! Solids as shaded pictures: robots' and hands' shapes, by one ray a subpixel.

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};

use super::{Colour, Oklab, Picture};
use kernel::geom::TouchShape;

/// Subpixels along each side of a pixel.
const FINE: u32 = 2;

/// A shape to draw.
pub struct Solid<'a> {
    /// The shape.
    pub shape: &'a TouchShape,
    /// Where it is in the world [m].
    pub pose: IsometryMatrix3<f64>,
    /// Colour in full light.
    pub colour: Colour,
}

/// Viewpoint of a picture of solids: from afar, z up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidView {
    /// Azimuth of the eye about z from the x axis [rad].
    pub azimuth: f64,
    /// Angle above the horizon [rad].
    pub elevation: f64,
    /// Point in the picture's middle [m].
    pub middle: Point3<f64>,
    /// Length of the world that a side of the picture shows [m].
    pub extent: f64,
}

impl SolidView {
    /// Unit vectors of the picture: towards the eye, to the right and up.
    fn axes(&self) -> (Unit<Vector3<f64>>, Vector3<f64>, Vector3<f64>) {
        let ((sa, ca), (se, ce)) = (libm::sincos(self.azimuth), libm::sincos(self.elevation));
        let to_eye = Unit::new_unchecked(Vector3::new(ca * ce, sa * ce, se));
        let right = Vector3::new(-sa, ca, 0.0);
        let up = to_eye.cross(&right);
        (to_eye, right, up)
    }

    /// Column and row at which a picture of `side` pixels shows a point of the world [m].
    pub fn pixel(&self, point: &Point3<f64>, side: u32) -> [f64; 2] {
        let (_, right, up) = self.axes();
        let (from_middle, side) = (point - self.middle, f64::from(side));
        let scale = side / self.extent;
        [side / 2.0 + from_middle.dot(&right) * scale, side / 2.0 - from_middle.dot(&up) * scale]
    }
}

/// A square picture of `side` pixels on a clear ground.
pub fn solid_picture(solids: &[Solid<'_>], view: &SolidView, side: u32) -> Picture {
    let (to_eye, right, up) = view.axes();
    let hits = first_hits(solids, view, side * FINE);
    let shade =
        |(solid, normal): (usize, Unit<Vector3<f64>>)| shaded(solids[solid].colour, &normal, &to_eye, &up, &right);
    let colours: Vec<Option<[u8; 3]>> = hits.map(|hit| hit.map(shade)).collect();
    smooth(&colours, side)
}

/// Pixels of a square picture of `side` pixels that see each of the solids.
pub fn seen_pixels(solids: &[Solid<'_>], view: &SolidView, side: u32) -> Vec<u32> {
    let mut counts = vec![0; solids.len()];
    first_hits(solids, view, side).flatten().for_each(|(solid, _)| counts[solid] += 1);
    counts
}

/// The index of the first solid in each pixel of a square picture of `side` pixels, and its outward normal there; row-major.
fn first_hits(
    solids: &[Solid<'_>],
    view: &SolidView,
    side: u32,
) -> impl Iterator<Item = Option<(usize, Unit<Vector3<f64>>)>> {
    let SolidView { middle, extent, .. } = *view;
    let (to_eye, right, up) = view.axes();
    let pixel = extent / f64::from(side);
    // Far enough that everything lies before the eye.
    let back = 4.0 * extent;
    let balls: Vec<(Point3<f64>, f64)> = solids.iter().map(|solid| solid.shape.ball(&solid.pose)).collect();
    (0..side * side).map(move |index| {
        let (column, row) = (index % side, index / side);
        let across = (f64::from(column) + 0.5) * pixel - extent / 2.0;
        let above = extent / 2.0 - (f64::from(row) + 0.5) * pixel;
        let from = middle + right * across + up * above + to_eye.into_inner() * back;
        let near = solids.iter().zip(&balls).enumerate().filter(|(_, (_, (centre, radius)))| {
            let off = centre - from;
            off.norm_squared() - off.dot(&to_eye).powi(2) <= radius * radius
        });
        let hits = near.filter_map(|(solid, (shape, _))| {
            let (far, normal) = shape.shape.first_hit(&shape.pose, &from, &-to_eye, 2.0 * back)?;
            Some((far, solid, normal))
        });
        hits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, solid, normal)| (solid, normal))
    })
}

/// Light from above the eye's left shoulder, and a little from everywhere.
fn shaded(
    colour: Colour,
    normal: &Vector3<f64>,
    to_eye: &Vector3<f64>,
    up: &Vector3<f64>,
    right: &Vector3<f64>,
) -> [u8; 3] {
    let light = (to_eye + up * 0.9 - right * 0.6).normalize();
    let full = colour.oklab();
    let share = 0.45 + 0.35 * normal.dot(&light).max(0.0) + 0.2 * normal.dot(to_eye).max(0.0);
    Oklab { lightness: full.lightness * share, a: full.a * share, b: full.b * share }.srgb().0
}

/// Means of the subpixels that something is in.
fn smooth(fine: &[Option<[u8; 3]>], side: u32) -> Picture {
    let mut picture = Picture::filled(side, side, [255, 255, 255, 0]);
    for (index, pixel) in picture.pixels.iter_mut().enumerate() {
        let (column, row) = (index as u32 % side * FINE, index as u32 / side * FINE);
        let subpixels = (0..FINE * FINE).map(|k| fine[((row + k / FINE) * side * FINE + column + k % FINE) as usize]);
        let (mut sum, mut count) = ([0_u32; 3], 0_u32);
        for colour in subpixels.flatten() {
            count += 1;
            sum.iter_mut().zip(colour).for_each(|(sum, channel)| *sum += u32::from(channel));
        }
        if count > 0 {
            let [r, g, b] = sum.map(|channel| (channel / count) as u8);
            *pixel = [r, g, b, (255 * count / (FINE * FINE)) as u8];
        }
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::geom::Shape;

    /// A ball of half the picture's width covers a circle, brightest towards the light; a nearer one hides it.
    #[test]
    fn a_ball_is_round_and_the_nearer_one_is_seen() {
        let ball = |radius| TouchShape::new(&Shape::Sphere { radius }).unwrap();
        let (large, small) = (ball(0.5), ball(0.1));
        let view = SolidView { azimuth: 0.0, elevation: 0.0, middle: Point3::origin(), extent: 2.0 };
        let solid = |shape, x, colour| {
            let pose = IsometryMatrix3::translation(x, 0.0, 0.0);
            Solid { shape, pose, colour }
        };
        let alone = solid_picture(&[solid(&large, 0.0, Colour::PARTIAL)], &view, 64);
        let covered = alone.pixels.iter().filter(|pixel| pixel[3] > 127).count() as f64;
        assert!((covered / (64.0 * 64.0) - std::f64::consts::PI / 16.0).abs() < 0.005, "{covered}");
        let brightness = |picture: &Picture, column, row| picture.at(column, row)[2];
        assert!(brightness(&alone, 27, 26) > brightness(&alone, 40, 42));
        for (x, seen) in [(0.6, Colour::COMPLETE), (-0.6, Colour::PARTIAL)] {
            let both = [solid(&large, 0.0, Colour::PARTIAL), solid(&small, x, Colour::COMPLETE)];
            let [r, _, b, _] = solid_picture(&both, &view, 64).at(32, 32);
            assert_eq!(r > b, seen == Colour::COMPLETE, "{x}");
            let [of_large, of_small] = seen_pixels(&both, &view, 64)[..] else { panic!("a count for each") };
            let of_large_alone = seen_pixels(&both[..1], &view, 64)[0];
            let hidden = if seen == Colour::COMPLETE { of_large_alone - of_large } else { 0 };
            assert!(f64::from(of_large_alone) / covered > 0.99 && of_small == hidden, "{of_large} {of_small}");
        }
    }

    /// A small ball is drawn about the pixel that its middle projects to.
    #[test]
    fn points_are_where_solids_are_drawn() {
        let ball = TouchShape::new(&Shape::Sphere { radius: 0.04 }).unwrap();
        let view = SolidView { azimuth: 0.7, elevation: 0.4, middle: Point3::new(0.1, 0.0, -0.2), extent: 2.0 };
        for at in [Point3::new(0.1, 0.0, -0.2), Point3::new(0.5, -0.3, 0.2), Point3::new(-0.4, 0.5, -0.6)] {
            let pose = IsometryMatrix3::translation(at.x, at.y, at.z);
            let picture = solid_picture(&[Solid { shape: &ball, pose, colour: Colour::PARTIAL }], &view, 200);
            let drawn: Vec<[f64; 2]> = (0..200 * 200_u32)
                .filter(|index| picture.pixels[*index as usize][3] == 255)
                .map(|index| [f64::from(index % 200) + 0.5, f64::from(index / 200) + 0.5])
                .collect();
            let found = view.pixel(&at, 200);
            for (axis, pixel) in found.into_iter().enumerate() {
                let mean = drawn.iter().map(|drawn| drawn[axis]).sum::<f64>() / drawn.len() as f64;
                assert!((mean - pixel).abs() < 0.5, "{at}: {mean} is not {pixel}");
            }
        }
    }
}
