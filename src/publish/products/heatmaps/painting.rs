//! Pictures of a heatmap of a scene: the points of its grasps over the depth of the image, and the patches of one grasp.

use crate::{
    pick_colours::state_colour,
    picture::{Colour, DepthRange, Picture, depth_picture, grey_depth_picture},
    scene_samples::ScenePanel,
};
use format::{Depth, HeatmapFacts, PatchSquare, PickState, SceneHeatmap, SeenGrasp, window_pixel};
use kernel::{geom::DepthCrop, words::counted};

/// Radius of the dots of palms, fingertips and forbidden palms [px].
const RADII: [f64; 3] = [6.0, 4.0, 2.5];

/// Colour of the dots of forbidden grasps.
const FORBIDDEN: Colour = Colour([0x30, 0x30, 0x34]);

/// Longest side of the picture of an image in the first picture of a set [px].
const SIDE: u32 = 640;

/// Pixels of the picture per pixel of a patch.
const ZOOM: u32 = 2;

/// Range of most depths in an image: a table extends far beyond the bodies and would use up most shades.
fn range_of(depth: &DepthCrop) -> DepthRange {
    let mut returns: Vec<f32> = depth.depth.iter().copied().filter(|depth| depth.is_finite()).collect();
    returns.sort_by(f32::total_cmp);
    let at = |share: f64| returns.get((share * returns.len() as f64) as usize).map_or(1.0, |depth| f64::from(*depth));
    DepthRange { near: at(0.0), far: at(0.9) }
}

/// Draws the points of all grasps over the depth of the image: forbidden ones first, those that held last, without hidden points.
/// Pixels are skipped evenly, so that the picture is at most `side` pixels wide and high.
pub(super) fn marked_picture(heatmap: &SceneHeatmap, depth: &Depth, side: u32) -> Picture {
    let (columns, rows) = (heatmap.camera.width, heatmap.camera.height);
    let step = columns.max(rows).div_ceil(side.max(1)).max(1);
    let (width, height) = (columns.div_ceil(step), rows.div_ceil(step));
    let at = |row: u32, column: u32| depth.crop.at(column * step, row * step);
    let depths = (0..height).flat_map(|row| (0..width).map(move |column| at(row, column))).collect();
    let thinned = DepthCrop { left: 0, top: 0, width, height, depth: depths };
    let mut picture = grey_depth_picture(&thinned, range_of(&thinned));
    let [palm, tip, small] = RADII;
    let place = |pixel: Option<[f64; 2]>| pixel.unwrap_or_default().map(|value| value / f64::from(step));
    for grasp in heatmap.forbidden.iter().filter(|grasp| grasp.pixel_in(&heatmap.camera).is_some()) {
        picture.dot(place(grasp.pixel), small, FORBIDDEN);
    }
    for state in [PickState::Untried, PickState::Failed, PickState::Held] {
        for grasp in heatmap.grasps.iter().filter(|grasp| grasp.state == state) {
            for (index, point) in grasp.points.iter().enumerate().filter(|(_, point)| point.visible) {
                let radius = if index == 0 { palm } else { tip };
                picture.dot(place(point.pixel), radius, state_colour(state));
            }
        }
    }
    picture
}

/// The grasp whose patches the page shows: the first that held, else the first with patches.
fn shown_grasp(heatmap: &SceneHeatmap) -> Option<&SeenGrasp> {
    let with_patches = || heatmap.grasps.iter().filter(|grasp| !grasp.patches.is_empty());
    with_patches().find(|grasp| grasp.state == PickState::Held).or_else(|| with_patches().next())
}

/// The patches of one grasp in depth, palm and fingertips from left to right; `None` if no grasp has patches.
pub(super) fn patches_picture(heatmap: &SceneHeatmap, depth: &Depth) -> Option<Picture> {
    let grasp = shown_grasp(heatmap)?;
    let side = heatmap.side;
    let patch = |square: &PatchSquare| {
        let pixels = (0..side).flat_map(|row| (0..side).map(move |column| [column, row]));
        let at = |[column, row]: [u32; 2]| match square.window {
            0 => depth.crop.at(square.corner[0] + column, square.corner[1] + row),
            window => depth.crop.at(
                square.window_corner[0] + window_pixel(column, window, side),
                square.window_corner[1] + window_pixel(row, window, side),
            ),
        };
        DepthCrop { left: 0, top: 0, width: side, height: side, depth: pixels.map(at).collect() }
    };
    let patches: Vec<DepthCrop> = grasp.patches.iter().map(patch).collect();
    let depth: Vec<f32> = patches.iter().flat_map(|patch| patch.depth.iter().copied()).collect();
    let all = DepthCrop { left: 0, top: 0, width: side, height: side * patches.len() as u32, depth };
    let range = DepthRange::from_crop(&all).unwrap_or(DepthRange { near: 0.0, far: 1.0 });
    let pictures: Vec<Picture> = patches.iter().map(|patch| depth_picture(patch, range, ZOOM).framed()).collect();
    Some(Picture::row(&pictures, 4 * ZOOM).with_few_colours())
}

/// One line about an image.
pub(super) fn heatmap_words(heatmap: &SceneHeatmap) -> String {
    let facts = HeatmapFacts::from_heatmap(heatmap);
    let [untried, held, failed] = facts.states;
    let forbidden: u64 = facts.forbidden.iter().map(|count| u64::from(*count)).sum();
    format!(
        "{held} grasps held, {failed} failed, {untried} untried, {forbidden} forbidden · {} of {} points visible · patches of {}",
        facts.visible_points, facts.points, facts.patches
    )
}

/// The image in the first picture of a set.
pub(super) fn heatmap_panel(heatmap: &SceneHeatmap, depth: &Depth) -> ScenePanel {
    let facts = HeatmapFacts::from_heatmap(heatmap);
    let [untried, held, failed] = facts.states;
    let grasps = counted(u64::from(facts.grasps()), "free grasp");
    ScenePanel {
        caption: format!(
            "Palms and fingertips of {grasps} of {} in this view, over its depth: {held} held in simulation (green), {failed} failed \
             (red), {untried} are untried (blue).",
            heatmap.hand
        ),
        pictures: vec![marked_picture(heatmap, depth, SIDE).with_few_colours()],
    }
}
