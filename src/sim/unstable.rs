//! Simulations whose numbers blow up.

/// The simulation became unstable: nothing after this step counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unstable in step {step}: {kind:?}")]
pub struct Unstable {
    /// The step, counted from 1 at the start of the run.
    pub step: u32,
    /// Instability that MuJoCo found.
    pub kind: Instability,
}

/// Quantity that became invalid inside a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Instability {
    /// A position that is not finite or absurdly large.
    Position,
    /// A velocity.
    Velocity,
    /// An acceleration.
    Acceleration,
    /// A control.
    Control,
    /// No room for all contacts or constraints, or an inertia without inverse.
    Room,
}
