//! One sample of the gallery.

use std::fmt::Write as _;

use serde::Serialize;

use super::gallery::Pick;
use crate::{
    chart::{percent, round_step},
    markup::Markup,
    page::{ImageView, StripCard},
    picture::{
        DepthRange, Eye, Panel, Picture, Slices, VoxelPainter, centre_of_mass, colour_bar, depth_picture, height_map,
    },
    touch_pictures::{TouchPictures, touch_points},
};
use format::{
    Depth, Visibility, VoxelPair,
    dataset::{DatasetError, Sample},
};
use kernel::{geom::DepthCrop, words::Split};

/// Side of a picture [px]: twice its size on the page, so that it is sharp on high-resolution screens.
const SIDE: u32 = 400;
/// Side of a picture on the page [px].
const SHOWN_SIDE: u32 = 200;

/// Name of the panel with touch on the whole solid.
const TOUCH_POINTS: &str = "Touch points, from behind";
/// Name of the panel with both grids, as the camera's side sees them.
const BOTH: &str = "Both, from the camera's side";

/// The card of a sample: pictures and numbers.
#[derive(Serialize)]
pub(crate) struct CardView {
    pub object: String,
    view: String,
    why: String,
    split: String,
    sample: String,
    /// Occupied cells.
    partial: u32,
    complete: u32,
    /// Partial cells over complete cells.
    share: String,
    /// Share of the solid inside the grid.
    inside: String,
    /// Side of a cell [mm].
    cell: String,
    depth: DepthView,
    panels: Vec<PanelView>,
}

/// Depth in colour; without a drawing where nothing returned.
#[derive(Serialize)]
struct DepthView {
    drawing: Option<Markup>,
    caption: &'static str,
}

/// A picture with its name.
#[derive(Serialize)]
struct PanelView {
    image: ImageView,
    name: &'static str,
    hint: String,
}

impl PanelView {
    fn new(picture: &Picture, name: &'static str, hint: impl Into<String>) -> Self {
        Self { image: ImageView::of(picture, SHOWN_SIDE, SHOWN_SIDE), name, hint: hint.into() }
    }
}

impl CardView {
    /// Draws a sample.
    pub fn of(sample: &Sample, pick: &Pick, object: &str, split: Option<Split>) -> Result<Self, DatasetError> {
        let pair = sample.read::<VoxelPair>()?;
        let (depth, kind) = match sample.find::<Depth>()? {
            Some(depth) => (depth.crop, DepthKind::Camera),
            None => (height_map(&pair.partial, &pair.grid), DepthKind::Cells),
        };
        let drawing = depth_drawing(&depth, &pair, kind);
        Ok(Self {
            object: object.to_owned(),
            view: pair.sample.item.to_string(),
            why: pick.why.clone(),
            split: split.map_or_else(String::new, |split| split.name().replace('_', " ")),
            sample: pick.index.to_string(),
            partial: pair.partial_cells,
            complete: pair.complete_cells,
            share: percent(f64::from(pair.partial_cells) / f64::from(pair.complete_cells.max(1))),
            inside: percent(pair.solid_share),
            cell: format!("{:.2}", pair.grid.cell_size * 1e3),
            depth: DepthView { drawing, caption: kind.caption() },
            panels: panels(sample, &pair)?,
        })
    }

    /// The card in the strip at the top of the page: touch on the solid if there is any, else both grids.
    pub fn for_strip(&self) -> StripCard {
        let named = |name: &str| self.panels.iter().find(|panel| panel.name == name);
        let panel = named(TOUCH_POINTS).or_else(|| named(BOTH));
        StripCard {
            caption: format!("{}, view {}", self.object, self.view),
            pictures: panel.map(|panel| panel.image.clone()).into_iter().collect(),
        }
    }
}

/// Grids from two sides, touch if there is any, and slices.
fn panels(sample: &Sample, pair: &VoxelPair) -> Result<Vec<PanelView>, DatasetError> {
    let free = sample.find::<Visibility>()?.map(|visibility| visibility.free);
    let (partial, complete) = (&pair.partial, &pair.complete);
    let front = VoxelPainter::new(SIDE, Eye::CameraSide, &[complete, partial]);
    let behind = VoxelPainter::new(SIDE, Eye::Behind, &[complete, partial]);
    let grids = [
        (front.draw(Some(partial), None), "Partial", "observed by the camera"),
        (front.draw(None, Some(complete)), "Complete", "the whole solid"),
        (front.draw(Some(partial), Some(complete)), BOTH, "blue on orange"),
        (behind.draw(Some(partial), Some(complete)), "Both, from behind", "orange was hidden"),
    ];
    let grids = grids.map(|(picture, name, hint)| PanelView::new(&picture.with_few_colours(), name, hint));
    let mut panels = Vec::from(grids);
    if let Some(touched) = sample.touched()? {
        let TouchPictures { cells, cells_hint, points, points_hint } = TouchPictures::of(&touched, &behind);
        panels.extend([
            PanelView::new(&cells, "Partial and touch, from behind", cells_hint),
            PanelView::new(&points, TOUCH_POINTS, points_hint),
        ]);
    }
    let zoom = (SIDE / pair.grid.resolution).max(1);
    let slices = Slices::new(partial, complete, free.as_ref(), centre_of_mass(complete), zoom);
    panels.extend([
        PanelView::new(&slices.front, "Slice across the view", "x right, y down"),
        PanelView::new(&slices.side, "Slice from the side", "z right, y down"),
        PanelView::new(&slices.top, "Slice from above", "x right, z up"),
    ]);
    Ok(panels)
}

/// A sample in one picture of four: depth, partial, complete, and both from behind; each `side` pixels wide and high.
pub(crate) fn picture_of(sample: &Sample, side: u32) -> Result<Picture, DatasetError> {
    let pair = sample.read::<VoxelPair>()?;
    let crop =
        sample.find::<Depth>()?.map_or_else(|| height_map(&pair.partial, &pair.grid), |depth| depth.crop).trimmed();
    let depth = DepthRange::from_crop(&crop).map(|range| {
        let zoom = (side / crop.width.max(crop.height).max(1)).max(1);
        depth_picture(&crop, range, zoom).in_square(side)
    });
    let (partial, complete) = (&pair.partial, &pair.complete);
    let front = VoxelPainter::new(side, Eye::CameraSide, &[complete, partial]);
    let behind = VoxelPainter::new(side, Eye::Behind, &[complete, partial]);
    let grids =
        [front.draw(Some(partial), None), front.draw(None, Some(complete)), behind.draw(Some(partial), Some(complete))];
    let pictures: Vec<Picture> = depth.into_iter().chain(grids).collect();
    Ok(Picture::row(&pictures, side / 20).with_few_colours())
}

/// A sample in panels: the depth image, the observed cells, the whole object, and touch from behind if there is any.
pub(crate) fn sample_panels(sample: &Sample, side: u32) -> Result<Vec<Panel>, DatasetError> {
    let pair = sample.read::<VoxelPair>()?;
    let (partial, complete) = (&pair.partial, &pair.complete);
    let mut panels = Vec::new();
    if let Some(depth) = sample.find::<Depth>()? {
        let crop = depth.crop.trimmed();
        panels.extend(DepthRange::from_crop(&crop).map(|range| {
            let zoom = (side / crop.width.max(crop.height).max(1)).max(1);
            Panel { caption: "depth image".to_owned(), picture: depth_picture(&crop, range, zoom) }
        }));
    }
    let [front, behind] = [Eye::CameraSide, Eye::Behind].map(|eye| VoxelPainter::new(side, eye, &[complete, partial]));
    panels.extend([
        Panel { caption: "what it saw".to_owned(), picture: front.draw(Some(partial), None) },
        Panel { caption: "whole object".to_owned(), picture: front.draw(None, Some(complete)) },
    ]);
    if let Some(touched) = sample.touched()? {
        panels.push(Panel { caption: "touch from behind".to_owned(), picture: touch_points(&touched, &behind) });
    }
    Ok(panels)
}

/// Source of the depth on a card.
#[derive(Clone, Copy, PartialEq, Eq)]
enum DepthKind {
    /// The stored crop.
    Camera,
    /// The nearest occupied cells, if no crop was stored.
    Cells,
}

impl DepthKind {
    fn caption(self) -> &'static str {
        match self {
            Self::Camera => "Depth",
            Self::Cells => "Depth of the partial cells",
        }
    }
}

/// Depth in colour with a scale of depth [m] and one of length across the view; `None` if nothing returned.
fn depth_drawing(crop: &DepthCrop, pair: &VoxelPair, kind: DepthKind) -> Option<Markup> {
    const BOX: (f64, f64) = (134.0, 160.0);
    let range = DepthRange::from_crop(crop)?;
    let crop = &crop.trimmed();
    let zoom = (SIDE / crop.width.max(crop.height).max(1)).clamp(1, 10);
    let picture = depth_picture(crop, range, zoom);
    let (width, height) = (f64::from(crop.width), f64::from(crop.height));
    let scale = (BOX.0 / width).min(BOX.1 / height);
    let (w, h) = (width * scale, height * scale);
    let (left, top) = ((BOX.0 - w) / 2.0 + 2.0, (BOX.1 - h) / 2.0 + 4.0);
    let metres_a_pixel = match kind {
        DepthKind::Camera => (range.near + range.far) / 2.0 / pair.camera.fx,
        DepthKind::Cells => pair.grid.cell_size,
    };
    let metres = round_step(w / scale * metres_a_pixel * 0.2);
    let length = metres / metres_a_pixel * scale;
    let digits = if range.far - range.near < 0.02 && range.far < 10.0 { 4 } else { 3 };
    let mut svg = format!(
        r#"<svg class="depth" viewBox="0 0 200 200" role="img" aria-label="depth from {0:.3} to {1:.3} m"><title>depth from {0:.3} to {1:.3} m</title>"#,
        range.near, range.far
    );
    let _ = write!(
        svg,
        r#"<image x="{left:.1}" y="{top:.1}" width="{w:.1}" height="{h:.1}" preserveAspectRatio="none" href="{}"/>"#,
        picture.to_data_uri()
    );
    let number = |share: f64| format!("{:.digits$}", range.near + (range.far - range.near) * share);
    if number(0.0) == number(1.0) {
        // A flat face across the view has one depth and one colour.
        let _ = write!(svg, r#"<text x="146" y="89">{}</text>"#, number(0.5));
    } else {
        let bar = colour_bar(1, 64).to_data_uri();
        let _ =
            write!(svg, r#"<image x="142" y="20" width="9" height="130" preserveAspectRatio="none" href="{bar}"/>"#);
        for (share, y) in [(0.0, 27), (0.5, 89), (1.0, 151)] {
            let _ = write!(svg, r#"<text x="154" y="{y}">{}</text>"#, number(share));
        }
    }
    svg.push_str(r#"<text class="quiet" x="200" y="11" text-anchor="end">depth [m]</text>"#);
    let _ = write!(
        svg,
        r#"<path class="ruler" d="M{0:.1} 178v5h{length:.1}v-5"/><text x="{1:.1}" y="196" text-anchor="middle">{2}</text></svg>"#,
        left + (w - length) / 2.0,
        left + w / 2.0,
        length_in_words(metres),
    );
    Some(Markup(svg))
}

fn length_in_words(metres: f64) -> String {
    match metres {
        _ if metres >= 1.0 => format!("{metres:.0} m"),
        _ if metres >= 0.01 => format!("{:.0} cm", metres * 100.0),
        _ => format!("{:.0} mm", metres * 1000.0),
    }
}

#[cfg(test)]
impl CardView {
    /// A card of one panel; depth is drawn where something returned.
    pub fn example(object: &str, returned: bool) -> Self {
        let picture = Picture::filled(1, 1, [0; 4]);
        Self {
            object: object.to_owned(),
            view: "3".to_owned(),
            why: "fewest observed cells".to_owned(),
            split: "training".to_owned(),
            sample: "7".to_owned(),
            partial: 5,
            complete: 9,
            share: percent(5.0 / 9.0),
            inside: percent(1.0),
            cell: "3.20".to_owned(),
            depth: DepthView { drawing: returned.then(|| Markup("<svg></svg>".to_owned())), caption: "Depth" },
            panels: vec![PanelView::new(&picture, BOTH, "blue on orange")],
        }
    }
}
