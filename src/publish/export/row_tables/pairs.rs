//! Tables of pairs, of single objects and in clutter, and of their contacts.

use serde_json::{Map, Value as Json};

use super::{
    bodies::{BodyName, ObjectNames, OfBody, body_columns},
    column::{HasCamera, OfSample, RowColumn, camera_columns, fact_columns, sample_columns},
    objects::{self, ObjectCounts},
    row_table::{RowTable, TableName, TableRow, table_facts},
    touch::TouchTables,
};
use crate::export::{
    error::ExportError,
    form::{ExportSelection, Written},
    pair::PairSample,
    pairs::{WritePairs, write_pairs},
    selected::SelectedSample,
    target::Target,
};
use format::{
    Channel, Clutter, Product, VoxelPair,
    dataset::{AssetRow, DatasetReader},
};
use kernel::geom::{Frame, Intrinsics, Pose};
use tables::{
    ColumnType::{Bytes, F64, F64s, U32},
    Value,
};

/// Layout of the tables in words.
pub(super) const LAYOUT: &str = "\
    pairs.parquet: one row per sample in row groups of 256, in the order of samples.csv; partial, complete, \
    with touch tactile (cells that any kind of touch met) are n^3 / 8 bytes, for numpy.unpackbits(..., \
    bitorder='little')[:n**3].reshape(n, n, n), indexed [x, y, z]; poses are the top three rows of 4 x 4, \
    row-major; with touch touch.parquet: one row per contact, for hands approaches.parquet: one row per approach, and in clutter blocked.parquet: one row per blocked probe; objects.parquet: one row per object";

/// Writes the tables of a dataset of completion or amodal pairs.
pub(super) fn write(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
) -> Result<Written, ExportError> {
    let assets = reader.assets()?.objects;
    let pairs = RowTable::create::<PairRow>(reader, target, &[])?;
    let touch = TouchTables::create(reader, target)?;
    let (names, counts) = (ObjectNames::of(&assets), ObjectCounts::default());
    let writer = PairTables { reader, assets: &assets, names, pairs, touch, counts };
    write_pairs(reader, selection, target, |_| writer)
}

/// The tables while they grow.
struct PairTables<'a> {
    reader: &'a DatasetReader,
    assets: &'a [AssetRow],
    names: ObjectNames<'a>,
    pairs: RowTable,
    touch: TouchTables,
    counts: ObjectCounts,
}

/// One pair.
pub(super) struct PairRow<'a> {
    pair: &'a PairSample<'a>,
    /// The object of the pair; in clutter a body of the scene.
    body: BodyName<'a>,
    /// Surroundings of the body; `None` of a lone object.
    clutter: Option<&'a Clutter>,
}

impl WritePairs for PairTables<'_> {
    const FILE_PER_SAMPLE: bool = false;

    fn write(&mut self, sample: &PairSample<'_>, _: &mut Target) -> Result<(), ExportError> {
        let in_clutter = sample.sample.payload(Channel::CLUTTER).is_some();
        let clutter = in_clutter.then(|| sample.sample.read::<Clutter>()).transpose()?;
        let object = sample.sample.object()?;
        self.counts.add([object]);
        let body = BodyName::new(sample.pair.sample.instance, object, &self.names);
        self.pairs.extend([PairRow { pair: sample, body, clutter: clutter.as_ref() }])?;
        sample.touched.map_or(Ok(()), |touched| self.touch.push(sample.names, touched))
    }

    fn finish(self, target: &mut Target) -> Result<Map<String, Json>, ExportError> {
        let mut tables = vec![self.pairs.finish()?];
        tables.extend(self.touch.finish()?);
        tables.push(objects::write(self.reader, self.assets, &self.counts, target)?);
        Ok(table_facts(tables))
    }
}

impl OfSample for PairRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.pair.names
    }
}

impl OfBody for PairRow<'_> {
    fn body(&self) -> &BodyName<'_> {
        &self.body
    }
}

impl HasCamera for PairRow<'_> {
    fn camera(&self) -> &Intrinsics {
        &self.pair.pair.camera
    }
}

impl PairRow<'_> {
    fn pair(&self) -> &VoxelPair {
        self.pair.pair
    }
}

impl TableRow for PairRow<'_> {
    const TABLE: TableName = TableName {
        name: "pairs",
        row: "pair",
        group: 256,
        meaning: "One row per pair. The bits are n^3 / 8 bytes: `numpy.unpackbits(numpy.frombuffer(bits, numpy.uint8), \
                  bitorder=\"little\")[:n**3].reshape(n, n, n)` is indexed (x, y, z). Poses have 12 numbers in this table, the top three \
                  rows of the 4 x 4 matrix. Datasets with touch have `tactile`; amodal datasets have the columns of the body and its \
                  surroundings. Further channels, such as depth and signed distances, are only in the shards: read them with the Python \
                  package.",
    };

    fn columns(product: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("instance", U32, "number of the object's instance", |row: &Self| {
                Value::U32(row.pair().sample.instance)
            }),
            RowColumn::new("camera", U32, "number of the camera", |row| Value::U32(row.pair().sample.camera)),
        ]);
        columns.extend(body_columns().map(|column| column.of_channel(Channel::CLUTTER)));
        columns.extend([
            RowColumn::new("resolution", U32, "cells along each side of the grid, n", |row: &Self| {
                Value::U32(row.pair().grid.resolution)
            }),
            RowColumn::new("cell_size", F64, "side of a cell [m]", |row| Value::F64(row.pair().grid.cell_size)),
            RowColumn::new("centre_x", F64, "centre of the grid in camera axes [m]", |row| {
                Value::F64(row.pair().grid.centre.x)
            }),
            RowColumn::new("centre_y", F64, "centre of the grid in camera axes [m]", |row| {
                Value::F64(row.pair().grid.centre.y)
            }),
            RowColumn::new("centre_z", F64, "centre of the grid in camera axes [m]", |row| {
                Value::F64(row.pair().grid.centre.z)
            }),
        ]);
        columns.extend(camera_columns());
        columns.extend([
            RowColumn::new(
                "camera_from_object",
                F64s,
                "pose of the object in camera axes, 12 numbers [m]",
                |row: &Self| rows(&row.pair().camera_from_object),
            ),
            RowColumn::new("world_from_object", F64s, "pose of the object in the world, 12 numbers [m]", |row| {
                rows(&row.pair().world_from_object)
            }),
            RowColumn::new("world_from_camera", F64s, "pose of the camera in the world, 12 numbers [m]", |row| {
                rows(&row.pair().world_from_camera)
            }),
            RowColumn::new("partial", Bytes, "bits of the cells that hold a point the camera saw", |row| {
                Value::Bytes(row.pair().partial.bytes())
            }),
            RowColumn::new("complete", Bytes, "bits of the cells of the solid", |row| {
                Value::Bytes(row.pair().complete.bytes())
            }),
            RowColumn::new("tactile", Bytes, "bits of the cells with a contact of any kind of touch", |row: &Self| {
                row.pair.tactile().map_or(Value::Empty, |grid| Value::Bytes(grid.bytes()))
            })
            .of_channels(Channel::is_touch),
        ]);
        columns.extend(clutter_columns());
        let facts = fact_columns(product, &columns);
        columns.extend(facts);
        columns
    }
}

/// Columns of the surroundings of a body of a scene.
fn clutter_columns<'a>() -> [RowColumn<PairRow<'a>>; 6] {
    fn count(row: &PairRow<'_>, count: fn(&Clutter) -> u32) -> Value<'static> {
        row.clutter.map_or(Value::Empty, |clutter| Value::U32(count(clutter)))
    }
    let columns = [
        RowColumn::optional(
            "pixels_all",
            U32,
            "pixels of the body's silhouette alone, including those outside the image",
            |row: &PairRow<'a>| count(row, |clutter| clutter.pixels_all),
        ),
        RowColumn::optional("pixels_in_image", U32, "pixels of the body's silhouette alone, in the image", |row| {
            count(row, |clutter| clutter.pixels_in_image)
        }),
        RowColumn::optional("points", U32, "measured depths from which the partial grid is made", |row| {
            count(row, |clutter| clutter.points)
        }),
        RowColumn::optional("own_points", U32, "depths among them that were measured on the body itself", |row| {
            count(row, |clutter| clutter.own_points)
        }),
        RowColumn::optional(
            "others_seen",
            Bytes,
            "bits of the cells that hold a measured depth of anything else",
            |row| row.clutter.map_or(Value::Empty, |clutter| Value::Bytes(clutter.others_seen.bytes())),
        ),
        RowColumn::optional(
            "others_solid",
            Bytes,
            "bits of the cells that meet another body, the container or the half-space below the table",
            |row| row.clutter.map_or(Value::Empty, |clutter| Value::Bytes(clutter.others_solid.bytes())),
        ),
    ];
    columns.map(|column| column.of_channel(Channel::CLUTTER))
}

/// A pose as the top three rows of 4 x 4, row-major.
fn rows<To: Frame, From: Frame>(pose: &Pose<To, From>) -> Value<'static> {
    Value::F64s(pose.to_rows().to_vec().into())
}
