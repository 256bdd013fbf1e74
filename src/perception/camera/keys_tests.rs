//! The table of keys: each row is true, and docs/completing.md has it.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::{json, *};

/// Statements of a camera of a format, which rows of the table change one at a time.
fn base(format: CameraFormat, key: &str) -> Value {
    let matrix = json!([525.0, 0.0, 319.5, 0.0, 525.0, 239.5, 0.0, 0.0, 1.0]);
    match format {
        CameraFormat::Graspmill => {
            json!({"width": 640, "height": 480, "fx": 525, "fy": 525, "cx": 320, "cy": 240, "pixel_centre": 0.5})
        }
        CameraFormat::Open3d => {
            let intrinsic =
                json!({"width": 640, "height": 480, "intrinsic_matrix": [525, 0, 0, 0, 525, 0, 319.5, 239.5, 1]});
            if key.starts_with("intrinsic.") || key == "intrinsic" {
                json!({"intrinsic": intrinsic})
            } else {
                intrinsic
            }
        }
        CameraFormat::BopCamera => {
            json!({"width": 640, "height": 480, "fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5, "depth_scale": 1.0})
        }
        CameraFormat::BopSceneCamera => json!({"cam_K": matrix, "depth_scale": 1.0}),
        CameraFormat::RealSense => {
            json!({"width": 640, "height": 480, "fx": 525, "fy": 525, "ppx": 319.5, "ppy": 239.5,
            "model": "brown_conrady", "coeffs": [0, 0, 0, 0, 0]})
        }
        CameraFormat::RealSenseTable => {
            json!({"rectified.0.width": 640, "rectified.0.height": 480, "rectified.0.fx": 525,
            "rectified.0.fy": 525, "rectified.0.ppx": 319.5, "rectified.0.ppy": 239.5})
        }
        CameraFormat::CameraInfo => {
            json!({"width": 640, "height": 480, "K": matrix, "D": [], "distortion_model": "plumb_bob",
            "roi": {"x_offset": 0, "y_offset": 0, "width": 0, "height": 0}})
        }
        CameraFormat::Calibration => {
            json!({"image_width": 640, "image_height": 480, "camera_matrix": {"data": matrix}})
        }
        CameraFormat::Kalibr => {
            json!({"camera_model": "pinhole", "intrinsics": [525, 525, 319.5, 239.5], "distortion_model": "radtan",
            "distortion_coeffs": [0, 0, 0, 0], "resolution": [640, 480]})
        }
    }
}

/// A sound value of a key that is read, other than that of [`base`]: it changes the camera, or is refused by name.
fn other_value(format: CameraFormat, key: &str) -> Value {
    let matrix = json!([500.0, 0.0, 319.5, 0.0, 525.0, 239.5, 0.0, 0.0, 1.0]);
    match (format, key.rsplit('.').next().unwrap_or_default()) {
        (_, "width" | "image_width") => json!(320),
        (_, "height" | "image_height") => json!(240),
        (_, "fx" | "fy") => json!(500),
        (_, "cx" | "cy" | "ppx" | "ppy") => json!(300),
        (CameraFormat::Graspmill, "pixel_centre") => json!(0),
        (CameraFormat::Graspmill, "distortion") => json!([0.1, 0, 0, 0, 0]),
        (CameraFormat::Open3d, "intrinsic_matrix") => json!([500, 0, 0, 0, 525, 0, 319.5, 239.5, 1]),
        (CameraFormat::Open3d, "intrinsic") => {
            json!({"width": 640, "height": 480, "intrinsic_matrix": [500, 0, 0, 0, 525, 0, 319.5, 239.5, 1]})
        }
        (_, "depth_scale") => json!(0.5),
        (_, "cam_K" | "K") => matrix,
        (_, "camera_matrix") => json!({"data": matrix}),
        (_, "model") => json!("kannala_brandt4"),
        (_, "coeffs") => json!([0.1, 0, 0, 0, 0]),
        (_, "D" | "distortion_coefficients" | "distortion_coeffs") => json!([0.1, 0, 0, 0]),
        (_, "distortion_model") => json!("equidistant"),
        (_, "R" | "rectification_matrix") => json!([0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
        (_, "P" | "projection_matrix") => json!([500.0, 0.0, 319.5, 0.0, 0.0, 525.0, 239.5, 0.0, 0.0, 0.0, 1.0, 0.0]),
        (_, "binning_x" | "binning_y") => json!(2),
        (_, "roi") => json!({"x_offset": 8}),
        (_, "x_offset" | "y_offset") => json!(8),
        (_, "fisheye_model") => json!(1),
        (_, "camera_model") => json!("omni"),
        (_, "intrinsics") => json!([500, 525, 319.5, 239.5]),
        (_, "resolution") => json!([320, 240]),
        (format, key) => panic!("no other value for {key} of {format}"),
    }
}

#[test]
fn every_row_of_the_table_of_keys_is_true() {
    // Cameras of some formats have names in a file.
    let named = |format: CameraFormat, camera: Value| match format {
        CameraFormat::BopSceneCamera => json!({"0": camera}),
        CameraFormat::Kalibr => json!({"cam0": camera}),
        _ => camera,
    };
    let read_value = |value: &Value| {
        let document = json::parse(&value.to_string()).expect("JSON");
        CameraRule::default().read_documents(&[document]).map_err(|error| error.to_string())
    };
    let set = |camera: &mut Value, key: &str, value: Value| match key
        .split_once('.')
        .filter(|_| !key.starts_with("rectified"))
    {
        Some((above, key)) if camera[above].is_object() => camera[above][key] = value,
        _ => camera[key] = value,
    };
    let nonsense = || json!({"elephants": ["two", 2]});
    let mut formats = BTreeSet::new();
    for CameraKey { format, key, treatment } in CAMERA_KEYS {
        formats.insert(*format);
        let written = key.replace(".N.", ".0.").replace(".*", ".x.x");
        let camera = base(*format, key);
        let plain =
            read_value(&named(*format, camera.clone())).unwrap_or_else(|error| panic!("{format}, {key}: {error}"));
        let read_with = |value: Value| {
            let mut camera = camera.clone();
            set(&mut camera, &written, value);
            read_value(&named(*format, camera))
        };
        match treatment {
            KeyTreatment::Read(_) => {
                let other = read_with(other_value(*format, key));
                assert_ne!(other.as_ref().ok(), Some(&plain), "{format}: {key} is not read: {other:?}");
                if let Err(words) = other {
                    let name = key.rsplit('.').next().unwrap_or_default();
                    assert!(words.contains(name) || words.contains("roi"), "{format}, {key}: {words}");
                }
                read_with(nonsense()).expect_err(key);
                read_with(json!("elephant")).expect_err(key);
            }
            KeyTreatment::Ignored(_) => {
                for value in [nonsense(), json!("elephant"), json!(7)] {
                    assert_eq!(read_with(value), Ok(plain), "{format}: {key} is not ignored");
                }
            }
            KeyTreatment::Refused(why) => {
                let words = read_with(other_value_or_number(*format, key)).expect_err(key);
                assert!(words.contains(key) && words.contains(why), "{format}, {key}: {words}");
            }
        }
        // What no row has is refused by name.
        let mut camera = camera.clone();
        set(&mut camera, "zoom", json!(1));
        let words = read_value(&named(*format, camera)).expect_err("an unknown key");
        assert!(words.contains("at zoom") && words.contains("a key that no camera file of"), "{format}: {words}");
    }
    assert!(formats.into_iter().eq(CameraFormat::ALL));
}

/// A value of a key that is refused.
fn other_value_or_number(format: CameraFormat, key: &str) -> Value {
    if key == "cam_model" { json!({"projection_model_type": "FISHEYE624"}) } else { other_value(format, key) }
}

/// The table of docs/completing.md: keys of one format with one treatment and one reason share a row.
fn table_of_keys() -> String {
    let mut rows: Vec<(CameraFormat, KeyTreatment, Vec<&str>)> = Vec::new();
    for CameraKey { format, key, treatment } in CAMERA_KEYS {
        match rows.iter_mut().find(|row| row.0 == *format && row.1 == *treatment) {
            Some(row) => row.2.push(key),
            None => rows.push((*format, *treatment, vec![key])),
        }
    }
    let row = |(format, treatment, keys): &(CameraFormat, KeyTreatment, Vec<&str>)| {
        let (word, why) = treatment.words();
        let keys: Vec<String> = keys.iter().map(|key| format!("`{key}`")).collect();
        format!("| {format} | {} | {word} | {why} |", keys.join(", "))
    };
    rows.iter().map(row).collect::<Vec<_>>().join("\n")
}

#[test]
fn the_documentation_has_the_table_of_keys() {
    let table = table_of_keys();
    assert!(include_str!("../../../docs/completing.md").contains(&table), "docs/completing.md lacks:\n{table}");
}
