//! Processor time, by which estimates count: it does not depend on what else the machine does.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Processor time of the calling thread since it began.
pub fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec as u32)
}

/// A result, and the processor time of the calling thread that it took [s].
pub fn timed<T>(make: impl FnOnce() -> T) -> (T, f64) {
    let began = processor_time();
    let made = make();
    (made, (processor_time() - began).as_secs_f64())
}
