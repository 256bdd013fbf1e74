//! Results of settling.

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use crate::physics::Instability;

/// Reason why a scene is no scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Fault {
    /// Bodies still moved at the end of the time.
    NeverRested {
        /// The largest speed [m/s].
        speed: f64,
    },
    /// Two bodies, or a body and the container, overlap by too much.
    TooDeep {
        /// Indices of the bodies; `None` for the container.
        pair: [Option<usize>; 2],
        /// The depth [m].
        depth: f64,
    },
    /// An edge of one body goes through the other.
    Crossed {
        /// Indices of the bodies; `None` for the container.
        pair: [Option<usize>; 2],
    },
    /// Too many bodies left the container.
    Gone {
        /// Their indices.
        bodies: Vec<usize>,
    },
    /// Stepped from the stored poses, a body moved.
    Moved {
        /// Index of the body that moved most.
        body: usize,
        /// Motion of its centre of mass [m].
        drift: f64,
        /// Rotation of that body [rad].
        turn: f64,
    },
    /// MuJoCo's numbers blew up.
    Unstable(Instability),
}

/// A body of a settled scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SettledBody {
    /// Index of the body among those that were given.
    pub index: usize,
    /// Pose of the body.
    pub world_from_object: IsometryMatrix3<f64>,
    /// Time of its release [s].
    pub released_at: f64,
    /// Motion of its centre of mass in the check [m].
    pub drift: f64,
    /// Rotation of the body in the check [rad].
    pub turn: f64,
}

impl SettledBody {
    /// A body at a pose, not stepped again yet.
    pub(super) fn at(index: usize, world_from_object: IsometryMatrix3<f64>, released_at: f64) -> Self {
        Self { index, world_from_object, released_at, drift: 0.0, turn: 0.0 }
    }
}

/// A point at which two bodies of a scene touch.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneTouch {
    /// Positions of the bodies in [`SettleOutcome::bodies`], the first below the second; `None` for the container, which comes
    /// first.
    pub pair: [Option<usize>; 2],
    /// Half way between the two surfaces, in the world [m].
    pub point: Point3<f64>,
    /// Out of the first, in the world.
    pub normal: Vector3<f64>,
    /// [m], negative where they overlap.
    pub distance: f64,
    /// Force of the first on the second, in the world [N].
    pub force: Vector3<f64>,
    /// Torque of the first on the second about the point, by torsion and rolling friction, in the world [N m].
    pub torque: Vector3<f64>,
}

/// Result of settling a scene. A scene with a fault has numbers as far as it got.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SettleOutcome {
    /// Why it is not a scene, if it is not one.
    pub fault: Option<Fault>,
    /// The bodies that stayed, in the order of their first release.
    pub bodies: Vec<SettledBody>,
    /// Indices of the bodies that left the container.
    pub gone: Vec<usize>,
    /// Time from the last release to rest [s].
    pub rest_time: f64,
    /// Steps until rest.
    pub steps: u32,
    /// Largest speed at rest [m/s].
    pub top_speed: f64,
    /// Largest depth between two bodies, and between a body and the container [m].
    pub depths: [f64; 2],
    /// Pairs of bodies, or of a body and the container, that go through each other; 0 of a scene without a fault.
    pub crossed: u32,
    /// The contacts at the stored poses.
    pub touches: Vec<SceneTouch>,
}

impl SettleOutcome {
    /// Keeps the bodies that stayed, and the indices of those that left.
    ///
    /// # Errors
    /// If fewer than the required number stayed, or none.
    pub(super) fn keep(
        &mut self,
        bodies: Vec<SettledBody>,
        gone: impl IntoIterator<Item = usize>,
        min: usize,
    ) -> Result<(), Fault> {
        self.bodies = bodies;
        self.gone.extend(gone);
        self.gone.sort_unstable();
        if self.bodies.len() < min.max(1) {
            return Err(Fault::Gone { bodies: self.gone.clone() });
        }
        Ok(())
    }

    /// The largest motion [m] and rotation [rad] of a body in the check.
    pub fn drift(&self) -> [f64; 2] {
        let of = |value: fn(&SettledBody) -> f64| self.bodies.iter().map(value).fold(0.0, f64::max);
        [of(|body| body.drift), of(|body| body.turn)]
    }
}
