//! ONNX networks, read and checked before the library sees them.
//!
//! A file of a few kilobytes can require more memory and time than any machine has. Therefore the library never reads the file:
//! it is read with bounds (`document`), each node is checked by the rule of its operator, which infers the shapes of its outputs
//! (`operators`), elements and work are summed up (`check`), and the library receives a rewritten network with only the required
//! nodes, numbers as names, known shapes, and normalised attributes.

mod bounds;
mod call;
mod check;
mod document;
mod fault;
mod operators;
#[cfg(test)]
mod tests;
mod value;
mod wire;

pub(crate) use bounds::WORK;
pub(crate) use call::Attribute;
pub(crate) use check::{Constant, Network, Node};
