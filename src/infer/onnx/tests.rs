use std::{fs, path::Path};

use proptest::prelude::*;

use super::{Constant, Network, operators::OPERATORS};

fn bytes() -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/models/thicken/model.onnx");
    fs::read(path).expect("the model of the tests")
}

fn read(bytes: &[u8]) -> Result<Network<'_>, crate::ModelProblem> {
    let names = |list: [&str; 2]| list.map(str::to_owned);
    Network::read(bytes, &names(["partial", "free"]), &names(["occupancy", "coverage"]))
}

#[test]
fn operators_are_sorted_and_documented() {
    let text = include_str!("../../../docs/models.md");
    assert!(OPERATORS.is_sorted_by(|one, other| one.0 < other.0));
    for (name, _) in OPERATORS {
        assert!(text.contains(&format!("`{name}`")), "{name} is not in docs/models.md");
    }
}

#[test]
fn the_library_gets_what_the_outputs_need_by_other_names() {
    let bytes = bytes();
    let network = read(&bytes).expect("a network");
    assert_eq!((network.inputs.len(), network.outputs.len()), (2, 2));
    let made = network.nodes.iter().flat_map(|node| &node.outputs).chain(&network.inputs);
    let known: Vec<&str> = made.chain(network.constants.keys()).map(String::as_str).collect();
    for input in network.nodes.iter().flat_map(|node| &node.inputs).filter(|input| !input.is_empty()) {
        assert!(known.contains(&input.as_str()), "{input}");
    }
    assert!(known.iter().all(|name| !name.contains("behind")), "names of the file stay in it");
    // Shapes are known: no -1 is left.
    let wholes = network.constants.values().filter_map(|constant| match constant {
        Constant::Wholes(_, list) => Some(list),
        _ => None,
    });
    assert!(wholes.flatten().all(|whole| *whole >= 0));
    // By hand: its largest layer is 64,000 windows of 2 x 3 x 3 x 13 cells, for 2 channels that take as long as 16.
    let largest = 64_000 * 2 * 3 * 3 * 13 * 16;
    assert!((largest..2 * largest).contains(&network.work), "{}", network.work);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_bytes_make_the_reader_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
        keep in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
        head in 0_usize..4096,
    ) {
        let mut bytes = bytes();
        for (place, value) in changes {
            // Most of the file is weights: changes fall on its ends, where the nodes and texts are.
            let place = place.index(2 * head.max(1));
            let place = if place < head { place } else { bytes.len() - 1 - (place - head) };
            bytes[place] = value;
        }
        if is_cut {
            bytes.truncate(keep.index(bytes.len()));
        }
        if let Err(error) = read(&bytes) {
            prop_assert!(!error.to_string().is_empty());
        }
    }
}
