use nalgebra::Point3;
use prost::Message;

use super::*;
use crate::{
    Approach, ApproachEnd, BlockedProbe, Facts, HandTouch, LinkContact, RecordError, SceneImage, TactileContacts,
    TouchContact, VoxelPair, codec::proto,
};
use kernel::{
    geom::{GridPlacement, Intrinsics, OccupancyGrid, Pose},
    ids::{Digest, ItemId, ObjectId, SampleId},
};

fn sample() -> SampleId {
    SampleId { instance: 3, camera: 1, ..SampleId::of_object(ObjectId(Digest([9; 32])), ItemId(2)) }
}

/// A body of 100 pixels, 80 in the image and 20 seen, on a grid of 5 cells.
fn clutter() -> Clutter {
    let mut clutter = Clutter {
        pixels_all: 100,
        pixels_in_image: 80,
        pixels_visible: 20,
        points: 24,
        own_points: 18,
        ..Clutter::none(sample(), ObjectId(Digest([4; 32])), 5)
    };
    clutter.others_seen.set([0, 1, 2]);
    clutter.others_solid.set([4, 4, 4]);
    clutter.others_solid.set([0, 1, 2]);
    clutter
}

fn pair() -> VoxelPair {
    let mut partial = OccupancyGrid::new(5);
    partial.set([2, 2, 2]);
    VoxelPair {
        sample: sample(),
        grid: GridPlacement { resolution: 5, centre: Point3::origin(), cell_size: 0.05 },
        camera: Intrinsics { width: 640, height: 480, fx: 554.3, fy: 554.3, cx: 320.0, cy: 240.0, near: 0.1 },
        camera_from_object: Pose::identity(),
        world_from_object: Pose::identity(),
        world_from_camera: Pose::identity(),
        complete: partial.clone(),
        partial,
        partial_cells: 1,
        complete_cells: 1,
        both_cells: 1,
        solid_share: 1.0,
    }
}

fn payload(clutter: &Clutter) -> Vec<u8> {
    let mut out = Vec::new();
    clutter.encode(&mut out);
    out
}

#[test]
fn clutter_comes_back_as_it_was_with_its_shares() {
    let clutter = clutter();
    assert_eq!(Clutter::decode(&payload(&clutter)), Ok(clutter.clone()));
    assert_eq!((clutter.visible_share(), clutter.purity(), clutter.is_truncated()), (0.2, 0.75, true));
    assert_eq!(clutter.check_beside(&pair()), Ok(()));
    let facts = AmodalFacts::from_pair(&pair(), &clutter);
    assert_eq!(AmodalFacts::from(&Facts::from(facts)), facts);
    assert_eq!((facts.visible_share, facts.truncated, facts.others_solid_cells), (0.2, 1, 2));
    // The record states the values of the table, by the same indices.
    let values = Facts::from(facts);
    assert!(clutter.stated_facts().iter().all(|(index, value)| values.values()[*index] == *value));
}

#[test]
fn clutter_that_contradicts_itself_or_its_pair_is_refused() {
    type Change = fn(&mut Clutter);
    let changes: [(Change, &str); 5] = [
        (|clutter| clutter.sample.instance = 0, "sample.instance"),
        (|clutter| clutter.pixels_in_image = 101, "pixels_in_image"),
        (|clutter| clutter.pixels_visible = 81, "pixels_visible"),
        (|clutter| clutter.own_points = 25, "own_points"),
        (|clutter| clutter.others_solid = OccupancyGrid::new(6), "others_solid"),
    ];
    for (change, expected) in changes {
        let mut clutter = clutter();
        change(&mut clutter);
        let error = Clutter::decode(&payload(&clutter)).expect_err(expected);
        let (RecordError::Range { field, .. } | RecordError::Length { field, .. }) = error else { panic!("{error:?}") };
        assert_eq!(field, expected);
    }
    let few = Clutter { points: 0, own_points: 0, ..clutter() };
    assert!(matches!(few.check_beside(&pair()), Err(RecordError::Range { field: "points", .. })));
    let coarse = Clutter::none(sample(), ObjectId(Digest([4; 32])), 4);
    assert!(matches!(coarse.check_beside(&pair()), Err(RecordError::Range { field: "resolution", .. })));
}

/// Four rays: the first touches, the second meets body 2, the third the table, the fourth nothing.
fn touch() -> TactileContacts {
    let contact = TouchContact {
        probe: 0,
        position: [0.0, 0.0, 0.02],
        normal: [0.0, 0.0, 1.0],
        distance: 0.1,
        visible: false,
        cell: Some([2, 2, 2]),
    };
    let blocked = |probe, by| BlockedProbe { probe, by, position: [0.01, 0.02, 0.5] };
    TactileContacts {
        resolution: 5,
        probes: 4,
        contacts: vec![contact],
        misses: vec![[0.0; 3]],
        blocked: vec![blocked(1, 2), blocked(2, SceneImage::TABLE)],
        ..TactileContacts::none(sample())
    }
}

/// The touch of a hand whose first approach ended at rest, with a finger at the container, whose second was blocked.
fn hand_touch() -> TactileContacts {
    let approach = |end| Approach { camera_from_hand: Pose::identity(), joints: Vec::new(), end };
    let ends = [ApproachEnd::AtRest, ApproachEnd::Blocked, ApproachEnd::Missed];
    let mut touch = TactileContacts { probes: 3, ..touch() };
    touch.blocked[1].probe = 1;
    touch.blocked.insert(0, BlockedProbe { probe: 0, by: SceneImage::CONTAINER, position: [0.0; 3] });
    touch.hand = Some(HandTouch {
        hand: "claw".to_owned(),
        links: vec!["palm".to_owned()],
        joints: Vec::new(),
        contacts: vec![LinkContact { link: 0, force: 1.0, gap: 0.0 }],
        approaches: ends.map(approach).to_vec(),
    });
    touch
}

fn touch_payload(touch: &TactileContacts) -> Vec<u8> {
    let mut out = Vec::new();
    touch.encode(&mut out);
    out
}

#[test]
fn touch_in_clutter_comes_back_as_it_was() {
    for (channel, touch) in [(Channel::AMODAL_TOUCH_RAYS, touch()), (Channel::AMODAL_TOUCH_EXPLORATION, hand_touch())] {
        let payload = touch_payload(&touch);
        assert_eq!(TactileContacts::decode_of(channel, &payload).as_ref(), Ok(&touch));
        let generated = proto::ClutterContacts::decode(payload.as_slice()).expect("a message");
        assert_eq!(generated.encode_to_vec(), payload);
        assert_eq!(touch.check_beside(&pair()), Ok(()));
        assert!(channel.is_touch() && channel.is_touch_in_clutter() && !Channel::TOUCH_RAYS.is_touch_in_clutter());
    }
    // A single object has no surroundings.
    assert!(TactileContacts::decode_of(Channel::TOUCH_RAYS, &touch_payload(&touch())).is_err());
    assert!(TactileContacts::decode_of(Channel::TOUCH_EXPLORATION, &touch_payload(&hand_touch())).is_err());
}

#[test]
fn touch_in_clutter_that_contradicts_itself_is_refused() {
    type Change = fn(&mut TactileContacts);
    let by_rays: [(Change, &str); 7] = [
        (|touch| touch.blocked[0].by = 0, "blocked_by"),
        (|touch| touch.blocked[0].by = 3, "blocked_by"),
        (|touch| touch.blocked[0].by = SceneImage::BETWEEN, "blocked_by"),
        (|touch| touch.blocked[0].probe = 0, "blocked_probe"),
        (|touch| touch.blocked[1].probe = 4, "blocked_probe"),
        (|touch| touch.blocked.swap(0, 1), "blocked_probe"),
        (|touch| _ = touch.blocked.pop(), "misses"),
    ];
    let by_hand: [(Change, &str); 2] =
        [(|touch| touch.blocked[2].probe = 2, "blocked_probe"), (|touch| touch.blocked.truncate(1), "ends")];
    for (touch, changes) in [(touch(), &by_rays[..]), (hand_touch(), &by_hand[..])] {
        for (change, expected) in changes {
            let mut touch = touch.clone();
            change(&mut touch);
            let error = TactileContacts::decode(&touch_payload(&touch)).expect_err(expected);
            let (RecordError::Range { field, .. } | RecordError::Length { field, .. }) = error else {
                panic!("{error:?}")
            };
            assert_eq!(field, *expected);
        }
    }
}
