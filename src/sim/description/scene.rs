//! Cameras of MJCF scenes.

use std::path::Path;

use mujoco_rs::{
    mujoco_c::mjtProjection,
    wrappers::{
        mj_data::MjData,
        mj_editing::{MjSpec, SpecElement},
        mj_model::{MjModel, MjtObjBase},
    },
};

use crate::{
    convert::pose_from,
    description::open::{OpenedSpec, open_spec, refused_by_mujoco},
    error::SceneError,
    statements::Usage,
};
use kernel::geom::{CameraGl, Intrinsics, Pose, World};

/// Intrinsics and pose of a camera of an MJCF scene, the scene in its initial state.
///
/// A field of view (`fovy`) is read as written, to the last bit. Focal lengths and principal points are 32-bit numbers in
/// MuJoCo; those in pixels become the shortest decimal that gives the same 32 bits, so `focalpixel="554.38"`
/// is 554.38 here. `near` is `znear` times the extent.
///
/// # Errors
/// When the description is refused, no camera has the name, or the camera is not a pinhole camera with an image size.
pub fn scene_camera(path: &Path, name: &str) -> Result<(Intrinsics, Pose<World, CameraGl>), SceneError> {
    let OpenedSpec { mut spec, .. } = open_spec(path, Usage::Camera)?;
    let model = spec.compile().map_err(|error| refused_by_mujoco(path, &error))?;
    let Some(camera) = (!name.contains('\0')).then(|| model.name_to_id(MjtObjBase::mjOBJ_CAMERA, name)).flatten()
    else {
        let present =
            spec.camera_iter().map(|camera| camera.name().to_owned()).filter(|name| !name.is_empty()).collect();
        return Err(SceneError::NoCamera { path: path.to_owned(), name: name.to_owned(), present });
    };
    let intrinsics = intrinsics(&spec, &model, camera, path, name)?;
    let mut data = MjData::new(&model);
    data.forward();
    let pose = pose_from(&data.cam_xpos()[camera], &data.cam_xmat()[camera]);
    Ok((intrinsics, pose))
}

/// The number that was written, where MuJoCo kept 32 bits of it.
fn as_written(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

fn intrinsics(
    spec: &MjSpec,
    model: &MjModel,
    camera: usize,
    path: &Path,
    name: &str,
) -> Result<Intrinsics, SceneError> {
    let (path, name) = (|| path.to_owned(), || name.to_owned());
    let written =
        spec.camera(&name()).ok_or_else(|| SceneError::NoCamera { path: path(), name: name(), present: Vec::new() })?;
    if written.proj() == mjtProjection::mjPROJ_ORTHOGRAPHIC {
        return Err(SceneError::Orthographic { path: path(), name: name() });
    }
    // MuJoCo's default of one pixel means "none given".
    let [width, height] = model.cam_resolution()[camera];
    let (Ok(width), Ok(height)) = (u32::try_from(width), u32::try_from(height)) else {
        return Err(SceneError::NoResolution { path: path(), name: name() });
    };
    if width <= 1 && height <= 1 {
        return Err(SceneError::NoResolution { path: path(), name: name() });
    }
    // Without a sensor size: square pixels from the vertical field of view, principal point in the middle.
    let (w, h) = (f64::from(width), f64::from(height));
    let sensor = model.cam_sensorsize()[camera].map(as_written);
    let [fx, fy, cx, cy] = if sensor == [0.0; 2] {
        let f = h / 2.0 / libm::tan(model.cam_fovy()[camera].to_radians() / 2.0);
        [f, f, w / 2.0, h / 2.0]
    } else {
        // With a sensor size: focal lengths and principal point in pixels where given, else from lengths by the pixel pitch.
        let per_pixel = [sensor[0] / w, sensor[1] / h];
        let in_pixels = |pixel: &[f32; 2], length: &[f32; 2], axis: usize| {
            if *pixel == [0.0; 2] { as_written(length[axis]) / per_pixel[axis] } else { as_written(pixel[axis]) }
        };
        let focal = |axis| in_pixels(written.focal_pixel(), written.focal_length(), axis);
        let principal = |axis| in_pixels(written.principal_pixel(), written.principal_length(), axis);
        // A positive offset of the principal point moves it left and up (tested against MuJoCo's own frustum).
        [focal(0), focal(1), w / 2.0 - principal(0), h / 2.0 - principal(1)]
    };
    // Near plane: a share of the model's extent.
    let near = as_written(model.vis().map.znear) * model.stat().extent;
    Intrinsics { width, height, fx, fy, cx, cy, near }.checked().map_err(|source| SceneError::Intrinsics {
        path: path(),
        name: name(),
        source,
    })
}

#[cfg(test)]
mod tests {
    use mujoco_rs::wrappers::mj_visualization::{MjvCamera, MjvOption, MjvPerturb, MjvScene};

    use super::*;
    use crate::ffi;

    /// The frustum that MuJoCo hands to OpenGL is the second opinion on focal length and principal point, signs included.
    #[test]
    fn intrinsics_agree_with_the_frustum_that_mujoco_draws() {
        ffi::prepare_library();
        for camera in [
            r#"fovy="40""#,
            r#"sensorsize="0.0032 0.002" focalpixel="310.5 309.25" principalpixel="3.5 -2.25""#,
            r#"sensorsize="0.0032 0.002" focal="0.004 0.0041" principal="0.0001 0.0002""#,
        ] {
            let text = format!(
                r#"<mujoco><statistic extent="1"/><visual><map znear="0.25"/></visual><worldbody>
                   <camera name="c" resolution="320 200" {camera}/></worldbody></mujoco>"#
            );
            let mut spec = MjSpec::from_xml_string(&text).expect("parsed");
            let model = spec.compile().expect("compiled");
            let ours = intrinsics(&spec, &model, 0, Path::new("test"), "c").expect("a camera");
            let mut data = MjData::new(&model);
            data.forward();
            let mut scene = MjvScene::new(&model, 4);
            let mut fixed = MjvCamera::new_fixed(0);
            scene.update(&mut data, &MjvOption::default(), &MjvPerturb::default(), &mut fixed);
            let theirs = &scene.camera()[0];
            // Width 0 means: as the window's shape has it.
            let half_width = match theirs.frustum_width {
                0.0 => (theirs.frustum_top - theirs.frustum_bottom) / 2.0 * 320.0 / 200.0,
                width => width,
            };
            // Edges of the image at the near plane, x right and y up [m].
            let near = f64::from(theirs.frustum_near);
            for (ours, theirs) in [
                (-ours.cx / ours.fx, theirs.frustum_center - half_width),
                ((320.0 - ours.cx) / ours.fx, theirs.frustum_center + half_width),
                ((ours.cy - 200.0) / ours.fy, theirs.frustum_bottom),
                (ours.cy / ours.fy, theirs.frustum_top),
            ] {
                assert!(
                    (ours - f64::from(theirs) / near).abs() < 1e-6,
                    "{camera}: {ours} {}",
                    f64::from(theirs) / near
                );
            }
            assert!((near - ours.near).abs() < 1e-7);
        }
    }
}
