//! The table of bodies of scenes: the object and the pose of each.

use std::collections::BTreeMap;

use super::{
    column::{OfSample, RowColumn, matrix, numbers, sample_columns},
    row_table::{TableName, TableRow},
};
use crate::export::selected::SelectedSample;
use format::{Channel, Product, SceneBody, dataset::AssetRow};
use kernel::{
    geom::{Object, Pose, World},
    ids::ObjectId,
};
use tables::{
    ColumnType::{F64, F64s, Text, U32},
    Value,
};

/// Names of objects by content.
pub(super) struct ObjectNames<'a>(BTreeMap<ObjectId, &'a str>);

impl<'a> ObjectNames<'a> {
    /// The names in some rows of the asset table.
    pub fn of(assets: &'a [AssetRow]) -> Self {
        Self(assets.iter().map(|row| (row.object, row.name.as_str())).collect())
    }

    /// Name of an object; empty where the asset table does not list it.
    pub fn name(&self, object: ObjectId) -> &'a str {
        self.0.get(&object).copied().unwrap_or_default()
    }
}

/// One body of a scene, by its number from 1.
pub(super) struct BodyName<'a> {
    pub number: u32,
    /// The object by content, 64 hexadecimal digits.
    pub object: String,
    pub name: &'a str,
}

impl<'a> BodyName<'a> {
    /// A body that is this object.
    pub fn new(number: u32, object: ObjectId, names: &ObjectNames<'a>) -> Self {
        Self { number, object: object.to_string(), name: names.name(object) }
    }
}

/// A row of something that a body of a scene is or has.
pub(super) trait OfBody {
    /// The body.
    fn body(&self) -> &BodyName<'_>;
}

/// Columns that name a body.
pub(super) fn body_columns<R: OfBody>() -> [RowColumn<R>; 3] {
    [
        RowColumn::new("body", U32, "number of the body in its scene, from 1", |row: &R| Value::U32(row.body().number)),
        RowColumn::new("body_name", Text, "name of the body's object", |row| Value::Text(row.body().name)),
        RowColumn::new("body_object", Text, "digest of the body's object, 64 hexadecimal digits", |row| {
            Value::Text(&row.body().object)
        }),
    ]
}

/// A body of a scene.
pub(super) struct BodyRow<'a> {
    sample: &'a SelectedSample<'a>,
    body: BodyName<'a>,
    pose: Pose<World, Object>,
    /// Further numbers of a scene that was settled or read.
    scene: Option<&'a SceneBody>,
}

impl<'a> BodyRow<'a> {
    /// The bodies of a sample, by object and pose.
    pub fn all(
        sample: &'a SelectedSample<'a>,
        names: &'a ObjectNames<'a>,
        bodies: &'a [(ObjectId, Pose<World, Object>)],
    ) -> impl Iterator<Item = Self> {
        let row = move |(number, (object, pose)): (u32, &(ObjectId, Pose<World, Object>))| Self {
            sample,
            body: BodyName::new(number, *object, names),
            pose: *pose,
            scene: None,
        };
        (1..).zip(bodies).map(row)
    }

    /// The bodies of a scene.
    pub fn of_scene(
        sample: &'a SelectedSample<'a>,
        names: &'a ObjectNames<'a>,
        bodies: &'a [SceneBody],
    ) -> impl Iterator<Item = Self> {
        let row = move |(number, body): (u32, &'a SceneBody)| Self {
            sample,
            body: BodyName::new(number, body.object, names),
            pose: body.world_from_object,
            scene: Some(body),
        };
        (1..).zip(bodies).map(row)
    }

    fn number(&self, of: fn(&SceneBody) -> f64) -> Value<'static> {
        self.scene.map_or(Value::Empty, |body| Value::F64(of(body)))
    }
}

impl OfSample for BodyRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfBody for BodyRow<'_> {
    fn body(&self) -> &BodyName<'_> {
        &self.body
    }
}

impl TableRow for BodyRow<'_> {
    const TABLE: TableName = TableName {
        name: "bodies",
        row: "body",
        group: 16384,
        meaning: "One row per body of each exported scene, volume, pick or sample of suction; `body` counts in the order of the scene. Only scenes have the \
                  columns from `mass` on.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend(body_columns());
        columns.push(RowColumn::new(
            "world_from_object",
            F64s,
            "16 numbers: pose of the object in the world [m]",
            |row: &Self| matrix(&row.pose),
        ));
        let of_scenes = [
            RowColumn::optional("mass", F64, "mass [kg]", |row: &Self| row.number(|body| body.mass)),
            RowColumn::optional("centre_of_mass", F64s, "3 numbers: centre of mass, in the world [m]", |row| {
                numbers(row.scene.map(|body| &body.centre_of_mass[..]))
            }),
            RowColumn::optional(
                "friction",
                F64,
                "coefficient of sliding friction; the larger one counts between two bodies",
                |row| row.number(|body| body.friction),
            ),
            RowColumn::optional("released_at", F64, "time at which it was released [s]", |row| {
                row.number(|body| body.released_at)
            }),
            RowColumn::optional(
                "resting_pose",
                U32,
                "index of the resting pose of its object with the nearest upward direction; none if no resting pose is known",
                |row| {
                    let resting = row.scene.and_then(|body| body.resting);
                    resting.map_or(Value::Empty, |(pose, _)| Value::U32(pose))
                },
            ),
            RowColumn::optional("resting_angle", F64, "angle between the two upward directions [rad]", |row| {
                let resting = row.scene.and_then(|body| body.resting);
                resting.map_or(Value::Empty, |(_, angle)| Value::F64(angle))
            }),
            RowColumn::optional(
                "drift",
                F64,
                "motion of its centre of mass when the scene is stepped again from rest [m]",
                |row| row.number(|body| body.drift),
            ),
            RowColumn::optional("turn", F64, "rotation then [rad]", |row| row.number(|body| body.turn)),
        ];
        columns.extend(of_scenes.map(|column| column.of_channel(Channel::SCENE)));
        columns
    }
}
