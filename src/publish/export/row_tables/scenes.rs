//! Tables of scenes: scenes, their bodies, contacts, and support relations.

use super::{
    bodies::{BodyRow, ObjectNames},
    column::{HasContainer, OfSample, RowColumn, container_columns, fact_columns, matrix, numbers, sample_columns},
    objects::{self, ObjectCounts},
    row_table::{RowTable, TableName, TableRow, table_facts},
};
use crate::export::{
    error::ExportError,
    form::{ExportSelection, Written},
    selected::{SelectedSample, SelectedSamples},
    target::Target,
};
use format::{Product, Scene, SceneContact, SceneContainer, SceneSupport, dataset::DatasetReader};
use tables::{
    ColumnType::{F64, F64s, Text, U32},
    Value,
};

/// Layout of the tables in words.
pub(super) const LAYOUT: &str = "\
    scenes.parquet: one row per scene; bodies.parquet: one row per body; body_contacts.parquet: one row per point at which two bodies \
    touch; supports.parquet: one row per body that carries another; objects.parquet: one row per object. sample_index joins them. \
    Poses are 16 numbers, 4 x 4 row-major";

/// One scene.
pub(super) struct SceneRow<'a> {
    sample: &'a SelectedSample<'a>,
    scene: &'a Scene,
    id: String,
}

/// One point at which two bodies touch.
pub(super) struct ContactRow<'a> {
    sample: &'a SelectedSample<'a>,
    contact: &'a SceneContact,
}

/// One body that carries another.
pub(super) struct SupportRow<'a> {
    sample: &'a SelectedSample<'a>,
    support: &'a SceneSupport,
}

/// Writes the tables.
pub(super) fn write(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let names = ObjectNames::of(&assets.objects);
    let selected = SelectedSamples::of(reader, &assets.subjects, selection)?;
    let mut scenes = RowTable::create::<SceneRow>(reader, target, &[])?;
    let mut bodies = RowTable::create::<BodyRow>(reader, target, &[])?;
    let mut contacts = RowTable::create::<ContactRow>(reader, target, &[])?;
    let mut supports = RowTable::create::<SupportRow>(reader, target, &[])?;
    let mut counts = ObjectCounts::default();
    selected.each(|stored, sample| {
        let scene = &stored.read::<Scene>()?;
        counts.add(scene.bodies.iter().map(|body| body.object));
        scenes.extend([SceneRow { sample, scene, id: scene.id().to_string() }])?;
        bodies.extend(BodyRow::of_scene(sample, &names, &scene.bodies))?;
        contacts.extend(scene.contacts.iter().map(|contact| ContactRow { sample, contact }))?;
        supports.extend(scene.supports.iter().map(|support| SupportRow { sample, support }))
    })?;
    let objects = objects::write(reader, &assets.objects, &counts, target)?;
    let mut written = Written::selection(selected.count(), "scenes", selection);
    let tables = [scenes.finish()?, bodies.finish()?, contacts.finish()?, supports.finish()?, objects];
    written.facts.extend(table_facts(tables));
    Ok(written)
}

impl OfSample for SceneRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl HasContainer for SceneRow<'_> {
    fn container(&self) -> &SceneContainer {
        &self.scene.container
    }
}

impl OfSample for ContactRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfSample for SupportRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl TableRow for SceneRow<'_> {
    const TABLE: TableName = TableName {
        name: "scenes",
        row: "scene",
        group: 4096,
        meaning: "One row per scene. The subject of a scene is its split; `scene` is the `subject` of the views, pairs, volumes, picks and \
                  heatmaps made from it. The triangles of a container that is a mesh are only in the shards (`container_mesh` of the \
                  Python package).",
    };

    fn columns(product: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("scene", Text, "digest of the scene, 64 hexadecimal digits", |row: &Self| {
                Value::Text(&row.id)
            }),
            RowColumn::new("mode", Text, "table, heap, bin, packed, pile or imported", |row| {
                Value::Text(row.scene.mode.name())
            }),
        ]);
        columns.extend(container_columns());
        columns.extend([
            RowColumn::optional("source", Text, "name of an imported scene among its files", |row: &Self| {
                row.scene.import.as_ref().map_or(Value::Empty, |import| Value::Text(&import.source))
            }),
            RowColumn::optional(
                "world_from_source",
                F64s,
                "16 numbers: pose of the world of an imported scene's files in the world [m]",
                |row| row.scene.import.as_ref().map_or(Value::Empty, |import| matrix(&import.world_from_source)),
            ),
            RowColumn::optional("crossed", U32, "pairs of bodies of an imported scene that intersect", |row| {
                row.scene.import.as_ref().map_or(Value::Empty, |import| Value::U32(import.crossed))
            }),
        ]);
        let facts = fact_columns(product, &columns);
        columns.extend(facts);
        columns
    }
}

impl TableRow for ContactRow<'_> {
    const TABLE: TableName = TableName {
        name: "body_contacts",
        row: "contact",
        group: 32768,
        meaning: "One row per point at which two bodies touch, or a body and the container, which has the number 0.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new(
                "first",
                U32,
                "number of the first body, the lower one; 0 is the container",
                |row: &Self| Value::U32(row.contact.pair[0]),
            ),
            RowColumn::new("second", U32, "number of the second body", |row| Value::U32(row.contact.pair[1])),
            RowColumn::new("point", F64s, "3 numbers: half way between the surfaces, in the world [m]", |row| {
                numbers(Some(&row.contact.point))
            }),
            RowColumn::new("normal", F64s, "3 numbers: out of the first, unit length, in the world", |row| {
                numbers(Some(&row.contact.normal))
            }),
            RowColumn::new("distance", F64, "between the surfaces [m], negative where they overlap", |row| {
                Value::F64(row.contact.distance)
            }),
            RowColumn::new("force", F64s, "3 numbers: force of the first on the second, in the world [N]", |row| {
                numbers(Some(&row.contact.force))
            }),
            RowColumn::new(
                "torque",
                F64s,
                "3 numbers: torque of the first on the second about the point, of torsion and rolling, in the world [N m]",
                |row| numbers(Some(&row.contact.torque)),
            ),
        ]);
        columns
    }
}

impl TableRow for SupportRow<'_> {
    const TABLE: TableName =
        TableName { name: "supports", row: "support", group: 32768, meaning: "One row per body that carries another." };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("by", U32, "number of the supporting body; 0 is the container", |row: &Self| {
                Value::U32(row.support.by)
            }),
            RowColumn::new("body", U32, "number of the carried body, from 1", |row| Value::U32(row.support.body)),
            RowColumn::new("share", F64, "share of the carried body's weight", |row| Value::F64(row.support.share)),
        ]);
        columns
    }
}
