//! Tables of completion datasets: pairs, and what touched their objects.

use serde_json::{Map, Value as Json};

use super::{
    column::{OfSample, RowColumn, RowTable, WrittenTable, sample_columns, table_facts},
    objects,
    touch::TouchTables,
};
use crate::export::{
    error::ExportError,
    form::{ExportSelection, Written},
    pair::PairSample,
    pairs::{WritePairs, write_pairs},
    selected::{SampleNames, SelectedSamples},
    target::Target,
};
use format::dataset::DatasetReader;
use kernel::geom::{Frame, Pose};
use tables::{
    ColumnType::{Bytes, F64, F64s, U32},
    Value,
};

/// Rows of a row group: what a reader holds to shuffle, 4 MB of bits at 40^3.
const ROW_GROUP: usize = 256;

/// Layout of the tables in words.
pub(super) const LAYOUT: &str = "\
    pairs.parquet: one row per sample in row groups of 256, in the order of samples.csv; partial, complete, \
    with touch tactile (cells that any kind of touch met) are n^3 / 8 bytes, for numpy.unpackbits(..., \
    bitorder='little')[:n**3].reshape(n, n, n), indexed [x, y, z]; poses are the top three rows of 4 x 4, \
    row-major; with touch touch.parquet: one row per contact, and of hands approaches.parquet: one row per \
    approach; objects.parquet: one row per object";

/// Writes `pairs.parquet` and `objects.parquet`, and with touch its tables.
pub(super) fn write(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
) -> Result<Written, ExportError> {
    let touched = reader.manifest().channels().iter().any(|channel| channel.is_touch());
    let assets = reader.assets()?.objects;
    let objects = objects::write(reader, &assets, &SelectedSamples::of(reader, &assets, selection)?, target)?;
    let pairs = RowTable::create(("pairs", "pair", ROW_GROUP), &columns(touched), (reader, &mut *target), &[])?;
    let writer = PairTables { pairs, touched, touch: TouchTables::create(reader, target)?, objects };
    write_pairs(reader, selection, target, |_| writer)
}

/// The tables while they grow.
struct PairTables {
    pairs: RowTable,
    touched: bool,
    touch: TouchTables,
    objects: WrittenTable,
}

impl WritePairs for PairTables {
    const FILE_PER_SAMPLE: bool = false;

    fn write(&mut self, sample: &PairSample<'_>, _: &mut Target) -> Result<(), ExportError> {
        self.pairs.push(&columns(self.touched), sample)?;
        sample.touched.map_or(Ok(()), |touched| self.touch.push(sample.names, touched))
    }

    fn finish(self) -> Result<Map<String, Json>, ExportError> {
        let mut tables = vec![self.pairs.finish()?];
        tables.extend(self.touch.finish()?);
        tables.push(self.objects);
        Ok(table_facts(tables))
    }
}

impl OfSample for PairSample<'_> {
    fn names(&self) -> &SampleNames<'_> {
        self.names
    }
}

fn columns<'a>(touched: bool) -> Vec<RowColumn<PairSample<'a>>> {
    let mut columns = sample_columns();
    columns.extend([
        RowColumn::new("instance", U32, "number of the object's instance", |row: &PairSample<'a>| {
            Value::U32(row.pair.sample.instance)
        }),
        RowColumn::new("camera", U32, "number of the camera", |row| Value::U32(row.pair.sample.camera)),
        RowColumn::new("resolution", U32, "cells along each side of the grid, n", |row| {
            Value::U32(row.pair.grid.resolution)
        }),
        RowColumn::new("partial_cells", U32, "cells that hold a seen point", |row| Value::U32(row.pair.partial_cells)),
        RowColumn::new("complete_cells", U32, "cells of the solid", |row| Value::U32(row.pair.complete_cells)),
        RowColumn::new("both_cells", U32, "cells of both", |row| Value::U32(row.pair.both_cells)),
        RowColumn::new("solid_share", F64, "share of the solid's volume that lies inside the grid, 0 to 1", |row| {
            Value::F64(row.pair.solid_share)
        }),
        RowColumn::new("cell_size", F64, "side of a cell [m]", |row| Value::F64(row.pair.grid.cell_size)),
        RowColumn::new("centre_x", F64, "centre of the grid in camera axes [m]", |row| {
            Value::F64(row.pair.grid.centre.x)
        }),
        RowColumn::new("centre_y", F64, "centre of the grid in camera axes [m]", |row| {
            Value::F64(row.pair.grid.centre.y)
        }),
        RowColumn::new("centre_z", F64, "centre of the grid in camera axes [m]", |row| {
            Value::F64(row.pair.grid.centre.z)
        }),
        RowColumn::new("fx", F64, "focal length of the camera [px]", |row| Value::F64(row.pair.camera.fx)),
        RowColumn::new("fy", F64, "focal length of the camera [px]", |row| Value::F64(row.pair.camera.fy)),
        RowColumn::new("cx", F64, "principal point of the camera [px]", |row| Value::F64(row.pair.camera.cx)),
        RowColumn::new("cy", F64, "principal point of the camera [px]", |row| Value::F64(row.pair.camera.cy)),
        RowColumn::new("camera_from_object", F64s, "pose of the object in camera axes, 12 numbers [m]", |row| {
            rows(&row.pair.camera_from_object)
        }),
        RowColumn::new("world_from_object", F64s, "pose of the object in the room, 12 numbers [m]", |row| {
            rows(&row.pair.world_from_object)
        }),
        RowColumn::new("world_from_camera", F64s, "pose of the camera in the room, 12 numbers [m]", |row| {
            rows(&row.pair.world_from_camera)
        }),
        RowColumn::new("partial", Bytes, "bits of the cells that hold a seen point", |row| {
            Value::Bytes(row.pair.partial.bytes())
        }),
        RowColumn::new("complete", Bytes, "bits of the cells of the solid", |row| {
            Value::Bytes(row.pair.complete.bytes())
        }),
    ]);
    if touched {
        columns.push(RowColumn::new("tactile", Bytes, "bits of the cells that any kind of touch met", |row| {
            row.tactile().map_or(Value::Empty, |grid| Value::Bytes(grid.bytes()))
        }));
    }
    columns
}

/// A pose as the top three rows of 4 x 4, row-major.
fn rows<To: Frame, From: Frame>(pose: &Pose<To, From>) -> Value<'static> {
    Value::F64s(pose.to_rows().to_vec().into())
}
