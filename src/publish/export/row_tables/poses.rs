//! The table of a reachability map: one row per pose of its grid.

use serde_json::json;

use super::column::{OfSample, RowColumn, RowTable, numbers, sample_columns, table_facts};
use crate::export::{
    error::ExportError,
    form::{ExportSelection, Written},
    selected::{SampleNames, SelectedSamples},
    target::Target,
};
use format::{ReachabilityBlock, dataset::DatasetReader, products::reachability::read_field};
use kernel::geom::PoseLabel;
use tables::{
    ColumnType::{F64, F64s, Text, U64},
    Value,
};

/// Rows of a row group: 10 MB of poses of an arm of seven joints.
const ROW_GROUP: usize = 65536;

/// Layout of the table in words.
pub(super) const LAYOUT: &str = "\
    poses.parquet: one row per pose, in the order of the grid; its rotation is Rz(yaw) Ry(pitch) Rx(roll); \
    distance is the signed distance to the border of the reachable set, NEGATIVE where reachable, in the \
    unit that the table's metadata name";

/// One pose of the grid.
struct PoseRow<'a> {
    names: &'a SampleNames<'a>,
    cell: usize,
    pose: [f64; 6],
    block: &'a ReachabilityBlock,
    /// Index of the orientation in the block.
    orientation: usize,
    witness: Option<&'a [f64]>,
    distance: f32,
}

impl OfSample for PoseRow<'_> {
    fn names(&self) -> &SampleNames<'_> {
        self.names
    }
}

/// Writes `poses.parquet`.
pub(super) fn write(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
) -> Result<Written, ExportError> {
    let assets = reader.assets()?.objects;
    let selected = SelectedSamples::of(reader, &assets, selection)?;
    let field = read_field(reader.folder())?;
    let (grid, header) = (&field.header.grid, &field.header);
    let facts = [
        ("robot", json!(header.robot)),
        ("joints", json!(header.joints)),
        ("target", json!(header.target)),
        ("frame", json!(header.frame)),
        ("profile", json!(header.profile())),
        ("distance_unit", json!(header.unit())),
    ];
    let mut table = RowTable::create(("poses", "pose", ROW_GROUP), &columns(), (reader, target), &facts)?;
    selected.each(|sample, names| {
        let (block, columns) = (sample.block()?, columns());
        let mut witnesses = block.witnesses.chunks_exact(block.joints as usize);
        let first = names.id.item.0 as usize * grid.orientations();
        if block.labels.len() != grid.orientations() || first >= grid.cells() {
            return Err(ExportError::OtherGrid { index: names.index });
        }
        for (orientation, label) in block.labels.iter().enumerate() {
            let cell = first + orientation;
            let witness = if *label == PoseLabel::Reachable { witnesses.next() } else { None };
            let (pose, distance) = (grid.pose(cell), field.distances[cell]);
            table.push(&columns, &PoseRow { names, cell, pose, block: &block, orientation, witness, distance })?;
        }
        Ok(())
    })?;
    let table = table.finish()?;
    let mut written = Written::selection(table.rows, "poses", selection);
    written.facts.extend(table_facts([table]));
    Ok(written)
}

fn columns<'a>() -> Vec<RowColumn<PoseRow<'a>>> {
    let mut columns = sample_columns();
    columns.extend([
        RowColumn::new("cell", U64, "number of the pose in the grid, C order over its axes", |row: &PoseRow<'a>| {
            Value::U64(row.cell as u64)
        }),
        RowColumn::new("x", F64, "position of the target in the map's frame [m]", |row| Value::F64(row.pose[0])),
        RowColumn::new("y", F64, "position of the target in the map's frame [m]", |row| Value::F64(row.pose[1])),
        RowColumn::new("z", F64, "position of the target in the map's frame [m]", |row| Value::F64(row.pose[2])),
        RowColumn::new("roll", F64, "rotation about x [rad]", |row| Value::F64(row.pose[3])),
        RowColumn::new("pitch", F64, "rotation about y [rad]", |row| Value::F64(row.pose[4])),
        RowColumn::new("yaw", F64, "rotation about z [rad]", |row| Value::F64(row.pose[5])),
        RowColumn::new("label", Text, "no_solution, colliding or reachable", |row| {
            Value::Text(row.block.labels[row.orientation].name())
        }),
        RowColumn::new(
            "proof",
            Text,
            "how the label is known: bound, interval_ends, swept, searched or witness",
            |row| Value::Text(row.block.proofs[row.orientation].name()),
        ),
        RowColumn::new(
            "distance",
            F64,
            "signed distance to the border of the reachable set, negative where reachable",
            |row| Value::F64(row.distance.into()),
        ),
        RowColumn::optional(
            "witness",
            F64s,
            "joint values that reach the pose [rad or m]; none where it is not reachable",
            |row| numbers(row.witness),
        ),
    ]);
    columns
}
