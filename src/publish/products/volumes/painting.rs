//! Pictures of a volume: the observed surface, the true bodies, and cuts through distances and truth.

use crate::{
    pick_colours::state_colour,
    picture::{Colour, Eye, FLOOR, InstanceMap, Panel, Picture, SLICE_COLOURS, VoxelPainter, WALLS},
};
use format::{
    PickState, SceneVolume, VolumeAffordance, VolumeTruth,
    dataset::{DatasetError, Sample},
};
use kernel::geom::OccupancyGrid;

/// The pictures of a volume.
pub(super) struct VolumePictures {
    /// Voxels at the fused surface.
    pub seen: Picture,
    /// Voxels inside the bodies, without the container, which would hide them.
    pub truth: Picture,
    /// Cut through the distances from the side: x to the right, z up.
    pub side: Picture,
    /// Cut through the truth at the same place.
    pub true_side: Picture,
    /// Cut through the distances from above: x to the right, y up.
    pub top: Picture,
    /// Cut through the truth at the same place.
    pub true_top: Picture,
    /// The centres of all free grasps over that cut; `None` if the dataset has none.
    pub grasps: Option<Picture>,
}

/// Radius of the dot of a grasp [px].
const DOT: f64 = 5.0;

/// Distance of a voxel's centre up to which the fused surface passes through it [edges of a voxel]: half of its diagonal.
const REACH: f64 = 0.87;

impl VolumePictures {
    /// Draws a sample; each picture has `side` pixels along each side at most.
    pub fn of(sample: &Sample, side: u32) -> Result<(Self, SceneVolume, VolumeTruth), DatasetError> {
        let (volume, truth) = (sample.read::<SceneVolume>()?, sample.read::<VolumeTruth>()?);
        let n = volume.grid.resolution;
        let index = |[x, y, z]: [u32; 3]| ((x * n + y) * n + z) as usize;
        let reach = REACH * volume.grid.voxel() / volume.truncation;
        let surface = upright(n, |voxel| {
            let index = index(voxel);
            volume.weights[index] > 0 && volume.value(index).abs() <= reach
        });
        let bodies = upright(n, |voxel| VolumeTruth::is_body(truth.instances[index(voxel)]));
        let painter = VoxelPainter::new(side, Eye::CameraSide, &[&surface, &bodies]);
        // At the mean of the voxels of the bodies.
        let [_, y, z] = middle(n, |voxel| VolumeTruth::is_body(truth.instances[index(voxel)]));
        let zoom = (side / n).max(1);
        let distance = |voxel: [u32; 3]| distance_colour(&volume, index(voxel));
        let own = |voxel: [u32; 3]| truth.instances[index(voxel)];
        let true_top = instances(n, zoom, |right, up| own([right, up, z]));
        let grasps = sample.find::<VolumeAffordance>()?.map(|affordance| with_grasps(&true_top, &affordance));
        let pictures = Self {
            seen: painter.draw(Some(&surface), None).with_few_colours(),
            truth: painter.draw(None, Some(&bodies)).with_few_colours(),
            side: cut(n, zoom, |right, up| distance([right, y, up])),
            true_side: instances(n, zoom, |right, up| own([right, y, up])),
            top: cut(n, zoom, |right, up| distance([right, up, z])),
            true_top,
            grasps,
        };
        Ok((pictures, volume, truth))
    }

    /// The pictures in one row.
    pub fn row(self, side: u32) -> Picture {
        let [cut, truth] = [self.side, self.true_side].map(|picture| picture.in_square(side));
        Picture::row(&[self.seen, self.truth, cut, truth], side / 20).with_few_colours()
    }

    /// The pictures as panels.
    pub fn panels(self) -> Vec<Panel> {
        let panel = |caption: &str, picture| Panel { caption: caption.to_owned(), picture };
        vec![
            panel("observed surface", self.seen),
            panel("true bodies", self.truth),
            panel("distances, from the side", self.side),
            panel("truth, from the side", self.true_side),
        ]
    }
}

/// A view from above with the centres of free grasps, those that held last.
fn with_grasps(above: &Picture, affordance: &VolumeAffordance) -> Picture {
    let mut picture = above.clone();
    let side = f64::from(picture.width);
    for state in [PickState::Untried, PickState::Failed, PickState::Held] {
        for grasp in affordance.grasps.iter().filter(|grasp| grasp.state == state) {
            let [x, y] = [0, 1].map(|axis| side * grasp.centre[axis] / affordance.grid.size);
            picture.dot([x, side - y], DOT, state_colour(state));
        }
    }
    picture
}

/// A grid of the voxels of a volume, z up, in the axes of pictures: x right, y down, z away.
fn upright(n: u32, holds: impl Fn([u32; 3]) -> bool) -> OccupancyGrid {
    let mut grid = OccupancyGrid::new(n);
    for voxel in voxels(n).filter(|voxel| holds(*voxel)) {
        let [x, y, z] = voxel;
        grid.set([x, n - 1 - z, y]);
    }
    grid
}

fn voxels(n: u32) -> impl Iterator<Item = [u32; 3]> {
    (0..n).flat_map(move |x| (0..n).flat_map(move |y| (0..n).map(move |z| [x, y, z])))
}

/// Mean of the selected voxels, rounded down; the cube's middle if none is selected.
fn middle(n: u32, holds: impl Fn([u32; 3]) -> bool) -> [u32; 3] {
    let (mut sum, mut count) = ([0u64; 3], 0u64);
    for voxel in voxels(n).filter(|voxel| holds(*voxel)) {
        count += 1;
        sum.iter_mut().zip(voxel).for_each(|(sum, index)| *sum += u64::from(index));
    }
    if count == 0 { [n / 2; 3] } else { sum.map(|sum| (sum / count) as u32) }
}

/// Colours: white far in front of the observed surface, blue close to it, orange behind it, grey in no image.
fn distance_colour(volume: &SceneVolume, index: usize) -> Colour {
    if volume.weights[index] == 0 {
        return SLICE_COLOURS.unseen;
    }
    let value = volume.value(index);
    let Colour(near) = if value >= 0.0 { Colour::PARTIAL } else { Colour::COMPLETE };
    let Colour(far) = SLICE_COLOURS.free;
    let mix = |(near, far): (u8, u8)| (f64::from(near) + (f64::from(far) - f64::from(near)) * value.abs() + 0.5) as u8;
    Colour([(near[0], far[0]), (near[1], far[1]), (near[2], far[2])].map(mix))
}

/// A cut of `zoom` pixels per voxel; `colour` takes the voxel's index to the right and upward.
fn cut(n: u32, zoom: u32, colour: impl Fn(u32, u32) -> Colour) -> Picture {
    let mut picture = Picture::filled(n * zoom, n * zoom, [0; 4]);
    for (right, up) in (0..n).flat_map(|right| (0..n).map(move |up| (right, up))) {
        let top = (n - 1 - up) * zoom;
        picture.fill(right * zoom..(right + 1) * zoom, top..top + zoom, colour(right, up).opaque());
    }
    picture
}

/// A cut through the numbers of voxels, one colour per body.
fn instances(n: u32, zoom: u32, own: impl Fn(u32, u32) -> u8) -> Picture {
    let numbers: Vec<u8> = (0..n)
        .flat_map(|row| (0..n).map(move |column| (row, column)))
        .map(|(row, column)| own(column, n - 1 - row))
        .collect();
    let grey = |number| match number {
        VolumeTruth::FREE => Some(FLOOR),
        VolumeTruth::CONTAINER => Some(WALLS),
        VolumeTruth::TABLE => Some(WALLS / 2 + FLOOR / 2),
        _ => None,
    };
    InstanceMap { width: n, height: n, instances: &numbers, depth: &|_, _| f32::NAN, grey }.picture(zoom)
}
