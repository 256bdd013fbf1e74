//! Keys of camera files: which are read, which are ignored and why, and which are refused. docs/completing.md has the same table.

use std::fmt;

use super::{
    problem::CameraProblem,
    statement::{Statement, Value},
};

/// A kind of camera file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CameraFormat {
    /// graspmill's own description.
    Graspmill,
    /// Open3D's pinhole cameras, and the metadata of its recorders.
    Open3d,
    /// `camera.json` of a BOP dataset.
    BopCamera,
    /// `scene_camera.json` of a BOP dataset: a camera per image.
    BopSceneCamera,
    /// `rs2_intrinsics` of librealsense, of one stream or several.
    RealSense,
    /// Calibration data that the RealSense Viewer saves: a camera per image size.
    RealSenseTable,
    /// A printed `sensor_msgs/CameraInfo` of ROS.
    CameraInfo,
    /// A calibration by OpenCV or by `camera_calibration` of ROS.
    Calibration,
    /// A camera chain of Kalibr.
    Kalibr,
}

/// Treatment of a key, with the reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyTreatment {
    /// The key counts; values that are not understood are refused.
    Read(&'static str),
    /// The key changes nothing that is made of a depth picture.
    Ignored(&'static str),
    /// The key would change what is made, and is not read.
    Refused(&'static str),
}

/// A key of a camera file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraKey {
    /// The kind of file.
    pub format: CameraFormat,
    /// The key; one below another one has both, as `roi.width`. `N` means a number, and `*` any ending.
    pub key: &'static str,
    /// Treatment of the key.
    pub treatment: KeyTreatment,
}

use CameraFormat::{
    BopCamera, BopSceneCamera, Calibration, CameraInfo, Graspmill, Kalibr, Open3d, RealSense, RealSenseTable,
};
use KeyTreatment::{Ignored, Read, Refused};

/// A row of the table.
const fn key(format: CameraFormat, key: &'static str, treatment: KeyTreatment) -> CameraKey {
    CameraKey { format, key, treatment }
}

const SIZE: KeyTreatment = Read("size of the image; it must be the picture's");
const FOCAL: KeyTreatment = Read("focal length in pixels");
const PRINCIPAL: KeyTreatment = Read("principal point in pixels");
const POSE: KeyTreatment = Ignored("the camera's pose: all numbers are in the camera's frame");
const NAME: KeyTreatment = Ignored("a name");
const RECORD: KeyTreatment = Ignored("a record of how the calibration was made");
const RAW_IMAGERS: KeyTreatment = Ignored("about the raw infrared pictures; depth is computed on the rectified ones");
const MODEL_ROS: KeyTreatment =
    Read("`plumb_bob`, `rational_polynomial`, or nothing; every other model is refused, whatever its coefficients");
const COEFFICIENTS: KeyTreatment =
    Read("k1, k2, p1, p2, k3, k4, k5, k6 are undone; more of OpenCV's (thin prism, tilt) must be 0");
const RECTIFICATION: KeyTreatment = Read("the identity, or `--image` selects the picture");
const PROJECTION: KeyTreatment = Read(
    "equal to K, or `--image` selects the picture; that of a rectified picture is its camera; Tx and Ty are ignored: poses",
);
const BINNING: KeyTreatment = Read("0 or 1; with more, the numbers belong to a larger picture");
const REGION: KeyTreatment = Read("all of the picture: 0, or its size; a part of it is refused");

/// Every key, by format.
pub static CAMERA_KEYS: &[CameraKey] = &[
    key(Graspmill, "width", SIZE),
    key(Graspmill, "height", SIZE),
    key(Graspmill, "fx", FOCAL),
    key(Graspmill, "fy", FOCAL),
    key(Graspmill, "cx", PRINCIPAL),
    key(Graspmill, "cy", PRINCIPAL),
    key(
        Graspmill,
        "pixel_centre",
        Read("0 or 0.5, the coordinate of the first pixel's centre; `--pixel-centre` is the alternative"),
    ),
    key(Graspmill, "distortion", Read("k1, k2, p1, p2, k3, or these and k4, k5, k6")),
    key(
        Graspmill,
        "depth_scale",
        Refused("BOP's, in millimetres, but a file of BOP has no `pixel_centre`: leave one of the two out"),
    ),
    key(Open3d, "width", SIZE),
    key(Open3d, "height", SIZE),
    key(Open3d, "intrinsic_matrix", Read("fx, 0, 0, 0, fy, 0, cx, cy, 1, column by column")),
    key(Open3d, "intrinsic", Read("a camera inside of `PinholeCameraParameters`")),
    key(Open3d, "intrinsic.width", SIZE),
    key(Open3d, "intrinsic.height", SIZE),
    key(Open3d, "intrinsic.intrinsic_matrix", Read("as `intrinsic_matrix`")),
    key(Open3d, "class_name", Ignored("repeats the other keys")),
    key(Open3d, "version_major", RECORD),
    key(Open3d, "version_minor", RECORD),
    key(Open3d, "extrinsic", POSE),
    key(
        Open3d,
        "depth_scale",
        Read("units per metre, from 1; below 1, metres per unit, as an older recorder writes it"),
    ),
    key(Open3d, "color_format", Ignored("about the colour picture")),
    key(Open3d, "depth_format", Ignored("the picture's own head has it")),
    key(Open3d, "device_name", NAME),
    key(Open3d, "serial_number", NAME),
    key(Open3d, "fps", Ignored("about time")),
    key(Open3d, "stream_length_usec", Ignored("about time")),
    key(BopCamera, "width", SIZE),
    key(BopCamera, "height", SIZE),
    key(BopCamera, "fx", FOCAL),
    key(BopCamera, "fy", FOCAL),
    key(BopCamera, "cx", PRINCIPAL),
    key(BopCamera, "cy", PRINCIPAL),
    key(BopCamera, "depth_scale", Read("millimetres per unit of depth")),
    key(BopSceneCamera, "cam_K", Read("fx, 0, cx, 0, fy, cy, 0, 0, 1, row by row")),
    key(BopSceneCamera, "depth_scale", Read("millimetres per unit of depth")),
    key(BopSceneCamera, "cam_R_w2c", POSE),
    key(BopSceneCamera, "cam_t_w2c", POSE),
    key(BopSceneCamera, "view_level", RECORD),
    key(BopSceneCamera, "cam_model", Refused("another camera model than a pinhole's")),
    key(RealSense, "width", SIZE),
    key(RealSense, "height", SIZE),
    key(RealSense, "fx", FOCAL),
    key(RealSense, "fy", FOCAL),
    key(RealSense, "ppx", PRINCIPAL),
    key(RealSense, "ppy", PRINCIPAL),
    key(
        RealSense,
        "model",
        Read(
            "`none`, `brown_conrady`; `inverse_brown_conrady` and `modified_brown_conrady` with zeros; every other model is refused, whatever its coefficients",
        ),
    ),
    key(RealSense, "coeffs", Read("k1, k2, p1, p2, k3")),
    key(RealSenseTable, "rectified.N.width", Read("size of the image; `--camera WxH` chooses it")),
    key(RealSenseTable, "rectified.N.height", Read("size of the image; `--camera WxH` chooses it")),
    key(RealSenseTable, "rectified.N.fx", FOCAL),
    key(RealSenseTable, "rectified.N.fy", FOCAL),
    key(RealSenseTable, "rectified.N.ppx", PRINCIPAL),
    key(RealSenseTable, "rectified.N.ppy", PRINCIPAL),
    key(RealSenseTable, "baseline", Ignored("the distance between the two infrared cameras")),
    key(RealSenseTable, "intrinsic_left.*", RAW_IMAGERS),
    key(RealSenseTable, "intrinsic_right.*", RAW_IMAGERS),
    key(RealSenseTable, "world2left_rot.*", RAW_IMAGERS),
    key(RealSenseTable, "world2right_rot.*", RAW_IMAGERS),
    key(CameraInfo, "width", SIZE),
    key(CameraInfo, "height", SIZE),
    key(CameraInfo, "K", Read("fx, 0, cx, 0, fy, cy, 0, 0, 1, row by row; `k` in ROS 2; skew is refused")),
    key(CameraInfo, "distortion_model", MODEL_ROS),
    key(CameraInfo, "D", COEFFICIENTS),
    key(CameraInfo, "R", RECTIFICATION),
    key(CameraInfo, "P", PROJECTION),
    key(CameraInfo, "binning_x", BINNING),
    key(CameraInfo, "binning_y", BINNING),
    key(CameraInfo, "roi", Read("the region of interest, by its keys")),
    key(CameraInfo, "roi.x_offset", REGION),
    key(CameraInfo, "roi.y_offset", REGION),
    key(CameraInfo, "roi.width", REGION),
    key(CameraInfo, "roi.height", REGION),
    key(CameraInfo, "roi.do_rectify", Ignored("about a region that is a part of the picture")),
    key(CameraInfo, "header", Ignored("time and a name")),
    key(Calibration, "image_width", SIZE),
    key(Calibration, "image_height", SIZE),
    key(Calibration, "camera_matrix", Read("fx, 0, cx, 0, fy, cy, 0, 0, 1, row by row; skew is refused")),
    key(Calibration, "distortion_model", MODEL_ROS),
    key(Calibration, "distortion_coefficients", COEFFICIENTS),
    key(Calibration, "rectification_matrix", RECTIFICATION),
    key(Calibration, "projection_matrix", PROJECTION),
    key(Calibration, "fisheye_model", Read("0; a fisheye's coefficients mean something else")),
    key(Calibration, "camera_name", NAME),
    key(Calibration, "calibration_time", RECORD),
    key(Calibration, "nframes", RECORD),
    key(Calibration, "nr_of_frames", RECORD),
    key(Calibration, "board_width", RECORD),
    key(Calibration, "board_height", RECORD),
    key(Calibration, "square_size", RECORD),
    key(Calibration, "marker_size", RECORD),
    key(Calibration, "aspectRatio", RECORD),
    key(Calibration, "fix_aspect_ratio", RECORD),
    key(Calibration, "flags", RECORD),
    key(Calibration, "avg_reprojection_error", RECORD),
    key(Calibration, "per_view_reprojection_errors", RECORD),
    key(Calibration, "extrinsic_parameters", RECORD),
    key(Calibration, "image_points", RECORD),
    key(Calibration, "grid_points", RECORD),
    key(Kalibr, "camera_model", Read("`pinhole`; `omni`, `eucm`, `ds` and others are refused")),
    key(Kalibr, "intrinsics", Read("fx, fy, cx, cy in pixels")),
    key(
        Kalibr,
        "distortion_model",
        Read("`radtan` or `none`; `equidistant`, `fov` and others are refused, whatever their coefficients"),
    ),
    key(Kalibr, "distortion_coeffs", Read("k1, k2, p1, p2")),
    key(Kalibr, "resolution", Read("width and height of the image; they must be the picture's")),
    key(Kalibr, "cam_overlaps", Ignored("which cameras see the same")),
    key(Kalibr, "rostopic", NAME),
    key(Kalibr, "T_cn_cnm1", POSE),
    key(Kalibr, "T_cam_imu", POSE),
    key(Kalibr, "timeshift_cam_imu", Ignored("about time")),
];

impl CameraFormat {
    /// Every kind of file.
    pub const ALL: [Self; 9] =
        [Graspmill, Open3d, BopCamera, BopSceneCamera, RealSense, RealSenseTable, CameraInfo, Calibration, Kalibr];

    /// The name of it for people.
    pub fn name(self) -> &'static str {
        match self {
            Graspmill => "graspmill",
            Open3d => "Open3D",
            BopCamera => "BOP `camera.json`",
            BopSceneCamera => "BOP `scene_camera.json`",
            RealSense => "RealSense intrinsics",
            RealSenseTable => "RealSense calibration data",
            CameraInfo => "ROS `camera_info`",
            Calibration => "OpenCV and ROS calibration",
            Kalibr => "Kalibr",
        }
    }

    /// Content of such a file, as a remedy.
    pub(super) fn remedy(self) -> &'static str {
        match self {
            Graspmill => "a camera is width, height, fx, fy, cx, cy and pixel_centre, with distortion if there is any",
            Open3d => {
                "a camera of Open3D is width, height and intrinsic_matrix: fx, 0, 0, 0, fy, 0, cx, cy, 1, column by column"
            }
            BopCamera => "a camera.json of BOP is width, height, fx, fy, cx, cy and depth_scale",
            BopSceneCamera => {
                "a scene_camera.json of BOP has cam_K of nine numbers, row by row, and depth_scale for each image"
            }
            RealSense => "intrinsics of RealSense are width, height, fx, fy, ppx, ppy, model and five coeffs",
            RealSenseTable => "calibration data of RealSense have rectified.N.width, height, fx, fy, ppx and ppy",
            CameraInfo => {
                "a camera_info has width, height, K of nine numbers, and D of the model plumb_bob or rational_polynomial"
            }
            Calibration => {
                "a calibration has image_width, image_height, camera_matrix of nine numbers and distortion_coefficients"
            }
            Kalibr => {
                "a camera of Kalibr has camera_model, intrinsics (fx, fy, cx, cy), distortion_model, distortion_coeffs and resolution"
            }
        }
    }
}

impl fmt::Display for CameraFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl KeyTreatment {
    /// The treatment in one word, and its reason.
    pub fn words(self) -> (&'static str, &'static str) {
        match self {
            Read(why) => ("read", why),
            Ignored(why) => ("ignored", why),
            Refused(why) => ("refused", why),
        }
    }
}

/// Refuses keys that no row of a format reads or ignores. `name_of` gives the name of a key in the table.
pub(super) fn check_keys(
    format: CameraFormat,
    camera: &Statement,
    name_of: &dyn Fn(&str) -> String,
) -> Result<(), CameraProblem> {
    check_level(format, camera, "", name_of)
}

fn check_level(
    format: CameraFormat,
    level: &Statement,
    above: &str,
    name_of: &dyn Fn(&str) -> String,
) -> Result<(), CameraProblem> {
    for (written, value) in level.keys() {
        let name = format!("{above}{}", name_of(written));
        let place = || value.place(&format!("{above}{written}"));
        match CAMERA_KEYS.iter().find(|row| row.format == format && row.key == name).map(|row| row.treatment) {
            Some(Read(_)) => {
                let has_rows_below = CAMERA_KEYS.iter().any(|row| {
                    row.format == format && row.key.strip_prefix(&name).is_some_and(|rest| rest.starts_with('.'))
                });
                if has_rows_below && matches!(value.value, Value::Map(_)) {
                    check_level(format, value, &format!("{name}."), name_of)?;
                }
            }
            Some(Ignored(_)) => {}
            Some(Refused(why)) => {
                return Err(CameraProblem::content(place(), format!("a key of {format} that is not read"), why));
            }
            None => {
                let found = format!("a key that no camera file of {format} has");
                let remedy = "delete it if it changes nothing about where pixels see; else rectify the picture and give fx,fy,cx,cy";
                return Err(CameraProblem::content(place(), found, remedy));
            }
        }
    }
    Ok(())
}
