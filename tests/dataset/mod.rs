//! The format, from the outside: written and read by us, by readers that are not ours, and in other formats.

mod classes;
mod damage;
mod export;
mod golden;
mod imports;
mod peers;
mod python_package;
mod reading;
mod schemas;
