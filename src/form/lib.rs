//! Strict TOML: every key must be known, every value is checked, and all mistakes are reported at once, each with its line, its
//! key and a remedy.
//!
//! ```text
//!  text, overrides       schema_of::<T>, Hints        the caller's own checks
//!        |                        |                             |
//!        v                        v                             v
//!    Document --------> Checker::check_schema ---> T + Checker::{fail, missing, ...} ---> finish
//!  keys and values      takes out what does        what types cannot express             T, or
//!  with their locations not fit the types                                                FormErrors
//! ```
//!
//! [`decode`] does the first two steps for files of one form. A file whose form depends on one of its keys, or whose defaults
//! are in other files, is read step by step: [`Document::read`], [`Checker::check_schema`], [`Schema::lay_over`]. A value that
//! does not fit is removed and replaced by its default or a placeholder, so that later checks still run.
//!
//! ```
//! use graspmill_form::{decode, schema_of};
//! use schemars::JsonSchema;
//! use serde::Deserialize;
//!
//! /// A pump.
//! #[derive(Debug, Deserialize, JsonSchema)]
//! #[serde(deny_unknown_fields)]
//! struct Pump {
//!     /// Volume per second.
//!     #[schemars(range(max = 5), extend("x-unit" = "l/s", "exclusiveMinimum" = 0))]
//!     flow: f64,
//!     /// Inner diameters of inlet and outlet.
//!     #[schemars(extend("x-unit" = "mm"))]
//!     diameters: [f64; 2],
//! }
//!
//! let schema = schema_of::<Pump>("a pump");
//! let read = |text: &str| {
//!     let (pump, mut checker) = decode::<Pump>("pump.toml", text, &[], &schema, &())?;
//!     if pump.diameters[1] > pump.diameters[0] {
//!         checker.invalid("diameters", "an outlet no wider than the inlet", format!("{:?} mm", pump.diameters));
//!     }
//!     checker.finish().map(|_| pump)
//! };
//!
//! assert_eq!(read("flow = 2.5\ndiameters = [25, 20]\n")?.flow, 2.5);
//! let errors = read("flwo = 2.5\ndiameters = [20, 25]\n").expect_err("three mistakes");
//! assert_eq!(
//!     errors.to_string(),
//!     "pump.toml:1:1: flow: missing: expected a number above 0 to 5 [l/s]\n\
//!      pump.toml:1:1: flwo: unknown key `flwo`; did you mean `flow`?\n\
//!      pump.toml:2:13: diameters: expected an outlet no wider than the inlet, found [20.0, 25.0] mm"
//! );
//! # Ok::<(), graspmill_form::FormErrors>(())
//! ```
//!
//! This crate knows no particular file.

mod checker;
mod decode;
mod document;
mod errors;
mod names;
mod path;
mod pattern;
mod reference;
mod requirement;
mod schema;
mod source;
mod walk;

pub use checker::{Checker, Report};
pub use decode::{decode, decode_own};
pub use document::Document;
pub use errors::{FormError, FormErrors, FormProblem, Mistakes};
pub use names::{did_you_mean, first_repeated, nearest};
pub use path::Path;
pub use pattern::{fits_name, fits_path, literal_pattern};
pub use reference::Reference;
pub use requirement::{Bounds, Finding, Requirement};
pub use schema::{Schema, schema_of};
pub use source::{Location, Source};
pub use walk::Hints;
