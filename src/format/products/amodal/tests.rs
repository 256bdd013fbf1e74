use nalgebra::Point3;

use super::*;
use crate::{Facts, RecordError, VoxelPair};
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
    let facts = AmodalFacts::of(&pair(), &clutter);
    assert_eq!(AmodalFacts::from(&Facts::from(facts)), facts);
    assert_eq!((facts.visible_share, facts.truncated, facts.others_solid_cells), (0.2, 1, 2));
    // The record states what stands in the table, by the same indices.
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
