//! Numbers that every simulation shares, and simulations that become unstable.

mod unstable;

use mujoco_rs::{mujoco_c::mjtCone, wrappers::mj_option::MjOption};

pub(crate) use unstable::instability;
pub use unstable::{Instability, Unstable};

/// Length of a step [s]. Half of it and a tenth of the labels of grasps stay the same: it is part of the method.
pub(crate) const STEP: f64 = 0.002;

/// [m/s^2].
pub(crate) const GRAVITY: f64 = 9.81;

/// Contacts [s, ratio]: as hard as two steps allow. A fingertip sinks in by 0.2 mm.
pub(crate) const CONTACT_SOLREF: [f64; 2] = [0.004, 1.0];
pub(crate) const CONTACT_SOLIMP: [f64; 5] = [0.95, 0.995, 0.0005, 0.5, 2.0];

/// Settings of the simulation of a hand and its object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Numerics {
    /// Steps of 2 ms, elliptic friction cones, `impratio` 10, 5 iterations against slip: the settings that hold most grasps with
    /// least penetration.
    #[default]
    Standard,
    /// The standard settings with steps of 1 ms.
    HalfStep,
    /// Elliptic friction cones, `impratio` 1, no iterations against slip.
    PlainElliptic,
    /// Pyramidal friction cones, `impratio` 1, no iterations against slip, as MuJoCo has them by default.
    MujocoDefaults,
}

impl Numerics {
    /// Steps of MuJoCo in 2 ms.
    pub(crate) fn substeps(self) -> u32 {
        if self == Self::HalfStep { 2 } else { 1 }
    }

    /// Writes the settings into MuJoCo's options.
    pub(crate) fn set(self, option: &mut MjOption) {
        let (cone, impratio, noslip) = match self {
            Self::Standard | Self::HalfStep => (mjtCone::mjCONE_ELLIPTIC, 10.0, 5),
            Self::PlainElliptic => (mjtCone::mjCONE_ELLIPTIC, 1.0, 0),
            Self::MujocoDefaults => (mjtCone::mjCONE_PYRAMIDAL, 1.0, 0),
        };
        option.timestep = STEP / f64::from(self.substeps());
        (option.cone, option.impratio, option.noslip_iterations) = (cone as i32, impratio, noslip);
    }
}
