//! Padding and resizing.

use super::{
    super::{
        bounds,
        call::{Attribute, Call, Operand, Outcome, Refused, axes_of, shape_of},
    },
    work::{PER_COORDINATE, PER_ELEMENT, PER_STEP},
};

pub(super) fn pad(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["mode"])?;
    call.expect_inputs(2, 4)?;
    let (shape, pads) = (call.floats(0)?, call.wholes(1)?);
    let mode = call.word("mode", &["constant", "reflect", "edge"], "constant")?;
    let axes = match call.is_given(3) {
        true => axes_of(call.wholes(3)?, shape.rank())?,
        false => (0..shape.rank()).collect(),
    };
    let fits = |pad: &i64| u64::try_from(*pad).ok().filter(|pad| *pad <= bounds::WINDOW);
    let own: Option<Vec<u64>> = pads.iter().map(fits).collect();
    let own = own.filter(|own| own.len() == 2 * axes.len());
    let own =
        own.ok_or_else(|| format!("pads are {pads:?}, not {} numbers from 0 to {}", 2 * axes.len(), bounds::WINDOW))?;
    let (before, after) = own.split_at(axes.len());
    let (mut sides, mut all) = (shape.sides().to_vec(), vec![0_i64; 2 * shape.rank()]);
    for (place, axis) in axes.into_iter().enumerate() {
        let (low, high) = (before[place], after[place]);
        if mode == "reflect" && low.max(high) >= sides[axis] {
            return Err(format!("it reflects {low} and {high} elements of {} along axis {axis}", sides[axis]));
        }
        sides[axis] = sides[axis].saturating_add(low + high);
        (all[axis], all[axis + shape.rank()]) = (low as i64, high as i64);
    }
    let mut inputs = vec![Operand::Own(0), Operand::Wholes(all)];
    if call.is_given(2) && mode == "constant" {
        let [value] = call.few_floats(2)?[..] else { return Err("input 2 is not a single number".to_owned()) };
        inputs.push(Operand::Scalar(value));
    }
    let output = shape_of(sides)?;
    let work = output.elements() * if mode == "constant" { 4 * PER_ELEMENT } else { PER_COORDINATE };
    Ok(Outcome::node("Pad", inputs, vec![("mode", Attribute::Text(mode))], output, work))
}

/// `Resize` by factors or to sizes, nearest or linear.
pub(super) fn resize(call: &Call<'_>) -> Result<Outcome, Refused> {
    const PLACES: [&str; 4] = ["half_pixel", "pytorch_half_pixel", "align_corners", "asymmetric"];
    const ROUNDINGS: [&str; 4] = ["round_prefer_floor", "round_prefer_ceil", "floor", "ceil"];
    let known = ["mode", "coordinate_transformation_mode", "nearest_mode", "antialias", "cubic_coeff_a"];
    let others = ["exclude_outside", "extrapolation_value", "keep_aspect_ratio_policy", "axes"];
    call.expect_attributes(&[&known[..], &others[..]].concat())?;
    call.expect_inputs(1, 4)?;
    let shape = call.floats(0)?;
    let mode = call.word("mode", &["nearest", "linear"], "nearest")?;
    let places = call.word("coordinate_transformation_mode", &PLACES, PLACES[0])?;
    let rounding = call.word("nearest_mode", &ROUNDINGS, ROUNDINGS[0])?;
    call.word("keep_aspect_ratio_policy", &["stretch"], "stretch")?;
    if call.flag("antialias", false)? || call.flag("exclude_outside", false)? {
        return Err("antialias and exclude_outside are not supported".to_owned());
    }
    let axes = match call.ints("axes")? {
        Some(axes) => axes_of(axes, shape.rank())?,
        None => (0..shape.rank()).collect(),
    };
    let mut sides = shape.sides().to_vec();
    // The factor determines the positions of cells, even if the resulting sides are rounded.
    let mut factors = vec![1.0_f32; shape.rank()];
    match (call.is_given(2), call.is_given(3)) {
        (true, false) => {
            let scales = call.few_floats(2)?;
            if scales.len() != axes.len() || !scales.iter().all(|scale| (1e-3..=64.0).contains(scale)) {
                return Err(format!("scales are {scales:?}, not {} numbers from 0.001 to 64", axes.len()));
            }
            for (axis, scale) in axes.iter().zip(scales) {
                // Exact in double precision, as the library computes it.
                sides[*axis] = (sides[*axis] as f64 * f64::from(scale)).floor() as u64;
                factors[*axis] = scale;
            }
        }
        (false, true) => {
            let sizes = call.wholes(3)?;
            if sizes.len() != axes.len() {
                return Err(format!("sizes are {sizes:?}, not {} numbers", axes.len()));
            }
            for (axis, size) in axes.iter().zip(sizes) {
                sides[*axis] = u64::try_from(*size).unwrap_or(0);
            }
        }
        _ => return Err("it has neither scales nor sizes, or both".to_owned()),
    }
    let output = shape_of(sides.clone())?;
    let changed: Vec<usize> = (0..shape.rank()).filter(|axis| sides[*axis] != shape.sides()[*axis]).collect();
    if changed.iter().any(|axis| *axis < 2) {
        return Err(format!("it resizes batch or channels: {shape} to {output}"));
    }
    let by = match call.is_given(2) {
        true => vec![Operand::None, Operand::Floats(factors)],
        false => {
            vec![Operand::None, Operand::None, Operand::Wholes(sides.iter().map(|side| *side as i64).collect())]
        }
    };
    let attributes = vec![
        ("mode", Attribute::Text(mode)),
        ("coordinate_transformation_mode", Attribute::Text(places)),
        ("nearest_mode", Attribute::Text(rounding)),
    ];
    let inputs = std::iter::once(Operand::Own(0)).chain(by).collect();
    let largest = shape.elements().max(output.elements());
    let work = largest * PER_STEP * (1 + changed.len() as u64);
    Ok(Outcome::Node { operator: "Resize", inputs, attributes, outputs: vec![output], scratch: 2 * largest, work })
}
