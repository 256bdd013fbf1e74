//! The table of patches: images around palm and fingertips of a grasp, with the label.

use serde_json::json;

use super::{
    column::{HasCamera, OfSample, RowColumn, camera_columns, fact_columns, le_bytes, matrix, sample_columns},
    objects::{self, ObjectCounts},
    row_table::{RowTable, TableName, TableRow, table_facts},
};
use crate::export::{
    error::ExportError,
    form::{ExportSelection, Written},
    selected::{SelectedSample, SelectedSamples},
    target::Target,
};
use format::{
    Channel, HeatmapPatch, POINT_NAMES, PatchColour, PatchMetric, PatchTable, PatchTrial, PatchVisibility, Product,
    dataset::DatasetReader,
};
use kernel::geom::Intrinsics;
use tables::{
    ColumnType::{Bytes, F64, F64s, Text, U32},
    Value,
};

/// Layout of the table in words.
pub(super) const LAYOUT: &str = "\
    patches.parquet: one row per grasp; depth is float32 little-endian of shape (4, side, side) [m], NaN = \
    no return, around the points palm, F0, F1, F2; rgb, where stored, uint8 (4, side, side, 3); points (4, \
    3), pixels (4, 2) and corners (4, 2) are row-major; poses are 16 numbers, 4 x 4 row-major; objects.parquet: \
    one row per object";

/// One sample.
pub(super) struct PatchRow<'a> {
    sample: &'a SelectedSample<'a>,
    patch: &'a HeatmapPatch,
    grasps: String,
    depth: Vec<u8>,
    colour: Option<&'a PatchColour>,
    trial: Option<&'a PatchTrial>,
    trials: String,
    visibility: Option<&'a PatchVisibility>,
    metric: Option<&'a PatchMetric>,
    metric_depth: Vec<u8>,
    metric_colour: Option<&'a PatchColour>,
    table: Option<&'a PatchTable>,
}

impl OfSample for PatchRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

/// Writes `patches.parquet` and `objects.parquet`.
pub(super) fn write(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let selected = SelectedSamples::of(reader, &assets.objects, selection)?;
    let mut table = RowTable::create::<PatchRow>(reader, target, &[("points", json!(POINT_NAMES))])?;
    let mut counts = ObjectCounts::default();
    selected.each(|stored, sample| {
        counts.add([sample.id.subject]);
        let (patch, colour) = (stored.read::<HeatmapPatch>()?, stored.find::<PatchColour>()?);
        let (trial, visibility) = (stored.find::<PatchTrial>()?, stored.find::<PatchVisibility>()?);
        let (metric, metric_colour) =
            (stored.find::<PatchMetric>()?, stored.find_at::<PatchColour>(Channel::PATCH_METRIC_COLOUR)?);
        let table_under = stored.find::<PatchTable>()?;
        table.extend([PatchRow {
            sample,
            patch: &patch,
            grasps: patch.grasps.hex(),
            depth: le_bytes(&patch.depth),
            colour: colour.as_ref(),
            trial: trial.as_ref(),
            trials: trial.as_ref().map(|trial| trial.trials.hex()).unwrap_or_default(),
            visibility: visibility.as_ref(),
            metric: metric.as_ref(),
            metric_depth: le_bytes(metric.iter().flat_map(|metric| &metric.depth)),
            metric_colour: metric_colour.as_ref(),
            table: table_under.as_ref(),
        }])
    })?;
    let objects = objects::write(reader, &assets.objects, &counts, target)?;
    let mut written = Written::selection(selected.count(), "samples", selection);
    written.facts.extend(table_facts([table.finish()?, objects]));
    Ok(written)
}

impl HasCamera for PatchRow<'_> {
    fn camera(&self) -> &Intrinsics {
        &self.patch.camera
    }
}

impl TableRow for PatchRow<'_> {
    const TABLE: TableName = TableName {
        name: "patches",
        row: "patch",
        group: 64,
        meaning: "One row per grasp with patches. `numpy.frombuffer(depth, \"<f4\").reshape(4, side, side)` are the patches; Jobs that \
                  render colours have `rgb`; jobs with labels by trials, marks, squares in metres or a table have the corresponding \
                  columns from `outcome` to `camera_from_table`.",
    };

    fn columns(product: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new(
                "grasps",
                Text,
                "root digest of the exact numbers of the dataset of grasps",
                |row: &Self| Value::Text(&row.grasps),
            ),
            RowColumn::new("run", U32, "item of the grasp's run in the dataset of grasps", |row| {
                Value::U32(row.patch.run)
            }),
            RowColumn::new("rank", U32, "number of the grasp in its run", |row| Value::U32(row.patch.rank)),
            RowColumn::new("type", U32, "type of the grasp", |row| Value::U32(row.patch.kind())),
            RowColumn::new("type_index", U32, "index of the type among the chosen types, most common first", |row| {
                Value::U32(row.patch.type_index)
            }),
            RowColumn::new("energy", F64, "energy that the search minimised, before closing", |row| {
                Value::F64(row.patch.energy)
            }),
            RowColumn::new("epsilon", F64, "quality of the closed hand, in `space`", |row| {
                Value::F64(row.patch.epsilon)
            }),
            RowColumn::new("space", Text, "space of epsilon: force, wrench", |row| Value::Text(&row.patch.space)),
            RowColumn::new(
                "label",
                Text,
                "content of `value`: epsilon (-epsilon), energy, trial (-1 held, 1 failed, 0 not known)",
                |row| Value::Text(&row.patch.label),
            ),
            RowColumn::new("value", F64, "the label; lower is better", |row| Value::F64(row.patch.value.into())),
            RowColumn::new("hand", Text, "name of the hand", |row| Value::Text(&row.patch.hand)),
        ]);
        columns.extend(camera_columns());
        columns.extend([
            RowColumn::new(
                "camera_from_object",
                F64s,
                "16 numbers: pose of the object in camera axes [m]",
                |row: &Self| matrix(&row.patch.camera_from_object),
            ),
            RowColumn::new(
                "object_from_approach",
                F64s,
                "16 numbers: pose of the approach frame in the object's frame, before closing [m]",
                |row| matrix(&row.patch.object_from_approach),
            ),
            RowColumn::new(
                "points",
                F64s,
                "12 numbers: palm, F0, F1, F2 of the closed hand, in the object's frame [m]",
                |row| Value::F64s(row.patch.points.iter().flat_map(|point| point.point).collect()),
            ),
            RowColumn::new("pixels", F64s, "8 numbers: column and row of each point in the image [px]", |row| {
                Value::F64s(row.patch.points.iter().flat_map(|point| point.pixel).collect())
            }),
            RowColumn::new("corners", F64s, "8 numbers: left and top pixel of each patch [px]", |row| {
                Value::F64s(row.patch.points.iter().flat_map(|point| point.corner).map(f64::from).collect())
            }),
            RowColumn::new("side", U32, "side of each patch [px]", |row| Value::U32(row.patch.side)),
            RowColumn::new(
                "depth",
                Bytes,
                "float32 (4, side, side): depth along the optical axis [m], NaN = no return",
                |row| Value::Bytes(&row.depth),
            ),
        ]);
        columns.push(
            RowColumn::optional("rgb", Bytes, "uint8 (4, side, side, 3): the patches in colour", |row: &Self| {
                row.colour.map_or(Value::Empty, |colour| Value::Bytes(colour.rgb.as_flattened()))
            })
            .of_channel(Channel::PATCH_COLOUR),
        );
        for (channel, of_channel) in mark_columns() {
            columns.extend(of_channel().into_iter().map(|column| column.of_channel(channel)));
        }
        let facts = fact_columns(product, &columns);
        columns.extend(facts);
        columns
    }
}

/// Makes the columns of a channel.
type Columns<'a> = fn() -> Vec<RowColumn<PatchRow<'a>>>;

/// Columns of the channels beside the patches.
fn mark_columns<'a>() -> [(Channel, Columns<'a>); 5] {
    [
        (Channel::PATCH_TRIAL, trial_columns),
        (Channel::PATCH_VISIBILITY, visibility_columns),
        (Channel::PATCH_METRIC, metric_columns),
        (Channel::PATCH_METRIC_COLOUR, || {
            vec![RowColumn::optional("metric_rgb", Bytes, "uint8 (4, side, side, 3): the squares in colour", |row| {
                row.metric_colour.map_or(Value::Empty, |colour| Value::Bytes(colour.rgb.as_flattened()))
            })]
        }),
        (Channel::PATCH_TABLE, table_columns),
    ]
}

fn trial_columns<'a>() -> Vec<RowColumn<PatchRow<'a>>> {
    fn of<'r>(row: &'r PatchRow<'_>, value: fn(&'r PatchTrial) -> Value<'r>) -> Value<'r> {
        row.trial.map_or(Value::Empty, value)
    }
    vec![
        RowColumn::optional(
            "outcome",
            Text,
            "label by trials: held, failed, borderline, unconfirmed, untested",
            |row| of(row, |trial| Value::Text(trial.outcome.name())),
        ),
        RowColumn::optional("trial", Text, "verdict on the trial in the air", |row| {
            of(row, |trial| Value::Text(trial.trial.name()))
        }),
        RowColumn::optional("verdict", Text, "verdict of the analytic criteria", |row| {
            of(row, |trial| Value::Text(trial.verdict.name()))
        }),
        RowColumn::new("trials", Text, "root digest of the physics numbers of the dataset of grasps", |row| {
            Value::Text(&row.trials)
        }),
    ]
}

fn visibility_columns<'a>() -> Vec<RowColumn<PatchRow<'a>>> {
    fn of(row: &PatchRow<'_>, values: fn(&PatchVisibility) -> Vec<f64>) -> Value<'static> {
        row.visibility.map_or(Value::Empty, |visibility| Value::F64s(values(visibility).into()))
    }
    vec![
        RowColumn::optional(
            "visible",
            F64s,
            "4 numbers: 1 unless the surface in the image hides the point, else 0",
            |row| {
                of(row, |visibility| visibility.visible.iter().map(|visible| f64::from(u8::from(*visible))).collect())
            },
        ),
        RowColumn::optional(
            "surfaces",
            F64s,
            "4 numbers: depth in the pixel of each point [m], NaN = no return",
            |row| of(row, |visibility| visibility.surfaces.iter().map(|depth| f64::from(*depth)).collect()),
        ),
    ]
}

fn metric_columns<'a>() -> Vec<RowColumn<PatchRow<'a>>> {
    fn of(row: &PatchRow<'_>, values: fn(&PatchMetric) -> Vec<u32>) -> Value<'static> {
        row.metric.map_or(Value::Empty, |metric| {
            Value::F64s(values(metric).into_iter().map(f64::from).collect::<Vec<_>>().into())
        })
    }
    vec![
        RowColumn::optional("size", F64, "side of the squares of one size [m]", |row| {
            row.metric.map_or(Value::Empty, |metric| Value::F64(metric.size))
        }),
        RowColumn::optional("windows", F64s, "4 numbers: side of each square in the image [px]", |row| {
            of(row, |metric| metric.windows.to_vec())
        }),
        RowColumn::optional("metric_corners", F64s, "8 numbers: left and top pixel of each square [px]", |row| {
            of(row, |metric| metric.corners.as_flattened().to_vec())
        }),
        RowColumn::optional(
            "metric_depth",
            Bytes,
            "float32 (4, side, side): depth in the squares [m], NaN = no return",
            |row| row.metric.map_or(Value::Empty, |_| Value::Bytes(&row.metric_depth)),
        ),
    ]
}

fn table_columns<'a>() -> Vec<RowColumn<PatchRow<'a>>> {
    vec![
        RowColumn::optional("resting_pose", U32, "index of the object's pose on the table", |row| {
            row.table.map_or(Value::Empty, |table| Value::U32(table.resting_pose))
        }),
        RowColumn::optional("camera_from_table", F64s, "16 numbers: pose of the table in camera axes [m]", |row| {
            row.table.map_or(Value::Empty, |table| matrix(&table.camera_from_table))
        }),
    ]
}
