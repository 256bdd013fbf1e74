//! Views: images of settled scenes, a second stage, about a dataset of scenes.
//!
//! [`ViewWorker`] is the producer of one thread: it draws cameras, renders every body of a scene alone, lets the nearest win, and
//! measures the depth by a sensor. All of it is of class `exact`: poses are read, nothing is stepped; colours alone are MuJoCo's, of class
//! `colour`.

mod cameras;
mod check;
mod colour;
mod image;
mod keys;
mod loaded;
mod row;
mod settings;
pub mod spec;
mod work;
mod worker;

pub use cameras::{camera_at, world_from_camera};
pub use row::FACTORY;
pub use settings::{Aim, ViewCamera, ViewJob, ViewPlacement, ViewSettings};
pub use worker::ViewWorker;
