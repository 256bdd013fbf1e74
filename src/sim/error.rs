//! Errors while a model is handed to MuJoCo.

use kernel::words::Show;
use std::path::PathBuf;

/// Why a scene's camera could not be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// MuJoCo cannot read or compile the file.
    #[error("{}: MuJoCo refuses this scene: {message}", path.shown())]
    Refused {
        /// The scene.
        path: PathBuf,
        /// MuJoCo's words, with line and column where it knows them.
        message: String,
    },
    /// No camera has that name.
    #[error("{}: no camera is named {name:?}; the scene has {}", path.shown(), list(present))]
    NoCamera {
        /// The scene.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// The names that there are.
        present: Vec<String>,
    },
    /// The camera has no image size.
    #[error("{}: camera {name:?} has no image size: give it resolution=\"WIDTH HEIGHT\"", path.shown())]
    NoResolution {
        /// The scene.
        path: PathBuf,
        /// The camera.
        name: String,
    },
    /// The camera is not a pinhole camera.
    #[error("{}: camera {name:?} is orthographic; a perspective camera is needed", path.shown())]
    Orthographic {
        /// The scene.
        path: PathBuf,
        /// The camera.
        name: String,
    },
    /// The camera's numbers are out of range.
    #[error("{}: camera {name:?}: {source}", path.shown())]
    Intrinsics {
        /// The scene.
        path: PathBuf,
        /// The camera.
        name: String,
        /// Problem with the intrinsics.
        source: kernel::geom::InvalidIntrinsics,
    },
}

/// Why a robot's description gives no planning group.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// MuJoCo cannot read or compile the file.
    #[error("{}: MuJoCo refuses this robot: {message}", path.shown())]
    Refused {
        /// The robot.
        path: PathBuf,
        /// MuJoCo's words, with line and column where it knows them.
        message: String,
    },
    /// A file that the description names is not there.
    #[error("{}: {} is not there; {}", path.shown(), file.shown(), kernel::assets::missing_remedy(file))]
    Missing {
        /// The robot.
        path: PathBuf,
        /// File that the description names.
        file: PathBuf,
    },
    /// A mesh file cannot be read.
    #[error("{}: geom {geom}: {source}", path.shown())]
    Mesh {
        /// The robot.
        path: PathBuf,
        /// The geom that shows it.
        geom: String,
        /// Reason of the refusal.
        source: Box<kernel::assets::MeshRefusal>,
    },
    /// A mesh has no surface.
    #[error("{}: {source}", path.shown())]
    Surface {
        /// The robot.
        path: PathBuf,
        /// Reason that no surface was made.
        source: kernel::geom::NoSurface,
    },
    /// Two bodies touch while the robot rests.
    #[error("{}: {first:?} touches {second:?} at rest; if they may touch, <contact><exclude body1={first:?} body2={second:?}/></contact> says so; `graspmill robot check` finds all such pairs", path.shown())]
    Rest {
        /// The robot.
        path: PathBuf,
        /// A body.
        first: String,
        /// The other.
        second: String,
    },
    /// A mesh that is in no file.
    #[error("{}: geom {geom}: its mesh {mesh:?} is in no file; write it to an STL, OBJ, PLY or OFF file and name that", path.shown())]
    MeshInline {
        /// The robot.
        path: PathBuf,
        /// The geom that shows it.
        geom: String,
        /// The mesh.
        mesh: String,
    },
    /// A geom whose kind collision checking does not know.
    #[error("{}: geom {geom} of body {body:?} is {kind}; {remedy}, or give it contype=\"0\" conaffinity=\"0\" if nothing can hit it", path.shown())]
    Geom {
        /// The robot.
        path: PathBuf,
        /// The geom.
        geom: String,
        /// The body that it is part of.
        body: String,
        /// Kind of the geom, with an article.
        kind: &'static str,
        /// Remedy: what to use instead.
        remedy: &'static str,
    },
    /// Contacts that are listed one by one.
    #[error("{}: <contact><pair> says which geoms may touch; say it by contype, conaffinity and <contact><exclude>", path.shown())]
    Pairs {
        /// The robot.
        path: PathBuf,
    },
    /// The joints of a group move different branches.
    #[error("{}: joint {joint:?} does not hang on joint {before:?}; a planning group is one chain", path.shown())]
    Branches {
        /// The robot.
        path: PathBuf,
        /// The joint.
        joint: String,
        /// The joint of the group before it in the description.
        before: String,
    },
    /// No joint has that name.
    #[error("{}: no joint is named {name:?}; the robot has {}", path.shown(), list(present))]
    NoJoint {
        /// The robot.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// The names that there are.
        present: Vec<String>,
    },
    /// No site has that name.
    #[error("{}: no site is named {name:?}; the robot has {}; put <site name={name:?}/> into the body that is to reach", path.shown(), list(present))]
    NoSite {
        /// The robot.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// The names that there are.
        present: Vec<String>,
    },
    /// No body and no site has a name.
    #[error("{}: no body or site {name:?}", path.shown())]
    NoFrame {
        /// The robot.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// The names that there are.
        present: Vec<String>,
    },
    /// A frame that has to stand still does not.
    #[error("{}: {name:?} is moved by joint {joint:?}; the frame of poses has to stand still", path.shown())]
    FrameMoves {
        /// The robot.
        path: PathBuf,
        /// The body or site.
        name: String,
        /// The first joint of the group that moves it.
        joint: String,
    },
    /// A joint of the group is not between the world and the target.
    #[error("{}: joint {joint:?} does not move site {site:?}; those that do: {}", path.shown(), list(moving))]
    NotMoved {
        /// The robot.
        path: PathBuf,
        /// The joint.
        joint: String,
        /// The target site.
        site: String,
        /// The joints between the world and the site.
        moving: Vec<String>,
    },
    /// A ball or free joint stands between the world and the target.
    #[error("{}: joint {joint:?} is a {kind} joint; a planning group needs hinge and slide joints", path.shown())]
    Kind {
        /// The robot.
        path: PathBuf,
        /// The joint.
        joint: String,
        /// Kind of the joint.
        kind: &'static str,
    },
    /// A joint of a hand has no name.
    #[error("{}: a joint of body {body:?} has no name; give it one", path.shown())]
    Unnamed {
        /// The hand.
        path: PathBuf,
        /// The body.
        body: String,
    },
    /// The joints make no planning group.
    #[error("{}: {source}", path.shown())]
    Group {
        /// The robot.
        path: PathBuf,
        /// Problem with the group.
        source: robot::kinematics::InvalidGroup,
    },
}

/// Why a description and its table make no hand, or no hand that closes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HandError {
    /// MJCF that cannot be read.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A table that is wrong or does not fit.
    #[error(transparent)]
    Table(#[from] robot::hand::HandTableError),
    /// A coupling that is not read.
    #[error("{}: <equality>: joint {joint:?} {reason}", path.shown())]
    Coupling {
        /// The hand.
        path: PathBuf,
        /// The joint that follows.
        joint: String,
        /// Problem with the coupling, and the remedy.
        reason: &'static str,
    },
    /// A geom of the hand that would have to touch a true mesh and can't.
    #[error(
        "{}: {body:?} can touch, and has a geom that is no box, sphere, capsule or cylinder: only these touch true meshes; put such shapes around it and give that geom contype=\"0\" conaffinity=\"0\"",
        path.shown()
    )]
    Geom {
        /// The hand.
        path: PathBuf,
        /// The body that has it.
        body: String,
    },
    /// A hand with which grasps cannot be searched for.
    #[error("{}: grasps are searched for with a hand that has {what}; docs/hands.md says how to give it some", path.shown())]
    NoGrasps {
        /// The hand's table.
        path: PathBuf,
        /// Part that the hand lacks.
        what: &'static str,
    },
    /// A hand whose pads have no middles that could be placed on pairs of points.
    #[error(
        "{}: only a gripper has middles of pads: a `width` in its table, its pads slid towards each other by one motor; antipodal.depth = \"any\" takes every hand with contacts that face each other",
        path.shown()
    )]
    NoGripper {
        /// The hand's table.
        path: PathBuf,
    },
    /// A hand that cannot take a pair of points between two of its contacts.
    #[error(
        "{}: no two of its contacts face each other in a posture of its eigengrasps, so it takes no pair of points between them; grasps.sampler = \"annealing\" and \"uniform\" take every hand",
        path.shown()
    )]
    NoOpposition {
        /// The hand's table.
        path: PathBuf,
    },
    /// An object without shapes, or a shape or pose that is not a finite one.
    #[error("the object to close on: {reason}")]
    Object {
        /// Problem with the object.
        reason: String,
    },
    /// Conditions or a protocol that no trial can have.
    #[error("a trial of a grasp: {reason}")]
    Trial {
        /// Problem with the trial.
        reason: String,
    },
    /// A posture of another length, or outside the joints' ranges.
    #[error("the posture {posture:?} does not fit: {} values within {ranges:?}", ranges.len())]
    Posture {
        /// The posture asked for.
        posture: Vec<f64>,
        /// The driven joints' ranges.
        ranges: Vec<[f64; 2]>,
    },
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none with a name".into() } else { names.join(", ") }
}

/// Why MuJoCo cannot make a depth image.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimError {
    /// Too little for a body; MuJoCo wants four vertices and one face at least.
    #[error("a mesh of {vertices} vertices and {triangles} triangles: MuJoCo wants at least 4 and 1")]
    TooSmall {
        /// Vertices given.
        vertices: usize,
        /// Triangles given.
        triangles: usize,
    },
    /// More than MuJoCo's 32-bit sizes hold.
    #[error("a mesh of {vertices} vertices and {triangles} triangles: MuJoCo's sizes end at 2^31 / 9")]
    TooLarge {
        /// Vertices given.
        vertices: usize,
        /// Triangles given.
        triangles: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// Index of the first such vertex.
        vertex: usize,
    },
    /// A face names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex} of {vertices}")]
    NoSuchVertex {
        /// Index of the first such triangle.
        triangle: usize,
        /// The vertex named.
        vertex: u32,
        /// Vertices there are.
        vertices: usize,
    },
    /// MuJoCo's compiler refuses the mesh.
    #[error("MuJoCo refuses the mesh: {0}")]
    Refused(String),
    /// A pose holds NaN or an infinite number.
    #[error("the pose is not finite: {0:?}")]
    Pose([f64; 12]),
    /// OpenGL is not to be had.
    #[error(transparent)]
    Gl(#[from] GlError),
}

/// Why MuJoCo's renderer cannot run here. Only `renderer = "mujoco-gl"` needs it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GlError {
    /// There is no EGL library.
    #[error("libEGL.so.1 could not be loaded ({message}); {REMEDY}")]
    NoLibrary {
        /// The loader's words.
        message: String,
    },
    /// EGL is there but no display and driver works.
    #[error("EGL finds no display that draws without a window ({message}); {REMEDY}")]
    NoDisplay {
        /// Answers of all displays.
        message: String,
    },
    /// The driver lacks something that MuJoCo needs; it would end the process.
    #[error("the OpenGL driver {renderer} lacks {missing}; {REMEDY}")]
    Lacks {
        /// The driver's name.
        renderer: String,
        /// Missing parts.
        missing: String,
    },
    /// The image does not fit the driver.
    #[error("an image of {width} x {height} px: the OpenGL driver draws up to {limit} px a side")]
    TooLarge {
        /// Image width [px].
        width: u32,
        /// Image height [px].
        height: u32,
        /// The driver's limit [px].
        limit: u32,
    },
    /// Drawing or reading back failed.
    #[error("OpenGL failed: {0}")]
    Failed(String),
}

const REMEDY: &str = "install the system's EGL and an OpenGL driver (make deps-gl; on Debian and Ubuntu: apt-get install \
                      libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri), or do without: renderer = \"raster\" of completion, \
                      render.colour = false of patches and views";
