//! Completion: the hand-written encoders against the generated ones, and what is refused.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use prost::Message;

use super::*;
use crate::{
    RecordError,
    codec::{proto, tests::sample},
};
use kernel::{
    geom::{GridPlacement, Intrinsics, OccupancyGrid, Pose, rotation_from_rpy},
    ids::{Digest, ItemId, ObjectId, SampleId},
};

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

/// Rays of which some touch something, inside and outside the grid of [`beside`].
fn touch() -> impl Strategy<Value = TactileContacts> {
    let ray = (any::<bool>(), prop::array::uniform3(-0.3..0.3f32), prop::array::uniform3(0.1..1.0f64), any::<bool>());
    (sample(), prop::collection::vec(ray, 1..50)).prop_map(|(sample, rays)| {
        let mut touch = TactileContacts { resolution: 7, probes: rays.len() as u32, ..TactileContacts::none(sample) };
        for (probe, (hits, position, normal, visible)) in (0..).zip(rays) {
            if !hits {
                touch.misses.push(position);
                continue;
            }
            let normal = Vector3::from(normal).normalize().map(|part| part as f32).into();
            // The grid's anchor is (0.5, 0.5, 0.45) of 7 cells, its centre the origin.
            let at: Vec<f64> = position
                .iter()
                .zip([3.5, 3.5, 3.15])
                .map(|(x, anchor)| (f64::from(*x) / 0.05 + anchor).floor())
                .collect();
            let inside = at.iter().all(|index| (0.0..7.0).contains(index));
            let cell = inside.then(|| [at[0] as u32, at[1] as u32, at[2] as u32]);
            touch.contacts.push(TouchContact { probe, position, normal, distance: 0.25, visible, cell });
        }
        touch
    })
}

/// A hand of three links whose approaches made those contacts.
fn hand_touch() -> impl Strategy<Value = TactileContacts> {
    let felt = (0..3u32, 0.0..50.0f32, -2e-3..1e-3f32);
    let approach = (prop::array::uniform6(-3.0..3.0f64), prop::array::uniform2(-1.0..2.5f64), any::<bool>());
    (touch(), "[a-z ü]{0,9}", prop::collection::vec(felt, 50), prop::collection::vec(approach, 50)).prop_map(
        |(mut touch, hand, felt, approaches)| {
            let ends = |touched: bool, other: bool| match (touched, other) {
                (true, false) => ApproachEnd::AtRest,
                (true, true) => ApproachEnd::TimedOut,
                (false, false) => ApproachEnd::Missed,
                (false, true) => ApproachEnd::Unstable,
            };
            let touches = |probe| touch.contacts.iter().any(|contact| contact.probe == probe);
            let approaches = (0..touch.probes).zip(approaches).map(|(probe, (pose, joints, other))| Approach {
                camera_from_hand: Pose::from_xyz_rpy(pose),
                joints: joints.to_vec(),
                end: ends(touches(probe), other),
            });
            let felt = felt.into_iter().take(touch.contacts.len());
            touch.hand = Some(HandTouch {
                hand,
                links: ["palm", "", "tip"].map(str::to_owned).to_vec(),
                joints: ["spread", "finger"].map(str::to_owned).to_vec(),
                contacts: felt.map(|(link, force, gap)| LinkContact { link, force, gap }).collect(),
                approaches: approaches.collect(),
            });
            touch
        },
    )
}

/// A pair with the grid of those contacts.
fn beside(sample: SampleId) -> VoxelPair {
    let grid = OccupancyGrid::new(7);
    VoxelPair {
        sample,
        grid: GridPlacement { resolution: 7, centre: Point3::origin(), cell_size: 0.05 },
        camera: Intrinsics { width: 640, height: 480, fx: 554.3, fy: 554.3, cx: 320.0, cy: 240.0, near: 0.1 },
        camera_from_object: Pose::identity(),
        world_from_object: Pose::identity(),
        world_from_camera: Pose::identity(),
        partial: grid.clone(),
        complete: grid,
        partial_cells: 0,
        complete_cells: 0,
        both_cells: 0,
        solid_share: 0.0,
    }
}

#[test]
fn a_pair_whose_camera_none_has_is_refused_by_the_field() {
    let sample = SampleId { subject: ObjectId(Digest([7; 32])), instance: 0, item: ItemId(1), camera: 0 };
    let mut payload = Vec::new();
    beside(sample).encode(&mut payload);
    let sound = proto::VoxelPair::decode(payload.as_slice()).expect("a message");
    assert!(VoxelPair::decode(&sound.encode_to_vec()).is_ok());
    type Lie = fn(&mut proto::Camera);
    let lies: [(Lie, &str); 9] = [
        (|camera| camera.width = 0, "camera.width"),
        (|camera| camera.height = 16385, "camera.height"),
        (|camera| camera.fx = 1e-300, "camera.fx"),
        (|camera| camera.fy = 1e300, "camera.fy"),
        (|camera| camera.fx = f64::NAN, "camera.fx"),
        (|camera| camera.cx = 1e300, "camera.cx"),
        (|camera| camera.cy = f64::NEG_INFINITY, "camera.cy"),
        (|camera| camera.near = 0.0, "camera.near"),
        (|camera| camera.near = f64::INFINITY, "camera.near"),
    ];
    for (lie, field) in lies {
        let mut lying = sound.clone();
        lie(lying.camera.as_mut().expect("a camera"));
        let words = VoxelPair::decode(&lying.encode_to_vec()).expect_err(field).to_string();
        assert!(words.contains(field), "{field}: {words}");
    }
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
    fn touch_reads_back_and_has_the_generated_encoders_bytes(touch in touch()) {
        let mut payload = Vec::new();
        touch.encode(&mut payload);
        prop_assert_eq!(&TactileContacts::decode(&payload).unwrap(), &touch);
        let generated = proto::TactileContacts::decode(payload.as_slice()).unwrap();
        prop_assert_eq!(generated.encode_to_vec(), payload);
        prop_assert_eq!(touch.check_beside(&beside(touch.sample)), Ok(()));
        let inside: std::collections::BTreeSet<_> = touch.contacts.iter().filter_map(|contact| contact.cell).collect();
        prop_assert_eq!(touch.tactile().cells().collect::<Vec<_>>(), inside.into_iter().collect::<Vec<_>>());
    }

    #[test]
    fn touch_that_contradicts_itself_or_its_pair_is_refused(touch in touch(), index in any::<prop::sample::Index>()) {
        let mut payload = Vec::new();
        touch.encode(&mut payload);
        let generated = proto::TactileContacts::decode(payload.as_slice()).unwrap();
        let lies: [fn(&mut proto::TactileContacts); 6] = [
            |touch| touch.outside += 1,
            |touch| touch.probes += 1,
            |touch| touch.misses.extend([0; 12]),
            |touch| touch.normals.extend([0; 12]),
            |touch| touch.visible.push(1),
            |touch| touch.resolution = 0,
        ];
        for (number, lie) in lies.into_iter().enumerate() {
            let mut lying = generated.clone();
            lie(&mut lying);
            prop_assert!(TactileContacts::decode(&lying.encode_to_vec()).is_err(), "lie {number}");
        }
        let count = touch.contacts.len();
        prop_assume!(count > 0);
        let index = index.index(count);
        let lies: [fn(&mut proto::TactileContacts, usize); 5] = [
            |touch, index| touch.normals[12 * index..12 * index + 4].copy_from_slice(&2f32.to_le_bytes()),
            |touch, index| touch.distances[4 * index..4 * index + 4].copy_from_slice(&(-1f32).to_le_bytes()),
            |touch, index| touch.probe[index] = touch.probes,
            |touch, index| touch.visible[index] = 2,
            |touch, index| touch.cells[index] = 344,
        ];
        for (number, lie) in lies.into_iter().enumerate() {
            let mut lying = generated.clone();
            lie(&mut lying, index);
            prop_assert!(TactileContacts::decode(&lying.encode_to_vec()).is_err(), "lie {number} at {index}");
        }
        let mut moved = touch.clone();
        let cell = &mut moved.contacts[index].cell;
        *cell = match *cell {
            // Two cells on, or from outside into the middle.
            Some([x, y, z]) => Some([(x + 2) % 7, y, z]),
            None => Some([3, 3, 3]),
        };
        prop_assert!(moved.check_beside(&beside(touch.sample)).is_err());
        let other = VoxelPair { grid: GridPlacement { resolution: 8, ..beside(touch.sample).grid }, ..beside(touch.sample) };
        prop_assert!(touch.check_beside(&other).is_err());
    }

    #[test]
    fn touch_by_a_hand_reads_back_and_adds_fields_alone(touch in hand_touch()) {
        let (mut payload, mut plain) = (Vec::new(), Vec::new());
        touch.encode(&mut payload);
        prop_assert_eq!(&TactileContacts::decode(&payload).unwrap(), &touch);
        let generated = proto::HandContacts::decode(payload.as_slice()).unwrap();
        prop_assert_eq!(&generated.encode_to_vec(), &payload);
        // What random rays would have: the same bytes, and nothing behind them.
        TactileContacts { hand: None, ..touch.clone() }.encode(&mut plain);
        prop_assert!(payload.starts_with(&plain) && payload.len() > plain.len());
        prop_assert_eq!(proto::TactileContacts::decode(payload.as_slice()).unwrap().encode_to_vec(), plain.clone());
        for channel in [Channel::TOUCH_EXPLORATION, Channel::TOUCH_GRASP] {
            prop_assert_eq!(&TactileContacts::decode_of(channel, &payload).unwrap(), &touch);
            let missing = RecordError::Missing { message: "HandContacts", field: "ends" };
            prop_assert_eq!(TactileContacts::decode_of(channel, &plain), Err(missing));
        }
        prop_assert!(TactileContacts::decode_of(Channel::TOUCH_RAYS, &plain).is_ok());
        prop_assert!(TactileContacts::decode_of(Channel::TOUCH_RAYS, &payload).is_err());
    }

    #[test]
    fn touch_by_a_hand_that_contradicts_itself_is_refused(touch in hand_touch(), index in any::<prop::sample::Index>()) {
        let mut payload = Vec::new();
        touch.encode(&mut payload);
        let generated = proto::HandContacts::decode(payload.as_slice()).unwrap();
        let refused = |lie: &dyn Fn(&mut proto::HandContacts)| {
            let mut lying = generated.clone();
            lie(&mut lying);
            TactileContacts::decode(&lying.encode_to_vec()).is_err()
        };
        let approach = index.index(touch.probes as usize);
        let lies: [&dyn Fn(&mut proto::HandContacts); 11] = [
            &|touch| touch.links.clear(),
            &|touch| touch.joints.push("third".to_owned()),
            &|touch| touch.link.push(0),
            &|touch| touch.forces.extend([0; 4]),
            &|touch| touch.gaps.extend([0; 3]),
            &|touch| _ = touch.ends.pop(),
            &|touch| touch.ends[approach] = 5,
            &|touch| _ = touch.camera_from_hand.pop(),
            &|touch| touch.camera_from_hand[12 * approach + 5] += 0.1,
            &|touch| touch.joint_values[2 * approach] = f64::NAN,
            &|touch| (touch.ends, touch.camera_from_hand, touch.joint_values) = Default::default(),
        ];
        for (number, lie) in lies.into_iter().enumerate() {
            prop_assert!(refused(lie), "lie {}", number);
        }
        let count = touch.contacts.len();
        prop_assume!(count > 0);
        let index = index.index(count);
        let barren = touch.contacts[index].probe as usize;
        let float = |bytes: &mut Vec<u8>, value: f32| bytes[4 * index..][..4].copy_from_slice(&value.to_le_bytes());
        let lies: [&dyn Fn(&mut proto::HandContacts); 7] = [
            &|touch| touch.link[index] = 3,
            &|touch| float(&mut touch.forces, -1e-3),
            &|touch| float(&mut touch.forces, f32::INFINITY),
            &|touch| float(&mut touch.gaps, f32::NAN),
            &|touch| touch.ends[barren] = ApproachEnd::Missed as u8,
            &|touch| touch.ends[barren] = ApproachEnd::Unstable as u8,
            &|touch| touch.ends[barren] = ApproachEnd::Overloaded as u8,
        ];
        for (number, lie) in lies.into_iter().enumerate() {
            prop_assert!(refused(lie), "lie {} at {}", number, index);
        }
    }

    #[test]
    fn a_damaged_pair_is_an_error_or_another_record(mut pair in pair(), index in any::<prop::sample::Index>(), bit in 0..8) {
        // Larger numbers take five bytes, and the format has readers ignore the last one's upper bits.
        for number in [&mut pair.sample.instance, &mut pair.sample.item.0, &mut pair.sample.camera] {
            *number &= 0x0fff_ffff;
        }
        let mut payload = Vec::new();
        pair.encode(&mut payload);
        let index = index.index(payload.len());
        payload[index] ^= 1u8 << bit;
        if let Ok(other) = VoxelPair::decode(&payload) {
            prop_assert_ne!(other, pair);
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
fn distances_become_steps_and_back() {
    let tsdf = Tsdf {
        sample: SampleId::of_object(ObjectId(Digest([1; 32])), ItemId(0)),
        resolution: 1,
        truncation: 0.02,
        steps: vec![0],
    };
    assert_eq!(Tsdf::step_of(0.5, 0.02), 32767);
    assert_eq!(Tsdf::step_of(-0.5, 0.02), -32767);
    assert!((tsdf.distance(Tsdf::step_of(0.0123, 0.02)) - 0.0123).abs() <= 0.02 / 32767.0);
}
