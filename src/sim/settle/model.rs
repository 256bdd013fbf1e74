//! The compiled model of a scene, with one box per body that represents its true mesh.
//!
//! A model is compiled once per count of bodies and thread, and given the masses and boxes of one scene after the other.

use super::SettleSettings;
use crate::{
    convert::index,
    ffi,
    objects::{container::Container, patch::BodyPatch},
    physics::{CONTACT_SOLIMP, CONTACT_SOLREF, GRAVITY},
};
use mujoco_rs::{
    mujoco_c::{mjtCone, mjtIntegrator},
    wrappers::{
        mj_data::MjData,
        mj_editing::MjSpec,
        mj_model::{MjModel, MjtGeomBase},
    },
};

/// Ratio of the stiffness of friction to that of normal forces: a higher ratio lets heaps creep less.
const IMPRATIO: f64 = 100.0;

/// Memory of a model [bytes]: the contacts of 20 nested cups and the solver's data for them.
const MEMORY: usize = 64 << 20;

/// A model of a thread, with its state.
pub(super) struct SceneModel {
    pub(super) data: MjData<Box<MjModel>>,
    /// Address of each body's position and rotation among MuJoCo's coordinates, and of its velocities.
    pub(super) addresses: Vec<[usize; 2]>,
}

impl SceneModel {
    /// Compiles a model of this many bodies in a container.
    pub(super) fn new(container: &Container, settings: &SettleSettings, count: usize) -> Self {
        Self::of_patches(container, settings, &vec![BodyPatch::oblique(); count])
    }

    /// Compiles a model of these bodies in a container.
    ///
    /// # Panics
    /// When MuJoCo refuses it: numbers were checked by the job.
    pub(super) fn of_patches(container: &Container, settings: &SettleSettings, bodies: &[BodyPatch]) -> Self {
        ffi::prepare_library();
        let mut spec = MjSpec::new();
        spec.set_memory(MEMORY as _);
        let ground = spec.world_body_mut().add_geom();
        ground.set_type(MjtGeomBase::mjGEOM_BOX);
        let bounds = container.bounds();
        *ground.pos_mut() = bounds.centre().into();
        *ground.size_mut() = ((bounds.max - bounds.min) / 2.0).into();
        // The larger of two frictions applies: the container has none.
        *ground.friction_mut() = [0.0; 3];
        ground.set_condim(6);
        for patch in bodies {
            patch.add_to(spec.world_body_mut().add_body());
        }
        let mut model = spec.compile().expect("boxes of a scene make a model");
        let option = model.opt_mut();
        option.timestep = settings.timestep;
        option.integrator = mjtIntegrator::mjINT_IMPLICITFAST as i32;
        option.cone = mjtCone::mjCONE_ELLIPTIC as i32;
        option.impratio = IMPRATIO;
        option.gravity = [0.0, 0.0, -GRAVITY];
        // Twice the step: as hard as contacts can be.
        model.geom_solref_mut().fill([CONTACT_SOLREF[0] * settings.timestep / 0.002, CONTACT_SOLREF[1]]);
        model.geom_solimp_mut().fill(CONTACT_SOLIMP);
        let address = |joint: usize| [model.jnt_qposadr()[joint], model.jnt_dofadr()[joint]].map(index);
        let addresses = (0..bodies.len()).map(address).collect();
        Self { data: MjData::new(Box::new(model)), addresses }
    }

    /// Gives the model the bodies of a scene.
    pub(super) fn set_bodies(&mut self, patches: &[BodyPatch]) {
        ffi::set_scene_bodies(&mut self.data, patches);
    }
}
