//! Depth of one object by MuJoCo: `mj_multiRay`, and through [`crate::render::gl`] `mjr_render`.

use std::sync::Arc;

use mujoco_rs::wrappers::{mj_data::MjData, mj_model::MjModel};

use crate::{
    convert::{pose_from, quaternion},
    error::SimError,
    render::{
        gl::GlView,
        model::{PixelBox, SimModel},
    },
};
use kernel::geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose, World};

/// Working memory of one thread that renders an object. It stays on its thread; make one per thread and move it from
/// object to object with [`SimWorker::use_model`].
pub struct SimWorker {
    pub(crate) model: Arc<SimModel>,
    pub(crate) data: MjData<Arc<MjModel>>,
    rays: Vec<[f64; 3]>,
    crop: DepthCrop,
    pub(crate) gl: Option<GlView>,
}

impl SimWorker {
    /// A worker that renders this object.
    pub fn new(model: &Arc<SimModel>) -> Self {
        let mut data = MjData::new(Arc::clone(&model.model));
        data.forward();
        Self { model: Arc::clone(model), data, rays: Vec::new(), crop: DepthCrop::default(), gl: None }
    }

    /// Renders another object from now on; the OpenGL context, where there is one, is kept.
    pub fn use_model(&mut self, model: &Arc<SimModel>) {
        if !Arc::ptr_eq(&self.model, model) {
            let gl = self.gl.take().map(GlView::without_model);
            *self = Self { gl, ..Self::new(model) };
        }
    }

    /// Depth by `mj_multiRay`, one ray through the centre of each pixel of the object's projected box.
    ///
    /// Both sides of a face are visible. A surface nearer than the near plane is neither visible nor an occluder.
    ///
    /// # Errors
    /// When the pose is not finite.
    pub fn ray_depth(
        &mut self,
        camera: &Intrinsics,
        camera_from_object: &Pose<CameraCv, Object>,
    ) -> Result<&DepthCrop, SimError> {
        self.set_camera(camera_from_object)?;
        let pixels = self.model.projected_box(camera, camera_from_object);
        let rotation = *self.model.world_from_camera.rotation();
        let from = *self.model.world_from_camera.translation();
        // Directions one metre long along the optical axis: MuJoCo's "distance" counts in lengths of the ray, so it
        // is depth along the axis.
        self.rays.clear();
        for row in pixels.top..pixels.bottom {
            for column in pixels.left..pixels.right {
                let point = camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, 1.0);
                self.rays.push((rotation * point.coords).into());
            }
        }
        open_crop(&mut self.crop, &pixels);
        if self.rays.is_empty() {
            return Ok(&self.crop);
        }
        let (_, depths) = self.data.multi_ray(&from.into(), &self.rays, None, true, None, FARTHEST, None);
        for ((pixel, ray), depth) in self.crop.depth.iter_mut().zip(&self.rays).zip(depths) {
            if depth >= camera.near {
                *pixel = depth as f32;
            } else if depth >= 0.0 {
                // A surface is before the near plane: render again from there.
                let start: [f64; 3] = std::array::from_fn(|axis| from[axis] + ray[axis] * camera.near);
                let (_, beyond) = self.data.ray(&start, ray, None, true, None, None);
                if beyond >= 0.0 {
                    *pixel = (camera.near + beyond) as f32;
                }
            }
        }
        Ok(&self.crop)
    }

    /// Depth by `mjr_render` over EGL, without samples, lights or textures, in the object's projected box.
    ///
    /// The OpenGL context is made on the first call. Both sides of a face are seen.
    ///
    /// # Errors
    /// When the pose is not finite, or OpenGL does not work here.
    pub fn gl_depth(
        &mut self,
        camera: &Intrinsics,
        camera_from_object: &Pose<CameraCv, Object>,
    ) -> Result<&DepthCrop, SimError> {
        self.set_camera(camera_from_object)?;
        let pixels = self.model.projected_box(camera, camera_from_object);
        open_crop(&mut self.crop, &pixels);
        if !self.crop.depth.is_empty() {
            let view = match self.gl.take() {
                Some(view) => self.gl.insert(view),
                None => self.gl.insert(GlView::new()?),
            };
            view.draw(&self.model, &mut self.data, camera, &pixels, &mut self.crop.depth)?;
        }
        Ok(&self.crop)
    }

    /// Name and version of the OpenGL driver in use, the label of data of class `colour`; `None` before the first
    /// [`SimWorker::gl_depth`].
    pub fn gl_renderer(&self) -> Option<String> {
        self.gl.as_ref().map(GlView::renderer)
    }

    /// Where MuJoCo's forward kinematics puts the object for a pose before the camera.
    ///
    /// # Errors
    /// When the pose is not finite.
    pub fn object_in_world(
        &mut self,
        camera_from_object: &Pose<CameraCv, Object>,
    ) -> Result<Pose<World, Object>, SimError> {
        self.set_camera(camera_from_object)?;
        Ok(pose_from(&self.data.xpos()[OBJECT], &self.data.xmat()[OBJECT]))
    }

    /// Moves the object's free joint; quaternion order (w first) is MuJoCo's and changes here only.
    fn set_camera(&mut self, camera_from_object: &Pose<CameraCv, Object>) -> Result<(), SimError> {
        if camera_from_object.to_rows().iter().any(|x| !x.is_finite()) {
            return Err(SimError::Pose(camera_from_object.to_rows()));
        }
        let world_from_object = self.model.world_from_camera * *camera_from_object;
        let (position, rotation) = self.data.qpos_mut().split_at_mut(3);
        position.copy_from_slice(world_from_object.translation().as_slice());
        rotation.copy_from_slice(&quaternion(world_from_object.isometry()));
        self.data.kinematics();
        Ok(())
    }
}

/// Body 0 is the world, the object the only other one.
const OBJECT: usize = 1;

/// Rays end here [m]; MuJoCo's own largest number.
const FARTHEST: f64 = 1e10;

fn open_crop(crop: &mut DepthCrop, pixels: &PixelBox) {
    (crop.left, crop.top, crop.width, crop.height) = (pixels.left, pixels.top, pixels.width(), pixels.height());
    crop.depth.clear();
    crop.depth.resize(pixels.width() as usize * pixels.height() as usize, f32::NAN);
}

#[cfg(test)]
mod tests {
    use mujoco_rs::wrappers::mj_model::{MjtGeomBase, MjtObjBase};

    use super::*;
    use crate::render::model::object_body;
    use kernel::geom::rotation_from_rpy;

    fn job_camera() -> Intrinsics {
        Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).expect("the default camera")
    }

    fn primitive(shape: MjtGeomBase, size: [f64; 3]) -> SimWorker {
        let model = SimModel::compile(|spec| {
            let geom = object_body(spec).add_geom();
            geom.set_type(shape);
            *geom.size_mut() = size;
            geom.set_contype(0);
            geom.set_conaffinity(0);
        });
        SimWorker::new(&Arc::new(model.expect("a primitive")))
    }

    #[test]
    fn the_scene_has_what_the_code_names() {
        let worker = primitive(MjtGeomBase::mjGEOM_SPHERE, [0.1, 0.0, 0.0]);
        assert_eq!(worker.model.model.name_to_id(MjtObjBase::mjOBJ_BODY, "object"), Some(OBJECT));
        assert_eq!(worker.data.qpos().len(), 7);
    }

    /// MuJoCo's own sphere through our ray directions and frames, against the closed form of its depth.
    #[test]
    fn a_sphere_has_its_closed_form_depth() {
        let (camera, radius) = (job_camera(), 0.13);
        let centre = nalgebra::Vector3::new(0.05, -0.08, 0.9);
        let mut worker = primitive(MjtGeomBase::mjGEOM_SPHERE, [radius, 0.0, 0.0]);
        let pose = Pose::new(rotation_from_rpy(0.3, -0.4, 2.0), centre);
        let depth = worker.ray_depth(&camera, &pose).expect("finite").clone();
        let mut worst = 0.0_f64;
        for row in 0..camera.height {
            for column in 0..camera.width {
                // |t d - c| = r with d of unit depth: the smaller root t is depth along the axis.
                let d = camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, 1.0).coords;
                let (a, b, c) = (d.dot(&d), d.dot(&centre), centre.dot(&centre) - radius * radius);
                let inside = b * b - a * c;
                let found = depth.at(column, row);
                if inside < 0.0 {
                    assert!(found.is_nan(), "({column}, {row}): {found}");
                } else {
                    worst = worst.max(((b - inside.sqrt()) / a - f64::from(found)).abs());
                }
            }
        }
        println!("sphere: {} returns, worst {worst:.1e} m", depth.returns());
        // Half a step of f32 below 1 m is 3e-8.
        assert!(worst < 4e-8);
    }

    #[test]
    fn a_slanted_plane_has_its_closed_form_depth() {
        let camera = job_camera();
        // MuJoCo's planes cannot move: the upper face of a wide box is one that can. Its normal is the box's z axis,
        // rotated to face the camera, then slanted.
        let mut worker = primitive(MjtGeomBase::mjGEOM_BOX, [50.0, 50.0, 1.0]);
        let rotation = rotation_from_rpy(std::f64::consts::PI, 0.0, 0.0) * rotation_from_rpy(0.5, 0.4, 0.0);
        let point = nalgebra::Vector3::new(0.1, 0.2, 1.5);
        let normal = rotation * nalgebra::Vector3::z();
        let depth = worker.ray_depth(&camera, &Pose::new(rotation, point - normal)).expect("finite").clone();
        let mut worst = 0.0_f64;
        for row in 0..camera.height {
            for column in 0..camera.width {
                let d = camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, 1.0).coords;
                let expected = normal.dot(&point) / normal.dot(&d);
                worst = worst.max((expected - f64::from(depth.at(column, row))).abs() / expected);
            }
        }
        println!("plane: {} returns, worst {worst:.1e} of the depth", depth.returns());
        assert_eq!(depth.returns(), 640 * 480);
        assert!(worst < 7e-8);
    }
}
