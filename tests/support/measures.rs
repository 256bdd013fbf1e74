//! Figures about figures: medians and times.

use super::files::read_text;

/// The upper one of two middle values; NaN for an empty list.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Processor time of this thread so far [s]; the load of other programs is not in it.
pub fn thread_seconds() -> f64 {
    let text = read_text("/proc/thread-self/schedstat");
    text.split(' ').next().and_then(|nanoseconds| nanoseconds.parse::<f64>().ok()).expect("nanoseconds") * 1e-9
}
