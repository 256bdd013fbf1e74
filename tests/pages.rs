//! The documents: their blocks run, their links and commands exist, and what they state of program and tests is true.
//!
//! A binary of its own: its tests enter the folder in which the documents' programs run.

mod documents;
mod support;
