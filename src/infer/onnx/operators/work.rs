//! Time of nodes in units of one multiply-add of a large matrix product, measured with the library and rounded up.

/// Reading, computing and writing an element.
pub(super) const PER_ELEMENT: u64 = 32;
/// An element of a function computed by a series, such as the exponential function.
pub(super) const PER_FUNCTION: u64 = 128;
/// Moving an element to a position far from its neighbours'.
pub(super) const PER_SCATTERED: u64 = 128;
/// Reading, computing and writing an element with a loop over coordinates, which the library uses for a few operators.
pub(super) const PER_COORDINATE: u64 = 1024;
/// A cell of a pooling window.
pub(super) const PER_POOLED: u64 = 64;
/// A number of a transposed convolution that is added at its position.
pub(super) const PER_ADDED: u64 = 256;
/// Elements of memory for a cell of a window, once for all channels: the library stores the cells of each window within the
/// padding.
pub(super) const PER_CELL: u64 = 8;
/// A step of an interpolation along one axis.
pub(super) const PER_STEP: u64 = 256;
/// Rows, or columns, that a kernel of the library computes at once: fewer take as long.
const TILE: u64 = 16;

/// Work of products of an m x k by a k x n matrix.
pub(super) fn of_products(count: u64, [m, k, n]: [u64; 3]) -> u64 {
    [m.next_multiple_of(TILE), k, n.next_multiple_of(TILE)].into_iter().fold(count, u64::saturating_mul)
}
