//! Cameras of a document: which kind of file it is, and how each of them is read.

use super::{
    bop, kalibr, open3d, own, realsense,
    ros::{self, RosImage},
};
use crate::camera::{description::CameraDescription, keys::CameraFormat, problem::CameraProblem, statement::Statement};

/// Kinds of files that hold cameras by name.
const SEVERAL: [CameraFormat; 3] = [CameraFormat::BopSceneCamera, CameraFormat::Kalibr, CameraFormat::RealSense];

/// Statements of one camera, not yet read.
pub(crate) struct Entry<'a> {
    pub(crate) format: CameraFormat,
    /// Name of the camera in a file of several; empty in a file of one.
    pub(crate) name: String,
    statement: &'a Statement,
    /// Number of the camera in the calibration data of RealSense, whose keys have no levels.
    number: &'a str,
}

/// The cameras of a document.
pub(crate) fn entries(document: &Statement) -> Result<Vec<Entry<'_>>, CameraProblem> {
    match format_of(document) {
        Some(format @ CameraFormat::RealSenseTable) => {
            let sizes = realsense::sizes_of_table(document)?.into_iter();
            Ok(sizes.map(|(name, number)| Entry { format, name, statement: document, number }).collect())
        }
        Some(format) => Ok(vec![Entry { format, name: String::new(), statement: document, number: "" }]),
        None => named_entries(document),
    }
}

/// Cameras of a document whose keys are their names, all of one kind.
fn named_entries(document: &Statement) -> Result<Vec<Entry<'_>>, CameraProblem> {
    let of_first = document.keys().first().and_then(|(_, first)| format_of(first));
    let Some(format) = of_first.filter(|format| SEVERAL.contains(format)) else {
        let known = CameraFormat::ALL.map(CameraFormat::name).join(", ");
        let remedy = format!("give fx,fy,cx,cy, or a file of one of these kinds: {known}");
        return Err(CameraProblem::content("the keys", "no camera of a known kind", remedy));
    };
    let named = document.keys().iter().map(|(name, statement)| {
        // A key that holds no camera among those that do is not dropped.
        if format_of(statement) != Some(format) {
            let found = format!("no camera of {format}");
            return Err(CameraProblem::content(statement.place(name), found, format.remedy()));
        }
        Ok(Entry { format, name: name.clone(), statement, number: "" })
    });
    named.collect()
}

/// The kind of a camera by its keys.
fn format_of(camera: &Statement) -> Option<CameraFormat> {
    let has = |key: &str| camera.has(key);
    if has("intrinsic_matrix") || has("intrinsic") {
        Some(CameraFormat::Open3d)
    } else if has("ppx") || has("ppy") {
        Some(CameraFormat::RealSense)
    } else if camera.keys().iter().any(|(key, _)| key.starts_with("rectified.")) {
        Some(CameraFormat::RealSenseTable)
    } else if has("cam_K") {
        Some(CameraFormat::BopSceneCamera)
    } else if has("K") || has("k") {
        Some(CameraFormat::CameraInfo)
    } else if has("camera_matrix") {
        Some(CameraFormat::Calibration)
    } else if has("camera_model") && has("intrinsics") {
        Some(CameraFormat::Kalibr)
    } else if has("depth_scale") && !has("pixel_centre") && has("fx") {
        // It differs from the next one by half a pixel, and by these keys.
        Some(CameraFormat::BopCamera)
    } else if has("fx") || has("fy") {
        Some(CameraFormat::Graspmill)
    } else {
        None
    }
}

impl Entry<'_> {
    /// Reads the camera. `pixel_centre` is used if the file states none.
    pub(crate) fn read(
        &self,
        pixel_centre: Option<f64>,
        image: Option<RosImage>,
    ) -> Result<CameraDescription, CameraProblem> {
        let statement = self.statement;
        let camera = match self.format {
            CameraFormat::Graspmill => own::read(statement, pixel_centre)?,
            CameraFormat::Open3d => open3d::read(statement)?,
            CameraFormat::BopCamera => bop::read_camera(statement)?,
            CameraFormat::BopSceneCamera => bop::read_image(statement)?,
            CameraFormat::RealSense => realsense::read(statement)?,
            CameraFormat::RealSenseTable => realsense::read_of_table(statement, self.number)?,
            CameraFormat::CameraInfo => return ros::read_info(statement, image),
            CameraFormat::Calibration => return ros::read_calibration(statement, image),
            CameraFormat::Kalibr => kalibr::read(statement)?,
        };
        if image == Some(RosImage::Rectified) && !camera.distortion.is_none() {
            let found = format!("{} has no camera of a rectified picture", self.format);
            return Err(CameraProblem::content("--image rectified", found, "give the rectified camera as fx,fy,cx,cy"));
        }
        Ok(camera)
    }
}
