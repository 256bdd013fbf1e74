//! The scheduler: threads, journal, resume, progress.
