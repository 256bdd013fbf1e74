//! Pictures of a pair in clutter: the visible cells of the body and of everything else, the whole body, and cuts through both.

use crate::{
    chart::percent,
    picture::{Eye, Panel, Picture, Slices, VoxelPainter, centre_of_mass},
    scene_samples::ScenePanel,
    touch_pictures::TouchPictures,
};
use format::{
    Clutter, Visibility, VoxelPair,
    dataset::{DatasetError, Sample},
};
use kernel::ids::ObjectId;

/// The pictures of a pair.
pub(super) struct PairPictures {
    /// Visible cells of the body and of everything else, from the camera's side.
    pub seen: Picture,
    /// All cells of the body, from the camera's side.
    pub whole: Picture,
    /// Cells of the body from behind.
    pub behind: Picture,
    /// Cuts, with solid cells around the body.
    pub slices: Slices,
    /// Touch, if there is any.
    pub touch: Option<TouchPictures>,
}

impl PairPictures {
    /// Draws a sample; each picture has `side` pixels along each side at most.
    pub fn of(sample: &Sample, side: u32) -> Result<(Self, VoxelPair, Clutter), DatasetError> {
        let (pair, clutter) = (sample.read::<VoxelPair>()?, sample.read::<Clutter>()?);
        let free = sample.find::<Visibility>()?.map(|visibility| visibility.free);
        let (partial, complete) = (&pair.partial, &pair.complete);
        let among = VoxelPainter::new(side, Eye::CameraSide, &[complete, partial, &clutter.others_seen]);
        let [front, behind] =
            [Eye::CameraSide, Eye::Behind].map(|eye| VoxelPainter::new(side, eye, &[complete, partial]));
        let zoom = (side / pair.grid.resolution).max(1);
        let grids = [partial, complete, &clutter.others_solid];
        let pictures = Self {
            seen: among.draw_among(partial, None, &clutter.others_seen).with_few_colours(),
            whole: front.draw(Some(partial), Some(complete)).with_few_colours(),
            behind: behind.draw(Some(partial), Some(complete)).with_few_colours(),
            slices: Slices::among(grids, free.as_ref(), centre_of_mass(complete), zoom),
            touch: sample.touched()?.map(|touched| TouchPictures::of(&touched, &behind)),
        };
        Ok((pictures, pair, clutter))
    }

    /// The pictures in one row.
    pub fn row(self, side: u32) -> Picture {
        let slice = self.slices.front.in_square(side);
        Picture::row(&[self.seen, self.whole, self.behind, slice], side / 20).with_few_colours()
    }

    /// The pictures as panels.
    pub fn panels(self) -> Vec<Panel> {
        let panel = |caption: &str, picture| Panel { caption: caption.to_owned(), picture };
        let mut panels = vec![
            panel("visible part", self.seen),
            panel("whole body", self.whole),
            panel("from behind", self.behind),
            panel("cut, others grey", self.slices.front),
        ];
        panels.extend(self.touch.map(|touch| panel("touch from behind", touch.points)));
        panels
    }
}

/// Side of each picture of a pair in the first picture of a set [px].
const SIDE: u32 = 400;

/// The pair in the first picture of a set: the visible cells of the body, and the whole body, at the same scale.
pub(super) fn pair_panel<'a>(
    sample: &Sample,
    name_of: impl Fn(ObjectId) -> &'a str,
) -> Result<ScenePanel, DatasetError> {
    let (VoxelPair { partial, complete, .. }, clutter) = (sample.read::<VoxelPair>()?, sample.read::<Clutter>()?);
    let painter = VoxelPainter::new(SIDE, Eye::CameraSide, &[&complete, &partial]);
    let caption = format!(
        "One amodal completion: {} of the silhouette of {} is visible (left, blue), and the whole body is known (right, hidden cells in orange).",
        percent(clutter.visible_share()),
        name_of(clutter.object),
    );
    let whole = [None, Some(&complete)];
    let pictures = whole.map(|complete| painter.draw(Some(&partial), complete).with_few_colours()).to_vec();
    Ok(ScenePanel { caption, pictures })
}
