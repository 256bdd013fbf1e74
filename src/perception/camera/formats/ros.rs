//! Cameras of ROS and OpenCV: a printed `camera_info`, and files of calibrations. Pixel centres are at 0: `image_geometry` and
//! `depth_image_proc` make rays of whole columns and rows, and OpenCV's corners count so.

use super::fields::{find, image_size, numbers_of_rows, required};
use crate::camera::{
    description::{CENTRE_AT_ZERO, CameraDescription},
    distortion::Distortion,
    keys::{CameraFormat, check_keys},
    problem::CameraProblem,
    statement::{Statement, Value},
};

/// Which of the two pictures of a camera of ROS a depth picture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RosImage {
    /// The picture of the sensor (`image_raw`): K and D are its camera.
    Raw,
    /// The rectified picture (`image_rect`): P is its camera, and it has no distortion.
    Rectified,
}

/// Which keys hold what.
struct Keys {
    format: CameraFormat,
    size: [&'static str; 2],
    matrix: &'static [&'static str],
    coefficients: &'static [&'static str],
    rectification: &'static [&'static str],
    projection: &'static [&'static str],
}

const INFO: Keys = Keys {
    format: CameraFormat::CameraInfo,
    size: ["width", "height"],
    matrix: &["K", "k"],
    coefficients: &["D", "d"],
    rectification: &["R", "r"],
    projection: &["P", "p"],
};

const CALIBRATION: Keys = Keys {
    format: CameraFormat::Calibration,
    size: ["image_width", "image_height"],
    matrix: &["camera_matrix"],
    coefficients: &["distortion_coefficients"],
    rectification: &["rectification_matrix"],
    projection: &["projection_matrix"],
};

/// Difference of rounded numbers.
const ROUNDING: f64 = 1e-6;

const WHICH_IMAGE: &str = "state which picture it is: --image raw (K and D are its camera) or --image rectified (P is)";

/// A printed `sensor_msgs/CameraInfo`.
pub(super) fn read_info(camera: &Statement, image: Option<RosImage>) -> Result<CameraDescription, CameraProblem> {
    check_keys(INFO.format, camera, &in_ros_1)?;
    let has_both = |key: &str| in_ros_1(key) != key && camera.has(&in_ros_1(key));
    if let Some((key, value)) = camera.keys().iter().find(|(key, _)| has_both(key)) {
        let found = format!("`{key}` beside `{}`", in_ros_1(key));
        return Err(CameraProblem::content(value.place(key), found, "leave one of them"));
    }
    let size = image_size(INFO.format, camera, INFO.size)?;
    for key in ["binning_x", "binning_y"] {
        let binning = camera.get(key).map(|binning| binning.whole(key, INFO.format.remedy())).transpose()?;
        if let Some(binning) = binning.filter(|binning| *binning > 1) {
            let remedy =
                "the numbers belong to a picture without binning: give those of the picture as it is, as fx,fy,cx,cy";
            return Err(CameraProblem::content(key, binning, remedy));
        }
    }
    if let Some(region) = camera.get("roi") {
        check_region(region, size)?;
    }
    read(&INFO, camera, size, image)
}

/// A key as ROS 1 has it: with capitals where ROS 2 has small letters.
fn in_ros_1(key: &str) -> String {
    if ["k", "d", "r", "p"].contains(&key) { key.to_ascii_uppercase() } else { key.to_owned() }
}

/// Refuses a region that is a part of the picture.
fn check_region(region: &Statement, [width, height]: [u32; 2]) -> Result<(), CameraProblem> {
    if !matches!(region.value, Value::Map(_)) {
        return Err(CameraProblem::content(
            region.place("roi"),
            "no region",
            "it has x_offset, y_offset, width and height",
        ));
    }
    for (key, whole) in [("x_offset", 0), ("y_offset", 0), ("width", width), ("height", height)] {
        let place = format!("roi.{key}");
        let value = region.get(key).map(|value| value.whole(&place, INFO.format.remedy())).transpose()?.unwrap_or(0);
        // A width and height of 0 mean the whole picture.
        if value != 0 && value != whole {
            let remedy = "the picture is a part of the camera's: give a file of graspmill with its own width and height, and cx and cy \
                          less the offset";
            return Err(CameraProblem::content(place, value, remedy));
        }
    }
    Ok(())
}

/// A file that OpenCV's calibration or `camera_calibration` of ROS writes.
pub(super) fn read_calibration(
    camera: &Statement,
    image: Option<RosImage>,
) -> Result<CameraDescription, CameraProblem> {
    check_keys(CALIBRATION.format, camera, &str::to_owned)?;
    let size = image_size(CALIBRATION.format, camera, CALIBRATION.size)?;
    let fisheye =
        camera.get("fisheye_model").map(|flag| flag.text("fisheye_model", CALIBRATION.format.remedy())).transpose()?;
    if let Some(flag) = fisheye.filter(|flag| !["0", "false", "False"].contains(flag)) {
        let remedy = "a fisheye is no pinhole, whatever its coefficients: rectify the picture, and give its camera as fx,fy,cx,cy";
        return Err(CameraProblem::content("fisheye_model", flag, remedy));
    }
    read(&CALIBRATION, camera, size, image)
}

fn read(
    keys: &Keys,
    camera: &Statement,
    size: [u32; 2],
    image: Option<RosImage>,
) -> Result<CameraDescription, CameraProblem> {
    let remedy = keys.format.remedy();
    let (key, matrix) = match find(camera, keys.matrix) {
        Some(found) => found,
        None => (keys.matrix[0], required(keys.format, camera, keys.matrix[0])?),
    };
    let numbers = numbers_of_rows(key, &matrix.numbers(key, remedy)?, remedy)?;
    let distortion = match listed(camera, keys.coefficients, remedy)? {
        Some((key, coefficients)) => distortion(camera, key, &coefficients)?,
        None => distortion(camera, keys.coefficients[0], &[])?,
    };
    // Drivers that do not know R and P leave them out or fill them with zeros.
    let rectification = listed(camera, keys.rectification, remedy)?.filter(|(_, list)| is_stated(list));
    let projection = listed(camera, keys.projection, remedy)?.filter(|(_, list)| is_stated(list));
    let projected = match projection {
        Some((key, matrix)) => Some((key, numbers_of_projection(key, &matrix, remedy)?)),
        None => None,
    };
    match image {
        None => {
            if let Some((key, _)) = rectification.filter(|(_, matrix)| !is_identity(matrix)) {
                return Err(CameraProblem::content(
                    key,
                    "a rotation between the raw and the rectified picture",
                    WHICH_IMAGE,
                ));
            }
            if let Some((key, found)) = projected.filter(|(_, found)| differs(found, &numbers)) {
                let found = format!("another camera than {}: {found:?}, not {numbers:?}", keys.matrix[0]);
                return Err(CameraProblem::content(key, found, WHICH_IMAGE));
            }
            Ok(description(numbers, size, distortion))
        }
        Some(RosImage::Raw) => Ok(description(numbers, size, distortion)),
        Some(RosImage::Rectified) => match projected {
            Some((_, numbers)) => Ok(description(numbers, size, Distortion::default())),
            None => {
                let place = format!("{}, with --image rectified", keys.projection[0]);
                Err(CameraProblem::content(place, "it is missing", "give the rectified camera as fx,fy,cx,cy"))
            }
        },
    }
}

/// The numbers of the first key of these that is there, with the key.
fn listed(
    camera: &Statement,
    keys: &[&'static str],
    remedy: &'static str,
) -> Result<Option<(&'static str, Vec<f64>)>, CameraProblem> {
    find(camera, keys).map(|(key, list)| Ok((key, list.numbers(key, remedy)?))).transpose()
}

fn is_stated(list: &[f64]) -> bool {
    list.iter().any(|value| *value != 0.0)
}

fn description(numbers: [f64; 4], size: [u32; 2], distortion: Distortion) -> CameraDescription {
    CameraDescription { numbers, pixel_centre: CENTRE_AT_ZERO, image_size: Some(size), distortion, depth_scale: None }
}

/// fx, fy, cx, cy of a projection [fx, 0, cx, Tx; 0, fy, cy, Ty; 0, 0, 1, 0], row by row. Tx and Ty are the offset from another
/// camera.
fn numbers_of_projection(key: &str, matrix: &[f64], remedy: &'static str) -> Result<[f64; 4], CameraProblem> {
    let [fx, skew, cx, _, zero, fy, cy, _, left, middle, one, last] = *matrix else {
        return Err(CameraProblem::content(key, format!("{} numbers, not 12", matrix.len()), remedy));
    };
    if last != 0.0 {
        return Err(CameraProblem::content(
            key,
            "a matrix of another form",
            "it is 3 rows of 4, the last of them 0, 0, 1, 0",
        ));
    }
    numbers_of_rows(key, &[fx, skew, cx, zero, fy, cy, left, middle, one], remedy)
}

/// Whether a matrix is the identity as far as it is there: what was cut off a printed message is not known.
fn is_identity(matrix: &[f64]) -> bool {
    const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    matrix.len() <= 9 && matrix.iter().zip(IDENTITY).all(|(value, wanted)| (value - wanted).abs() < ROUNDING)
}

fn differs(one: &[f64; 4], other: &[f64; 4]) -> bool {
    one.iter().zip(other).any(|(a, b)| (a - b).abs() > ROUNDING * b.abs().max(1.0))
}

/// Coefficients by the model, or by their count where none is named: OpenCV has 4, 5, 8, 12 or 14.
fn distortion(camera: &Statement, key: &'static str, coefficients: &[f64]) -> Result<Distortion, CameraProblem> {
    const KEY: &str = "distortion_model";
    let model = camera.get(KEY).map(|model| model.text(KEY, "it is plumb_bob or rational_polynomial")).transpose()?;
    let known = match model.unwrap_or_default() {
        "" => coefficients.len().min(8),
        "plumb_bob" => 5,
        "rational_polynomial" => 8,
        other => {
            let remedy = "only plumb_bob and rational_polynomial are undone, and no other model is a pinhole by zeros alone: rectify the \
                          picture before, and give its camera as fx,fy,cx,cy";
            return Err(CameraProblem::content(KEY, other, remedy));
        }
    };
    // Thin prism and tilt of OpenCV, and whatever the named model does not have.
    if let Some((index, value)) = coefficients.iter().enumerate().skip(known).find(|(_, value)| **value != 0.0) {
        let model = model.filter(|model| !model.is_empty()).unwrap_or("no model");
        let found = format!("{model} with {} numbers, the one at {index} is {value}", coefficients.len());
        let remedy = "only k1, k2, p1, p2, k3 of plumb_bob and k4, k5, k6 of rational_polynomial are undone: rectify the picture \
                      before, and give its camera as fx,fy,cx,cy";
        return Err(CameraProblem::content(key, found, remedy));
    }
    let is_known_count = [0, 4, 5, 8, 12, 14].contains(&coefficients.len());
    if !is_known_count && coefficients.iter().any(|value| *value != 0.0) {
        let found = format!("{} numbers", coefficients.len());
        return Err(CameraProblem::content(key, found, "it is k1, k2, p1, p2, and then k3, and then k4, k5, k6"));
    }
    let mut all = [0.0; 8];
    all.iter_mut().zip(coefficients).for_each(|(value, given)| *value = *given);
    Ok(Distortion::from_opencv(all))
}
