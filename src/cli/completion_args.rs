//! Arguments of the commands about depth pictures and completion models.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum, ValueHint};

use super::local_path::{folder, local_path};
use kernel::files::Folder;
use perception::{RosImage, is_depth_scale};
use runtime::completion::{Detail, LaplacianRule, NeighbourWeights};

/// A depth picture, its camera, and how it is taken apart.
#[derive(Args, Debug)]
pub struct PictureArgs {
    /// A depth picture: PNG of 16 bits, NPY, or an organised cloud (PCD, PLY). `complete` takes a dataset's folder, too.
    pub depth: PathBuf,
    /// The camera of an image: four numbers in pixels, or a file: JSON or YAML of graspmill, ROS (camera_info, calibration), OpenCV,
    /// RealSense, Open3D, BOP or Kalibr. A cloud needs none.
    #[arg(long, value_name = "FX,FY,CX,CY|FILE")]
    pub intrinsics: Option<String>,
    /// Camera in a file of several: number of the image in a scene_camera.json of BOP, camera of a chain of Kalibr, stream or image
    /// size of RealSense.
    #[arg(long, value_name = "NAME", requires = "intrinsics")]
    pub camera: Option<String>,
    /// Picture of a ROS camera whose raw and rectified pictures have different cameras: raw (K and D) or rectified (P).
    #[arg(long, value_name = "raw|rectified", requires = "intrinsics")]
    pub image: Option<ImageName>,
    /// Coordinate of the first pixel's centre by which cx and cy are counted: 0 (OpenCV, ROS, RealSense, Open3D, BOP, Kalibr) or 0.5.
    /// By default 0 for numbers and files of others; a file of graspmill states it.
    #[arg(long, value_name = "0|0.5", requires = "intrinsics")]
    pub pixel_centre: Option<PixelCentre>,
    /// Metres per unit of the file. By default 0.001 for whole numbers, or what the camera's file states; 1 for floats and clouds.
    #[arg(long, value_name = "METRES", value_parser = depth_scale)]
    pub depth_scale: Option<f64>,
    /// The image holds distances from the camera's centre, and not depths along its axis.
    #[arg(long)]
    pub range: bool,
    /// Mirror y and z of a cloud that looks along -z with y up (OpenGL's axes).
    #[arg(long)]
    pub flip: bool,
    /// The surface that objects stand on, instead of the largest plane in the picture: NX x + NY y + NZ z + D = 0 in the
    /// camera's frame (x right, y down, z forward), metres.
    #[arg(long, value_name = "NX,NY,NZ,D", allow_hyphen_values = true, conflicts_with = "no_plane")]
    pub plane: Option<String>,
    /// Search no plane: all points belong to objects.
    #[arg(long)]
    pub no_plane: bool,
    /// Points up to this far apart belong to one object.
    #[arg(long, value_name = "METRES", default_value_t = 0.02, value_parser = positive)]
    pub gap: f64,
    /// Points up to this height above the plane belong to it.
    #[arg(long, value_name = "METRES", default_value_t = 0.008, value_parser = positive)]
    pub min_height: f64,
    /// Objects of fewer points are left out.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub min_points: u32,
}

/// Coordinate of the first pixel's centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PixelCentre {
    /// The way of OpenCV, ROS, RealSense and Open3D.
    #[value(name = "0")]
    Zero,
    /// The way of graspmill.
    #[value(name = "0.5")]
    Half,
}

/// Picture of a ROS camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ImageName {
    /// The sensor's own picture (image_raw).
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
    number.ok_or_else(|| "give metres per unit, from 1e-7 to 10, as 0.001".to_owned())
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
    /// The model's folder.
    #[arg(long, value_name = "DIR", required_unless_present = "method")]
    pub model: Option<PathBuf>,
    /// A baseline in place of a model: partial, extrude, hull, mirror-far, mirror, mirror-shell, primitive. With the ending
    /// +smooth, as in hull+smooth, its meshes are smoothed.
    #[arg(long, value_name = "NAME", conflicts_with = "model")]
    pub method: Option<String>,
    /// The object to grasp: `auto` (the one nearest to the picture's middle), `all`, its number by size from 1, a pixel (column,
    /// row) on it, or a mask of its pixels: a grey PNG of the picture's size, 0 elsewhere. Pixels are those of the picture as it
    /// was given, from 0, whole numbers at their centres. The others are obstacles: larger by up to a cell, and faster.
    #[arg(long, value_name = "auto|all|N|U,V|MASK.png", default_value = "auto", allow_hyphen_values = true)]
    pub target: String,
    /// Points at which the target was touched: a CSV with the columns x, y, z [m], in the camera's frame.
    #[arg(long, value_name = "FILE.csv")]
    pub touch: Option<PathBuf>,
    /// Pose of the camera in the world, whose z points up: position [m] and unit quaternion of the camera's frame (x right,
    /// y down, z forward). It goes into scene.json, and scene.xml stands in the world.
    #[arg(long, value_name = "X,Y,Z,QW,QX,QY,QZ", allow_hyphen_values = true)]
    pub world: Option<String>,
    /// Split of a dataset: only its samples (training, holdout, validation, test).
    #[arg(long, value_name = "SPLIT")]
    pub split: Option<String>,
    /// Maximal count of samples of a dataset, taken evenly.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub limit: Option<u64>,
    /// Way in which a target's mesh is made; by default `on` for pictures and `off` for datasets, which may store no depth.
    #[arg(long, value_enum)]
    pub detail: Option<DetailName>,
    #[command(flatten)]
    pub smoothing: SmoothArgs,
    /// Form of the meshes.
    #[arg(long, value_enum, default_value_t = MeshFormat::Ply)]
    pub to: MeshFormat,
    /// Threads; by default every core that the cgroup and the scheduler grant.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// The folder for meshes, picture and `scene.json`; must not exist yet or be empty.
    #[arg(short, long, value_name = "DIR", value_parser = local_path())]
    pub out: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Way in which a target's mesh is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DetailName {
    /// Where the occupied cells have it, as obstacles: fast, and some .7 cell outside.
    Fast,
    /// Where the network's coverage has the surface.
    Off,
    /// The thesis's algorithm 2: seen points and completed cells together, smoothed.
    Thesis,
    /// Coverage joined with the surface that the camera saw, smoothed.
    On,
}

impl DetailName {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Off => "off",
            Self::Thesis => "thesis",
            Self::On => "on",
        }
    }
}

impl From<DetailName> for Detail {
    fn from(name: DetailName) -> Self {
        match name {
            DetailName::Fast => Self::Fast,
            DetailName::Off => Self::Surface,
            DetailName::Thesis => Self::Algorithm2,
            DetailName::On => Self::Joined,
        }
    }
}

/// Smoothing of the meshes of methods with the ending `+smooth`.
#[derive(Args, Clone, Copy, Debug)]
pub struct SmoothArgs {
    /// Steps of the Laplacian smoothing of methods with the ending +smooth: in each one every vertex moves to the mean of its
    /// neighbours.
    #[arg(long, value_name = "N", default_value_t = LaplacianRule::default().steps, value_parser = clap::value_parser!(u32).range(1..))]
    pub smooth_steps: u32,
    /// Weights of the neighbours in that mean.
    #[arg(long, value_enum, default_value_t = WeightsName::Uniform)]
    pub smooth_weights: WeightsName,
}

impl SmoothArgs {
    /// The rule of the library.
    pub fn rule(self) -> LaplacianRule {
        let weights = match self.smooth_weights {
            WeightsName::Uniform => NeighbourWeights::Uniform,
            WeightsName::Cotangent => NeighbourWeights::Cotangent,
        };
        // Completed meshes are closed: they have no boundary that could move by a rule of its own.
        LaplacianRule { steps: self.smooth_steps, weights, boundary: false }
    }
}

/// Weights of the neighbours of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WeightsName {
    /// All alike.
    Uniform,
    /// Cotangents of the opposite angles: flat parts stay as they are.
    Cotangent,
}

/// Rules of the measures of surfaces and meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RulesName {
    /// Points drawn evenly over both surfaces, volumes in the box of both.
    Standard,
    /// These, and beside them those of the thesis's tools.
    Thesis,
}

/// Form of completed meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MeshFormat {
    /// Binary PLY.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// Binary STL.
    Stl,
    /// OBJ, with a scene for MuJoCo (`scene.xml`) in which each is a free body on the table.
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
    /// The folder for surfaces, pictures, labels and `scene.json`; must not exist yet or be empty.
    #[arg(short, long, value_name = "DIR", value_parser = local_path())]
    pub out: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Subcommand, Debug)]
pub enum EvaluateCommand {
    /// Overlap with the true cells, also of those that no camera saw, and distance from the true surface.
    Completion(EvaluateCompletionArgs),
}

#[derive(Args, Debug)]
pub struct EvaluateCompletionArgs {
    /// The dataset's folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// A model's folder (repeatable).
    #[arg(long, value_name = "DIR", required_unless_present = "method")]
    pub model: Vec<PathBuf>,
    /// A baseline (repeatable): partial, extrude, hull, mirror-far, mirror, mirror-shell; primitive, which needs the depth
    /// (`channels.depth`); knn and mean, which learn from the dataset's training pairs; or truth: the true grids, as a perfect
    /// network would give them. With the ending +smooth, as in hull+smooth, its meshes are smoothed.
    #[arg(long, value_name = "NAME")]
    pub method: Vec<String>,
    /// Way in which meshes are made of answers; `thesis` and `on` need the depth (`channels.depth`). Baselines have no coverage:
    /// their surface is that of the occupied cells.
    /// Given again, each way is a row, compared with the first one.
    #[arg(long, value_enum, default_value = "off")]
    pub detail: Vec<DetailName>,
    #[command(flatten)]
    pub smoothing: SmoothArgs,
    /// A folder with the objects' meshes, named as in the dataset: they are the true surfaces, and not the dataset's grids.
    /// Built-in shapes need no file.
    #[arg(long, value_name = "DIR")]
    pub truth: Option<PathBuf>,
    /// The split: training, holdout, validation, test.
    #[arg(long, value_name = "SPLIT", default_value = "test")]
    pub split: String,
    /// Maximal count of samples, taken evenly.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub limit: Option<u64>,
    /// Points per surface for distances; 0 leaves them out.
    #[arg(long, value_name = "N", default_value_t = 2000)]
    pub surface_samples: u32,
    /// Rules of the measures: `thesis` adds columns by the rules of its tools, which others are not to be compared by: overlap
    /// of meshes in the truth's box alone, where cells of the surface count, and distances of vertices, as MeshLab's.
    #[arg(long, value_enum, default_value_t = RulesName::Standard)]
    pub rules: RulesName,
    /// Also compare surfaces by their mean geodesic distances (Hamza and Krim 2003): seconds per mesh.
    #[arg(long)]
    pub geodesics: bool,
    /// Also write a page: the table, and the best, the median and the worst sample of each method as pictures.
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
    /// Check a model's folder: digests, network, and the stored answers of `golden.npz` against this machine's.
    Check(ModelCheckArgs),
}

#[derive(Args, Debug)]
pub struct ModelCheckArgs {
    /// The model's folder.
    pub dir: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}
