//! MuJoCo's own verdict on which bodies of a robot touch, and where a robot rests.

use std::{collections::BTreeMap, sync::Arc};

use mujoco_rs::wrappers::{
    mj_data::MjData,
    mj_model::{MjModel, MjtObjBase},
};

use crate::{
    convert::index,
    description::{bodies::Carried, robot::RobotModel},
    error::RobotError,
};
use robot::collision::Bodies;

/// Two bodies that MuJoCo finds in contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyContact {
    /// Indices in [`Bodies::bodies`], the lower first.
    pub bodies: [usize; 2],
    /// Distance of the two [m], by MuJoCo's measure: negative where they overlap.
    pub distance: f64,
}

/// Working memory of one thread that queries MuJoCo for contacts.
///
/// MuJoCo collides convex hulls of meshes, so it finds contacts where the meshes themselves have none, and takes the frame of
/// a mesh from that of its body's inertia where the two agree to a millionth.
pub struct ContactWorker {
    data: MjData<Arc<MjModel>>,
    carried: Carried,
    /// Index of each joint of the group among MuJoCo's coordinates.
    addresses: Vec<usize>,
}

impl RobotModel {
    /// A worker for the planning group of these joints; `fixed` as in [`RobotModel::bodies`].
    ///
    /// # Errors
    /// Errors of [`RobotModel::bodies`].
    pub fn contact_worker(&self, joints: &[&str], fixed: &BTreeMap<String, f64>) -> Result<ContactWorker, RobotError> {
        let carried = self.carried(joints, fixed)?;
        let mut data = MjData::new(Arc::clone(&self.model));
        let address = |name: &str| Ok(index(self.model.jnt_qposadr()[self.joint(name)?]));
        for (name, value) in self.still_values(joints, fixed)? {
            data.qpos_mut()[address(&name)?] = value;
        }
        let addresses = carried.chain.iter().map(|joint| address(&joint.name)).collect::<Result<_, _>>()?;
        Ok(ContactWorker { data, carried, addresses })
    }

    /// The group's joint values at rest [rad or m], from the world outward: as the keyframe `home` has them, else where the
    /// description has each joint, brought within its limits.
    ///
    /// # Errors
    /// Errors of [`RobotModel::bodies`].
    pub fn rest(&self, joints: &[&str], fixed: &BTreeMap<String, f64>) -> Result<Vec<f64>, RobotError> {
        self.rest_of(&self.carried(joints, fixed)?)
    }

    pub(crate) fn rest_of(&self, carried: &Carried) -> Result<Vec<f64>, RobotError> {
        let model = &self.model;
        let home = model.name_to_id(MjtObjBase::mjOBJ_KEY, "home");
        let home = home.map_or(model.qpos0(), |key| &model.key_qpos()[key * model.qpos0().len()..]);
        let value = |joint: &robot::kinematics::Joint| {
            let value = home[index(model.jnt_qposadr()[self.joint(&joint.name)?])];
            Ok(joint.limits.map_or(value, |limits| value.max(limits.low).min(limits.high)))
        };
        carried.chain.iter().map(value).collect()
    }

    /// Whether MuJoCo finds the robot free at rest, its meshes as convex hulls.
    ///
    /// # Errors
    /// When a pair is in contact, and as [`RobotModel::bodies`].
    pub fn check_rest_by_contacts(&self, joints: &[&str], fixed: &BTreeMap<String, f64>) -> Result<(), RobotError> {
        let rest = self.rest(joints, fixed)?;
        let mut worker = self.contact_worker(joints, fixed)?;
        match worker.contacts(&rest).into_iter().find(|contact| contact.distance <= 0.0) {
            Some(contact) => Err(self.touching_at_rest(&worker.carried.bodies, contact.bodies)),
            None => Ok(()),
        }
    }

    /// The error of two bodies (indices in the list of [`RobotModel::bodies`]) that touch while the robot rests.
    pub fn touching_at_rest(&self, bodies: &Bodies, pair: [usize; 2]) -> RobotError {
        let [first, second] = pair.map(|index| bodies.bodies[index].name.clone());
        RobotError::Rest { path: self.path.clone(), format: self.text.format, first, second }
    }
}

impl ContactWorker {
    /// The pairs of bodies of different links in contact at joint values `q` [rad or m], from the world outward: each once,
    /// at its least distance, sorted.
    ///
    /// # Panics
    /// When `q` has another length than the group, or a value that is not finite.
    pub fn contacts(&mut self, q: &[f64]) -> Vec<BodyContact> {
        assert_eq!(q.len(), self.addresses.len(), "one value a joint");
        assert!(q.iter().all(|value| value.is_finite()), "joint values must be finite: {q:?}");
        for (address, value) in self.addresses.iter().zip(q) {
            self.data.qpos_mut()[*address] = *value;
        }
        self.data.kinematics();
        self.data.com_pos();
        self.data.collision();
        let mut found = BTreeMap::new();
        for contact in self.data.contact() {
            let index =
                |side: usize| usize::try_from(contact.geom[side]).ok().and_then(|geom| self.carried.body_of_geom[geom]);
            let (Some(one), Some(other)) = (index(0), index(1)) else { continue };
            let link = |index: usize| self.carried.bodies.bodies[index].link;
            if link(one) != link(other) {
                let min = found.entry([one.min(other), one.max(other)]).or_insert(f64::INFINITY);
                *min = contact.dist.min(*min);
            }
        }
        found.into_iter().map(|(bodies, distance)| BodyContact { bodies, distance }).collect()
    }

    /// Whether no two bodies of different links touch or overlap at joint values `q` [rad or m]; contacts within
    /// MuJoCo's margins before that are ignored.
    ///
    /// # Panics
    /// Panics of [`ContactWorker::contacts`].
    pub fn is_free(&mut self, q: &[f64]) -> bool {
        self.contacts(q).iter().all(|contact| contact.distance > 0.0)
    }
}
