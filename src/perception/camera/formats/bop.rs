//! Cameras of BOP datasets. Pixel centres are at 0: the BOP toolkit makes points of whole columns and rows. A depth image times
//! `depth_scale` is in millimetres (BOP's description of its format).

use super::fields::{image_size, numbers_of_rows, required, required_numbers};
use crate::camera::{
    description::{CENTRE_AT_ZERO, CameraDescription},
    distortion::Distortion,
    keys::{CameraFormat, check_keys},
    problem::CameraProblem,
    statement::Statement,
};

const MILLIMETRE: f64 = 1e-3;

/// `camera.json`.
pub(super) fn read_camera(camera: &Statement) -> Result<CameraDescription, CameraProblem> {
    const FORMAT: CameraFormat = CameraFormat::BopCamera;
    check_keys(FORMAT, camera, &str::to_owned)?;
    let image_size = image_size(FORMAT, camera, ["width", "height"])?;
    let numbers = required_numbers(FORMAT, camera, ["fx", "fy", "cx", "cy"])?;
    let [scale] = required_numbers(FORMAT, camera, ["depth_scale"])?;
    Ok(description(numbers, Some(image_size), Some(scale)))
}

/// The camera of an image in `scene_camera.json`.
pub(super) fn read_image(camera: &Statement) -> Result<CameraDescription, CameraProblem> {
    const FORMAT: CameraFormat = CameraFormat::BopSceneCamera;
    check_keys(FORMAT, camera, &str::to_owned)?;
    let matrix = required(FORMAT, camera, "cam_K")?.numbers("cam_K", FORMAT.remedy())?;
    let numbers = numbers_of_rows("cam_K", &matrix, FORMAT.remedy())?;
    let scale = camera.get("depth_scale").map(|scale| scale.number("depth_scale", FORMAT.remedy())).transpose()?;
    Ok(description(numbers, None, scale))
}

fn description(numbers: [f64; 4], image_size: Option<[u32; 2]>, millimetres: Option<f64>) -> CameraDescription {
    CameraDescription {
        numbers,
        pixel_centre: CENTRE_AT_ZERO,
        image_size,
        distortion: Distortion::default(),
        depth_scale: millimetres.map(|scale| scale * MILLIMETRE),
    }
}
