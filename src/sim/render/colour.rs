//! Colour images of one object, or of a scene, by MuJoCo's renderer, headless.

use mujoco_rs::{mujoco_c::mjtLightType, wrappers::mj_visualization::MjvScene};
use nalgebra::{Unit, Vector3};

use crate::{
    error::SimError,
    ffi,
    render::{
        depth::SimWorker,
        gl::GlView,
        model::{LIGHTS, PixelBox, Shadowed},
    },
};
use kernel::geom::{CameraCv, Intrinsics, Object, Pose, World};

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

/// Distance of lights without shadows from the origin of a scene [m]: only their direction matters.
const FAR: f64 = 20.0;

/// Distance of a light from the world's origin, as a multiple of how far its shadows reach, at most.
const FAR_OF_REACH: f64 = 4.0;

/// Ratio of the far plane of a colour image to the distance of the farthest vertex.
const BEYOND: f64 = 1.05;

/// A scene's light from the world's origin, and the far plane of camera and shadow maps [m]. The maps have 24 bits between near
/// and far plane and are compared in single precision: the less there is between the planes, the finer.
fn planes(shadows: Shadowed, camera_distance: f64) -> [f64; 2] {
    let light = shadows.span.min(FAR_OF_REACH * shadows.reach);
    [light, BEYOND * (2.0 * light).max(camera_distance + shadows.span)]
}

/// Lights a scene that was made for this pose of the object; with `shadows_from` [m] lights are at this distance from
/// its origin and throw shadows.
fn light(
    scene: &mut MjvScene,
    appearance: &Appearance,
    world_from_object: &Pose<World, Object>,
    shadows_from: Option<f64>,
) {
    let mut far = appearance.lights.iter();
    for light in scene.lights_mut() {
        (light.castshadow, light.specular) = (0, [0.1; 3]);
        if light.headlight != 0 {
            (light.ambient, light.diffuse) = (appearance.ambient, appearance.headlight);
        } else if let Some(Light { direction, colour }) = far.next() {
            let direction = world_from_object.rotation() * direction.into_inner();
            let position = world_from_object.translation() - direction * shadows_from.unwrap_or(FAR);
            let single = |vector: Vector3<f64>| [vector.x, vector.y, vector.z].map(|part| part as f32);
            light.type_ = mjtLightType::mjLIGHT_DIRECTIONAL as i32;
            (light.dir, light.pos, light.castshadow) =
                (single(direction), single(position), shadows_from.is_some().into());
            (light.ambient, light.diffuse) = ([0.0; 3], *colour);
        }
    }
}

impl SimWorker {
    /// Colours by `mjr_render` over EGL in a part of the image, row-major from the top: red, green, blue, each pixel the mean
    /// of four. Nothing casts a shadow. The model must be one of [`crate::SimModel::with_lights`].
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
        window: Window,
        appearance: &Appearance,
        behind: &dyn Fn(u32, u32) -> [u8; 3],
        rgb: &mut Vec<[u8; 3]>,
    ) -> Result<(), SimError> {
        self.gl_painted(camera, camera_from_object, window, (appearance, &[appearance.object]), behind, rgb)
    }

    /// Colours of a whole image of a scene by `mjr_render` over EGL, row-major from the top: red, green, blue, each pixel the mean of
    /// four. Both lights throw shadows. The model must be one of [`crate::SimModel::of_scene`], whose parts have these colours;
    /// directions of lights are in its world.
    ///
    /// # Errors
    /// When the pose is not finite, or OpenGL does not work here.
    pub fn gl_scene_colours(
        &mut self,
        camera: &Intrinsics,
        camera_from_world: &Pose<CameraCv, World>,
        appearance: &Appearance,
        parts: &[[f32; 3]],
        rgb: &mut Vec<[u8; 3]>,
    ) -> Result<(), SimError> {
        let camera_from_object = Pose::from_isometry(*camera_from_world.isometry());
        let window = [0, 0, camera.width, camera.height];
        self.gl_painted(camera, &camera_from_object, window, (appearance, parts), &|_, _| appearance.background, rgb)
    }

    /// Draws a window of an image, with the geoms in these colours.
    fn gl_painted(
        &mut self,
        camera: &Intrinsics,
        camera_from_object: &Pose<CameraCv, Object>,
        [left, top, width, height]: Window,
        (appearance, paints): (&Appearance, &[[f32; 3]]),
        behind: &dyn Fn(u32, u32) -> [u8; 3],
        rgb: &mut Vec<[u8; 3]>,
    ) -> Result<(), SimError> {
        let world_from_object = self.object_in_world(camera_from_object)?;
        let camera_distance = camera_from_object.translation().norm();
        let planes = self.model.shadows.map(|shadows| planes(shadows, camera_distance));
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
        let lit = |scene: &mut MjvScene| {
            light(scene, appearance, &world_from_object, planes.map(|[light, _]| light));
            ffi::paint(scene, paints);
        };
        let far = planes.map(|[_, far]| far);
        view.draw_colours(&self.model, &mut self.data, camera, (&pixels, far), lit, behind, rgb)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{Inertia, SimModel};
    use kernel::{geom::TriMesh, seed::Stream};
    use nalgebra::IsometryMatrix3;

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

    /// Light from all directions: the object has its own colour, and the rest the background's.
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
        // The same pixels for every window, and when repeated.
        let mut part = Vec::new();
        worker.gl_colours(&camera(), &before_the_camera(), [310, 230, 20, 10], &appearance, &mut part).expect("EGL");
        let same = part.iter().enumerate().all(|(k, pixel)| *pixel == rgb[(30 + k / 20) * 80 + 30 + k % 20]);
        assert!(same);
    }

    /// Two plates, one above the other, seen from above: the parts have their own colours, and the light from above throws the upper
    /// one's shadow where its outline lies on the lower one.
    #[test]
    fn parts_of_a_scene_have_their_colours_and_throw_shadows() {
        let (plate, floor) = (plate(), Pose::<World, Object>::identity());
        let raised = Pose::from_xyz_rpy([0.0, 0.0, 0.3, 0.0, 0.0, 0.0]);
        let wide: Vec<_> = plate.vertices.iter().map(|[x, y, z]| [8.0 * x, 8.0 * y, *z]).collect();
        let wide = TriMesh { vertices: wide, triangles: plate.triangles.clone() };
        let model = SimModel::of_scene([(&wide, floor), (&plate, raised)], 1.0).expect("a model");
        let mut worker = SimWorker::new(&Arc::new(model));
        // Light at 45 degrees along x.
        let slanted = Light { direction: Unit::new_normalize(Vector3::new(1.0, 0.0, -1.0)), colour: [0.6; 3] };
        let dark = Light { direction: -Vector3::z_axis(), colour: [0.0; 3] };
        let appearance =
            Appearance { ambient: [0.4; 3], headlight: [0.0; 3], lights: [slanted, dark], ..Appearance::default() };
        let camera = camera();
        // Straight down from 2 m: x to the right, y up.
        let world_from_camera: Pose<World, CameraCv> =
            Pose::from_rows(&[1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 2.0]);
        let mut rgb = Vec::new();
        let paints = [[0.2, 0.9, 0.2], [0.9, 0.2, 0.2]];
        worker.gl_scene_colours(&camera, &world_from_camera.inverse(), &appearance, &paints, &mut rgb).expect("EGL");
        let at = |x: f64, y: f64, z: f64| {
            let (u, v) = camera.project(&world_from_camera.inverse().point(&nalgebra::Point3::new(x, y, z)));
            rgb[v as usize * camera.width as usize + u as usize]
        };
        let [red, green, _] = at(0.0, 0.0, 0.31);
        assert!(red > 3 * green, "{:?}", at(0.0, 0.0, 0.31));
        let lit = at(-0.5, 0.3, 0.01);
        assert!(lit[1] > 3 * lit[0], "{lit:?}");
        // The raised plate lies from 0.29 to 0.31 m, and the upper side of the lower one at 0.01 m: the shadow reaches from
        // 0.18 to 0.4 m.
        for (x, shaded) in [(0.17, false), (0.23, true), (0.3, true), (0.37, true), (0.43, false)] {
            let level = f64::from(at(x, 0.0, 0.01)[1]) / f64::from(lit[1]);
            assert_eq!(level < 0.8, shaded, "at {x} m: {level}");
        }
    }

    /// A plain face that a light reaches has no pattern, for all angles of light and face: no sample of it is in a
    /// shadow, so that each pixel is as bright as the mean of those around it.
    #[test]
    fn a_plain_lit_face_has_no_moire() {
        let plate = plate();
        let wide: Vec<_> = plate.vertices.iter().map(|[x, y, z]| [8.0 * x, 8.0 * y, *z]).collect();
        let table = TriMesh { vertices: wide, triangles: plate.triangles.clone() };
        let camera = camera();
        let mut stream = Stream::of_job(1, b"", "lights");
        let (mut rgb, mut lit, mut dimmer) = (Vec::new(), 0, 0.0_f64);
        for _ in 0..24 {
            // The table, tilted by up to 80 degrees about any axis in its plane, 1.6 m below the camera.
            let axis = stream.uniform(-3.0, 3.0);
            let tilt = Vector3::new(libm::cos(axis), libm::sin(axis), 0.0) * stream.uniform(0.0, 1.4);
            let world_from_table: Pose<World, Object> = Pose::from_isometry(IsometryMatrix3::rotation(tilt));
            let model = SimModel::of_scene([(&table, world_from_table)], 1.2).expect("a model");
            let mut worker = SimWorker::new(&Arc::new(model));
            // The light meets it at 3 to 90 degrees.
            let normal = world_from_table.rotation() * Vector3::z();
            let direction = loop {
                let drawn = Unit::new_normalize(Vector3::from_fn(|_, _| stream.normal()));
                if drawn.dot(&normal) < -0.05 {
                    break drawn;
                }
            };
            let dark = Light { direction: -Vector3::z_axis(), colour: [0.0; 3] };
            let lights = [Light { direction, colour: [0.6; 3] }, dark];
            let appearance = Appearance { ambient: [0.2; 3], headlight: [0.0; 3], lights, ..Appearance::default() };
            let world_from_camera: Pose<World, CameraCv> =
                Pose::from_rows(&[1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 1.6]);
            let paints = [[0.9, 0.9, 0.9]];
            worker
                .gl_scene_colours(&camera, &world_from_camera.inverse(), &appearance, &paints, &mut rgb)
                .expect("EGL");
            // Pixels whose neighbours are all on the upper face, 1 cm from its border at least.
            let table_from_camera = world_from_table.inverse() * world_from_camera;
            let is_inside = |column: usize, row: usize| {
                let ray = table_from_camera.rotation()
                    * Vector3::new(
                        (column as f64 + 0.5 - camera.cx) / camera.fx,
                        (row as f64 + 0.5 - camera.cy) / camera.fy,
                        1.0,
                    );
                let eye = table_from_camera.translation();
                let hit = eye + ray * ((0.01 - eye.z) / ray.z);
                eye.z > 0.01 && hit.x.abs().max(hit.y.abs()) < 0.79
            };
            let width = camera.width as usize;
            let brightness = |column: usize, row: usize| f64::from(rgb[row * width + column][1]);
            for row in (1..camera.height as usize - 1).step_by(2) {
                for column in (1..width - 1).step_by(2) {
                    let around =
                        || (row - 1..row + 2).flat_map(|row| (column - 1..column + 2).map(move |column| (column, row)));
                    if around().all(|(column, row)| is_inside(column, row)) {
                        let mean = around().map(|(column, row)| brightness(column, row)).sum::<f64>() / 9.0;
                        lit += 1;
                        dimmer = dimmer.max((mean - brightness(column, row)).abs());
                    }
                }
            }
        }
        // Along a face the brightness changes by steps of 1 of 255; a sample of four without its light takes a quarter of
        // 0.6 x 0.9 x 255 times the sine of the light's angle: more than 3 from 5.6 degrees on.
        assert!(lit > 1_000_000 && dimmer < 3.0, "{lit} pixels, {dimmer} of 255");
    }

    /// A light from the left makes a tilted plate brighter than one from the right; depth is unchanged.
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
