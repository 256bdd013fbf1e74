//! Errors while a model is handed to MuJoCo.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use kernel::{
    description::{Format, Statement},
    words::Show,
};

/// Why a scene's camera could not be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read or compiled.
    #[error(transparent)]
    Unreadable(#[from] RobotError),
    /// No camera has that name.
    #[error("{}: no camera is named {name:?}; the scene has {}", path.shown(), list(present))]
    NoCamera {
        /// The scene.
        path: PathBuf,
        /// The requested name.
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

/// A statement of a description that is not understood.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefusedStatement {
    /// File and line, or only the file.
    pub place: String,
    /// The statement as written.
    pub statement: String,
    /// Why it is refused here, as a clause; empty where it always is.
    pub when: &'static str,
    /// Remedy: the statement to write instead.
    pub remedy: &'static str,
}

impl RefusedStatement {
    /// An element, or one of its attributes.
    pub(super) fn new(statement: &Statement, attribute: Option<&str>, remedy: &'static str) -> Self {
        let element = shortened(&statement.to_string());
        let written = attribute.map_or(element.clone(), |attribute| {
            format!("{attribute}=\"{}\" of {element}", shortened(statement.get(attribute).unwrap_or_default()))
        });
        Self { place: statement.place.to_string(), statement: written, when: "", remedy }
    }

    /// An element that no table contains, or with an attribute that none contains.
    pub(super) fn unknown(statement: &Statement, attribute: Option<&str>) -> Self {
        Self::new(statement, attribute, "take it out if it changes no shape and no motion")
    }

    /// An element that is refused under a condition.
    pub(super) fn when(statement: &Statement, when: &'static str, remedy: &'static str) -> Self {
        Self { when, ..Self::new(statement, None, remedy) }
    }

    /// An element without a known position, refused under a condition.
    pub(super) fn without_place(
        file: &Path,
        element: &str,
        names: &[(&'static str, String)],
        when: &'static str,
        remedy: &'static str,
    ) -> Self {
        let known = names.iter().filter(|(_, name)| !name.is_empty());
        let attributes: String = known.map(|(attribute, name)| format!(" {attribute}=\"{name}\"")).collect();
        Self { place: file.shown().to_string(), statement: format!("<{element}{attributes}>"), when, remedy }
    }
}

impl fmt::Display for RefusedStatement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { place, statement, when, .. } = self;
        write!(f, "{place}: {statement} is refused")?;
        if when.is_empty() { Ok(()) } else { write!(f, ", because {when}") }
    }
}

/// The beginning of a text that may be long.
fn shortened(text: &str) -> String {
    const MOST: usize = 100;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

/// Refused statements, a line each; the remedy follows the last of those that share it.
fn lines(refused: &[RefusedStatement]) -> String {
    const MOST: usize = 10;
    let mut out = String::new();
    for (index, statement) in refused.iter().take(MOST).enumerate() {
        let next = refused.get(index + 1).filter(|_| index + 1 < MOST);
        let is_last = next.is_none_or(|next| next.remedy != statement.remedy);
        let remedy = if is_last { format!("; {}", statement.remedy) } else { String::new() };
        let line_break = if index > 0 { "\n" } else { "" };
        out += &format!("{line_break}{statement}{remedy}");
    }
    if refused.len() > MOST {
        out += &format!("\nand {} more", refused.len() - MOST);
    }
    out
}

/// Why a robot's description gives no planning group.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// A text that cannot be read, or that needs too much memory or time.
    #[error("{message}; {remedy}")]
    Text {
        /// File, place and problem.
        message: String,
        /// Remedy for it.
        remedy: &'static str,
    },
    /// Statements that are not understood.
    #[error("{}", lines(refused))]
    Statements {
        /// Every one.
        refused: Vec<RefusedStatement>,
    },
    /// Too little memory to compile anything.
    #[error("{}: not compiled: less than {} MiB of memory are left; raise the limit (ulimit -v), or end other programs", path.shown(), needed >> 20)]
    Memory {
        /// The robot.
        path: PathBuf,
        /// Memory that has to be left [bytes].
        needed: usize,
    },
    /// A fixed joint with a value that the description does not allow.
    #[error("{}: joint {joint:?} is set to {given}, but its coupling (<equality><joint>, <mimic> in a URDF) sets it to {value}{}; give it that value, or none", path.shown(), follows(leader.as_deref()))]
    Contradicted {
        /// The robot.
        path: PathBuf,
        /// The joint that follows.
        joint: String,
        /// The value that the job gives [rad or m].
        given: f64,
        /// The joint that it follows.
        leader: Option<String>,
        /// The value that follows from the description [rad or m].
        value: f64,
    },
    /// MuJoCo cannot read or compile the file.
    #[error("{}: MuJoCo refuses it: {message}", path.shown())]
    Refused {
        /// The robot.
        path: PathBuf,
        /// MuJoCo's words, with line and column if it reports them.
        message: String,
    },
    /// A file that the description names is not there.
    #[error("{}: {} is not there; {}", path.shown(), file.shown(), kernel::description::missing_remedy(file))]
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
        source: Box<assets::MeshRefusal>,
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
    #[error("{}: {first:?} touches {second:?} at rest; if they may touch, put <contact><exclude body1={first:?} body2={second:?}/></contact> into {}; `graspmill robot check` finds all such pairs", path.shown(), place_of_excludes(*format))]
    Rest {
        /// The robot.
        path: PathBuf,
        /// Format of its description.
        format: Format,
        /// A body.
        first: String,
        /// The other.
        second: String,
    },
    /// A mesh that is in no file.
    #[error("{}: geom {geom}: its mesh {mesh:?} is in no file; {remedy}", path.shown())]
    MeshInline {
        /// The robot.
        path: PathBuf,
        /// The geom that shows it.
        geom: String,
        /// The mesh.
        mesh: String,
        /// Remedy: what to write instead.
        remedy: &'static str,
    },
    /// A geom of a kind that collision checking does not support.
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
        /// The requested name.
        name: String,
        /// The names that there are.
        present: Vec<String>,
    },
    /// No site and no body has that name.
    #[error("{}: no site or body is named {name:?}; the robot has {}; name one of them, or in MJCF put <site name={name:?}/> into the body that is to reach", path.shown(), list(present))]
    NoTarget {
        /// The robot.
        path: PathBuf,
        /// The requested name.
        name: String,
        /// The names that there are.
        present: Vec<String>,
    },
    /// No body and no site has a name.
    #[error("{}: no body or site {name:?}", path.shown())]
    NoFrame {
        /// The robot.
        path: PathBuf,
        /// The requested name.
        name: String,
        /// The names that there are.
        present: Vec<String>,
    },
    /// A frame that must be fixed is moved by a joint.
    #[error("{}: {name:?} is moved by joint {joint:?}; the frame of poses must be fixed", path.shown())]
    FrameMoves {
        /// The robot.
        path: PathBuf,
        /// The body or site.
        name: String,
        /// The first joint of the group that moves it.
        joint: String,
    },
    /// A joint of the group is not between the world and the target.
    #[error("{}: joint {joint:?} does not move {target:?}; those that do: {}", path.shown(), list(moving))]
    NotMoved {
        /// The robot.
        path: PathBuf,
        /// The joint.
        joint: String,
        /// The target.
        target: String,
        /// The joints between the world and the target.
        moving: Vec<String>,
    },
    /// A ball or free joint is between the world and the target.
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
    /// A description that cannot be read.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A table that is wrong or does not fit.
    #[error(transparent)]
    Table(#[from] robot::hand::HandTableError),
    /// A coupling that is not read.
    #[error("{place}: <equality>: joint {joint:?} {reason}")]
    Coupling {
        /// File and line, or only the file.
        place: String,
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
    /// A geom of the hand that can touch, but no object.
    #[error("{}: body {body:?} has a geom that is refused, because {when}; {remedy}", path.shown())]
    MissesObjects {
        /// The hand.
        path: PathBuf,
        /// The body that has it.
        body: String,
        /// Condition under which such a geom is refused.
        when: &'static str,
        /// Remedy: the statement to write instead.
        remedy: &'static str,
    },
    /// A hand that a search has no room for.
    #[error("{}: grasps cannot be searched for with this hand: {source}", path.shown())]
    Unsearchable {
        /// The hand.
        path: PathBuf,
        /// Part that there is no room for, and the remedy.
        source: robot::grasp::UnsearchableHand,
    },
    /// A hand that overlaps itself in every posture.
    #[error("{}: in each of {postures} postures of its eigengrasps bodies of the hand overlap, so that no state of it is legal: {}; if these may overlap, put this into {}:\n  <contact>\n{}  </contact>", path.shown(), overlapping(pairs, *postures), place_of_excludes(*format), excludes(pairs, *postures))]
    NeverClear {
        /// The hand.
        path: PathBuf,
        /// Format of its description.
        format: Format,
        /// Postures that were tried.
        postures: u32,
        /// Names of bodies that overlap, and in how many postures, the most frequent ones first.
        pairs: Vec<([String; 2], u32)>,
    },
    /// A hand with which grasps cannot be searched for.
    #[error("{}: grasps are searched for with a hand that has {what}; docs/hands.md explains how to add some", path.shown())]
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
        "{}: no two of its contacts face each other in a posture of its eigengrasps, so it cannot hold a pair of points between them; grasps.sampler = \"annealing\" and \"uniform\" take every hand",
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
        /// The requested posture.
        posture: Vec<f64>,
        /// The driven joints' ranges.
        ranges: Vec<[f64; 2]>,
    },
}

/// Pairs that overlap, with their shares.
fn overlapping(pairs: &[([String; 2], u32)], postures: u32) -> String {
    let share = |([one, other], count): &([String; 2], u32)| {
        format!("{one} and {other} in {:.0} %", 100.0 * f64::from(*count) / f64::from(postures))
    };
    pairs.iter().map(share).collect::<Vec<_>>().join(", ")
}

/// Lines of MJCF for the pairs that overlap in every posture; without such pairs, for all pairs.
fn excludes(pairs: &[([String; 2], u32)], postures: u32) -> String {
    let always = pairs.iter().filter(|(_, count)| *count == postures);
    let chosen: Vec<_> = if always.clone().next().is_some() { always.collect() } else { pairs.iter().collect() };
    chosen.iter().map(|(pair, _)| format!("    {}\n", exclude_line(pair))).collect()
}

/// MJCF that keeps two bodies from being checked. A body of several sorts of geoms is excluded by its plain name.
pub fn exclude_line(pair: &[String; 2]) -> String {
    let [one, other] = pair.each_ref().map(|name| name.split(" (contype").next().unwrap_or_default());
    format!("<exclude body1=\"{one}\" body2=\"{other}\"/>")
}

/// Place of such lines, as the end of "put them into". A URDF has none.
pub fn place_of_excludes(format: Format) -> &'static str {
    match format {
        Format::Mjcf => "the description",
        Format::Urdf => "the description after saving it as MJCF (docs/faq.md)",
    }
}

fn follows(leader: Option<&str>) -> String {
    leader.map(|leader| format!(", because it follows {leader:?}")).unwrap_or_default()
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none with a name".into() } else { names.join(", ") }
}

/// Why MuJoCo cannot make a depth image.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimError {
    /// Too little for a body; MuJoCo needs at least four vertices and one face.
    #[error("a mesh of {vertices} vertices and {triangles} triangles: MuJoCo needs at least 4 and 1")]
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
