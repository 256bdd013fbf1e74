//! Producers: from a view of an object to records. They never call each other and never write.

pub mod completion;
pub mod reachability;

/// What became of a sample; a reject is data, not an error.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome<Facts, Reason> {
    /// The sample is in the worker's payloads.
    Kept(Facts),
    /// The sample is left out, and counted.
    Rejected {
        /// Why, as a name that is counted.
        reason: Reason,
        /// Why, with numbers, for people.
        detail: String,
        /// What was known by then.
        facts: Facts,
    },
}
