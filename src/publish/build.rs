//! Generates the protobuf types of previews.

use std::error::Error;

#[path = "../../proto/compile.rs"]
mod compile;

fn main() -> Result<(), Box<dyn Error>> {
    compile::compile(|stem| stem.starts_with("foxglove"))
}
