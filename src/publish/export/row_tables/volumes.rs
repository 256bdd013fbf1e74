//! Tables of volumes: cubes of distances, the images that they are fused from, the bodies and the grasps in them.

use super::{
    bodies::{BodyRow, ObjectNames},
    column::{HasCamera, OfSample, RowColumn, camera_columns, fact_columns, list, matrix, numbers, sample_columns},
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
    Channel, FusedView, Product, SceneVolume, VolumeAffordance, VolumeTruth, VoxelGrasp, dataset::DatasetReader,
};
use kernel::geom::Intrinsics;
use tables::{
    ColumnType::{Bytes, F64, F64s, Text, U32},
    Value,
};

/// Layout of the tables in words.
pub(super) const LAYOUT: &str = "\
    volumes.parquet: one row per fusion; steps is int16 little-endian, weights and instances uint8, of shape (n, n, n), indexed [x, y, z]; \
    fused_views.parquet: one row per image of a fusion; bodies.parquet: one row per body of its scene; with grasps \
    volume_grasps.parquet: one row per free grasp in the cube; objects.parquet: one row per object. sample_index joins them. Poses are \
    16 numbers, 4 x 4 row-major";

/// One volume.
pub(super) struct VolumeRow<'a> {
    sample: &'a SelectedSample<'a>,
    volume: &'a SceneVolume,
    truth: &'a VolumeTruth,
    affordance: Option<&'a VolumeAffordance>,
    steps: Vec<u8>,
    /// Digests of the dataset of picks: its exact numbers, and those of physics.
    picks: [String; 2],
}

/// One image of a volume.
pub(super) struct FusedRow<'a> {
    sample: &'a SelectedSample<'a>,
    view: &'a FusedView,
}

/// One grasp in a volume.
pub(super) struct GraspRow<'a> {
    sample: &'a SelectedSample<'a>,
    grasp: &'a VoxelGrasp,
    voxel: [u32; 3],
}

/// The tables while they are written.
struct VolumeTables {
    volumes: RowTable,
    fused: RowTable,
    bodies: RowTable,
    grasps: Option<RowTable>,
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
    let has_grasps = reader.manifest().channels().contains(&Channel::VOLUME_AFFORDANCE);
    let mut tables = VolumeTables {
        volumes: RowTable::create::<VolumeRow>(reader, target, &[])?,
        fused: RowTable::create::<FusedRow>(reader, target, &[])?,
        bodies: RowTable::create::<BodyRow>(reader, target, &[])?,
        grasps: has_grasps.then(|| RowTable::create::<GraspRow>(reader, target, &[])).transpose()?,
    };
    let mut counts = ObjectCounts::default();
    selected.each(|stored, sample| {
        let (volume, truth) = (&stored.read::<SceneVolume>()?, &stored.read::<VolumeTruth>()?);
        let affordance = stored.find::<VolumeAffordance>()?;
        counts.add(truth.bodies.iter().map(|(object, _)| *object));
        tables.push(sample, (volume, truth, affordance.as_ref()), &names)
    })?;
    let objects = objects::write(reader, &assets.objects, &counts, target)?;
    let mut written = Written::selection(selected.count(), "volumes", selection);
    let VolumeTables { volumes, fused, bodies, grasps } = tables;
    let all = [volumes, fused, bodies].into_iter().chain(grasps).map(RowTable::finish).chain([Ok(objects)]);
    written.facts.extend(table_facts(all.collect::<Result<Vec<_>, _>>()?));
    Ok(written)
}

impl VolumeTables {
    /// Adds a volume.
    fn push<'a>(
        &mut self,
        sample: &'a SelectedSample<'a>,
        (volume, truth, affordance): (&'a SceneVolume, &'a VolumeTruth, Option<&'a VolumeAffordance>),
        names: &'a ObjectNames<'a>,
    ) -> Result<(), ExportError> {
        let steps = volume.steps.iter().flat_map(|steps| steps.to_le_bytes()).collect();
        let trials = affordance.and_then(|affordance| affordance.trials);
        let picks = [affordance.map(|affordance| affordance.picks), trials]
            .map(|digest| digest.map(|digest| digest.hex()).unwrap_or_default());
        self.volumes.extend([VolumeRow { sample, volume, truth, affordance, steps, picks }])?;
        self.fused.extend(volume.views.iter().map(|view| FusedRow { sample, view }))?;
        self.bodies.extend(BodyRow::all(sample, names, &truth.bodies))?;
        let (Some(table), Some(affordance)) = (&mut self.grasps, affordance) else { return Ok(()) };
        let n = affordance.grid.resolution;
        let row = |grasp: &'a VoxelGrasp| {
            let number = affordance.voxel(grasp);
            GraspRow { sample, grasp, voxel: [number / n / n, number / n % n, number % n] }
        };
        table.extend(affordance.grasps.iter().map(row))
    }
}

impl OfSample for VolumeRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfSample for FusedRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl HasCamera for FusedRow<'_> {
    fn camera(&self) -> &Intrinsics {
        &self.view.intrinsics
    }
}

impl OfSample for GraspRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl TableRow for VolumeRow<'_> {
    const TABLE: TableName = TableName {
        name: "volumes",
        row: "volume",
        group: 16,
        meaning: "One row per fusion. `numpy.frombuffer(steps, \"<i2\").reshape(n, n, n) / 32767` is the mean signed distance in units of \
                  the truncation, indexed (x, y, z); n is `resolution`. In `instances` 0 is free, from 1 a body, 254 the container and 255 \
                  below the table. Jobs that name picks have the columns from `hand` to `evaluated`.",
    };

    fn columns(product: Product) -> Vec<RowColumn<Self>> {
        fn of<'r>(row: &'r VolumeRow<'_>, value: fn(&'r VolumeAffordance) -> Value<'r>) -> Value<'r> {
            row.affordance.map_or(Value::Empty, value)
        }
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("resolution", U32, "voxels along each edge of the cube, n", |row: &Self| {
                Value::U32(row.volume.grid.resolution)
            }),
            RowColumn::new("size", F64, "edge of the cube [m]", |row| Value::F64(row.volume.grid.size)),
            RowColumn::new("truncation", F64, "distance at which values are truncated [m]", |row| {
                Value::F64(row.volume.truncation)
            }),
            RowColumn::new(
                "world_from_volume",
                F64s,
                "16 numbers: pose of the cube, whose origin is a corner, in the world [m]",
                |row| matrix(&row.volume.world_from_volume),
            ),
            RowColumn::new(
                "steps",
                Bytes,
                "int16 (n, n, n): mean signed distance / truncation * 32767, positive in front of the observed surface",
                |row| Value::Bytes(&row.steps),
            ),
            RowColumn::new("weights", Bytes, "uint8 (n, n, n): number of images averaged in each distance", |row| {
                Value::Bytes(&row.volume.weights)
            }),
            RowColumn::new("instances", Bytes, "uint8 (n, n, n): what is at the centre of each voxel", |row| {
                Value::Bytes(&row.truth.instances)
            }),
        ]);
        let of_grasps = [
            RowColumn::optional("hand", Text, "name of the hand", |row: &Self| {
                of(row, |affordance| Value::Text(&affordance.hand))
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
            RowColumn::optional(
                "forbidden_by",
                F64s,
                "4 numbers: grasps of the scene that collide with ground, container, own object and neighbour",
                |row| of(row, |affordance| list(affordance.forbidden)),
            ),
            RowColumn::optional("evaluated", F64s, "one number per body: 1 if it has picks, else 0", |row| {
                of(row, |affordance| list(affordance.evaluated.iter().map(|known| u8::from(*known))))
            }),
        ];
        columns.extend(of_grasps.map(|column| column.of_channel(Channel::VOLUME_AFFORDANCE)));
        let facts = fact_columns(product, &columns);
        columns.extend(facts);
        columns
    }
}

impl TableRow for FusedRow<'_> {
    const TABLE: TableName =
        TableName { name: "fused_views", row: "view", group: 16384, meaning: "One row per image of a fusion." };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("view", U32, "number of the view: its `item` in the dataset of views", |row: &Self| {
                Value::U32(row.view.view)
            }),
            RowColumn::new("camera", U32, "index of the job's camera that made it", |row| Value::U32(row.view.camera)),
        ]);
        columns.extend(camera_columns());
        columns.push(RowColumn::new(
            "world_from_camera",
            F64s,
            "16 numbers: pose of the camera in the world [m]",
            |row: &Self| matrix(&row.view.world_from_camera),
        ));
        columns
    }
}

impl TableRow for GraspRow<'_> {
    const TABLE: TableName = TableName {
        name: "volume_grasps",
        row: "grasp",
        group: 16384,
        meaning: "One row per free grasp whose centre is in the cube. `body` and `candidate` join it with `candidates.parquet` of the \
                  picks.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("body", U32, "number of the body, from 1", |row: &Self| Value::U32(row.grasp.body)),
            RowColumn::new("candidate", U32, "index among the candidates of that body", |row| {
                Value::U32(row.grasp.candidate)
            }),
            RowColumn::new("state", Text, "outcome of its trial: untried, held or failed", |row| {
                Value::Text(row.grasp.state.name())
            }),
            RowColumn::new("voxel", F64s, "3 numbers: the voxel that contains its centre", |row| list(row.voxel)),
            RowColumn::new(
                "centre",
                F64s,
                "3 numbers: middle between the pads of a closed gripper, or the mean of the contacts of any other hand, in the \
                 volume's frame [m]",
                |row| numbers(Some(&row.grasp.centre)),
            ),
            RowColumn::new(
                "rotation",
                F64s,
                "4 numbers: quaternion x, y, z, w in the volume's frame, x along the closing line, z along the approach",
                |row| numbers(Some(&row.grasp.rotation)),
            ),
            RowColumn::new("width", F64, "free width between the pads of the closed hand [m]; 0 for a hand without a width", |row| {
                Value::F64(row.grasp.width)
            }),
        ]);
        columns
    }
}
