//! Arguments of the commands about depth pictures and completion models.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum, ValueHint};

use super::local_path::{folder, local_path};
use kernel::files::Folder;
use perception::{RosImage, is_depth_scale};
use runtime::completion::{Detail, LaplacianRule, NeighbourWeights};

/// Depth picture, its camera, and settings of the segmentation.
#[derive(Args, Clone, Debug)]
pub struct PictureArgs {
    /// Depth picture: 16-bit PNG, NPY, or an organised cloud (PCD, PLY). `complete` also accepts a dataset folder.
    pub depth: PathBuf,
    /// Camera of an image: four numbers in pixels, or a JSON or YAML file of graspmill, ROS (camera_info, calibration), OpenCV,
    /// RealSense, Open3D, BOP or Kalibr. A cloud needs none.
    #[arg(long, value_name = "FX,FY,CX,CY|FILE")]
    pub intrinsics: Option<String>,
    /// Camera to use from a file with several: image number in a BOP scene_camera.json, camera name in a Kalibr chain, stream or
    /// image size of RealSense.
    #[arg(long, value_name = "NAME", requires = "intrinsics")]
    pub camera: Option<String>,
    /// Kind of picture for a ROS camera whose raw and rectified pictures have different intrinsics: raw (K and D) or rectified
    /// (P).
    #[arg(long, value_name = "raw|rectified", requires = "intrinsics")]
    pub image: Option<ImageName>,
    /// Coordinate of the first pixel's centre in the convention of cx and cy: 0 (OpenCV, ROS, RealSense, Open3D, BOP, Kalibr) or
    /// 0.5. Default: 0 for numbers and foreign files; a graspmill file states it.
    #[arg(long, value_name = "0|0.5", requires = "intrinsics")]
    pub pixel_centre: Option<PixelCentre>,
    /// Metres per unit of the file. Default: the value in the camera file, or else 0.001 for integers; 1 for floats and clouds.
    #[arg(long, value_name = "METRES", value_parser = depth_scale)]
    pub depth_scale: Option<f64>,
    /// Read the values as distances from the camera's centre instead of depths along its axis.
    #[arg(long)]
    pub range: bool,
    /// Mirror y and z, for a cloud whose camera looks along -z with y up (OpenGL axes).
    #[arg(long)]
    pub flip: bool,
    /// Support plane of the objects, instead of the largest plane in the picture: NX x + NY y + NZ z + D = 0 in the camera's
    /// frame (x right, y down, z forward), in metres.
    #[arg(long, value_name = "NX,NY,NZ,D", allow_hyphen_values = true, conflicts_with = "no_plane")]
    pub plane: Option<String>,
    /// Do not search for a plane: all points belong to objects.
    #[arg(long)]
    pub no_plane: bool,
    /// Container that the objects are in: `auto` finds the walls of a bin in the picture, `off` keeps walls as objects, and the inner
    /// size of a box in metres, such as 0.45x0.35x0.2, needs --container-pose.
    #[arg(long, value_name = "auto|off|WIDTHxDEPTHxHEIGHT", default_value = "auto", value_parser = container)]
    pub container: ContainerName,
    /// Pose of that box in the camera's frame (x right, y down, z forward): the middle of its floor [m], and the unit quaternion of
    /// its axes along width, depth and height.
    #[arg(long, value_name = "X,Y,Z,QW,QX,QY,QZ", allow_hyphen_values = true, conflicts_with_all = ["plane", "no_plane"])]
    pub container_pose: Option<String>,
    /// Largest distance between neighbouring points of one object. Default: 0.012, or 0.02 with --concavity off.
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub gap: Option<f64>,
    /// Smallest angle of a concave edge between two touching objects, below 180; `off` separates objects by distance alone.
    #[arg(long, value_name = "DEGREES|off", default_value = "30", value_parser = concavity)]
    pub concavity: Concavity,
    /// Height above the plane up to which points belong to the plane.
    #[arg(long, value_name = "METRES", default_value_t = 0.008, value_parser = positive)]
    pub min_height: f64,
    /// Minimum number of points per object; smaller clusters are ignored.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub min_points: u32,
}

/// Smallest angle of a concave edge that separates objects [degree]; `None` to separate them by distance alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Concavity(pub Option<f64>);

/// Container around the objects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContainerName {
    /// Found in the picture, if it shows one.
    Auto,
    /// None.
    Off,
    /// A box of this inner size [m].
    Size([f64; 3]),
}

/// Coordinate of the first pixel's centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PixelCentre {
    /// Convention of OpenCV, ROS, RealSense and Open3D.
    #[value(name = "0")]
    Zero,
    /// Convention of graspmill.
    #[value(name = "0.5")]
    Half,
}

/// Picture of a ROS camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ImageName {
    /// The picture as the sensor took it (image_raw).
    Raw,
    /// The rectified picture (image_rect).
    Rectified,
}

impl From<ImageName> for RosImage {
    fn from(name: ImageName) -> Self {
        match name {
            ImageName::Raw => Self::Raw,
            ImageName::Rectified => Self::Rectified,
        }
    }
}

/// A unit of depth [m].
fn depth_scale(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| is_depth_scale(*number));
    number.ok_or_else(|| "give metres per unit, from 1e-7 to 10, such as 0.001".to_owned())
}

/// An angle of concave edges; half a turn separates nothing by its edges.
fn concavity(text: &str) -> Result<Concavity, String> {
    if text == "off" {
        return Ok(Concavity(None));
    }
    let angle = text.parse().ok().filter(|angle: &f64| *angle > 0.0 && *angle <= 180.0);
    let angle = angle.ok_or_else(|| "give an angle in degrees above 0 and up to 180, or off".to_owned())?;
    Ok(Concavity((angle < 180.0).then_some(angle)))
}

/// A container, or the inner size of a box.
fn container(text: &str) -> Result<ContainerName, String> {
    match text {
        "auto" => return Ok(ContainerName::Auto),
        "off" => return Ok(ContainerName::Off),
        _ => {}
    }
    let lengths: Option<Vec<f64>> = text.split('x').map(|length| positive(length).ok()).collect();
    let size = lengths.and_then(|lengths| lengths.try_into().ok());
    size.map(ContainerName::Size)
        .ok_or_else(|| "give auto, off, or three lengths in metres such as 0.45x0.35x0.2".to_owned())
}

/// A number above 0.
fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| "give a number above 0".to_owned())
}

#[derive(Args, Debug)]
pub struct CompleteArgs {
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Model folder, to use instead of the network in this program.
    #[arg(long, value_name = "DIR")]
    pub model: Option<PathBuf>,
    /// Method to use instead of a model folder: bundled, the network in this program (the default); partial, extrude, hull,
    /// hull-to-table, extrude-to-table, mirror-far, mirror, mirror-shell, primitive. The ending +smooth, as in hull+smooth,
    /// smooths its meshes.
    #[arg(long, value_name = "NAME", conflicts_with = "model")]
    pub method: Option<String>,
    /// Object to grasp: `auto` (the one nearest to the picture's middle), `all`, its number by size from 1, a pixel (column, row)
    /// on it, or a mask of its pixels: a grey PNG of the picture's size, 0 elsewhere. Pixels count from 0 in the picture as
    /// given, with whole numbers at pixel centres. The other objects become obstacles, which are computed faster and are up to
    /// one cell larger.
    #[arg(long, value_name = "auto|all|N|U,V|MASK.png", default_value = "auto", allow_hyphen_values = true)]
    pub target: String,
    /// Contact points on the target: a CSV file with the columns x, y, z [m] in the camera's frame.
    #[arg(long, value_name = "FILE.csv")]
    pub touch: Option<PathBuf>,
    /// Pose of the camera in the world, whose z points up: position [m] and unit quaternion of the camera's frame (x right,
    /// y down, z forward). Recorded in scene.json; scene.xml then uses the world frame.
    #[arg(long, value_name = "X,Y,Z,QW,QX,QY,QZ", allow_hyphen_values = true)]
    pub camera_pose: Option<String>,
    /// Complete only samples of this split of a dataset (training, holdout, validation, test).
    #[arg(long, value_name = "SPLIT")]
    pub split: Option<String>,
    /// Maximum number of samples of a dataset, spread evenly.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub limit: Option<u64>,
    /// Meshing method for targets; by default `joined` for pictures and `coverage` for datasets, which may store no depth.
    #[arg(long, value_enum)]
    pub detail: Option<DetailName>,
    #[command(flatten)]
    pub smoothing: SmoothArgs,
    /// Disconnected bodies of a mesh: report them, or drop all but the largest.
    #[arg(long, value_enum, default_value_t = LooseName::Keep)]
    pub loose: LooseName,
    /// File format of the meshes.
    #[arg(long, value_enum, default_value_t = MeshFormat::Ply)]
    pub to: MeshFormat,
    /// Threads; by default every core that the cgroup and the scheduler grant.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Folder for meshes, picture and `scene.json`; must be new or empty.
    #[arg(short, long, value_name = "DIR", value_parser = local_path())]
    pub out: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Meshing method for targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DetailName {
    /// Surface of the occupied cells, as for obstacles: fast, about 0.7 cells too far out.
    Fast,
    /// Surface of the network's coverage.
    Coverage,
    /// Algorithm 2 of the thesis: observed points and completed cells together, smoothed.
    Thesis,
    /// Coverage joined with the surface that the camera observed, smoothed.
    Joined,
}

impl DetailName {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Coverage => "coverage",
            Self::Thesis => "thesis",
            Self::Joined => "joined",
        }
    }
}

impl From<DetailName> for Detail {
    fn from(name: DetailName) -> Self {
        match name {
            DetailName::Fast => Self::Fast,
            DetailName::Coverage => Self::Surface,
            DetailName::Thesis => Self::Algorithm2,
            DetailName::Joined => Self::Joined,
        }
    }
}

/// Treatment of disconnected bodies of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LooseName {
    /// Keep and report them.
    Keep,
    /// Drop all bodies but the largest.
    Drop,
}

/// Smoothing of the meshes of methods with the ending `+smooth`.
#[derive(Args, Clone, Copy, Debug)]
pub struct SmoothArgs {
    /// Laplacian smoothing steps for methods with the ending +smooth; each step moves every vertex to the mean of its neighbours.
    #[arg(long, value_name = "N", default_value_t = LaplacianRule::default().steps, value_parser = clap::value_parser!(u32).range(1..))]
    pub smooth_steps: u32,
    /// Weights of the neighbours in this mean.
    #[arg(long, value_enum, default_value_t = WeightsName::Uniform)]
    pub smooth_weights: WeightsName,
}

impl SmoothArgs {
    /// Rule for the library.
    pub fn rule(self) -> LaplacianRule {
        let weights = match self.smooth_weights {
            WeightsName::Uniform => NeighbourWeights::Uniform,
            WeightsName::Cotangent => NeighbourWeights::Cotangent,
        };
        // Completed meshes are closed: they have no boundary, so no rule for boundaries applies.
        LaplacianRule { steps: self.smooth_steps, weights, boundary: false }
    }
}

/// Weights of the neighbours of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WeightsName {
    /// Equal weights.
    Uniform,
    /// Cotangents of the opposite angles: flat parts stay as they are.
    Cotangent,
}

/// Rules by which surfaces and meshes are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RulesName {
    /// Points sampled uniformly on both surfaces, volumes in the joint bounding box.
    Standard,
    /// The standard rules, and in addition those of the thesis's tools.
    Thesis,
}

/// File format of completed meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MeshFormat {
    /// Binary PLY.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// Binary STL.
    Stl,
    /// OBJ, with a MuJoCo scene (`scene.xml`) in which each mesh is a free body on the table.
    Mjcf,
}

impl MeshFormat {
    /// Ending of the meshes' files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Obj | Self::Mjcf => "obj",
            Self::Stl => "stl",
        }
    }
}

#[derive(Args, Debug)]
pub struct SegmentArgs {
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Further pictures with the same camera and settings: the files of each go to a subfolder named as the picture.
    #[arg(value_name = "MORE")]
    pub more: Vec<PathBuf>,
    /// Folder for surfaces, pictures, labels and `scene.json`; must be new or empty.
    #[arg(short, long, value_name = "DIR", value_parser = local_path())]
    pub out: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Subcommand, Debug)]
pub enum EvaluateCommand {
    /// Measure overlap with the true cells, including cells that no camera observed, and distance from the true surface.
    Completion(EvaluateCompletionArgs),
}

#[derive(Args, Debug)]
pub struct EvaluateCompletionArgs {
    /// Dataset folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Model folder (repeatable).
    #[arg(long, value_name = "DIR")]
    pub model: Vec<PathBuf>,
    /// Method (repeatable): bundled, the network in this program (the default without --model and --method); partial, extrude,
    /// hull, mirror-far, mirror, mirror-shell; hull-to-table and extrude-to-table, for pairs of scenes; primitive, which needs
    /// depth (`channels.depth`); knn and mean, which learn from the dataset's training pairs; or truth: the true grids, as a
    /// perfect network would return them. The ending +smooth, as in hull+smooth, smooths its meshes.
    #[arg(long, value_name = "NAME")]
    pub method: Vec<String>,
    /// Meshing method; `thesis` and `joined` need depth (`channels.depth`). Baselines have no coverage: their surface is that of the
    /// occupied cells. Repeatable: each method becomes a row, compared with the first one.
    #[arg(long, value_enum, default_value = "coverage")]
    pub detail: Vec<DetailName>,
    #[command(flatten)]
    pub smoothing: SmoothArgs,
    /// Folder with the objects' meshes, named as in the dataset; they serve as the true surfaces instead of the dataset's grids.
    /// Built-in shapes need no file.
    #[arg(long, value_name = "DIR")]
    pub truth: Option<PathBuf>,
    /// Split to evaluate: training, holdout, validation, test.
    #[arg(long, value_name = "SPLIT", default_value = "test")]
    pub split: String,
    /// Maximum number of samples, spread evenly.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub limit: Option<u64>,
    /// Points per surface for distances; 0 skips the distances.
    #[arg(long, value_name = "N", default_value_t = 2000)]
    pub surface_samples: u32,
    /// Measurement rules. `thesis` adds columns by the rules of the thesis's tools, for comparison with the thesis only: mesh
    /// overlap in the bounding box of the true mesh, counting surface cells, and vertex distances as MeshLab computes them.
    #[arg(long, value_enum, default_value_t = RulesName::Standard)]
    pub rules: RulesName,
    /// Also compare surfaces by their mean geodesic distances (Hamza and Krim 2003); takes seconds per mesh.
    #[arg(long)]
    pub geodesics: bool,
    /// Also write an HTML page to this file: the table, and pictures of the best, median and worst sample of each method.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Threads; by default every core that the cgroup and the scheduler grant.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Subcommand, Debug)]
pub enum ModelCommand {
    /// Check a model folder: digests, network, and this machine's results against those stored in `golden.npz`.
    Check(ModelCheckArgs),
}

#[derive(Args, Debug)]
pub struct ModelCheckArgs {
    /// Model folder. Default: the network in this program.
    pub dir: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}
