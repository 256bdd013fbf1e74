//! Arguments of the program. The command line is a contract: README lists it, `tests/cli.rs` holds it.

use std::{fmt, path::PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum, ValueHint, builder::PossibleValue};

use super::{
    completion_args::{CompleteArgs, EvaluateCommand, ModelCommand, SegmentArgs},
    local_path::{folder, local_folder, local_path},
};
use factory::cluster::TaskChoice;
use kernel::files::Folder;
use publish::export::{ExportFormat, FORMATS};

/// Simulation-driven data factory for robotic grasping.
#[derive(Parser, Debug)]
#[command(name = "graspmill", version, max_term_width = 100, arg_required_else_help = true)]
#[command(after_help = "Exit codes: 0 complete; 1 failed; 2 bad job or arguments; 3 complete, but meshes or\n\
    objects were refused, or no sample was kept; 4 verify or diff found a difference; 74 input/output (disk full, read-only: mend, then run again);\n\
    75 interrupted, resumable.\n\
    Environment: GRASPMILL_SIMD=scalar|avx2|avx512 picks the vector instructions (same bytes);\n\
    GRASPMILL_PACKAGES=DIR is the folder of the packages of meshes that jobs name, in place of the program's own;\n\
    NO_COLOR=1 for plain text.")]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand, Debug)]
pub enum Command {
    /// Estimate samples, shards, bytes and time of a job, by a short pilot run.
    Estimate(EstimateArgs),
    /// Make a job's dataset, or those of a set; run again to resume.
    Run(RunArgs),
    /// Show the progress of a dataset: reads its folder alone, so it works with every engine.
    Status(DatasetArgs),
    /// Close a dataset whose shards were made by tasks (`run --task`).
    Merge(MergeArgs),
    /// Submit a job to a cluster's engine: tasks, then the merge.
    Submit(SubmitArgs),
    /// Check a dataset: hashes, structure, ranges, root digest; optionally make samples again and compare.
    Verify(VerifyArgs),
    /// Compare two datasets, sample by sample, and say why they differ; exit code 4 when they do.
    Diff(DiffArgs),
    /// Show the facts of a dataset, as text or JSON.
    Inspect(DatasetArgs),
    /// Write report.html: pictures, distributions, assets, splits; for a set a page that leads to those of its datasets.
    Report(ReportArgs),
    /// Write samples in another format.
    Export(ExportArgs),
    /// Make a publication of a dataset: card, datasheet, licences, metadata, provenance, digests.
    Release(ReleaseArgs),
    /// Query a dataset.
    #[command(subcommand)]
    Query(QueryCommand),
    /// Compare models with baselines on the samples of a dataset.
    #[command(subcommand)]
    Evaluate(EvaluateCommand),
    /// Complete the objects in a depth picture, or the samples of a dataset, by a model: closed meshes, with the parts that the camera did not see.
    #[command(
        before_help = "For a depth picture of a RealSense camera, with the intrinsics that rs-enumerate-devices -c prints:\n\n  \
                       graspmill complete depth.png --model MODEL --intrinsics 615.2,615.4,320.1,239.7 --out completed"
    )]
    Complete(CompleteArgs),
    /// Find the table in a depth picture and the objects on it: their visible surfaces, and a picture with outlines.
    #[command(
        before_help = "For a depth picture of a RealSense camera, with the intrinsics that rs-enumerate-devices -c prints:\n\n  \
                       graspmill segment depth.png --intrinsics 615.2,615.4,320.1,239.7 --out scene"
    )]
    Segment(SegmentArgs),
    /// Check meshes before a job uses them.
    #[command(subcommand)]
    Meshes(MeshesCommand),
    /// Check a completion model before it is used.
    #[command(subcommand)]
    Model(ModelCommand),
    /// Check a robot before a job uses it.
    #[command(subcommand)]
    Robot(RobotCommand),
    /// Check a hand before a job uses it.
    #[command(subcommand)]
    Hand(HandCommand),
    /// Print the JSON Schema of job files, for editors.
    Schema,
    /// Print the version, as `--version` does.
    Version,
    /// Show what this machine can do, and what it lacks.
    Doctor(DoctorArgs),
    /// Print a dataset's root digest, and nothing else.
    Digest(DigestArgs),
    /// Print a shell's completion script: `graspmill completions bash > ~/.local/share/bash-completion/completions/graspmill`.
    Completions(CompletionsArgs),
    /// Write manual pages.
    Man(ManArgs),
}

#[derive(Args, Debug)]
pub struct JobArgs {
    /// The job file (TOML); `run` takes a set of jobs, too.
    pub job: PathBuf,
    /// Replace a setting: `--set seed=7 --set grid.resolution=64`. Recorded in the dataset. In a set: of every job, or of one:
    /// `--set patches:render.colour=false`.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Threads; by default every core that the cgroup and the scheduler grant.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
}

#[derive(Args, Debug)]
pub struct EstimateArgs {
    #[command(flatten)]
    pub job: JobArgs,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct RunArgs {
    #[command(flatten)]
    pub job: JobArgs,
    /// The dataset's folder; made if absent.
    #[arg(short, long, value_name = "DIR", value_parser = local_folder(), value_hint = ValueHint::DirPath)]
    pub out: Folder,
    /// Make one task's share of the shards and leave the dataset open for `merge`: task I (from 0) of N, or `env`, or `env/N`:
    /// as the variables of Slurm, Kubernetes, AWS Batch, Cloud Run, HyperQueue, PBS, Grid Engine, LSF or GNU parallel say.
    #[arg(long, value_name = "I/N")]
    pub task: Option<TaskChoice>,
    /// Form in which progress is shown.
    #[arg(long, value_enum, default_value_t = ProgressMode::Auto)]
    pub progress: ProgressMode,
    /// Show no progress: short for `--progress none`.
    #[arg(short, long, conflicts_with = "progress")]
    pub quiet: bool,
    /// Add messages, progress and results to a file, each line with its time and its level.
    #[arg(long, value_name = "FILE", value_parser = local_path())]
    pub log: Option<PathBuf>,
    /// Print the summary as JSON.
    #[arg(long)]
    pub json: bool,
}

impl RunArgs {
    /// Form in which progress is shown.
    pub fn progress(&self) -> ProgressMode {
        if self.quiet { ProgressMode::None } else { self.progress }
    }
}

#[derive(Args, Debug)]
pub struct MergeArgs {
    /// The dataset's folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Wait so many minutes for shards that are missing.
    #[arg(long, value_name = "MINUTES", default_value_t = 0)]
    pub wait: u32,
    /// Threads; by default every core that the cgroup and the scheduler grant.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Print the summary as JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct SubmitArgs {
    /// The job file (TOML).
    #[arg(required_unless_present = "retry")]
    pub job: Option<PathBuf>,
    /// The dataset's folder; scripts and logs go to `cluster` in it.
    #[arg(short, long, value_name = "DIR", value_parser = local_folder(), value_hint = ValueHint::DirPath)]
    pub out: Folder,
    /// Engine that runs the tasks.
    #[arg(long, value_enum, required_unless_present = "retry")]
    pub backend: Option<EngineName>,
    /// Replace a setting: `--set seed=7`.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Print what the engine would be given; write and send nothing.
    #[arg(long)]
    pub print: bool,
    /// Send those tasks again whose shards are missing, as they were sent before.
    #[arg(long, conflicts_with_all = ["job", "backend", "set", "tasks", "at_once", "cpus", "memory", "minutes", "option", "image"])]
    pub retry: bool,
    /// Tasks; by default as many as take about half an hour each.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub tasks: Option<u32>,
    /// Maximal count of tasks at a time.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub at_once: Option<u32>,
    /// Processors of a task.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..))]
    pub cpus: u16,
    /// Memory of a task [MiB].
    #[arg(long, value_name = "MIB", default_value_t = 4096)]
    pub memory: u32,
    /// Maximal time per task; by default four times what it is expected to take, and an hour at least.
    #[arg(long, value_name = "MINUTES", value_parser = clap::value_parser!(u32).range(1..))]
    pub minutes: Option<u32>,
    /// Another option for Slurm (repeatable): `--option=--partition=long`.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub option: Vec<String>,
    /// Kubernetes: the image, with graspmill in its PATH.
    #[arg(long, value_name = "IMAGE", required_if_eq("backend", "kubernetes"))]
    pub image: Option<String>,
    /// Kubernetes: the claim of a volume that many pods may write to, and where they see it. Job file, meshes and dataset lie
    /// below; give them here as pods see them.
    #[arg(long, value_name = "NAME=PATH", required_if_eq("backend", "kubernetes"))]
    pub claim: Option<String>,
    /// Add messages, progress and results to a file, each line with its time and its level.
    #[arg(long, value_name = "FILE", value_parser = local_path())]
    pub log: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EngineName {
    /// An array of Slurm and a merge that depends on it; sent with sbatch.
    Slurm,
    /// An Indexed Job and a merge that waits for it, as a manifest for kubectl.
    Kubernetes,
    /// A script for GNU parallel.
    Parallel,
    /// A script of processes of this machine.
    Local,
}

/// Form in which long work shows its progress (always on stderr).
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProgressMode {
    /// A bar on a terminal, plain lines elsewhere.
    Auto,
    /// A line every few seconds.
    Plain,
    /// One JSON object a line.
    Json,
    /// Nothing.
    None,
}

#[derive(Args, Debug)]
pub struct DatasetArgs {
    /// The dataset's folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct VerifyArgs {
    /// The dataset's folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Make this many random samples again from the manifest alone and compare bytes.
    #[arg(long, value_name = "K")]
    pub regenerate: Option<u64>,
    /// Seed of the choice of samples to make again.
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    /// Where a path of its job is to be found on this machine, for making samples again: `--set hand.scene=scenes/hand.xml`.
    /// Content is pinned: anything else is refused.
    #[arg(long = "set", value_name = "KEY=PATH", requires = "regenerate")]
    pub set: Vec<String>,
    /// Add messages, progress and results to a file, each line with its time and its level.
    #[arg(long, value_name = "FILE", value_parser = local_path())]
    pub log: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct DiffArgs {
    /// A dataset's folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub a: Folder,
    /// Another's.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub b: Folder,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct ReportArgs {
    /// The folder of a dataset or of a set.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Where to write; `report.html` in that folder by default. With it the page of a set leads nowhere, and only this page is
    /// written.
    #[arg(short, long, value_name = "FILE", value_parser = local_path())]
    pub out: Option<PathBuf>,
    /// Open it in the browser: by the program that BROWSER names, or else the desktop's.
    #[arg(long)]
    pub open: bool,
}

#[derive(Args, Debug)]
pub struct ReleaseArgs {
    /// The dataset's folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// The release's folder; must not exist yet or be empty.
    #[arg(short, long, value_name = "REL", value_parser = local_path())]
    pub out: PathBuf,
    /// File of what only its authors know: title, date, licence, uses (TOML; docs/releases.md).
    #[arg(long, value_name = "ABOUT")]
    pub about: PathBuf,
    /// Leave out what may not be shipped, with a recipe that makes it again.
    #[arg(long)]
    pub recipe: bool,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct ExportArgs {
    /// The dataset's folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// The format.
    #[arg(long, value_enum)]
    pub to: ExportFormatName,
    /// Where to write; must not exist yet or be empty.
    #[arg(short, long, value_name = "DIR", value_parser = local_path())]
    pub out: PathBuf,
    /// Only this split: training, holdout, validation, test.
    #[arg(long, value_name = "SPLIT")]
    pub split: Option<String>,
    /// Only samples of the object of this name, or of the scene where samples are of scenes: 'training 0' (repeatable).
    #[arg(long, value_name = "NAME")]
    pub object: Vec<String>,
    /// Maximal count of samples; with mujoco, of grasps, taken evenly over the dataset.
    #[arg(long, value_name = "N")]
    pub limit: Option<u64>,
    /// npy: one byte per cell, shape (N, n, n, n), instead of packed bits.
    #[arg(long)]
    pub unpacked: bool,
    /// vgn: a number that no dataset says, in metres: max_opening_width, finger_depth, of views also size and below (repeatable).
    #[arg(long, value_name = "KEY=NUMBER", value_parser = key_and_number)]
    pub set: Vec<(String, f64)>,
}

/// A key and its number, out of `KEY=NUMBER`.
fn key_and_number(text: &str) -> Result<(String, f64), String> {
    let expected = || format!("`{text}` is no KEY=NUMBER, such as finger_depth=0.05");
    let (key, number) = text.split_once('=').ok_or_else(expected)?;
    let number = number.trim().parse().map_err(|_| expected())?;
    Ok((key.trim().to_owned(), number))
}

/// A format of the table of export formats, by its name.
#[derive(Clone)]
pub struct ExportFormatName(pub &'static ExportFormat);

impl ValueEnum for ExportFormatName {
    fn value_variants<'a>() -> &'a [Self] {
        static NAMES: [ExportFormatName; FORMATS.len()] = {
            let mut names = [const { ExportFormatName(FORMATS[0]) }; FORMATS.len()];
            let mut index = 0;
            while index < names.len() {
                names[index] = ExportFormatName(FORMATS[index]);
                index += 1;
            }
            names
        };
        &NAMES
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.0.name).help(self.0.summary))
    }
}

impl fmt::Debug for ExportFormatName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.name)
    }
}

#[derive(Subcommand, Debug)]
pub enum QueryCommand {
    /// Find how far end-effector poses are inside or outside the reachable set: distance, gradient, label, joint
    /// values.
    Reach(ReachArgs),
}

#[derive(Args, Debug)]
pub struct ReachArgs {
    /// The dataset's folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// A pose of the target site, metres and radians (repeatable): `--pose 0.6,0.1,0.9,0,0.5,0.2`.
    #[arg(long, value_name = "X,Y,Z,ROLL,PITCH,YAW", allow_hyphen_values = true)]
    pub pose: Vec<String>,
    /// A file of poses, six numbers per line; a first line of names (x, y, z, roll, pitch, yaw) may give another order.
    #[arg(long, value_name = "FILE", required_unless_present = "pose")]
    pub csv: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Subcommand, Debug)]
pub enum MeshesCommand {
    /// Say what each mesh is, what would be repaired, what is refused and how to mend it.
    Check(MeshesCheckArgs),
    /// Write each part of a mesh that nothing joins to the others as a mesh of its own.
    Split(MeshesSplitArgs),
}

#[derive(Args, Debug)]
pub struct MeshesSplitArgs {
    /// Mesh file.
    pub file: PathBuf,
    /// Folder for the parts, new or empty: NAME-1.ply, NAME-2.ply and so on, in metres.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub scale: MeshScaleArgs,
}

/// Size of a mesh.
#[derive(Args, Debug)]
pub struct MeshScaleArgs {
    /// Unit of the files: m, dm, cm, mm, in, ft, or the length of one unit in metres.
    #[arg(long, default_value = "m")]
    pub unit: String,
    /// Longest side of each mesh in metres, for meshes that were normalised (ShapeNet, ModelNet).
    #[arg(long, value_name = "METRES", conflicts_with = "unit")]
    pub size: Option<f64>,
}

#[derive(Args, Debug)]
pub struct MeshesCheckArgs {
    /// Mesh files, or folders of them.
    #[arg(required = true)]
    pub paths: Vec<PathBuf>,
    #[command(flatten)]
    pub scale: MeshScaleArgs,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Subcommand, Debug)]
pub enum RobotCommand {
    /// Say what a planning group is and what of the robot can collide; find the pairs of bodies that always or never touch.
    Check(RobotCheckArgs),
}

#[derive(Args, Debug)]
pub struct RobotCheckArgs {
    /// Description of the robot (MJCF or URDF).
    pub scene: PathBuf,
    /// The planning group's joints.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', required = true)]
    pub joints: Vec<String>,
    /// Site that is brought to the poses, or a body: a link of a URDF.
    #[arg(long, value_name = "SITE")]
    pub target: String,
    /// Hold another joint at a value, radians or metres (repeatable); by default where the description has it.
    #[arg(long, value_name = "JOINT=VALUE")]
    pub fixed: Vec<String>,
    /// Random configurations to evaluate.
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    pub samples: u64,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Subcommand, Debug)]
pub enum HandCommand {
    /// Say what drives a hand, what follows, where it touches, and which of its bodies hit each other; draw it.
    Check(HandCheckArgs),
}

#[derive(Args, Debug)]
pub struct HandCheckArgs {
    /// Description of the hand (MJCF or URDF); its table is beside it, with the same name and `.toml`.
    pub hand: PathBuf,
    /// Random postures to evaluate.
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    pub samples: u64,
    /// Draw the hand opened, half closed and closed into this folder; made if absent.
    #[arg(long, value_name = "DIR")]
    pub picture: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct DoctorArgs {
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct CompletionsArgs {
    /// The shell.
    pub shell: clap_complete::Shell,
}

#[derive(Args, Debug)]
pub struct ManArgs {
    /// The folder for them; made if absent.
    #[arg(short, long, value_name = "DIR", value_parser = local_folder(), value_hint = ValueHint::DirPath)]
    pub out: Folder,
}

#[derive(Args, Debug)]
pub struct DigestArgs {
    /// The dataset's folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
}
