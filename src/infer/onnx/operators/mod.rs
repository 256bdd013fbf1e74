//! Supported operators, each with its rule: bounds of its attributes, shape of its outputs, memory and work.
//!
//! Source: the operators' documentation of ONNX, operator set 18. A rule normalises the node for the library: axes counted from
//! the start, padding as numbers, complete shapes.

mod arrange;
mod elementwise;
mod matrix;
mod resample;
mod wholes;
mod window;
mod work;

use super::call::{Call, Outcome, Refused};

/// Checks a node and returns its result.
pub(super) type Rule = fn(&Call<'_>) -> Result<Outcome, Refused>;

/// Operators with their rules, in alphabetical order.
pub(super) const OPERATORS: &[(&str, Rule)] = &[
    ("Abs", elementwise::unary),
    ("Add", elementwise::binary),
    ("AveragePool", window::pool),
    ("BatchNormalization", elementwise::batch_normalization),
    ("Cast", wholes::cast),
    ("Clip", elementwise::clip),
    ("Concat", arrange::concat),
    ("Conv", window::convolution),
    ("ConvTranspose", window::transposed_convolution),
    ("Div", elementwise::binary),
    ("Elu", elementwise::with_alpha),
    ("Erf", elementwise::unary),
    ("Exp", elementwise::unary),
    ("Flatten", arrange::flatten),
    ("Gather", arrange::gather),
    ("Gemm", matrix::gemm),
    ("GlobalAveragePool", matrix::global_pool),
    ("GlobalMaxPool", matrix::global_pool),
    ("HardSigmoid", elementwise::hard_sigmoid),
    ("Identity", arrange::identity),
    ("InstanceNormalization", elementwise::instance_normalization),
    ("LeakyRelu", elementwise::with_alpha),
    ("MatMul", matrix::product),
    ("Max", elementwise::variadic),
    ("MaxPool", window::pool),
    ("Min", elementwise::variadic),
    ("Mul", elementwise::binary),
    ("Neg", elementwise::unary),
    ("PRelu", elementwise::prelu),
    ("Pad", resample::pad),
    ("ReduceMax", matrix::reduce),
    ("ReduceMean", matrix::reduce),
    ("ReduceSum", matrix::reduce),
    ("Relu", elementwise::unary),
    ("Reshape", arrange::reshape),
    ("Resize", resample::resize),
    ("Shape", wholes::shape),
    ("Sigmoid", elementwise::unary),
    ("Slice", arrange::slice),
    ("Softmax", elementwise::softmax),
    ("Softplus", elementwise::unary),
    ("Split", arrange::split),
    ("Sqrt", elementwise::unary),
    ("Squeeze", arrange::squeeze),
    ("Sub", elementwise::binary),
    ("Sum", elementwise::variadic),
    ("Tanh", elementwise::unary),
    ("Transpose", arrange::transpose),
    ("Unsqueeze", arrange::unsqueeze),
];

/// Finds operator and rule by name.
pub(super) fn rule_of(name: &str) -> Option<(&'static str, Rule)> {
    OPERATORS.iter().find(|(own, _)| *own == name).copied()
}
