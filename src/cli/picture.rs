//! Depth pictures of the command line: read with their camera, segmented, and described in `scene.json`.

use std::time::Instant;

use serde::Serialize;

use super::{
    completion_args::{ContainerName, PictureArgs, PixelCentre},
    exit::{Exit, Failure},
};
use kernel::{ids::Digest, words::Show};
use nalgebra::{Isometry3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use perception::{
    CENTRE_AT_HALF, CENTRE_AT_ZERO, CameraDescription, CameraRule, ClusterRule, Container, ContainerChoice, DepthFrame,
    FrameRule, LabelImage, LabelledFrame, MAX_OBJECTS, Outline, PartitionRule, Plane, PlaneChoice, PlaneRule,
    Rectification, SceneRule, SegmentedScene, Wall, read_frame,
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
    /// Largest distance of neighbouring points of one object [m].
    gap: f64,
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
    /// Origin of the plane's frame: the point nearest to the camera [m].
    position: [f64; 3],
    /// Unit quaternion w, x, y, z of the plane's frame in the camera's: z is the normal, x is nearest to the camera's x.
    quaternion: [f64; 4],
}

/// Container in `scene.json`.
#[derive(Serialize)]
pub struct ContainerRow {
    /// Height of the rim above the floor, which is the plane [m].
    rim: f64,
    /// Inner faces of the walls.
    walls: Vec<WallRow>,
    /// Pixels of walls and rim.
    pixels: usize,
}

/// Inner face of a wall in `scene.json`: normal . point + offset = 0.
#[derive(Serialize)]
struct WallRow {
    /// Unit normal into the container.
    normal: [f64; 3],
    /// Distance of the camera from the face, positive on the container's side [m].
    offset: f64,
    /// Whether the picture shows the face.
    seen: bool,
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
        let rule = scene_rule(arguments)?;
        let scene = SegmentedScene::segment(frame, &rule);
        let segment = milliseconds_since(began);
        if scene.clusters.len() > MAX_OBJECTS {
            let found = format!("{} objects, more than {MAX_OBJECTS}", scene.clusters.len());
            let message = format!("{}: {found}; raise --min-points or --gap", arguments.depth.shown());
            return Err(Failure::message(Exit::BadSpec, message));
        }
        let file = arguments.depth.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let (min_height, gap) = (arguments.min_height, rule.clusters.tolerance);
        Ok(Self { scene, read, segment, min_height, gap, digest, file })
    }

    /// The object that each pixel of the given picture shows.
    pub fn labels(&self) -> LabelImage {
        self.scene.labels(self.min_height)
    }

    /// The outline of each object.
    pub fn outlines(&self) -> Vec<Outline> {
        self.scene.outlines(self.gap, self.min_height)
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
            position: plane.foot().into(),
            quaternion: quaternion(&plane.normal),
        };
        self.scene.plane.map(row)
    }

    /// The container, if there is one.
    pub fn container_row(&self) -> Option<ContainerRow> {
        let row = |wall: &Wall| WallRow { normal: wall.normal.into(), offset: wall.offset, seen: wall.is_seen };
        self.scene.container.as_ref().map(|container| ContainerRow {
            rim: container.rim,
            walls: container.walls.iter().map(row).collect(),
            pixels: self.scene.container_pixels.len(),
        })
    }

    /// The plane and the container in words.
    pub fn plane_text(&self, arguments: &PictureArgs) -> String {
        match &self.scene.plane {
            Some(plane) => {
                let [x, y, z] = plane.normal.into();
                let share = 100.0 * plane.points as f64 / self.scene.frame.returns().count().max(1) as f64;
                let points = if plane.points > 0 { format!("{share:.0} % of the points") } else { "given".to_owned() };
                let container = self.scene.container.as_ref().map_or(String::new(), |container| {
                    let seen = container.walls.iter().filter(|wall| wall.is_seen).count();
                    format!("\ncontainer: {seen} walls, {:.0} mm high; the plane is its floor", 1e3 * container.rim)
                });
                let plane = format!("plane: normal {x:.3} {y:.3} {z:.3}, {:.3} m below the camera", plane.offset);
                format!("{plane}, {points}{container}")
            }
            None if arguments.no_plane => "plane: not searched".to_owned(),
            None => {
                "plane: none contains a tenth of the points, so all points belong to objects (set one with --plane)"
                    .to_owned()
            }
        }
    }
}

/// Unit quaternion w, x, y, z of a frame whose z is this unit vector, and whose x is nearest to the camera's x, or to its y.
fn quaternion(z: &Vector3<f64>) -> [f64; 4] {
    let helper = if z.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let x = (helper - z * z.dot(&helper)).normalize();
    let rotation = Rotation3::from_basis_unchecked(&[x, z.cross(&x), *z]);
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    [rotation.w, rotation.i, rotation.j, rotation.k]
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
    Ok(SceneRule { plane, container: container_choice(arguments)?, clusters, partition })
}

/// Camera pose in the world from seven numbers.
pub fn given_pose(option: &str, text: &str) -> Result<Isometry3<f64>, Failure> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|number| number.trim().parse().ok().filter(|number: &f64| number.is_finite())).collect();
    let numbers: Option<[f64; 7]> = numbers.and_then(|numbers| numbers.try_into().ok());
    let pose = numbers.and_then(|[x, y, z, w, i, j, k]| {
        let rotation = Quaternion::new(w, i, j, k);
        // Rounded numbers pass; a quaternion whose norm is far from 1 is refused.
        let is_unit = (rotation.norm() - 1.0).abs() < 1e-3;
        is_unit.then(|| Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_quaternion(rotation)))
    });
    pose.ok_or_else(|| {
        let remedy = "give seven numbers X,Y,Z,QW,QX,QY,QZ: a position in metres and a unit quaternion";
        Failure::message(Exit::BadSpec, format!("{option} {text}: {remedy}"))
    })
}

/// The container that the command line describes.
fn container_choice(arguments: &PictureArgs) -> Result<ContainerChoice, Failure> {
    let wrong = |problem: &str| Err(Failure::message(Exit::BadSpec, problem.to_owned()));
    match (arguments.container, &arguments.container_pose) {
        (ContainerName::Auto, None) => Ok(ContainerChoice::Find),
        (ContainerName::Off, None) => Ok(ContainerChoice::Without),
        (ContainerName::Size(size), Some(text)) => {
            let pose = given_pose("--container-pose", text)?;
            let container = Container::from_size(size, pose.translation.vector.into(), pose.rotation);
            container.map_or_else(
                || wrong("--container: the box has no size"),
                |container| Ok(ContainerChoice::Given(container)),
            )
        }
        (ContainerName::Size(_), None) => wrong(
            "--container with a size also needs --container-pose X,Y,Z,QW,QX,QY,QZ; without a size, the walls are found",
        ),
        (_, Some(_)) => wrong("--container-pose also needs the size of the box, such as --container 0.45x0.35x0.2"),
    }
}

fn given_plane(text: &str) -> Result<Plane, Failure> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    let numbers: Option<[f64; 4]> = numbers.and_then(|numbers| numbers.try_into().ok());
    numbers.and_then(Plane::from_numbers).ok_or_else(|| {
        let remedy = "give four numbers NX,NY,NZ,D, such as 0,-0.8,-0.6,0.7: a normal and a distance in metres";
        Failure::message(Exit::BadSpec, format!("--plane {text}: {remedy}"))
    })
}
