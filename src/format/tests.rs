//! The table of products as a whole: names, topics and schemas, and decoders that meet any bytes.

use proptest::prelude::*;

use super::*;

proptest! {
    #[test]
    fn no_bytes_make_a_decoder_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for product in Product::all() {
            let mut check = (checks_of(product).samples)();
            for channel in product.channels() {
                let _ = check_record(check.as_mut(), channel, &bytes);
            }
        }
        let _ = ReachabilityField::decode(&bytes);
    }
}

#[test]
fn every_channel_has_its_topic_and_its_message() {
    let text = |channel: Channel| String::from_utf8_lossy(channel.descriptors).into_owned();
    for channel in Product::all().flat_map(Product::channels) {
        assert_eq!(Channel::from_topic(channel.topic), Some(channel));
        let product = channel.product();
        assert_eq!(channel.topic, format!("/{product}/{}", channel.name()));
        let descriptors = text(channel);
        assert!(descriptors.contains(channel.message.trim_start_matches("graspmill.")));
        assert!(!descriptors.contains("Topic /"), "comments must not be in shards");
    }
    assert_eq!(Channel::from_topic("/completion/colour"), None);
    for product in Product::all() {
        assert_eq!(product.leading().product(), product);
        assert_eq!(Product::from_name(product.name), Some(product));
    }
    let pair = text(Channel::PAIR);
    assert!(!pair.contains("Reachability"), "one product's shards must not change with another's");
    assert!(!pair.contains("Tactile"), "shards without touch must not change with it");
    assert!(!text(Channel::TOUCH_RAYS).contains("Hand"), "shards of rays must not change with touch by hands");
    assert!(text(Channel::BLOCK).contains("ReachabilityField"));
}
