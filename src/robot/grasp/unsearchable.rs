//! Reasons why a hand cannot be annealed.

/// Reason why a hand cannot be annealed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnsearchableHand {
    /// Postures are searched in the space of eigengrasps.
    #[error("it has no eigengrasps: give its table `[eigengrasps]`")]
    NoEigengrasps,
    /// More of them than a state has room for.
    #[error("it has {count} eigengrasps, more than {max}: give its table fewer")]
    TooManyEigengrasps {
        /// Count that was found.
        count: usize,
        /// Largest count that there is room for.
        max: usize,
    },
    /// More joints than there is room for.
    #[error("it has {count} joints, more than {max}")]
    TooManyJoints {
        /// Count that was found.
        count: usize,
        /// Largest count that there is room for.
        max: usize,
    },
    /// The approach frame must be fixed to the base.
    #[error("its approach frame moves with a joint: put it on the base")]
    MovingApproach,
    /// More shapes than there is room for.
    #[error("it has {count} shapes that can touch, more than {max}: put one in the place of several")]
    TooManyShapes {
        /// Count that was found.
        count: usize,
        /// Largest count that there is room for.
        max: usize,
    },
    /// A part of it is a mesh.
    #[error("a shape of {body} is a mesh: put boxes, balls, capsules or cylinders in its place")]
    Mesh {
        /// Name of the body.
        body: String,
    },
}
