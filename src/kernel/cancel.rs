//! A wish to stop, checked inside long work.

use std::sync::atomic::{AtomicBool, Ordering};

/// A wish to stop, set by a signal handler; work ends at the next sample, or inside the preparation of an object.
#[derive(Debug, Default)]
pub struct Cancel(AtomicBool);

/// Work that ended early because somebody wished it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Cancelled;

impl Cancel {
    /// Not wished yet.
    pub const fn new() -> Self {
        Self(AtomicBool::new(false))
    }

    /// Wishes it.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was wished.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Ends the caller's work by `?` where it was wished.
    ///
    /// # Errors
    /// When it was wished.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}
