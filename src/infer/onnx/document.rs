//! Content of an ONNX file: nodes, attributes and tensors, read with bounds. Unsupported parts are refused by name and unknown
//! fields by number; only texts for people are skipped.
//!
//! Source: `onnx.proto3` of ONNX 1.17, intermediate representation 10.

use super::{
    bounds,
    fault::Fault,
    wire::{Field, Fields, push},
};
use crate::error::ModelProblem;

/// Required operator set of networks.
const OPERATOR_SET: i64 = 18;

/// Type of a tensor's elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Elements {
    /// `FLOAT`, single precision.
    Float,
    /// `INT64`.
    Whole,
    /// Another type, by its number in ONNX.
    Other(i64),
}

/// A tensor in the file.
#[derive(Clone, Debug)]
pub(super) struct TensorText<'a> {
    pub name: &'a str,
    pub dims: Vec<i64>,
    pub elements: Elements,
    /// Little-endian elements in `raw_data`.
    pub raw: &'a [u8],
    /// Elements in `float_data`.
    pub floats: Vec<f32>,
    /// Elements in `int64_data`.
    pub wholes: Vec<i64>,
    /// Whether its elements are in another file.
    pub is_external: bool,
}

/// Value of an attribute.
#[derive(Clone, Debug)]
pub(super) enum AttributeText<'a> {
    Float(f32),
    Int(i64),
    Text(&'a str),
    Tensor(TensorText<'a>),
    Floats(Vec<f32>),
    Ints(Vec<i64>),
}

/// A node in the file.
#[derive(Clone, Debug, Default)]
pub(super) struct NodeText<'a> {
    pub name: &'a str,
    pub operator: &'a str,
    pub domain: &'a str,
    /// Names of tensors; empty for an omitted optional one.
    pub inputs: Vec<&'a str>,
    pub outputs: Vec<&'a str>,
    pub attributes: Vec<(&'a str, AttributeText<'a>)>,
}

/// An input or output of the network in the file.
#[derive(Clone, Debug)]
pub(super) struct EndText<'a> {
    pub name: &'a str,
    pub elements: Elements,
    /// Sides; `None` if one is a symbol.
    pub dims: Option<Vec<Option<i64>>>,
}

/// A network in the file.
#[derive(Clone, Debug, Default)]
pub(super) struct Document<'a> {
    pub nodes: Vec<NodeText<'a>>,
    pub tensors: Vec<TensorText<'a>>,
    pub inputs: Vec<EndText<'a>>,
    pub outputs: Vec<EndText<'a>>,
}

impl<'a> Document<'a> {
    /// Reads `ModelProto`.
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, ModelProblem> {
        let (mut graph, mut set) = (None, None);
        let mut fields = Fields::of(bytes);
        while let Some((number, field)) = fields.next()? {
            match number {
                // Version of the representation, producer, domain, version of the model, text, and more texts.
                1 | 5 => _ = field.integer()?,
                2..=4 | 6 | 14 => _ = field.bytes()?,
                7 if graph.is_some() => return Err(Fault::Twice("its graph").into()),
                7 => graph = Some(field.bytes()?),
                8 => {
                    let (domain, version) = operator_set(field.bytes()?)?;
                    if is_own_domain(domain) {
                        set = Some(version);
                    }
                }
                20 => return Err(Fault::Forbidden("information for training").into()),
                25 => return Err(Fault::Forbidden("local functions").into()),
                26 => return Err(Fault::Forbidden("configurations of devices").into()),
                number => return Err(Fault::Unknown { message: "ModelProto", number }.into()),
            }
        }
        if set != Some(OPERATOR_SET) {
            let found = set.map_or("is not stated".to_owned(), |version: i64| version.to_string());
            return Err(ModelProblem::OperatorSet { found, wanted: OPERATOR_SET });
        }
        let graph = graph.ok_or_else(|| ModelProblem::NotOnnx { found: "it has no graph".to_owned() })?;
        Self::of_graph(graph)
    }

    /// Reads `GraphProto`.
    fn of_graph(bytes: &'a [u8]) -> Result<Self, ModelProblem> {
        let mut graph = Self::default();
        let mut fields = Fields::of(bytes);
        while let Some((number, field)) = fields.next()? {
            match number {
                1 if graph.nodes.len() == bounds::NODES => return Err(too_many("nodes", bounds::NODES)),
                1 => graph.nodes.push(node(field.bytes()?)?),
                5 if graph.tensors.len() == bounds::TENSORS => return Err(too_many("initializers", bounds::TENSORS)),
                5 => graph.tensors.push(tensor(field.bytes()?)?),
                11 if graph.inputs.len() == bounds::ENDS + bounds::TENSORS => {
                    return Err(too_many("inputs", bounds::ENDS));
                }
                11 => graph.inputs.push(end(field.bytes()?)?),
                12 if graph.outputs.len() == bounds::ENDS => return Err(too_many("outputs", bounds::ENDS)),
                12 => graph.outputs.push(end(field.bytes()?)?),
                // The name, a text, shapes that this program infers itself, and more texts.
                2 | 10 | 13 | 16 => _ = field.bytes()?,
                14 => return Err(Fault::Forbidden("annotations of quantisation").into()),
                15 => return Err(Fault::Forbidden("sparse initializers").into()),
                number => return Err(Fault::Unknown { message: "GraphProto", number }.into()),
            }
        }
        Ok(graph)
    }
}

fn too_many(what: &'static str, most: usize) -> ModelProblem {
    ModelProblem::Bound { what, most: most as u64 }
}

/// Whether a domain is ONNX's own.
pub(super) fn is_own_domain(domain: &str) -> bool {
    domain.is_empty() || domain == "ai.onnx"
}

/// Reads `OperatorSetIdProto`: domain and version.
fn operator_set(bytes: &[u8]) -> Result<(&str, i64), Fault> {
    let (mut domain, mut version) = ("", 0);
    let mut fields = Fields::of(bytes);
    while let Some((number, field)) = fields.next()? {
        match number {
            1 => domain = field.text()?,
            2 => version = field.integer()?,
            number => return Err(Fault::Unknown { message: "OperatorSetIdProto", number }),
        }
    }
    Ok((domain, version))
}

fn name(field: Field<'_>) -> Result<&str, Fault> {
    let name = field.text()?;
    if name.len() > bounds::NAME { Err(Fault::Long { most: bounds::NAME }) } else { Ok(name) }
}

/// Reads `NodeProto`.
fn node(bytes: &[u8]) -> Result<NodeText<'_>, ModelProblem> {
    let mut node = NodeText::default();
    let mut fields = Fields::of(bytes);
    while let Some((number, field)) = fields.next()? {
        match number {
            1 => push(&mut node.inputs, name(field)?, bounds::ENDS_OF_NODE)?,
            2 => push(&mut node.outputs, name(field)?, bounds::ENDS_OF_NODE)?,
            3 => node.name = name(field)?,
            4 => node.operator = name(field)?,
            5 => push(&mut node.attributes, attribute(field.bytes()?)?, bounds::ATTRIBUTES)?,
            // A text, and more texts.
            6 | 9 => _ = field.bytes()?,
            7 => node.domain = name(field)?,
            8 if field.bytes()?.is_empty() => {}
            8 => return Err(Fault::Forbidden("overloads of operators").into()),
            10 => return Err(Fault::Forbidden("configurations of devices").into()),
            number => return Err(Fault::Unknown { message: "NodeProto", number }.into()),
        }
    }
    Ok(node)
}

/// Reads `AttributeProto`: its name and value.
fn attribute(bytes: &[u8]) -> Result<(&str, AttributeText<'_>), ModelProblem> {
    let (mut own_name, mut stated, mut value) = ("", 0, None);
    let (mut floats, mut ints) = (Vec::new(), Vec::new());
    let mut fields = Fields::of(bytes);
    while let Some((number, field)) = fields.next()? {
        let single = match number {
            1 => {
                own_name = name(field)?;
                continue;
            }
            2 => AttributeText::Float(field.float()?),
            3 => AttributeText::Int(field.integer()?),
            4 => AttributeText::Text(name(field)?),
            5 => AttributeText::Tensor(tensor(field.bytes()?)?),
            7 => {
                field.push_floats(&mut floats, bounds::LIST)?;
                continue;
            }
            8 => {
                field.push_integers(&mut ints, bounds::LIST)?;
                continue;
            }
            13 => {
                field.bytes()?;
                continue;
            }
            20 => {
                stated = field.integer()?;
                continue;
            }
            21 if field.bytes()?.is_empty() => continue,
            6 | 11 => return Err(Fault::Forbidden("a node with a graph inside").into()),
            9 => return Err(Fault::Forbidden("an attribute that is a list of texts").into()),
            10 => return Err(Fault::Forbidden("an attribute that is a list of tensors").into()),
            14 | 15 => return Err(Fault::Forbidden("an attribute that is a type").into()),
            21 => return Err(Fault::Forbidden("an attribute that refers to a function's attribute").into()),
            22 | 23 => return Err(Fault::Forbidden("an attribute that is a sparse tensor").into()),
            number => return Err(Fault::Unknown { message: "AttributeProto", number }.into()),
        };
        if value.replace(single).is_some() {
            return Err(Fault::Twice("the value of an attribute").into());
        }
    }
    // Numbers of `AttributeProto.AttributeType`: an empty list and a value of 0 have no field.
    let value = match (value, stated) {
        (Some(_), _) if !floats.is_empty() || !ints.is_empty() => {
            return Err(Fault::Twice("the value of an attribute").into());
        }
        (Some(value), stated) if [0, type_number(&value)].contains(&stated) => value,
        (None, 1) => AttributeText::Float(0.0),
        (None, 2) => AttributeText::Int(0),
        (None, 3) => AttributeText::Text(""),
        (None, 6) if ints.is_empty() => AttributeText::Floats(floats),
        (None, 7) if floats.is_empty() => AttributeText::Ints(ints),
        (None, 0) if ints.is_empty() && !floats.is_empty() => AttributeText::Floats(floats),
        (None, 0) if floats.is_empty() && !ints.is_empty() => AttributeText::Ints(ints),
        _ => return Err(Fault::Kind.into()),
    };
    Ok((own_name, value))
}

/// The number of a value in `AttributeProto.AttributeType`.
fn type_number(value: &AttributeText<'_>) -> i64 {
    match value {
        AttributeText::Float(_) => 1,
        AttributeText::Int(_) => 2,
        AttributeText::Text(_) => 3,
        AttributeText::Tensor(_) => 4,
        AttributeText::Floats(_) => 6,
        AttributeText::Ints(_) => 7,
    }
}

/// Reads `TensorProto`.
fn tensor(bytes: &[u8]) -> Result<TensorText<'_>, ModelProblem> {
    let mut tensor = TensorText {
        name: "",
        dims: Vec::new(),
        elements: Elements::Other(0),
        raw: &[],
        floats: Vec::new(),
        wholes: Vec::new(),
        is_external: false,
    };
    // There are at most as many numbers as bytes.
    let most = bytes.len();
    let mut fields = Fields::of(bytes);
    while let Some((number, field)) = fields.next()? {
        match number {
            1 => field.push_integers(&mut tensor.dims, bounds::RANK)?,
            2 => tensor.elements = elements(field.integer()?),
            4 => field.push_floats(&mut tensor.floats, most)?,
            7 => field.push_integers(&mut tensor.wholes, bounds::LIST)?,
            8 => tensor.name = name(field)?,
            9 => tensor.raw = field.bytes()?,
            // A text, and more texts.
            12 | 16 => _ = field.bytes()?,
            13 => tensor.is_external = true,
            14 => tensor.is_external |= field.integer()? != 0,
            3 => return Err(Fault::Forbidden("a tensor in segments").into()),
            5 | 6 | 10 | 11 => return Err(Fault::Forbidden("a tensor of a type other than float32 and int64").into()),
            number => return Err(Fault::Unknown { message: "TensorProto", number }.into()),
        }
    }
    if tensor.is_external {
        return Err(ModelProblem::ExternalData { tensor: tensor.name.escape_debug().to_string() });
    }
    Ok(tensor)
}

/// The type of a number in `TensorProto.DataType`.
pub(super) fn elements(number: i64) -> Elements {
    match number {
        1 => Elements::Float,
        7 => Elements::Whole,
        other => Elements::Other(other),
    }
}

/// Reads `ValueInfoProto`.
fn end(bytes: &[u8]) -> Result<EndText<'_>, ModelProblem> {
    let mut end = EndText { name: "", elements: Elements::Other(0), dims: None };
    let mut fields = Fields::of(bytes);
    while let Some((number, field)) = fields.next()? {
        match number {
            1 => end.name = name(field)?,
            2 => (end.elements, end.dims) = value_type(field.bytes()?)?,
            3 | 4 => _ = field.bytes()?,
            number => return Err(Fault::Unknown { message: "ValueInfoProto", number }.into()),
        }
    }
    Ok(end)
}

type EndType = (Elements, Option<Vec<Option<i64>>>);

/// Reads `TypeProto` of a tensor: the type of its elements, and its sides.
fn value_type(bytes: &[u8]) -> Result<EndType, Fault> {
    let mut found = (Elements::Other(0), None);
    let mut fields = Fields::of(bytes);
    while let Some((number, field)) = fields.next()? {
        match number {
            1 => {
                let mut tensor = Fields::of(field.bytes()?);
                while let Some((number, field)) = tensor.next()? {
                    match number {
                        1 => found.0 = elements(field.integer()?),
                        2 => found.1 = Some(sides(field.bytes()?)?),
                        number => return Err(Fault::Unknown { message: "TypeProto.Tensor", number }),
                    }
                }
            }
            6 => _ = field.bytes()?,
            4 | 5 | 7 | 8 | 9 => return Err(Fault::Forbidden("an input or output that is not a tensor")),
            number => return Err(Fault::Unknown { message: "TypeProto", number }),
        }
    }
    Ok(found)
}

/// Reads `TensorShapeProto`: sides, `None` for symbols.
fn sides(bytes: &[u8]) -> Result<Vec<Option<i64>>, Fault> {
    let mut sides = Vec::new();
    let mut fields = Fields::of(bytes);
    while let Some((number, field)) = fields.next()? {
        if number != 1 {
            return Err(Fault::Unknown { message: "TensorShapeProto", number });
        }
        let (mut dimension, mut side) = (Fields::of(field.bytes()?), None);
        while let Some((number, field)) = dimension.next()? {
            match number {
                1 => side = Some(field.integer()?),
                2 | 3 => _ = field.bytes()?,
                number => return Err(Fault::Unknown { message: "TensorShapeProto.Dimension", number }),
            }
        }
        push(&mut sides, side, bounds::RANK)?;
    }
    Ok(sides)
}
