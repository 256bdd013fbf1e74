//! Checks of a whole network: names, inputs and outputs, sums of memory and work, and the required nodes.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    bounds,
    call::{Attribute, Call, Operand, Outcome},
    document::{AttributeText, Document, Elements, EndText, NodeText, TensorText, is_own_domain},
    operators::{OPERATORS, rule_of},
    value::{Shape, Value},
};
use crate::{error::ModelProblem, folder::RESOLUTION};

/// The operator of constants, which has no rule.
const CONSTANT: &str = "Constant";

/// A constant tensor for the library.
#[derive(Clone, Debug)]
pub(crate) enum Constant<'a> {
    /// Single precision, little-endian, with its sides.
    Raw(Vec<u64>, &'a [u8]),
    /// Single precision, with its sides.
    Floats(Vec<u64>, Vec<f32>),
    /// Integers, with their sides.
    Wholes(Vec<u64>, Vec<i64>),
}

/// A node for the library.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// Name of the operator.
    pub(crate) operator: &'static str,
    /// Names of its inputs; empty for an omitted optional one.
    pub(crate) inputs: Vec<String>,
    /// Names of its outputs.
    pub(crate) outputs: Vec<String>,
    /// All relevant attributes.
    pub(crate) attributes: Vec<(&'static str, Attribute)>,
}

/// A network for the library.
#[derive(Clone, Debug)]
pub(crate) struct Network<'a> {
    /// Names of the inputs.
    pub(crate) inputs: Vec<String>,
    /// Names of the outputs.
    pub(crate) outputs: Vec<String>,
    /// Nodes, each after those whose outputs it uses.
    pub(crate) nodes: Vec<Node>,
    /// Constants by name.
    pub(crate) constants: BTreeMap<String, Constant<'a>>,
    /// Multiply-adds of one sample, or equivalent work.
    pub(crate) work: u64,
}

/// A network that is being checked.
#[derive(Default)]
struct Checked<'a> {
    /// Knowledge of each tensor, and its name for the library.
    values: BTreeMap<&'a str, (Value, String)>,
    weights: Vec<(Vec<u64>, TensorText<'a>)>,
    nodes: Vec<Node>,
    constants: BTreeMap<String, Constant<'a>>,
    elements: u64,
    largest_scratch: u64,
    work: u64,
}

impl<'a> Network<'a> {
    /// Reads a network and checks it against the bounds; inputs and outputs must be those of `model.json`.
    pub(crate) fn read(bytes: &'a [u8], inputs: &[String], outputs: &[String]) -> Result<Self, ModelProblem> {
        let mut document = Document::read(bytes)?;
        let free = check_ends(&document, inputs, outputs)?;
        let mut checked = Checked::default();
        for tensor in std::mem::take(&mut document.tensors) {
            let name = tensor.name;
            checked.add_constant(name, tensor)?;
        }
        let sides = grid();
        for name in &free {
            let own = format!("i{}", checked.values.len());
            checked.define(name, Value::Computed(sides.clone()), own)?;
        }
        for node in &document.nodes {
            checked.add_node(node)?;
        }
        checked.finish(&free, outputs)
    }

    /// Merges equal constants, and refuses those whose comparison takes too long: the library compares all pairs of one shape.
    fn share_constants(&mut self) -> Result<(), ModelProblem> {
        let mut of_shape: BTreeMap<Vec<u64>, Vec<(&[u8], &String)>> = BTreeMap::new();
        for (name, constant) in &self.constants {
            if let Constant::Raw(sides, bytes) = constant {
                of_shape.entry(sides.clone()).or_default().push((bytes, name));
            }
        }
        let (mut shared, mut compared) = (BTreeMap::new(), 0_u64);
        for list in of_shape.values_mut() {
            list.sort_unstable();
            for place in 1..list.len() {
                let [(before, name), (bytes, other)] = [list[place - 1], list[place]];
                if before == bytes {
                    let first = shared.get(name).cloned().unwrap_or_else(|| name.clone());
                    shared.insert(other.clone(), first);
                    continue;
                }
                // In this order, two constants share no longer prefix with each other than with any constant between them.
                let common = before.iter().zip(bytes).take_while(|(one, other)| one == other).count() as u64;
                compared = compared.saturating_add(common.saturating_mul((list.len() - place) as u64));
            }
        }
        if compared > bounds::COMPARED {
            return Err(bound("bytes of equal prefixes of constants of one shape", bounds::COMPARED));
        }
        for input in self.nodes.iter_mut().flat_map(|node| &mut node.inputs) {
            if let Some(first) = shared.get(input) {
                input.clone_from(first);
            }
        }
        self.constants.retain(|name, _| !shared.contains_key(name));
        Ok(())
    }

    /// Keeps the nodes and constants that the outputs need.
    fn prune(&mut self) {
        let mut needed: BTreeSet<String> = self.outputs.iter().cloned().collect();
        let mut kept = Vec::new();
        while let Some(node) = self.nodes.pop() {
            if node.outputs.iter().any(|output| needed.contains(output)) {
                needed.extend(node.inputs.iter().cloned());
                kept.push(node);
            }
        }
        kept.reverse();
        self.nodes = kept;
        self.constants.retain(|name, _| needed.contains(name));
    }
}

/// Shape of every input and output: one sample.
fn grid() -> Shape {
    let n = u64::from(RESOLUTION);
    Shape::new(vec![1, 1, n, n, n]).expect("a shape")
}

fn escaped(name: &str) -> String {
    name.escape_debug().to_string()
}

/// Error about a node. A node without a name is called by its first output.
fn refused(node: &NodeText<'_>, found: String) -> ModelProblem {
    let name = if node.name.is_empty() { node.outputs.first().copied().unwrap_or_default() } else { node.name };
    ModelProblem::Node { operator: escaped(node.operator), node: escaped(name), found }
}

fn unknown_operator(node: &NodeText<'_>, is_own_domain: bool) -> ModelProblem {
    let domain = if is_own_domain { String::new() } else { format!("{}.", escaped(node.domain)) };
    let known: Vec<&str> = [CONSTANT].into_iter().chain(OPERATORS.iter().map(|(name, _)| *name)).collect();
    let operator = format!("{domain}{}", escaped(node.operator));
    ModelProblem::Operator { operator, node: escaped(node.name), allowed: known.join(", ") }
}

fn bound(what: &'static str, most: u64) -> ModelProblem {
    ModelProblem::Bound { what, most }
}

impl<'a> Checked<'a> {
    /// Registers the name of a tensor, which must be unique.
    fn define(&mut self, name: &'a str, value: Value, own: String) -> Result<(), ModelProblem> {
        if name.is_empty() || self.values.insert(name, (value, own)).is_some() {
            return Err(ModelProblem::NotOnnx {
                found: format!("the tensor name '{}' is empty or used twice", escaped(name)),
            });
        }
        Ok(())
    }

    /// Adds an initializer, or the tensor of a `Constant`.
    fn add_constant(&mut self, name: &'a str, tensor: TensorText<'a>) -> Result<(), ModelProblem> {
        let wrong = |found: String| ModelProblem::NotOnnx { found: format!("the tensor '{}' {found}", escaped(name)) };
        let sides: Option<Vec<u64>> = tensor.dims.iter().map(|side| u64::try_from(*side).ok()).collect();
        let shape = sides.and_then(Shape::new).ok_or_else(|| wrong(format!("has the shape {:?}", tensor.dims)))?;
        let (elements, own) = (shape.elements(), format!("w{}", self.values.len()));
        // All elements are in one of three lists.
        let (raw, floats, wholes) = (tensor.raw.len() as u64, tensor.floats.len() as u64, tensor.wholes.len() as u64);
        let are_floats = [[elements.saturating_mul(4), 0, 0], [0, elements, 0]].contains(&[raw, floats, wholes]);
        let are_wholes = [[elements.saturating_mul(8), 0, 0], [0, 0, elements]].contains(&[raw, floats, wholes]);
        match tensor.elements {
            Elements::Float if are_floats => {
                let number = self.weights.len();
                let value = Value::Weight(shape.clone(), number);
                self.weights.push((shape.sides().to_vec(), tensor));
                self.define(name, value, own)
            }
            Elements::Whole if elements > bounds::LIST as u64 => {
                Err(wrong(format!("has {elements} integers, but at most {} are supported", bounds::LIST)))
            }
            Elements::Whole if are_wholes => {
                let packed = tensor.raw.as_chunks::<8>().0.iter().map(|bytes| i64::from_le_bytes(*bytes));
                let values = if tensor.wholes.is_empty() { packed.collect() } else { tensor.wholes };
                self.define(name, Value::Whole(shape, values), own)
            }
            Elements::Float | Elements::Whole => Err(wrong(format!("has a size that differs from its shape {shape}"))),
            Elements::Other(kind) => {
                Err(wrong(format!("has elements of type {kind}, not float32 or int64; export it in single precision")))
            }
        }
    }

    /// Checks a node by the rule of its operator, and adds the result.
    fn add_node(&mut self, node: &NodeText<'a>) -> Result<(), ModelProblem> {
        let is_own = is_own_domain(node.domain);
        if is_own && node.operator == CONSTANT {
            let tensor = constant_of(node).map_err(|found| refused(node, found))?;
            return self.add_constant(node.outputs[0], tensor);
        }
        let (operator, rule) =
            rule_of(node.operator).filter(|_| is_own).ok_or_else(|| unknown_operator(node, is_own))?;
        let mut found = Vec::new();
        for input in &node.inputs {
            let missing = || format!("no input, initializer or earlier node produces '{}'", escaped(input));
            found.push(match *input {
                "" => None,
                input => Some(self.values.get(input).ok_or_else(|| refused(node, missing()))?),
            });
        }
        let weights = |number: usize| self.weights.get(number).map(|(_, tensor)| floats_of(tensor));
        let inputs = found.iter().map(|found| found.map(|(value, _)| value)).collect();
        let call = Call { operator, node, inputs, weights: &weights };
        let outcome = rule(&call).map_err(|found| refused(node, found))?;
        // The inputs by their names for the library, and the weights among them.
        let names: Vec<String> =
            found.iter().map(|found| found.map_or(String::new(), |(_, own)| own.clone())).collect();
        let used = found.iter().flatten().filter_map(|(value, own)| match value {
            Value::Weight(_, number) => Some((*number, own.clone())),
            _ => None,
        });
        let used: Vec<(usize, String)> = used.collect();
        self.add_outcome(node, outcome, &names, used)
    }

    /// Adds the result of a node: a known tensor, or a node of the library with these inputs and weights.
    fn add_outcome(
        &mut self,
        node: &NodeText<'a>,
        outcome: Outcome,
        names: &[String],
        used: Vec<(usize, String)>,
    ) -> Result<(), ModelProblem> {
        let count = if let Outcome::Node { outputs, .. } = &outcome { outputs.len() } else { 1 };
        if node.outputs.len() != count {
            return Err(refused(node, format!("it has {} outputs, not {count}", node.outputs.len())));
        }
        let (operator, inputs, attributes, outputs, scratch, work) = match outcome {
            Outcome::Known(value) => {
                // A weight keeps its name for the library.
                let own =
                    if let Value::Weight(..) = value { names[0].clone() } else { format!("k{}", self.values.len()) };
                return self.define(node.outputs[0], value, own);
            }
            Outcome::Node { operator, inputs, attributes, outputs, scratch, work } => {
                (operator, inputs, attributes, outputs, scratch, work)
            }
        };
        if let Some(output) = outputs.iter().find(|shape| shape.elements() > bounds::ELEMENTS) {
            let most = bounds::ELEMENTS;
            return Err(refused(node, format!("its output of shape {output} has more than {most} elements")));
        }
        self.add_sums(&outputs, scratch, work)?;
        used.into_iter().for_each(|(number, own)| self.use_weight(number, own));
        let inputs = inputs.into_iter().map(|operand| self.operand(operand, names)).collect();
        let mut made = Node { operator, inputs, outputs: Vec::new(), attributes };
        for (output, shape) in node.outputs.iter().zip(outputs) {
            let own = format!("t{}", self.values.len());
            made.outputs.push(own.clone());
            self.define(output, Value::Computed(shape), own)?;
        }
        self.nodes.push(made);
        Ok(())
    }

    /// Adds memory and work of a node to the sums.
    fn add_sums(&mut self, outputs: &[Shape], scratch: u64, work: u64) -> Result<(), ModelProblem> {
        self.elements += outputs.iter().map(Shape::elements).sum::<u64>();
        self.largest_scratch = self.largest_scratch.max(scratch);
        if self.elements.saturating_add(self.largest_scratch) > bounds::ALL_ELEMENTS {
            return Err(bound("elements of tensors that it computes", bounds::ALL_ELEMENTS));
        }
        self.work = self.work.saturating_add(work);
        if self.work > bounds::WORK {
            return Err(bound("multiply-adds per sample, or equivalent work", bounds::WORK));
        }
        Ok(())
    }

    /// Adds a weight for the library.
    fn use_weight(&mut self, number: usize, own: String) {
        let (sides, tensor) = &self.weights[number];
        let constant = match tensor.floats.is_empty() {
            true => Constant::Raw(sides.clone(), tensor.raw),
            false => Constant::Floats(sides.clone(), tensor.floats.clone()),
        };
        self.constants.entry(own).or_insert(constant);
    }

    /// The name of a node's input for the library; constants of the rule are added.
    fn operand(&mut self, operand: Operand, names: &[String]) -> String {
        let constant = match operand {
            Operand::Own(input) => return names[input].clone(),
            Operand::None => return String::new(),
            Operand::Wholes(list) => Constant::Wholes(vec![list.len() as u64], list),
            Operand::Whole(value) => Constant::Wholes(Vec::new(), vec![value]),
            Operand::Floats(list) => Constant::Floats(vec![list.len() as u64], list),
            Operand::Scalar(value) => Constant::Floats(Vec::new(), vec![value]),
        };
        let own = format!("c{}", self.constants.len());
        self.constants.insert(own.clone(), constant);
        own
    }

    /// The network between inputs and outputs, with only the required nodes.
    fn finish(mut self, inputs: &[&str], outputs: &[String]) -> Result<Network<'a>, ModelProblem> {
        let mut ends = Vec::new();
        for name in outputs {
            let missing = || ModelProblem::NotOnnx { found: format!("no node produces the output {}", escaped(name)) };
            let (value, own) = self.values.get(name.as_str()).ok_or_else(missing)?;
            match value {
                Value::Computed(shape) if *shape == grid() => {}
                value => {
                    let kind = if let Value::Whole(..) = value { "int64" } else { "float32" };
                    let (found, name) = (format!("{kind} of shape {}", value.shape()), escaped(name));
                    return Err(ModelProblem::Shape { name, found, resolution: RESOLUTION });
                }
            }
            ends.push(own.clone());
        }
        // An output that is an input, or equal to another output, gets a separate node.
        let inputs: Vec<String> = inputs.iter().map(|name| self.values[*name].1.clone()).collect();
        for place in 0..ends.len() {
            if inputs.contains(&ends[place]) || ends[..place].contains(&ends[place]) {
                let own = format!("o{place}");
                let (inputs, outputs) = (vec![ends[place].clone()], vec![own.clone()]);
                self.nodes.push(Node { operator: "Identity", inputs, outputs, attributes: Vec::new() });
                ends[place] = own;
            }
        }
        let Self { nodes, constants, work, .. } = self;
        let mut network = Network { inputs, outputs: ends, nodes, constants, work };
        network.prune();
        network.share_constants()?;
        Ok(network)
    }
}

/// The numbers of a single-precision tensor.
fn floats_of(tensor: &TensorText<'_>) -> Vec<f32> {
    match tensor.floats.is_empty() {
        true => tensor.raw.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect(),
        false => tensor.floats.clone(),
    }
}

/// The tensor of a `Constant`.
fn constant_of<'a>(node: &NodeText<'a>) -> Result<TensorText<'a>, String> {
    let ([_], []) = (&node.outputs[..], &node.inputs[..]) else {
        return Err(format!("it has {} inputs and {} outputs, not 0 and 1", node.inputs.len(), node.outputs.len()));
    };
    let [(name, value)] = &node.attributes[..] else {
        return Err(format!("it has {} attributes, not 1", node.attributes.len()));
    };
    let text = |dims: Vec<i64>, elements, floats, wholes| TensorText {
        dims,
        elements,
        floats,
        wholes,
        name: "",
        raw: &[],
        is_external: false,
    };
    match (*name, value) {
        ("value", AttributeText::Tensor(tensor)) => Ok(tensor.clone()),
        ("value_float", AttributeText::Float(value)) => Ok(text(Vec::new(), Elements::Float, vec![*value], Vec::new())),
        ("value_int", AttributeText::Int(value)) => Ok(text(Vec::new(), Elements::Whole, Vec::new(), vec![*value])),
        ("value_floats", AttributeText::Floats(list)) => {
            Ok(text(vec![list.len() as i64], Elements::Float, list.clone(), Vec::new()))
        }
        ("value_ints", AttributeText::Ints(list)) => {
            Ok(text(vec![list.len() as i64], Elements::Whole, Vec::new(), list.clone()))
        }
        (name, _) => Err(format!("its attribute '{}' is not a tensor or a number", escaped(name))),
    }
}

/// Refuses inputs and outputs that differ from `model.json`; returns the names of the inputs that are not initializers.
fn check_ends<'a>(
    document: &Document<'a>,
    inputs: &[String],
    outputs: &[String],
) -> Result<Vec<&'a str>, ModelProblem> {
    let is_weight = |end: &&EndText<'a>| document.tensors.iter().any(|tensor| tensor.name == end.name);
    let free: Vec<&EndText<'a>> = document.inputs.iter().filter(|end| !is_weight(end)).collect();
    let results: Vec<&EndText<'a>> = document.outputs.iter().collect();
    for (what, found, stated) in [("inputs", &free, inputs), ("outputs", &results, outputs)] {
        let names: Vec<&str> = found.iter().map(|end| end.name).collect();
        if !names.iter().eq(stated.iter()) {
            let found = names.into_iter().map(escaped).collect::<Vec<_>>().join(", ");
            return Err(ModelProblem::Ends { what, found, stated: stated.join(", ") });
        }
    }
    for end in free.iter().chain(&results) {
        check_end(end)?;
    }
    Ok(free.into_iter().map(|end| end.name).collect())
}

/// Refuses an input or output with a wrong type or shape; the number of samples may be a symbol.
fn check_end(end: &EndText<'_>) -> Result<(), ModelProblem> {
    let dims = end.dims.as_deref().unwrap_or_default();
    let n = i64::from(RESOLUTION);
    let is_ours = matches!(dims, [None | Some(1), Some(1), rest @ ..] if rest == [Some(n); 3]);
    if end.elements == Elements::Float && is_ours {
        return Ok(());
    }
    let kind = match end.elements {
        Elements::Float => "float32".to_owned(),
        Elements::Whole => "int64".to_owned(),
        Elements::Other(kind) => format!("of type {kind}"),
    };
    let sides: Vec<String> = dims.iter().map(|side| side.map_or("?".to_owned(), |side| side.to_string())).collect();
    let found = format!("{kind} of shape ({})", sides.join(", "));
    Err(ModelProblem::Shape { name: escaped(end.name), found, resolution: RESOLUTION })
}
