use std::fs;

use proptest::prelude::*;

use super::{json, statement::Statement, yaml, *};

const AT_ZERO: [f64; 4] = [615.2, 614.8, 319.5, 239.25];
const BROWN: [f64; 5] = [0.1, -0.2, 0.001, 0.002, 0.03];

fn read_by(rule: &CameraRule, kind: &str, text: &str) -> Result<CameraDescription, CameraError> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(format!("camera.{kind}"));
    fs::write(&path, text).expect("a file");
    rule.read(&path)
}

fn read(kind: &str, text: &str) -> Result<CameraDescription, CameraError> {
    read_by(&CameraRule::default(), kind, text)
}

fn entry(name: &str) -> CameraRule {
    CameraRule { entry: Some(name.to_owned()), ..CameraRule::default() }
}

fn brown([k1, k2, p1, p2, k3]: [f64; 5]) -> Distortion {
    Distortion::from_opencv([k1, k2, p1, p2, k3, 0.0, 0.0, 0.0])
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

const OPENCV: &str = "%YAML:1.0
---
calibration_time: \"Mon Nov 23 12:31:23 2026\"
nframes: 12
image_width: 640
image_height: 480
flags: 0
fisheye_model: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 6.1520000000000005e+02, 0., 3.1950000000000000e+02, 0.,
       6.1480000000000000e+02, 2.3925000000000000e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 1.0e-01, -2.0e-01, 1.0e-03, 2.0e-03, 3.0e-02 ]
avg_reprojection_error: 2.1e-01
";

/// Two messages as ROS 2 prints them; the first one is cut.
const MESSAGE: &str = "header:
  stamp:
    sec: 1
    nanosec: 2
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
- 0.0
---
header: {stamp: {sec: 2, nanosec: 3}, frame_id: camera}
height: 480
width: 640
distortion_model: plumb_bob
d: [0.1, -0.2, 0.001, 0.002, 0.03]
k: [615.2, 0.0, 319.5, 0.0, 614.8, 239.25, 0.0, 0.0, 1.0]
";

/// A message as ROS 1 prints it.
const OLD_MESSAGE: &str = "header: \n  seq: 1\n  stamp: \n    secs: 1\n    nsecs: 2\n  frame_id: \"camera\"
height: 480\nwidth: 640\ndistortion_model: \"rational_polynomial\"
D: [0.1, -0.2, 0.001, 0.002, 0.03, 0.0, 0.0, 0.0]
K: [615.2, 0.0, 319.5, 0.0, 614.8, 239.25, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [615.2, 0.0, 319.5, 0.0, 0.0, 614.8, 239.25, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0\nbinning_y: 0
roi: \n  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n  do_rectify: False\n---\n";

const KALIBR: &str = "cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [0.1, -0.2, 0.001, 0.002]  # k1, k2, p1, p2
  distortion_model: radtan
  intrinsics: [615.2, 614.8, 319.5, 239.25]
  resolution: [640, 480]
  rostopic: /left
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]
  distortion_model: equidistant
  intrinsics: [465.3, 465.6, 337.2, 227.2]
  resolution: [640, 480]
  rostopic: /right
";

#[test]
fn every_kind_of_file_states_the_same_camera() {
    let own = "{\"width\": 640, \"height\": 480, \"fx\": 615.2, \"fy\": 614.8, \"cx\": 320.0, \"cy\": 239.75, \"pixel_centre\": 0.5}";
    let at_zero = "{\"width\": 640, \"height\": 480, \"fx\": 615.2, \"fy\": 614.8, \"cx\": 319.5, \"cy\": 239.25, \
                   \"pixel_centre\": 0, \"distortion\": [0.1, -0.2, 0.001, 0.002, 0.03]}";
    let matrix = "\"width\": 640, \"height\": 480, \"intrinsic_matrix\": [615.2, 0, 0, 0, 614.8, 0, 319.5, 239.25, 1]";
    let parameters =
        format!("{{\"class_name\": \"PinholeCameraParameters\", \"extrinsic\": [1], \"intrinsic\": {{{matrix}}}}}");
    let bop = "{\"cx\": 319.5, \"cy\": 239.25, \"depth_scale\": 0.1, \"fx\": 615.2, \"fy\": 614.8, \"height\": 480, \"width\": 640}";
    let realsense = "{\"width\": 640, \"height\": 480, \"ppx\": 319.5, \"ppy\": 239.25, \"fx\": 615.2, \"fy\": 614.8, \
                     \"model\": \"distortion.brown_conrady\", \"coeffs\": [0.1, -0.2, 0.001, 0.002, 0.03]}";
    let infrared = realsense.replace("distortion.brown_conrady", "4");
    let plain = realsense
        .replace("brown_conrady", "inverse_brown_conrady")
        .replace("[0.1, -0.2, 0.001, 0.002, 0.03]", "[0, 0, 0, 0, 0.0]");
    // OpenCV writes JSON, too.
    let opencv_json = "{\"image_width\": 640, \"image_height\": 480, \"camera_matrix\": {\"type_id\": \"opencv-matrix\", \"rows\": 3, \
                       \"cols\": 3, \"dt\": \"d\", \"data\": [615.2, 0, 319.5, 0, 614.8, 239.25, 0, 0, 1]}, \
                       \"distortion_coefficients\": [[0.1, -0.2, 0.001, 0.002, 0.03]]}";
    let none = Distortion::default();
    for (kind, text, distortion) in [
        ("json", own, none),
        ("json", at_zero, brown(BROWN)),
        ("yaml", "width: 640\nheight: 480\nfx: 615.2\nfy: 614.8\ncx: 319.5\ncy: 239.25\npixel_centre: 0\n", none),
        ("json", &format!("{{{matrix}}}"), none),
        ("json", &parameters, none),
        ("json", bop, none),
        ("json", realsense, brown(BROWN)),
        ("json", &infrared, brown(BROWN)),
        ("json", &plain, none),
        ("yaml", CALIBRATION, brown(BROWN)),
        ("yml", OPENCV, brown(BROWN)),
        ("json", opencv_json, brown(BROWN)),
        ("yml", MESSAGE, brown(BROWN)),
        ("yaml", OLD_MESSAGE, brown(BROWN)),
    ] {
        let camera = read(kind, text).unwrap_or_else(|error| panic!("{text}\n{error}"));
        let [fx, fy, cx, cy] = AT_ZERO;
        assert_eq!(camera.with_centres_at_half(), [fx, fy, cx + 0.5, cy + 0.5], "{text}");
        assert_eq!(camera.image_size, Some([640, 480]));
        assert_eq!(camera.distortion, distortion, "{text}");
    }
    let typed = CameraDescription::parse("615.2, 614.8,319.5,239.25").expect("numbers");
    assert_eq!((typed.numbers, typed.pixel_centre), (AT_ZERO, CENTRE_AT_ZERO));
    let kalibr = read_by(&entry("cam0"), "yaml", KALIBR).expect("a camera");
    assert_eq!((kalibr.numbers, kalibr.pixel_centre), (AT_ZERO, CENTRE_AT_ZERO));
    assert_eq!(kalibr.distortion, brown([0.1, -0.2, 0.001, 0.002, 0.0]));
}

#[test]
fn a_rational_model_is_read_with_its_divisor() {
    let rational = OLD_MESSAGE.replace("0.0, 0.0, 0.0]\nK", "0.4, -0.5, 0.6]\nK");
    let camera = read("yaml", &rational).expect("a camera");
    assert_eq!(camera.distortion, Distortion::from_opencv([0.1, -0.2, 0.001, 0.002, 0.03, 0.4, -0.5, 0.6]));
    // Thin prism and tilt of OpenCV's longest lists.
    let long =
        OPENCV.replace("3.0e-02 ]", "3.0e-02, 0., 0., 0., 0., 0., 0., 0., 0., 0. ]").replace("cols: 5", "cols: 14");
    assert_eq!(read("yaml", &long).expect("a camera").distortion, brown(BROWN));
    let prism = long.replace("0., 0. ]", "0., 1e-3 ]");
    let words = read("yaml", &prism).expect_err("a tilt").to_string();
    assert!(words.contains("14 numbers, the one at 13 is 0.001"), "{words}");
}

#[test]
fn units_of_depth_are_read_in_the_unit_of_their_format() {
    let scale = |text: &str| read("json", text).expect("a camera").depth_scale;
    let bop = |scale: &str| {
        format!(
            "{{\"cx\":319.5,\"cy\":239.5,\"depth_scale\":{scale},\"fx\":525,\"fy\":525,\"height\":480,\"width\":640}}"
        )
    };
    assert_eq!(scale(&bop("0.1")), Some(0.1 * 1e-3));
    let image = "{\"3\": {\"cam_K\": [525, 0, 319.5, 0, 525, 239.5, 0, 0, 1], \"depth_scale\": 1.0, \"cam_R_w2c\": [1], \"cam_t_w2c\": [2]}}";
    let camera = read("json", image).expect("a camera");
    assert_eq!((camera.depth_scale, camera.image_size, camera.pixel_centre), (Some(1e-3), None, CENTRE_AT_ZERO));
    let open3d = |scale: &str| {
        format!(
            "{{\"width\": 640, \"height\": 480, \"intrinsic_matrix\": [525, 0, 0, 0, 525, 0, 319.5, 239.5, 1], \"depth_scale\": {scale}, \
             \"fps\": 30.0, \"serial_number\": \"7\", \"color_format\": \"RGB8\", \"depth_format\": \"Z16\", \"device_name\": \"D435\", \
             \"stream_length_usec\": 5}}"
        )
    };
    assert_eq!([scale(&open3d("1000.0")), scale(&open3d("0.00025"))], [Some(1e-3), Some(0.00025)]);
    for (text, words) in
        [(bop("0"), "at depth_scale: 0.0 m"), (open3d("-1"), "at depth_scale: -1.0 m"), (bop("1e9"), "1e-7 to 10 m")]
    {
        let found = read("json", &text).expect_err(words).to_string();
        assert!(found.contains(words), "{words}: {found}");
    }
}

/// Two images with different cameras, and two with the same one.
#[test]
fn a_file_of_several_cameras_names_them() {
    let image =
        |focal: f64| format!("{{\"cam_K\": [{focal}, 0, 319.5, 0, 525, 239.5, 0, 0, 1], \"depth_scale\": 0.1}}");
    let two = format!("{{\"0\": {}, \"12\": {}}}", image(525.0), image(530.0));
    let words = read("json", &two).expect_err("two cameras").to_string();
    assert!(words.contains("2 different cameras; choose one by --camera: 0, 12"), "{words}");
    assert_eq!(read_by(&entry("12"), "json", &two).expect("a camera").numbers[0], 530.0);
    let words = read_by(&entry("3"), "json", &two).expect_err("no such image").to_string();
    assert!(words.contains("at --camera 3: no camera of the file; choose one by --camera: 0, 12"), "{words}");
    let alike = format!("{{\"0\": {}, \"12\": {}}}", image(525.0), image(525.0));
    assert_eq!(read("json", &alike).expect("one camera").numbers[0], 525.0);
    let many: Vec<String> =
        (0..30).map(|number| format!("\"{number}\": {}", image(500.0 + f64::from(number)))).collect();
    let words = read("json", &format!("{{{}}}", many.join(","))).expect_err("cameras").to_string();
    assert!(words.contains("10, 11, ...") && !words.contains("12,"), "{words}");
    // An entry among cameras that is not a camera is refused.
    let mixed = format!("{{\"0\": {}, \"zoom\": 2}}", image(525.0));
    assert!(read("json", &mixed).expect_err("a key").to_string().contains("at zoom: no camera of BOP"));
    // A camera that is not chosen may be one that cannot be read; without a choice it cannot be overlooked.
    let words = read("yaml", KALIBR).expect_err("two cameras").to_string();
    assert!(words.contains("choose one by --camera: cam0, cam1"), "{words}");
    let words = read_by(&entry("cam1"), "yaml", KALIBR).expect_err("a fisheye").to_string();
    assert!(words.contains("at distortion_model of cam1: equidistant with 4 coefficients"), "{words}");
    assert!(read_by(&entry("cam0"), "yaml", CALIBRATION).expect_err("one").to_string().contains("leave --camera out"));
    assert!(entry("0").parse("1,2,3,4").expect_err("one").to_string().contains("leave --camera out"));
    // Streams and image sizes of RealSense.
    let stream = |focal: f64| {
        format!(
            "{{\"width\": 640, \"height\": 480, \"ppx\": 319.5, \"ppy\": 239.5, \"fx\": {focal}, \"fy\": 380.0, \"model\": \"Brown Conrady\", \"coeffs\": [0, 0, 0, 0, 0]}}"
        )
    };
    let streams = format!("{{\"depth\": {}, \"color\": {}}}", stream(385.0), stream(610.0));
    assert_eq!(read_by(&entry("depth"), "json", &streams).expect("a stream").numbers[0], 385.0);
    let mut table =
        "{\"baseline\": \"-50.1\", \"intrinsic_left.x.x\": \"0.5\", \"world2right_rot.z.z\": \"1\"".to_owned();
    for (number, [width, height], focal) in [(0, [1280, 720], 640.5), (1, [640, 480], 385.25), (2, [0, 0], 0.0)] {
        table += &format!(", \"rectified.{number}.width\": \"{width}\", \"rectified.{number}.height\": \"{height}\"");
        for name in ["fx", "fy", "ppx", "ppy"] {
            table += &format!(", \"rectified.{number}.{name}\": \"{}\"", if name == "fx" { focal } else { 300.0 });
        }
    }
    table.push('}');
    let words = read("json", &table).expect_err("sizes").to_string();
    assert!(words.contains("choose one by --camera: 1280x720, 640x480"), "{words}");
    let camera = read_by(&entry("640x480"), "json", &table).expect("a camera");
    assert_eq!((camera.numbers, camera.image_size), ([385.25, 300.0, 300.0, 300.0], Some([640, 480])));
}

#[test]
fn a_file_of_numbers_alone_has_to_state_where_pixels_begin() {
    let text = "{\"cx\": 319.5, \"cy\": 239.5, \"fx\": 525.0, \"fy\": 525.0, \"height\": 480, \"width\": 640}";
    let words = read("json", text).expect_err("ambiguous").to_string();
    assert!(words.contains("at pixel_centre: it is missing; add \"pixel_centre\": 0"), "{words}");
    // Each remedy works: in the file, and by the rule.
    for centre in [0.0, 0.5] {
        let stated = text.replace('{', &format!("{{\"pixel_centre\": {centre}, "));
        assert_eq!(read("json", &stated).expect("a camera").pixel_centre, centre);
        let rule = CameraRule { pixel_centre: Some(centre), ..CameraRule::default() };
        assert_eq!(read_by(&rule, "json", text).expect("a camera").pixel_centre, centre);
    }
    let both = text.replace('{', "{\"pixel_centre\": 0, \"depth_scale\": 1, ");
    let words = read("json", &both).expect_err("of two formats").to_string();
    assert!(words.contains("at depth_scale") && words.contains("leave one of the two out"), "{words}");
}

#[test]
fn models_that_are_no_pinhole_are_refused_whatever_their_coefficients() {
    let realsense = |model: &str, coefficient: f64| {
        format!(
            "{{\"width\": 640, \"height\": 480, \"ppx\": 319.5, \"ppy\": 239.5, \"fx\": 525, \"fy\": 525, \"model\": \"{model}\", \"coeffs\": [{coefficient}, 0, 0, 0, 0]}}"
        )
    };
    let kalibr = |from: &str, to: &str| KALIBR.replace("0.1, -0.2, 0.001, 0.002", "0, 0, 0, 0").replacen(from, to, 1);
    let zeros = OLD_MESSAGE.replace("0.1, -0.2, 0.001, 0.002, 0.03", "0.0, 0.0, 0.0, 0.0, 0.0");
    let message = |model: &str| zeros.replace("rational_polynomial", model);
    for (kind, text, words) in [
        ("yaml", message("equidistant"), "at distortion_model: equidistant; only plumb_bob"),
        ("yaml", message("fisheye"), "at distortion_model: fisheye"),
        ("yaml", message("thin_prism_fisheye"), "at distortion_model: thin_prism_fisheye"),
        ("yaml", CALIBRATION.replace("plumb_bob", "equidistant"), "at distortion_model: equidistant"),
        (
            "yaml",
            OPENCV.replace("fisheye_model: 0", "fisheye_model: 1"),
            "at fisheye_model: 1; a fisheye is no pinhole",
        ),
        ("yaml", kalibr("pinhole", "omni"), "at camera_model of cam0: omni"),
        ("yaml", kalibr("pinhole", "ds"), "at camera_model of cam0: ds"),
        ("yaml", kalibr("radtan", "equidistant"), "at distortion_model of cam0: equidistant"),
        ("yaml", kalibr("radtan", "fov"), "at distortion_model of cam0: fov"),
        ("json", realsense("distortion.ftheta", 0.0), "at model: distortion.ftheta"),
        ("json", realsense("RS2_DISTORTION_KANNALA_BRANDT4", 0.0), "at model: RS2_DISTORTION_KANNALA_BRANDT4"),
        ("json", realsense("5", 0.0), "at model: 5"),
        ("json", realsense("elephant", 0.0), "at model: elephant"),
        ("json", realsense("Inverse Brown Conrady", 0.1), "at model: Inverse Brown Conrady"),
        ("json", realsense("none", 0.1), "at model: none"),
    ] {
        let rule = if text.starts_with("cam0") { entry("cam0") } else { CameraRule::default() };
        let found = read_by(&rule, kind, &text).expect_err(words).to_string();
        assert!(found.contains(words), "{words}: {found}");
        // The remedy of each, a rectified picture with its own numbers, is the pinhole that any camera can be.
        assert!(found.contains("fx,fy,cx,cy"), "{found}");
    }
    assert!(read("yaml", &message("rational_polynomial")).is_ok() && read("yaml", &message("plumb_bob")).is_ok());
}

#[test]
fn what_is_a_part_or_another_picture_of_the_camera_is_refused_by_name() {
    let with = |from: &str, to: &str| OLD_MESSAGE.replace(from, to);
    let skewed = "K: [615.2, 0.7, 319.5, 0.0, 614.8, 239.25, 0.0, 0.0, 1.0]";
    for (text, words) in [
        (with("binning_x: 0", "binning_x: 2"), "at binning_x: 2"),
        (with("binning_y: 0", "binning_y: 4"), "at binning_y: 4"),
        (with("  x_offset: 0", "  x_offset: 16"), "at roi.x_offset: 16"),
        (with("  width: 0", "  width: 320"), "at roi.width: 320"),
        (with("K: [615.2, 0.0, 319.5, 0.0, 614.8, 239.25, 0.0, 0.0, 1.0]", skewed), "at K: a skew of 0.7"),
        (with("R: [1.0, 0.0,", "R: [1.0, 0.01,"), "at R: a rotation between the raw and the rectified picture"),
        (with("P: [615.2", "P: [600.0"), "at P: another camera than K"),
        (with("P: [615.2, 0.0, 319.5, 0.0", "P: [615.2, 0.1, 319.5, 0.0"), "at P: a skew of 0.1"),
        (with("P: [615.2, 0.0, 319.5, 0.0", "P: [615.2, 0.0, 319.5"), "at P: 11 numbers, not 12"),
        (with("height: 480", "height: 480\nzoom: 2"), "at zoom (line 8): a key that no camera file of ROS"),
        (with("height: 480", "height: 480\nk: [1]"), "`k` beside `K`"),
        (with("height: 480", "height: 480\nheight: 481"), "the key `height` is there twice"),
    ] {
        let found = read("yaml", &text).expect_err(words).to_string();
        assert!(found.contains(words), "{words}: {found}");
    }
    // All of the picture, with and without numbers; binning of 1.
    for (from, to) in
        [("  width: 0", "  width: 640"), ("  height: 0", "  height: 480"), ("binning_x: 0", "binning_x: 1")]
    {
        assert!(read("yaml", &with(from, to)).is_ok(), "{to}");
    }
}

#[test]
fn which_of_two_pictures_is_meant_must_be_given() {
    let other = OLD_MESSAGE
        .replace("R: [1.0, 0.0, 0.0,", "R: [0.9, 0.0, 0.1,")
        .replace("P: [615.2, 0.0, 319.5, 0.0, 0.0, 614.8, 239.25", "P: [600.0, 0.0, 310.0, -30.0, 0.0, 600.0, 240.0");
    let words = read("yaml", &other).expect_err("two pictures").to_string();
    assert!(words.contains("--image raw (K and D are its camera) or --image rectified (P is)"), "{words}");
    let of = |image| read_by(&CameraRule { image: Some(image), ..CameraRule::default() }, "yaml", &other);
    let raw = of(RosImage::Raw).expect("the raw picture");
    assert_eq!((raw.numbers, raw.distortion), (AT_ZERO, brown(BROWN)));
    let rectified = of(RosImage::Rectified).expect("the rectified picture");
    assert_eq!((rectified.numbers, rectified.distortion), ([600.0, 600.0, 310.0, 240.0], Distortion::default()));
    // Drivers fill what they do not know with zeros.
    let unknown = OLD_MESSAGE
        .replace("R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]", "R: [0, 0, 0, 0, 0, 0, 0, 0, 0]")
        .replace(
            "P: [615.2, 0.0, 319.5, 0.0, 0.0, 614.8, 239.25, 0.0, 0.0, 0.0, 1.0, 0.0]",
            "P: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]",
        );
    assert_eq!(read("yaml", &unknown).expect("a camera").numbers, AT_ZERO);
    let rule = CameraRule { image: Some(RosImage::Rectified), ..CameraRule::default() };
    let words = read_by(&rule, "yaml", &unknown).expect_err("no P").to_string();
    assert!(
        words.contains("at P, with --image rectified: it is missing; give the rectified camera as fx,fy,cx,cy"),
        "{words}"
    );
    let own = "{\"width\": 640, \"height\": 480, \"fx\": 1, \"fy\": 1, \"cx\": 1, \"cy\": 1, \"pixel_centre\": 0, \"distortion\": [1, 0, 0, 0, 0]}";
    let own = own.replace("\": 1,", "\": 600,");
    assert!(read_by(&rule, "json", &own).expect_err("no P").to_string().contains("no camera of a rectified picture"));
}

#[test]
fn mistakes_name_file_position_and_remedy() {
    let own = |from: &str, to: &str| {
        let text = "{\"width\":640,\"height\":480,\"fx\":525,\"fy\":525,\"cx\":320,\"cy\":240,\"pixel_centre\":0.5}";
        text.replace(from, to)
    };
    for (kind, text, words) in [
        ("json", "{\"width\": 640,\n \"height\": 480}".to_owned(), "at the keys: no camera of a known kind"),
        ("json", "{\"fx\": 640,\n \"height\": 480}".to_owned(), "at width: it is missing"),
        ("json", own("\"width\":640", "\"high\":4"), "at high: a key that no camera file of graspmill has"),
        ("json", own("\"fy\":525", "\"fx\":525"), "the key `fx` is there twice"),
        ("json", "{".to_owned(), "line 1, column 1"),
        ("json", "[]".to_owned(), "no camera of a known kind"),
        ("json", own("0.5", "1"), "at pixel_centre: 1; it is 0 or 0.5"),
        ("json", own("\"fx\":525", "\"fx\":0"), "at fx: fx = 0.0 px: must lie between 6.4 and 64000 px"),
        ("json", own("\"fx\":525", "\"fx\":1e-300"), "must lie between 6.4 and 64000 px for an image of 640 x 480 px"),
        ("json", own("\"cx\":320", "\"cx\":1e300"), "must lie between -2880 and 3520 px"),
        ("json", own("640", "1e9"), "image size 1000000000 x 480 px"),
        ("json", own("640", "640.5"), "640.5 is no whole number"),
        ("json", own("525", "\"wide\""), "'wide' is no number"),
        ("json", own("}", ",\"distortion\":[1,2]}"), "at distortion: 2 numbers"),
        ("json", own("}", ",\"distortion\":[1,2,3,4,1e9]}"), "at k3: 1000000000"),
        ("json", "{\"width\":4,\"height\":4,\"intrinsic_matrix\":[4,0,5,0,4,5,0,0,1]}".to_owned(), "column by column"),
        ("json", "{\"intrinsic\":{},\"width\":4}".to_owned(), "at width: a camera beside that in `intrinsic`"),
        ("yaml", "height: 480\nK: [1]\n".to_owned(), "at width: it is missing"),
        ("yaml", "width: 640\nheight: 480\n".to_owned(), "no camera of a known kind"),
        ("yaml", String::new(), "the file: it is empty"),
        ("yaml", "width: 640\nheight: tall\nK: [1]".to_owned(), "at height (line 2): 'tall' is no number"),
        ("yaml", "width: 640\nheight: 480\nK: [1, 2]".to_owned(), "at K: 2 numbers"),
        ("yaml", "width: 640\nheight: 480\nK: [1, two]".to_owned(), "'two' is no number"),
        ("yaml", "width 640\n".to_owned(), "at line 1: 'width 640'; write `key: value`"),
        ("yaml", "K: &a [1]\n".to_owned(), "at line 1: '&a [1]'"),
        ("yaml", "K: [1, *a]\n".to_owned(), "'*' within a value"),
        ("yaml", "K: |\n  [1]\n".to_owned(), "at line 1: '|'"),
        ("yaml", "K: [1, 2\n".to_owned(), "no closing ']'"),
        ("yaml", "\tK: 1\n".to_owned(), "a tab before the key"),
        ("yaml", format!("K: {}1{}\n", "[".repeat(40), "]".repeat(40)), "more than 16 levels"),
        (
            "yaml",
            CALIBRATION.replace("0.03]", "0.03, 1, 2, 3]").replace("cols: 5", "cols: 8"),
            "plumb_bob with 8 numbers",
        ),
        ("yaml", CALIBRATION.replace("0.03]", "0.03, 1, 2, 3]"), "8 numbers for 1 rows of 5"),
        (
            "yaml",
            CALIBRATION.replace("-0.2, 0.001, 0.002, 0.03", "-0.2").replace("cols: 5", "cols: 2"),
            "2 numbers; it is k1, k2",
        ),
        ("yaml", MESSAGE.replacen("k: [615.2", "k: [615.3", 1), "document 2: another camera than the first one"),
        ("txt", String::new(), "unknown kind"),
    ] {
        let found = read(kind, &text).expect_err(words).to_string();
        assert!(found.contains(words) && found.contains(&format!("camera.{kind}")), "{words}: {found}");
    }
    for (text, words) in [
        ("1,2,3", "3 numbers"),
        ("1,2,x,4", "'x' is no number"),
        ("1,2,3,nan", "at cy: NaN"),
        ("-1,2,3,4", "at fx: -1"),
        ("nowhere.json", "cannot be read"),
    ] {
        let error = CameraDescription::parse(text).expect_err(words).to_string();
        assert!(error.contains(words) && error.contains(text), "{words}: {error}");
    }
}

fn statements(text: &str) -> Vec<Statement> {
    yaml::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

#[test]
fn yaml_is_read_as_json_with_the_same_content() {
    let without_lines = |statement: &Statement| {
        format!("{statement:?}")
            .split("line: ")
            .map(|part| part.trim_start_matches(|letter: char| letter.is_ascii_digit()).to_owned())
            .collect::<String>()
    };
    for (text, as_json) in [
        (
            "a: 1\nb: two words\nc:\n  d: [1, -2.5e3, three]\n  e: {f: 1, 'g h': [2]}\n",
            "{\"a\": 1, \"b\": \"two words\", \"c\": {\"d\": [1, \"-2.5e3\", \"three\"], \"e\": {\"f\": 1, \"g h\": [2]}}}",
        ),
        (
            "a:\n- 1\n- [2, 3]\nb:\n  - c: 1\n    d: 2\n  -\n    - 4\n",
            "{\"a\": [1, [2, 3]], \"b\": [{\"c\": 1, \"d\": 2}, [4]]}",
        ),
        (
            "# a comment\n\"a\": 'x # y' # more\nb: x#y\n\nc: \nd: \"\"\n",
            "{\"a\": \"x # y\", \"b\": \"x#y\", \"c\": null, \"d\": \"\"}",
        ),
        (
            "%YAML:1.0\n---\na: !!opencv-matrix\n   rows: 1\n   data: [ 1.,\n      2. ]\n...\n",
            "{\"a\": {\"rows\": 1, \"data\": [\"1.\", \"2.\"]}}",
        ),
        ("- - 1\n  - 2\n- 3\n", "[[1, 2], 3]"),
        ("a: http://host:80/x\nb: 12:30\n", "{\"a\": \"http://host:80/x\", \"b\": \"12:30\"}"),
    ] {
        let found = statements(text);
        assert_eq!(found.len(), 1, "{text}");
        let wanted = json::parse(as_json).expect("JSON");
        assert_eq!(without_lines(&found[0]), without_lines(&wanted), "{text}");
    }
    assert_eq!(statements("a: 1\n---\na: 2\n---\n").len(), 2);
    assert_eq!(statements("---\n\n# nothing\n").len(), 0);
}

proptest! {
    #[test]
    fn no_text_makes_a_reader_panic(text in ".{0,200}", changes in prop::collection::vec((any::<prop::sample::Index>(), ".{1}"), 0..8)) {
        for original in [text.as_str(), CALIBRATION, MESSAGE, OPENCV, KALIBR] {
            let mut letters: Vec<char> = original.chars().collect();
            for (index, letter) in changes.iter().filter(|_| !original.is_empty()) {
                let index = index.index(letters.len());
                letters[index] = letter.chars().next().expect("a letter");
            }
            let text: String = letters.into_iter().collect();
            let documents = [json::parse(&text).map(|document| vec![document]), yaml::parse(&text)];
            for documents in documents.into_iter().flatten() {
                for rule in [CameraRule::default(), entry("cam0")] {
                    if let Ok(camera) = rule.read_documents(&documents) {
                        prop_assert!(camera.numbers.iter().all(|value| value.is_finite()));
                    }
                }
            }
        }
    }
}
