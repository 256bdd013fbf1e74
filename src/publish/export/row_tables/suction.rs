//! Tables of suction: bodies, and the stored poses of the cup on each.

use super::{
    bodies::{BodyName, BodyRow, ObjectNames, OfBody, body_columns},
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
use format::{
    PickObstacle, Product, SceneContainer, SealedSurface, SuctionHold, SuctionPose, SuctionPoses,
    dataset::DatasetReader,
};
use tables::{
    ColumnType::{Boolean, F64, F64s, Text, U32},
    Value,
};

/// Layout of the tables in words.
pub(super) const LAYOUT: &str = "\
    suction.parquet: one row per body; suction_poses.parquet: one row per stored pose of the cup; bodies.parquet: one row per body of the \
    scene; objects.parquet: one row per object. sample_index joins them. Poses are 16 numbers, 4 x 4 row-major";

/// One body with its poses.
pub(super) struct SuctionRow<'a> {
    sample: &'a SelectedSample<'a>,
    body: BodyName<'a>,
    poses: &'a SuctionPoses,
}

/// One pose of the cup.
pub(super) struct PoseRow<'a> {
    sample: &'a SelectedSample<'a>,
    pose: &'a SuctionPose,
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
    let mut suction = RowTable::create::<SuctionRow>(reader, target, &[])?;
    let mut poses = RowTable::create::<PoseRow>(reader, target, &[])?;
    let mut bodies = RowTable::create::<BodyRow>(reader, target, &[])?;
    let mut counts = ObjectCounts::default();
    selected.each(|stored, sample| {
        let record = &stored.read::<SuctionPoses>()?;
        counts.add([record.object()]);
        let body = BodyName::new(record.body(), record.object(), &names);
        suction.extend([SuctionRow { sample, body, poses: record }])?;
        poses.extend(record.poses.iter().map(|pose| PoseRow { sample, pose }))?;
        bodies.extend(BodyRow::all(sample, &names, &record.bodies))
    })?;
    let objects = objects::write(reader, &assets.objects, &counts, target)?;
    let mut written = Written::selection(selected.count(), "bodies", selection);
    written.facts.extend(table_facts([suction.finish()?, poses.finish()?, bodies.finish()?, objects]));
    Ok(written)
}

impl OfSample for SuctionRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfBody for SuctionRow<'_> {
    fn body(&self) -> &BodyName<'_> {
        &self.body
    }
}

impl HasContainer for SuctionRow<'_> {
    fn container(&self) -> &SceneContainer {
        &self.poses.container
    }
}

impl OfSample for PoseRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl TableRow for SuctionRow<'_> {
    const TABLE: TableName = TableName {
        name: "suction",
        row: "body",
        group: 4096,
        meaning: "One row per body with the rules by which poses of the cup were drawn and decided, and the poses by result.",
    };

    fn columns(product: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend(body_columns());
        columns.extend(container_columns());
        columns.extend([
            RowColumn::new("mass", F64, "mass of the body [kg]", |row: &Self| Value::F64(row.poses.mass)),
            RowColumn::new(
                "centre_of_mass",
                F64s,
                "3 numbers: centre of mass of the body, in the object's frame [m]",
                |row| numbers(Some(&row.poses.centre_of_mass)),
            ),
            RowColumn::new("cup_radius", F64, "radius of the circle along which the lip seals [m]", |row| {
                Value::F64(row.poses.cup.radius)
            }),
            RowColumn::new("cup_outer_radius", F64, "outer radius of the lip [m]", |row| {
                Value::F64(row.poses.cup.outer_radius)
            }),
            RowColumn::new("cup_height", F64, "length of the relaxed cup [m]", |row| Value::F64(row.poses.cup.height)),
            RowColumn::new("tube_radius", F64, "radius of the tube behind the cup [m]", |row| {
                Value::F64(row.poses.cup.tube_radius)
            }),
            RowColumn::new("tube_length", F64, "length of the tube [m]", |row| Value::F64(row.poses.cup.tube_length)),
            RowColumn::new(
                "margin",
                F64,
                "distance that cup and tube keep from everything except the body [m]",
                |row| Value::F64(row.poses.rules.margin),
            ),
            RowColumn::new("half_angle", F64, "largest angle between the approach and straight down [rad]", |row| {
                Value::F64(row.poses.rules.half_angle)
            }),
            RowColumn::new(
                "tilt",
                F64,
                "largest angle between the approach and the inward normal of the drawn point [rad]",
                |row| Value::F64(row.poses.rules.tilt),
            ),
            RowColumn::new("safety", F64, "factor on the weight", |row| Value::F64(row.poses.rules.safety)),
            RowColumn::new(
                "any_direction",
                Boolean,
                "whether the cup must hold the body in every direction of gravity",
                |row| Value::Boolean(row.poses.rules.any_direction),
            ),
            RowColumn::new("budget", U32, "poses at most", |row| Value::U32(row.poses.rules.budget)),
            RowColumn::new("wanted", U32, "free poses at which drawing ends", |row| Value::U32(row.poses.rules.wanted)),
        ]);
        let facts = fact_columns(product, &columns);
        columns.extend(facts);
        columns
    }
}

impl TableRow for PoseRow<'_> {
    const TABLE: TableName = TableName {
        name: "suction_poses",
        row: "pose",
        group: 8192,
        meaning: "One row per stored pose: all free ones, and the first ones that leak, that are too weak and that are blocked. \
                  `seat` to `curvatures` are null if a ray misses the surface, `strength` to `force` if the cup leaks.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("pose", U32, "number of the pose in drawn order, from 0", |row: &Self| {
                Value::U32(row.pose.number)
            }),
            RowColumn::new("scheme", Text, "draw of its point: area, thickness or cells", |row| {
                Value::Text(row.pose.scheme.name())
            }),
            RowColumn::new(
                "object_from_cup",
                F64s,
                "16 numbers: the cup in the object's frame, origin where its axis meets the surface, z the approach [m]",
                |row| matrix(&row.pose.object_from_cup),
            ),
            RowColumn::new("result", Text, "free, blocked, weak or leaking", |row| {
                Value::Text(row.pose.result().name())
            }),
        ]);
        columns.extend(seal_columns());
        columns.extend(surface_columns());
        columns.extend(hold_columns());
        columns.extend(path_columns());
        columns
    }
}

/// Columns of the seal, and scores of SuctionNet-1Billion.
fn seal_columns<'a>() -> [RowColumn<PoseRow<'a>>; 5] {
    [
        RowColumn::new(
            "seal_limit",
            Text,
            "limit of the seal that is used most: surface, stroke, flex, stretch, bulge, hole or curvature",
            |row: &PoseRow<'a>| Value::Text(SuctionPoses::SEAL_LIMITS[usize::from(row.pose.seal_limit)]),
        ),
        RowColumn::new(
            "seal_margin",
            F64,
            "1 less the used share of that limit, at least -1; minus the share of rays that miss, if any does",
            |row| Value::F64(row.pose.seal_margin),
        ),
        RowColumn::new("missed", U32, "rays that miss the surface", |row| Value::U32(row.pose.missed)),
        RowColumn::new("suctionnet_seal", F64, "seal score of SuctionNet-1Billion, 0 to 1", |row| {
            Value::F64(row.pose.suctionnet[0])
        }),
        RowColumn::new("suctionnet_wrench", F64, "wrench score of SuctionNet-1Billion, 0 to 1", |row| {
            Value::F64(row.pose.suctionnet[1])
        }),
    ]
}

/// Columns of the measures of the surface.
fn surface_columns<'a>() -> [RowColumn<PoseRow<'a>>; 9] {
    fn of(row: &PoseRow<'_>, value: fn(&SealedSurface) -> f64) -> Value<'static> {
        row.pose.surface.as_ref().map_or(Value::Empty, |surface| Value::F64(value(surface)))
    }
    [
        RowColumn::optional("seat", F64, "distance from the cup's frame to the farthest point of the lip [m]", |row| {
            of(row, |surface| surface.seat)
        }),
        RowColumn::optional("compression", F64, "mean compression of the bellows [m]", |row| {
            of(row, |surface| surface.compression)
        }),
        RowColumn::optional("spread", F64, "range of the lip's distances along the axis [m]", |row| {
            of(row, |surface| surface.spread)
        }),
        RowColumn::optional("slope", F64s, "2 numbers: slope of the lip's plane along x and y of the cup", |row| {
            numbers(row.pose.surface.as_ref().map(|surface| &surface.slope[..]))
        }),
        RowColumn::optional("flex", F64, "range of the lip's distances from its plane [m]", |row| {
            of(row, |surface| surface.flex)
        }),
        RowColumn::optional("stretch", F64, "largest stretch of a piece of the lip, as a share of its length", |row| {
            of(row, |surface| surface.stretch)
        }),
        RowColumn::optional(
            "bulge",
            F64,
            "largest height of the surface inside of the lip over its plane [m]",
            |row| of(row, |surface| surface.bulge),
        ),
        RowColumn::optional(
            "hole",
            F64,
            "largest depth of the surface inside of the lip, or along its outer edge, below its plane [m]",
            |row| of(row, |surface| surface.hole),
        ),
        RowColumn::optional(
            "curvatures",
            F64s,
            "2 numbers: principal curvatures, ascending, positive where the object is convex [1/m]",
            |row| numbers(row.pose.surface.as_ref().map(|surface| &surface.curvatures[..])),
        ),
    ]
}

/// Columns of the hold of the weight.
fn hold_columns<'a>() -> [RowColumn<PoseRow<'a>>; 4] {
    fn of(row: &PoseRow<'_>, value: fn(&SuctionHold) -> f64) -> Value<'static> {
        row.pose.hold.as_ref().map_or(Value::Empty, |hold| Value::F64(value(hold)))
    }
    [
        RowColumn::optional(
            "strength",
            Text,
            "strength that is used most: pull, shear, torsion or tilt",
            |row: &PoseRow<'a>| {
                let hold = row.pose.hold.as_ref();
                hold.map_or(Value::Empty, |hold| Value::Text(SuctionPoses::STRENGTHS[usize::from(hold.strength)]))
            },
        ),
        RowColumn::optional("hold_margin", F64, "1 less the used share of that strength, at least -1", |row| {
            of(row, |hold| hold.margin)
        }),
        RowColumn::optional("used", F64s, "4 numbers: used share of pull, shear, torsion and tilt", |row| {
            numbers(row.pose.hold.as_ref().map(|hold| &hold.used[..]))
        }),
        RowColumn::optional("force", F64, "force of the vacuum less that of the bellows [N]", |row| {
            of(row, |hold| hold.force)
        }),
    ]
}

/// Columns of the path, and the robustness.
fn path_columns<'a>() -> [RowColumn<PoseRow<'a>>; 5] {
    [
        RowColumn::optional(
            "blocked_by",
            Text,
            "obstacle on the path: ground, container, own object or neighbour",
            |row: &PoseRow<'a>| match row.pose.obstacle() {
                0 => Value::Empty,
                number => Value::Text(PickObstacle::NAMES[usize::from(number) - 1]),
            },
        ),
        RowColumn::optional(
            "stage",
            Text,
            "part of the path with the obstacle: pregrasp, the pose itself, or approach, the line to it",
            |row| row.pose.passage.blocked.map_or(Value::Empty, |blocked| Value::Text(blocked.stage.name())),
        ),
        RowColumn::optional("neighbour", U32, "number of the body that is the obstacle", |row| {
            match row.pose.neighbour() {
                0 => Value::Empty,
                number => Value::U32(number),
            }
        }),
        RowColumn::new(
            "clearance",
            F64,
            "distance from the obstacle, negative where they overlap; without one the smallest distance from anything but the \
             body, up to 0.01 [m]",
            |row| Value::F64(row.pose.passage.clearance),
        ),
        RowColumn::optional(
            "robustness",
            F64,
            "share of poses with errors in which a free cup seals and holds",
            |row| row.pose.robustness.map_or(Value::Empty, Value::F64),
        ),
    ]
}
