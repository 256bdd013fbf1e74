//! `preview.mcap` of a reachability dataset: how much of each position is reachable, and from where.

use std::{io::Seek, path::PathBuf};

use nalgebra::Vector3;

use super::{
    Preview, arrow,
    cloud::coloured_cloud,
    foxglove::{Color, PointCloud, SceneEntity, SceneUpdate},
    google::protobuf::Timestamp,
    write_file,
};
use format::ReachabilityField;
use format::dataset::DatasetError;
use kernel::{
    files::Folder,
    geom::{PoseGrid, PoseLabel, approach_directions},
};

/// The most positions with arrows along an axis: finer grids show every second, third, ... position.
const MAX_WITH_ARROWS: usize = 12;
/// The most points; finer grids show every second, third, ... position along each axis.
const MAX_POINTS: usize = 200_000;

/// Writes `preview.mcap` of a reachability dataset into its folder: on `/preview/reachable` a point for each position
/// with a reachable pose, with the share of its orientations that are reachable and a colour by it (dark blue to yellow),
/// and on `/preview/directions`, at every few positions, an arrow for each approach direction that is reachable (green) or
/// only with a collision (orange). In the frame of the poses.
///
/// # Errors
/// When the file can't be written.
pub fn write_map_preview(folder: &Folder, field: &ReachabilityField) -> Result<PathBuf, DatasetError> {
    write_file(folder, |file| write_messages(file, field))
}

fn write_messages(file: impl std::io::Write + Seek, field: &ReachabilityField) -> mcap::McapResult<()> {
    let mut preview = Preview::create(file, include_bytes!("../generated/foxglove_scene.bin"))?;
    preview.write(0, "/preview/reachable", "foxglove.PointCloud", &cloud(field))?;
    preview.write(0, "/preview/directions", "foxglove.SceneUpdate", &arrows(field))?;
    preview.finish()
}

/// Stride of the positions along each axis, for at most `most` of them.
fn positions(grid: &PoseGrid, fits: impl Fn([usize; 3]) -> bool) -> impl Iterator<Item = [usize; 3]> {
    let [nx, ny, nz] = grid.position_counts();
    let counts = |stride: usize| [nx, ny, nz].map(|count| count.div_ceil(stride));
    let stride = (1..=nx.max(ny).max(nz)).find(|stride| fits(counts(*stride))).unwrap_or(1);
    let along = move |count: usize| (0..count).step_by(stride);
    along(nx).flat_map(move |x| along(ny).flat_map(move |y| along(nz).map(move |z| [x, y, z])))
}

/// The labels of a position, and where it is [m].
fn labels_at(field: &ReachabilityField, indices: [usize; 3]) -> (&[PoseLabel], Vector3<f64>) {
    let grid = &field.header.grid;
    let position = PoseGrid::position(grid.position_counts(), indices);
    (&field.labels[grid.cells_at(indices)], grid.centre(position))
}

fn cloud(field: &ReachabilityField) -> PointCloud {
    let mut data = Vec::new();
    for indices in positions(&field.header.grid, |counts| counts.iter().product::<usize>() <= MAX_POINTS) {
        let (labels, at) = labels_at(field, indices);
        let reachable = labels.iter().filter(|label| **label == PoseLabel::Reachable).count();
        if reachable > 0 {
            let share = reachable as f64 / labels.len() as f64;
            data.extend([at.x, at.y, at.z, share].into_iter().flat_map(|value| (value as f32).to_le_bytes()));
            data.extend(colour_of(share));
        }
    }
    coloured_cloud(Some(Timestamp::default()), &field.header.frame, &["x", "y", "z", "share"], data)
}

/// From dark blue (none) over teal to yellow (all), straight lines in sRGB.
fn colour_of(share: f64) -> [u8; 4] {
    const ENDS: [[f64; 3]; 3] = [[40.0, 50.0, 120.0], [30.0, 150.0, 140.0], [250.0, 225.0, 60.0]];
    let scaled = share.clamp(0.0, 1.0) * 2.0;
    let (from, to, part) = if scaled < 1.0 { (ENDS[0], ENDS[1], scaled) } else { (ENDS[1], ENDS[2], scaled - 1.0) };
    let [r, g, b] = std::array::from_fn(|k| (from[k] + (to[k] - from[k]) * part + 0.5) as u8);
    [r, g, b, 255]
}

fn arrows(field: &ReachabilityField) -> SceneUpdate {
    let grid = &field.header.grid;
    let (directions, approaches) = (approach_directions(), grid.approaches());
    let wanted: Vec<[usize; 3]> =
        positions(grid, |counts| counts.iter().all(|count| *count <= MAX_WITH_ARROWS)).collect();
    // Arrows of neighbours do not touch: they are a third of the distance long.
    let apart = wanted.first().zip(wanted.get(1)).map_or(1, |(a, b)| b[2].abs_diff(a[2]).max(1));
    let length = 0.36 * apart as f64 * grid.position_axes().iter().map(|axis| axis.step).fold(f64::INFINITY, f64::min);
    let mut arrows = Vec::new();
    for indices in wanted {
        let (labels, at) = labels_at(field, indices);
        let mut best = [PoseLabel::NoSolution; 26];
        for (label, approach) in labels.iter().zip(&approaches) {
            let best = &mut best[usize::from(*approach)];
            *best = (*best).max(*label);
        }
        for (direction, label) in directions.iter().zip(best) {
            let color = match label {
                PoseLabel::NoSolution => continue,
                PoseLabel::Colliding => Color { r: 0.88, g: 0.54, b: 0.0, a: 0.8 },
                PoseLabel::Reachable => Color { r: 0.0, g: 0.53, b: 0.37, a: 1.0 },
            };
            arrows.push(arrow(&at, direction, length, color));
        }
    }
    let entity = SceneEntity {
        timestamp: Some(Timestamp::default()),
        frame_id: field.header.frame.clone(),
        id: "approach directions".to_owned(),
        arrows,
        ..SceneEntity::default()
    };
    SceneUpdate { entities: vec![entity], ..SceneUpdate::default() }
}
