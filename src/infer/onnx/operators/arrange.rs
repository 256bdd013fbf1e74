//! Operators that rearrange elements.

use super::{
    super::{
        call::{Attribute, Call, Operand, Outcome, Refused, axes_of, axis_of, range_of, shape_of},
        value::{Shape, Value},
    },
    wholes,
    work::{PER_ELEMENT, PER_SCATTERED},
};

pub(super) fn identity(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&[])?;
    call.expect_inputs(1, 1)?;
    match call.inputs[0] {
        Some(value @ (Value::Whole(..) | Value::Weight(..))) => Ok(Outcome::Known(value.clone())),
        _ => {
            let shape = call.floats(0)?;
            Ok(Outcome::node("Identity", vec![Operand::Own(0)], Vec::new(), shape.clone(), shape.elements()))
        }
    }
}

/// Reshapes the input, keeping the number of elements.
fn reshaped(call: &Call<'_>, sides: Vec<u64>) -> Result<Outcome, Refused> {
    let shape = shape_of(sides)?;
    if let Some(Value::Whole(_, values)) = call.inputs[0] {
        return Ok(Outcome::Known(Value::Whole(shape, values.clone())));
    }
    if shape.rank() == 0 {
        return Err("a tensor without axes is not supported".to_owned());
    }
    let list = shape.sides().iter().map(|side| *side as i64).collect();
    let work = shape.elements();
    Ok(Outcome::node("Reshape", vec![Operand::Own(0), Operand::Wholes(list)], Vec::new(), shape, work))
}

fn own_shape<'a>(call: &Call<'a>) -> Result<&'a Shape, Refused> {
    call.inputs.first().copied().flatten().map(Value::shape).ok_or_else(|| "input 0 is missing".to_owned())
}

pub(super) fn reshape(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["allowzero"])?;
    call.expect_inputs(2, 2)?;
    let (shape, wanted, allow_zero) = (own_shape(call)?, call.wholes(1)?, call.flag("allowzero", false)?);
    let refused = || format!("{shape} cannot become {wanted:?}");
    let mut sides = Vec::new();
    for (axis, side) in wanted.iter().enumerate() {
        sides.push(match side {
            // 0 means the input's side, -1 the remaining elements.
            0 if !allow_zero => *shape.sides().get(axis).ok_or_else(refused)?,
            -1 => 0,
            side => u64::try_from(*side).ok().filter(|side| *side > 0).ok_or_else(refused)?,
        });
    }
    let open: Vec<usize> = (0..sides.len()).filter(|axis| sides[*axis] == 0).collect();
    if let [axis] = open[..] {
        sides[axis] = 1;
        let others = shape_of(sides.clone())?.elements();
        sides[axis] = shape.elements() / others;
    }
    match Shape::new(sides.clone()) {
        Some(found) if found.elements() == shape.elements() => reshaped(call, sides),
        _ => Err(refused()),
    }
}

pub(super) fn flatten(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["axis"])?;
    call.expect_inputs(1, 1)?;
    let shape = call.floats(0)?;
    let (axis, rank) = (call.int("axis", 1)?, shape.rank());
    // The axis may be after all axes.
    let axis = if axis == rank as i64 { rank } else { axis_of(axis, rank)? };
    let (before, after) = shape.sides().split_at(axis);
    reshaped(call, vec![before.iter().product(), after.iter().product()])
}

pub(super) fn squeeze(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&[])?;
    call.expect_inputs(1, 2)?;
    let shape = own_shape(call)?;
    let single = |axis: &usize| shape.sides()[*axis] == 1;
    let axes = match call.is_given(1) {
        true => axes_of(call.wholes(1)?, shape.rank())?,
        false => (0..shape.rank()).filter(single).collect(),
    };
    if !axes.iter().all(single) {
        return Err(format!("axes {axes:?} of {shape} do not all have one element"));
    }
    let kept = (0..shape.rank()).filter(|axis| !axes.contains(axis));
    reshaped(call, kept.map(|axis| shape.sides()[axis]).collect())
}

pub(super) fn unsqueeze(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&[])?;
    call.expect_inputs(2, 2)?;
    let (shape, wanted) = (own_shape(call)?, call.wholes(1)?);
    let rank = shape.rank() + wanted.len();
    let axes = axes_of(wanted, rank)?;
    let mut sides = shape.sides().iter().copied();
    reshaped(call, (0..rank).map(|axis| if axes.contains(&axis) { 1 } else { sides.next().unwrap_or(1) }).collect())
}

pub(super) fn transpose(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["perm"])?;
    call.expect_inputs(1, 1)?;
    let shape = call.floats(0)?;
    let rank = shape.rank();
    let perm: Vec<usize> = match call.ints("perm")? {
        None => (0..rank).rev().collect(),
        Some(perm) => {
            let found = axes_of(perm, rank)?;
            if found.len() != rank || perm.iter().any(|axis| *axis < 0) {
                return Err(format!("perm is {perm:?}, not a permutation of {rank} axes"));
            }
            found
        }
    };
    let sides = perm.iter().map(|axis| shape.sides()[*axis]).collect();
    let attributes = vec![("perm", Attribute::Ints(perm.iter().map(|axis| *axis as i64).collect()))];
    let work = shape.elements() * PER_SCATTERED;
    Ok(Outcome::node("Transpose", vec![Operand::Own(0)], attributes, shape_of(sides)?, work))
}

pub(super) fn concat(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["axis"])?;
    let count = call.inputs.len();
    call.expect_inputs(count.max(1), count)?;
    let axis = call.int("axis", i64::MIN)?;
    if call.inputs.iter().all(|input| matches!(input, Some(Value::Whole(..)))) {
        return wholes::concat(call, axis);
    }
    let first = call.floats(0)?;
    let axis = axis_of(axis, first.rank())?;
    let mut sides = first.sides().to_vec();
    for input in 1..count {
        let other = call.floats(input)?;
        let fits = |at: usize| at == axis || other.sides()[at] == sides[at];
        if other.rank() != first.rank() || !(0..first.rank()).all(fits) {
            return Err(format!("shapes {first} and {other} do not fit along axis {axis}"));
        }
        sides[axis] = sides[axis].saturating_add(other.sides()[axis]);
    }
    let shape = shape_of(sides)?;
    let work = shape.elements() * PER_ELEMENT;
    let attributes = vec![("axis", Attribute::Int(axis as i64))];
    Ok(Outcome::node("Concat", (0..count).map(Operand::Own).collect(), attributes, shape, work))
}

pub(super) fn split(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["axis", "num_outputs"])?;
    call.expect_inputs(1, 2)?;
    let shape = call.floats(0)?;
    let axis = axis_of(call.int("axis", 0)?, shape.rank())?;
    let (side, count) = (shape.sides()[axis], call.node.outputs.len() as u64);
    let wanted = call.int("num_outputs", count as i64)?;
    if wanted != count as i64 || count == 0 {
        return Err(format!("num_outputs is {wanted}, but it has {count} outputs"));
    }
    let parts: Vec<u64> = if call.is_given(1) {
        call.wholes(1)?.iter().map(|part| u64::try_from(*part).unwrap_or(0)).collect()
    } else {
        // Equal parts; the last one is smaller if they do not divide the side.
        let part = side.div_ceil(count);
        (0..count).map(|index| side.saturating_sub(index * part).min(part)).collect()
    };
    let total = parts.iter().try_fold(0_u64, |sum, part| sum.checked_add(*part));
    if parts.len() as u64 != count || parts.contains(&0) || total != Some(side) {
        return Err(format!("{side} elements along axis {axis} cannot be split into {parts:?}"));
    }
    let outputs = parts.iter().map(|part| {
        let mut sides = shape.sides().to_vec();
        sides[axis] = *part;
        shape_of(sides)
    });
    Ok(Outcome::Node {
        operator: "Split",
        outputs: outputs.collect::<Result<_, _>>()?,
        inputs: vec![Operand::Own(0), Operand::Wholes(parts.iter().map(|part| *part as i64).collect())],
        attributes: vec![("axis", Attribute::Int(axis as i64))],
        scratch: 0,
        work: shape.elements() * PER_ELEMENT,
    })
}

pub(super) fn slice(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&[])?;
    call.expect_inputs(3, 5)?;
    if let Some(Value::Whole(..)) = call.inputs[0] {
        return wholes::slice(call);
    }
    let shape = call.floats(0)?;
    let (begins, ends) = (call.wholes(1)?, call.wholes(2)?);
    let count = begins.len();
    let axes = match call.is_given(3) {
        true => axes_of(call.wholes(3)?, shape.rank())?,
        false => (0..count).collect(),
    };
    let ones = vec![1; count];
    let steps = if call.is_given(4) { call.wholes(4)? } else { &ones };
    if [ends.len(), axes.len(), steps.len()] != [count; 3] || count == 0 || count > shape.rank() {
        return Err(format!("its lists for the axes of {shape} are missing or have different lengths"));
    }
    let (mut sides, mut lists) = (shape.sides().to_vec(), [const { Vec::new() }; 4]);
    for (place, axis) in axes.into_iter().enumerate() {
        let [first, last, step] = range_of(sides[axis], [begins[place], ends[place], steps[place]])?;
        sides[axis] = (last - first).div_ceil(step);
        let row = [first as i64, last as i64, axis as i64, step as i64];
        lists.iter_mut().zip(row).for_each(|(list, entry)| list.push(entry));
    }
    let output = shape_of(sides)?;
    let inputs = std::iter::once(Operand::Own(0)).chain(lists.into_iter().map(Operand::Wholes)).collect();
    let work = output.elements() * PER_SCATTERED;
    Ok(Outcome::node("Slice", inputs, Vec::new(), output, work))
}

pub(super) fn gather(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["axis"])?;
    call.expect_inputs(2, 2)?;
    if let Some(Value::Whole(..)) = call.inputs[0] {
        return wholes::gather(call);
    }
    let (shape, indices) = (call.floats(0)?, call.wholes(1)?);
    let axis = axis_of(call.int("axis", 0)?, shape.rank())?;
    let side = shape.sides()[axis] as usize;
    let place = |index: &i64| match axis_of(*index, side) {
        Ok(place) => Ok(place as i64),
        Err(_) => Err(format!("index {index} is not among the {side} elements along axis {axis}")),
    };
    let places: Vec<i64> = indices.iter().map(place).collect::<Result<_, _>>()?;
    let mut sides = shape.sides().to_vec();
    // A single index removes its axis.
    let operand = match call.inputs[1] {
        Some(Value::Whole(own, _)) if own.rank() == 0 => {
            sides.remove(axis);
            Operand::Whole(places[0])
        }
        _ => {
            sides[axis] = places.len() as u64;
            Operand::Wholes(places)
        }
    };
    let output = shape_of(sides)?;
    let work = output.elements() * PER_SCATTERED;
    let attributes = vec![("axis", Attribute::Int(axis as i64))];
    Ok(Outcome::node("Gather", vec![Operand::Own(0), operand], attributes, output, work))
}
