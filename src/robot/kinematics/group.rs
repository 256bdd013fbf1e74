//! A planning group: the joints between the world and an end effector, and where the end effector is.

use nalgebra::{IsometryMatrix3, Matrix6xX, Rotation3, Translation3, Unit, Vector3, Vector6};

use kernel::geom::{EndEffector, Pose, World};

/// Kind of a joint's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// About its axis [rad].
    Revolute,
    /// Along its axis [m].
    Prismatic,
}

/// Range of a joint [rad or m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
}

/// One joint of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name in the robot's description.
    pub name: String,
    /// Kind of motion.
    pub kind: JointKind,
    /// The joint's frame at value 0, expressed in the frame that the joint before it moves; its axis goes through the origin.
    pub origin: IsometryMatrix3<f64>,
    /// Direction in the joint's frame.
    pub axis: Unit<Vector3<f64>>,
    /// `None` for a continuous joint.
    pub limits: Option<JointLimits>,
}

impl Joint {
    /// Whether the joint can be used: finite numbers, and a range where it has limits or slides.
    pub(super) fn check(&self) -> Result<(), InvalidGroup> {
        let name = || self.name.clone();
        let origin = self.origin.translation.vector.iter().chain(self.origin.rotation.matrix().iter());
        let limits = self.limits.iter().flat_map(|limits| [limits.low, limits.high]);
        if !origin.chain(self.axis.iter()).copied().chain(limits).all(f64::is_finite) {
            return Err(InvalidGroup::NotFinite { name: name() });
        }
        match self.limits {
            Some(JointLimits { low, high }) if low >= high => Err(InvalidGroup::NoRange { name: name(), low, high }),
            None if self.kind == JointKind::Prismatic => Err(InvalidGroup::Endless { name: name() }),
            _ => Ok(()),
        }
    }

    /// The motion of this joint at a value, in the joint's frame.
    pub fn motion(&self, value: f64) -> IsometryMatrix3<f64> {
        match self.kind {
            JointKind::Revolute => {
                IsometryMatrix3::from_parts(Translation3::identity(), rotation_about(&self.axis, value))
            }
            JointKind::Prismatic => {
                IsometryMatrix3::from_parts(Translation3::from(self.axis.into_inner() * value), Rotation3::identity())
            }
        }
    }
}

/// Rodrigues' formula with `libm`: the same bits everywhere.
pub(super) fn rotation_about(axis: &Vector3<f64>, angle: f64) -> Rotation3<f64> {
    let (sin, cos) = libm::sincos(angle);
    let cross = axis.cross_matrix();
    Rotation3::from_matrix_unchecked(nalgebra::Matrix3::identity() + cross * sin + cross * cross * (1.0 - cos))
}

/// Parts of a planning group.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanningGroupParts {
    /// From the world outward.
    pub joints: Vec<Joint>,
    /// The end effector's frame, expressed in the frame that the last joint moves.
    pub end_effector: IsometryMatrix3<f64>,
}

/// Why parts make no planning group.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidGroup {
    /// Nothing moves.
    #[error("a planning group needs a joint")]
    NoJoint,
    /// A joint's lowest value is not below its highest.
    #[error("joint {name:?}: limits {low} to {high} leave no range; give it range=\"LOW HIGH\"")]
    NoRange {
        /// The joint.
        name: String,
        /// Lowest value.
        low: f64,
        /// Highest value.
        high: f64,
    },
    /// A prismatic joint may not be endless.
    #[error("joint {name:?} slides without limits; give it range=\"LOW HIGH\"")]
    Endless {
        /// The joint.
        name: String,
    },
    /// A number is NaN or infinite.
    #[error("joint {name:?} has a number that is not finite")]
    NotFinite {
        /// The joint.
        name: String,
    },
}

/// A chain of joints from the world to an end effector. Joint values are in radians and metres, in the group's order.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanningGroup {
    parts: PlanningGroupParts,
}

impl PlanningGroup {
    /// From its parts.
    ///
    /// # Errors
    /// When there is no joint, or one has no range, no limits along an axis it slides on, or a number that is not finite.
    pub fn new(parts: PlanningGroupParts) -> Result<Self, InvalidGroup> {
        if parts.joints.is_empty() {
            return Err(InvalidGroup::NoJoint);
        }
        parts.joints.iter().try_for_each(Joint::check)?;
        Ok(Self { parts })
    }

    /// Expresses the arm in another fixed frame; that frame becomes the world.
    #[must_use]
    pub fn seen_from(mut self, world_from_frame: &IsometryMatrix3<f64>) -> Self {
        let first = &mut self.parts.joints[0].origin;
        *first = world_from_frame.inverse() * *first;
        self
    }

    /// The joints from the world outward.
    pub fn joints(&self) -> &[Joint] {
        &self.parts.joints
    }

    /// The end effector's frame, expressed in the frame that the last joint moves.
    pub fn end_effector(&self) -> &IsometryMatrix3<f64> {
        &self.parts.end_effector
    }

    /// Number of joints.
    pub fn len(&self) -> usize {
        self.parts.joints.len()
    }

    /// Never: a group has a joint.
    pub fn is_empty(&self) -> bool {
        self.parts.joints.is_empty()
    }

    /// Whether every value lies within its joint's limits.
    ///
    /// # Panics
    /// When `q` has another length than the group.
    pub fn within_limits(&self, q: &[f64]) -> bool {
        assert_eq!(q.len(), self.len(), "one value a joint");
        self.joints()
            .iter()
            .zip(q)
            .all(|(joint, value)| joint.limits.is_none_or(|limits| (limits.low..=limits.high).contains(value)))
    }

    /// Forward kinematics: where the end effector is at joint values `q`.
    ///
    /// # Panics
    /// When `q` has another length than the group.
    pub fn forward(&self, q: &[f64]) -> Pose<World, EndEffector> {
        assert_eq!(q.len(), self.len(), "one value a joint");
        let moved = self.joints().iter().zip(q);
        let last = moved
            .fold(IsometryMatrix3::identity(), |frame, (joint, value)| frame * joint.origin * joint.motion(*value));
        Pose::from_isometry(last * self.parts.end_effector)
    }

    /// Poses of the links: the world poses of the frames that joints 1 to n move, after the motion.
    ///
    /// # Panics
    /// When `q` or `out` has another length than the group.
    pub fn link_frames(&self, q: &[f64], out: &mut [IsometryMatrix3<f64>]) {
        assert_eq!((q.len(), out.len()), (self.len(), self.len()), "one value and one frame a joint");
        let mut frame = IsometryMatrix3::identity();
        for ((joint, value), out) in self.joints().iter().zip(q).zip(out) {
            frame = frame * joint.origin * joint.motion(*value);
            *out = frame;
        }
    }

    /// Forward kinematics and the geometric Jacobian, shape (6, joints): how the end effector's origin moves [m] (rows 0
    /// to 2) and how it rotates [rad] (rows 3 to 5) per unit of each joint, both in world axes.
    ///
    /// # Panics
    /// When `q` has another length than the group.
    pub fn forward_and_jacobian(&self, q: &[f64]) -> (Pose<World, EndEffector>, Matrix6xX<f64>) {
        let mut columns = vec![Vector6::zeros(); self.len()];
        let pose = self.forward_and_columns(q, &mut columns);
        (pose, Matrix6xX::from_columns(&columns))
    }

    /// [`PlanningGroup::forward_and_jacobian`] without taking memory: the Jacobian column by column.
    ///
    /// # Panics
    /// When `q` or `columns` has another length than the group.
    pub fn forward_and_columns(&self, q: &[f64], columns: &mut [Vector6<f64>]) -> Pose<World, EndEffector> {
        assert_eq!((q.len(), columns.len()), (self.len(), self.len()), "one value and one column a joint");
        let mut frame = IsometryMatrix3::identity();
        for ((joint, value), column) in self.joints().iter().zip(q).zip(columns.iter_mut()) {
            frame *= joint.origin;
            let (axis, through) = (frame.rotation * joint.axis.into_inner(), frame.translation.vector);
            column.fixed_rows_mut::<3>(0).copy_from(&through);
            column.fixed_rows_mut::<3>(3).copy_from(&axis);
            frame *= joint.motion(*value);
        }
        let end = frame * self.parts.end_effector;
        for (joint, column) in self.joints().iter().zip(columns) {
            let (through, axis) = (column.fixed_rows::<3>(0).into_owned(), column.fixed_rows::<3>(3).into_owned());
            let (moves, rotates) = match joint.kind {
                JointKind::Revolute => (axis.cross(&(end.translation.vector - through)), axis),
                JointKind::Prismatic => (axis, Vector3::zeros()),
            };
            column.fixed_rows_mut::<3>(0).copy_from(&moves);
            column.fixed_rows_mut::<3>(3).copy_from(&rotates);
        }
        Pose::from_isometry(end)
    }
}
