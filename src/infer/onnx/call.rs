//! A node as input of its rule: known facts about its inputs, its attributes by name, and its result.

use super::{
    bounds,
    document::{AttributeText, NodeText},
    value::{Shape, Value},
};

/// An attribute for the library.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Attribute {
    Int(i64),
    Float(f32),
    Text(&'static str),
    Ints(Vec<i64>),
}

/// An input of a node for the library.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Operand {
    /// The node's input with this index.
    Own(usize),
    /// A constant list of integers.
    Wholes(Vec<i64>),
    /// A constant integer without axes.
    Whole(i64),
    /// A constant list of numbers.
    Floats(Vec<f32>),
    /// A constant number without axes.
    Scalar(f32),
    /// An omitted input.
    None,
}

/// Result of a rule: a known tensor, or a node of the library.
#[derive(Clone, Debug)]
pub(super) enum Outcome {
    /// A known tensor, the only output.
    Known(Value),
    /// A node of the library.
    Node {
        /// Name of the operator.
        operator: &'static str,
        inputs: Vec<Operand>,
        attributes: Vec<(&'static str, Attribute)>,
        /// Shape of each output.
        outputs: Vec<Shape>,
        /// Elements of memory that the library uses while the node runs.
        scratch: u64,
        /// Multiply-adds, or equivalent work.
        work: u64,
    },
}

/// Text about the reason why a node is not supported.
pub(super) type Refused = String;

/// A node with the known facts about its inputs.
pub(super) struct Call<'a> {
    /// Name of the operator in the table of rules.
    pub operator: &'static str,
    pub node: &'a NodeText<'a>,
    /// Value of each input; `None` for an omitted one.
    pub inputs: Vec<Option<&'a Value>>,
    /// The constants of single precision, by their number.
    pub weights: &'a dyn Fn(usize) -> Option<Vec<f32>>,
}

impl<'a> Call<'a> {
    /// Refuses attributes that are not in a list, and duplicate ones.
    pub(super) fn expect_attributes(&self, known: &[&str]) -> Result<(), Refused> {
        for (place, (name, _)) in self.node.attributes.iter().enumerate() {
            if !known.contains(name) {
                return Err(format!("the attribute '{}' is not known", name.escape_debug()));
            }
            if self.node.attributes[..place].iter().any(|(before, _)| before == name) {
                return Err(format!("the attribute '{name}' is given twice"));
            }
        }
        Ok(())
    }

    fn attribute(&self, name: &str) -> Option<&'a AttributeText<'a>> {
        self.node.attributes.iter().find(|(own, _)| *own == name).map(|(_, value)| value)
    }

    pub(super) fn int(&self, name: &str, default: i64) -> Result<i64, Refused> {
        match self.attribute(name) {
            None => Ok(default),
            Some(AttributeText::Int(value)) => Ok(*value),
            Some(_) => Err(format!("{name} is not an integer")),
        }
    }

    /// Reads an attribute that is 0 or 1.
    pub(super) fn flag(&self, name: &str, default: bool) -> Result<bool, Refused> {
        match self.int(name, i64::from(default))? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(format!("{name} is {other}, neither 0 nor 1")),
        }
    }

    pub(super) fn float(&self, name: &str, default: f32) -> Result<f32, Refused> {
        match self.attribute(name) {
            None => Ok(default),
            Some(AttributeText::Float(value)) if value.is_finite() => Ok(*value),
            Some(_) => Err(format!("{name} is not a finite number")),
        }
    }

    /// Reads a text that must be one of a few.
    pub(super) fn word(
        &self,
        name: &str,
        known: &[&'static str],
        default: &'static str,
    ) -> Result<&'static str, Refused> {
        let found = match self.attribute(name) {
            None => return Ok(default),
            Some(AttributeText::Text(text)) => *text,
            Some(_) => return Err(format!("{name} is not a text")),
        };
        let word = known.iter().find(|word| **word == found);
        word.copied().ok_or_else(|| format!("{name} is '{}', not {}", found.escape_debug(), known.join(" or ")))
    }

    pub(super) fn ints(&self, name: &str) -> Result<Option<&'a [i64]>, Refused> {
        match self.attribute(name) {
            None => Ok(None),
            Some(AttributeText::Ints(values)) => Ok(Some(values)),
            Some(_) => Err(format!("{name} is not a list of integers")),
        }
    }

    /// Reads a list with one number per axis, each within bounds; `default` for each if the attribute is missing.
    pub(super) fn sides(&self, name: &str, count: usize, ends: [u64; 2], default: u64) -> Result<Vec<u64>, Refused> {
        let Some(values) = self.ints(name)? else { return Ok(vec![default; count]) };
        let [low, high] = ends;
        let fits = |value: &i64| u64::try_from(*value).ok().filter(|value| (low..=high).contains(value));
        let sides: Option<Vec<u64>> = values.iter().map(fits).collect();
        let sides = sides.filter(|sides| sides.len() == count);
        sides.ok_or_else(|| format!("{name} is {values:?}, not {count} numbers from {low} to {high}"))
    }

    pub(super) fn expect_inputs(&self, least: usize, most: usize) -> Result<(), Refused> {
        let count = self.inputs.len();
        if !(least..=most).contains(&count) || self.inputs[..least].iter().any(Option::is_none) {
            return Err(format!("it has {count} inputs, not {least} to {most}"));
        }
        Ok(())
    }

    pub(super) fn is_given(&self, input: usize) -> bool {
        self.inputs.get(input).is_some_and(Option::is_some)
    }

    /// Shape of a single-precision input.
    pub(super) fn floats(&self, input: usize) -> Result<&'a Shape, Refused> {
        match self.inputs.get(input).copied().flatten() {
            Some(Value::Computed(shape) | Value::Weight(shape, _)) => Ok(shape),
            Some(Value::Whole(..)) => Err(format!("input {input} has integers, but float32 is required")),
            None => Err(format!("input {input} is missing")),
        }
    }

    /// Known integers of an input, a list or a single one.
    pub(super) fn wholes(&self, input: usize) -> Result<&'a [i64], Refused> {
        match self.inputs.get(input).copied().flatten() {
            Some(Value::Whole(shape, values)) if shape.rank() <= 1 => Ok(values),
            Some(_) => Err(format!("input {input} is not a list of constant integers")),
            None => Err(format!("input {input} is missing")),
        }
    }

    /// The numbers of an input that is a single-precision constant no longer than a list may be.
    pub(super) fn few_floats(&self, input: usize) -> Result<Vec<f32>, Refused> {
        let found = match self.inputs.get(input).copied().flatten() {
            Some(Value::Weight(shape, number)) if shape.elements() <= bounds::LIST as u64 => (self.weights)(*number),
            _ => None,
        };
        let found = found.filter(|values| values.iter().all(|value| value.is_finite()));
        found.ok_or_else(|| format!("input {input} is not a constant of a few finite numbers"))
    }
}

impl Outcome {
    /// A node with one output and no other memory.
    pub(super) fn node(
        operator: &'static str,
        inputs: Vec<Operand>,
        attributes: Vec<(&'static str, Attribute)>,
        output: Shape,
        work: u64,
    ) -> Self {
        Self::Node { operator, inputs, attributes, outputs: vec![output], scratch: 0, work }
    }
}

/// The axis of a number, which may count from the end.
pub(super) fn axis_of(axis: i64, rank: usize) -> Result<usize, Refused> {
    let from_start = if axis < 0 { axis.checked_add(rank as i64) } else { Some(axis) };
    let found = from_start.and_then(|axis| usize::try_from(axis).ok()).filter(|axis| *axis < rank);
    found.ok_or_else(|| format!("there is no axis {axis} of {rank}"))
}

/// Axes of numbers, without repetition.
pub(super) fn axes_of(axes: &[i64], rank: usize) -> Result<Vec<usize>, Refused> {
    let found: Vec<usize> = axes.iter().map(|axis| axis_of(*axis, rank)).collect::<Result<_, _>>()?;
    let is_twice = (1..found.len()).any(|place| found[..place].contains(&found[place]));
    if is_twice { Err(format!("axes {axes:?} contain one twice")) } else { Ok(found) }
}

/// A shape, or the message about an invalid one.
pub(super) fn shape_of(sides: Vec<u64>) -> Result<Shape, Refused> {
    let words = format!("a tensor of shape {sides:?} is not supported");
    Shape::new(sides).ok_or(words)
}

/// Start, end and step of a slice along an axis, clamped as in ONNX; an empty slice is refused.
pub(super) fn range_of(side: u64, [begin, end, step]: [i64; 3]) -> Result<[u64; 3], Refused> {
    let from_start = |place: i64| {
        let place = if place < 0 { place.saturating_add_unsigned(side) } else { place };
        u64::try_from(place).unwrap_or(0).min(side)
    };
    let (first, last) = (from_start(begin), from_start(end));
    match u64::try_from(step) {
        Ok(step) if step > 0 && first < last => Ok([first, last, step]),
        _ => Err(format!("a slice from {begin} to {end} in steps of {step} of {side} elements is not supported")),
    }
}
