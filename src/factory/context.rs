//! Context of a run: threads, the wish to stop, and the listener.

use super::{Cancel, Listener, RunError};
use kernel::geom::SimdLevel;

/// Stack of a worker [bytes], independent of `ulimit -s` and RUST_MIN_STACK.
const STACK_BYTES: usize = 4 << 20;

/// Threads and vector instructions of a run; they change no byte.
#[derive(Clone, Copy, Debug)]
pub struct Parallelism {
    /// Threads, at least 1.
    pub threads: usize,
    /// Vector instructions.
    pub level: SimdLevel,
}

impl Parallelism {
    /// All processors of this machine, with the best vector instructions that it has.
    pub fn available() -> Self {
        let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        Self { threads, level: SimdLevel::detect() }
    }

    /// A pool of these threads.
    ///
    /// # Errors
    /// When the threads cannot be started.
    pub fn pool(&self) -> Result<rayon::ThreadPool, RunError> {
        rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .thread_name(|number| format!("worker-{number}"))
            .stack_size(STACK_BYTES)
            .build()
            .map_err(|error| RunError::Threads(error.to_string()))
    }
}

/// Context of a run: threads, the wish to stop, and the listener.
#[derive(Clone, Copy)]
pub struct RunContext<'a> {
    /// Threads.
    pub parallelism: &'a Parallelism,
    /// Wish to stop.
    pub cancel: &'a Cancel,
    /// Receiver of progress.
    pub listener: &'a Listener<'a>,
}

impl<'a> RunContext<'a> {
    /// A context without a listener, whose run is never stopped.
    pub fn quiet(parallelism: &'a Parallelism) -> Self {
        static NEVER: Cancel = Cancel::new();
        Self { parallelism, cancel: &NEVER, listener: &|_| {} }
    }
}
