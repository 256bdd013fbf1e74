//! Arguments of the program. The command line is a contract: README lists it, and `tests/cli` checks it.

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
    objects were refused, or no sample was kept; 4 verify or diff found a difference; 74 input/output\n\
    error (disk full or read-only: fix it, then run again); 75 interrupted, resumable.\n\
    Environment: GRASPMILL_SIMD=scalar|avx2|avx512 selects the vector instructions (same bytes);\n\
    GRASPMILL_PACKAGES=DIR replaces the program's own folder of mesh packages that jobs name;\n\
    NO_COLOR=1 prints plain text.")]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand, Debug)]
pub enum Command {
    /// Write a commented job for a folder of meshes, after a check of the meshes.
    Init(InitArgs),
    /// Estimate the samples, shards, bytes and time of a job from a short pilot run.
    Estimate(EstimateArgs),
    /// Make the dataset of a job, or the datasets of a set; run again to resume.
    Run(RunArgs),
    /// Show the progress of a dataset. Reads only its folder, so it works with every engine.
    Status(DatasetArgs),
    /// Finish a dataset whose shards were made by tasks (`run --task`).
    Merge(MergeArgs),
    /// Submit a job to a cluster engine: the tasks, then the merge.
    Submit(SubmitArgs),
    /// Check a dataset: hashes, structure, ranges, root digest; optionally make samples again and compare.
    Verify(VerifyArgs),
    /// Compare two datasets sample by sample and explain differences; exit code 4 if they differ.
    Diff(DiffArgs),
    /// Show the facts of a dataset, as text or JSON.
    Inspect(DatasetArgs),
    /// Write report.html: pictures, distributions, assets, splits; for a set, a page that links to the reports of its datasets.
    Report(ReportArgs),
    /// Write samples in another format.
    Export(ExportArgs),
    /// Prepare a dataset for publication: card, datasheet, licences, metadata, provenance, digests.
    Release(ReleaseArgs),
    /// Query a dataset.
    #[command(subcommand)]
    Query(QueryCommand),
    /// Compare models with baselines on the samples of a dataset.
    #[command(subcommand)]
    Evaluate(EvaluateCommand),
    /// Complete the objects in a depth picture, or the samples of a dataset, with a model: closed meshes that include the parts
    /// hidden from the camera.
    #[command(
        before_help = "For a depth picture of a RealSense camera, with the intrinsics that rs-enumerate-devices -c prints:\n\n  \
                       graspmill complete depth.png --model MODEL --intrinsics 615.2,615.4,320.1,239.7 --out completed"
    )]
    Complete(CompleteArgs),
    /// Find the table and the objects on it in a depth picture; write their visible surfaces and a picture with outlines.
    #[command(
        before_help = "For a depth picture of a RealSense camera, with the intrinsics that rs-enumerate-devices -c prints:\n\n  \
                       graspmill segment depth.png --intrinsics 615.2,615.4,320.1,239.7 --out scene"
    )]
    Segment(SegmentArgs),
    /// Check meshes before a job uses them.
    #[command(subcommand)]
    Meshes(MeshesCommand),
    /// Check a completion model before you use it.
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
    /// Show what this machine supports and what it lacks.
    Doctor(DoctorArgs),
    /// Print only a dataset's root digest.
    Digest(DigestArgs),
    /// Print the completion script of a shell: `graspmill completions bash >
    /// ~/.local/share/bash-completion/completions/graspmill`.
    Completions(CompletionsArgs),
    /// Write manual pages.
    Man(ManArgs),
}

#[derive(Args, Debug)]
pub struct JobArgs {
    /// Job file (TOML); `run` also accepts a set of jobs.
    pub job: PathBuf,
    /// Replace a setting: `--set seed=7 --set grid.resolution=64`. Recorded in the dataset. In a set it applies to every job, or
    /// to one: `--set patches:render.colour=false`.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Number of threads; by default every core that the cgroup and the scheduler grant.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
}

#[derive(Args, Debug)]
pub struct InitArgs {
    /// Folder of meshes (STL, OBJ, PLY or OFF), with all folders below it.
    #[arg(value_hint = ValueHint::DirPath)]
    pub meshes: PathBuf,
    /// Job file to write; must not exist.
    #[arg(short, long, value_name = "JOB", value_parser = local_path())]
    pub out: PathBuf,
    /// Product of the job.
    #[arg(long, value_enum, default_value_t = InitProduct::Completion)]
    pub product: InitProduct,
    /// Hand of a job of grasps: an MJCF file with its table beside it.
    #[arg(long, value_name = "HAND")]
    pub hand: Option<PathBuf>,
    /// Length unit of the files: m, dm, cm, mm, in, ft, or the length of one unit in metres; by default the likeliest of m, mm, cm and
    /// in.
    #[arg(long)]
    pub unit: Option<String>,
    /// Longest side of each mesh in metres, for meshes that were normalised (ShapeNet, ModelNet).
    #[arg(long, value_name = "METRES", conflicts_with = "unit")]
    pub size: Option<f64>,
}

/// Products that `init` writes jobs for: those that need meshes alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum InitProduct {
    /// Pairs of partial and complete shapes.
    Completion,
    /// Grasps on a table with graded labels; needs --hand.
    Grasps,
    /// Scenes of several bodies on a table.
    Scenes,
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
    /// Dataset folder; created if absent.
    #[arg(short, long, value_name = "DIR", value_parser = local_folder(), value_hint = ValueHint::DirPath)]
    pub out: Folder,
    /// Make one task's share of the shards and leave the dataset open for `merge`: task I (from 0) of N. `env` or `env/N` reads
    /// the task from the variables of Slurm, Kubernetes, AWS Batch, Cloud Run, HyperQueue, PBS, Grid Engine, LSF or GNU parallel.
    #[arg(long, value_name = "I/N")]
    pub task: Option<TaskChoice>,
    /// Progress display.
    #[arg(long, value_enum, default_value_t = ProgressMode::Auto)]
    pub progress: ProgressMode,
    /// Show no progress; short for `--progress none`.
    #[arg(short, long, conflicts_with = "progress")]
    pub quiet: bool,
    /// Append messages, progress and results to a file, each line with its time and level.
    #[arg(long, value_name = "FILE", value_parser = local_path())]
    pub log: Option<PathBuf>,
    /// Print the summary as JSON.
    #[arg(long)]
    pub json: bool,
}

impl RunArgs {
    /// Progress display.
    pub fn progress(&self) -> ProgressMode {
        if self.quiet { ProgressMode::None } else { self.progress }
    }
}

#[derive(Args, Debug)]
pub struct MergeArgs {
    /// Dataset folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Minutes to wait for missing shards.
    #[arg(long, value_name = "MINUTES", default_value_t = 0)]
    pub wait: u32,
    /// Number of threads; by default every core that the cgroup and the scheduler grant.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Print the summary as JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct SubmitArgs {
    /// Job file (TOML).
    #[arg(required_unless_present = "retry")]
    pub job: Option<PathBuf>,
    /// Dataset folder; scripts and logs are written to `cluster` inside it.
    #[arg(short, long, value_name = "DIR", value_parser = local_folder(), value_hint = ValueHint::DirPath)]
    pub out: Folder,
    /// Engine that runs the tasks.
    #[arg(long, value_enum, required_unless_present = "retry")]
    pub backend: Option<EngineName>,
    /// Replace a setting: `--set seed=7`.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Print what the engine would receive; write and send nothing.
    #[arg(long)]
    pub print: bool,
    /// Resubmit the tasks whose shards are missing, with the settings of the first submission.
    #[arg(long, conflicts_with_all = ["job", "backend", "set", "tasks", "at_once", "cpus", "memory", "minutes", "option", "image"])]
    pub retry: bool,
    /// Number of tasks; by default chosen so that each takes about half an hour.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub tasks: Option<u32>,
    /// Maximum number of tasks that run at once.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub at_once: Option<u32>,
    /// Processors per task.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..))]
    pub cpus: u16,
    /// Memory per task [MiB].
    #[arg(long, value_name = "MIB", default_value_t = 4096)]
    pub memory: u32,
    /// Maximum time per task; by default four times its expected time, and at least an hour.
    #[arg(long, value_name = "MINUTES", value_parser = clap::value_parser!(u32).range(1..))]
    pub minutes: Option<u32>,
    /// Additional option for Slurm (repeatable): `--option=--partition=long`.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub option: Vec<String>,
    /// Kubernetes: container image with graspmill on its PATH.
    #[arg(long, value_name = "IMAGE", required_if_eq("backend", "kubernetes"))]
    pub image: Option<String>,
    /// Kubernetes: claim of a volume that many pods may write to, and its mount path. Job file, meshes and dataset must be below
    /// this path; give their paths as the pods see them.
    #[arg(long, value_name = "NAME=PATH", required_if_eq("backend", "kubernetes"))]
    pub claim: Option<String>,
    /// Append messages, progress and results to a file, each line with its time and level.
    #[arg(long, value_name = "FILE", value_parser = local_path())]
    pub log: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EngineName {
    /// A Slurm array and a merge that depends on it, sent with sbatch.
    Slurm,
    /// An Indexed Job and a merge that waits for it, as a manifest for kubectl.
    Kubernetes,
    /// A script for GNU parallel.
    Parallel,
    /// A script that starts processes on this machine.
    Local,
}

/// Progress display of long work (always on stderr).
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProgressMode {
    /// A bar on a terminal, plain lines elsewhere.
    Auto,
    /// A line every few seconds.
    Plain,
    /// One JSON object per line.
    Json,
    /// Nothing.
    None,
}

#[derive(Args, Debug)]
pub struct DatasetArgs {
    /// Dataset folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct VerifyArgs {
    /// Dataset folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Number of random samples to make again from the manifest alone and compare byte by byte.
    #[arg(long, value_name = "K")]
    pub regenerate: Option<u64>,
    /// Seed that selects the samples to make again.
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    /// Path on this machine for an input of the dataset's job, used when making samples again: `--set
    /// hand.model=scenes/hand.xml`. A file with other content is refused.
    #[arg(long = "set", value_name = "KEY=PATH", requires = "regenerate")]
    pub set: Vec<String>,
    /// Append messages, progress and results to a file, each line with its time and level.
    #[arg(long, value_name = "FILE", value_parser = local_path())]
    pub log: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct DiffArgs {
    /// First dataset folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub a: Folder,
    /// Dataset folder to compare with.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub b: Folder,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct ReportArgs {
    /// Folder of a dataset or of a set.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Output file; by default `report.html` in that folder. For a set, only this page is written, and it has no links to the
    /// reports of the datasets.
    #[arg(short, long, value_name = "FILE", value_parser = local_path())]
    pub out: Option<PathBuf>,
    /// Picture to show first on the page of a set (PNG), such as an `overlay.png` of `graspmill complete`.
    #[arg(long, value_name = "FILE.png", requires = "cover_text")]
    pub cover: Option<PathBuf>,
    /// Caption of this picture.
    #[arg(long, value_name = "TEXT", requires = "cover")]
    pub cover_text: Option<String>,
    /// Open the page in the browser: the program that BROWSER names, or else the desktop's default.
    #[arg(long)]
    pub open: bool,
}

#[derive(Args, Debug)]
pub struct ReleaseArgs {
    /// Dataset folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Release folder; must be new or empty.
    #[arg(short, long, value_name = "REL", value_parser = local_path())]
    pub out: PathBuf,
    /// File with the facts that only the authors know: title, date, licence, uses (TOML; docs/releases.md).
    #[arg(long, value_name = "ABOUT")]
    pub about: PathBuf,
    /// Leave out files that may not be shipped, and include a recipe that makes them again.
    #[arg(long)]
    pub recipe: bool,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct ExportArgs {
    /// Dataset folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Output format.
    #[arg(long, value_enum)]
    pub to: ExportFormatName,
    /// Output folder; must be new or empty.
    #[arg(short, long, value_name = "DIR", value_parser = local_path())]
    pub out: PathBuf,
    /// Export only this split: training, holdout, validation, test.
    #[arg(long, value_name = "SPLIT")]
    pub split: Option<String>,
    /// Export only samples of this object; for products made from scenes, of this scene, as 'training 0' (repeatable).
    #[arg(long, value_name = "NAME")]
    pub object: Vec<String>,
    /// Maximum number of samples (of grasps with mujoco), spread evenly over the dataset.
    #[arg(long, value_name = "N")]
    pub limit: Option<u64>,
    /// npy: write one byte per cell, shape (N, n, n, n), instead of packed bits.
    #[arg(long)]
    pub unpacked: bool,
    /// vgn: extra layout parameter in metres that the dataset does not contain: max_opening_width, finger_depth; for views also
    /// size and below (repeatable).
    #[arg(long, value_name = "KEY=NUMBER", value_parser = key_and_number)]
    pub set: Vec<(String, f64)>,
}

/// A key and its number, out of `KEY=NUMBER`.
fn key_and_number(text: &str) -> Result<(String, f64), String> {
    let expected = || format!("`{text}` is not KEY=NUMBER; write it as finger_depth=0.05");
    let (key, number) = text.split_once('=').ok_or_else(expected)?;
    let number = number.trim().parse().map_err(|_| expected())?;
    Ok((key.trim().to_owned(), number))
}

/// Entry of the table of export formats, selected by its name.
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
    /// Compute how far end-effector poses are inside or outside the reachable set: distance, gradient, label, joint values.
    Reach(ReachArgs),
}

#[derive(Args, Debug)]
pub struct ReachArgs {
    /// Dataset folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
    /// Pose of the target site in metres and radians (repeatable): `--pose 0.6,0.1,0.9,0,0.5,0.2`.
    #[arg(long, value_name = "X,Y,Z,ROLL,PITCH,YAW", allow_hyphen_values = true)]
    pub pose: Vec<String>,
    /// File of poses, six numbers per line; a first line of names (x, y, z, roll, pitch, yaw) may give another order.
    #[arg(long, value_name = "FILE", required_unless_present = "pose")]
    pub csv: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Subcommand, Debug)]
pub enum MeshesCommand {
    /// Describe each mesh, list repairs that a job would make, and explain refusals and their remedies.
    Check(MeshesCheckArgs),
    /// Write each disconnected part of a mesh as a separate mesh.
    Split(MeshesSplitArgs),
}

#[derive(Args, Debug)]
pub struct MeshesSplitArgs {
    /// Mesh file.
    pub file: PathBuf,
    /// Folder for the parts (NAME-1.ply, NAME-2.ply and so on, in metres); must be new or empty.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub scale: MeshScaleArgs,
}

/// Size of a mesh.
#[derive(Args, Debug)]
pub struct MeshScaleArgs {
    /// Length unit of the files: m, dm, cm, mm, in, ft, or the length of one unit in metres.
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
    /// Describe a planning group and the robot's collision bodies; find the pairs of bodies that always or never touch.
    Check(RobotCheckArgs),
}

#[derive(Args, Debug)]
pub struct RobotCheckArgs {
    /// Robot description (MJCF or URDF).
    pub model: PathBuf,
    /// Joints of the planning group.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', required = true)]
    pub joints: Vec<String>,
    /// End-effector site, or a body (a link of a URDF).
    #[arg(long, value_name = "SITE")]
    pub target: String,
    /// Value of a joint outside the group, in radians or metres (repeatable); by default its value in the description.
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
    /// Describe the actuated joints, coupled joints and contacts of a hand; find its bodies that collide with each other; draw
    /// the hand.
    Check(HandCheckArgs),
}

#[derive(Args, Debug)]
pub struct HandCheckArgs {
    /// Hand description (MJCF or URDF). A table with the same name and the ending `.toml` must be in the same folder.
    pub hand: PathBuf,
    /// Random postures to evaluate.
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    pub samples: u64,
    /// Folder for pictures of the hand opened, half closed and closed; created if absent.
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
    /// Shell to complete for.
    pub shell: clap_complete::Shell,
}

#[derive(Args, Debug)]
pub struct ManArgs {
    /// Folder for the pages; created if absent.
    #[arg(short, long, value_name = "DIR", value_parser = local_folder(), value_hint = ValueHint::DirPath)]
    pub out: Folder,
}

#[derive(Args, Debug)]
pub struct DigestArgs {
    /// Dataset folder.
    #[arg(value_parser = folder(), value_hint = ValueHint::DirPath)]
    pub dir: Folder,
}
