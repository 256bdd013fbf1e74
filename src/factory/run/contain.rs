//! Panics of producers become errors that name what was being made: a defect costs the run at hand, never a finished shard or
//! the other threads' work.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
};

use crate::{RunError, job::Job};
use kernel::ids::ItemId;

/// Runs a step; a panic in it becomes [`RunError::Panicked`]. What the step was changing must not be used after an error.
pub(super) fn contain<T, E>(what: impl FnOnce() -> String, step: impl FnOnce() -> Result<T, E>) -> Result<T, RunError>
where
    RunError: From<E>,
{
    match catch_unwind(AssertUnwindSafe(step)) {
        Ok(result) => Ok(result?),
        Err(payload) => Err(RunError::Panicked { what: what(), message: message_of(payload.as_ref()) }),
    }
}

/// The text of a panic.
fn message_of(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied().or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("no message").to_owned()
}

/// A subject of a job, for people: its name where it is an object, otherwise its content.
pub(super) fn subject_words(job: &Job, subject: usize) -> String {
    let noun = job.product().subjects.one;
    let objects = job.work.objects().filter(|_| job.product().subjects_are_objects);
    match objects.and_then(|objects| objects.list.get(subject)) {
        Some(object) => format!("{noun} `{}`", object.source.name),
        None => match job.work.subjects().get(subject) {
            Some(items) => format!("{noun} {:?}", items.id),
            None => format!("{noun} {subject}"),
        },
    }
}

/// An item of a subject, for people.
pub(super) fn item_words(job: &Job, subject: usize, item: ItemId) -> String {
    format!("{} {item} of {}", job.product().samples.one, subject_words(job, subject))
}
