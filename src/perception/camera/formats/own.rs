//! Cameras in the format of graspmill.

use super::fields::{image_size, required_numbers};
use crate::camera::{
    description::{CENTRE_AT_HALF, CENTRE_AT_ZERO, CameraDescription},
    distortion::Distortion,
    keys::{CameraFormat, check_keys},
    problem::CameraProblem,
    statement::Statement,
};

const FORMAT: CameraFormat = CameraFormat::Graspmill;

pub(super) fn read(camera: &Statement, pixel_centre: Option<f64>) -> Result<CameraDescription, CameraProblem> {
    check_keys(FORMAT, camera, &str::to_owned)?;
    let image_size = image_size(FORMAT, camera, ["width", "height"])?;
    let numbers = required_numbers(FORMAT, camera, ["fx", "fy", "cx", "cy"])?;
    let stated = camera.get("pixel_centre").map(|centre| centre.number("pixel_centre", FORMAT.remedy())).transpose()?;
    let Some(pixel_centre) = stated.or(pixel_centre) else {
        let remedy = "add \"pixel_centre\": 0 where cx and cy count from the first pixel's centre (OpenCV, ROS, RealSense, BOP), \
                      or 0.5 where they count from its corner; or give --pixel-centre";
        return Err(CameraProblem::content("pixel_centre", "it is missing", remedy));
    };
    if pixel_centre != CENTRE_AT_HALF && pixel_centre != CENTRE_AT_ZERO {
        return Err(CameraProblem::content("pixel_centre", pixel_centre, "it is 0 or 0.5"));
    }
    let coefficients = camera.get("distortion").map(|list| list.numbers("distortion", FORMAT.remedy())).transpose()?;
    let distortion = match coefficients.unwrap_or_default()[..] {
        [] => Distortion::default(),
        [k1, k2, p1, p2, k3] => Distortion::from_opencv([k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]),
        [k1, k2, p1, p2, k3, k4, k5, k6] => Distortion::from_opencv([k1, k2, p1, p2, k3, k4, k5, k6]),
        ref others => {
            let found = format!("{} numbers", others.len());
            return Err(CameraProblem::content(
                "distortion",
                found,
                "it is k1, k2, p1, p2, k3, or these and k4, k5, k6",
            ));
        }
    };
    Ok(CameraDescription { numbers, pixel_centre, image_size: Some(image_size), distortion, depth_scale: None })
}
