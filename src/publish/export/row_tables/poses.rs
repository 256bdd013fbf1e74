//! The table of a reachability map: one row per pose of its grid.

use serde_json::json;

use super::{
    column::{OfSample, RowColumn, fact_columns, numbers, sample_columns},
    row_table::{RowTable, TableName, TableRow, table_facts},
};
use crate::export::{
    error::ExportError,
    form::{ExportSelection, Written},
    selected::{SelectedSample, SelectedSamples},
    target::Target,
};
use format::{Product, ReachabilityBlock, dataset::DatasetReader, extras::read_field};
use kernel::geom::PoseLabel;
use tables::{
    ColumnType::{F64, F64s, Text, U64},
    Value,
};

/// Layout of the table in words.
pub(super) const LAYOUT: &str = "\
    positions.parquet: one row per position; poses.parquet: one row per pose, in the order of the grid; its rotation is Rz(yaw) Ry(pitch) Rx(roll); \
    distance is the signed distance to the border of the reachable set, NEGATIVE where reachable, in the \
    unit that the table's metadata name";

/// One pose of the grid.
pub(super) struct PoseRow<'a> {
    sample: &'a SelectedSample<'a>,
    cell: usize,
    pose: [f64; 6],
    block: &'a ReachabilityBlock,
    /// Index of the orientation in the block.
    orientation: usize,
    witness: Option<&'a [f64]>,
    distance: f32,
}

impl OfSample for PoseRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

/// One position of the grid.
pub(super) struct PositionRow<'a> {
    sample: &'a SelectedSample<'a>,
    position: [f64; 3],
}

impl OfSample for PositionRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

/// Writes the tables.
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
    let mut positions = RowTable::create::<PositionRow>(reader, target, &facts[..1])?;
    let mut poses = RowTable::create::<PoseRow>(reader, target, &facts)?;
    selected.each(|stored, sample| {
        let block = stored.read::<ReachabilityBlock>()?;
        let mut witnesses = block.witnesses.chunks_exact(block.joints as usize);
        let first = sample.id.item.0 as usize * grid.orientations();
        if block.labels.len() != grid.orientations() || first >= grid.cells() {
            return Err(ExportError::OtherGrid { index: sample.index });
        }
        let [x, y, z, ..] = grid.pose(first);
        positions.extend([PositionRow { sample, position: [x, y, z] }])?;
        poses.extend(block.labels.iter().enumerate().map(|(orientation, label)| {
            let cell = first + orientation;
            let witness = if *label == PoseLabel::Reachable { witnesses.next() } else { None };
            let (pose, distance) = (grid.pose(cell), field.distances[cell]);
            PoseRow { sample, cell, pose, block: &block, orientation, witness, distance }
        }))
    })?;
    let poses = poses.finish()?;
    let mut written = Written::selection(poses.rows, "poses", selection);
    written.facts.extend(table_facts([positions.finish()?, poses]));
    Ok(written)
}

impl TableRow for PositionRow<'_> {
    const TABLE: TableName = TableName {
        name: "positions",
        row: "position",
        group: 65536,
        meaning: "One row per position of the grid, with the counts of its poses.",
    };

    fn columns(product: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("x", F64, "position of the target in the map's frame [m]", |row: &Self| {
                Value::F64(row.position[0])
            }),
            RowColumn::new("y", F64, "position of the target in the map's frame [m]", |row| {
                Value::F64(row.position[1])
            }),
            RowColumn::new("z", F64, "position of the target in the map's frame [m]", |row| {
                Value::F64(row.position[2])
            }),
        ]);
        let facts = fact_columns(product, &columns);
        columns.extend(facts);
        columns
    }
}

impl TableRow for PoseRow<'_> {
    const TABLE: TableName = TableName {
        name: "poses",
        row: "pose",
        group: 65536,
        meaning: "One row per pose of the grid, in its order; the rotation is Rz(yaw) Ry(pitch) Rx(roll). `graspmill.robot`, \
                  `graspmill.joints` (of `witness`), `graspmill.target`, `graspmill.frame` and `graspmill.distance_unit` (metres, or cells \
                  in the profile `thesis`) in the table's metadata are JSON.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("cell", U64, "number of the pose in the grid, C order over its axes", |row: &Self| {
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
                "proof of the label: bound, interval_ends, swept, searched or witness",
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
                "joint values that reach the pose [rad or m]; none if it is not reachable",
                |row| numbers(row.witness),
            ),
        ]);
        columns
    }
}
