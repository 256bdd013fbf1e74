//! The table of objects: mass, kind, shape and resting poses.

use std::{
    borrow::Cow,
    collections::{BTreeMap, BTreeSet},
};

use serde_json::Value as Json;

use super::{
    column::RowColumn,
    row_table::{RowTable, TableName, TableRow, WrittenTable},
};
use crate::export::{error::ExportError, target::Target};
use format::{
    Product,
    dataset::{AssetRow, DatasetError, DatasetReader, ObjectFacts},
};
use kernel::{
    geom::{MassProperties, RestingPose, RestingPoses},
    ids::{Digest, ObjectId},
};
use tables::{
    ColumnType::{Boolean, F64, F64s, Text, U32, U64},
    Value,
};

/// One object.
pub(super) struct ObjectRow<'a> {
    asset: &'a AssetRow,
    facts: Option<ObjectFacts>,
    resting: Option<RestingPoses>,
    subject: String,
    split: &'static str,
    samples: u64,
}

/// Samples of an export that contain each object.
#[derive(Default)]
pub(super) struct ObjectCounts(BTreeMap<ObjectId, u64>);

impl ObjectCounts {
    /// Counts a sample with these objects, each once.
    pub fn add(&mut self, objects: impl IntoIterator<Item = ObjectId>) {
        let objects: BTreeSet<ObjectId> = objects.into_iter().collect();
        objects.into_iter().for_each(|object| *self.0.entry(object).or_default() += 1);
    }
}

/// The objects of each scene, in the order of its bodies, as rows of the asset table list them.
pub(super) fn bodies_of_scenes(scenes: &[AssetRow]) -> BTreeMap<ObjectId, Vec<ObjectId>> {
    let digests = |row: &AssetRow| {
        let listed = row.facts.get("objects").and_then(Json::as_array).cloned().unwrap_or_default();
        listed.iter().filter_map(|digest| digest.as_str().and_then(Digest::from_hex).map(ObjectId)).collect()
    };
    scenes.iter().map(|row| (row.object, digests(row))).collect()
}

/// Writes `objects.parquet`: the objects of the exported samples, in the order of `assets.json`.
///
/// # Errors
/// When a row of the asset table is invalid, or the file can't be written.
pub(super) fn write(
    reader: &DatasetReader,
    assets: &[AssetRow],
    counts: &ObjectCounts,
    target: &mut Target,
) -> Result<WrittenTable, ExportError> {
    let mut table = RowTable::create::<ObjectRow>(reader, target, &[])?;
    for asset in assets {
        let Some(samples) = counts.0.get(&asset.object) else { continue };
        let (facts, resting) = (asset.object_facts(), asset.resting());
        let facts = facts.map_err(|error| invalid(reader, error.to_string()))?;
        let resting = resting.map_err(|error| invalid(reader, error.to_string()))?;
        let split = reader.splits().object(&asset.object).map_or("", |split| split.split.name());
        let subject = asset.object.to_string();
        table.extend([ObjectRow { asset, facts, resting, subject, split, samples: *samples }])?;
    }
    table.finish()
}

/// Error for an invalid row of the asset table.
fn invalid(reader: &DatasetReader, problem: String) -> ExportError {
    let path = reader.folder().path_of("assets.json");
    DatasetError::Invalid { path, problem, remedy: "`verify` the dataset" }.into()
}

impl ObjectRow<'_> {
    fn of_resting(&self, numbers: fn(&RestingPose) -> Vec<f64>) -> Value<'static> {
        self.resting
            .as_ref()
            .map_or(Value::Empty, |resting| Value::F64s(resting.poses.iter().flat_map(numbers).collect()))
    }

    fn solid(&self) -> Option<&MassProperties> {
        self.facts.as_ref()?.solid.as_ref()
    }

    fn text(&self, key: &str) -> Value<'_> {
        self.asset.facts.get(key).and_then(Json::as_str).map_or(Value::Empty, Value::Text)
    }

    /// All numbers below a key, in their order.
    fn numbers(&self, keys: &[&str]) -> Value<'_> {
        let mut found = self.asset.facts.get(keys[0]);
        for key in &keys[1..] {
            found = found.and_then(|value| value.get(key));
        }
        found.map_or(Value::Empty, |value| Value::F64s(Cow::Owned(numbers_in(value))))
    }

    fn fact<'a>(&'a self, fact: impl Fn(&'a ObjectFacts) -> Option<Value<'a>>) -> Value<'a> {
        self.facts.as_ref().and_then(fact).unwrap_or(Value::Empty)
    }
}

/// The numbers of a list of lists or tables, in order: of a table those of its keys, sorted.
fn numbers_in(value: &Json) -> Vec<f64> {
    match value {
        Json::Number(number) => number.as_f64().into_iter().collect(),
        Json::Array(values) => values.iter().flat_map(numbers_in).collect(),
        Json::Object(table) => table.values().flat_map(numbers_in).collect(),
        _ => Vec::new(),
    }
}

fn matrix_of(solid: &MassProperties, factor: f64) -> Value<'static> {
    Value::F64s((solid.inertia * factor).transpose().as_slice().to_vec().into())
}

impl TableRow for ObjectRow<'_> {
    const TABLE: TableName = TableName {
        name: "objects",
        row: "object",
        group: 1024,
        meaning: "One row per object of the exported samples, with its physical properties ([format](format.md#tables)). Join it with the \
                  other tables on `object` if the samples are of objects, and on `body_name` in tables of scenes. `object_facts` of the \
                  Python package returns the same without an export.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = vec![
            RowColumn::new("subject", Text, "digest of the object, 64 hexadecimal digits", |row: &Self| {
                Value::Text(&row.subject)
            }),
            RowColumn::new("object", Text, "name of the object", |row| Value::Text(&row.asset.name)),
            RowColumn::new("split", Text, "split of the object; empty if the product has no splits", |row| {
                Value::Text(row.split)
            }),
            RowColumn::new("samples", U64, "samples in this export that the object is in", |row| {
                Value::U64(row.samples)
            }),
            RowColumn::optional("group", Text, "family, for splits by group", |row| row.text("group")),
            RowColumn::optional("category", Text, "kind of object, if the job gives it", |row| row.text("category")),
            RowColumn::optional("material", Text, "class of material, if the job gives it", |row| row.text("material")),
            RowColumn::optional("licence", Text, "licence of the mesh", |row| row.text("licence")),
        ];
        columns.extend(weight_columns());
        columns.extend(shape_columns());
        columns
    }
}

/// Columns of the object's mass.
fn weight_columns<'a>() -> [RowColumn<ObjectRow<'a>>; 8] {
    [
        RowColumn::optional("mass", F64, "mass [kg]", |row: &ObjectRow<'a>| {
            row.fact(|facts| Some(Value::F64(facts.mass)))
        }),
        RowColumn::optional(
            "mass_from",
            Text,
            "origin of the mass: job, table, material, or hull (the area of the convex hull)",
            |row| row.fact(|facts| Some(Value::Text(&facts.mass_from))),
        ),
        RowColumn::optional("mass_source", Text, "source of the mass in words; may be empty", |row| {
            row.fact(|facts| Some(Value::Text(&facts.mass_source)))
        }),
        RowColumn::optional("friction", F64, "coefficient of friction against hands in trials", |row| {
            row.fact(|facts| facts.friction.map(Value::F64))
        }),
        RowColumn::optional("solid_volume", F64, "volume of the solid, by its cells [m^3]", |row| {
            row.solid().map_or(Value::Empty, |solid| Value::F64(solid.volume))
        }),
        RowColumn::optional("centre_of_mass", F64s, "3 numbers: of the solid, in the object's frame [m]", |row| {
            row.solid().map_or(Value::Empty, |solid| Value::F64s(solid.centre.coords.as_slice().into()))
        }),
        RowColumn::optional(
            "inertia_per_kilogram",
            F64s,
            "9 numbers: inertia about the centre of mass, of one kilogram [m^2]",
            |row| row.solid().map_or(Value::Empty, |solid| matrix_of(solid, 1.0)),
        ),
        RowColumn::optional("inertia", F64s, "9 numbers: inertia about the centre of mass [kg m^2]", |row| {
            row.fact(|facts| Some(matrix_of(facts.solid.as_ref()?, facts.mass)))
        }),
    ]
}

/// Columns of the object's mesh, symmetries and resting poses.
fn shape_columns<'a>() -> [RowColumn<ObjectRow<'a>>; 10] {
    [
        RowColumn::optional("extents", F64s, "3 numbers: sides of the box of the mesh [m]", |row: &ObjectRow<'a>| {
            row.numbers(&["extents"])
        }),
        RowColumn::optional("bodies", U32, "connected bodies of the mesh", |row| {
            let count = row.asset.facts.get("bodies").and_then(Json::as_u64);
            count.and_then(|count| u32::try_from(count).ok()).map_or(Value::Empty, Value::U32)
        }),
        RowColumn::optional("watertight", Boolean, "whether every edge of the mesh has two faces", |row| {
            row.asset.facts.get("watertight").and_then(Json::as_bool).map_or(Value::Empty, Value::Boolean)
        }),
        RowColumn::optional(
            "symmetry_group",
            Text,
            "group of its rotations: C1 none, C and D with the order of the main axis (inf: any angle), T, O, I, K a ball",
            |row| {
                let group = row.asset.facts.get("symmetry").and_then(|symmetry| symmetry.get("group"));
                group.and_then(Json::as_str).map_or(Value::Empty, Value::Text)
            },
        ),
        RowColumn::optional(
            "symmetries_discrete",
            F64s,
            "16 numbers per rotation, 4 x 4 row-major: object_from_object [m]",
            |row| row.numbers(&["symmetry", "symmetries_discrete"]),
        ),
        RowColumn::optional(
            "symmetries_continuous",
            F64s,
            "6 numbers per axis of rotation by any angle: direction, then a point on it [m]",
            |row| row.numbers(&["symmetry", "symmetries_continuous"]),
        ),
        RowColumn::optional(
            "mirror_normals",
            F64s,
            "3 numbers per plane of reflection through the centre of mass: its normal",
            |row| row.numbers(&["symmetry", "mirror_normals"]),
        ),
        RowColumn::optional(
            "symmetry_tolerance",
            F64,
            "largest distance from the surface at which a mapped point still counts as on it [m]",
            |row| {
                let tolerance = row.asset.facts.get("symmetry").and_then(|symmetry| symmetry.get("tolerance"));
                tolerance.and_then(Json::as_f64).map_or(Value::Empty, Value::F64)
            },
        ),
        RowColumn::optional(
            "resting_probability",
            F64s,
            "one number per resting pose: the share of random drops that end in it",
            |row| row.of_resting(|pose| vec![pose.probability]),
        ),
        RowColumn::optional(
            "resting_world_from_object",
            F64s,
            "16 numbers per resting pose, 4 x 4 row-major: the object on the table z = 0 [m]",
            |row| {
                row.of_resting(|pose| {
                    pose.world_from_object.to_rows().into_iter().chain([0.0, 0.0, 0.0, 1.0]).collect()
                })
            },
        ),
    ]
}
