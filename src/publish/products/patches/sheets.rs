//! Sheets of patches as in the thesis's figure 4.3: colours above depth, one column for the palm and each fingertip.

use std::collections::BTreeMap;

use serde::Serialize;

use super::inspection::PatchSurvey;
use crate::{
    page::{ImageView, StripCard},
    picture::{DepthRange, Picture, depth_picture},
};
use format::{
    Channel, HeatmapPatch, PATCH_POINTS, POINT_NAMES, PatchColour, PatchMetric, PatchTrial, PatchVisibility,
    dataset::{DatasetError, DatasetReader, Sample},
};
use kernel::{
    geom::DepthCrop,
    ids::{ObjectId, SampleIndex},
};

/// Pixels of the picture per pixel of a patch.
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
    /// Label; `None` if labels do not come from trials.
    outcome: Option<&'static str>,
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
    /// Pixel of the image at the centre of the patch.
    u: String,
    v: String,
    /// Whether the surface in the image hides the point.
    hidden: bool,
}

/// The best grasps of each type, of a few objects.
pub(crate) fn cards(reader: &DatasetReader, survey: &PatchSurvey) -> Result<Vec<CardView>, DatasetError> {
    let names: BTreeMap<ObjectId, &str> =
        survey.facts.objects.iter().map(|object| (object.object, object.name.as_str())).collect();
    let mut cards = Vec::new();
    for index in survey.picks.iter().flatten() {
        let Some(sample) = reader.sample(*index)? else { continue };
        let name = names.get(&sample.id.subject).copied().unwrap_or("?");
        cards.push(CardView::of(*index, &PatchSheet::of(&sample)?, name));
    }
    Ok(cards)
}

/// Patches of one grasp: those of one size in metres if stored, else those in pixels of the image.
pub(super) struct PatchSheet {
    patch: HeatmapPatch,
    side: u32,
    /// Depth of the patches. Shape (points, side, side), row-major.
    depth: Vec<f32>,
    colour: Option<PatchColour>,
    trial: Option<PatchTrial>,
    visibility: Option<PatchVisibility>,
}

impl PatchSheet {
    /// Reads a sample.
    pub fn of(sample: &Sample) -> Result<Self, DatasetError> {
        let patch = sample.read::<HeatmapPatch>()?;
        let (trial, visibility) = (sample.find::<PatchTrial>()?, sample.find::<PatchVisibility>()?);
        let (side, depth, colour) = match sample.find::<PatchMetric>()? {
            Some(metric) => (metric.side, metric.depth, sample.find_at::<PatchColour>(Channel::PATCH_METRIC_COLOUR)?),
            None => (patch.side, patch.depth.clone(), sample.find::<PatchColour>()?),
        };
        Ok(Self { patch, side, depth, colour, trial, visibility })
    }

    /// Type of the grasp.
    pub fn kind(&self) -> u32 {
        self.patch.kind()
    }

    /// The patches in one picture: palm and fingertips from left to right, in colour if stored, else depth.
    pub fn picture(&self) -> Picture {
        let pictures =
            (0..PATCH_POINTS).map(|point| self.in_colour(point).unwrap_or_else(|| self.in_depth(point)).framed());
        Picture::row(&pictures.collect::<Vec<_>>(), 4 * ZOOM).with_few_colours()
    }

    fn in_colour(&self, point: usize) -> Option<Picture> {
        let colour = self.colour.as_ref()?;
        let pixels = colour.rgb_of(point).iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect();
        Some(enlarged(&Picture { width: colour.side, height: colour.side, pixels }))
    }

    fn in_depth(&self, point: usize) -> Picture {
        let pixels = (self.side * self.side) as usize;
        let depth = self.depth[point * pixels..(point + 1) * pixels].to_vec();
        let crop = DepthCrop { left: 0, top: 0, width: self.side, height: self.side, depth };
        depth_picture(&crop, self.range(), ZOOM)
    }

    /// The range of depth of all four patches, which share their scale.
    fn range(&self) -> DepthRange {
        let (width, height) = (self.side, 4 * self.side);
        let whole = DepthCrop { left: 0, top: 0, width, height, depth: self.depth.clone() };
        DepthRange::from_crop(&whole).unwrap_or(DepthRange { near: 0.0, far: 1.0 })
    }

    fn panel(&self, point: usize, picture: Picture, what: &'static str) -> PanelView {
        let [u, v] = self.patch.points[point].pixel.map(|pixel| format!("{pixel:.1}"));
        let (width, height) = (picture.width, picture.height);
        PanelView {
            image: ImageView::of(&picture.with_few_colours(), width, height),
            what,
            point: POINT_NAMES[point],
            name: self.patch.points[point].name.clone(),
            u,
            v,
            hidden: self.visibility.as_ref().is_some_and(|visibility| !visibility.visible[point]),
        }
    }
}

impl CardView {
    fn of(index: SampleIndex, sheet: &PatchSheet, object: &str) -> Self {
        let patch = &sheet.patch;
        let colours =
            (0..PATCH_POINTS).filter_map(|point| Some(sheet.panel(point, sheet.in_colour(point)?, "colours")));
        let depths = (0..PATCH_POINTS).map(|point| sheet.panel(point, sheet.in_depth(point), "depth"));
        Self {
            object: object.to_owned(),
            r#type: patch.kind(),
            type_index: patch.type_index,
            epsilon: format!("{:.4}", patch.epsilon),
            energy: format!("{:.3}", patch.energy),
            outcome: sheet.trial.as_ref().map(|trial| trial.outcome.name()),
            sample: index.to_string(),
            run: patch.run.to_string(),
            rank: patch.rank,
            panels: colours.chain(depths).collect(),
        }
    }
}

impl CardView {
    /// The card in the strip at the top of the page.
    pub fn for_strip(&self) -> StripCard {
        let pictures = self.panels.iter().map(|panel| panel.image.clone());
        StripCard { caption: format!("{}, type {}", self.object, self.r#type), pictures: pictures.collect() }
    }
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
            hidden: false,
        };
        Self {
            object: object.to_owned(),
            r#type: 12,
            type_index: 0,
            epsilon: "0.1000".to_owned(),
            energy: "0.200".to_owned(),
            outcome: Some("held"),
            sample: "3".to_owned(),
            run: "4".to_owned(),
            rank: 5,
            panels: vec![panel],
        }
    }
}
