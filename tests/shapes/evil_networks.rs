//! Networks that need more memory or time than any machine has, or that the library cannot handle: refused before the
//! library reads them, with location and remedy, or run.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use sha2::{Digest, Sha256};

use super::{
    network::MODEL,
    onnx_file::{Attribute, FLOAT, Network, Node, bytes, number},
};
use crate::support::{
    files::{list_names, repository_path},
    program::{Outcome, Program},
    workspace::Workspace,
};

/// Address space of the program: 1 GiB above what it takes for itself.
const MEMORY: &str = "--as=1610612736";
/// Processor time of the program [s].
const SECONDS: &str = "--cpu=8";

/// A model's folder with other files, whose digests are stated.
fn folder_with(workspace: &Workspace, files: &[(&str, &[u8])]) -> PathBuf {
    let folder = workspace.make_folder("model");
    for own in list_names(repository_path(MODEL)) {
        fs::copy(repository_path(MODEL).join(&own), folder.join(&own)).expect("a copy");
    }
    let text = fs::read_to_string(folder.join("model.json")).expect("text");
    let mut facts: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    for (name, content) in files {
        fs::write(folder.join(name), content).expect("written");
        let digest: String = Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect();
        facts["files"][*name] = digest.into();
        if *name == "model.onnx" {
            facts["outputs"] = serde_json::json!(["occupancy"]);
        }
    }
    fs::write(folder.join("model.json"), facts.to_string()).expect("written");
    folder
}

/// A model's folder with another network; its stored samples are grids of zeros.
fn folder(workspace: &Workspace, network: &Network) -> PathBuf {
    let (packed, length) = packed_zeros(1);
    let names = ["partial", "free", "occupancy"].map(|name| format!("{name}.npy"));
    let golden = archive(&names, &packed, length);
    folder_with(workspace, &[("model.onnx", &network.bytes()), ("golden.npz", &golden)])
}

/// An array of zeros for `samples` samples, packed; and its length unpacked.
fn packed_zeros(samples: usize) -> (Vec<u8>, usize) {
    let head = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({samples}, 1, 40, 40, 40), }}\n");
    let plain = [b"\x93NUMPY\x01\x00", &(head.len() as u16).to_le_bytes()[..], head.as_bytes()].concat();
    let plain = [plain, vec![0; samples * 64_000 * 4]].concat();
    let mut packer = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::best());
    std::io::Write::write_all(&mut packer, &plain).expect("packed");
    (packer.finish().expect("packed"), plain.len())
}

/// `model check` under limits of memory and time.
fn check(folder: &Path) -> Outcome {
    let program = Program::of_system("prlimit").args([MEMORY, SECONDS, env!("CARGO_BIN_EXE_graspmill")]);
    program.args(["model", "check"]).arg(folder).finish()
}

/// Checks a network that must be refused with these words.
fn refuse(workspace: &Workspace, network: &Network, words: &str) {
    let began = Instant::now();
    let outcome = check(&folder(workspace, network));
    let text = outcome.text();
    assert_eq!(outcome.code, Some(2), "{words}: {text}");
    assert!(text.contains(words) && text.contains("model.onnx") && !text.contains("panicked"), "{words}: {text}");
    assert!(text.contains("export") || text.contains("docs/models.md"), "a remedy: {text}");
    // Generous, since the machine may be busy; the processor's time has a separate limit.
    assert!(began.elapsed() < Duration::from_secs(30), "{words}");
}

/// A network that ends in `occupancy`, the sigmoid of a tensor.
fn ending(mut network: Network, last: &str) -> Network {
    network.node_to("Sigmoid", &[last], &["occupancy"], &[]);
    network
}

fn ints(values: &[i64]) -> Attribute {
    Attribute::Ints(values.to_vec())
}

#[test]
fn doubled_and_padded_tensors_are_refused() {
    let workspace = Workspace::new();
    // Concatenated with itself 14 and 40 times: 4 GB, and more than there are atoms.
    for times in [14, 40] {
        let mut network = Network::default();
        let mut last = "partial".to_owned();
        for _ in 0..times {
            last = network.node("Concat", &[&last, &last], &[("axis", Attribute::Int(1))]);
        }
        refuse(&workspace, &ending(network, &last), "has more than 16777216 elements");
    }
    let mut network = Network::default();
    let pads = network.wholes(&[0, 0, 1_000_000, 0, 0, 0, 0, 0, 0, 0]);
    let last = network.node("Pad", &["partial", &pads], &[("mode", Attribute::Text("constant".to_owned()))]);
    refuse(&workspace, &ending(network, &last), "pads are [0, 0, 1000000, 0, 0, 0, 0, 0, 0, 0]");
    // Many tensors, each small enough.
    let mut network = Network::default();
    let weights = network.filled(&[200, 1, 1, 1, 1], 0.1);
    for _ in 0..11 {
        network.node("Conv", &["partial", &weights], &[]);
    }
    refuse(&workspace, &ending(network, "partial"), "more than 134217728 elements of tensors that it computes");
}

#[test]
fn orders_windows_and_places_that_are_none_are_refused() {
    let workspace = Workspace::new();
    let mut network = Network::default();
    let last = network.node("Transpose", &["partial"], &[("perm", ints(&[0, 1, 2, 2, 2]))]);
    refuse(
        &workspace,
        &ending(network, &last),
        "Transpose at node 't0' is not supported: axes [0, 1, 2, 2, 2] contain one twice",
    );

    let mut network = Network::default();
    let weights = network.filled(&[1, 1, 3, 3, 3], 0.1);
    let last = network.node("Conv", &["partial", &weights], &[("pads", ints(&[1 << 40; 6]))]);
    refuse(&workspace, &ending(network, &last), "not 6 numbers from 0 to 64");

    let mut network = Network::default();
    let window = [("kernel_shape", ints(&[2, 2, 2])), ("strides", ints(&[0, 0, 0]))];
    let last = network.node("MaxPool", &["partial"], &window);
    refuse(&workspace, &ending(network, &last), "strides is [0, 0, 0], not 3 numbers from 1 to 64");

    let mut network = Network::default();
    let index = network.wholes(&[7]);
    let last = network.node("Gather", &["partial", &index], &[("axis", Attribute::Int(0))]);
    refuse(&workspace, &ending(network, &last), "index 7 is not among the 1 elements along axis 0");

    let mut network = Network::default();
    let (one, zero) = (network.wholes(&[1]), network.wholes(&[0]));
    let none = network.node("Div", &[&one, &zero], &[]);
    let last = network.node("Reshape", &["partial", &none], &[]);
    refuse(&workspace, &ending(network, &last), "[1] and [0] have no result");

    let mut network = Network::default();
    let text = network.floats(&[1], &[0.0]);
    network.tensors[0].kind = 8;
    let last = network.node("Add", &["partial", &text], &[]);
    refuse(&workspace, &ending(network, &last), "the tensor 'c0' has elements of type 8");

    let mut network = Network::default();
    let shape = network.wholes(&[1; 60]);
    let last = network.node("Reshape", &["partial", &shape], &[]);
    refuse(&workspace, &ending(network, &last), "cannot become [1, 1,");
}

#[test]
fn long_chains_and_great_products_are_refused() {
    let workspace = Workspace::new();
    for (count, is_backwards) in [(500, false), (3_000, false), (100_000, false), (20_000, true)] {
        let mut network = Network::default();
        let mut last = "partial".to_owned();
        for _ in 0..count {
            last = network.node("Relu", &[&last], &[]);
        }
        if is_backwards {
            network.nodes.reverse();
        }
        refuse(&workspace, &ending(network, &last), "more than 256 nodes");
    }
    // Backwards, though not too long.
    let mut network = Network::default();
    let first = network.node("Relu", &["partial"], &[]);
    let last = network.node("Relu", &[&first], &[]);
    network.nodes.reverse();
    refuse(&workspace, &ending(network, &last), "no input, initializer or earlier node produces 't0'");

    // A product of constants, which the library would compute once: 2 x 10^11 multiply-adds from nothing.
    let mut network = Network::default();
    let one = network.filled(&[1, 1], 1.0);
    let pads = network.wholes(&[0, 0, 63, 63]);
    let mut wide = network.node("Pad", &[&one, &pads], &[]);
    for _ in 0..6 {
        wide = network.node("Concat", &[&wide, &wide], &[("axis", Attribute::Int(0))]);
        wide = network.node("Concat", &[&wide, &wide], &[("axis", Attribute::Int(1))]);
    }
    let last = network.node("MatMul", &[&wide, &wide], &[]);
    refuse(&workspace, &ending(network, &last), "more than 17179869184 multiply-adds per sample");
}

#[test]
fn tensors_in_other_files_are_refused_wherever_they_may_be() {
    let workspace = Workspace::new();
    let location = bytes(13, &[bytes(1, b"location"), bytes(2, b"../../etc/passwd")].concat());
    let external = [number(2, FLOAT), bytes(8, b"away"), location, number(14, 1)].concat();
    let sparse = bytes(1, &external);
    let network = || {
        let mut network = Network::default();
        network.node_to("Sigmoid", &["partial"], &["occupancy"], &[]);
        network
    };
    let in_attribute = |fields: Vec<u8>| {
        let mut network = network();
        network.nodes[0].attributes.push(("evil".to_owned(), Attribute::Fields(fields)));
        network
    };
    let subgraph = bytes(5, &external);
    let in_model = |field: u64, content: &[u8]| {
        let mut network = network();
        network.more[1] = bytes(field, content);
        network
    };
    let in_graph = |field: u64, content: &[u8]| {
        let mut network = network();
        network.more[0] = bytes(field, content);
        network
    };
    for (network, words) in [
        (in_graph(5, &external), "weights 'away' are in another file"),
        (in_graph(15, &sparse), "it has sparse initializers"),
        (in_attribute(bytes(5, &external)), "weights 'away' are in another file"),
        (in_attribute(bytes(10, &external)), "an attribute that is a list of tensors"),
        (in_attribute(bytes(22, &sparse)), "an attribute that is a sparse tensor"),
        (in_attribute(bytes(23, &sparse)), "an attribute that is a sparse tensor"),
        (in_attribute(bytes(6, &subgraph)), "a node with a graph inside"),
        (in_attribute(bytes(11, &subgraph)), "a node with a graph inside"),
        (in_model(25, &bytes(7, &bytes(5, &bytes(5, &external)))), "local functions"),
        (in_model(20, &bytes(1, &subgraph)), "information for training"),
        (in_model(99, b"new"), "ModelProto has a field 99"),
        (in_graph(14, b"new"), "annotations of quantisation"),
    ] {
        refuse(&workspace, &network, words);
    }
}

#[test]
fn archives_and_texts_that_are_large_unpacked_are_refused() {
    let workspace = Workspace::new();
    let (packed, length) = packed_zeros(64);
    // Names that differ, names that are the same, and more members than there are arrays.
    type Names = fn(usize) -> String;
    let kinds: [(usize, Names, &str); 3] = [
        (12, |index| format!("a{index}.npy"), "its members are larger than 65 MiB together"),
        (3, |_| "partial.npy".to_owned(), "two members have the same name"),
        (60, |index| format!("a{index}.npy"), "it has more than 16 members"),
    ];
    for (count, name, words) in kinds {
        let names: Vec<String> = (0..count).map(name).collect();
        let outcome = check(&folder_with(&workspace, &[("golden.npz", &archive(&names, &packed, length))]));
        let text = outcome.text();
        assert!(outcome.code == Some(2) && text.contains(words) && text.contains("golden.npz"), "{words}: {text}");
    }
    // Files with holes: none of their content is read.
    for (name, bytes, words) in [
        ("card.md", 3 << 30, "it has 3221225472 bytes, and a network's card may have at most 1048576;"),
        ("golden.npz", 3 << 30, "may have at most 67108864;"),
        ("model.onnx", 1 << 31, "may have at most 2146435072;"),
        ("model.json", 3 << 30, "may have at most 1048576;"),
    ] {
        let folder = folder_with(&workspace, &[]);
        fs::File::create(folder.join(name)).and_then(|file| file.set_len(bytes)).expect("a file with a hole");
        let outcome = check(&folder);
        let text = outcome.text();
        assert!(outcome.code == Some(2) && text.contains(words) && text.contains(name), "{name}: {text}");
    }
}

/// An archive whose entries all name one member.
fn archive(names: &[String], packed: &[u8], plain: usize) -> Vec<u8> {
    let sizes = [(packed.len() as u32).to_le_bytes(), (plain as u32).to_le_bytes()].concat();
    let head = |name: &str| {
        [&[20, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0], &sizes[..], &(name.len() as u16).to_le_bytes(), &[0, 0]].concat()
    };
    let mut out = [b"PK\x03\x04".to_vec(), head(&names[0]), names[0].as_bytes().to_vec(), packed.to_vec()].concat();
    let start = out.len() as u32;
    for name in names {
        out.extend(b"PK\x01\x02\x14\x00");
        out.extend(head(name));
        out.extend([0; 14]);
        out.extend(name.as_bytes());
    }
    let length = out.len() as u32 - start;
    out.extend(b"PK\x05\x06\0\0\0\0");
    let count = (names.len() as u16).to_le_bytes();
    out.extend([&count[..], &count, &length.to_le_bytes(), &start.to_le_bytes(), &[0, 0]].concat());
    out
}

/// A network with a node of every operator that is run, which ends in `occupancy`.
fn every_operator() -> Network {
    use Attribute::{Float, Int, Text};
    let mut net = Network::default();
    let text = |word: &str| Text(word.to_owned());
    let [begins, ends, axes, steps] = [[0, 0, 0], [8, 8, 8], [2, 3, 4], [1, 1, 1]].map(|list| net.wholes(&list));
    let mut x = net.node("Slice", &["partial", &begins, &ends, &axes, &steps], &[]);
    let (weights, bias) = (net.filled(&[4, 1, 3, 3, 3], 0.1), net.filled(&[4], 0.0));
    let window = |kernel: i64, stride: i64, pad: i64| {
        let list = |value: i64, count| ints(&vec![value; count]);
        vec![("kernel_shape", list(kernel, 3)), ("strides", list(stride, 3)), ("pads", list(pad, 6))]
    };
    let convolution = |kernel, stride, pad| {
        [window(kernel, stride, pad), vec![("dilations", ints(&[1, 1, 1])), ("group", Int(1))]].concat()
    };
    x = net.node("Conv", &[&x, &weights, &bias], &convolution(3, 1, 1));
    let four: Vec<String> = (0..4).map(|_| net.filled(&[4], 1.0)).collect();
    let ones: Vec<&str> = four.iter().map(String::as_str).collect();
    let training = [("epsilon", Float(1e-5)), ("momentum", Float(0.9)), ("training_mode", Int(0))];
    x = net.node("BatchNormalization", &[&[x.as_str()], &ones[..]].concat(), &training);
    x = net.node("InstanceNormalization", &[&x, ones[0], ones[1]], &[("epsilon", Float(1e-5))]);
    for operator in ["Neg", "Abs", "Sqrt", "Erf", "Exp", "Softplus", "Tanh", "Relu", "Sigmoid", "Identity"] {
        x = net.node(operator, &[&x], &[]);
    }
    x = net.node("Elu", &[&x], &[("alpha", Float(1.0))]);
    x = net.node("LeakyRelu", &[&x], &[("alpha", Float(0.1))]);
    x = net.node("HardSigmoid", &[&x], &[("alpha", Float(0.2)), ("beta", Float(0.5))]);
    let (number, low, high) = (net.floats(&[], &[1.5]), net.floats(&[], &[-9.0]), net.floats(&[], &[9.0]));
    x = net.node("PRelu", &[&x, &number], &[]);
    x = net.node("Clip", &[&x, &low, &high], &[]);
    for operator in ["Add", "Sub", "Mul", "Div"] {
        x = net.node(operator, &[&x, &number], &[]);
    }
    for operator in ["Max", "Min", "Sum"] {
        x = net.node(operator, &[&x, &x], &[]);
    }
    let pooled = [window(2, 2, 0), vec![("ceil_mode", Int(0)), ("storage_order", Int(0))]].concat();
    x = net.node("MaxPool", &[&x], &pooled);
    let weights = net.filled(&[4, 4, 2, 2, 2], 0.1);
    let transposed = [convolution(2, 2, 0), vec![("output_padding", ints(&[0, 0, 0]))]].concat();
    x = net.node("ConvTranspose", &[&x, &weights, &bias], &transposed);
    let pooled = [window(2, 1, 0), vec![("ceil_mode", Int(0)), ("count_include_pad", Int(0))]].concat();
    x = net.node("AveragePool", &[&x], &pooled);
    let (pads, zero) = (net.wholes(&[0, 0, 0, 0, 0, 0, 0, 1, 1, 1]), net.floats(&[], &[0.0]));
    x = net.node("Pad", &[&x, &pads, &zero], &[("mode", text("constant"))]);
    let scales = net.floats(&[5], &[1.0, 1.0, 2.0, 2.0, 2.0]);
    let places = [("mode", text("nearest")), ("nearest_mode", text("floor"))];
    let places = [&places[..], &[("coordinate_transformation_mode", text("asymmetric"))]].concat();
    x = net.node("Resize", &[&x, "", &scales], &places);
    x = net.node("Transpose", &[&x], &[("perm", ints(&[0, 1, 3, 2, 4]))]);
    x = net.node("Concat", &[&x, &x], &[("axis", Int(1))]);
    let halves = net.wholes(&[4, 4]);
    net.node_to("Split", &[&x, &halves], &["half", "other"], &[("axis", Int(1))]);
    x = net.node("Add", &["half", "other"], &[]);
    let (order, zero_axis) = (net.wholes(&[3, 2, 1, 0]), net.wholes(&[0]));
    x = net.node("Gather", &[&x, &order], &[("axis", Int(1))]);
    x = net.node("Unsqueeze", &[&x, &zero_axis], &[]);
    x = net.node("Squeeze", &[&x, &zero_axis], &[]);
    let shape = net.node("Shape", &[&x], &[("start", Int(0))]);
    x = net.node("Reshape", &[&x, &shape], &[("allowzero", Int(0))]);
    x = net.node("Softmax", &[&x], &[("axis", Int(1))]);
    let (mean, most) = (net.node("GlobalAveragePool", &[&x], &[]), net.node("GlobalMaxPool", &[&x], &[]));
    x = net.node("Add", &[&mean, &most], &[]);
    x = net.node("Flatten", &[&x], &[("axis", Int(1))]);
    let (weights, bias, last) = (net.filled(&[3, 4], 1.0), net.filled(&[3], 1.0), net.filled(&[3, 2], 1.0));
    let gemm = [("alpha", Float(1.0)), ("beta", Float(1.0)), ("transA", Int(0)), ("transB", Int(1))];
    x = net.node("Gemm", &[&x, &weights, &bias], &gemm);
    x = net.node("MatMul", &[&x, &last], &[]);
    let second = net.wholes(&[1]);
    for operator in ["ReduceMean", "ReduceSum", "ReduceMax"] {
        x = net.node(operator, &[&x, &second], &[("keepdims", Int(1)), ("noop_with_empty_axes", Int(0))]);
    }
    let list = net.node("Constant", &[], &[("value_ints", ints(&[1, 1, 1, 1, 1]))]);
    let list = net.node("Cast", &[&list], &[("to", Int(7))]);
    x = net.node("Reshape", &[&x, &list], &[]);
    x = net.node("Add", &["free", &x], &[]);
    ending(net, &x)
}

/// Every network that differs from one in an attribute, an input or a constant, with what was done.
fn mutations(whole: &Network) -> Vec<(String, Network)> {
    let mut found = Vec::new();
    let mut push = |what: String, change: &dyn Fn(&mut Network)| {
        let mut network = whole.clone();
        change(&mut network);
        found.push((what, network));
    };
    let extremes = [0, -1, 7, 65, 1 << 31, 1 << 40, i64::MAX, i64::MIN];
    for (place, Node { operator, attributes, .. }) in whole.nodes.iter().enumerate() {
        for (at, (name, value)) in attributes.iter().enumerate() {
            let other_values: Vec<Attribute> = match value {
                Attribute::Int(_) => extremes.map(Attribute::Int).to_vec(),
                Attribute::Ints(list) => {
                    let first = |value: i64| Attribute::Ints([&[value], &list[1..]].concat());
                    let all = |value: i64| Attribute::Ints(vec![value; list.len()]);
                    extremes
                        .iter()
                        .flat_map(|value| [first(*value), all(*value)])
                        .chain([ints(&[]), ints(&[1; 1000])])
                        .collect()
                }
                Attribute::Float(_) => [f32::NAN, f32::INFINITY, -1e38, 1e-45].map(Attribute::Float).to_vec(),
                _ => ["", "cubic", "\u{1b}[31m"].map(|word| Attribute::Text(word.to_owned())).to_vec(),
            };
            let other_kind = Attribute::Text("text".to_owned());
            for other in other_values.into_iter().chain([other_kind]) {
                let what = format!("{operator} with {name} = {other:?}");
                push(what.chars().take(120).collect(), &|network| {
                    network.nodes[place].attributes[at].1 = other.clone()
                });
            }
        }
        push(format!("{operator} with an unknown attribute"), &|network| {
            network.nodes[place].attributes.push(("evil".to_owned(), Attribute::Int(1)));
        });
        push(format!("{operator} without inputs"), &|network| network.nodes[place].inputs.clear());
        push(format!("{operator} with one more output"), &|network| {
            network.nodes[place].outputs.push("more".to_owned());
        });
        push(format!("{operator} of its own output"), &|network| {
            let own = network.nodes[place].outputs[0].clone();
            network.nodes[place].inputs.iter_mut().for_each(|input| input.clone_from(&own));
        });
        push(format!("{operator} of a whole grid"), &|network| {
            network.nodes[place].inputs.first_mut().into_iter().for_each(|input| *input = "free".to_owned());
        });
    }
    for place in 0..whole.tensors.len() {
        for dims in [vec![], vec![0], vec![-1], vec![1 << 40], vec![i64::MAX, 2], vec![1; 9]] {
            push(format!("constant {place} of shape {dims:?}"), &|network| {
                network.tensors[place].dims.clone_from(&dims)
            });
        }
        for kind in [0, 8, 11, 16, 99] {
            push(format!("constant {place} of type {kind}"), &|network| network.tensors[place].kind = kind);
        }
        for raw in [[0xff; 8], [0x7f; 8]] {
            push(format!("constant {place} with other numbers"), &|network| {
                let list = &mut network.tensors[place].raw;
                let count = list.len().min(8);
                list[..count].copy_from_slice(&raw[..count]);
            });
        }
    }
    found
}

/// Lets the program check every n-th mutation; counts those that were refused and those that ran.
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn check_mutations(step: usize) {
    let (workspace, whole) = (Workspace::new(), every_operator());
    let run = check(&folder(&workspace, &whole));
    assert_eq!(run.code, Some(4), "it runs, and answers otherwise than the stored samples: {}", run.text());
    // The message of a refusal lists the operators: none is left out here.
    let mut other = whole.clone();
    other.nodes[0].operator = "Loop".to_owned();
    let text = check(&folder(&workspace, &other)).text();
    let (_, listed) = text.split_once("networks may use ").expect("the operators");
    for operator in listed.trim().split(", ") {
        assert!(whole.nodes.iter().any(|node| node.operator == operator), "no node is a {operator}");
    }
    let (mut tried, mut ran, mut failures) = (0, 0, Vec::new());
    for (what, network) in mutations(&whole).into_iter().step_by(step) {
        let outcome = check(&folder(&workspace, &network));
        let text = outcome.text();
        tried += 1;
        ran += u32::from(outcome.code != Some(2));
        let is_clear =
            matches!(outcome.code, Some(0 | 2 | 4)) && !text.contains("panicked") && !text.contains('\u{1b}');
        if !is_clear {
            failures.push(format!("{what}: {:?} {}", outcome.code, text.chars().take(300).collect::<String>()));
        }
    }
    println!("networks: {tried} tried, {ran} of them run, {} failed", failures.len());
    assert!(failures.is_empty() && tried >= 300, "{tried} tried\n{}", failures.join("\n"));
}

#[test]
#[ignore = "slow: hundreds of networks"]
fn hundreds_of_evil_networks_are_refused_or_run() {
    check_mutations(3);
}

#[test]
#[ignore = "slow: more than a thousand networks"]
fn all_evil_networks_are_refused_or_run() {
    check_mutations(1);
}
