//! The format, from the outside.

mod damage;
mod golden;
mod made;
mod peers;
mod reading;
