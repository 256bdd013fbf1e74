//! Depth: the hand-written encoder against the generated one; ids of samples for the tests of all products.

use proptest::prelude::*;
use prost::Message;

use super::*;
use kernel::geom::DepthCrop;

/// Any id of a sample.
pub(crate) fn sample() -> impl Strategy<Value = SampleId> {
    (any::<[u8; 32]>(), any::<u32>(), any::<u32>(), any::<u32>()).prop_map(|(subject, instance, item, camera)| {
        SampleId { subject: ObjectId(Digest(subject)), instance, item: ItemId(item), camera }
    })
}

proptest! {
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
                let max = if coding == DepthCoding::F32 { 0.0 } else { 0.5e-4 + 1e-6 };
                prop_assert!(read.is_nan() && depth.is_nan() || (read - depth).abs() <= max, "{} {}", read, depth);
            }
            let generated = proto::Depth::decode(payload.as_slice()).unwrap();
            prop_assert_eq!(generated.encode_to_vec(), payload);
        }
    }
}
