//! The hand-written encoder against the generated one, and every codec against itself.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use prost::Message;

use super::*;
use crate::geom::{DepthCrop, GridPlacement, Intrinsics, OccupancyGrid, Pose, rotation_from_rpy};

fn sample() -> impl Strategy<Value = SampleId> {
    (any::<[u8; 32]>(), any::<u32>(), any::<u32>(), any::<u32>()).prop_map(|(subject, instance, view, camera)| {
        SampleId { subject: ObjectId(Digest(subject)), instance, view: ViewId(view), camera }
    })
}

fn grid(resolution: u32) -> impl Strategy<Value = OccupancyGrid> {
    let cells = (resolution as usize).pow(3);
    prop::collection::vec(any::<bool>(), cells).prop_map(move |cells| {
        let mut grid = OccupancyGrid::new(resolution);
        let n = resolution;
        for (bit, _) in (0..).zip(&cells).filter(|(_, cell)| **cell) {
            grid.set([bit / n / n, bit / n % n, bit % n]);
        }
        grid
    })
}

fn pair() -> impl Strategy<Value = VoxelPair> {
    let number = || prop::array::uniform3(-3.0..3.0);
    let grids = (1u32..9).prop_flat_map(|resolution| (grid(resolution), grid(resolution)));
    (sample(), grids, number(), number(), number(), 1e-5..1.0, 0.0..=1.0).prop_map(
        |(sample, (partial, complete), a, b, c, cell_size, solid_share)| {
            let world_from_camera = Pose::new(rotation_from_rpy(a[0], a[1], a[2]), Vector3::from(b));
            let camera_from_object = Pose::new(rotation_from_rpy(c[0], c[1], c[2]), Vector3::from(a));
            VoxelPair {
                sample,
                grid: GridPlacement { resolution: partial.resolution(), centre: Point3::from(c), cell_size },
                camera: Intrinsics { width: 640, height: 480, fx: 554.3, fy: 554.3, cx: 320.0, cy: 240.0, near: 0.1 },
                camera_from_object,
                world_from_object: world_from_camera * camera_from_object,
                world_from_camera,
                partial_cells: partial.count(),
                complete_cells: complete.count(),
                both_cells: partial.count_both(&complete),
                partial,
                complete,
                solid_share,
            }
        },
    )
}

proptest! {
    #[test]
    fn a_pair_reads_back_and_has_the_generated_encoders_bytes(pair in pair()) {
        let mut payload = Vec::new();
        pair.encode(&mut payload);
        prop_assert_eq!(&VoxelPair::decode(&payload).unwrap(), &pair);
        let generated = proto::VoxelPair::decode(payload.as_slice()).unwrap();
        prop_assert_eq!(generated.encode_to_vec(), payload);
    }

    #[test]
    fn no_bytes_make_a_decoder_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for channel in Channel::ALL {
            let _ = check(channel, &bytes);
        }
    }

    #[test]
    fn a_damaged_pair_is_an_error_or_another_record(mut pair in pair(), place in any::<prop::sample::Index>(), bit in 0..8) {
        // Larger numbers take five bytes, and the format has readers ignore the last one's upper bits.
        for number in [&mut pair.sample.instance, &mut pair.sample.view.0, &mut pair.sample.camera] {
            *number &= 0x0fff_ffff;
        }
        let mut payload = Vec::new();
        pair.encode(&mut payload);
        let place = place.index(payload.len());
        payload[place] ^= 1u8 << bit;
        if let Ok(other) = VoxelPair::decode(&payload) {
            prop_assert_ne!(other, pair);
        }
    }

    #[test]
    fn depth_reads_back_to_half_a_step(id in sample(), depths in prop::collection::vec(prop::option::of(0.1f32..6.0), 12)) {
        let depth: Vec<f32> = depths.iter().map(|depth| depth.unwrap_or(f32::NAN)).collect();
        let crop = DepthCrop { left: 3, top: 0, width: 4, height: 3, depth };
        for coding in [DepthCoding::F32, DepthCoding::U16 { step: 1e-4 }] {
            let mut payload = Vec::new();
            Depth::encode_parts(&id, &crop, coding, &mut payload);
            let read = Depth::decode(&payload).unwrap();
            prop_assert_eq!((read.sample, read.coding), (id, coding));
            for (read, depth) in read.crop.depth.iter().zip(&crop.depth) {
                let most = if coding == DepthCoding::F32 { 0.0 } else { 0.5e-4 + 1e-6 };
                prop_assert!(read.is_nan() && depth.is_nan() || (read - depth).abs() <= most, "{} {}", read, depth);
            }
            let generated = proto::Depth::decode(payload.as_slice()).unwrap();
            prop_assert_eq!(generated.encode_to_vec(), payload);
        }
    }

    #[test]
    fn the_other_channels_read_back(id in sample(), free in grid(5), points in prop::collection::vec(any::<[i16; 3]>(), 0..9)) {
        let points: Vec<[f32; 3]> = points.into_iter().map(|point| point.map(f32::from)).collect();
        let mut payload = Vec::new();
        let visibility = Visibility { sample: id, free };
        visibility.encode(&mut payload);
        prop_assert_eq!(Visibility::decode(&payload).unwrap(), visibility);
        payload.clear();
        let cloud = Cloud { sample: id, points: points.clone() };
        cloud.encode(&mut payload);
        prop_assert_eq!(Cloud::decode(&payload).unwrap(), cloud);
        payload.clear();
        let steps = (0..27).map(|step| Tsdf::step_of(f64::from(step) * 1e-3 - 0.01, 0.008)).collect();
        let tsdf = Tsdf { sample: id, resolution: 3, truncation: 0.008, steps };
        tsdf.encode(&mut payload);
        prop_assert_eq!(Tsdf::decode(&payload).unwrap(), tsdf);
        payload.clear();
        let coverage = Coverage { sample: id, resolution: 3, share: (0..27).collect() };
        coverage.encode(&mut payload);
        prop_assert_eq!(Coverage::decode(&payload).unwrap(), coverage);
        payload.clear();
        let implicit = Implicit {
            sample: id,
            surface_normals: vec![[0.0, 0.6, 0.8]; points.len()],
            space_distances: vec![-0.5; points.len()],
            surface_points: points.clone(),
            space_points: points,
        };
        implicit.encode(&mut payload);
        prop_assert_eq!(Implicit::decode(&payload).unwrap(), implicit);
    }
}

#[test]
fn every_channel_has_its_topic_and_its_message() {
    let descriptors = String::from_utf8_lossy(descriptors()).into_owned();
    for channel in Channel::ALL {
        assert_eq!(Channel::from_topic(channel.topic()), Some(channel));
        assert!(descriptors.contains(channel.schema_name().trim_start_matches("graspmill.")));
    }
    assert_eq!(Channel::from_topic("/completion/colour"), None);
    assert!(!descriptors.contains("Topic /completion"), "comments must not stand in shards");
}

#[test]
fn distances_become_steps_and_back() {
    let tsdf = Tsdf {
        sample: SampleId::of_object(ObjectId(Digest([1; 32])), ViewId(0)),
        resolution: 1,
        truncation: 0.02,
        steps: vec![0],
    };
    assert_eq!(Tsdf::step_of(0.5, 0.02), 32767);
    assert_eq!(Tsdf::step_of(-0.5, 0.02), -32767);
    assert!((tsdf.distance(Tsdf::step_of(0.0123, 0.02)) - 0.0123).abs() <= 0.02 / 32767.0);
}
