//! Cameras out of texts and files.

use std::path::Path;

use kernel::files::{self, Bound};

use super::{
    description::{CENTRE_AT_ZERO, CameraDescription},
    json,
    problem::{CameraError, CameraProblem, NUMBERS},
    yaml,
};

impl CameraDescription {
    /// Reads `fx,fy,cx,cy`, or the file that the text names.
    ///
    /// Numbers alone are taken as OpenCV, ROS and librealsense print them: pixel centres at 0.
    ///
    /// # Errors
    /// With the file, the position in it and the remedy.
    pub fn parse(text: &str) -> Result<Self, CameraError> {
        let fields: Vec<&str> = text.split(',').map(str::trim).collect();
        let numbers: Option<Vec<f64>> = fields.iter().map(|field| field.parse().ok()).collect();
        match numbers {
            Some(numbers) => Self::from_numbers(&numbers),
            // A name with commas is hardly a file's.
            None if fields.len() == 4 && !files::is_present(Path::new(text)) => {
                let wrong = fields.iter().find(|field| field.parse::<f64>().is_err()).unwrap_or(&"");
                Err(CameraProblem::content("the command line", format!("'{wrong}' is no number"), NUMBERS))
            }
            None => return Self::read(Path::new(text)),
        }
        .map_err(|problem| CameraError { origin: text.to_owned(), problem })
    }

    /// Reads a file: ours or Open3D's by `.json`, a `camera_info` of ROS by `.yaml` or `.yml`.
    ///
    /// # Errors
    /// With the file, the position in it and the remedy.
    pub fn read(path: &Path) -> Result<Self, CameraError> {
        let failed = |problem| CameraError { origin: path.display().to_string(), problem };
        let kind = path.extension().map(|kind| kind.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        let parse: fn(&str) -> Result<Self, CameraProblem> = match kind.as_str() {
            "json" => json::parse,
            "yaml" | "yml" => yaml::parse,
            _ => {
                let remedy = "a file ends in .json (ours, Open3D) or .yaml (ROS); or give fx,fy,cx,cy";
                return Err(failed(CameraProblem::content("the name", "an unknown kind of file", remedy)));
            }
        };
        let text = files::read_text(path, Bound::CAMERA).map_err(|error| failed(error.into()))?;
        parse(&text).and_then(Self::checked).map_err(failed)
    }

    fn from_numbers(numbers: &[f64]) -> Result<Self, CameraProblem> {
        let numbers: [f64; 4] = numbers
            .try_into()
            .map_err(|_| CameraProblem::content("the command line", format!("{} numbers", numbers.len()), NUMBERS))?;
        Self { pixel_centre: CENTRE_AT_ZERO, ..Self::pinhole(numbers) }.checked()
    }
}
