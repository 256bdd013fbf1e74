//! Datasets from the outside: the command line, jobs, tasks of clusters, the format and its readers, damage and forgery, reports
//! and releases, and additions to the repository.
//!
//! Few binaries hold all integration tests, so that `support` is compiled and linked a few times only and no test waits for the
//! last one of another binary.

mod cli;
mod cluster;
mod dataset;
mod extension;
mod integrity;
mod jobs;
mod publish;
mod support;
