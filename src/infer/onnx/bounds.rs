//! Bounds of networks, checked before the library sees them. `docs/models.md` lists them with their guarantees.

/// Nodes of a network. The library's time for sorting a network grows with the square of this number.
pub(super) const NODES: usize = 256;
/// Constant tensors of a network: initializers and constants in nodes.
pub(super) const TENSORS: usize = 1024;
/// Inputs, or outputs, of one node.
pub(super) const ENDS_OF_NODE: usize = 32;
/// Attributes of one node.
pub(super) const ATTRIBUTES: usize = 16;
/// Numbers of a list attribute, and integers of a constant that defines shapes.
pub(super) const LIST: usize = 64;
/// Bytes of a name.
pub(super) const NAME: usize = 256;
/// Inputs and outputs of a network.
pub(super) const ENDS: usize = 8;
/// Axes of a tensor.
pub(super) const RANK: usize = 8;
/// Side of a window, its stride, its dilation, and cells of padding on one side.
pub(super) const WINDOW: u64 = 64;
/// Elements of a tensor that the network computes.
pub(super) const ELEMENTS: u64 = 1 << 24;
/// Elements of all tensors that the network computes, including scratch memory of its nodes: 512 MiB in single precision.
pub(super) const ALL_ELEMENTS: u64 = 1 << 27;
/// Multiply-adds of one sample, or equivalent work.
pub(crate) const WORK: u64 = 1 << 34;
/// Bytes read when all pairs of constants of one shape are compared up to the first difference, as the library does.
pub(super) const COMPARED: u64 = 1 << 30;
