//! Maps of instances as pictures: bodies in colours of their own, lighter where they are nearer.

use super::{Colour, Oklab, Picture};

/// Step between the hues of two bodies, in turns: the golden section, so that few are alike.
const HUE_STEP: f64 = 0.618_033_988_749_895;

/// Lightnesses of the bodies in turn, half way between near and far. Numbers whose hues are nearly alike differ by 5, 8 or 13: by no
/// multiple of three, so that their lightnesses differ.
const LIGHTNESSES: [f64; 3] = [0.66, 0.78, 0.52];

/// Lightness of the nearest point of the bodies over that of the farthest.
const NEARER: f64 = 0.2;

/// Edges between two bodies are darker by this.
const OUTLINE: f64 = 0.25;

/// Level of grey of the floor.
pub const FLOOR: u8 = 244;

/// Level of grey of walls.
pub const WALLS: u8 = 205;

/// A map of instances.
pub struct InstanceMap<'a> {
    /// Image width [px].
    pub width: u32,
    /// Image height [px].
    pub height: u32,
    /// Number of what each pixel sees. Shape (height, width), row-major.
    pub instances: &'a [u8],
    /// Depth of a pixel by column and row [m].
    pub depth: &'a dyn Fn(u32, u32) -> f32,
    /// Level of grey of a number that is no body's.
    pub grey: fn(u8) -> Option<u8>,
}

/// Colour of a body, lighter by `lighter` than half way between near and far.
fn body_colour(instance: u8, lighter: f64) -> Colour {
    let hue = std::f64::consts::TAU * (f64::from(instance) * HUE_STEP).fract();
    let lightness = LIGHTNESSES[usize::from(instance) % LIGHTNESSES.len()];
    Oklab::from_hue(lightness + lighter, 0.13, hue).srgb()
}

/// The colour by which a legend names a body, from 1.
pub fn body_swatch(instance: u8) -> Colour {
    body_colour(instance, 0.0)
}

impl InstanceMap<'_> {
    fn at(&self, column: u32, row: u32) -> u8 {
        self.instances[(row * self.width + column) as usize]
    }

    /// The map, each pixel as `zoom` x `zoom` pixels.
    pub fn picture(&self, zoom: u32) -> Picture {
        let Self { width, height, depth, grey, .. } = *self;
        let pixels = || (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
        let depths = || pixels().filter(|(x, y)| grey(self.at(*x, *y)).is_none()).map(|(x, y)| depth(x, y));
        let (near, far) = (depths().fold(f32::INFINITY, f32::min), depths().fold(0.0, f32::max));
        let mut picture = Picture::filled(width * zoom, height * zoom, [FLOOR, FLOOR, FLOOR, 255]);
        for (column, row) in pixels() {
            let own = self.at(column, row);
            let pixel = match grey(own) {
                Some(FLOOR) => continue,
                Some(level) => [level, level, level, 255],
                None => {
                    let own_depth = depth(column, row);
                    let below =
                        if own_depth.is_nan() { 0.5 } else { f64::from((own_depth - near) / (far - near).max(1e-3)) };
                    let right = self.at((column + 1).min(width - 1), row);
                    let under = self.at(column, (row + 1).min(height - 1));
                    let edge = if right != own || under != own { OUTLINE } else { 0.0 };
                    body_colour(own, NEARER * (0.5 - below) - edge).opaque()
                }
            };
            picture.fill(column * zoom..(column + 1) * zoom, row * zoom..(row + 1) * zoom, pixel);
        }
        picture
    }
}
