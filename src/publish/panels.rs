//! One sample of a dataset as a row of panels, as in the first picture of README.md.

use super::{picture::Panel, products::pages_of};
use format::dataset::{DatasetError, DatasetReader, Selection};
use kernel::{files::Folder, ids::ItemId};

/// Draws the sample of an object and an item in panels, each at most `side` pixels wide and high; `None` if the dataset stores no
/// such sample. The name is empty for a robot's map, whose samples all belong to that robot.
///
/// # Errors
/// When the dataset is not finished, or a file is missing or damaged.
pub fn draw_panels(folder: &Folder, object: &str, item: ItemId, side: u32) -> Result<Option<Vec<Panel>>, DatasetError> {
    let reader = DatasetReader::open(folder)?;
    let row = reader.assets()?.objects.into_iter().find(|row| row.name == object);
    let is_wanted = |index: &_| {
        reader.id(*index).is_some_and(|id| {
            id.item == item && (object.is_empty() || row.as_ref().is_some_and(|row| row.object == id.subject))
        })
    };
    let Some(index) = reader.indices(Selection::default()).find(is_wanted) else { return Ok(None) };
    let Some(sample) = reader.sample(index)? else { return Ok(None) };
    let survey = (pages_of(reader.manifest().product).survey)(&reader)?;
    survey.panels(&reader, &sample, side).map(Some)
}
