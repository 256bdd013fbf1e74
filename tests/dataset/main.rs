//! The format, from the outside.

mod classes;
mod damage;
mod golden;
mod made;
mod peers;
#[path = "../python/mod.rs"]
mod python;
mod reading;
