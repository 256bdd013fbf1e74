//! Shared by every test binary and by the benches: the built program and its peers, folders to work in, small jobs and
//! datasets, meshes, robots, hands and settings. Each is defined here once.
#![allow(dead_code, reason = "each binary uses a part of it")]

pub mod annealing;
pub mod files;
pub mod first_change;
pub mod first_words;
pub mod jobs;
pub mod measures;
pub mod meshes;
pub mod pairs;
pub mod polygons;
pub mod products;
pub mod program;
pub mod robots;
pub mod schemas;
pub mod shelf;
pub mod small_dataset;
pub mod solid;
pub mod touch_test;
pub mod workspace;
