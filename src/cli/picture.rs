//! Depth pictures of the command line: read with their camera, segmented, and described in `scene.json`.

use std::time::Instant;

use serde::Serialize;

use super::{
    completion_args::{PictureArgs, PixelCentre},
    exit::{Exit, Failure},
};
use kernel::{ids::Digest, words::Show};
use perception::{
    CENTRE_AT_HALF, CENTRE_AT_ZERO, CameraDescription, CameraRule, ClusterRule, DepthFrame, FrameRule, LabelImage,
    LabelledFrame, MAX_OBJECTS, PartitionRule, Plane, PlaneChoice, PlaneRule, Rectification, SceneRule, SegmentedScene,
    read_frame,
};

/// Frame of every number in `scene.json`.
pub const FRAME: &str = "the camera's: x right, y down, z forward; metres; pixel centres at 0.5";
/// Picture whose pixel coordinates `scene.json` and the files next to it use.
const PIXELS: &str = "of the given picture: columns and rows from 0, the last included";

/// A segmented picture, with the time it took.
pub struct SegmentedPicture {
    pub scene: SegmentedScene,
    /// Reading the file [ms].
    pub read: f64,
    /// Plane and clusters [ms].
    pub segment: f64,
    /// Height above the plane up to which points belong to it [m].
    min_height: f64,
    digest: Digest,
    file: String,
}

/// Picture in `scene.json`.
#[derive(Serialize)]
pub struct PictureRow {
    /// Name of the file.
    file: String,
    /// BLAKE3 of its bytes.
    digest: Digest,
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    /// Distortion k1, k2, p1, p2, k3, k4, k5, k6 of the given picture, if it was removed.
    #[serde(skip_serializing_if = "Option::is_none")]
    distortion: Option<[f64; 8]>,
    /// Picture whose pixel coordinates are used.
    pixels: &'static str,
    /// Pixels with a return.
    returns: usize,
}

/// Plane in `scene.json`: normal . point + offset = 0.
#[derive(Serialize)]
pub struct PlaneRow {
    normal: [f64; 3],
    /// Height of the camera above it [m].
    offset: f64,
    /// Points of the plane; `None` if the plane was given.
    points: Option<usize>,
}

impl SegmentedPicture {
    /// Refuses settings that fit no picture.
    pub fn check_settings(arguments: &PictureArgs) -> Result<(), Failure> {
        arguments.intrinsics.as_deref().map(|text| camera(text, arguments)).transpose()?;
        scene_rule(arguments).map(|_| ())
    }

    /// Reads and segments the picture.
    pub fn open(arguments: &PictureArgs) -> Result<Self, Failure> {
        let camera = arguments.intrinsics.as_deref().map(|text| camera(text, arguments)).transpose()?;
        let began = Instant::now();
        let (depth_scale, is_range, is_flipped) = (arguments.depth_scale, arguments.range, arguments.flip);
        let rule = FrameRule { camera, depth_scale, is_range, is_flipped };
        let LabelledFrame { frame, digest, .. } = read_frame(&arguments.depth, &rule).map_err(Failure::of_input)?;
        let read = milliseconds_since(began);
        let began = Instant::now();
        let scene = SegmentedScene::segment(frame, &scene_rule(arguments)?);
        let segment = milliseconds_since(began);
        if scene.clusters.len() > MAX_OBJECTS {
            let found = format!("{} objects, more than {MAX_OBJECTS}", scene.clusters.len());
            let message = format!("{}: {found}; raise --min-points or --gap", arguments.depth.shown());
            return Err(Failure::message(Exit::BadSpec, message));
        }
        let file = arguments.depth.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { scene, read, segment, min_height: arguments.min_height, digest, file })
    }

    /// The object that each pixel of the given picture shows.
    pub fn labels(&self) -> LabelImage {
        self.scene.labels(self.min_height)
    }

    /// The picture and its camera.
    pub fn picture_row(&self) -> PictureRow {
        let DepthFrame { camera, rectification, .. } = &self.scene.frame;
        let distortion = rectification.as_ref().map(Rectification::distortion);
        PictureRow {
            file: self.file.clone(),
            digest: self.digest,
            width: camera.width,
            height: camera.height,
            fx: camera.fx,
            fy: camera.fy,
            cx: camera.cx,
            cy: camera.cy,
            distortion: distortion.map(|distortion| distortion.coefficients().map(|(_, value)| value)),
            pixels: PIXELS,
            returns: self.scene.frame.returns().count(),
        }
    }

    /// The plane, if there is one.
    pub fn plane_row(&self) -> Option<PlaneRow> {
        let row = |plane: Plane| PlaneRow {
            normal: plane.normal.into(),
            offset: plane.offset,
            points: (plane.points > 0).then_some(plane.points),
        };
        self.scene.plane.map(row)
    }

    /// The plane in words.
    pub fn plane_text(&self, arguments: &PictureArgs) -> String {
        match &self.scene.plane {
            Some(plane) => {
                let [x, y, z] = plane.normal.into();
                let share = 100.0 * plane.points as f64 / self.scene.frame.returns().count().max(1) as f64;
                let points = if plane.points > 0 { format!("{share:.0} % of the points") } else { "given".to_owned() };
                format!("plane: normal {x:.3} {y:.3} {z:.3}, {:.3} m below the camera, {points}", plane.offset)
            }
            None if arguments.no_plane => "plane: not searched".to_owned(),
            None => {
                "plane: none contains a tenth of the points, so all points belong to objects (set one with --plane)"
                    .to_owned()
            }
        }
    }
}

/// Milliseconds since `began`.
pub fn milliseconds_since(began: Instant) -> f64 {
    began.elapsed().as_secs_f64() * 1e3
}

/// The camera that the command line describes.
fn camera(text: &str, arguments: &PictureArgs) -> Result<CameraDescription, Failure> {
    let pixel_centre = arguments.pixel_centre.map(|centre| match centre {
        PixelCentre::Zero => CENTRE_AT_ZERO,
        PixelCentre::Half => CENTRE_AT_HALF,
    });
    let rule = CameraRule { entry: arguments.camera.clone(), pixel_centre, image: arguments.image.map(Into::into) };
    rule.parse(text).map_err(Failure::of_input)
}

fn scene_rule(arguments: &PictureArgs) -> Result<SceneRule, Failure> {
    let plane = match &arguments.plane {
        Some(text) => PlaneChoice::Given(given_plane(text)?),
        None if arguments.no_plane => PlaneChoice::Without,
        None => PlaneChoice::Find(PlaneRule::default()),
    };
    let partition = arguments.concavity.0.map(|concavity| PartitionRule { concavity });
    let default_gap = if partition.is_some() { PartitionRule::GAP } else { ClusterRule::default().tolerance };
    let clusters = ClusterRule {
        tolerance: arguments.gap.unwrap_or(default_gap),
        min_height: arguments.min_height,
        min_points: arguments.min_points as usize,
    };
    Ok(SceneRule { plane, clusters, partition })
}

fn given_plane(text: &str) -> Result<Plane, Failure> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    let numbers: Option<[f64; 4]> = numbers.and_then(|numbers| numbers.try_into().ok());
    numbers.and_then(Plane::from_numbers).ok_or_else(|| {
        let remedy = "give four numbers NX,NY,NZ,D, such as 0,-0.8,-0.6,0.7: a normal and a distance in metres";
        Failure::message(Exit::BadSpec, format!("--plane {text}: {remedy}"))
    })
}
