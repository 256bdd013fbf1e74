//! Reports and pictures.
