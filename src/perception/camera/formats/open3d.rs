//! Cameras of Open3D: `PinholeCameraIntrinsic`, `PinholeCameraParameters`, and what its recorders write beside a video. Pixel
//! centres are at 0: its clouds are unprojected from whole columns and rows.

use super::fields::{image_size, required};
use crate::camera::{
    description::{CENTRE_AT_ZERO, CameraDescription},
    distortion::Distortion,
    keys::{CameraFormat, check_keys},
    problem::CameraProblem,
    statement::Statement,
};

const FORMAT: CameraFormat = CameraFormat::Open3d;

pub(super) fn read(camera: &Statement) -> Result<CameraDescription, CameraProblem> {
    check_keys(FORMAT, camera, &str::to_owned)?;
    let intrinsic = camera.get("intrinsic").unwrap_or(camera);
    if let Some(key) =
        ["intrinsic_matrix", "width", "height"].into_iter().find(|key| camera.has("intrinsic") && camera.has(key))
    {
        return Err(CameraProblem::content(key, "a camera beside that in `intrinsic`", "leave one of them"));
    }
    let image_size = image_size(FORMAT, intrinsic, ["width", "height"])?;
    let matrix = required(FORMAT, intrinsic, "intrinsic_matrix")?.numbers("intrinsic_matrix", FORMAT.remedy())?;
    let [fx, zero, last, skew, fy, bottom, cx, cy, one] = matrix[..] else {
        return Err(CameraProblem::content("intrinsic_matrix", format!("{} numbers", matrix.len()), FORMAT.remedy()));
    };
    if [zero, last, skew, bottom, one - 1.0].iter().any(|value| *value != 0.0) {
        let remedy = "it is fx, 0, 0, 0, fy, 0, cx, cy, 1, column by column, without skew";
        return Err(CameraProblem::content("intrinsic_matrix", "a matrix of another form", remedy));
    }
    let scale = camera.get("depth_scale").map(|scale| scale.number("depth_scale", FORMAT.remedy())).transpose()?;
    Ok(CameraDescription {
        numbers: [fx, fy, cx, cy],
        pixel_centre: CENTRE_AT_ZERO,
        image_size: Some(image_size),
        distortion: Distortion::default(),
        // `RGBDVideoMetadata` has units per metre, the older recorder in Python what librealsense gives: metres per unit. No
        // depth camera has units of a metre or more.
        depth_scale: scale.map(|scale| if scale >= 1.0 { 1.0 / scale } else { scale }),
    })
}
