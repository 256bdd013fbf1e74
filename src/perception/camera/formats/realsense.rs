//! Cameras of librealsense: `rs2_intrinsics`, and the calibration data that its Viewer saves. Pixel centres are at 0: "[0,0]
//! refers to the center of the top left pixel" (Projection in RealSense SDK 2.0).

use super::fields::{image_size, required_numbers};
use crate::camera::{
    description::{CENTRE_AT_ZERO, CameraDescription},
    distortion::Distortion,
    keys::{CameraFormat, check_keys},
    problem::CameraProblem,
    statement::Statement,
};

/// Models of `rs2_distortion` in the order of its numbers.
const MODELS: [&str; 6] =
    ["none", "modified_brown_conrady", "inverse_brown_conrady", "ftheta", "brown_conrady", "kannala_brandt4"];

/// Most keys of calibration data: 16 image sizes with six keys each, and four matrices.
const MAX_TABLE_KEYS: usize = 1024;

/// `rs2_intrinsics` by the names of its fields, as pyrealsense2 has them.
pub(super) fn read(camera: &Statement) -> Result<CameraDescription, CameraProblem> {
    const FORMAT: CameraFormat = CameraFormat::RealSense;
    check_keys(FORMAT, camera, &str::to_owned)?;
    let image_size = image_size(FORMAT, camera, ["width", "height"])?;
    let numbers = required_numbers(FORMAT, camera, ["fx", "fy", "ppx", "ppy"])?;
    let model = camera.get("model").map(|model| model.text("model", FORMAT.remedy())).transpose()?.unwrap_or("none");
    let coefficients = camera.get("coeffs").map(|list| list.numbers("coeffs", FORMAT.remedy())).transpose()?;
    let coefficients = coefficients.unwrap_or_default();
    let distortion = distortion(model, &coefficients)?;
    Ok(description(numbers, image_size, distortion))
}

/// A model by its name in C (`RS2_DISTORTION_BROWN_CONRADY`), in Python (`distortion.brown_conrady`), for people (`Brown Conrady`),
/// or by its number.
fn distortion(model: &str, coefficients: &[f64]) -> Result<Distortion, CameraProblem> {
    let plain = model.to_ascii_lowercase().replace(' ', "_");
    let plain = plain.strip_prefix("distortion.").or_else(|| plain.strip_prefix("rs2_distortion_")).unwrap_or(&plain);
    let name = plain.parse().ok().and_then(|number: usize| MODELS.get(number).copied()).unwrap_or(plain);
    let is_plain = coefficients.iter().all(|value| *value == 0.0);
    match (name, coefficients) {
        ("brown_conrady", [k1, k2, p1, p2, k3]) => {
            Ok(Distortion::from_opencv([*k1, *k2, *p1, *p2, *k3, 0.0, 0.0, 0.0]))
        }
        ("none" | "brown_conrady" | "inverse_brown_conrady" | "modified_brown_conrady", _) if is_plain => {
            Ok(Distortion::default())
        }
        _ => {
            let found = format!("{model} with {} coeffs", coefficients.len());
            let remedy = "only brown_conrady with five coeffs is undone: rectify the picture, and give its camera as fx,fy,cx,cy; \
                          depth that is not aligned to colour has no distortion";
            Err(CameraProblem::content("model", found, remedy))
        }
    }
}

fn description(numbers: [f64; 4], image_size: [u32; 2], distortion: Distortion) -> CameraDescription {
    CameraDescription {
        numbers,
        pixel_centre: CENTRE_AT_ZERO,
        image_size: Some(image_size),
        distortion,
        depth_scale: None,
    }
}

/// Image sizes of calibration data in words, `640x480`, with the number of each in the table; unused slots have size 0.
pub(super) fn sizes_of_table(table: &Statement) -> Result<Vec<(String, &str)>, CameraProblem> {
    const FORMAT: CameraFormat = CameraFormat::RealSenseTable;
    if table.keys().len() > MAX_TABLE_KEYS {
        let found = format!("{} keys, more than {MAX_TABLE_KEYS}", table.keys().len());
        return Err(CameraProblem::content("the calibration data", found, FORMAT.remedy()));
    }
    check_keys(FORMAT, table, &name_in_table)?;
    let numbers = table.keys().iter().filter_map(|(key, _)| key.strip_prefix("rectified.")?.strip_suffix(".width"));
    let mut sizes: Vec<(String, &str)> = Vec::new();
    for number in numbers {
        let [width, height] = size_in_table(table, number)?;
        let name = format!("{width}x{height}");
        if width > 0 && height > 0 && sizes.iter().all(|(known, _)| *known != name) {
            sizes.push((name, number));
        }
    }
    if sizes.is_empty() {
        return Err(CameraProblem::content("rectified.N.width", "no image size", FORMAT.remedy()));
    }
    Ok(sizes)
}

/// A key of calibration data as the table of keys has it.
fn name_in_table(key: &str) -> String {
    if let Some((number, name)) = key.strip_prefix("rectified.").and_then(|rest| rest.split_once('.'))
        && number.parse::<u32>().is_ok()
    {
        return format!("rectified.N.{name}");
    }
    match key.split_once('.') {
        Some((name, _)) if name != "rectified" => format!("{name}.*"),
        _ => key.to_owned(),
    }
}

fn size_in_table(table: &Statement, number: &str) -> Result<[u32; 2], CameraProblem> {
    let side = |name: &str| {
        let key = format!("rectified.{number}.{name}");
        let value = table.get(&key);
        let value =
            value.ok_or_else(|| CameraProblem::content(&key, "it is missing", CameraFormat::RealSenseTable.remedy()));
        value?.whole(&key, CameraFormat::RealSenseTable.remedy())
    };
    Ok([side("width")?, side("height")?])
}

/// A camera of calibration data: that of the rectified left picture, on which depth is computed.
pub(super) fn read_of_table(table: &Statement, number: &str) -> Result<CameraDescription, CameraProblem> {
    let remedy = CameraFormat::RealSenseTable.remedy();
    let mut numbers = [0.0; 4];
    for (value, name) in numbers.iter_mut().zip(["fx", "fy", "ppx", "ppy"]) {
        let key = format!("rectified.{number}.{name}");
        let stated = table.get(&key).ok_or_else(|| CameraProblem::content(&key, "it is missing", remedy))?;
        *value = stated.number(&key, remedy)?;
    }
    Ok(description(numbers, size_in_table(table, number)?, Distortion::default()))
}
