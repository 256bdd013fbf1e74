//! Sheets of patches as in the thesis's figure 4.3: colours above depth, a column each for the palm and the fingertips.

use std::collections::BTreeMap;

use serde::Serialize;

use super::inspection::PatchSurvey;
use crate::{
    page::{ImageView, StripCard},
    picture::{DepthRange, Picture, depth_picture},
};
use format::{
    HeatmapPatch, PATCH_POINTS, POINT_NAMES, PatchColour,
    dataset::{DatasetError, DatasetReader},
};
use kernel::{
    geom::DepthCrop,
    ids::{ObjectId, SampleIndex},
};

/// Pixels of a picture for each of a patch.
const ZOOM: u32 = 2;

/// The card of a grasp: its patches.
#[derive(Serialize)]
pub(crate) struct CardView {
    pub object: String,
    r#type: u32,
    /// Index of the type among the chosen ones.
    type_index: u32,
    epsilon: String,
    energy: String,
    sample: String,
    run: String,
    rank: u32,
    panels: Vec<PanelView>,
}

/// One patch.
#[derive(Serialize)]
struct PanelView {
    image: ImageView,
    /// `depth` or `colours`.
    what: &'static str,
    /// The palm, or which fingertip.
    point: &'static str,
    /// The hand's name for it.
    name: String,
    /// Pixel of the image that the patch lies around.
    u: String,
    v: String,
}

impl PanelView {
    fn of(picture: Picture, patch: &HeatmapPatch, point: usize, what: &'static str) -> Self {
        let [u, v] = patch.points[point].pixel.map(|pixel| format!("{pixel:.1}"));
        let (width, height) = (picture.width, picture.height);
        Self {
            image: ImageView::of(&picture.with_few_colours(), width, height),
            what,
            point: POINT_NAMES[point],
            name: patch.points[point].name.clone(),
            u,
            v,
        }
    }
}

/// The best grasps of each type, of a few objects.
pub(crate) fn cards(reader: &DatasetReader, survey: &PatchSurvey) -> Result<Vec<CardView>, DatasetError> {
    let names: BTreeMap<ObjectId, &str> =
        survey.facts.objects.iter().map(|object| (object.object, object.name.as_str())).collect();
    let mut cards = Vec::new();
    for index in survey.picks.iter().flatten() {
        let Some(sample) = reader.sample(*index)? else { continue };
        let patch = sample.heatmap_patch()?;
        let name = names.get(&sample.id.subject).copied().unwrap_or("?");
        cards.push(CardView::of(*index, &patch, sample.patch_colour()?.as_ref(), name));
    }
    Ok(cards)
}

impl CardView {
    fn of(index: SampleIndex, patch: &HeatmapPatch, colour: Option<&PatchColour>, object: &str) -> Self {
        let range = range_of(patch);
        let colours = colour.into_iter().flat_map(|colour| {
            (0..PATCH_POINTS).map(|point| PanelView::of(enlarged(&in_colour(colour, point)), patch, point, "colours"))
        });
        let depths = (0..PATCH_POINTS)
            .map(|point| PanelView::of(depth_picture(&crop_of(patch, point), range, ZOOM), patch, point, "depth"));
        Self {
            object: object.to_owned(),
            r#type: patch.kind(),
            type_index: patch.type_index,
            epsilon: format!("{:.4}", patch.epsilon),
            energy: format!("{:.3}", patch.energy),
            sample: index.to_string(),
            run: patch.run.to_string(),
            rank: patch.rank,
            panels: colours.chain(depths).collect(),
        }
    }
}

impl CardView {
    /// The card as the strip on top of the page shows it.
    pub fn for_strip(&self) -> StripCard {
        let pictures = self.panels.iter().map(|panel| panel.image.clone());
        StripCard { caption: format!("{}, type {}", self.object, self.r#type), pictures: pictures.collect() }
    }
}

/// The patches of a grasp in one picture: palm and fingertips from left to right, in colour where there is any, else depth.
pub(crate) fn picture_of(patch: &HeatmapPatch, colour: Option<&PatchColour>) -> Picture {
    let range = range_of(patch);
    let of_point = |point: usize| {
        let picture = match colour {
            Some(colour) => enlarged(&in_colour(colour, point)),
            None => depth_picture(&crop_of(patch, point), range, ZOOM),
        };
        picture.framed()
    };
    let pictures: Vec<Picture> = (0..PATCH_POINTS).map(of_point).collect();
    Picture::row(&pictures, 4 * ZOOM).with_few_colours()
}

fn in_colour(colour: &PatchColour, point: usize) -> Picture {
    let pixels = colour.rgb_of(point).iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect();
    Picture { width: colour.side, height: colour.side, pixels }
}

fn crop_of(patch: &HeatmapPatch, point: usize) -> DepthCrop {
    let depth = patch.depth_of(point).to_vec();
    DepthCrop { left: 0, top: 0, width: patch.side, height: patch.side, depth }
}

/// The range of depth of all four patches, which share their scale.
fn range_of(patch: &HeatmapPatch) -> DepthRange {
    let (width, height) = (patch.side, 4 * patch.side);
    let whole = DepthCrop { left: 0, top: 0, width, height, depth: patch.depth.clone() };
    DepthRange::of(&whole).unwrap_or(DepthRange { near: 0.0, far: 1.0 })
}

fn enlarged(picture: &Picture) -> Picture {
    let mut large = Picture::filled(picture.width * ZOOM, picture.height * ZOOM, [0; 4]);
    for row in 0..picture.height {
        for column in 0..picture.width {
            let pixel = picture.at(column, row);
            large.fill(column * ZOOM..(column + 1) * ZOOM, row * ZOOM..(row + 1) * ZOOM, pixel);
        }
    }
    large
}

#[cfg(test)]
impl CardView {
    /// A card of one panel around a point of this name.
    pub fn example(object: &str, point: &str) -> Self {
        let panel = PanelView {
            image: ImageView::of(&Picture::filled(1, 1, [0; 4]), 1, 1),
            what: "depth",
            point: POINT_NAMES[0],
            name: point.to_owned(),
            u: "1.5".to_owned(),
            v: "2.5".to_owned(),
        };
        Self {
            object: object.to_owned(),
            r#type: 12,
            type_index: 0,
            epsilon: "0.1000".to_owned(),
            energy: "0.200".to_owned(),
            sample: "3".to_owned(),
            run: "4".to_owned(),
            rank: 5,
            panels: vec![panel],
        }
    }
}
