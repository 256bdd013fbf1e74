//! A hand: joints, motors, contacts, approach frame, eigengrasps.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, IsometryMatrix3, Point3, Unit, Vector3};

use super::{Driven, Motor};
use crate::kinematics::{JointKind, JointTree, TreeJoint};
use kernel::geom::{Approach, HandBase, Pose};

/// Two directions are opposite when their sum is shorter than this share of one.
const OPPOSED: f64 = 1e-9;

/// Steps from the opened to the closed hand in which it is looked for how far ahead it reaches, and the gain that counts [m].
const SHARES: u32 = 64;
const SAME_REACH: f64 = 1e-6;

/// A frame that a link carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// The link: 0 is the base, link k what the k-th joint moves, counted from 1.
    pub link: usize,
    /// The frame, expressed in the link's.
    pub link_from_frame: IsometryMatrix3<f64>,
}

/// A joint that a description couples to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// The joint that follows; indices in the tree of joints.
    pub joint: usize,
    /// The joint that it follows.
    pub follows: usize,
    /// Travel per unit of the other joint.
    pub ratio: f64,
    /// Value where the other joint is at 0 [rad or m].
    pub offset: f64,
}

/// Content of a description before its table has been read: shapes and joints, but not what drives them.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    /// The name that the description gives itself.
    pub name: String,
    /// Every hinge and slide.
    pub tree: JointTree,
    /// Names of links 0 to n: the body that each joint moves, and of the base the first body.
    pub links: Vec<String>,
    /// Joints that follow others.
    pub couplings: Vec<Coupling>,
    /// Named sites.
    pub sites: BTreeMap<String, Mount>,
    /// Named bodies.
    pub bodies: BTreeMap<String, Mount>,
}

/// A point on the hand that may touch: a virtual contact, on the surface of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPoint {
    /// Name of the contact.
    pub name: String,
    /// The link that carries it, as in [`Mount`].
    pub link: usize,
    /// Where, expressed in the link's frame [m].
    pub point: Point3<f64>,
    /// Out of the link, towards what the hand holds, expressed in the link's frame.
    pub normal: Unit<Vector3<f64>>,
}

/// A space of few numbers in which postures are searched (Ciocarlie and Allen 2009): `origin + sum of amplitude * direction`.
#[derive(Clone, Debug, PartialEq)]
pub struct Eigengrasps {
    /// A posture, one value per driven joint.
    pub origin: Vec<f64>,
    /// Directions, each with one value per driven joint; not of unit length.
    pub directions: Vec<Vec<f64>>,
}

/// Parts of a hand.
#[derive(Clone, Debug, PartialEq)]
pub struct HandParts {
    /// Name of the hand.
    pub name: String,
    /// Tree of joints.
    pub tree: JointTree,
    /// Names of links 0 to n.
    pub links: Vec<String>,
    /// The joints with motors, in the table's order: a posture has one value for each.
    pub driven: Vec<Driven>,
    /// Origin on the palm, z towards what the hand grasps.
    pub approach: Mount,
    /// Where it may touch.
    pub contacts: Vec<ContactPoint>,
    /// The two contacts whose distance is the hand's width, where that means something.
    pub width: Option<[usize; 2]>,
    /// Eigengrasps, where the hand has some.
    pub eigengrasps: Option<Eigengrasps>,
}

/// A hand's description, checked: every joint is driven or follows one that is.
#[derive(Clone, Debug, PartialEq)]
pub struct Hand {
    parts: HandParts,
}

impl Hand {
    /// From parts that fit.
    ///
    /// # Panics
    /// If a joint is moved by no motor or by two, an index is out of range, or the length of a list differs from the
    /// number of driven joints. The table's reader reports these errors with their location.
    pub fn new(parts: HandParts) -> Self {
        let joints = parts.tree.len();
        let mut moved = vec![0; joints];
        for driven in &parts.driven {
            moved[driven.joint] += 1;
            driven.followers.iter().for_each(|follower| moved[follower.joint] += 1);
            assert!(driven.breakaway.is_none_or(|breakaway| breakaway.follower < driven.followers.len()));
        }
        assert!(moved.iter().all(|motors| *motors == 1), "each joint is moved by one motor: {moved:?}");
        assert_eq!(parts.links.len(), joints + 1, "one name a link");
        assert!(parts.approach.link <= joints && parts.contacts.iter().all(|contact| contact.link <= joints));
        assert!(parts.width.iter().flatten().all(|contact| *contact < parts.contacts.len()));
        for list in parts.eigengrasps.iter().flat_map(|grasps| grasps.directions.iter().chain([&grasps.origin])) {
            assert_eq!(list.len(), parts.driven.len(), "one value a driven joint");
        }
        Self { parts }
    }

    /// Name of the hand.
    pub fn name(&self) -> &str {
        &self.parts.name
    }

    /// Tree of joints.
    pub fn tree(&self) -> &JointTree {
        &self.parts.tree
    }

    /// Names of links 0 (the base) to n.
    pub fn links(&self) -> &[String] {
        &self.parts.links
    }

    /// The joints with motors: a posture has one value for each, in this order.
    pub fn driven(&self) -> &[Driven] {
        &self.parts.driven
    }

    /// Where it may touch.
    pub fn contacts(&self) -> &[ContactPoint] {
        &self.parts.contacts
    }

    /// Eigengrasps, where the hand has some.
    pub fn eigengrasps(&self) -> Option<&Eigengrasps> {
        self.parts.eigengrasps.as_ref()
    }

    /// The frame in which a grasp is stated.
    pub fn approach(&self) -> &Mount {
        &self.parts.approach
    }

    /// The posture of the opened hand.
    pub fn opened(&self) -> Vec<f64> {
        self.driven().iter().map(|driven| driven.opened).collect()
    }

    /// The posture of the closed hand; joints that do not close it are as in the opened one.
    pub fn closed(&self) -> Vec<f64> {
        self.driven().iter().map(|driven| driven.closed.unwrap_or(driven.opened)).collect()
    }

    /// The posture in which the joints that close the hand have gone a share of their way, from 0, opened, to 1, closed.
    pub fn partly_closed(&self, share: f64) -> Vec<f64> {
        let value = |driven: &Driven| driven.opened + share * (driven.closed.unwrap_or(driven.opened) - driven.opened);
        self.driven().iter().map(value).collect()
    }

    /// Share of its way at which the closing hand reaches farthest ahead with one of its contacts, along the z axis of the
    /// approach frame; the first of equals.
    pub fn foremost_share(&self) -> f64 {
        let ahead = |share: f64| {
            let frames = self.link_frames(&self.posture_values(&self.partly_closed(share)));
            let base_from_approach = *self.approach_pose(&frames).isometry();
            let ahead =
                |contact| base_from_approach.inverse_transform_point(&self.contact_in_base(contact, &frames).0).z;
            (0..self.contacts().len()).map(ahead).fold(f64::NEG_INFINITY, f64::max)
        };
        let shares = (0..=SHARES).map(|step| f64::from(step) / f64::from(SHARES));
        let farthest = |best: (f64, f64), share: f64| {
            let ahead = ahead(share);
            if ahead > best.1 + SAME_REACH { (share, ahead) } else { best }
        };
        shares.fold((0.0, f64::NEG_INFINITY), farthest).0
    }

    /// Whether a motor moves each link, the base first.
    pub fn links_moved(&self, driven: &Driven) -> Vec<bool> {
        let mut moved = vec![false];
        for (joint, TreeJoint { carried_by, .. }) in self.tree().joints().iter().enumerate() {
            let own = driven.joint == joint || driven.followers.iter().any(|follower| follower.joint == joint);
            moved.push(own || moved[*carried_by]);
        }
        moved
    }

    /// Force that the hand bears at a fingertip [N]: the smallest over its closing motors of the load that the last
    /// joint of each bears, on the lever of the farthest contact beyond that joint; `None` for a hand without such a
    /// contact.
    pub fn fingertip_force(&self) -> Option<f64> {
        let closing = self.driven().iter().filter(|driven| driven.closing_sign() != 0.0);
        closing.filter_map(|driven| self.tip_force(driven)).min_by(f64::total_cmp)
    }

    fn tip_force(&self, driven: &Driven) -> Option<f64> {
        // The last joint: the one that an open clutch moves, else the driven one.
        let (last, holds) = driven.breakaway.map_or((driven.joint, driven.holding_torque), |breakaway| {
            (driven.followers[breakaway.follower].joint, breakaway.holding_torque)
        });
        let joint = &self.tree().joints()[last].joint;
        let frames = self.link_frames(&self.posture_values(&self.opened()));
        let beyond = |link: usize| {
            let mut link = link;
            while link > last + 1 {
                link = self.tree().joints()[link - 1].carried_by;
            }
            link == last + 1
        };
        let contacts = self.contacts().iter().enumerate().filter(|(_, contact)| beyond(contact.link));
        let lever = |(index, _): (usize, &ContactPoint)| {
            let point = frames[last].inverse_transform_point(&self.contact_in_base(index, &frames).0).coords;
            match joint.kind {
                JointKind::Prismatic => 1.0,
                _ => (point - joint.axis.into_inner() * point.dot(&joint.axis)).norm(),
            }
        };
        contacts.map(lever).max_by(f64::total_cmp).filter(|lever| *lever > 0.0).map(|lever| holds / lever)
    }

    /// The joints whose values define the hand's state, in the order of records: the driven ones, then followers that a
    /// clutch releases. Indices in the tree.
    pub fn commanded_joints(&self) -> Vec<usize> {
        let alone = self.driven().iter().filter_map(|driven| Some(driven.followers[driven.breakaway?.follower].joint));
        self.driven().iter().map(|driven| driven.joint).chain(alone).collect()
    }

    /// Values of all joints [rad or m], in the tree's order, from the motors.
    ///
    /// # Panics
    /// When `motors` or `out` has another length than the driven joints or the tree.
    pub fn joint_values(&self, motors: &[Motor], out: &mut [f64]) {
        assert_eq!((motors.len(), out.len()), (self.driven().len(), self.tree().len()), "one motor a driven joint");
        for (driven, motor) in self.driven().iter().zip(motors) {
            out[driven.joint] = driven.value(*motor);
            for (index, follower) in driven.followers.iter().enumerate() {
                out[follower.joint] = driven.follower_value(index, *motor);
            }
        }
    }

    /// The posture in which the hand approaches before it takes another one: opened, except for joints that shape the
    /// hand.
    ///
    /// # Panics
    /// When the posture has another length than the driven joints.
    pub fn opening(&self, posture: &[f64]) -> Vec<f64> {
        assert_eq!(posture.len(), self.driven().len(), "one value a driven joint");
        let of = |(driven, value): (&Driven, &f64)| if driven.closed.is_some() { driven.opened } else { *value };
        self.driven().iter().zip(posture).map(of).collect()
    }

    /// Values of all joints [rad or m] in a posture, every clutch engaged.
    ///
    /// # Panics
    /// When the posture has another length than the driven joints.
    pub fn posture_values(&self, posture: &[f64]) -> Vec<f64> {
        let motors: Vec<Motor> = posture.iter().copied().map(Motor::engaged).collect();
        let mut values = vec![0.0; self.tree().len()];
        self.joint_values(&motors, &mut values);
        values
    }

    /// The frames of links 1 to n, expressed in the base frame, at values of all joints.
    ///
    /// # Panics
    /// When there is not one value per joint.
    pub fn link_frames(&self, values: &[f64]) -> Vec<IsometryMatrix3<f64>> {
        let mut frames = vec![IsometryMatrix3::identity(); self.tree().len()];
        self.tree().link_frames(values, &mut frames);
        frames
    }

    /// A frame that a link carries, expressed in the base frame; `frames` as [`Hand::link_frames`] has them.
    pub fn base_from(&self, mount: &Mount, frames: &[IsometryMatrix3<f64>]) -> IsometryMatrix3<f64> {
        base_from_link(mount.link, frames) * mount.link_from_frame
    }

    /// The approach frame expressed in the base frame.
    pub fn approach_pose(&self, frames: &[IsometryMatrix3<f64>]) -> Pose<HandBase, Approach> {
        Pose::from_isometry(self.base_from(&self.parts.approach, frames))
    }

    /// Direction of the approach, expressed in the base frame; `frames` as [`Hand::link_frames`] has them.
    pub fn approach_direction(&self, frames: &[IsometryMatrix3<f64>]) -> Vector3<f64> {
        self.approach_pose(frames).isometry().rotation * Vector3::z()
    }

    /// Position and outward direction of a contact, expressed in the base frame [m].
    ///
    /// # Panics
    /// When there is no such contact.
    pub fn contact_in_base(
        &self,
        contact: usize,
        frames: &[IsometryMatrix3<f64>],
    ) -> (Point3<f64>, Unit<Vector3<f64>>) {
        let ContactPoint { link, point, normal, .. } = &self.contacts()[contact];
        let base_from_link = base_from_link(*link, frames);
        (base_from_link * point, base_from_link * normal)
    }

    /// The two contacts whose distance is the width, where that means something.
    pub fn pads(&self) -> Option<[usize; 2]> {
        self.parts.width
    }

    /// The free width between the hand's two pads [m]: how far the second lies before the first. `None` where a width means
    /// nothing.
    pub fn width(&self, frames: &[IsometryMatrix3<f64>]) -> Option<f64> {
        let [first, second] = self.parts.width?.map(|contact| self.contact_in_base(contact, frames));
        Some((second.0 - first.0).dot(&first.1))
    }

    /// Motion of the first pad per unit of the motor that closes a gripper, expressed in the base frame: the other goes
    /// as far in the opposite direction. Of a hand with a width whose two pads slide towards each other, carried by nothing
    /// else that moves, both by the only motor that closes it, and with no link that it moves in another direction; `None` of
    /// every other.
    pub fn closing_line(&self) -> Option<Vector3<f64>> {
        let pads = self.parts.width?.map(|contact| self.contacts()[contact].link);
        let line = self.slid(pads[0])?;
        let opposed = |link: usize, with: f64| {
            let off = |direction: Vector3<f64>| (direction - line * with).norm();
            self.slid(link).is_some_and(|direction| off(direction) < OPPOSED * line.norm())
        };
        let one_of_them = |link: usize| [1.0, 0.0, -1.0].iter().any(|with| opposed(link, *with));
        let links = 0..self.links().len();
        (line != Vector3::zeros() && opposed(pads[1], -1.0) && links.into_iter().all(one_of_them)).then_some(line)
    }

    /// Side of a link of a hand with a [`Hand::closing_line`]: 1 where it goes along it while the hand closes, -1
    /// against it, else 0.
    pub fn closing_side(&self, link: usize) -> f64 {
        let along = |line: Vector3<f64>| Some(self.slid(link)?.dot(&line) / line.norm_squared());
        self.closing_line().and_then(along).map_or(0.0, f64::round)
    }

    /// Motion of a link per unit of the only motor that closes the hand, expressed in the base frame, for a link on
    /// slides of that motor alone.
    fn slid(&self, link: usize) -> Option<Vector3<f64>> {
        let mut closing = self.driven().iter().filter(|driven| driven.closing_sign() != 0.0);
        let (Some(driven), None) = (closing.next(), closing.next()) else { return None };
        let mut direction = Vector3::zeros();
        let mut link = link;
        while link > 0 {
            let TreeJoint { joint, carried_by } = &self.tree().joints()[link - 1];
            let follower = driven.followers.iter().find(|follower| follower.joint == link - 1);
            let rate = if driven.joint == link - 1 { 1.0 } else { follower?.ratio };
            if joint.kind != JointKind::Prismatic {
                return None;
            }
            // What carries it only slides: its frame is rotated as its origin is.
            direction = joint.origin.rotation * (direction + joint.axis.into_inner() * (rate * driven.closing_sign()));
            link = *carried_by;
        }
        Some(direction)
    }

    /// The range in which every driven joint stays within its own along an eigengrasp, the other amplitudes at 0.
    ///
    /// # Panics
    /// When there is no such eigengrasp.
    pub fn amplitude_range(&self, direction: usize) -> [f64; 2] {
        let grasps = self.eigengrasps().expect("a hand with eigengrasps");
        let along = self.driven().iter().zip(&grasps.origin).zip(&grasps.directions[direction]);
        along.filter(|(_, step)| **step != 0.0).fold([f64::NEG_INFINITY, f64::INFINITY], |[low, high], at| {
            let ((driven, origin), step) = at;
            let [a, b] = driven.range().map(|limit| (limit - origin) / step);
            [low.max(a.min(b)), high.min(a.max(b))]
        })
    }

    /// The amplitudes whose posture is nearest to a posture, by least squares over the driven joints; empty of a hand without
    /// eigengrasps, `None` where these depend on each other.
    ///
    /// # Panics
    /// When the posture has another length than the driven joints.
    pub fn amplitudes_of(&self, posture: &[f64]) -> Option<Vec<f64>> {
        assert_eq!(posture.len(), self.driven().len(), "one value a driven joint");
        let Some(grasps) = self.eigengrasps() else { return Some(Vec::new()) };
        // Normal equations: D^T D a = D^T (posture - origin), by sums in a fixed order.
        let (directions, count) = (&grasps.directions, grasps.directions.len());
        let offset: Vec<f64> = posture.iter().zip(&grasps.origin).map(|(value, origin)| value - origin).collect();
        let dot = |one: &[f64], other: &[f64]| one.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
        let products = DMatrix::from_fn(count, count, |row, column| dot(&directions[row], &directions[column]));
        let amplitudes = products.cholesky()?.solve(&DVector::from_fn(count, |row, _| dot(&directions[row], &offset)));
        Some(amplitudes.iter().copied().collect())
    }

    /// The posture of amplitudes, one an eigengrasp, brought within the joints' ranges.
    ///
    /// # Panics
    /// When there is not one amplitude an eigengrasp.
    pub fn posture_of(&self, amplitudes: &[f64]) -> Vec<f64> {
        let grasps = self.eigengrasps().expect("a hand with eigengrasps");
        assert_eq!(amplitudes.len(), grasps.directions.len(), "one amplitude an eigengrasp");
        let value = |(index, driven): (usize, &Driven)| {
            let steps = amplitudes.iter().zip(&grasps.directions).map(|(amplitude, step)| amplitude * step[index]);
            let [low, high] = driven.range();
            (grasps.origin[index] + steps.sum::<f64>()).max(low).min(high)
        };
        self.driven().iter().enumerate().map(value).collect()
    }
}

fn base_from_link(link: usize, frames: &[IsometryMatrix3<f64>]) -> IsometryMatrix3<f64> {
    if link == 0 { IsometryMatrix3::identity() } else { frames[link - 1] }
}
