//! Cameras by name: pinhole cameras of depth sensors, by published figures. Pixels are square, the principal point is
//! in the middle; the figures of an individual device differ by a few per cent.

use serde_json::{Value, json};

use kernel::geom::Intrinsics;

/// A camera that a job can name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedCamera {
    /// Name: the device and the size of its depth image.
    pub name: &'static str,
    /// Image width [px].
    pub width: u32,
    /// Image height [px].
    pub height: u32,
    /// Focal length along x and y [px].
    pub focal: f64,
    /// Where the focal length comes from; docs/sensors.md has the whole references.
    pub source: &'static str,
}

impl NamedCamera {
    /// The camera, which sees nothing nearer than `near` [m].
    pub fn intrinsics(&self, near: f64) -> Intrinsics {
        let Self { width, height, focal, .. } = *self;
        let (cx, cy) = (f64::from(width) / 2.0, f64::from(height) / 2.0);
        Intrinsics { width, height, fx: focal, fy: focal, cx, cy, near }
    }
}

/// The cameras, by device.
pub const CAMERAS: [NamedCamera; 6] = [
    NamedCamera {
        name: "d435-848x480",
        width: 848,
        height: 480,
        focal: 424.0,
        source: "Intel: 848 px over 90 degrees",
    },
    NamedCamera { name: "d435-1280x720", width: 1280, height: 720, focal: 640.0, source: "Intel: the same 90 degrees" },
    NamedCamera {
        name: "l515-1024x768",
        width: 1024,
        height: 768,
        // 512 / tan(35 degrees).
        focal: 731.2,
        source: "Intel's data sheet: 70 degrees",
    },
    NamedCamera {
        name: "l515-640x480",
        width: 640,
        height: 480,
        focal: 457.0,
        source: "Intel's data sheet: 70 degrees",
    },
    NamedCamera {
        name: "kinect-v1-640x480",
        width: 640,
        height: 480,
        focal: 586.3,
        source: "Khoshelham and Oude Elberink: 5.453 mm over 9.3 um",
    },
    NamedCamera { name: "zed-1280x720", width: 1280, height: 720, focal: 700.0, source: "Stereolabs" },
];

/// Lists the cameras that have names in the schema of a key that takes one.
pub fn describe_cameras(key: &mut Value) {
    let choice = |NamedCamera { name, focal, source, .. }: &NamedCamera| {
        let description = format!("{focal} px ({source}).");
        json!({ "const": name, "type": "string", "description": description })
    };
    if let Some(key) = key.as_object_mut() {
        key.remove("type");
        key.insert("oneOf".to_owned(), CAMERAS.iter().map(choice).collect());
    }
}

/// The camera of a name.
pub fn named_camera(name: &str) -> Option<&'static NamedCamera> {
    CAMERAS.iter().find(|camera| camera.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_the_size_and_focal_lengths_the_angle_that_was_published() {
        for NamedCamera { name, width, height, focal, source } in CAMERAS {
            assert!(name.ends_with(&format!("-{width}x{height}")), "{name}");
            let degrees = 2.0 * (f64::from(width) / 2.0 / focal).atan().to_degrees();
            let published = match name.split('-').next() {
                Some("d435") => 90.0,
                Some("l515") => 70.0,
                Some("kinect") => 57.3,
                _ => 84.9,
            };
            assert!((degrees - published).abs() < 0.1, "{name}: {degrees} degrees, {source}: {published}");
            assert_eq!(named_camera(name).map(|camera| camera.name), Some(name));
        }
        assert_eq!(named_camera("d435"), None);
    }
}
