//! Masses, boxes and friction of one body, as a model of scenes is given them.

use mujoco_rs::wrappers::{
    mj_editing::{MjsBody, MjsGeom},
    mj_model::MjtGeomBase,
};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

use super::scene_body::SimBody;

/// Torsional friction [m].
const TORSION: f64 = 0.005;

/// Masses, boxes and friction that a body of a model is given for a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BodyPatch {
    /// [kg].
    pub(crate) mass: f64,
    /// Principal moments [kg m^2], and their frame in the body's.
    pub(crate) inertia: [f64; 3],
    pub(crate) centre: [f64; 3],
    pub(crate) quaternion: [f64; 4],
    /// Box of the mesh: its centre and half its sides, in the body's frame [m].
    pub(crate) box_centre: [f64; 3],
    pub(crate) box_half: [f64; 3],
    /// Bounds of that box along the axes of inertia: centre and half sides [m].
    pub(crate) bounds: [f64; 6],
    /// Sliding [ratio], torsion and rolling [m].
    pub(crate) friction: [f64; 3],
}

impl BodyPatch {
    /// The body's own; `rolling` is its rolling friction [m].
    pub(crate) fn new(body: &SimBody, rolling: f64) -> Self {
        let bounds = body.body.surface().bounds();
        let (box_centre, half) = (bounds.centre(), (bounds.max - bounds.min) / 2.0);
        let [moments, axes] = principal(&body.solid.inertia);
        let body_from_inertia = Rotation3::from_matrix_unchecked(axes);
        let quaternion = UnitQuaternion::from_rotation_matrix(&body_from_inertia);
        let centre_in_inertia = axes.transpose() * (box_centre - body.solid.centre);
        let half_in_inertia = axes.transpose().abs() * half;
        let [x, y, z] = centre_in_inertia.into();
        let [a, b, c] = half_in_inertia.into();
        Self {
            mass: body.mass,
            inertia: (moments.diagonal() * body.mass).into(),
            centre: body.solid.centre.into(),
            quaternion: [quaternion.w, quaternion.i, quaternion.j, quaternion.k],
            box_centre: box_centre.into(),
            box_half: half.into(),
            bounds: [x, y, z, a, b, c],
            friction: [body.friction, TORSION, rolling],
        }
    }

    /// A body that every model has when it is compiled: oblique in all respects, so that MuJoCo takes no short cut that
    /// a later body would not fit.
    pub(crate) fn oblique() -> Self {
        let inertia = Matrix3::new(2.0, 0.3, 0.2, 0.3, 2.5, 0.1, 0.2, 0.1, 3.0) * 1e-3;
        let [moments, axes] = principal(&inertia);
        let quaternion = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        Self {
            mass: 1.0,
            inertia: moments.diagonal().into(),
            centre: [0.01, 0.02, 0.03],
            quaternion: [quaternion.w, quaternion.i, quaternion.j, quaternion.k],
            box_centre: [0.003, 0.002, 0.001],
            box_half: [0.05; 3],
            bounds: [0.0, 0.0, 0.0, 0.2, 0.2, 0.2],
            friction: [0.5, TORSION, 0.002],
        }
    }

    /// Makes a body free to move, with this mass and box.
    pub(crate) fn add_to<'b>(&self, body: &'b mut MjsBody) -> &'b mut MjsGeom {
        body.add_free_joint();
        self.add_mass_to(body);
        self.add_box_to(body)
    }

    /// Gives a body this mass.
    pub(crate) fn add_mass_to(&self, body: &mut MjsBody) {
        body.set_mass(self.mass);
        *body.ipos_mut() = self.centre;
        *body.iquat_mut() = self.quaternion;
        *body.inertia_mut() = self.inertia;
        *body.fullinertia_mut() = [f64::NAN; 6];
        body.set_explicitinertial(true);
    }

    /// Gives a body the box that represents its true mesh.
    pub(crate) fn add_box_to<'b>(&self, body: &'b mut MjsBody) -> &'b mut MjsGeom {
        let geom = body.add_geom();
        geom.set_type(MjtGeomBase::mjGEOM_BOX);
        *geom.pos_mut() = self.box_centre;
        *geom.size_mut() = self.box_half;
        *geom.friction_mut() = self.friction;
        geom.set_condim(6);
        geom
    }
}

/// Principal moments as a diagonal matrix, and their axes as columns, right-handed.
fn principal(inertia: &Matrix3<f64>) -> [Matrix3<f64>; 2] {
    let eigen = inertia.symmetric_eigen();
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    [Matrix3::from_diagonal(&eigen.eigenvalues), axes]
}
