//! Convolutions and pooling: a window that moves over the cells.

use super::{
    super::{
        bounds,
        call::{Attribute, Call, Operand, Outcome, Refused, shape_of},
        value::Shape,
    },
    work::{PER_ADDED, PER_CELL, PER_ELEMENT, PER_POOLED, of_products},
};

/// A window along every spatial axis.
struct Window {
    kernel: Vec<u64>,
    strides: Vec<u64>,
    dilations: Vec<u64>,
    before: Vec<u64>,
    after: Vec<u64>,
}

impl Window {
    /// Reads strides, dilations and padding of a window over `space`.
    fn read(call: &Call<'_>, kernel: Vec<u64>, space: &[u64], is_transposed: bool) -> Result<Self, Refused> {
        let axes = space.len();
        if kernel.len() != axes || kernel.iter().any(|side| !(1..=bounds::WINDOW).contains(side)) {
            return Err(format!("a kernel of {kernel:?}, not of {axes} sides from 1 to {}", bounds::WINDOW));
        }
        let strides = call.sides("strides", axes, [1, bounds::WINDOW], 1)?;
        let dilations = call.sides("dilations", axes, [1, bounds::WINDOW], 1)?;
        let pads = call.sides("pads", 2 * axes, [0, bounds::WINDOW], 0)?;
        let (before, after) = (pads[..axes].to_vec(), pads[axes..].to_vec());
        let mut window = Self { kernel, strides, dilations, before, after };
        let modes: &[&'static str] =
            if is_transposed { &["NOTSET", "VALID"] } else { &["NOTSET", "VALID", "SAME_UPPER", "SAME_LOWER"] };
        let mode = call.word("auto_pad", modes, "NOTSET")?;
        if mode != "NOTSET" && pads.iter().any(|pad| *pad > 0) {
            return Err(format!("auto_pad is {mode}, but it also has pads"));
        }
        if mode.starts_with("SAME") {
            for (axis, side) in space.iter().enumerate() {
                // As many windows as strides fit; odd padding goes to the end that the mode selects.
                let windows = side.div_ceil(window.strides[axis]);
                let needed = (windows - 1) * window.strides[axis] + window.extent(axis);
                let total = needed.saturating_sub(*side);
                let (less, more) = (total / 2, total.div_ceil(2));
                (window.before[axis], window.after[axis]) =
                    if mode == "SAME_UPPER" { (less, more) } else { (more, less) };
            }
        }
        for axis in 0..axes {
            if window.before[axis].max(window.after[axis]) >= window.extent(axis) {
                let [before, after] = [window.before[axis], window.after[axis]];
                let extent = window.extent(axis);
                return Err(format!(
                    "padding of {before} and {after} along spatial axis {axis} with a kernel of {extent}"
                ));
            }
        }
        Ok(window)
    }

    /// Cells from the first to the last one of the window.
    fn extent(&self, axis: usize) -> u64 {
        (self.kernel[axis] - 1) * self.dilations[axis] + 1
    }

    fn volume(&self) -> u64 {
        self.kernel.iter().product()
    }

    /// Numbers of cells including padding, and of windows, along each axis. `None` if a window does not fit.
    fn moved_over(&self, space: &[u64]) -> Option<(Vec<u64>, Vec<u64>)> {
        let padded: Vec<u64> =
            (0..space.len()).map(|axis| space[axis] + self.before[axis] + self.after[axis]).collect();
        let windows = (0..space.len())
            .map(|axis| padded[axis].checked_sub(self.extent(axis)).map(|room| room / self.strides[axis] + 1));
        Some((padded.clone(), windows.collect::<Option<_>>()?))
    }

    /// Elements of memory for the cells of every window.
    fn cells_of(&self, windows: &[u64]) -> u64 {
        windows.iter().fold(self.volume().saturating_mul(PER_CELL), |product, count| product.saturating_mul(*count))
    }

    /// Attributes of a node for the window.
    fn attributes(&self) -> Vec<(&'static str, Attribute)> {
        let list = |sides: &[u64]| Attribute::Ints(sides.iter().map(|side| *side as i64).collect());
        vec![
            ("kernel_shape", list(&self.kernel)),
            ("strides", list(&self.strides)),
            ("dilations", list(&self.dilations)),
            ("pads", list(&[&self.before[..], &self.after[..]].concat())),
        ]
    }
}

/// Batch, channels and space of the first input.
fn channels_and_space<'a>(call: &Call<'a>) -> Result<(&'a Shape, [u64; 2], &'a [u64]), Refused> {
    let shape = call.floats(0)?;
    match shape.sides() {
        [batch, channels, space @ ..] if (1..=3).contains(&space.len()) => Ok((shape, [*batch, *channels], space)),
        _ => Err(format!("an input of shape {shape}, not (batch, channels, 1 to 3 sides)")),
    }
}

/// Refuses a kernel in the attributes that differs from that of the weights.
fn expect_kernel(call: &Call<'_>, kernel: &[u64]) -> Result<(), Refused> {
    match call.ints("kernel_shape")? {
        Some(stated) if !stated.iter().copied().eq(kernel.iter().map(|side| *side as i64)) => {
            Err(format!("kernel_shape is {stated:?}, but the weights have {kernel:?}"))
        }
        _ => Ok(()),
    }
}

/// Refuses a bias without one number per channel.
fn expect_bias(call: &Call<'_>, channels: u64) -> Result<Vec<Operand>, Refused> {
    let mut inputs = vec![Operand::Own(0), Operand::Own(1)];
    if call.is_given(2) {
        let bias = call.floats(2)?;
        if bias.sides() != [channels] {
            return Err(format!("a bias of shape {bias}, not ({channels})"));
        }
        inputs.push(Operand::Own(2));
    }
    Ok(inputs)
}

const OF_CONVOLUTION: [&str; 6] = ["auto_pad", "dilations", "group", "kernel_shape", "pads", "strides"];

/// Number of channel groups, which must divide both counts.
fn groups(call: &Call<'_>, channels: [u64; 2]) -> Result<u64, Refused> {
    let group = call.int("group", 1)?;
    let found = u64::try_from(group).ok().filter(|group| *group > 0 && channels.iter().all(|count| count % group == 0));
    found.ok_or_else(|| format!("{channels:?} channels cannot be divided into {group} groups"))
}

pub(super) fn convolution(call: &Call<'_>) -> Result<Outcome, Refused> {
    call.expect_attributes(&OF_CONVOLUTION)?;
    call.expect_inputs(2, 3)?;
    let (shape, [batch, into], space) = channels_and_space(call)?;
    let weights = call.floats(1)?;
    let [out, of_group, kernel @ ..] = weights.sides() else { return Err(format!("weights of shape {weights}")) };
    let group = groups(call, [into, *out])?;
    if of_group.checked_mul(group) != Some(into) {
        return Err(format!("weights of shape {weights} for {into} channels in {group} groups"));
    }
    expect_kernel(call, kernel)?;
    let window = Window::read(call, kernel.to_vec(), space, false)?;
    let refused = || format!("a kernel of {kernel:?} does not fit into {shape} with its padding");
    let (padded, windows) = window.moved_over(space).ok_or_else(refused)?;
    let inputs = expect_bias(call, *out)?;
    let output = shape_of([batch, *out].into_iter().chain(windows.iter().copied()).collect())?;
    let padded = shape_of([batch, into].into_iter().chain(padded).collect())?;
    // A matrix product per group: channels x (channels of the group, kernel) x windows.
    let depth = of_group.saturating_mul(window.volume());
    let cells = windows.iter().product::<u64>();
    let work = of_products(batch * group, [out / group, depth, cells]).saturating_add(output.elements() * PER_ELEMENT);
    // Padded input, and the columns of the product if the kernel is small.
    let columns = if window.volume() < 8 { depth.saturating_mul(group).saturating_mul(cells).min(1 << 21) } else { 0 };
    let of_windows = if group > 1 { window.cells_of(&windows) } else { 0 };
    let scratch = padded.elements().saturating_add(columns).saturating_add(of_windows);
    let mut attributes = window.attributes();
    attributes.push(("group", Attribute::Int(group as i64)));
    Ok(Outcome::Node { operator: "Conv", inputs, attributes, outputs: vec![output], scratch, work })
}

pub(super) fn transposed_convolution(call: &Call<'_>) -> Result<Outcome, Refused> {
    let known = [&OF_CONVOLUTION[..], &["output_padding", "output_shape"]].concat();
    call.expect_attributes(&known)?;
    call.expect_inputs(2, 3)?;
    if call.ints("output_shape")?.is_some() {
        return Err("output_shape is not supported; give pads and output_padding".to_owned());
    }
    let (_, [batch, into], space) = channels_and_space(call)?;
    let weights = call.floats(1)?;
    let [own, of_group, kernel @ ..] = weights.sides() else { return Err(format!("weights of shape {weights}")) };
    let out = of_group.saturating_mul(call.int("group", 1)?.unsigned_abs());
    let group = groups(call, [into, out])?;
    if *own != into {
        return Err(format!("weights of shape {weights} for {into} channels"));
    }
    expect_kernel(call, kernel)?;
    let window = Window::read(call, kernel.to_vec(), space, true)?;
    let more = call.sides("output_padding", space.len(), [0, bounds::WINDOW], 0)?;
    let mut sides = vec![batch, out];
    for (axis, side) in space.iter().enumerate() {
        if more[axis] >= window.strides[axis].max(window.dilations[axis]) {
            return Err(format!("output_padding of {} with a stride of {}", more[axis], window.strides[axis]));
        }
        let whole = (side - 1) * window.strides[axis] + window.extent(axis) + more[axis];
        let cut = window.before[axis] + window.after[axis];
        sides.push(whole.checked_sub(cut).filter(|side| *side > 0).ok_or("its padding leaves nothing")?);
    }
    let (inputs, output) = (expect_bias(call, out)?, shape_of(sides)?);
    let cells = space.iter().product::<u64>();
    // The product of weights and cells, followed by adding each number at its position.
    let rows = of_group.saturating_mul(window.volume());
    let numbers = rows.saturating_mul(group).saturating_mul(cells).saturating_mul(batch);
    let work = of_products(batch * group, [rows, into / group, cells])
        .saturating_add(numbers.saturating_mul(PER_ADDED))
        .saturating_add(output.elements() * PER_ELEMENT);
    let scratch = numbers.saturating_add(output.elements());
    let mut attributes = window.attributes();
    attributes.push(("group", Attribute::Int(group as i64)));
    attributes.push(("output_padding", Attribute::Ints(more.iter().map(|side| *side as i64).collect())));
    Ok(Outcome::Node { operator: "ConvTranspose", inputs, attributes, outputs: vec![output], scratch, work })
}

/// `MaxPool` and `AveragePool`.
pub(super) fn pool(call: &Call<'_>) -> Result<Outcome, Refused> {
    let is_max = call.operator == "MaxPool";
    let own: &[&str] = if is_max { &["dilations", "storage_order"] } else { &["count_include_pad"] };
    call.expect_attributes(&[&["auto_pad", "ceil_mode", "kernel_shape", "pads", "strides"], own].concat())?;
    call.expect_inputs(1, 1)?;
    let (shape, [batch, channels], space) = channels_and_space(call)?;
    if call.ints("kernel_shape")?.is_none() {
        return Err("kernel_shape is missing".to_owned());
    }
    let kernel = call.sides("kernel_shape", space.len(), [1, bounds::WINDOW], 1)?;
    let window = Window::read(call, kernel, space, false)?;
    let refused = || format!("a window of {:?} does not fit into {shape} with its padding", window.kernel);
    let (padded, windows) = window.moved_over(space).ok_or_else(refused)?;
    let is_left = |axis: usize| (padded[axis] - window.extent(axis)) % window.strides[axis] > 0;
    if call.flag("ceil_mode", false)? && (0..space.len()).any(is_left) {
        return Err("ceil_mode adds windows beyond the padding here; pad the input instead".to_owned());
    }
    let mut attributes = window.attributes();
    if is_max {
        call.flag("storage_order", false)?;
    } else {
        attributes.retain(|(name, _)| *name != "dilations");
        attributes.push(("count_include_pad", Attribute::Int(call.flag("count_include_pad", false)?.into())));
    }
    let (inputs, scratch) = (vec![Operand::Own(0)], window.cells_of(&windows));
    let output = shape_of([batch, channels].into_iter().chain(windows).collect())?;
    let work = output.elements().saturating_mul(window.volume()).saturating_mul(PER_POOLED);
    Ok(Outcome::Node { operator: call.operator, inputs, attributes, outputs: vec![output], scratch, work })
}
