//! ONNX by `tract`: the only file that names the library.

use std::sync::Arc;

use tract_onnx::{
    pb::{
        AttributeProto, GraphProto, ModelProto, NodeProto, OperatorSetIdProto, TensorProto, TensorShapeProto,
        TypeProto, ValueInfoProto, attribute_proto::AttributeType, tensor_proto::DataType, tensor_shape_proto,
        type_proto,
    },
    prelude::*,
};

use crate::{
    error::ModelProblem,
    folder::RESOLUTION,
    onnx::{Attribute, Constant, Network, Node},
    silence,
};

/// Operator set of the networks for the library.
const OPERATOR_SET: i64 = 18;

/// A prepared network: one sample per call, one call per thread.
pub(crate) struct Graph(Arc<TypedRunnableModel>);

impl Graph {
    /// Prepares a checked and rewritten network.
    pub(crate) fn prepare(written: Written, outputs: &[String]) -> Result<Self, ModelProblem> {
        let failed = |found: String| ModelProblem::Network { found };
        // A network that the library still cannot prepare is refused.
        let made = silence::catch(|| into_plan(written));
        let (plan, facts) = made.map_err(failed)?.map_err(|error| failed(one_line(&error)))?;
        for (name, found) in outputs.iter().zip(facts) {
            if let Some(found) = found {
                return Err(ModelProblem::Shape { name: name.clone(), found, resolution: RESOLUTION });
            }
        }
        Ok(Self(plan))
    }

    /// Outputs of one sample; each input and output has one number per cell.
    pub(crate) fn run(&self, inputs: &[&[f32]]) -> Result<Vec<Vec<f32>>, String> {
        let n = RESOLUTION as usize;
        let run = || -> TractResult<Vec<Vec<f32>>> {
            let tensors =
                inputs.iter().map(|values| Tensor::from_shape(&[1, 1, n, n, n], values).map(IntoTValue::into_tvalue));
            let results = self.0.run(tensors.collect::<TractResult<_>>()?)?;
            results.iter().map(|values| Ok(values.to_plain_array_view::<f32>()?.iter().copied().collect())).collect()
        };
        silence::catch(run)?.map_err(|error| one_line(&error))
    }
}

/// A network in the library's types, with copies of its weights, so that its file is no longer needed.
pub(crate) struct Written(ModelProto);

type Plan = Arc<TypedRunnableModel>;

/// Execution plan of a network, and for each output the text about a wrong type or shape.
fn into_plan(Written(proto): Written) -> TractResult<(Plan, Vec<Option<String>>)> {
    let n = RESOLUTION as usize;
    let model = tract_onnx::onnx().with_ignore_value_info(true).model_for_proto_model(&proto)?;
    // The model contains the weights now; otherwise a large network would be in memory twice.
    drop(proto);
    let model = model.into_optimized()?;
    let facts = (0..model.outputs.len()).map(|index| {
        let fact = model.output_fact(index)?;
        let shape = fact.shape.as_concrete().map(<[usize]>::to_vec);
        let fits = fact.datum_type == f32::datum_type() && shape == Some(vec![1, 1, n, n, n]);
        Ok((!fits).then(|| format!("{:?} of shape {:?}", fact.datum_type, fact.shape)))
    });
    let facts = facts.collect::<TractResult<_>>()?;
    Ok((model.into_runnable()?, facts))
}

impl Written {
    /// Writes a network.
    pub(crate) fn of(network: Network<'_>) -> Self {
        let Network { inputs, outputs, nodes, constants, .. } = network;
        let graph = GraphProto {
            node: nodes.into_iter().enumerate().map(|(number, node)| node_of(number, node)).collect(),
            initializer: constants.into_iter().map(|(name, constant)| tensor_of(name, constant)).collect(),
            input: inputs.into_iter().map(end_of).collect(),
            output: outputs.into_iter().map(end_of).collect(),
            ..GraphProto::default()
        };
        let set = OperatorSetIdProto { domain: String::new(), version: OPERATOR_SET };
        Self(ModelProto { opset_import: vec![set], graph: Some(graph), ..ModelProto::default() })
    }
}

fn node_of(number: usize, node: Node) -> NodeProto {
    let Node { operator, inputs, outputs, attributes } = node;
    NodeProto {
        name: format!("n{number}"),
        op_type: operator.to_owned(),
        input: inputs,
        output: outputs,
        attribute: attributes.into_iter().map(|(name, value)| attribute_of(name, value)).collect(),
        ..NodeProto::default()
    }
}

fn attribute_of(name: &str, value: Attribute) -> AttributeProto {
    let named = AttributeProto { name: name.to_owned(), ..AttributeProto::default() };
    match value {
        Attribute::Int(i) => AttributeProto { r#type: AttributeType::Int.into(), i, ..named },
        Attribute::Float(f) => AttributeProto { r#type: AttributeType::Float.into(), f, ..named },
        Attribute::Text(text) => AttributeProto { r#type: AttributeType::String.into(), s: text.into(), ..named },
        Attribute::Ints(ints) => AttributeProto { r#type: AttributeType::Ints.into(), ints, ..named },
    }
}

fn tensor_of(name: String, constant: Constant<'_>) -> TensorProto {
    let bytes_of = |list: &[f32]| list.iter().flat_map(|value| value.to_le_bytes()).collect();
    let (sides, kind, raw_data) = match constant {
        Constant::Raw(sides, bytes) => (sides, DataType::Float, bytes.to_vec()),
        Constant::Floats(sides, list) => (sides, DataType::Float, bytes_of(&list)),
        Constant::Wholes(sides, list) => {
            (sides, DataType::Int64, list.iter().flat_map(|value| value.to_le_bytes()).collect())
        }
    };
    let dims = sides.into_iter().map(|side| side as i64).collect();
    TensorProto { name, dims, data_type: kind.into(), raw_data, ..TensorProto::default() }
}

/// An input or output: one sample.
fn end_of(name: String) -> ValueInfoProto {
    let n = i64::from(RESOLUTION);
    let side = |value| tensor_shape_proto::Dimension {
        value: Some(tensor_shape_proto::dimension::Value::DimValue(value)),
        ..Default::default()
    };
    let shape = TensorShapeProto { dim: [1, 1, n, n, n].map(side).to_vec() };
    let tensor = type_proto::Tensor { elem_type: DataType::Float.into(), shape: Some(shape) };
    let r#type = TypeProto { value: Some(type_proto::Value::TensorType(tensor)), ..TypeProto::default() };
    ValueInfoProto { name, r#type: Some(r#type), ..ValueInfoProto::default() }
}

/// An error of the library with its causes, as one line of bounded length.
fn one_line(error: &TractError) -> String {
    let text = format!("{error:#}").split_whitespace().collect::<Vec<_>>().join(" ");
    text.chars().take(300).flat_map(char::escape_debug).collect()
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use prost::Message;
    use tract_onnx::pb::{StringStringEntryProto, tensor_proto::DataLocation};

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

    fn open(bytes: &[u8], outputs: &[String]) -> Result<Graph, ModelProblem> {
        Network::read(bytes, &inputs(), outputs).and_then(|network| Graph::prepare(Written::of(network), outputs))
    }

    /// Message with which a changed network is refused.
    fn refusal(change: impl Fn(&mut ModelProto)) -> String {
        let mut proto = ModelProto::decode(&*bytes()).expect("a network");
        change(&mut proto);
        open(&proto.encode_to_vec(), &outputs()).err().expect("a refusal").to_string()
    }

    fn graph(proto: &mut ModelProto) -> &mut GraphProto {
        proto.graph.as_mut().expect("a graph")
    }

    #[test]
    fn the_network_of_the_tests_is_taken() {
        assert!(open(&bytes(), &outputs()).is_ok());
    }

    #[test]
    fn a_network_without_coverage_is_taken() {
        let mut proto = ModelProto::decode(&*bytes()).expect("a network");
        graph(&mut proto).output.retain(|output| output.name == "occupancy");
        let bytes = proto.encode_to_vec();
        let graph = open(&bytes, &outputs()[..1]).unwrap_or_else(|error| panic!("{error}"));
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
            ("operator Loop at node 'behind' is not supported", &|proto| {
                let node = graph(proto).node.iter_mut().find(|node| node.name == "behind");
                node.expect("a node").op_type = "Loop".to_owned();
            }),
            ("operator com.example.Conv", &|proto| {
                proto.opset_import.push(OperatorSetIdProto { domain: "com.example".to_owned(), version: 1 });
                let node = graph(proto).node.iter_mut().find(|node| node.name == "behind");
                node.expect("a node").domain = "com.example".to_owned();
            }),
            ("weights 'behind.weight' are in another file", &|proto| {
                let tensor = graph(proto).initializer.iter_mut().find(|tensor| tensor.name == "behind.weight");
                let tensor = tensor.expect("a tensor");
                tensor.raw_data = Vec::new();
                tensor.data_location = Some(DataLocation::External as i32);
                let value = "../../../etc/passwd".to_owned();
                tensor.external_data.push(StringStringEntryProto { key: "location".to_owned(), value });
            }),
            ("inputs are free, partial, but model.json states partial, free", &|proto| graph(proto).input.swap(0, 1)),
            ("inputs are partial, but model.json", &|proto| _ = graph(proto).input.pop()),
            ("outputs are occupancy, but model.json", &|proto| _ = graph(proto).output.pop()),
            ("free is float32 of shape (?, 1, 32, 40, 40)", &|proto| dims(&mut graph(proto).input[1], 2, 32)),
            ("partial is float32 of shape (8, 1, 40, 40, 40)", &|proto| dims(&mut graph(proto).input[0], 0, 8)),
            ("no node produces the output coverage", &|proto| {
                let graph = graph(proto);
                graph.node.retain(|node| node.output != ["coverage"]);
            }),
            ("'behind.weight' has a size that differs from its shape (2, 3, 3, 3, 13)", &|proto| {
                let tensor = graph(proto).initializer.iter_mut().find(|tensor| tensor.name == "behind.weight");
                tensor.expect("a tensor").dims[1] = 3;
            }),
            ("has a size that differs from its shape", &|proto| {
                let tensor = graph(proto).initializer.iter_mut().find(|tensor| tensor.name == "behind.weight");
                tensor.expect("a tensor").raw_data.truncate(12);
            }),
        ];
        for (says, change) in changes {
            let said = refusal(change);
            assert!(said.contains(says), "{says}: {said}");
        }
        let text = open(b"{\"a\": 1}", &outputs()).err().expect("a refusal").to_string();
        assert!(text.contains("it is not an ONNX model"), "{text}");
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
