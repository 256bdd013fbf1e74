//! Reasons why a run stops.

use std::error::Error;

use format::dataset::{BadShard, DatasetError};
use kernel::{cancel::Cancelled, ids::ObjectId, words::number_ranges};
use sim::{HandError, RobotError};

/// Any error of a tool below, boxed: the message is what counts.
pub type Cause = Box<dyn Error + Send + Sync>;

/// A reason why a sample could not be made at all; the run stops.
#[derive(Debug, thiserror::Error)]
pub enum ProduceError {
    /// A mesh or description that was fine when the job was resolved can't be read any more.
    #[error("{0}; it was usable when this run began: restore it and run again")]
    Gone(#[source] Cause),
    /// A mesh or description is another one than when the job was resolved.
    #[error(
        "{name}: changed during the run: content {found:?}, expected {expected:?}; restore it, or run into a new folder"
    )]
    Changed {
        /// Name in the job, or file.
        name: String,
        /// Content now.
        found: ObjectId,
        /// Content when the job was resolved.
        expected: ObjectId,
    },
    /// An object, hand or robot cannot be used as the job requires.
    #[error("{name}: {cause}")]
    Unusable {
        /// Name in the job, or file.
        name: String,
        /// Reason and remedy.
        #[source]
        cause: Cause,
    },
    /// A renderer of the job is not available on this machine.
    #[error("{renderer}: {cause}")]
    NoRenderer {
        /// Name of the renderer.
        renderer: &'static str,
        /// Reason and remedy.
        #[source]
        cause: Cause,
    },
    /// The sample was made and could not be stored.
    #[error(transparent)]
    Store(#[from] DatasetError),
    /// The run was stopped on request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl ProduceError {
    /// Makes [`ProduceError::Gone`] of an error.
    pub fn gone(cause: impl Into<Cause>) -> Self {
        Self::Gone(cause.into())
    }

    /// Whether too little memory was left to compile a robot or a hand.
    fn lacks_memory(&self) -> bool {
        let mut cause: Option<&(dyn Error + 'static)> = Some(self);
        while let Some(error) = cause {
            let of_robot = error.downcast_ref::<RobotError>();
            let of_hand = error.downcast_ref::<HandError>().and_then(|error| match error {
                HandError::Robot(error) => Some(error),
                _ => None,
            });
            if matches!(of_robot.or(of_hand), Some(RobotError::Memory { .. })) {
                return true;
            }
            cause = error.source();
        }
        false
    }

    /// Makes [`ProduceError::Unusable`] of an error about `name`.
    pub fn unusable(name: impl Into<String>, cause: impl Into<Cause>) -> Self {
        Self::Unusable { name: name.into(), cause: cause.into() }
    }
}

/// Reason why a run ended early. Shards that were finished before stay.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The run was stopped on request.
    #[error("interrupted; run the same command again to resume")]
    Interrupted,
    /// The dataset could not be read or written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The job cannot be worked with, as was found when what all samples share was opened, before any was made.
    #[error(transparent)]
    WrongJob(ProduceError),
    /// A sample could not be made.
    #[error(transparent)]
    Produce(ProduceError),
    /// Code of graspmill panicked: a defect.
    #[error(
        "{what}: internal error in graspmill: {message}; finished shards are kept, and the same command resumes; \
         please report this bug with the job file"
    )]
    Panicked {
        /// Object, item or step that was being made.
        what: String,
        /// Text of the panic.
        message: String,
    },
    /// A dataset cannot be closed: shards are missing.
    #[error("{} of {shards} shards are missing: {}{}", missing.len(), number_ranges(missing).join(","), not_whole(bad))]
    Gap {
        /// Which, in order.
        missing: Vec<u32>,
        /// Number of shards in all.
        shards: u32,
        /// Files with the names of shards that are not shards.
        bad: Vec<BadShard>,
    },
    /// The threads could not be started.
    #[error("starting threads: {0}; try fewer with --threads")]
    Threads(String),
}

impl RunError {
    /// The error of opening what all samples share: what is unusable then is a mistake of the job, unless this machine lacks memory.
    pub(crate) fn of_opening(error: Self) -> Self {
        match error {
            Self::Produce(error @ ProduceError::Unusable { .. }) if !error.lacks_memory() => Self::WrongJob(error),
            error => error,
        }
    }
}

impl From<ProduceError> for RunError {
    fn from(error: ProduceError) -> Self {
        match error {
            ProduceError::Cancelled(Cancelled) => Self::Interrupted,
            error => Self::Produce(error),
        }
    }
}

/// Lines about files that are no shards, after the list of missing ones.
fn not_whole(bad: &[BadShard]) -> String {
    bad.iter().map(|bad| format!("\n{bad}")).collect()
}
