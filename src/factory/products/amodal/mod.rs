//! Amodal pairs: completion pairs of the bodies of settled scenes, a stage behind views, about a dataset of them.
//!
//! [`AmodalWorker`] is the producer of one thread: it reads an image (`image`), takes the depth of each body that
//! passes the gate, makes its pair as completion does (`pair`, which both share), and adds its surroundings
//! (`neighbours`) and its touch among them (`touch`, `hands`). Views contain all poses and the meshes (`viewed`), so
//! that nothing else is read. All results except touch by hands are of class `exact`.

mod check;
mod hands;
mod image;
mod keys;
mod meshes;
mod neighbours;
mod row;
mod scene;
mod settings;
pub mod spec;
mod touch;
mod work;
mod worker;

pub use row::FACTORY;
pub use settings::{AmodalJob, AmodalSettings, PointSource};
pub use worker::AmodalWorker;
