//! ONNX networks, read and checked before the library sees them.
//!
//! A file of a few kilobytes can ask for more memory and time than any machine has. Therefore nothing of it reaches the library as it
//! stands: the file is read with bounds (`document`), each node is checked by the rule of its operator, which infers the shapes of what
//! it computes (`operators`), elements and work are summed up (`check`), and the library gets a network that is written anew: the nodes
//! that the outputs need, with numbers for names, all shapes known, and every attribute in one spelling.

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
