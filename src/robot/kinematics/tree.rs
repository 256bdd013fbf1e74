//! A tree of joints, as a hand has it: several chains that leave one base.

use nalgebra::IsometryMatrix3;

use super::group::{InvalidGroup, Joint};

/// A joint and its parent.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeJoint {
    /// The joint; its origin is expressed in the frame of the link that carries it.
    pub joint: Joint,
    /// The link that carries it: 0 is the base, link k is moved by the k-th joint, counted from 1.
    pub carried_by: usize,
}

/// Joints that branch. Link 0 is the base, link k what the k-th joint moves; joint values are in radians and metres, in the
/// tree's order.
#[derive(Clone, Debug, PartialEq)]
pub struct JointTree {
    joints: Vec<TreeJoint>,
}

impl JointTree {
    /// From its joints, each after the one that carries it.
    ///
    /// # Errors
    /// When there is no joint, or one has no range, no limits along an axis it slides on, or a number that is not finite.
    ///
    /// # Panics
    /// When a joint comes before the link that carries it.
    pub fn new(joints: Vec<TreeJoint>) -> Result<Self, InvalidGroup> {
        if joints.is_empty() {
            return Err(InvalidGroup::NoJoint);
        }
        for (index, joint) in joints.iter().enumerate() {
            assert!(joint.carried_by <= index, "joint {:?} comes before its link", joint.joint.name);
            joint.joint.check()?;
        }
        Ok(Self { joints })
    }

    /// The joints, each after the one that carries it.
    pub fn joints(&self) -> &[TreeJoint] {
        &self.joints
    }

    /// Number of joints, which is that of the links that move.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Never: a tree has a joint.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Index of the joint of this name.
    pub fn joint_named(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.joint.name == name)
    }

    /// Forward kinematics: the frames of links 1 to n expressed in the base frame, after the motion.
    ///
    /// # Panics
    /// When `q` or `out` has another length than the tree.
    pub fn link_frames(&self, q: &[f64], out: &mut [IsometryMatrix3<f64>]) {
        assert_eq!((q.len(), out.len()), (self.len(), self.len()), "one value and one frame a joint");
        for (index, (joint, value)) in self.joints.iter().zip(q).enumerate() {
            let moved = joint.joint.origin * joint.joint.motion(*value);
            out[index] = match joint.carried_by {
                0 => moved,
                link => out[link - 1] * moved,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry, Point3, Rotation3, Translation3, Unit, Vector3};

    use super::*;
    use crate::kinematics::{JointKind, JointLimits};

    fn turning(name: &str, along: f64, carried_by: usize) -> TreeJoint {
        let origin = Isometry::from_parts(Translation3::new(along, 0.0, 0.0), Rotation3::identity());
        let limits = Some(JointLimits { low: -3.0, high: 3.0 });
        let axis = Unit::new_unchecked(Vector3::z());
        TreeJoint { joint: Joint { name: name.into(), kind: JointKind::Revolute, origin, axis, limits }, carried_by }
    }

    /// Two planar fingers of two links: by hand.
    #[test]
    fn fingers_turn_apart() {
        let tree = JointTree::new(vec![
            turning("a", 1.0, 0),
            turning("b", 2.0, 1),
            turning("c", -1.0, 0),
            turning("d", 0.5, 3),
        ]);
        let tree = tree.expect("a tree");
        let mut frames = vec![IsometryMatrix3::identity(); 4];
        let quarter = std::f64::consts::FRAC_PI_2;
        tree.link_frames(&[quarter, -quarter, 0.0, quarter], &mut frames);
        let tip = |link: usize| frames[link - 1] * Point3::new(1.0, 0.0, 0.0);
        for (link, expected) in [(1, [1.0, 1.0]), (2, [2.0, 2.0]), (3, [0.0, 0.0]), (4, [-0.5, 1.0])] {
            let found = tip(link);
            assert!((found - Point3::new(expected[0], expected[1], 0.0)).norm() < 1e-15, "link {link}: {found}");
        }
        assert_eq!(tree.joint_named("c"), Some(2));
    }

    #[test]
    fn joints_are_checked() {
        assert_eq!(JointTree::new(Vec::new()), Err(InvalidGroup::NoJoint));
        let mut flat = turning("a", 0.0, 0);
        flat.joint.limits = Some(JointLimits { low: 1.0, high: 1.0 });
        assert!(matches!(JointTree::new(vec![flat]), Err(InvalidGroup::NoRange { .. })));
    }
}
