//! Reachability: the hand-written encoders against the generated ones, and what is refused.

use proptest::prelude::*;
use prost::Message;

use super::*;
use crate::codec::{proto, tests::sample};
use kernel::{
    geom::{Axis, AxisUnit, FieldMetric, HealPix, PoseGrid, PoseLabel, Proof},
    ids::{Digest, ObjectId},
};

/// Cells of every label with some proof that fits, and a witness for each reachable one.
fn block() -> impl Strategy<Value = ReachabilityBlock> {
    let cell = (0..3u8, 0..4u8, prop::array::uniform3(-7.0..7.0));
    (sample(), prop::collection::vec(cell, 1..40)).prop_map(|(sample, cells)| {
        let mut block =
            ReachabilityBlock { sample, joints: 3, labels: Vec::new(), proofs: Vec::new(), witnesses: Vec::new() };
        for (label, proof, witness) in cells {
            let label = PoseLabel::from_byte(label).unwrap();
            block.labels.push(label);
            block.proofs.push(Proof::from_byte(proof).unwrap());
            if label == PoseLabel::Reachable {
                *block.proofs.last_mut().unwrap() = Proof::Witness;
                block.witnesses.extend(witness);
            }
        }
        block
    })
}

/// A grid of 2 x 1 x 3 x 1 x 2 x 4 poses.
fn field_header(thesis: bool, robot: String) -> FieldHeader {
    let metres = |name, count| Axis { name, unit: AxisUnit::Metre, first: -0.1, step: 0.1, count, periodic: false };
    let radians = |name, count: usize| {
        let step = std::f64::consts::TAU / count as f64;
        Axis { name, unit: AxisUnit::Radian, first: -std::f64::consts::PI, step, count, periodic: true }
    };
    let axes =
        [metres("x", 2), metres("y", 1), metres("z", 3), radians("roll", 1), radians("pitch", 2), radians("yaw", 4)];
    FieldHeader {
        grid: PoseGrid::new(axes).unwrap(),
        metric: if thesis { FieldMetric::Cells } else { FieldMetric::Metres { rho: 0.127 } },
        robot,
        robot_id: ObjectId(Digest([7; 32])),
        joints: vec!["a".to_owned(), String::new()],
        target: "tool".to_owned(),
        frame: "world".to_owned(),
    }
}

proptest! {
    #[test]
    fn a_block_reads_back_and_has_the_generated_encoders_bytes(block in block()) {
        let mut payload = Vec::new();
        block.encode(&mut payload);
        prop_assert_eq!(&ReachabilityBlock::decode(&payload).unwrap(), &block);
        let generated = proto::ReachabilityBlock::decode(payload.as_slice()).unwrap();
        prop_assert_eq!(generated.encode_to_vec(), payload);
        let facts = block.facts();
        prop_assert_eq!(facts.labels.iter().sum::<u32>(), block.labels.len() as u32);
        prop_assert_eq!(facts.labels[2], facts.proofs[4]);
        let mut witnesses = Vec::new();
        for cell in 0..block.labels.len() {
            witnesses.extend_from_slice(block.witness(cell).unwrap_or_default());
        }
        prop_assert_eq!(witnesses, block.witnesses);
    }

    #[test]
    fn a_block_that_contradicts_itself_is_refused(mut block in block(), index in any::<prop::sample::Index>()) {
        let index = index.index(block.labels.len());
        let changes: [fn(&mut ReachabilityBlock, usize); 4] = [
            |block, index| block.labels[index] = PoseLabel::ALL[(block.labels[index] as usize + 2) % 3],
            |block, _| block.witnesses.push(0.0),
            |block, _| _ = block.proofs.pop(),
            |block, _| block.joints = 0,
        ];
        let was = block.clone();
        for change in changes {
            change(&mut block, index);
            let mut payload = Vec::new();
            block.encode(&mut payload);
            // From "no solution" to "colliding" both stay possible.
            let both_are_out_of_reach = block.labels != was.labels
                && [block.labels[index], was.labels[index]].iter().all(|label| *label != PoseLabel::Reachable);
            prop_assert!(ReachabilityBlock::decode(&payload).is_err() || both_are_out_of_reach);
            block.clone_from(&was);
        }
    }

    #[test]
    fn a_field_reads_back_and_has_the_generated_encoders_bytes(
        labels in prop::collection::vec(0..3u8, 48), thesis in any::<bool>(), robot in "[a-z ü]{0,9}",
    ) {
        let labels: Vec<PoseLabel> = labels.into_iter().filter_map(PoseLabel::from_byte).collect();
        let header = field_header(thesis, robot);
        let field = ReachabilityField { distances: header.distances(&labels), header, labels };
        let mut payload = Vec::new();
        field.encode(&mut payload);
        prop_assert_eq!(&ReachabilityField::decode(&payload).unwrap(), &field);
        let generated = proto::ReachabilityField::decode(payload.as_slice()).unwrap();
        prop_assert_eq!(generated.encode_to_vec(), payload);
        let lies: [fn(&mut proto::ReachabilityField); 8] = [
            |field| field.sign = "positive inside".to_owned(),
            |field| field.unit = "miles".to_owned(),
            |field| field.profile = "other".to_owned(),
            |field| field.radian_weight = f64::NAN,
            |field| field.labels[0] = 3,
            |field| field.distances[3] ^= 0x80,
            |field| field.axes[5].count += 1,
            |field| field.axes.swap(0, 1),
        ];
        for lie in lies {
            let mut lying = generated.clone();
            lie(&mut lying);
            prop_assert!(ReachabilityField::decode(&lying.encode_to_vec()).is_err());
        }
    }

    #[test]
    fn a_field_over_directions_reads_back_and_lies_are_found(labels in prop::collection::vec(0..3u8, 48)) {
        let labels: Vec<PoseLabel> = labels.into_iter().filter_map(PoseLabel::from_byte).collect();
        let position_axes = *field_header(false, String::new()).grid.position_axes();
        let position_axes = position_axes.map(|axis| kernel::geom::Axis { count: 1, ..axis });
        let grid = PoseGrid::on_sphere(position_axes, HealPix::new(1).unwrap(), 4).unwrap();
        let header = FieldHeader { grid, ..field_header(false, "arm".to_owned()) };
        let field = ReachabilityField { distances: header.distances(&labels), header, labels };
        let mut payload = Vec::new();
        field.encode(&mut payload);
        prop_assert_eq!(&ReachabilityField::decode(&payload).unwrap(), &field);
        let generated = proto::ReachabilityField::decode(payload.as_slice()).unwrap();
        prop_assert_eq!(generated.encode_to_vec(), payload);
        let lies: [fn(&mut proto::ReachabilityField); 8] = [
            |field| (field.profile, field.unit, field.radian_weight) = ("thesis".to_owned(), "cells".to_owned(), 0.0),
            |field| field.axes[3].count = 13,
            |field| field.axes[3].unit = "rad".to_owned(),
            |field| field.axes[3].step = 2.0,
            |field| field.axes[4].first = 0.0,
            |field| field.axes[4].count = 0,
            |field| field.axes[0].periodic = true,
            |field| _ = field.axes.pop(),
        ];
        for (index, lie) in lies.into_iter().enumerate() {
            let mut lying = generated.clone();
            lie(&mut lying);
            prop_assert!(ReachabilityField::decode(&lying.encode_to_vec()).is_err(), "lie {index}");
        }
    }
}
