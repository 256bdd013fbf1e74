//! Datasets in other formats.
