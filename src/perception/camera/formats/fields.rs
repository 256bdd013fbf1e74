//! Fields that several kinds of camera files have.

use crate::camera::{keys::CameraFormat, problem::CameraProblem, statement::Statement};

/// The statement of the first key of these that is there, with the key.
pub(super) fn find<'a>(camera: &'a Statement, keys: &[&'static str]) -> Option<(&'static str, &'a Statement)> {
    keys.iter().find_map(|key| Some((*key, camera.get(key)?)))
}

/// The statement of a key that a file must have.
pub(super) fn required<'a>(
    format: CameraFormat,
    camera: &'a Statement,
    key: &'static str,
) -> Result<&'a Statement, CameraProblem> {
    camera.get(key).ok_or_else(|| CameraProblem::content(key, "it is missing", format.remedy()))
}

/// Numbers of keys that a file must have.
pub(super) fn required_numbers<const N: usize>(
    format: CameraFormat,
    camera: &Statement,
    keys: [&'static str; N],
) -> Result<[f64; N], CameraProblem> {
    let mut numbers = [0.0; N];
    for (number, key) in numbers.iter_mut().zip(keys) {
        *number = required(format, camera, key)?.number(key, format.remedy())?;
    }
    Ok(numbers)
}

/// Width and height of the image [px], by their keys.
pub(super) fn image_size(
    format: CameraFormat,
    camera: &Statement,
    [width, height]: [&'static str; 2],
) -> Result<[u32; 2], CameraProblem> {
    Ok([
        required(format, camera, width)?.whole(width, format.remedy())?,
        required(format, camera, height)?.whole(height, format.remedy())?,
    ])
}

/// fx, fy, cx, cy of a matrix [fx, skew, cx; 0, fy, cy; 0, 0, 1], row by row.
pub(super) fn numbers_of_rows(place: &str, matrix: &[f64], remedy: &'static str) -> Result<[f64; 4], CameraProblem> {
    let [fx, skew, cx, zero, fy, cy, left, middle, one] = *matrix else {
        return Err(CameraProblem::content(place, format!("{} numbers", matrix.len()), remedy));
    };
    if skew != 0.0 {
        let remedy =
            "pixels that are no rectangles are not read: rectify the picture, and give its camera without skew";
        return Err(CameraProblem::content(place, format!("a skew of {skew}"), remedy));
    }
    if [zero, left, middle, one - 1.0].iter().any(|value| *value != 0.0) {
        let remedy = "it is fx, 0, cx, 0, fy, cy, 0, 0, 1, row by row";
        return Err(CameraProblem::content(place, "a matrix of another form", remedy));
    }
    Ok([fx, fy, cx, cy])
}
