//! Job files as written: the one source of their keys, from which the decoder, the JSON Schema and the reference in the
//! documentation are all derived (see `schema`). Keys that every job has are defined here, sections that several products share in
//! `sections`, the others with their product.

mod set;

use schemars::{JsonSchema, json_schema};
use serde::{Deserialize, Serialize};
use serde_json::json;
pub use set::{MemberSpec, SetSpec};

use crate::sections::Profile;
use format::Product;

/// The keys that every job has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeadSpec {
    /// Product of the job; determines the other keys.
    #[schemars(schema_with = "product_schema")]
    pub product: Product,
    /// Name of the job, for readers. Default: the file's name.
    #[schemars(extend("examples" = ["ycb-completion"]))]
    pub name: Option<String>,
    /// Seed of every random stream: split, distances, sensor noise, starts of a search. Each stream is keyed by its purpose,
    /// so that adding a mesh or storing one more channel changes no other sample.
    #[schemars(range(min = 0), extend("examples" = [7]))]
    pub seed: i64,
    /// Defaults of the other keys. Every key that a profile sets can also be set directly.
    #[schemars(extend("examples" = ["thesis"]))]
    pub profile: Profile,
    /// Overrides by `--set` when this file was written. Already applied; informative only.
    pub overrides: Vec<String>,
}

/// The names of all products, each with its meaning.
fn product_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    let choice = |product: Product| json!({ "const": product.name, "description": product.summary, "type": "string" });
    let choices: Vec<_> = Product::all().map(choice).collect();
    json_schema!({ "oneOf": choices, "examples": ["reachability"] })
}
