//! Simulations that become unstable.

use mujoco_rs::{
    mujoco_c::mjtWarning,
    wrappers::{mj_data::MjData, traits::ModelType},
};

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
    /// A hand deeper in the object than its edges are [rounded](kernel::contact::EDGE_RADIUS): contacts have no direction there.
    Depth,
}

/// The first instability that MuJoCo has counted since its state was reset, if any.
pub(crate) fn instability<M: ModelType>(data: &MjData<M>) -> Option<Instability> {
    let kinds = [
        (mjtWarning::mjWARN_BADQPOS, Instability::Position),
        (mjtWarning::mjWARN_BADQVEL, Instability::Velocity),
        (mjtWarning::mjWARN_BADQACC, Instability::Acceleration),
        (mjtWarning::mjWARN_BADCTRL, Instability::Control),
        (mjtWarning::mjWARN_CONTACTFULL, Instability::Room),
        (mjtWarning::mjWARN_CNSTRFULL, Instability::Room),
        (mjtWarning::mjWARN_INERTIA, Instability::Room),
    ];
    kinds.into_iter().find(|(warning, _)| data.warning()[*warning as usize].number > 0).map(|(_, kind)| kind)
}
