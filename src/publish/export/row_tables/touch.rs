//! Tables of touch: contacts, the approaches of hands that made them, and blocked probes.

use super::{
    column::{OfSample, RowColumn, list, matrix, numbers, sample_columns},
    row_table::{RowTable, TableName, TableRow, WrittenTable},
};
use crate::export::{error::ExportError, selected::SelectedSample, target::Target};
use format::{
    BlockedProbe, Channel, HandTouch, Product, TouchContact, TouchedPair, dataset::DatasetReader,
    products::completion::Approach,
};
use tables::{
    ColumnType::{Boolean, F64, F64s, Text, U32},
    Value,
};

/// The tables while they are written. A dataset without touch has none, one without hands no approaches, one of single objects no
/// blocked probes.
pub(super) struct TouchTables {
    contacts: Option<RowTable>,
    blocked: Option<RowTable>,
    approaches: Option<RowTable>,
}

/// One contact.
pub(super) struct ContactRow<'a> {
    sample: &'a SelectedSample<'a>,
    channel: Channel,
    contact: &'a TouchContact,
    /// The hand, and the index of the contact.
    hand: Option<(&'a HandTouch, usize)>,
}

/// One probe that something other than the body stopped.
pub(super) struct BlockedRow<'a> {
    sample: &'a SelectedSample<'a>,
    channel: Channel,
    blocked: &'a BlockedProbe,
}

/// One approach of a hand.
pub(super) struct ApproachRow<'a> {
    sample: &'a SelectedSample<'a>,
    channel: Channel,
    probe: u32,
    approach: &'a Approach,
    hand: &'a HandTouch,
}

impl TouchTables {
    /// Starts the tables of the dataset.
    ///
    /// # Errors
    /// When a file can't be written.
    pub fn create(reader: &DatasetReader, target: &mut Target) -> Result<Self, ExportError> {
        let manifest = reader.manifest();
        let channels = manifest.channels();
        let has = |is: fn(Channel) -> bool| channels.iter().any(|channel| is(*channel));
        let contacts = has(Channel::is_touch);
        // Nothing can block the probes of a single object.
        let blocked = contacts && !manifest.product.subjects_are_objects;
        let contacts = contacts.then(|| RowTable::create::<ContactRow>(reader, target, &[])).transpose()?;
        let blocked = blocked.then(|| RowTable::create::<BlockedRow>(reader, target, &[])).transpose()?;
        let by_hand = has(Channel::is_touch_by_hand);
        let approaches = by_hand.then(|| RowTable::create::<ApproachRow>(reader, target, &[])).transpose()?;
        Ok(Self { contacts, blocked, approaches })
    }

    /// Adds the touch of a sample.
    ///
    /// # Errors
    /// When a file can't be written.
    pub fn push(&mut self, sample: &SelectedSample<'_>, touched: &TouchedPair) -> Result<(), ExportError> {
        for (channel, touch) in &touched.touch {
            if let Some(table) = &mut self.contacts {
                let row = |(index, contact)| {
                    let hand = touch.hand.as_ref().map(|hand| (hand, index));
                    ContactRow { sample, channel: *channel, contact, hand }
                };
                table.extend(touch.contacts.iter().enumerate().map(row))?;
            }
            if let Some(table) = &mut self.blocked {
                let row = |blocked| BlockedRow { sample, channel: *channel, blocked };
                table.extend(touch.blocked.iter().map(row))?;
            }
            if let (Some(table), Some(hand)) = (&mut self.approaches, &touch.hand) {
                let row = |(probe, approach)| ApproachRow { sample, channel: *channel, probe, approach, hand };
                table.extend((0..).zip(&hand.approaches).map(row))?;
            }
        }
        Ok(())
    }

    /// Finishes the tables.
    ///
    /// # Errors
    /// When a file can't be written.
    pub fn finish(self) -> Result<Vec<WrittenTable>, ExportError> {
        self.contacts.into_iter().chain(self.blocked).chain(self.approaches).map(RowTable::finish).collect()
    }
}

impl OfSample for BlockedRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfSample for ContactRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfSample for ApproachRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl TableRow for ContactRow<'_> {
    const TABLE: TableName =
        TableName { name: "touch", row: "contact", group: 32768, meaning: "One row per contact of any kind of touch." };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("channel", Text, "kind of touch: the channel that holds it", |row: &Self| {
                Value::Text(row.channel.name())
            }),
            RowColumn::new("probe", U32, "number of the ray, or of the approach of a hand", |row| {
                Value::U32(row.contact.probe)
            }),
            RowColumn::new("position", F64s, "3 numbers: where it touched, in camera axes [m]", |row| {
                list(row.contact.position)
            }),
            RowColumn::new("normal", F64s, "3 numbers: outward normal of the surface there, in camera axes", |row| {
                list(row.contact.normal)
            }),
            RowColumn::new("distance", F64, "distance that the probe moved until it touched [m]", |row| {
                Value::F64(row.contact.distance.into())
            }),
            RowColumn::new("visible", Boolean, "whether no surface is between it and the camera", |row| {
                Value::Boolean(row.contact.visible)
            }),
            RowColumn::optional("cell_x", U32, "index of the cell of the pair's grid; none outside it", |row| {
                cell(row, 0)
            }),
            RowColumn::optional("cell_y", U32, "index of the cell of the pair's grid; none outside it", |row| {
                cell(row, 1)
            }),
            RowColumn::optional("cell_z", U32, "index of the cell of the pair's grid; none outside it", |row| {
                cell(row, 2)
            }),
            RowColumn::optional("link", Text, "link of the hand that touched; none for rays", |row| {
                let felt = row.hand.map(|(hand, index)| hand.links[hand.contacts[index].link as usize].as_str());
                felt.map_or(Value::Empty, Value::Text)
            }),
            RowColumn::optional("force", F64, "force along the normal [N]; none for rays", |row| {
                row.hand.map_or(Value::Empty, |(hand, index)| Value::F64(hand.contacts[index].force.into()))
            }),
            RowColumn::optional(
                "gap",
                F64,
                "from the mesh to the link [m], negative where it presses in; none for rays",
                |row| row.hand.map_or(Value::Empty, |(hand, index)| Value::F64(hand.contacts[index].gap.into())),
            ),
        ]);
        columns
    }
}

impl TableRow for BlockedRow<'_> {
    const TABLE: TableName = TableName {
        name: "blocked",
        row: "probe",
        group: 32768,
        meaning: "One row per ray or approach that an obstacle stopped, in clutter.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("channel", Text, "kind of touch: the channel that holds it", |row: &Self| {
                Value::Text(row.channel.name())
            }),
            RowColumn::new("probe", U32, "number of the ray, or of the approach of a hand", |row| {
                Value::U32(row.blocked.probe)
            }),
            RowColumn::new("by", U32, "obstacle: a body from 1, 254 the container, 255 the table", |row| {
                Value::U32(row.blocked.by.into())
            }),
            RowColumn::new("position", F64s, "3 numbers: where it was stopped, in camera axes [m]", |row| {
                list(row.blocked.position)
            }),
        ]);
        columns
    }
}

impl TableRow for ApproachRow<'_> {
    const TABLE: TableName = TableName {
        name: "approaches",
        row: "approach",
        group: 32768,
        meaning: "One row per approach of a hand, including those that touched nothing.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("channel", Text, "kind of touch: the channel that holds it", |row: &Self| {
                Value::Text(row.channel.name())
            }),
            RowColumn::new("probe", U32, "number of the approach", |row| Value::U32(row.probe)),
            RowColumn::new("hand", Text, "name of the hand", |row| Value::Text(&row.hand.hand)),
            RowColumn::new(
                "end",
                Text,
                "how it ended: at_rest, timed_out, missed, unstable, overloaded, blocked",
                |row| Value::Text(row.approach.end.name()),
            ),
            RowColumn::new(
                "camera_from_hand",
                F64s,
                "16 numbers: pose of the hand's base at the end, in camera axes [m]",
                |row| matrix(&row.approach.camera_from_hand),
            ),
            RowColumn::new("joints", F64s, "values of the hand's joints at the end [rad or m]", |row| {
                numbers(Some(&row.approach.joints))
            }),
        ]);
        columns
    }
}

/// One index of the cell of a contact.
fn cell(row: &ContactRow<'_>, axis: usize) -> Value<'static> {
    row.contact.cell.map_or(Value::Empty, |cell| Value::U32(cell[axis]))
}
