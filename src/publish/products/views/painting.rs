//! Pictures of a view: the body at each pixel, depth, and colours.

use crate::{
    picture::{DepthRange, FLOOR, InstanceMap, Picture, WALLS, depth_picture},
    scene_samples::ScenePanel,
};
use format::{Depth, SceneColour, SceneContainer, SceneImage};
use kernel::{geom::DepthCrop, words::counted};

/// An image of every `step`-th pixel.
fn thinned<T: Copy>(pixels: &[T], width: u32, step: u32) -> Vec<T> {
    let rows = pixels.chunks_exact(width as usize).step_by(step as usize);
    rows.flat_map(|row| row.iter().copied().step_by(step as usize)).collect()
}

/// Stride of the drawn pixels so that a picture has at most this side.
pub(super) fn step_for(image: &SceneImage, side: u32) -> u32 {
    image.camera.width.max(image.camera.height).div_ceil(side.max(1)).max(1)
}

/// The body at each pixel; every `step`-th pixel.
pub(super) fn instance_picture(image: &SceneImage, depth: &Depth, step: u32) -> Picture {
    let (width, height) = (image.camera.width.div_ceil(step), image.camera.height.div_ceil(step));
    let grey = |instance| match instance {
        SceneImage::NOTHING | SceneImage::TABLE => Some(FLOOR),
        SceneImage::CONTAINER => Some(WALLS),
        _ => None,
    };
    let instances = thinned(&image.instances, image.camera.width, step);
    let depth = |column: u32, row: u32| depth.crop.at(column * step, row * step);
    InstanceMap { width, height, instances: &instances, depth: &depth, grey }.picture(1)
}

/// Depth as the sensor measured it, in colours that span the bodies; `None` without a return.
pub(super) fn depth_of_view(image: &SceneImage, depth: &Depth, step: u32) -> Option<Picture> {
    let (width, height) = (image.camera.width.div_ceil(step), image.camera.height.div_ceil(step));
    let at = |row: u32, column: u32| depth.crop.at(column * step, row * step);
    let depth = (0..height).flat_map(|row| (0..width).map(move |column| at(row, column))).collect();
    let crop = DepthCrop { left: 0, top: 0, width, height, depth };
    // Container and table extend far beyond the bodies and would use up most of the colours.
    let is_body = |instance: u8| (1..=SceneImage::MAX_BODIES).contains(&usize::from(instance));
    let instances = thinned(&image.instances, image.camera.width, step);
    let of_bodies = crop.depth.iter().zip(instances).map(|(depth, own)| if is_body(own) { *depth } else { f32::NAN });
    let of_bodies = DepthCrop { depth: of_bodies.collect(), ..crop };
    DepthRange::from_crop(&of_bodies)
        .or_else(|| DepthRange::from_crop(&crop))
        .map(|range| depth_picture(&crop, range, 1))
}

/// Colours of a view; every `step`-th pixel.
pub(super) fn colour_picture(colour: &SceneColour, step: u32) -> Picture {
    let pixels = thinned(&colour.rgb, colour.width, step).into_iter().map(|[red, green, blue]| [red, green, blue, 255]);
    Picture { width: colour.width.div_ceil(step), height: colour.height.div_ceil(step), pixels: pixels.collect() }
}

/// One line about a view.
pub(super) fn view_words(image: &SceneImage) -> String {
    let seen = image.bodies.iter().filter(|body| body.pixels_visible > 0).count();
    let truncated = image.bodies.iter().filter(|body| body.is_truncated()).count();
    format!("{seen} of {} bodies are visible, {truncated} extend beyond the image", image.bodies.len())
}

/// Longest side of the pictures of a view in the first picture of a set [px].
const SIDE: u32 = 640;

/// The view in the first picture of a set: its depth, the body at each pixel, and its colours if it has any.
pub(super) fn view_panels(image: &SceneImage, depth: &Depth, colour: Option<&SceneColour>) -> Vec<ScenePanel> {
    let step = step_for(image, SIDE);
    let bodies = counted(image.bodies.len() as u64, "body");
    let seen = image.bodies.iter().filter(|body| body.pixels_visible > 0).count();
    let held_by = match image.container {
        SceneContainer::Bin { .. } => "in a bin",
        SceneContainer::Mesh { .. } => "in a container",
        SceneContainer::Plane { .. } => "on a plane",
    };
    let by = if image.point_instances.is_some() { "as a depth camera measures them" } else { "as a camera sees them" };
    let of_depth = depth_of_view(image, depth, step).map(|picture| ScenePanel {
        caption: format!("{bodies} {held_by}, {by}: near is light and far is dark."),
        pictures: vec![picture.with_few_colours()],
    });
    let of_bodies = ScenePanel {
        caption: format!(
            "The instance map of this view: each body has its own colour, and {seen} of {} are visible.",
            image.bodies.len()
        ),
        pictures: vec![instance_picture(image, depth, step).with_few_colours()],
    };
    let of_colour = colour.map(|colour| ScenePanel {
        caption: "The same view in colour.".to_owned(),
        pictures: vec![colour_picture(colour, step).with_few_colours()],
    });
    of_depth.into_iter().chain([of_bodies]).chain(of_colour).collect()
}
