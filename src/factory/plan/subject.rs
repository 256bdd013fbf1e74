//! Subjects of a job and their counts of items.

use kernel::ids::ObjectId;

/// A subject of a job, and its items.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SubjectItems {
    /// The subject by content.
    pub id: ObjectId,
    /// Items of the subject; perhaps none.
    pub items: u32,
    /// Samples per item, at least 1.
    pub samples_per_item: u32,
}
