//! Colour images of one object by MuJoCo's renderer, headless.

use mujoco_rs::{mujoco_c::mjtLightType, wrappers::mj_visualization::MjvScene};
use nalgebra::{Unit, Vector3};

use super::{
    depth::SimWorker,
    error::SimError,
    ffi,
    gl::GlView,
    model::{LIGHTS, PixelBox},
};
use kernel::geom::{CameraCv, Intrinsics, Object, Pose};

/// Lights and paint of an object. Colours are shares of full brightness, 0 to 1: red, green, blue.
#[derive(Clone, Debug, PartialEq)]
pub struct Appearance {
    /// Colour of the object.
    pub object: [f32; 3],
    /// Behind it, not lit.
    pub background: [u8; 3],
    /// Light from everywhere.
    pub ambient: [f32; 3],
    /// A light at the camera.
    pub headlight: [f32; 3],
    /// Lights from far away.
    pub lights: [Light; LIGHTS],
}

/// A light from far away.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Where it shines to, in `Object`.
    pub direction: Unit<Vector3<f64>>,
    /// Colour and brightness.
    pub colour: [f32; 3],
}

impl Default for Appearance {
    /// A grey object before a darker background, lit from above on two sides.
    fn default() -> Self {
        let light =
            |x, y, z, share| Light { direction: Unit::new_normalize(Vector3::new(x, y, z)), colour: [share; 3] };
        Self {
            object: [0.72, 0.70, 0.67],
            background: [70, 76, 84],
            ambient: [0.25; 3],
            headlight: [0.3; 3],
            lights: [light(0.4, 0.5, -1.0, 0.45), light(-0.8, 0.3, -0.4, 0.2)],
        }
    }
}

/// Part of an image: left and top pixel, width and height [px].
pub type Window = [u32; 4];

/// Lights and paints a scene that was made for this pose.
pub(super) fn apply(scene: &mut MjvScene, appearance: &Appearance, world_from_object: &nalgebra::Matrix3<f64>) {
    let mut far = appearance.lights.iter();
    for light in scene.lights_mut() {
        (light.castshadow, light.specular) = (0, [0.1; 3]);
        if light.headlight != 0 {
            (light.ambient, light.diffuse) = (appearance.ambient, appearance.headlight);
        } else if let Some(Light { direction, colour }) = far.next() {
            let direction = world_from_object * direction.into_inner();
            light.type_ = mjtLightType::mjLIGHT_DIRECTIONAL as i32;
            light.dir = [direction.x, direction.y, direction.z].map(|part| part as f32);
            (light.ambient, light.diffuse) = ([0.0; 3], *colour);
        }
    }
    ffi::paint(scene, appearance.object);
}

impl SimWorker {
    /// Colours by `mjr_render` over EGL in a part of the image, row-major from the top: red, green, blue, each pixel the mean
    /// of four. Nothing casts a shadow. The model must be one of [`super::SimModel::with_lights`].
    ///
    /// The OpenGL context is made on the first call.
    ///
    /// # Errors
    /// When the pose is not finite, or OpenGL does not work here.
    pub fn gl_colours(
        &mut self,
        camera: &Intrinsics,
        camera_from_object: &Pose<CameraCv, Object>,
        window: Window,
        appearance: &Appearance,
        rgb: &mut Vec<[u8; 3]>,
    ) -> Result<(), SimError> {
        self.gl_colours_before(camera, camera_from_object, window, appearance, &|_, _| appearance.background, rgb)
    }

    /// [`SimWorker::gl_colours`] before an image: `behind` gives its colour at a column and a row of the whole image.
    ///
    /// # Errors
    /// When the pose is not finite, or OpenGL does not work here.
    pub fn gl_colours_before(
        &mut self,
        camera: &Intrinsics,
        camera_from_object: &Pose<CameraCv, Object>,
        [left, top, width, height]: Window,
        appearance: &Appearance,
        behind: &dyn Fn(u32, u32) -> [u8; 3],
        rgb: &mut Vec<[u8; 3]>,
    ) -> Result<(), SimError> {
        let world_from_object = *self.object_in_world(camera_from_object)?.rotation().matrix();
        let pixels = PixelBox { left, top, right: left + width, bottom: top + height };
        rgb.clear();
        rgb.resize(width as usize * height as usize, appearance.background);
        if rgb.is_empty() {
            return Ok(());
        }
        let view = match self.gl.take() {
            Some(view) => self.gl.insert(view),
            None => self.gl.insert(GlView::new()?),
        };
        let lit = |scene: &mut MjvScene| apply(scene, appearance, &world_from_object);
        view.draw_colours(&self.model, &mut self.data, camera, &pixels, lit, behind, rgb)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{Inertia, SimModel};
    use kernel::geom::TriMesh;

    /// A square plate in the plane z = 0, both sides.
    fn plate() -> TriMesh {
        let (near, far) = (-0.01, 0.01);
        let corner = |x: f32, y: f32, z: f32| [0.1 * x, 0.1 * y, z];
        let square = |z| [corner(-1.0, -1.0, z), corner(1.0, -1.0, z), corner(1.0, 1.0, z), corner(-1.0, 1.0, z)];
        let triangles = vec![
            [0, 2, 1],
            [0, 3, 2],
            [4, 5, 6],
            [4, 6, 7],
            [0, 1, 5],
            [0, 5, 4],
            [1, 2, 6],
            [1, 6, 5],
            [2, 3, 7],
            [2, 7, 6],
            [3, 0, 4],
            [3, 4, 7],
        ];
        TriMesh { vertices: [square(near), square(far)].concat(), triangles }
    }

    fn worker() -> SimWorker {
        SimWorker::new(&Arc::new(SimModel::with_lights(&plate(), Inertia::Shell).expect("a model")))
    }

    fn before_the_camera() -> Pose<CameraCv, Object> {
        Pose::from_xyz_rpy([0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
    }

    fn camera() -> Intrinsics {
        Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).expect("a camera")
    }

    /// All light from everywhere: the object has its own colour, and what is around it the background's.
    #[test]
    fn colours_are_those_that_were_asked_for() {
        let dark = Light { direction: Vector3::z_axis(), colour: [0.0; 3] };
        let appearance = Appearance {
            object: [0.8, 0.4, 0.2],
            background: [10, 20, 30],
            ambient: [1.0; 3],
            headlight: [0.0; 3],
            lights: [dark.clone(), dark],
        };
        let (mut worker, mut rgb) = (worker(), Vec::new());
        worker.gl_colours(&camera(), &before_the_camera(), [280, 200, 80, 80], &appearance, &mut rgb).expect("EGL");
        // The near side is at 1.99 m: 55.7 px wide around the middle, (40, 40) of the window.
        let apart = |found: [u8; 3], wanted: [u8; 3]| {
            found.iter().zip(wanted).all(|(found, wanted)| found.abs_diff(wanted) <= 26)
        };
        assert!(apart(rgb[40 * 80 + 40], [204, 102, 51]), "{:?}", rgb[40 * 80 + 40]);
        assert_eq!(rgb[2 * 80 + 2], appearance.background);
        let covered = rgb.iter().filter(|pixel| **pixel != appearance.background).count() as f64;
        assert!((covered.sqrt() - 55.7).abs() < 1.2, "{}", covered.sqrt());
        // The same pixels whatever the window, and again.
        let mut part = Vec::new();
        worker.gl_colours(&camera(), &before_the_camera(), [310, 230, 20, 10], &appearance, &mut part).expect("EGL");
        let same = part.iter().enumerate().all(|(k, pixel)| *pixel == rgb[(30 + k / 20) * 80 + 30 + k % 20]);
        assert!(same);
    }

    /// A light from the left makes a tilted plate brighter than one from the right; depth is as it was before.
    #[test]
    fn lights_shine_along_their_directions_and_leave_depth_alone() {
        let (mut worker, pose) = (worker(), Pose::from_xyz_rpy([0.0, 0.0, 2.0, 0.0, 0.6, 0.0]));
        let before = worker.gl_depth(&camera(), &pose).expect("EGL").clone();
        let brightness = |worker: &mut SimWorker, x: f64| {
            // In the camera's frame along x; lights are stated in the object's.
            let direction = Unit::new_normalize(pose.rotation().inverse() * Vector3::new(x, 0.0, 1.0));
            let dark = Light { direction, colour: [0.0; 3] };
            let lights = [Light { direction, colour: [0.9; 3] }, dark];
            let appearance = Appearance { ambient: [0.0; 3], headlight: [0.0; 3], lights, ..Appearance::default() };
            let mut rgb = Vec::new();
            worker.gl_colours(&camera(), &pose, [316, 236, 8, 8], &appearance, &mut rgb).expect("EGL");
            rgb.iter().map(|pixel| u32::from(pixel[1])).sum::<u32>()
        };
        let normal = pose.rotation() * -Vector3::z();
        let (left, right) = (brightness(&mut worker, 1.0), brightness(&mut worker, -1.0));
        // The side that is seen has the normal (-sin, 0, -cos): light along +x meets it where its x is below 0.
        assert!(if normal.x < 0.0 { left > right + 500 } else { right > left + 500 }, "{left} {right} {normal}");
        let after = worker.gl_depth(&camera(), &pose).expect("EGL");
        assert_eq!(format!("{after:?}"), format!("{before:?}"));
    }
}
