//! Matrix products, and sums over axes.

use super::{
    super::{
        call::{Attribute, Call, Operand, Outcome, Refused, axes_of, shape_of},
        value::{Shape, Value},
    },
    work::{PER_ELEMENT, of_products},
};

/// `Gemm`: alpha A' B' + beta C.
pub(super) fn gemm(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["alpha", "beta", "transA", "transB"])?;
    call.expect_inputs(2, 3)?;
    let [alpha, beta] = [call.float("alpha", 1.0)?, call.float("beta", 1.0)?];
    let [of_a, of_b] = [call.flag("transA", false)?, call.flag("transB", false)?];
    let (a, b) = (call.floats(0)?, call.floats(1)?);
    let ([a0, a1], [b0, b1]) = (a.sides(), b.sides()) else {
        return Err(format!("{a} and {b} are not matrices"));
    };
    let ([m, k], [own_k, n]) = (if of_a { [*a1, *a0] } else { [*a0, *a1] }, if of_b { [*b1, *b0] } else { [*b0, *b1] });
    if k != own_k {
        return Err(format!("{a} and {b} cannot be multiplied as matrices"));
    }
    let shape = shape_of(vec![m, n])?;
    let mut inputs = vec![Operand::Own(0), Operand::Own(1)];
    if call.is_given(2) {
        let c = call.floats(2)?;
        if c.broadcast(&shape).as_ref() != Some(&shape) {
            return Err(format!("{c} does not fit the product, {shape}"));
        }
        inputs.push(Operand::Own(2));
    }
    let attributes = vec![
        ("alpha", Attribute::Float(alpha)),
        ("beta", Attribute::Float(beta)),
        ("transA", Attribute::Int(of_a.into())),
        ("transB", Attribute::Int(of_b.into())),
    ];
    // A factor with a single row or column is read once, and each number of the other factor is used once.
    let work = of_products(1, [m, k, n]).saturating_add(shape.elements() * PER_ELEMENT);
    Ok(Outcome::Node { operator: "Gemm", inputs, attributes, outputs: vec![shape], scratch: computed(call), work })
}

/// Elements of computed inputs, which the library reorders before a product.
fn computed(call: &Call<'_>) -> u64 {
    let inputs = call.inputs.iter().flatten();
    inputs.map(|value| if let Value::Computed(shape) = value { 2 * shape.elements() } else { 0 }).sum()
}

/// `MatMul` as in NumPy.
pub(super) fn product(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&[])?;
    call.expect_inputs(2, 2)?;
    let (a, b) = (call.floats(0)?, call.floats(1)?);
    let refused = || format!("{a} and {b} cannot be multiplied as matrices");
    let ([before_a @ .., m, k], [before_b @ .., own_k, n]) = (a.sides(), b.sides()) else { return Err(refused()) };
    let batch = |sides: &[u64]| Shape::new(sides.to_vec());
    let both = batch(before_a).zip(batch(before_b)).and_then(|(one, other)| one.broadcast(&other));
    let both = both.filter(|_| k == own_k).ok_or_else(refused)?;
    let shape = shape_of(both.sides().iter().copied().chain([*m, *n]).collect())?;
    let work = of_products(both.elements(), [*m, *k, *n]).saturating_add(shape.elements() * PER_ELEMENT);
    let inputs = vec![Operand::Own(0), Operand::Own(1)];
    let scratch = computed(call);
    Ok(Outcome::Node { operator: "MatMul", inputs, attributes: Vec::new(), outputs: vec![shape], scratch, work })
}

/// `GlobalAveragePool` and `GlobalMaxPool`.
pub(super) fn global_pool(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&[])?;
    call.expect_inputs(1, 1)?;
    let shape = call.floats(0)?;
    let [batch, channels, _, ..] = shape.sides() else { return Err(format!("{shape} has no channels and space")) };
    let sides = [*batch, *channels].into_iter().chain(shape.sides()[2..].iter().map(|_| 1));
    let output = shape_of(sides.collect())?;
    Ok(Outcome::node(call.operator, vec![Operand::Own(0)], Vec::new(), output, shape.elements() * PER_ELEMENT))
}

/// `ReduceMax`, `ReduceMean` and `ReduceSum` over constant axes.
pub(super) fn reduce(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&["keepdims", "noop_with_empty_axes"])?;
    call.expect_inputs(1, 2)?;
    let (shape, keeps) = (call.floats(0)?, call.flag("keepdims", true)?);
    let is_noop = call.flag("noop_with_empty_axes", false)?;
    let axes = match call.is_given(1) {
        true => axes_of(call.wholes(1)?, shape.rank())?,
        false if is_noop => return Err("it reduces no axis".to_owned()),
        false => (0..shape.rank()).collect(),
    };
    let sides = shape.sides().iter().enumerate().filter_map(|(axis, side)| match axes.contains(&axis) {
        true => keeps.then_some(1),
        false => Some(*side),
    });
    let output = shape_of(sides.collect())?;
    let list = Operand::Wholes(axes.iter().map(|axis| *axis as i64).collect());
    let attributes = vec![("keepdims", Attribute::Int(keeps.into()))];
    let work = shape.elements() * PER_ELEMENT * (1 + axes.len() as u64);
    let (inputs, scratch) = (vec![Operand::Own(0), list], 2 * shape.elements());
    Ok(Outcome::Node { operator: call.operator, inputs, attributes, outputs: vec![output], scratch, work })
}
