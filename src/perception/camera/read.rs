//! Cameras out of texts and files.

use std::path::Path;

use kernel::files::{self, Bound};

use super::{
    description::{CENTRE_AT_ZERO, CameraDescription},
    formats::{Entry, RosImage, entries},
    json,
    problem::{CameraError, CameraProblem, NUMBERS},
    statement::Statement,
    yaml,
};

/// Names of cameras that a message lists.
const MAX_LISTED: usize = 12;

/// Rule by which a description of a camera is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraRule {
    /// Name of the camera in a file of several: an image of BOP, a camera of Kalibr, a stream or image size of RealSense.
    pub entry: Option<String>,
    /// Coordinate of the first pixel's centre by which cx and cy are counted [px], 0 or 0.5, in place of the file's.
    pub pixel_centre: Option<f64>,
    /// Which of a camera's pictures a depth picture is, where a file of ROS describes two different ones.
    pub image: Option<RosImage>,
}

impl CameraDescription {
    /// Reads `fx,fy,cx,cy`, or the file that the text names.
    ///
    /// Numbers alone are taken as OpenCV, ROS and librealsense print them: pixel centres at 0.
    ///
    /// # Errors
    /// With the file, the position in it and the remedy.
    pub fn parse(text: &str) -> Result<Self, CameraError> {
        CameraRule::default().parse(text)
    }

    /// Reads a file by its keys: `.json`, `.yaml` or `.yml`.
    ///
    /// # Errors
    /// With the file, the position in it and the remedy.
    pub fn read(path: &Path) -> Result<Self, CameraError> {
        CameraRule::default().read(path)
    }
}

impl CameraRule {
    /// Reads `fx,fy,cx,cy`, or the file that the text names.
    ///
    /// # Errors
    /// With the file, the position in it and the remedy.
    pub fn parse(&self, text: &str) -> Result<CameraDescription, CameraError> {
        let fields: Vec<&str> = text.split(',').map(str::trim).collect();
        let numbers: Option<Vec<f64>> = fields.iter().map(|field| field.parse().ok()).collect();
        match numbers {
            Some(numbers) => self.read_numbers(&numbers),
            // A name with commas is hardly a file's.
            None if fields.len() == 4 && !files::is_present(Path::new(text)) => {
                let wrong = fields.iter().find(|field| field.parse::<f64>().is_err()).unwrap_or(&"");
                Err(CameraProblem::content("the command line", format!("'{wrong}' is no number"), NUMBERS))
            }
            None => return self.read(Path::new(text)),
        }
        .map_err(|problem| CameraError { origin: text.to_owned(), problem })
    }

    /// Reads a file by its keys: `.json`, `.yaml` or `.yml`.
    ///
    /// # Errors
    /// With the file, the position in it and the remedy.
    pub fn read(&self, path: &Path) -> Result<CameraDescription, CameraError> {
        self.read_file(path).map_err(|problem| CameraError { origin: path.display().to_string(), problem })
    }

    fn read_file(&self, path: &Path) -> Result<CameraDescription, CameraProblem> {
        let kind = path.extension().map(|kind| kind.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        let parse: fn(&str) -> Result<Vec<Statement>, CameraProblem> = match kind.as_str() {
            "json" => |text| json::parse(text).map(|document| vec![document]),
            "yaml" | "yml" => yaml::parse,
            _ => {
                let remedy = "a file ends in .json or .yaml; or give fx,fy,cx,cy";
                return Err(CameraProblem::content("the name", "an unknown kind of file", remedy));
            }
        };
        self.read_documents(&parse(&files::read_text(path, Bound::CAMERA)?)?)
    }

    /// The camera that all documents of a text state: a printed topic has one per message.
    pub(super) fn read_documents(&self, documents: &[Statement]) -> Result<CameraDescription, CameraProblem> {
        let mut cameras = documents.iter().map(|document| self.read_document(document));
        let first =
            cameras.next().unwrap_or_else(|| Err(CameraProblem::content("the file", "it is empty", NUMBERS)))?;
        for (number, camera) in (2..).zip(cameras) {
            if camera? != first {
                let place = format!("document {number}");
                return Err(CameraProblem::content(place, "another camera than the first one", "keep one of them"));
            }
        }
        Ok(first)
    }

    fn read_document(&self, document: &Statement) -> Result<CameraDescription, CameraProblem> {
        let entries = entries(document)?;
        let entry = match (&self.entry, &entries[..]) {
            (None, [only]) => return self.read_entry(only),
            (Some(name), [only]) if only.name.is_empty() => {
                let remedy = "leave --camera out";
                return Err(CameraProblem::content(format!("--camera {name}"), "the file states one camera", remedy));
            }
            (Some(name), _) => entries.iter().find(|entry| entry.name == *name).ok_or_else(|| {
                CameraProblem::content(format!("--camera {name}"), "no camera of the file", choose(&entries))
            })?,
            (None, _) => return self.read_alike(&entries),
        };
        self.read_entry(entry)
    }

    /// The camera that every entry states, where they are alike.
    fn read_alike(&self, entries: &[Entry<'_>]) -> Result<CameraDescription, CameraProblem> {
        let differ = || {
            let found = format!("{} different cameras", entries.len());
            CameraProblem::content("the file", found, choose(entries))
        };
        let first = self.read_entry(entries.first().ok_or_else(differ)?)?;
        for entry in &entries[1..] {
            if self.read_entry(entry).ok() != Some(first) {
                return Err(differ());
            }
        }
        Ok(first)
    }

    fn read_entry(&self, entry: &Entry<'_>) -> Result<CameraDescription, CameraProblem> {
        let read = entry.read(self.pixel_centre, self.image).and_then(|camera| {
            let pixel_centre = self.pixel_centre.unwrap_or(camera.pixel_centre);
            CameraDescription { pixel_centre, ..camera }.checked()
        });
        match read {
            Err(CameraProblem::Content { place, found, remedy }) if !entry.name.is_empty() => {
                Err(CameraProblem::Content { place: format!("{place} of {}", entry.name), found, remedy })
            }
            other => other,
        }
    }

    fn read_numbers(&self, numbers: &[f64]) -> Result<CameraDescription, CameraProblem> {
        let numbers: [f64; 4] = numbers
            .try_into()
            .map_err(|_| CameraProblem::content("the command line", format!("{} numbers", numbers.len()), NUMBERS))?;
        for (name, is_given) in [("--camera", self.entry.is_some()), ("--image", self.image.is_some())] {
            if is_given {
                return Err(CameraProblem::content(name, "numbers are of one camera", format!("leave {name} out")));
            }
        }
        let pixel_centre = self.pixel_centre.unwrap_or(CENTRE_AT_ZERO);
        CameraDescription { pixel_centre, ..CameraDescription::pinhole(numbers) }.checked()
    }
}

/// The remedy that names the cameras of a file.
fn choose(entries: &[Entry<'_>]) -> String {
    let names: Vec<&str> = entries.iter().take(MAX_LISTED).map(|entry| entry.name.as_str()).collect();
    let more = if entries.len() > MAX_LISTED { ", ..." } else { "" };
    format!("choose one by --camera: {}{more}", names.join(", "))
}
