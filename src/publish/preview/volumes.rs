//! `preview.mcap` of a dataset of volumes.

use std::path::PathBuf;

use nalgebra::Point3;

use super::{Preview, cloud::coloured_cloud, google::protobuf::Timestamp, previewed, transform, write_file};
use format::{
    SceneVolume, VolumeTruth,
    dataset::{DatasetError, DatasetReader},
};

/// Writes `preview.mcap` into the folder of a dataset: volume k at k seconds, some of them spread over the dataset, on
/// `/preview/tf` (world -> volume), `/preview/surface` (centres of the voxels at the fused surface, with distance and weight) and
/// `/preview/bodies` (centres inside bodies and container, with their number).
///
/// # Errors
/// When a shard is missing or damaged, or the file cannot be written.
pub fn write_volume_preview(reader: &DatasetReader) -> Result<PathBuf, DatasetError> {
    let mut volumes = Vec::new();
    for sample in previewed(reader)? {
        volumes.push((sample.read::<SceneVolume>()?, sample.read::<VolumeTruth>()?));
    }
    write_file(reader.folder(), |file| write_messages(file, &volumes))
}

/// A point with two numbers and a colour.
type ColouredPoint = (Point3<f64>, [f32; 2], [u8; 4]);

fn write_messages(
    file: impl std::io::Write + std::io::Seek,
    volumes: &[(SceneVolume, VolumeTruth)],
) -> mcap::McapResult<()> {
    let mut preview = Preview::create(file, include_bytes!("../generated/foxglove.bin"))?;
    for (second, (volume, truth)) in (0..).zip(volumes) {
        let time = Some(Timestamp { seconds: second as i64, nanos: 0 });
        preview.write(
            second,
            "/preview/tf",
            "foxglove.FrameTransform",
            &transform(time, &volume.world_from_volume, "volume"),
        )?;
        for (topic, names, points) in [
            ("/preview/surface", ["distance", "weight"], surface(volume)),
            ("/preview/bodies", ["instance", "is_container"], bodies(volume, truth)),
        ] {
            let mut data = Vec::with_capacity(24 * points.len());
            for (at, numbers, colour) in points {
                let numbers = [at.x as f32, at.y as f32, at.z as f32].into_iter().chain(numbers);
                data.extend(numbers.flat_map(f32::to_le_bytes).chain(colour));
            }
            let cloud = coloured_cloud(time, "volume", &["x", "y", "z", names[0], names[1]], data);
            preview.write(second, topic, "foxglove.PointCloud", &cloud)?;
        }
    }
    preview.finish()
}

/// Centres of the voxels of a volume, with their indices.
fn centres(volume: &SceneVolume) -> impl Iterator<Item = (usize, Point3<f64>)> {
    let (grid, n) = (volume.grid, volume.grid.resolution);
    let voxels = (0..n).flat_map(move |x| (0..n).flat_map(move |y| (0..n).map(move |z| [x, y, z])));
    voxels.map(move |voxel| grid.centre(voxel)).enumerate()
}

/// Voxels whose centre is within an edge of a voxel of what is seen; blue in front of it, orange behind.
fn surface(volume: &SceneVolume) -> Vec<ColouredPoint> {
    let point = |(index, at): (usize, Point3<f64>)| {
        let distance = volume.value(index) * volume.truncation;
        let is_near = volume.weights[index] > 0 && distance.abs() <= volume.grid.voxel();
        let colour = if distance >= 0.0 { [0x00, 0x72, 0xb2, 255] } else { [0xe6, 0x9f, 0x00, 255] };
        is_near.then(|| (at, [distance as f32, f32::from(volume.weights[index])], colour))
    };
    centres(volume).filter_map(point).collect()
}

/// Voxels inside bodies, orange, and container, grey.
fn bodies(volume: &SceneVolume, truth: &VolumeTruth) -> Vec<ColouredPoint> {
    let point = |(index, at): (usize, Point3<f64>)| {
        let own = truth.instances[index];
        match own {
            VolumeTruth::CONTAINER => Some((at, [f32::from(own), 1.0], [0x8c, 0x8c, 0x90, 255])),
            own if VolumeTruth::is_body(own) => Some((at, [f32::from(own), 0.0], [0xe6, 0x9f, 0x00, 255])),
            _ => None,
        }
    };
    centres(volume).filter_map(point).collect()
}
