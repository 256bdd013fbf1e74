//! Tables of touch: contacts, and the approaches of hands that made them.

use super::column::{OfSample, RowColumn, RowTable, WrittenTable, matrix, numbers, sample_columns};
use crate::export::{error::ExportError, selected::SampleNames, target::Target};
use format::{Channel, HandTouch, TouchContact, TouchedPair, dataset::DatasetReader, products::completion::Approach};
use tables::{
    ColumnType::{Boolean, F64, F64s, Text, U32},
    Value,
};

/// Rows of a row group: 5 MB of contacts.
const ROW_GROUP: usize = 32768;

/// The tables while they grow; a dataset without touch has none, one without hands no approaches.
pub(super) struct TouchTables {
    contacts: Option<RowTable>,
    approaches: Option<RowTable>,
}

/// One contact.
struct ContactRow<'a> {
    names: &'a SampleNames<'a>,
    channel: Channel,
    contact: &'a TouchContact,
    /// The hand, and which of its contacts it is.
    hand: Option<(&'a HandTouch, usize)>,
}

/// One approach of a hand.
struct ApproachRow<'a> {
    names: &'a SampleNames<'a>,
    channel: Channel,
    probe: u32,
    approach: &'a Approach,
    hand: &'a HandTouch,
}

impl TouchTables {
    /// Begins the tables that the dataset fills.
    ///
    /// # Errors
    /// When a file can't be written.
    pub fn create(reader: &DatasetReader, target: &mut Target) -> Result<Self, ExportError> {
        let channels = reader.manifest().channels();
        let has = |is: fn(Channel) -> bool| channels.iter().any(|channel| is(*channel));
        let mut tables = Self { contacts: None, approaches: None };
        if has(Channel::is_touch) {
            let table = ("touch", "contact", ROW_GROUP);
            tables.contacts = Some(RowTable::create(table, &contact_columns(), (reader, &mut *target), &[])?);
        }
        if has(Channel::is_touch_by_hand) {
            let table = ("approaches", "approach", ROW_GROUP);
            tables.approaches = Some(RowTable::create(table, &approach_columns(), (reader, &mut *target), &[])?);
        }
        Ok(tables)
    }

    /// Adds the touch of a sample.
    ///
    /// # Errors
    /// When a file can't be written.
    pub fn push(&mut self, names: &SampleNames<'_>, touched: &TouchedPair) -> Result<(), ExportError> {
        let (contact_columns, approach_columns) = (contact_columns(), approach_columns());
        for (channel, touch) in &touched.touch {
            for (index, contact) in touch.contacts.iter().enumerate() {
                let hand = touch.hand.as_ref().map(|hand| (hand, index));
                let row = ContactRow { names, channel: *channel, contact, hand };
                self.contacts.as_mut().map_or(Ok(()), |table| table.push(&contact_columns, &row))?;
            }
            if let Some(hand) = &touch.hand {
                for (probe, approach) in (0..).zip(&hand.approaches) {
                    let row = ApproachRow { names, channel: *channel, probe, approach, hand };
                    self.approaches.as_mut().map_or(Ok(()), |table| table.push(&approach_columns, &row))?;
                }
            }
        }
        Ok(())
    }

    /// Ends the tables.
    ///
    /// # Errors
    /// When a file can't be written.
    pub fn finish(self) -> Result<Vec<WrittenTable>, ExportError> {
        self.contacts.into_iter().chain(self.approaches).map(RowTable::finish).collect()
    }
}

impl OfSample for ContactRow<'_> {
    fn names(&self) -> &SampleNames<'_> {
        self.names
    }
}

impl OfSample for ApproachRow<'_> {
    fn names(&self) -> &SampleNames<'_> {
        self.names
    }
}

fn contact_columns<'a>() -> Vec<RowColumn<ContactRow<'a>>> {
    let mut columns = sample_columns();
    columns.extend([
        RowColumn::new("channel", Text, "kind of touch: the channel that holds it", |row: &ContactRow<'a>| {
            Value::Text(row.channel.name())
        }),
        RowColumn::new("probe", U32, "number of the ray, or of the approach of a hand", |row| {
            Value::U32(row.contact.probe)
        }),
        RowColumn::new("position", F64s, "3 numbers: where it touched, in camera axes [m]", |row| {
            single(&row.contact.position)
        }),
        RowColumn::new("normal", F64s, "3 numbers: outward normal of the surface there, in camera axes", |row| {
            single(&row.contact.normal)
        }),
        RowColumn::new("distance", F64, "way of the probe until it touched [m]", |row| {
            Value::F64(row.contact.distance.into())
        }),
        RowColumn::new("visible", Boolean, "whether no surface stands between it and the camera", |row| {
            Value::Boolean(row.contact.visible)
        }),
        RowColumn::optional("cell_x", U32, "index of the cell of the pair's grid; none outside it", |row| cell(row, 0)),
        RowColumn::optional("cell_y", U32, "index of the cell of the pair's grid; none outside it", |row| cell(row, 1)),
        RowColumn::optional("cell_z", U32, "index of the cell of the pair's grid; none outside it", |row| cell(row, 2)),
        RowColumn::optional("link", Text, "link of the hand that touched; none of rays", |row| {
            let felt = row.hand.map(|(hand, index)| hand.links[hand.felt[index].link as usize].as_str());
            felt.map_or(Value::Empty, Value::Text)
        }),
        RowColumn::optional("force", F64, "force along the normal [N]; none of rays", |row| {
            row.hand.map_or(Value::Empty, |(hand, index)| Value::F64(hand.felt[index].force.into()))
        }),
        RowColumn::optional(
            "gap",
            F64,
            "from the mesh to the link [m], negative where it presses in; none of rays",
            |row| row.hand.map_or(Value::Empty, |(hand, index)| Value::F64(hand.felt[index].gap.into())),
        ),
    ]);
    columns
}

fn approach_columns<'a>() -> Vec<RowColumn<ApproachRow<'a>>> {
    let mut columns = sample_columns();
    columns.extend([
        RowColumn::new("channel", Text, "kind of touch: the channel that holds it", |row: &ApproachRow<'a>| {
            Value::Text(row.channel.name())
        }),
        RowColumn::new("probe", U32, "number of the approach", |row| Value::U32(row.probe)),
        RowColumn::new("hand", Text, "name of the hand", |row| Value::Text(&row.hand.hand)),
        RowColumn::new("end", Text, "how it ended: at_rest, timed_out, missed, unstable, overloaded", |row| {
            Value::Text(row.approach.end.name())
        }),
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

/// Three numbers of single precision.
fn single(values: &[f32; 3]) -> Value<'static> {
    Value::F64s(values.iter().copied().map(f64::from).collect())
}

/// One index of the cell of a contact.
fn cell(row: &ContactRow<'_>, axis: usize) -> Value<'static> {
    row.contact.cell.map_or(Value::Empty, |cell| Value::U32(cell[axis]))
}
