//! The format, from the outside.

mod damage;
mod made;
mod reading;
