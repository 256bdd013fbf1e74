//! Operators that compute each element independently, or with numbers of its channel.

use super::{
    super::{
        call::{Attribute, Call, Operand, Outcome, Refused, axis_of},
        value::{Shape, Value},
    },
    wholes,
    work::{PER_COORDINATE, PER_ELEMENT, PER_FUNCTION},
};

/// Work of a function of each element.
fn function_work(name: &str, shape: &Shape) -> u64 {
    shape.elements()
        * match name {
            "Abs" | "Neg" | "Relu" | "LeakyRelu" => PER_ELEMENT,
            "Elu" => PER_COORDINATE,
            _ => PER_FUNCTION,
        }
}

/// An elementwise function without attributes.
pub(super) fn unary(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&[])?;
    call.expect_inputs(1, 1)?;
    let (name, shape) = (call.operator, call.floats(0)?);
    Ok(Outcome::node(name, vec![Operand::Own(0)], Vec::new(), shape.clone(), function_work(name, shape)))
}

/// `LeakyRelu` and `Elu`.
pub(super) fn with_alpha(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["alpha"])?;
    call.expect_inputs(1, 1)?;
    let (name, shape) = (call.operator, call.floats(0)?);
    let alpha = call.float("alpha", if name == "Elu" { 1.0 } else { 0.01 })?;
    let attributes = vec![("alpha", Attribute::Float(alpha))];
    Ok(Outcome::node(name, vec![Operand::Own(0)], attributes, shape.clone(), function_work(name, shape)))
}

pub(super) fn hard_sigmoid(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["alpha", "beta"])?;
    call.expect_inputs(1, 1)?;
    let (name, shape) = (call.operator, call.floats(0)?);
    let [alpha, beta] = [call.float("alpha", 0.2)?, call.float("beta", 0.5)?];
    let attributes = vec![("alpha", Attribute::Float(alpha)), ("beta", Attribute::Float(beta))];
    Ok(Outcome::node(name, vec![Operand::Own(0)], attributes, shape.clone(), function_work(name, shape)))
}

/// Broadcast shape of several single-precision inputs.
fn broadcast(call: &Call<'_>) -> Result<Shape, Refused> {
    let mut whole = call.floats(0)?.clone();
    for input in 1..call.inputs.len() {
        let other = call.floats(input)?;
        whole = whole.broadcast(other).ok_or_else(|| format!("shapes {whole} and {other} do not fit"))?;
    }
    Ok(whole)
}

/// `Add`, `Sub`, `Mul`, `Div`: of single precision, or of known integers.
pub(super) fn binary(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&[])?;
    call.expect_inputs(2, 2)?;
    if let [Some(Value::Whole(..)), Some(Value::Whole(..))] = call.inputs[..] {
        return wholes::arithmetic(call);
    }
    let shape = broadcast(call)?;
    let work = shape.elements() * PER_ELEMENT;
    Ok(Outcome::node(call.operator, vec![Operand::Own(0), Operand::Own(1)], Vec::new(), shape, work))
}

/// `Max`, `Min` and `Sum` of one or more inputs.
pub(super) fn variadic(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&[])?;
    let count = call.inputs.len();
    call.expect_inputs(count.max(1), count)?;
    let shape = broadcast(call)?;
    let work = shape.elements() * PER_ELEMENT * count as u64;
    Ok(Outcome::node(call.operator, (0..count).map(Operand::Own).collect(), Vec::new(), shape, work))
}

pub(super) fn prelu(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&[])?;
    call.expect_inputs(2, 2)?;
    let (shape, slope) = (call.floats(0)?, call.floats(1)?);
    if slope.broadcast(shape).as_ref() != Some(shape) {
        return Err(format!("a slope of shape {slope} does not fit {shape}"));
    }
    let work = shape.elements() * PER_COORDINATE;
    Ok(Outcome::node("PRelu", vec![Operand::Own(0), Operand::Own(1)], Vec::new(), shape.clone(), work))
}

pub(super) fn clip(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&[])?;
    call.expect_inputs(1, 3)?;
    let shape = call.floats(0)?;
    let mut inputs = vec![Operand::Own(0)];
    for input in 1..3 {
        if !call.is_given(input) {
            inputs.push(Operand::None);
            continue;
        }
        let [bound] = call.few_floats(input)?[..] else { return Err(format!("input {input} is not a single number")) };
        inputs.push(Operand::Scalar(bound));
    }
    if let [_, Operand::Scalar(low), Operand::Scalar(high)] = inputs[..]
        && low > high
    {
        return Err(format!("it clips to an empty range: from {low} to {high}"));
    }
    Ok(Outcome::node("Clip", inputs, Vec::new(), shape.clone(), shape.elements() * PER_ELEMENT))
}

/// Shapes of a tensor with channels, and of inputs with one number per channel from the second input on.
fn per_channel(call: &Call<'_>, inputs: usize) -> Result<Shape, Refused> {
    call.expect_inputs(inputs, inputs)?;
    let shape = call.floats(0)?;
    let Some(channels) = shape.sides().get(1).filter(|_| shape.rank() >= 3) else {
        return Err(format!("an input of shape {shape} has no channels and space"));
    };
    for input in 1..inputs {
        let own = call.floats(input)?;
        if own.sides() != [*channels] {
            return Err(format!("input {input} has the shape {own}, not ({channels})"));
        }
    }
    Ok(shape.clone())
}

pub(super) fn batch_normalization(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["epsilon", "momentum", "training_mode"])?;
    if call.flag("training_mode", false)? {
        return Err("it is in training mode".to_owned());
    }
    call.float("momentum", 0.9)?;
    let (epsilon, shape) = (call.float("epsilon", 1e-5)?, per_channel(call, 5)?);
    if (1..5).any(|input| !matches!(call.inputs[input], Some(Value::Weight(..)))) {
        return Err("its scale, bias, mean and variance are not constants".to_owned());
    }
    let work = shape.elements() * PER_ELEMENT * 2;
    let attributes = vec![("epsilon", Attribute::Float(epsilon))];
    Ok(Outcome::node("BatchNormalization", (0..5).map(Operand::Own).collect(), attributes, shape, work))
}

pub(super) fn instance_normalization(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["epsilon"])?;
    let (epsilon, shape) = (call.float("epsilon", 1e-5)?, per_channel(call, 3)?);
    let (work, scratch) = (shape.elements() * PER_ELEMENT * 8, 3 * shape.elements());
    let attributes = vec![("epsilon", Attribute::Float(epsilon))];
    let inputs = (0..3).map(Operand::Own).collect();
    Ok(Outcome::Node { operator: "InstanceNormalization", inputs, attributes, outputs: vec![shape], scratch, work })
}

pub(super) fn softmax(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["axis"])?;
    call.expect_inputs(1, 1)?;
    let shape = call.floats(0)?;
    let axis = axis_of(call.int("axis", -1)?, shape.rank())?;
    let attributes = vec![("axis", Attribute::Int(axis as i64))];
    let (work, scratch) = (shape.elements() * PER_COORDINATE, 2 * shape.elements());
    let (inputs, outputs) = (vec![Operand::Own(0)], vec![shape.clone()]);
    Ok(Outcome::Node { operator: "Softmax", inputs, attributes, outputs, scratch, work })
}
