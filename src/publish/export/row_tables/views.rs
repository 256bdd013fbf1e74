//! Tables of views: images, and the bodies in them.

use super::{
    bodies::{BodyName, ObjectNames, OfBody, body_columns},
    column::{
        HasCamera, HasContainer, OfSample, RowColumn, camera_columns, container_columns, fact_columns, le_bytes, list,
        matrix, sample_columns,
    },
    objects::{self, ObjectCounts},
    row_table::{RowTable, TableName, TableRow, table_facts},
};
use crate::export::{
    error::ExportError,
    form::{ExportSelection, Written},
    selected::{SelectedSample, SelectedSamples},
    target::Target,
};
use format::{Channel, Depth, Product, SceneColour, SceneContainer, SceneImage, SceneInstance, dataset::DatasetReader};
use kernel::geom::Intrinsics;
use tables::{
    ColumnType::{Boolean, Bytes, F64, F64s, U32},
    Value,
};

/// Layout of the tables in words.
pub(super) const LAYOUT: &str = "\
    views.parquet: one row per image; depth is float32 little-endian of shape (height, width) [m], NaN = no return; instances and \
    point_instances are uint8 (height, width), rgb uint8 (height, width, 3); instances.parquet: one row per body of the scene in each \
    image; objects.parquet: one row per object. sample_index joins them. Poses are 16 numbers, 4 x 4 row-major";

/// One image.
pub(super) struct ViewRow<'a> {
    sample: &'a SelectedSample<'a>,
    image: &'a SceneImage,
    depth: Vec<u8>,
    colour: Option<&'a SceneColour>,
}

/// One body in an image.
pub(super) struct InstanceRow<'a> {
    sample: &'a SelectedSample<'a>,
    body: BodyName<'a>,
    instance: &'a SceneInstance,
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
    let mut views = RowTable::create::<ViewRow>(reader, target, &[])?;
    let mut instances = RowTable::create::<InstanceRow>(reader, target, &[])?;
    let mut counts = ObjectCounts::default();
    selected.each(|stored, sample| {
        let (image, depth, colour) =
            (&stored.read::<SceneImage>()?, stored.find::<Depth>()?, stored.find::<SceneColour>()?);
        let [width, height] = [image.camera.width, image.camera.height];
        let depth = depth.map_or_else(Vec::new, |depth| le_bytes(&depth.crop.whole(width, height)));
        counts.add(image.bodies.iter().map(|body| body.object));
        views.extend([ViewRow { sample, image, depth, colour: colour.as_ref() }])?;
        let row = |(number, instance): (u32, _)| InstanceRow::new(sample, number, instance, &names);
        instances.extend((1..).zip(&image.bodies).map(row))
    })?;
    let objects = objects::write(reader, &assets.objects, &counts, target)?;
    let mut written = Written::selection(selected.count(), "views", selection);
    written.facts.extend(table_facts([views.finish()?, instances.finish()?, objects]));
    Ok(written)
}

impl<'a> InstanceRow<'a> {
    fn new(sample: &'a SelectedSample<'a>, number: u32, instance: &'a SceneInstance, names: &ObjectNames<'a>) -> Self {
        Self { sample, body: BodyName::new(number, instance.object, names), instance }
    }
}

impl OfSample for ViewRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl HasCamera for ViewRow<'_> {
    fn camera(&self) -> &Intrinsics {
        &self.image.camera
    }
}

impl HasContainer for ViewRow<'_> {
    fn container(&self) -> &SceneContainer {
        &self.image.container
    }
}

impl OfSample for InstanceRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfBody for InstanceRow<'_> {
    fn body(&self) -> &BodyName<'_> {
        &self.body
    }
}

impl TableRow for ViewRow<'_> {
    const TABLE: TableName = TableName {
        name: "views",
        row: "view",
        group: 16,
        meaning: "One row per image. `numpy.frombuffer(depth, \"<f4\").reshape(height, width)` is the depth. Jobs that render colours have \
                  `rgb`, views that store depth have `depth`, jobs with a sensor have `point_instances`. In `instances` 0 is nothing, from \
                  1 a body, 254 the container and 255 the table; in `point_instances`, 253 is a depth between two bodies.",
    };

    fn columns(product: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend(camera_columns());
        columns.push(RowColumn::new(
            "world_from_camera",
            F64s,
            "16 numbers: pose of the camera in the world [m]",
            |row: &Self| matrix(&row.image.world_from_camera),
        ));
        columns.extend(container_columns());
        columns.extend([
            RowColumn::new("table_size", F64s, "2 numbers: sides of the table along x and y [m]", |row: &Self| {
                list(row.image.table)
            }),
            RowColumn::new("instances", Bytes, "uint8 (height, width): what each pixel sees", |row| {
                Value::Bytes(&row.image.instances)
            }),
            RowColumn::optional(
                "point_instances",
                Bytes,
                "uint8 (height, width): what each measured depth belongs to; none without a sensor",
                |row| row.image.point_instances.as_deref().map_or(Value::Empty, Value::Bytes),
            ),
            RowColumn::new(
                "depth",
                Bytes,
                "float32 (height, width): depth along the optical axis [m]",
                |row: &Self| Value::Bytes(&row.depth),
            )
            .of_channel(Channel::VIEW_DEPTH),
            RowColumn::optional("rgb", Bytes, "uint8 (height, width, 3): red, green, blue", |row: &Self| {
                row.colour.map_or(Value::Empty, |colour| Value::Bytes(colour.rgb.as_flattened()))
            })
            .of_channel(Channel::VIEW_COLOUR),
        ]);
        let facts = fact_columns(product, &columns);
        columns.extend(facts);
        columns
    }
}

impl TableRow for InstanceRow<'_> {
    const TABLE: TableName = TableName {
        name: "instances",
        row: "instance",
        group: 1024,
        meaning: "One row per body of the scene in each image, seen or not. Boxes are left, top, width and height [px]. `mask` has the \
                  bits of the silhouette in `mask_box`: `numpy.unpackbits(numpy.frombuffer(mask, numpy.uint8), bitorder=\"little\")[:w * \
                  h].reshape(h, w)`.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend(body_columns());
        columns.extend([
            RowColumn::new(
                "world_from_object",
                F64s,
                "16 numbers: pose of the object in the world [m]",
                |row: &Self| matrix(&row.instance.world_from_object),
            ),
            RowColumn::new(
                "pixels_all",
                U32,
                "pixels of its silhouette alone, including those outside the image",
                |row| Value::U32(row.instance.pixels_all),
            ),
            RowColumn::new("pixels_in_image", U32, "pixels of its silhouette alone, in the image", |row| {
                Value::U32(row.instance.mask.count())
            }),
            RowColumn::new("pixels_visible", U32, "pixels that see it", |row| Value::U32(row.instance.pixels_visible)),
            RowColumn::new("visible_share", F64, "visible share of its silhouette, 0 to 1", |row| {
                Value::F64(row.instance.visible_share())
            }),
            RowColumn::optional(
                "pixels_too_near",
                U32,
                "pixels that see it nearer than the sensor measures; none without a sensor",
                |row| row.instance.near.map_or(Value::Empty, |near| Value::U32(near.pixels)),
            ),
            RowColumn::optional(
                "nearest_depth",
                F64,
                "smallest true depth of the pixels that see it, 0 if none does; none without a sensor [m]",
                |row| row.instance.near.map_or(Value::Empty, |near| Value::F64(near.nearest.into())),
            ),
            RowColumn::new("truncated", Boolean, "whether it extends beyond the image", |row| {
                Value::Boolean(row.instance.is_truncated())
            }),
            RowColumn::new("whole_box", F64s, "4 numbers: its whole silhouette, in the image or not [px]", |row| {
                list(row.instance.whole_box)
            }),
            RowColumn::new("visible_box", F64s, "4 numbers: pixels that see it; zeros if none does [px]", |row| {
                list(row.instance.visible_box)
            }),
            RowColumn::new("mask_box", F64s, "4 numbers: the part of the image that `mask` covers [px]", |row| {
                let mask = &row.instance.mask;
                list([mask.left, mask.top, mask.width, mask.height])
            }),
            RowColumn::new(
                "mask",
                Bytes,
                "bits of its silhouette alone, regardless of what is in front of it",
                |row| Value::Bytes(&row.instance.mask.bits),
            ),
        ]);
        columns
    }
}
