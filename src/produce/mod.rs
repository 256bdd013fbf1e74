//! Producers: from a work unit to records. They never call each other and never write.

pub mod completion;
