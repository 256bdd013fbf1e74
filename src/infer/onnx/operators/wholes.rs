//! Arithmetic of known integers, with which exporters compute shapes from those of the inputs.

use super::super::{
    bounds,
    call::{Call, Operand, Outcome, Refused, axis_of, range_of, shape_of},
    document::{Elements, elements},
    value::Value,
};

/// A list of known integers as an outcome.
fn list(values: Vec<i64>) -> Result<Outcome, Refused> {
    if values.is_empty() || values.len() > bounds::LIST {
        return Err(format!("a list of {} integers, not 1 to {}", values.len(), bounds::LIST));
    }
    Ok(Outcome::Known(Value::Whole(shape_of(vec![values.len() as u64])?, values)))
}

/// A single known integer as an outcome.
fn single(value: i64) -> Result<Outcome, Refused> {
    Ok(Outcome::Known(Value::Whole(shape_of(Vec::new())?, vec![value])))
}

/// Whether an input is a single number without axes.
fn is_single(call: &Call<'_>, input: usize) -> bool {
    matches!(call.inputs.get(input), Some(Some(value)) if value.shape().rank() == 0)
}

/// `Shape`: the sides of a tensor from `start` to before `end`.
pub(super) fn shape(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["start", "end"])?;
    call.expect_inputs(1, 1)?;
    let Some(value) = call.inputs[0] else { return Err("input 0 is missing".to_owned()) };
    let sides: Vec<i64> = value.shape().sides().iter().map(|side| *side as i64).collect();
    let [first, last, _] = range_of(sides.len() as u64, [call.int("start", 0)?, call.int("end", i64::MAX)?, 1])?;
    list(sides[first as usize..last as usize].to_vec())
}

/// `Cast` to the input's own type, or from known integers to single precision.
pub(super) fn cast(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["to", "saturate"])?;
    call.expect_inputs(1, 1)?;
    call.flag("saturate", true)?;
    let to = call.int("to", 0)?;
    match (call.inputs[0], elements(to)) {
        (Some(value @ Value::Whole(..)), Elements::Whole) => Ok(Outcome::Known(value.clone())),
        (Some(value @ Value::Weight(..)), Elements::Float) => Ok(Outcome::Known(value.clone())),
        (Some(Value::Computed(shape)), Elements::Float) => {
            Ok(Outcome::node("Identity", vec![Operand::Own(0)], Vec::new(), shape.clone(), shape.elements()))
        }
        (Some(Value::Whole(shape, _)), Elements::Float) => {
            let floats: Vec<f32> = call.wholes(0)?.iter().map(|value| *value as f32).collect();
            let constant = if shape.rank() == 0 { Operand::Scalar(floats[0]) } else { Operand::Floats(floats) };
            Ok(Outcome::node("Identity", vec![constant], Vec::new(), shape.clone(), shape.elements()))
        }
        _ => Err(format!("elements of its input cannot be cast to type {to}")),
    }
}

/// `Add`, `Sub`, `Mul` and `Div` of lists of equal length, or of a list and a single number.
pub(super) fn arithmetic(call: &Call<'_>) -> Result<Outcome, Refused> {
    let (one, other) = (call.wholes(0)?, call.wholes(1)?);
    let compute = |a: i64, b: i64| match call.operator {
        "Add" => a.checked_add(b),
        "Sub" => a.checked_sub(b),
        "Mul" => a.checked_mul(b),
        _ => a.checked_div(b),
    };
    let count = one.len().max(other.len());
    if [one.len(), other.len()].iter().any(|length| ![1, count].contains(length)) {
        return Err(format!("lists of {} and {} integers do not fit", one.len(), other.len()));
    }
    let pairs = (0..count).map(|place| (one[place % one.len()], other[place % other.len()]));
    let found: Option<Vec<i64>> = pairs.map(|(a, b)| compute(a, b)).collect();
    let found = found.ok_or_else(|| format!("{one:?} and {other:?} have no result"))?;
    if is_single(call, 0) && is_single(call, 1) { single(found[0]) } else { list(found) }
}

pub(super) fn concat(call: &Call<'_>, axis: i64) -> Result<Outcome, Refused> {
    axis_of(axis, 1)?;
    let mut joined = Vec::new();
    for input in 0..call.inputs.len() {
        if is_single(call, input) {
            return Err(format!("input {input} is not a list"));
        }
        joined.extend(call.wholes(input)?);
    }
    list(joined)
}

pub(super) fn slice(call: &Call<'_>) -> Result<Outcome, Refused> {
    let values = call.wholes(0)?;
    if is_single(call, 0) {
        return Err("input 0 is not a list".to_owned());
    }
    let one = |input: usize, default: i64| match call.is_given(input) {
        true => match call.wholes(input)? {
            [value] => Ok(*value),
            other => Err(format!("input {input} has {} numbers, but a list has 1 axis", other.len())),
        },
        false => Ok(default),
    };
    axis_of(one(3, 0)?, 1)?;
    let [first, last, step] = range_of(values.len() as u64, [one(1, 0)?, one(2, 0)?, one(4, 1)?])?;
    list(values[first as usize..last as usize].iter().copied().step_by(step as usize).collect())
}

pub(super) fn gather(call: &Call<'_>) -> Result<Outcome, Refused> {
    let (values, indices) = (call.wholes(0)?, call.wholes(1)?);
    axis_of(call.int("axis", 0)?, 1)?;
    if is_single(call, 0) {
        return Err("input 0 is not a list".to_owned());
    }
    let found: Vec<i64> = indices
        .iter()
        .map(|index| axis_of(*index, values.len()).map(|place| values[place]))
        .collect::<Result<_, _>>()?;
    if is_single(call, 1) { single(found[0]) } else { list(found) }
}
