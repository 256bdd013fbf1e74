//! Parts of a trial.

/// A part of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// The hand closes, without gravity unless the object rests on a table.
    Closing,
    /// The hand lifts.
    Lift,
    /// The hand shakes.
    Shake,
    /// Gravity pulls along one of six directions, counted from 0.
    Turned(u8),
}
