//! Planning groups out of MJCF and URDF.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use mujoco_rs::{
    error::MjEditError,
    mujoco_c::mjtDisableBit,
    wrappers::{
        mj_data::MjData,
        mj_editing::MjSpec,
        mj_model::{MjModel, MjtJoint, MjtObjBase},
    },
};
use nalgebra::{IsometryMatrix3, Translation3, Unit, Vector3};

use crate::{
    convert::{index, isometry, placement},
    description::open::{OpenedSpec, open_spec, refused_by_mujoco},
    error::RobotError,
    statements::Usage,
};
use kernel::{
    description::{DescriptionText, Format},
    geom::{EndEffector, Pose, World},
};
use robot::kinematics::{Joint, JointKind, JointLimits, PlanningGroup, PlanningGroupParts};

/// A robot's description, compiled by MuJoCo.
pub struct RobotModel {
    pub(crate) path: PathBuf,
    /// The name that the description gives itself.
    pub(crate) name: String,
    pub(crate) model: Arc<MjModel>,
    /// Use that the description is read for.
    pub(crate) usage: Usage,
    /// Elements of the description as written.
    pub(crate) text: DescriptionText,
    /// Mesh files in the model's order.
    pub(crate) meshes: Vec<MeshFile>,
}

/// Source of a mesh of the description.
pub(crate) struct MeshFile {
    /// `None` for a mesh written into the description, or made by MuJoCo.
    pub(crate) file: Option<PathBuf>,
    /// The frame to which the file's points are mapped before they are scaled, expressed in the file's own.
    pub(crate) file_from_reference: IsometryMatrix3<f64>,
    /// By axis.
    pub(crate) scale: [f64; 3],
}

impl RobotModel {
    /// Reads the description of a robot, MJCF or URDF.
    ///
    /// # Errors
    /// When its text is refused, or MuJoCo refuses it.
    pub fn open(path: &Path) -> Result<Self, RobotError> {
        Self::open_edited(path, Usage::Robot, |_| Ok(()))
    }

    /// Reads a description for its shapes only.
    ///
    /// # Errors
    /// Errors of [`RobotModel::open`].
    pub fn open_container(path: &Path) -> Result<Self, RobotError> {
        Self::open_edited(path, Usage::Container, |_| Ok(()))
    }

    /// Format of the description.
    pub fn format(&self) -> Format {
        self.text.format
    }

    /// Opens a description that is edited before MuJoCo compiles it.
    ///
    /// # Errors
    /// Errors of [`RobotModel::open`].
    pub(crate) fn open_edited(
        path: &Path,
        usage: Usage,
        edit: impl FnOnce(&mut MjSpec) -> Result<(), MjEditError>,
    ) -> Result<Self, RobotError> {
        let refused = |error: MjEditError| refused_by_mujoco(path, &error);
        let OpenedSpec { mut spec, text } = open_spec(path, usage)?;
        edit(&mut spec).map_err(refused)?;
        let mut model = spec.compile().map_err(refused)?;
        // A robot is opened for its contacts.
        model.opt_mut().disableflags &= !(mjtDisableBit::mjDSBL_CONTACT as i32);
        let meshes = (0..model.mesh_pathadr().len()).map(|mesh| mesh_file(&spec, &model, mesh)).collect();
        let name = spec.modelname().to_owned();
        Ok(Self { path: path.to_owned(), name, model: Arc::new(model), usage, text, meshes })
    }

    /// The joints between the world and a target, as a planning group; those named in `fixed` [rad or m], and all
    /// others that are not in `joints`, are fixed: at the given value, else at the value of the description. The target
    /// is a site, or else a body (a link of a URDF), and its frame the end effector.
    ///
    /// # Errors
    /// When a name is not there, a joint does not move the target, something else ties a joint, or the joints make no planning group.
    pub fn planning_group(
        &self,
        joints: &[&str],
        target: &str,
        fixed: &BTreeMap<String, f64>,
    ) -> Result<PlanningGroup, RobotError> {
        let model = &self.model;
        let (target_body, body_from_target) = self.target(target)?;
        for name in joints.iter().copied().chain(fixed.keys().map(String::as_str)) {
            self.joint(name)?;
        }
        let fixed = &self.still_values(joints, fixed)?;
        self.check_ties(&self.link_table(joints, fixed)?)?;
        let mut bodies = Vec::new();
        let mut body = target_body;
        while body != 0 {
            bodies.push(body);
            body = index(model.body_parentid()[body]);
        }
        bodies.reverse();
        let between: Vec<usize> = bodies.iter().flat_map(|body| self.joints_of(*body)).collect();
        let name_of = |joint: usize| model.id_to_name(MjtObjBase::mjOBJ_JOINT, joint).unwrap_or_default().to_owned();
        for name in joints {
            if !between.iter().any(|joint| name_of(*joint) == *name) {
                return Err(RobotError::NotMoved {
                    path: self.path.clone(),
                    joint: (*name).to_owned(),
                    target: target.to_owned(),
                    moving: between.into_iter().map(name_of).collect(),
                });
            }
        }
        let mut parts = PlanningGroupParts { joints: Vec::new(), end_effector: IsometryMatrix3::identity() };
        // From the frame that the last joint of the group moves.
        let mut frame = IsometryMatrix3::identity();
        for body in bodies {
            self.pass_through(body, joints, fixed, &mut frame, &mut parts.joints)?;
        }
        parts.end_effector = frame * body_from_target;
        PlanningGroup::new(parts).map_err(|source| RobotError::Group { path: self.path.clone(), source })
    }

    /// Pose in the world of the frame of a fixed body, or else site, with the joints as in
    /// [`RobotModel::planning_group`]. The world itself is the body `world`.
    ///
    /// # Errors
    /// When nothing has the name, a joint of the group moves it, or a joint cannot be read.
    pub fn resting_frame(
        &self,
        name: &str,
        joints: &[&str],
        fixed: &BTreeMap<String, f64>,
    ) -> Result<IsometryMatrix3<f64>, RobotError> {
        let model = &self.model;
        let fixed = &self.still_values(joints, fixed)?;
        let (mut body, body_from_frame) = self.body_named(name).or_else(|| self.site_named(name)).ok_or_else(|| {
            let present = self.frames();
            RobotError::NoFrame { path: self.path.clone(), name: name.to_owned(), present }
        })?;
        let mut bodies = Vec::new();
        while body != 0 {
            bodies.push(body);
            body = index(model.body_parentid()[body]);
        }
        let (mut frame, mut chain) = (IsometryMatrix3::identity(), Vec::new());
        for body in bodies.into_iter().rev() {
            self.pass_through(body, joints, fixed, &mut frame, &mut chain)?;
        }
        match chain.into_iter().next() {
            Some(Joint { name: joint, .. }) => {
                Err(RobotError::FrameMoves { path: self.path.clone(), name: name.to_owned(), joint })
            }
            None => Ok(frame * body_from_frame),
        }
    }

    /// MuJoCo's own forward kinematics: where a target (see [`RobotModel::planning_group`]) is at these joint values [rad or m], every
    /// other joint where the description has it.
    ///
    /// # Errors
    /// When a name is not there.
    pub fn target_pose(&self, target: &str, values: &[(&str, f64)]) -> Result<Pose<World, EndEffector>, RobotError> {
        let (body, body_from_target) = self.target(target)?;
        let mut data = MjData::new(&*self.model);
        for (name, value) in values {
            let joint = self.joint(name)?;
            data.qpos_mut()[index(self.model.jnt_qposadr()[joint])] = *value;
        }
        data.forward();
        Ok(Pose::from_isometry(placement(&data.xpos()[body], &data.xmat()[body]) * body_from_target))
    }

    /// From a body's parent to the body: `frame`, that of the parent expressed in the link that carries it, becomes that of
    /// the body; joints of the group on the way are added to `chain` and become the link.
    pub(crate) fn pass_through(
        &self,
        body: usize,
        joints: &[&str],
        fixed: &BTreeMap<String, f64>,
        frame: &mut IsometryMatrix3<f64>,
        chain: &mut Vec<Joint>,
    ) -> Result<(), RobotError> {
        let model = &self.model;
        *frame *= isometry(&model.body_pos()[body], &model.body_quat()[body]);
        for id in self.joints_of(body) {
            let name = self.model.id_to_name(MjtObjBase::mjOBJ_JOINT, id).unwrap_or_default();
            let (mut joint, reference) = match self.read_joint(id) {
                // A body with a ball or free joint at rest is where the description puts it.
                Err(RobotError::Kind { .. }) if !joints.contains(&name) && !fixed.contains_key(name) => continue,
                read => read?,
            };
            let anchor = Translation3::from(Vector3::from(model.jnt_pos()[id]));
            if joints.contains(&joint.name.as_str()) {
                joint.origin = *frame * anchor * joint.motion(-reference);
                *frame = IsometryMatrix3::from_parts(anchor.inverse(), nalgebra::Rotation3::identity());
                chain.push(joint);
            } else {
                let value = fixed.get(&joint.name).copied().unwrap_or(reference);
                *frame = *frame * anchor * joint.motion(value - reference) * anchor.inverse();
            }
        }
        Ok(())
    }

    pub(crate) fn joints_of(&self, body: usize) -> std::ops::Range<usize> {
        let count = index(self.model.body_jntnum()[body]);
        let first = if count == 0 { 0 } else { index(self.model.body_jntadr()[body]) };
        first..first + count
    }

    /// A joint without its origin, and the value at which it has moved nothing.
    fn read_joint(&self, id: usize) -> Result<(Joint, f64), RobotError> {
        let model = &self.model;
        let name = model.id_to_name(MjtObjBase::mjOBJ_JOINT, id).unwrap_or_default().to_owned();
        let refused = |kind| RobotError::Kind { path: self.path.clone(), joint: name.clone(), kind };
        let kind = match model.jnt_type()[id] {
            MjtJoint::mjJNT_HINGE => JointKind::Revolute,
            MjtJoint::mjJNT_SLIDE => JointKind::Prismatic,
            MjtJoint::mjJNT_BALL => return Err(refused("ball")),
            MjtJoint::mjJNT_FREE => return Err(refused("free")),
        };
        let [low, high] = model.jnt_range()[id];
        let joint = Joint {
            name,
            kind,
            origin: IsometryMatrix3::identity(),
            axis: Unit::new_unchecked(Vector3::from(model.jnt_axis()[id])),
            limits: model.jnt_limited()[id].then_some(JointLimits { low, high }),
        };
        Ok((joint, model.qpos0()[index(model.jnt_qposadr()[id])]))
    }

    pub(crate) fn joint(&self, name: &str) -> Result<usize, RobotError> {
        self.named(MjtObjBase::mjOBJ_JOINT, name).ok_or_else(|| RobotError::NoJoint {
            path: self.path.clone(),
            name: name.to_owned(),
            present: self.names(MjtObjBase::mjOBJ_JOINT, self.model.jnt_type().len()),
        })
    }

    /// The body that carries a target, and the target's frame expressed in the body's: a site, or else a body.
    fn target(&self, name: &str) -> Result<(usize, IsometryMatrix3<f64>), RobotError> {
        self.site_named(name).or_else(|| self.body_named(name)).ok_or_else(|| RobotError::NoTarget {
            path: self.path.clone(),
            name: name.to_owned(),
            present: self.frames(),
        })
    }

    /// The body of a site, and the site's frame expressed in the body's.
    fn site_named(&self, name: &str) -> Option<(usize, IsometryMatrix3<f64>)> {
        let model = &self.model;
        let site = self.named(MjtObjBase::mjOBJ_SITE, name)?;
        let body_from_site = isometry(&model.site_pos()[site], &model.site_quat()[site]);
        Some((index(model.site_bodyid()[site]), body_from_site))
    }

    /// A body and its own frame.
    fn body_named(&self, name: &str) -> Option<(usize, IsometryMatrix3<f64>)> {
        self.named(MjtObjBase::mjOBJ_BODY, name).map(|body| (body, IsometryMatrix3::identity()))
    }

    /// Names of all sites and bodies.
    fn frames(&self) -> Vec<String> {
        let mut names = self.names(MjtObjBase::mjOBJ_SITE, self.model.site_bodyid().len());
        names.extend(self.names(MjtObjBase::mjOBJ_BODY, self.model.body_parentid().len()));
        names
    }

    fn named(&self, kind: MjtObjBase, name: &str) -> Option<usize> {
        (!name.contains('\0')).then(|| self.model.name_to_id(kind, name)).flatten()
    }

    fn names(&self, kind: MjtObjBase, count: usize) -> Vec<String> {
        (0..count)
            .filter_map(|id| self.model.id_to_name(kind, id))
            .filter(|name| !name.is_empty())
            .map(str::to_owned)
            .collect()
    }
}

fn mesh_file(spec: &MjSpec, model: &MjModel, mesh: usize) -> MeshFile {
    let start = usize::try_from(model.mesh_pathadr()[mesh]).ok();
    let file = start.map(|start| {
        let bytes = model.paths()[start..].iter().map(|byte| byte.cast_unsigned()).take_while(|byte| *byte != 0);
        PathBuf::from(String::from_utf8_lossy(&bytes.collect::<Vec<u8>>()).into_owned())
    });
    let written = model.id_to_name(MjtObjBase::mjOBJ_MESH, mesh).and_then(|name| spec.mesh(name));
    let file_from_reference =
        written.map_or_else(IsometryMatrix3::identity, |mesh| isometry(mesh.refpos(), mesh.refquat()));
    MeshFile { file, file_from_reference, scale: model.mesh_scale()[mesh] }
}
