use std::fs;

use proptest::prelude::*;

use super::{json, yaml, *};

const NUMBERS_AT_ZERO: [f64; 4] = [615.2, 614.8, 319.5, 239.25];

fn read(kind: &str, text: &str) -> Result<CameraDescription, CameraError> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(format!("camera.{kind}"));
    fs::write(&path, text).expect("a file");
    CameraDescription::read(&path)
}

const CALIBRATION: &str = "image_width: 640
image_height: 480
camera_name: narrow
camera_matrix:
  rows: 3
  cols: 3
  data: [615.2, 0.0, 319.5,
         0.0, 614.8, 239.25, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.1, -0.2, 0.001, 0.002, 0.03]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
";

const MESSAGE: &str = "header:
  frame_id: camera
height: 480
width: 640
distortion_model: \"plumb_bob\"
d:
- 0.1
- -0.2
- 0.001
- 0.002
- 0.03
k:
- 615.2
- 0.0
- 319.5
- 0.0
- 614.8
- 239.25
- 0.0
- 0.0
- 1.0
r:
- 1.0
";

#[test]
fn every_kind_of_file_states_the_same_camera() {
    let own = "{\"width\": 640, \"height\": 480, \"fx\": 615.2, \"fy\": 614.8, \"cx\": 320.0, \"cy\": 239.75}";
    let at_zero = "{\"width\": 640, \"height\": 480, \"fx\": 615.2, \"fy\": 614.8, \"cx\": 319.5, \"cy\": 239.25, \
                   \"pixel_centre\": 0, \"distortion\": [0.1, -0.2, 0.001, 0.002, 0.03]}";
    let matrix = "\"width\": 640, \"height\": 480, \"intrinsic_matrix\": [615.2, 0, 0, 0, 614.8, 0, 319.5, 239.25, 1]";
    let whole =
        format!("{{\"class_name\": \"PinholeCameraParameters\", \"extrinsic\": [1], \"intrinsic\": {{{matrix}}}}}");
    let old = "height: 480\nwidth: 640\ndistortion_model: \"plumb_bob\"\nD: [0.1, -0.2, 0.001, 0.002, 0.03]\n\
               K: [615.2, 0.0, 319.5, 0.0, 614.8, 239.25, 0.0, 0.0, 1.0]\nR: [1]\n";
    for (kind, text, is_distorted) in [
        ("json", own, false),
        ("json", at_zero, true),
        ("json", &format!("{{{matrix}}}"), false),
        ("json", &whole, false),
        ("yaml", CALIBRATION, true),
        ("yml", MESSAGE, true),
        ("yaml", old, true),
    ] {
        let camera = read(kind, text).unwrap_or_else(|error| panic!("{text}\n{error}"));
        let [fx, fy, cx, cy] = NUMBERS_AT_ZERO;
        assert_eq!(camera.with_centres_at_half(), [fx, fy, cx + 0.5, cy + 0.5], "{text}");
        assert_eq!(camera.image_size, Some([640, 480]));
        assert_eq!(camera.distortion, if is_distorted { [0.1, -0.2, 0.001, 0.002, 0.03] } else { [0.0; 5] }, "{text}");
    }
    let typed = CameraDescription::parse("615.2, 614.8,319.5,239.25").expect("numbers");
    assert_eq!((typed.numbers, typed.pixel_centre), (NUMBERS_AT_ZERO, CENTRE_AT_ZERO));
}

#[test]
fn mistakes_name_file_position_and_remedy() {
    for (kind, text, says) in [
        ("json", "{\"width\": 640,\n \"height\": 480}", "missing field `fx`"),
        ("json", "{\"width\": 640,\n \"high\": 480}", "line 2"),
        ("json", "{", "line 1, column 1"),
        ("json", "{\"width\":4,\"height\":4,\"fx\":1,\"fy\":1,\"cx\":1,\"cy\":1,\"pixel_centre\":1}", "0 or 0.5"),
        ("json", "{\"width\":4,\"height\":4,\"fx\":0,\"fy\":1,\"cx\":1,\"cy\":1}", "at fx: 0"),
        ("json", "{\"width\":4,\"height\":4,\"intrinsic_matrix\":[1,0,5,0,1,5,0,0,1]}", "column by column"),
        ("yaml", "height: 480\n", "at width: it is missing"),
        ("yaml", "width: 640\nheight: 480\n", "at K: it is missing"),
        ("yaml", "width: 640\nheight: tall\nK: [1]", "line 2: 'tall'"),
        ("yaml", "width: 640\nheight: 480\nK: [1, 2]", "2 numbers"),
        ("yaml", "width: 640\nheight: 480\nK: [1, two]", "'two' is no number"),
        ("yaml", &CALIBRATION.replace("plumb_bob", "equidistant"), "only plumb_bob"),
        ("yaml", &CALIBRATION.replace("0.03]", "0.03, 1, 2, 3]"), "8 numbers"),
        ("txt", "", "unknown kind"),
    ] {
        let text = read(kind, text).expect_err(says).to_string();
        assert!(text.contains(says) && text.contains(&format!("camera.{kind}")), "{says}: {text}");
    }
    for (text, says) in [
        ("1,2,3", "3 numbers"),
        ("1,2,x,4", "'x' is no number"),
        ("1,2,3,nan", "at cy: NaN"),
        ("-1,2,3,4", "at fx: -1"),
        ("nowhere.json", "cannot be read"),
    ] {
        let error = CameraDescription::parse(text).expect_err(says).to_string();
        assert!(error.contains(says) && error.contains(text), "{says}: {error}");
    }
}

#[test]
fn distortion_is_undone_ray_by_ray() {
    // Each pixel of the distorted image holds the column of the ray that it sees, found by iteration: the inverse of what the
    // product computes in closed form.
    let (width, height, camera) = (160, 120, [150.0, 152.0, 81.0, 58.5]);
    let [fx, fy, cx, cy] = camera;
    let [k1, k2, p1, p2, k3] = [-0.25, 0.08, 0.002, -0.001, 0.01];
    let ray = |column: u32, row: u32| {
        let (xd, yd) = ((f64::from(column) + 0.5 - cx) / fx, (f64::from(row) + 0.5 - cy) / fy);
        let (mut x, mut y) = (xd, yd);
        for _ in 0..60 {
            let square = x * x + y * y;
            let radial = 1.0 + square * (k1 + square * (k2 + square * k3));
            (x, y) = (
                (xd - 2.0 * p1 * x * y - p2 * (square + 2.0 * x * x)) / radial,
                (yd - p1 * (square + 2.0 * y * y) - 2.0 * p2 * x * y) / radial,
            );
        }
        (fx * x + cx, fy * y + cy)
    };
    let distorted = |axis: usize| -> Vec<f32> {
        let value = |pixel: u32| {
            let (u, v) = ray(pixel % width, pixel / width);
            if axis == 0 { u as f32 } else { v as f32 }
        };
        (0..width * height).map(value).collect()
    };
    let (mut checked, mut moved) = (0, 0.0_f64);
    for axis in 0..2 {
        let found = rectified(&distorted(axis), [width, height], camera, [k1, k2, p1, p2, k3]);
        for (pixel, value) in (0..width * height).zip(&found).filter(|(_, value)| !value.is_nan()) {
            let wanted = f64::from(if axis == 0 { pixel % width } else { pixel / width }) + 0.5;
            // The nearest pixel is up to half a pixel away, a little more where the lens shrinks the image.
            assert!((f64::from(*value) - wanted).abs() < 0.65, "pixel {pixel}: {value}, not {wanted}");
            checked += 1;
        }
    }
    for pixel in 0..width * height {
        let (u, _) = ray(pixel % width, pixel / width);
        moved = moved.max((u - f64::from(pixel % width) - 0.5).abs());
    }
    assert!(checked > 30_000 && moved > 3.0, "{checked} values, the lens moves rays by {moved} px");
    let plain = distorted(0);
    assert_eq!(rectified(&plain, [width, height], camera, [0.0; 5]), plain);
}

proptest! {
    #[test]
    fn no_text_makes_a_reader_panic(text in ".{0,200}", changes in prop::collection::vec((any::<prop::sample::Index>(), ".{1}"), 0..8)) {
        for original in [text.as_str(), CALIBRATION, MESSAGE] {
            let mut letters: Vec<char> = original.chars().collect();
            for (index, letter) in changes.iter().filter(|_| !original.is_empty()) {
                let index = index.index(letters.len());
                letters[index] = letter.chars().next().expect("a letter");
            }
            let text: String = letters.into_iter().collect();
            for camera in [json::parse(&text), yaml::parse(&text)].into_iter().flatten() {
                prop_assert!(camera.checked().is_err() || camera.numbers.iter().all(|value| value.is_finite()));
            }
        }
    }
}
