//! Columns of a table of rows.

use std::borrow::Cow;

use crate::export::selected::SelectedSample;
use format::{Channel, FactKind, Product, SceneContainer};
use kernel::geom::{Frame, Intrinsics, Pose};
use tables::{ColumnType, TableColumn, Value};

/// A column of a table whose rows are made of records `R`.
pub(super) struct RowColumn<R> {
    /// Name of the column.
    pub name: &'static str,
    /// Type of its values.
    pub kind: ColumnType,
    /// Whether a value may be missing.
    pub optional: bool,
    /// Text about the content, with unit and frame.
    pub meaning: Cow<'static, str>,
    /// Channels without which a dataset has no such column; `None`: every dataset has it.
    needs: Option<fn(Channel) -> bool>,
    /// Topic without which a dataset has no such column.
    topic: Option<&'static str>,
    cell: Cell<R>,
}

/// The value of a row.
enum Cell<R> {
    /// Out of the record.
    Record(fn(&R) -> Value<'_>),
    /// The fact of the sample with this index, a whole number or not.
    Fact(fn(&R, usize) -> f64, usize, bool),
}

impl<R> RowColumn<R> {
    /// A column with a value in every row.
    pub fn new(name: &'static str, kind: ColumnType, meaning: &'static str, value: fn(&R) -> Value<'_>) -> Self {
        let (meaning, cell) = (Cow::Borrowed(meaning), Cell::Record(value));
        Self { name, kind, optional: false, meaning, needs: None, topic: None, cell }
    }

    /// A column whose value may be missing.
    pub fn optional(name: &'static str, kind: ColumnType, meaning: &'static str, value: fn(&R) -> Value<'_>) -> Self {
        Self { optional: true, ..Self::new(name, kind, meaning, value) }
    }

    /// The column of datasets that store a channel.
    pub fn of_channel(self, channel: Channel) -> Self {
        Self { topic: Some(channel.topic), ..self }
    }

    /// The column of datasets that store one of some channels.
    pub fn of_channels(self, needs: fn(Channel) -> bool) -> Self {
        Self { needs: Some(needs), ..self }
    }

    /// Whether a dataset with these channels has the column.
    pub fn is_stored(&self, channels: &[Channel]) -> bool {
        self.needs.is_none_or(|needs| channels.iter().any(|channel| needs(*channel)))
            && self.topic.is_none_or(|topic| channels.iter().any(|channel| channel.topic == topic))
    }

    /// The column as the library of tables takes it.
    pub fn format(&self) -> TableColumn {
        TableColumn { name: self.name.into(), kind: self.kind, optional: self.optional }
    }

    /// The value of a row.
    pub fn value<'r>(&self, row: &'r R) -> Value<'r> {
        match self.cell {
            Cell::Record(value) => value(row),
            Cell::Fact(value, index, true) => Value::U32(value(row, index) as u32),
            Cell::Fact(value, index, false) => Value::F64(value(row, index)),
        }
    }
}

/// A row of something in a sample.
pub(super) trait OfSample {
    /// The sample.
    fn sample(&self) -> &SelectedSample<'_>;
}

/// A row with a camera.
pub(super) trait HasCamera {
    /// The camera [px].
    fn camera(&self) -> &Intrinsics;
}

/// A row with the container of a scene.
pub(super) trait HasContainer {
    /// The container.
    fn container(&self) -> &SceneContainer;
}

/// Columns that name the sample of a row.
pub(super) fn sample_columns<R: OfSample>() -> Vec<RowColumn<R>> {
    use ColumnType::{Text, U32, U64};
    vec![
        RowColumn::new("sample_index", U64, "index of the sample in the dataset", |row| {
            Value::U64(row.sample().index.0)
        }),
        RowColumn::new("subject", Text, "digest of the subject, 64 hexadecimal digits", |row| {
            Value::Text(&row.sample().subject)
        }),
        RowColumn::new("object", Text, "name of the subject", |row| Value::Text(row.sample().object)),
        RowColumn::new("split", Text, "split of the sample; empty if the product has no splits", |row| {
            Value::Text(row.sample().split)
        }),
        RowColumn::new("item", U32, "number of the sample's item: view, run, position, grasp or body", |row| {
            Value::U32(row.sample().id.item.0)
        }),
    ]
}

/// Columns of the facts of a product's samples, without those that the table reads from the records.
pub(super) fn fact_columns<R: OfSample>(product: Product, known: &[RowColumn<R>]) -> Vec<RowColumn<R>> {
    let facts =
        product.facts.iter().enumerate().filter(|(_, fact)| known.iter().all(|column| column.name != fact.name));
    let column = |(index, fact): (usize, &'static format::FactFormat)| {
        let is_whole = !matches!(fact.kind, FactKind::Number(_));
        RowColumn {
            name: fact.name,
            kind: if is_whole { ColumnType::U32 } else { ColumnType::F64 },
            optional: false,
            meaning: as_meaning(fact.meaning).into(),
            needs: None,
            topic: fact.topic,
            cell: Cell::Fact(|row: &R, index| row.sample().facts.values()[index], index, is_whole),
        }
    };
    facts.map(column).collect()
}

/// A sentence as the meaning of a column: without the capital and the full stop.
fn as_meaning(sentence: &str) -> String {
    let mut letters = sentence.trim_end_matches('.').chars();
    letters.next().map(|first| first.to_lowercase().chain(letters).collect()).unwrap_or_default()
}

/// Columns of a camera.
pub(super) fn camera_columns<R: HasCamera>() -> [RowColumn<R>; 6] {
    use ColumnType::{F64, U32};
    [
        RowColumn::new("width", U32, "width of the camera's image [px]", |row: &R| Value::U32(row.camera().width)),
        RowColumn::new("height", U32, "height of the camera's image [px]", |row| Value::U32(row.camera().height)),
        RowColumn::new("fx", F64, "focal length of the camera [px]", |row| Value::F64(row.camera().fx)),
        RowColumn::new("fy", F64, "focal length of the camera [px]", |row| Value::F64(row.camera().fy)),
        RowColumn::new("cx", F64, "principal point of the camera [px]", |row| Value::F64(row.camera().cx)),
        RowColumn::new("cy", F64, "principal point of the camera [px]", |row| Value::F64(row.camera().cy)),
    ]
}

/// Columns of the container of a scene.
pub(super) fn container_columns<R: HasContainer>() -> [RowColumn<R>; 2] {
    [
        RowColumn::new("container", ColumnType::Text, "container of the scene: plane, bin or mesh", |row: &R| {
            Value::Text(row.container().name())
        }),
        RowColumn::new(
            "container_size",
            ColumnType::F64s,
            "sides along x and y of a plane; inner sides of a bin and thickness of its walls; inner sides of a mesh [m]; last \
             the tilt of a tilted bin or mesh [degree]",
            |row| Value::F64s(row.container().sizes().into()),
        ),
    ]
}

/// A pose as 16 numbers, 4 x 4 row-major.
pub(super) fn matrix<To: Frame, From: Frame>(pose: &Pose<To, From>) -> Value<'static> {
    Value::F64s(pose.to_rows().into_iter().chain([0.0, 0.0, 0.0, 1.0]).collect())
}

/// A list of numbers; none where there is no list.
pub(super) fn numbers(values: Option<&[f64]>) -> Value<'_> {
    values.map_or(Value::Empty, |values| Value::F64s(Cow::Borrowed(values)))
}

/// A list of numbers that become doubles.
pub(super) fn list<T: Into<f64>>(values: impl IntoIterator<Item = T>) -> Value<'static> {
    Value::F64s(values.into_iter().map(Into::into).collect())
}

/// Little-endian bytes of single precision.
pub(super) fn le_bytes<'v>(values: impl IntoIterator<Item = &'v f32>) -> Vec<u8> {
    values.into_iter().flat_map(|value| value.to_le_bytes()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_become_meanings() {
        assert_eq!(
            as_meaning("Bodies of the scene; 0 for a rejected scene."),
            "bodies of the scene; 0 for a rejected scene"
        );
        assert_eq!(as_meaning(""), "");
    }
}
