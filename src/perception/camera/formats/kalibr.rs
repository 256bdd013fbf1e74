//! Cameras of Kalibr's chains. Pixel centres are at 0: its targets are found by OpenCV, whose corners count so.

use super::fields::required;
use crate::camera::{
    description::{CENTRE_AT_ZERO, CameraDescription},
    distortion::Distortion,
    keys::{CameraFormat, check_keys},
    problem::CameraProblem,
    statement::Statement,
};

const FORMAT: CameraFormat = CameraFormat::Kalibr;

pub(super) fn read(camera: &Statement) -> Result<CameraDescription, CameraProblem> {
    check_keys(FORMAT, camera, &str::to_owned)?;
    let text = |key: &'static str| required(FORMAT, camera, key)?.text(key, FORMAT.remedy());
    let numbers = |key: &'static str| required(FORMAT, camera, key)?.numbers(key, FORMAT.remedy());
    let model = text("camera_model")?;
    if model != "pinhole" {
        let remedy = "only pinhole is read: calibrate with pinhole-radtan, or rectify the picture and give fx,fy,cx,cy";
        return Err(CameraProblem::content("camera_model", model, remedy));
    }
    let intrinsics = numbers("intrinsics")?;
    let numbers_of_pinhole: [f64; 4] = intrinsics[..]
        .try_into()
        .map_err(|_| CameraProblem::content("intrinsics", format!("{} numbers", intrinsics.len()), FORMAT.remedy()))?;
    let (model, coefficients) = (text("distortion_model")?, numbers("distortion_coeffs")?);
    let distortion = match (model, &coefficients[..]) {
        ("radtan", [k1, k2, p1, p2]) => Distortion::from_opencv([*k1, *k2, *p1, *p2, 0.0, 0.0, 0.0, 0.0]),
        ("none", values) if values.iter().all(|value| *value == 0.0) => Distortion::default(),
        _ => {
            let found = format!("{model} with {} coefficients", coefficients.len());
            let remedy = "only radtan with four coefficients is undone: calibrate with pinhole-radtan, or rectify the picture and \
                          give fx,fy,cx,cy";
            return Err(CameraProblem::content("distortion_model", found, remedy));
        }
    };
    let size = required(FORMAT, camera, "resolution")?.numbers("resolution", FORMAT.remedy())?;
    let image_size = match size[..] {
        [width, height] if [width, height].iter().all(|side| side.fract() == 0.0 && (0.0..1e6).contains(side)) => {
            [width as u32, height as u32]
        }
        _ => return Err(CameraProblem::content("resolution", format!("{size:?}"), FORMAT.remedy())),
    };
    Ok(CameraDescription {
        numbers: numbers_of_pinhole,
        pixel_centre: CENTRE_AT_ZERO,
        image_size: Some(image_size),
        distortion,
        depth_scale: None,
    })
}
