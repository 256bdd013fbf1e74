//! Tables of heatmaps: images, the free grasps marked in them, and the forbidden grasps.

use serde_json::json;

use super::{
    column::{HasCamera, OfSample, RowColumn, camera_columns, fact_columns, le_bytes, list, matrix, sample_columns},
    objects::{self, ObjectCounts},
    row_table::{RowTable, TableName, TableRow, table_facts},
};
use crate::export::{
    error::ExportError,
    form::{ExportSelection, Written},
    selected::{SelectedSample, SelectedSamples},
    target::Target,
};
use format::{Channel, Depth, ForbiddenGrasp, PickObstacle, Product, SceneHeatmap, SeenGrasp, dataset::DatasetReader};
use kernel::geom::Intrinsics;
use tables::{
    ColumnType::{Bytes, F64, F64s, Text, U32},
    Value,
};

/// Layout of the tables in words.
pub(super) const LAYOUT: &str = "\
    heatmaps.parquet: one row per image; depth, where stored, is float32 little-endian of shape (height, width) [m], NaN = no return; \
    marks.parquet: one row per free grasp that approaches from the camera's side; forbidden.parquet: one row per forbidden grasp; objects.parquet: one row per object. sample_index joins them. Poses are 16 numbers, 4 x 4 row-major";

/// One image.
pub(super) struct HeatmapRow<'a> {
    sample: &'a SelectedSample<'a>,
    heatmap: &'a SceneHeatmap,
    depth: Vec<u8>,
    hand: String,
    /// Digests of the dataset of picks: its exact numbers, and those of physics.
    picks: [String; 2],
}

/// One free grasp in an image.
pub(super) struct MarkRow<'a> {
    sample: &'a SelectedSample<'a>,
    number: u32,
    grasp: &'a SeenGrasp,
}

/// One forbidden grasp.
pub(super) struct ForbiddenRow<'a> {
    sample: &'a SelectedSample<'a>,
    grasp: &'a ForbiddenGrasp,
}

/// Writes the tables.
pub(super) fn write(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let selected = SelectedSamples::of(reader, &assets.subjects, selection)?;
    let bodies = objects::bodies_of_scenes(&assets.subjects);
    let mut tables: Option<[RowTable; 3]> = None;
    let mut counts = ObjectCounts::default();
    selected.each(|stored, sample| {
        let (heatmap, depth) = (&stored.read::<SceneHeatmap>()?, stored.find::<Depth>()?);
        let [images, marks, forbidden] = match &mut tables {
            Some(tables) => tables,
            none => none.insert(create(reader, target, heatmap)?),
        };
        counts.add(bodies.get(&sample.id.subject).into_iter().flatten().copied());
        let [width, height] = [heatmap.camera.width, heatmap.camera.height];
        let depth = depth.map_or_else(Vec::new, |depth| le_bytes(&depth.crop.whole(width, height)));
        let digests = [Some(heatmap.picks), heatmap.trials];
        let picks = digests.map(|digest| digest.map(|digest| digest.hex()).unwrap_or_default());
        images.extend([HeatmapRow { sample, heatmap, depth, hand: heatmap.hand_id.to_string(), picks }])?;
        marks.extend((0..).zip(&heatmap.grasps).map(|(number, grasp)| MarkRow { sample, number, grasp }))?;
        forbidden.extend(heatmap.forbidden.iter().map(|grasp| ForbiddenRow { sample, grasp }))
    })?;
    let objects = objects::write(reader, &assets.objects, &counts, target)?;
    let mut written = Written::selection(selected.count(), "images", selection);
    let tables = tables.into_iter().flatten().map(RowTable::finish).chain([Ok(objects)]);
    written.facts.extend(table_facts(tables.collect::<Result<Vec<_>, _>>()?));
    Ok(written)
}

/// Begins the tables; the first image names hand, points and types.
fn create(reader: &DatasetReader, target: &mut Target, first: &SceneHeatmap) -> Result<[RowTable; 3], ExportError> {
    let facts = [("hand", json!(first.hand)), ("points", json!(first.names)), ("types", json!(first.types))];
    Ok([
        RowTable::create::<HeatmapRow>(reader, target, &facts)?,
        RowTable::create::<MarkRow>(reader, target, &facts)?,
        RowTable::create::<ForbiddenRow>(reader, target, &facts[..1])?,
    ])
}

impl OfSample for HeatmapRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl HasCamera for HeatmapRow<'_> {
    fn camera(&self) -> &Intrinsics {
        &self.heatmap.camera
    }
}

impl OfSample for MarkRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfSample for ForbiddenRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl TableRow for HeatmapRow<'_> {
    const TABLE: TableName = TableName {
        name: "heatmaps",
        row: "heatmap",
        group: 16,
        meaning: "One row per image. `numpy.frombuffer(depth, \"<f4\").reshape(height, width)` is the depth, if the job stores it.",
    };

    fn columns(product: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend(camera_columns());
        columns.extend([
            RowColumn::new(
                "world_from_camera",
                F64s,
                "16 numbers: pose of the camera in the world [m]",
                |row: &Self| matrix(&row.heatmap.world_from_camera),
            ),
            RowColumn::new("hand", Text, "name of the hand", |row| Value::Text(&row.heatmap.hand)),
            RowColumn::new("hand_digest", Text, "digest of the hand's description and table", |row| {
                Value::Text(&row.hand)
            }),
            RowColumn::new("picks", Text, "root digest of the exact numbers of the dataset of picks", |row| {
                Value::Text(&row.picks[0])
            }),
            RowColumn::new(
                "trials",
                Text,
                "root digest of the physics numbers of the dataset of picks; empty without trials",
                |row| Value::Text(&row.picks[1]),
            ),
            RowColumn::new("label", Text, "meaning of the labels: trial or free", |row| {
                Value::Text(row.heatmap.label.name())
            }),
            RowColumn::new("angle", F64, "largest angle between approaches and the camera's axis [rad]", |row| {
                Value::F64(row.heatmap.angle)
            }),
            RowColumn::new("side", U32, "side of each patch [px]", |row| Value::U32(row.heatmap.side)),
            RowColumn::optional("size", F64, "side of the squares that patches in metres show [m]", |row| {
                row.heatmap.size.map_or(Value::Empty, Value::F64)
            }),
            RowColumn::new("evaluated", F64s, "one number per body: 1 if it has picks, else 0", |row| {
                list(row.heatmap.evaluated.iter().map(|known| u8::from(*known)))
            }),
            RowColumn::new(
                "depth",
                Bytes,
                "float32 (height, width): depth along the optical axis [m], NaN = no return",
                |row: &Self| Value::Bytes(&row.depth),
            )
            .of_channel(Channel::HEATMAP_DEPTH),
        ]);
        let facts = fact_columns(product, &columns);
        columns.extend(facts);
        columns
    }
}

/// A projection; none if it is nearer than the camera's near limit.
fn pixel(pixel: Option<[f64; 2]>) -> [f64; 2] {
    pixel.unwrap_or([f64::NAN; 2])
}

impl TableRow for MarkRow<'_> {
    const TABLE: TableName = TableName {
        name: "marks",
        row: "mark",
        group: 4096,
        meaning: "One row per free grasp of the chosen types that comes from the camera's side. `graspmill.points` in the table's metadata \
                  is JSON: names of the points of the hand, the palm first; p is their count. `graspmill.types` has the types that \
                  `type_index` counts. `body` and `candidate` join it with `candidates.parquet` of the picks.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        fn of_patches(row: &MarkRow<'_>, values: fn(&format::PatchSquare) -> Vec<u32>) -> Value<'static> {
            let patches = &row.grasp.patches;
            if patches.is_empty() { Value::Empty } else { list(patches.iter().flat_map(values)) }
        }
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("mark", U32, "number of the grasp in the image", |row: &Self| Value::U32(row.number)),
            RowColumn::new("body", U32, "number of the body, from 1", |row| Value::U32(row.grasp.body)),
            RowColumn::new("candidate", U32, "index among the candidates of that body", |row| {
                Value::U32(row.grasp.candidate)
            }),
            RowColumn::new("run", U32, "number of the run of the stored grasp", |row| Value::U32(row.grasp.run)),
            RowColumn::new("rank", U32, "number of the stored grasp in that run", |row| Value::U32(row.grasp.rank)),
            RowColumn::new("direction", U32, "number of its direction; 0 is the stored grasp", |row| {
                Value::U32(row.grasp.direction)
            }),
            RowColumn::new("type_index", U32, "index of its type among the chosen types, most common first", |row| {
                Value::U32(row.grasp.type_index)
            }),
            RowColumn::new("state", Text, "outcome of its trial: untried, held or failed", |row| {
                Value::Text(row.grasp.state.name())
            }),
            RowColumn::new("value", F64, "the label; lower is better", |row| Value::F64(row.grasp.value.into())),
            RowColumn::new(
                "world_from_base",
                F64s,
                "16 numbers: pose of the hand's base in the world, where the hand closes [m]",
                |row| matrix(&row.grasp.world_from_base),
            ),
            RowColumn::new("points", F64s, "3 p numbers: palm and fingertips of the closed hand, in the world [m]", |row| {
                list(row.grasp.points.iter().flat_map(|point| point.point))
            }),
            RowColumn::new(
                "pixels",
                F64s,
                "2 p numbers: column and row of each point, in the image or not [px]; NaN if nearer than the camera's near limit",
                |row| list(row.grasp.points.iter().flat_map(|point| pixel(point.pixel))),
            ),
            RowColumn::new(
                "surfaces",
                F64s,
                "p numbers: depth of the image in the pixel of each point [m]; NaN without a return or outside the image",
                |row| list(row.grasp.points.iter().map(|point| point.surface)),
            ),
            RowColumn::new(
                "visible",
                F64s,
                "p numbers: 1 if the point is in the image and nothing hides it, else 0",
                |row| list(row.grasp.points.iter().map(|point| u8::from(point.visible))),
            ),
            RowColumn::optional(
                "corners",
                F64s,
                "2 p numbers: left and top pixel of each patch [px]; none for a grasp without patches",
                |row| of_patches(row, |patch| patch.corner.to_vec()),
            ),
            RowColumn::optional(
                "windows",
                F64s,
                "p numbers: side of each square of one size in metres [px]; zeros without such squares",
                |row| of_patches(row, |patch| vec![patch.window]),
            ),
            RowColumn::optional(
                "window_corners",
                F64s,
                "2 p numbers: left and top pixel of each such square [px]; zeros without such squares",
                |row| of_patches(row, |patch| patch.window_corner.to_vec()),
            ),
        ]);
        columns
    }
}

impl TableRow for ForbiddenRow<'_> {
    const TABLE: TableName = TableName {
        name: "forbidden",
        row: "grasp",
        group: 16384,
        meaning: "One row per grasp from the camera's side that is not free: train its pixel as background.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("body", U32, "number of the body, from 1", |row: &Self| Value::U32(row.grasp.body)),
            RowColumn::new("candidate", U32, "index among the candidates of that body", |row| {
                Value::U32(row.grasp.candidate)
            }),
            RowColumn::new("forbidden_by", Text, "ground, container, own object or neighbour", |row| {
                Value::Text(PickObstacle::NAMES[usize::from(row.grasp.obstacle) - 1])
            }),
            RowColumn::new(
                "pixel",
                F64s,
                "2 numbers: column and row of its palm, in the image or not [px]; NaN if nearer than the camera's near limit",
                |row| list(pixel(row.grasp.pixel)),
            ),
        ]);
        columns
    }
}
