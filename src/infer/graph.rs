//! ONNX by `tract`: the only file that names the library.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
};

use tract_onnx::{
    pb::{GraphProto, ModelProto, TensorProto, ValueInfoProto, tensor_proto::DataLocation, type_proto},
    prelude::*,
};

use crate::{error::ModelProblem, folder::RESOLUTION};

/// The set of operators that networks are exported with.
const OPERATOR_SET: i64 = 18;
/// `TensorProto.DataType.FLOAT`.
const FLOAT: i32 = 1;
/// Operators that are run: what completion networks are made of, nothing with a graph inside.
const OPERATORS: &[&str] = &[
    "Add",
    "AveragePool",
    "BatchNormalization",
    "Cast",
    "Clip",
    "Concat",
    "Constant",
    "Conv",
    "ConvTranspose",
    "Div",
    "Flatten",
    "Gather",
    "Gemm",
    "GlobalAveragePool",
    "Identity",
    "LeakyRelu",
    "MatMul",
    "Max",
    "MaxPool",
    "Min",
    "Mul",
    "Pad",
    "ReduceMean",
    "Relu",
    "Reshape",
    "Shape",
    "Sigmoid",
    "Slice",
    "Split",
    "Sqrt",
    "Squeeze",
    "Sub",
    "Tanh",
    "Transpose",
    "Unsqueeze",
];

/// A network that runs: one sample per call, one call per thread.
pub(crate) struct Graph(Arc<TypedRunnableModel>);

impl Graph {
    /// Checks a network and prepares it.
    pub(crate) fn open(bytes: &[u8], inputs: &[String], outputs: &[String]) -> Result<Self, ModelProblem> {
        let reader = tract_onnx::onnx().with_ignore_value_info(true);
        let not_onnx = |error: TractError| ModelProblem::NotOnnx { found: one_line(&error) };
        let proto = reader.proto_model_for_read(&mut &*bytes).map_err(not_onnx)?;
        check(&proto, inputs, outputs)?;
        // The library meets files that nobody has checked as closely as it expects: what it gives up on is refused.
        let made = catch_unwind(AssertUnwindSafe(|| prepare(&reader, &proto, inputs.len(), outputs)));
        match made {
            Ok(Ok(graph)) => graph,
            Ok(Err(error)) => Err(ModelProblem::Network { found: one_line(&error) }),
            Err(panic) => Err(ModelProblem::Network { found: panic_text(&*panic) }),
        }
    }

    /// Outputs of one sample; each input and output has a number per cell.
    pub(crate) fn run(&self, inputs: &[&[f32]]) -> Result<Vec<Vec<f32>>, String> {
        let n = RESOLUTION as usize;
        let run = || -> TractResult<Vec<Vec<f32>>> {
            let tensors =
                inputs.iter().map(|values| Tensor::from_shape(&[1, 1, n, n, n], values).map(IntoTValue::into_tvalue));
            let results = self.0.run(tensors.collect::<TractResult<_>>()?)?;
            results.iter().map(|values| Ok(values.to_plain_array_view::<f32>()?.iter().copied().collect())).collect()
        };
        match catch_unwind(AssertUnwindSafe(run)) {
            Ok(result) => result.map_err(|error| one_line(&error)),
            Err(panic) => Err(panic_text(&*panic)),
        }
    }
}

fn prepare(
    reader: &tract_onnx::Onnx,
    proto: &ModelProto,
    inputs: usize,
    outputs: &[String],
) -> TractResult<Result<Graph, ModelProblem>> {
    let n = RESOLUTION as usize;
    let mut model = reader.model_for_proto_model(proto)?;
    for index in 0..inputs {
        model.set_input_fact(index, f32::fact([1, 1, n, n, n]).into())?;
    }
    let model = model.into_optimized()?;
    for (index, name) in outputs.iter().enumerate() {
        let fact = model.output_fact(index)?;
        let shape = fact.shape.as_concrete().map(<[usize]>::to_vec);
        if fact.datum_type != f32::datum_type() || shape != Some(vec![1, 1, n, n, n]) {
            let found = format!("{:?} of shape {:?}", fact.datum_type, fact.shape);
            return Ok(Err(ModelProblem::Shape { name: name.clone(), found, resolution: RESOLUTION }));
        }
    }
    Ok(Ok(Graph(model.into_runnable()?)))
}

/// Refuses what this program does not run, before the library reads it.
fn check(proto: &ModelProto, inputs: &[String], outputs: &[String]) -> Result<(), ModelProblem> {
    let set = proto.opset_import.iter().find(|set| set.domain.is_empty() || set.domain == "ai.onnx");
    if set.map(|set| set.version) != Some(OPERATOR_SET) {
        let found = set.map_or("is not stated".to_owned(), |set| set.version.to_string());
        return Err(ModelProblem::OperatorSet { found, wanted: OPERATOR_SET });
    }
    let not_onnx = |found: &str| ModelProblem::NotOnnx { found: found.to_owned() };
    let graph = proto.graph.as_ref().ok_or_else(|| not_onnx("it has no graph"))?;
    for node in &graph.node {
        let is_own = node.domain.is_empty() || node.domain == "ai.onnx";
        if !is_own || !OPERATORS.contains(&node.op_type.as_str()) {
            let domain = if is_own { String::new() } else { format!("{}.", node.domain) };
            let operator = format!("{domain}{}", node.op_type);
            return Err(ModelProblem::Operator { operator, node: node.name.clone(), allowed: OPERATORS.join(", ") });
        }
    }
    let attributes = graph.node.iter().flat_map(|node| &node.attribute);
    let constants = attributes.filter_map(|attribute| attribute.t.as_ref());
    let is_external = |tensor: &&TensorProto| {
        !tensor.external_data.is_empty() || tensor.data_location == Some(DataLocation::External as i32)
    };
    if let Some(tensor) = graph.initializer.iter().chain(constants).find(is_external) {
        return Err(ModelProblem::ExternalData { tensor: tensor.name.clone() });
    }
    check_ends(graph, inputs, outputs)
}

/// Refuses inputs and outputs that are not those of `model.json`.
fn check_ends(graph: &GraphProto, inputs: &[String], outputs: &[String]) -> Result<(), ModelProblem> {
    let is_weight = |info: &&ValueInfoProto| graph.initializer.iter().any(|tensor| tensor.name == info.name);
    let free: Vec<&ValueInfoProto> = graph.input.iter().filter(|info| !is_weight(info)).collect();
    let names = |infos: &[&ValueInfoProto]| infos.iter().map(|info| info.name.clone()).collect::<Vec<_>>();
    let results: Vec<&ValueInfoProto> = graph.output.iter().collect();
    for (what, found, stated) in [("inputs", names(&free), inputs), ("outputs", names(&results), outputs)] {
        if found != stated {
            return Err(ModelProblem::Ends { what, found: found.join(", "), stated: stated.join(", ") });
        }
    }
    for info in free {
        let value = info.r#type.as_ref().and_then(|kind| kind.value.as_ref());
        let Some(type_proto::Value::TensorType(tensor)) = value else {
            let (name, found) = (info.name.clone(), "no tensor".to_owned());
            return Err(ModelProblem::Shape { name, found, resolution: RESOLUTION });
        };
        let dims = tensor.shape.as_ref().map(|shape| shape.dim.as_slice()).unwrap_or_default();
        let text = |dim: &tract_onnx::pb::tensor_shape_proto::Dimension| match &dim.value {
            Some(tract_onnx::pb::tensor_shape_proto::dimension::Value::DimValue(value)) => value.to_string(),
            _ => "?".to_owned(),
        };
        let shape: Vec<String> = dims.iter().map(text).collect();
        let n = RESOLUTION.to_string();
        let is_ours = shape.len() == 5
            && ["?", "1"].contains(&shape[0].as_str())
            && shape[1..] == ["1".to_owned(), n.clone(), n.clone(), n];
        if tensor.elem_type != FLOAT || !is_ours {
            let kind =
                if tensor.elem_type == FLOAT { "float32".to_owned() } else { format!("of type {}", tensor.elem_type) };
            let found = format!("{kind} of shape ({})", shape.join(", "));
            return Err(ModelProblem::Shape { name: info.name.clone(), found, resolution: RESOLUTION });
        }
    }
    let made =
        graph.node.iter().flat_map(|node| &node.output).chain(graph.initializer.iter().map(|tensor| &tensor.name));
    let made: std::collections::BTreeSet<&String> = made.chain(inputs).collect();
    match graph.output.iter().find(|info| !made.contains(&info.name)) {
        Some(info) => Err(ModelProblem::NotOnnx { found: format!("no node makes the output {}", info.name) }),
        None => Ok(()),
    }
}

/// An error of the library with its causes, in one line of bounded length.
fn one_line(error: &TractError) -> String {
    let text = format!("{error:#}").split_whitespace().collect::<Vec<_>>().join(" ");
    text.chars().take(300).collect()
}

fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("the library gave up").chars().take(300).collect()
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use prost::Message;
    use tract_onnx::pb::{OperatorSetIdProto, StringStringEntryProto, tensor_shape_proto};

    use super::*;

    fn bytes() -> Vec<u8> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/models/thicken/model.onnx");
        fs::read(path).expect("the model of the tests")
    }

    fn inputs() -> [String; 2] {
        ["partial", "free"].map(str::to_owned)
    }

    fn outputs() -> [String; 2] {
        ["occupancy", "coverage"].map(str::to_owned)
    }

    /// The words with which a changed network is refused.
    fn refusal(change: impl Fn(&mut ModelProto)) -> String {
        let mut proto = ModelProto::decode(&*bytes()).expect("a network");
        change(&mut proto);
        Graph::open(&proto.encode_to_vec(), &inputs(), &outputs()).err().expect("a refusal").to_string()
    }

    fn graph(proto: &mut ModelProto) -> &mut GraphProto {
        proto.graph.as_mut().expect("a graph")
    }

    #[test]
    fn the_network_of_the_tests_is_taken() {
        assert!(Graph::open(&bytes(), &inputs(), &outputs()).is_ok());
    }

    #[test]
    fn a_network_without_coverage_is_taken() {
        let mut proto = ModelProto::decode(&*bytes()).expect("a network");
        graph(&mut proto).output.retain(|output| output.name == "occupancy");
        let bytes = proto.encode_to_vec();
        let graph = Graph::open(&bytes, &inputs(), &outputs()[..1]).unwrap_or_else(|error| panic!("{error}"));
        let field = vec![0.0; 64_000];
        assert_eq!(graph.run(&[&field, &field]).expect("an answer").len(), 1);
    }

    #[test]
    fn other_networks_are_refused_with_the_remedy() {
        let dims = |info: &mut ValueInfoProto, axis: usize, value: i64| {
            let Some(type_proto::Value::TensorType(tensor)) = info.r#type.as_mut().and_then(|kind| kind.value.as_mut())
            else {
                panic!("a tensor")
            };
            let dim = &mut tensor.shape.as_mut().expect("a shape").dim[axis];
            dim.value = Some(tensor_shape_proto::dimension::Value::DimValue(value));
        };
        type Change<'a> = &'a dyn Fn(&mut ModelProto);
        let changes: [(&str, Change<'_>); 14] = [
            ("operator set 17; export the network with operator set 18", &|proto| proto.opset_import[0].version = 17),
            ("operator set is not stated", &|proto| proto.opset_import.clear()),
            ("it has no graph", &|proto| proto.graph = None),
            ("operator Loop at node 'behind' is not run", &|proto| {
                let node = graph(proto).node.iter_mut().find(|node| node.name == "behind");
                node.expect("a node").op_type = "Loop".to_owned();
            }),
            ("operator com.example.Conv", &|proto| {
                proto.opset_import.push(OperatorSetIdProto { domain: "com.example".to_owned(), version: 1 });
                let node = graph(proto).node.iter_mut().find(|node| node.name == "behind");
                node.expect("a node").domain = "com.example".to_owned();
            }),
            ("weights 'behind.weight' lie in another file", &|proto| {
                let tensor = graph(proto).initializer.iter_mut().find(|tensor| tensor.name == "behind.weight");
                let tensor = tensor.expect("a tensor");
                tensor.raw_data = Vec::new();
                tensor.data_location = Some(DataLocation::External as i32);
                let value = "../../../etc/passwd".to_owned();
                tensor.external_data.push(StringStringEntryProto { key: "location".to_owned(), value });
            }),
            ("inputs are free, partial; model.json says partial, free", &|proto| graph(proto).input.swap(0, 1)),
            ("inputs are partial; model.json", &|proto| _ = graph(proto).input.pop()),
            ("outputs are occupancy; model.json", &|proto| _ = graph(proto).output.pop()),
            ("free is float32 of shape (?, 1, 32, 40, 40)", &|proto| dims(&mut graph(proto).input[1], 2, 32)),
            ("partial is float32 of shape (8, 1, 40, 40, 40)", &|proto| dims(&mut graph(proto).input[0], 0, 8)),
            ("no node makes the output coverage", &|proto| {
                let graph = graph(proto);
                graph.node.retain(|node| node.output != ["coverage"]);
            }),
            ("the network cannot be run", &|proto| {
                let tensor = graph(proto).initializer.iter_mut().find(|tensor| tensor.name == "behind.weight");
                tensor.expect("a tensor").dims[1] = 3;
            }),
            ("the network cannot be run", &|proto| {
                let tensor = graph(proto).initializer.iter_mut().find(|tensor| tensor.name == "behind.weight");
                tensor.expect("a tensor").raw_data.truncate(12);
            }),
        ];
        for (says, change) in changes {
            let said = refusal(change);
            assert!(said.contains(says), "{says}: {said}");
        }
        let text = Graph::open(b"{\"a\": 1}", &inputs(), &outputs()).err().expect("a refusal").to_string();
        assert!(text.contains("it is no ONNX model"), "{text}");
    }

    #[test]
    fn a_network_of_another_size_inside_is_refused_by_its_output() {
        let said = refusal(|proto| {
            let graph = graph(proto);
            let node = graph.node.iter_mut().find(|node| node.op_type == "Sigmoid" && node.output == ["coverage"]);
            // The sum of both channels instead of one of them.
            node.expect("a node").input = vec!["logits".to_owned()];
        });
        assert!(said.contains("coverage is") && said.contains("must be float32"), "{said}");
    }
}
