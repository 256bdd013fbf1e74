use super::*;
use crate::{Facts, PixelMask, RecordError, SceneContainer};
use kernel::{
    geom::{Intrinsics, Pose},
    ids::{Digest, ItemId, ObjectId, SampleId},
};

/// Two bodies in an image of 4 x 3 pixels, the second behind the first and reaching out to the left.
fn image() -> SceneImage {
    let body = |number: u8, pixels_all, whole_box, visible: (u32, [u32; 4]), mask: PixelMask| SceneInstance {
        object: ObjectId(Digest([number; 32])),
        world_from_object: Pose::from_xyz_rpy([0.1 * f64::from(number), 0.0, 0.05, 0.3, 0.2, 0.1]),
        pixels_all,
        pixels_visible: visible.0,
        whole_box,
        visible_box: visible.1,
        mask,
        near: None,
    };
    let mask = |left, top, width, height, bits: u8| PixelMask { left, top, width, height, bits: vec![bits] };
    SceneImage {
        sample: SampleId { camera: 1, ..SampleId::of_object(ObjectId(Digest([9; 32])), ItemId(3)) },
        camera: Intrinsics { width: 4, height: 3, fx: 5.0, fy: 5.0, cx: 2.0, cy: 1.5, near: 0.01 },
        world_from_camera: Pose::from_xyz_rpy([0.0, 0.1, 0.5, 3.0, 0.0, 0.0]),
        container: SceneContainer::Bin { inner: [0.4, 0.3, 0.2], wall: 0.02, tilt_deg: 0.0 },
        table: [2.0, 2.0],
        bodies: vec![
            body(1, 2, [1, 0, 2, 1], (2, [1, 0, 2, 1]), mask(1, 0, 2, 1, 0b11)),
            body(2, 5, [-1, 0, 3, 2], (2, [0, 0, 1, 2]), mask(0, 0, 2, 2, 0b0111)),
        ],
        instances: vec![2, 1, 1, 254, 2, 255, 255, 255, 0, 255, 255, 0],
        point_instances: None,
        near_draws: 1,
        unseen_draws: 2,
    }
}

/// An image before a sensor: one of two pixels of the first body is too near, none of the second.
fn measured() -> SceneImage {
    let mut image = image();
    image.point_instances = Some(vec![2, 253, 1, 254, 0, 0, 255, 255, 0, 0, 0, 0]);
    image.bodies[0].near = Some(NearBody { pixels: 1, nearest: 0.45 });
    image.bodies[1].near = Some(NearBody { pixels: 0, nearest: 0.55 });
    image
}

fn payload(image: &SceneImage) -> Vec<u8> {
    let mut out = Vec::new();
    image.encode(&mut out);
    out
}

#[test]
fn an_image_comes_back_as_it_was() {
    for image in [image(), measured()] {
        assert_eq!(SceneImage::decode(&payload(&image)), Ok(image));
    }
}

#[test]
fn facts_count_bodies_by_what_is_seen_of_them() {
    let facts = image().facts();
    assert_eq!(ViewFacts::from(&Facts::from(facts)), facts);
    let expected = ViewFacts {
        bodies: 2,
        clear: 1,
        mostly_hidden: 1,
        truncated: 1,
        near_draws: 1,
        unseen_draws: 2,
        ..ViewFacts::default()
    };
    assert_eq!(facts, expected);
    let measured = measured().facts();
    assert_eq!(measured, ViewFacts { too_near: 1, nearest: f64::from(0.45_f32), ..expected });
    assert_eq!(ViewFacts::from(&Facts::from(measured)), measured);
}

#[test]
fn an_image_that_contradicts_itself_is_refused() {
    type Change = fn(&mut SceneImage);
    let changes: [(Change, &str); 11] = [
        (|image| image.bodies[1].near = Some(NearBody { pixels: 3, nearest: 0.3 }), "pixels_too_near"),
        (|image| image.bodies[1].near = Some(NearBody { pixels: 1, nearest: 0.0 }), "nearest_depths"),
        (|image| image.bodies[1].near = Some(NearBody { pixels: 1, nearest: f32::NAN }), "nearest_depths"),
        (|image| image.bodies[0].pixels_visible = 1, "pixels_visible"),
        (|image| image.bodies[0].visible_box[0] = 0, "visible_boxes"),
        (|image| image.bodies[1].pixels_all = 2, "pixels_all"),
        (|image| image.bodies[1].whole_box[0] = 1, "whole_boxes"),
        (|image| image.bodies[0].mask.bits[0] = 0b111, "masks"),
        (|image| image.bodies[0].mask.left = 3, "mask_boxes"),
        (|image| image.instances[11] = 3, "instances"),
        (|image| image.table[0] = 0.0, "table_size"),
    ];
    for (change, expected) in changes {
        let mut image = if expected.contains("near") { measured() } else { image() };
        change(&mut image);
        let error = SceneImage::decode(&payload(&image)).expect_err(expected);
        let field = match error {
            RecordError::Range { field, .. } | RecordError::Count { field, .. } => field,
            other => panic!("{other:?}"),
        };
        assert_eq!(field, expected);
    }
    // A body seen outside its own silhouette.
    let mut strange = image();
    strange.instances.swap(0, 11);
    strange.bodies[1].visible_box = [0, 1, 4, 2];
    assert!(matches!(SceneImage::decode(&payload(&strange)), Err(RecordError::Range { field: "instances", .. })));
}
