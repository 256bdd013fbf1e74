//! Pictures of a scene from above: bodies in colours of their own, lighter where they are higher, and depth.

use crate::picture::{Colour, DepthRange, Oklab, Picture, depth_picture};
use format::{Scene, SceneOverview};
use kernel::geom::DepthCrop;

/// Step between the hues of two bodies, in turns: the golden section, so that few are alike.
const HUE_STEP: f64 = 0.618_033_988_749_895;

/// Lightness of the highest and the lowest point of a scene, and of the floor and the walls.
const LIGHTNESS: [f64; 2] = [0.82, 0.45];
const FLOOR: u8 = 244;
const WALLS: u8 = 205;

/// Edges between two bodies are darker by this.
const OUTLINE: f64 = 0.25;

/// Colour of a body at a lightness from 0 to 1.
fn colour(instance: u8, lightness: f64) -> Colour {
    let hue = std::f64::consts::TAU * (f64::from(instance) * HUE_STEP).fract();
    Oklab::from_hue(lightness, 0.13, hue).srgb()
}

/// The instance map from above, at a whole zoom.
pub(super) fn instance_picture(overview: &SceneOverview, zoom: u32) -> Picture {
    let [width, height] = overview.size;
    let at = |column: u32, row: u32| overview.instances[(row * width + column) as usize];
    let is_body = |instance: u8| instance != 0 && instance != SceneOverview::WALLS;
    let depths = || {
        let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
        pixels.filter(|(column, row)| is_body(at(*column, *row))).map(|(column, row)| overview.depth(column, row))
    };
    let (near, far) = (depths().fold(f32::INFINITY, f32::min), depths().fold(0.0, f32::max));
    let mut picture = Picture::filled(width * zoom, height * zoom, [FLOOR, FLOOR, FLOOR, 255]);
    for row in 0..height {
        for column in 0..width {
            let own = at(column, row);
            let pixel = match own {
                0 => continue,
                SceneOverview::WALLS => [WALLS, WALLS, WALLS, 255],
                body => {
                    let below = f64::from((overview.depth(column, row) - near) / (far - near).max(1e-3));
                    let [high, low] = LIGHTNESS;
                    let right = at((column + 1).min(width - 1), row);
                    let under = at(column, (row + 1).min(height - 1));
                    let edge = if right != own || under != own { OUTLINE } else { 0.0 };
                    colour(body, high + (low - high) * below - edge).opaque()
                }
            };
            picture.fill(column * zoom..(column + 1) * zoom, row * zoom..(row + 1) * zoom, pixel);
        }
    }
    picture
}

/// The depth from above.
pub(super) fn depth_from_above(overview: &SceneOverview, zoom: u32) -> Option<Picture> {
    let [width, height] = overview.size;
    let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    let depth = pixels.map(|(column, row)| overview.depth(column, row)).collect();
    let crop = DepthCrop { left: 0, top: 0, width, height, depth };
    DepthRange::of(&crop).map(|range| depth_picture(&crop, range, zoom))
}

/// One line about a scene: bodies, contacts, and the bodies that carry others.
pub(super) fn scene_words(scene: &Scene) -> String {
    let carriers: std::collections::BTreeSet<u32> =
        scene.supports.iter().map(|support| support.by).filter(|by| *by != format::CONTAINER).collect();
    let [bodies, contacts] = [scene.bodies.len(), scene.contacts.len()];
    format!(
        "{bodies} bodies, {contacts} contacts, {} of them carry others, at rest after {:.2} s",
        carriers.len(),
        scene.rest_time
    )
}
