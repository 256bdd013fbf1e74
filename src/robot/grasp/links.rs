//! Where a hand's links are, for many postures a millisecond.

use nalgebra::{Matrix3, Vector3};

use super::{frame::Frame, numbers::sines, unsearchable::UnsearchableHand};
use crate::{hand::Hand, kinematics::JointKind};

/// Most joints of a hand that is annealed.
pub(super) const MAX_JOINTS: usize = 24;

/// A joint with all that does not change worked out.
struct Joint {
    carried_by: usize,
    /// Index of the driven joint that moves it; `ratio` and `offset` give its value from that joint's.
    driven: usize,
    ratio: f64,
    offset: f64,
    revolute: bool,
    /// The rotation is `fixed + cos * with_cos + sin * with_sin` (Rodrigues' formula).
    fixed: Matrix3<f64>,
    with_cos: Matrix3<f64>,
    with_sin: Matrix3<f64>,
    at: Vector3<f64>,
    /// Direction of a slide, in the frame of the link that carries it.
    along: Vector3<f64>,
}

/// A hand's joints and eigengrasps.
pub(super) struct Links {
    joints: Vec<Joint>,
    origin: Vec<f64>,
    directions: Vec<Vec<f64>>,
    ranges: Vec<[f64; 2]>,
}

impl Links {
    pub(super) fn new(hand: &Hand) -> Result<Self, UnsearchableHand> {
        let grasps = hand.eigengrasps().ok_or(UnsearchableHand::NoEigengrasps)?;
        let tree = hand.tree().joints();
        if tree.len() > MAX_JOINTS {
            return Err(UnsearchableHand::TooManyJoints { count: tree.len(), max: MAX_JOINTS });
        }
        // Driven joint, ratio and offset of each joint.
        let mut moved_by = vec![(0, 1.0, 0.0); tree.len()];
        for (index, driven) in hand.driven().iter().enumerate() {
            moved_by[driven.joint] = (index, 1.0, 0.0);
            for follower in &driven.followers {
                moved_by[follower.joint] = (index, follower.ratio, follower.offset);
            }
        }
        let joint = |(index, joint): (usize, &crate::kinematics::TreeJoint)| {
            let (driven, ratio, offset) = moved_by[index];
            let axis = joint.joint.axis.into_inner();
            let rotation = joint.joint.origin.rotation.matrix();
            let revolute = joint.joint.kind != JointKind::Prismatic;
            // Rotation about the axis by an angle (Rodrigues): fixed part, part of the cosine, part of the sine.
            let along_axis = axis * axis.transpose();
            let [fixed, with_cos, with_sin] = if revolute {
                [rotation * along_axis, rotation * (Matrix3::identity() - along_axis), rotation * axis.cross_matrix()]
            } else {
                [*rotation, Matrix3::zeros(), Matrix3::zeros()]
            };
            let (at, along) = (joint.joint.origin.translation.vector, rotation * axis);
            let carried_by = joint.carried_by;
            Joint { carried_by, driven, ratio, offset, revolute, fixed, with_cos, with_sin, at, along }
        };
        Ok(Self {
            joints: tree.iter().enumerate().map(joint).collect(),
            origin: grasps.origin.clone(),
            directions: grasps.directions.clone(),
            ranges: hand.driven().iter().map(crate::hand::Driven::range).collect(),
        })
    }

    /// Links, the base among them.
    pub(super) fn count(&self) -> usize {
        self.joints.len() + 1
    }

    /// Values of all joints for amplitudes; the rest of the array stays.
    #[inline(always)]
    pub(super) fn values(&self, amplitudes: &[f64], values: &mut [f64; MAX_JOINTS]) {
        let mut driven = [0.0; MAX_JOINTS];
        for (index, value) in driven.iter_mut().enumerate().take(self.origin.len()) {
            let mut sum = self.origin[index];
            for (amplitude, direction) in amplitudes.iter().zip(&self.directions) {
                sum += amplitude * direction[index];
            }
            let [low, high] = self.ranges[index];
            *value = sum.max(low).min(high);
        }
        for (value, joint) in values.iter_mut().zip(&self.joints) {
            *value = joint.offset + joint.ratio * driven[joint.driven];
        }
    }

    /// Poses of all links at values of all joints, expressed in the frame in which the base is at `base`.
    #[inline(always)]
    pub(super) fn link_frames(&self, base: &Frame, values: &[f64; MAX_JOINTS], frames: &mut [Frame]) {
        frames[0] = *base;
        for (chunk, joints) in self.joints.chunks(8).enumerate() {
            let angles: &[f64; 8] = values[8 * chunk..8 * chunk + 8].try_into().expect("a multiple of eight");
            let [sin, cos] = sines(angles);
            for (lane, joint) in joints.iter().enumerate() {
                let own = if joint.revolute {
                    let rotation = joint.fixed + joint.with_cos * cos[lane] + joint.with_sin * sin[lane];
                    Frame { rotation, origin: joint.at }
                } else {
                    Frame { rotation: joint.fixed, origin: joint.at + joint.along * angles[lane] }
                };
                frames[8 * chunk + lane + 1] = frames[joint.carried_by].times(&own);
            }
        }
    }
}
