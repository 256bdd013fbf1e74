//! Cameras of ROS: the file of a calibration, or a printed `camera_info` message.
//!
//! Both are read as plain text, key by key: no more of YAML than they use.

use super::{
    description::{CENTRE_AT_ZERO, CameraDescription},
    problem::CameraProblem,
};

const REMEDY: &str = "a camera_info has width, height, K of nine numbers, and D of the model plumb_bob";

pub(super) fn parse(text: &str) -> Result<CameraDescription, CameraProblem> {
    let one = |names: [&'static str; 2]| -> Result<u32, CameraProblem> {
        let (line, value) = names
            .into_iter()
            .find_map(|name| value_of(text, name))
            .ok_or_else(|| CameraProblem::content(names[0], "it is missing", REMEDY))?;
        value
            .trim()
            .parse()
            .map_err(|_| CameraProblem::content(format!("line {line}"), format!("'{}'", value.trim()), REMEDY))
    };
    let width = one(["width", "image_width"])?;
    let height = one(["height", "image_height"])?;
    let matrix = numbers_of(text, &["K", "k", "camera_matrix"])?
        .ok_or_else(|| CameraProblem::content("K", "it is missing", REMEDY))?;
    let [fx, skew, cx, zero, fy, cy, left, middle, one] = matrix[..] else {
        return Err(CameraProblem::content("K", format!("{} numbers", matrix.len()), REMEDY));
    };
    if [skew, zero, left, middle, one - 1.0].iter().any(|value| *value != 0.0) {
        let remedy = "it is fx, 0, cx, 0, fy, cy, 0, 0, 1, row by row";
        return Err(CameraProblem::content("K", "a matrix of another form", remedy));
    }
    let coefficients = numbers_of(text, &["D", "d", "distortion_coefficients"])?.unwrap_or_default();
    let model = value_of(text, "distortion_model").map(|(_, value)| value.trim().trim_matches(['"', '\'']).to_owned());
    let is_plain = coefficients.iter().all(|value| *value == 0.0);
    if !is_plain && (coefficients.len() > 5 || model.as_deref().is_some_and(|model| model != "plumb_bob")) {
        let model = model.unwrap_or_else(|| "no model".to_owned());
        let found = format!("{model} with {} numbers", coefficients.len());
        let remedy = "only plumb_bob is undone; rectify the picture before, and give its intrinsics without distortion";
        return Err(CameraProblem::content("distortion_model", found, remedy));
    }
    let mut distortion = [0.0; 5];
    distortion.iter_mut().zip(coefficients).for_each(|(value, given)| *value = given);
    Ok(CameraDescription {
        numbers: [fx, fy, cx, cy],
        pixel_centre: CENTRE_AT_ZERO,
        image_size: Some([width, height]),
        distortion,
    })
}

/// Number of the line of a key at the text's margin, from 1, and what follows on it.
fn value_of<'a>(text: &'a str, name: &str) -> Option<(usize, &'a str)> {
    let mut lines = (1..).zip(text.lines());
    lines.find_map(|(number, line)| Some((number, line.strip_prefix(name)?.trim_start().strip_prefix(':')?)))
}

/// The numbers of a list: in brackets, over several lines or not, or one per line after a dash; of a matrix, those of `data`.
fn numbers_of(text: &str, names: &[&str]) -> Result<Option<Vec<f64>>, CameraProblem> {
    let Some((number, first)) = names.iter().find_map(|name| value_of(text, name)) else { return Ok(None) };
    // What belongs to the key: the rest of its line, and lines below that are indented, begin with a dash, or stand within
    // brackets that are still open.
    let mut content = first.to_owned();
    for line in text.lines().skip(number) {
        let is_open = content.matches('[').count() > content.matches(']').count();
        if !(is_open || line.starts_with([' ', '\t', '-']) || line.trim().is_empty()) {
            break;
        }
        content.push('\n');
        content.push_str(line);
    }
    let list = match content.split_once("data") {
        Some((_, data)) => data.trim_start().strip_prefix(':').unwrap_or(data),
        None => &content,
    };
    let list = list.split_once(']').map_or(list, |(inside, _)| inside);
    let words = list.split([',', '[', '\n']).map(|word| {
        let word = word.trim();
        word.strip_prefix("- ").unwrap_or(word).trim()
    });
    let mut numbers = Vec::new();
    for word in words.filter(|word| !word.is_empty()) {
        let value = word.parse().map_err(|_| {
            CameraProblem::content(format!("line {number} and below"), format!("'{word}' is no number"), REMEDY)
        })?;
        numbers.push(value);
    }
    Ok(Some(numbers))
}
