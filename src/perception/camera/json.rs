//! Cameras as JSON: a description of our own, and what Open3D writes.

use serde::Deserialize;

use super::{
    description::{CENTRE_AT_HALF, CENTRE_AT_ZERO, CameraDescription},
    problem::CameraProblem,
};

const REMEDY: &str = "a camera is {\"width\", \"height\", \"fx\", \"fy\", \"cx\", \"cy\"} with pixel centres at 0.5, or what Open3D writes";

/// The description of our own.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Own {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    pixel_centre: Option<f64>,
    /// k1, k2, p1, p2, k3.
    distortion: Option<[f64; 5]>,
}

/// Open3D's `PinholeCameraIntrinsic`.
#[derive(Deserialize)]
struct Open3dIntrinsic {
    width: u32,
    height: u32,
    /// Column by column.
    intrinsic_matrix: [f64; 9],
}

/// Open3D's `PinholeCameraParameters`.
#[derive(Deserialize)]
struct Open3dParameters {
    intrinsic: Open3dIntrinsic,
}

pub(super) fn parse(text: &str) -> Result<CameraDescription, CameraProblem> {
    let wrong = |error: serde_json::Error| {
        let place = format!("line {}, column {}", error.line(), error.column());
        // The library ends its message with the position.
        let message = error.to_string();
        let found = message.split(" at line ").next().unwrap_or_default();
        CameraProblem::content(place, found, REMEDY)
    };
    let value: serde_json::Value = serde_json::from_str(text).map_err(wrong)?;
    if value.get("intrinsic").is_some() {
        return serde_json::from_str(text).map_err(wrong).and_then(|Open3dParameters { intrinsic }| intrinsic.camera());
    }
    if value.get("intrinsic_matrix").is_some() {
        return serde_json::from_str(text).map_err(wrong).and_then(|intrinsic: Open3dIntrinsic| intrinsic.camera());
    }
    let Own { width, height, fx, fy, cx, cy, pixel_centre, distortion } = serde_json::from_str(text).map_err(wrong)?;
    let pixel_centre = pixel_centre.unwrap_or(CENTRE_AT_HALF);
    if pixel_centre != CENTRE_AT_HALF && pixel_centre != CENTRE_AT_ZERO {
        return Err(CameraProblem::content("pixel_centre", pixel_centre, "it is 0 or 0.5"));
    }
    Ok(CameraDescription {
        numbers: [fx, fy, cx, cy],
        pixel_centre,
        image_size: Some([width, height]),
        distortion: distortion.unwrap_or_default(),
    })
}

impl Open3dIntrinsic {
    fn camera(self) -> Result<CameraDescription, CameraProblem> {
        let [fx, zero, last, skew, fy, bottom, cx, cy, one] = self.intrinsic_matrix;
        if [zero, last, skew, bottom, one - 1.0].iter().any(|value| *value != 0.0) {
            let remedy = "it is fx, 0, 0, 0, fy, 0, cx, cy, 1, column by column";
            return Err(CameraProblem::content("intrinsic_matrix", "a matrix of another form", remedy));
        }
        Ok(CameraDescription {
            numbers: [fx, fy, cx, cy],
            pixel_centre: CENTRE_AT_ZERO,
            image_size: Some([self.width, self.height]),
            distortion: [0.0; 5],
        })
    }
}
