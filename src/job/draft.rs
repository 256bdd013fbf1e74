//! A job file, read and checked in every setting, with the meshes that it names found but not yet read.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use super::{
    check::{self, Checker, GraspsReader, HandReader, RobotReader, SceneReader},
    checked::{
        Completion, GraspSettings, JobHand, KnownMass, PackageFile, PatchJob, Profile, ReachabilityJob, Renderer,
        SplitSettings,
    },
    decode::{self, Decoded},
    discover,
    document::Document,
    errors::JobErrors,
    spec::{
        BodySpec,
        completion::{CompletionSpec, ObjectsSpec, SplitSpec},
        grasp::GraspsSpec,
        patches::PatchesSpec,
        reachability::ReachabilitySpec,
    },
};
use crate::assets::{MeshRefusal, MeshSource};

/// A job file as text, and what is laid over it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JobText {
    /// What messages call the file.
    pub label: String,
    /// The folder that relative paths in it start from.
    pub folder: PathBuf,
    /// Its text.
    pub text: String,
    /// What `--set` gave, each `dotted.key=value`; later ones win.
    pub overrides: Vec<String>,
}

impl JobText {
    /// Reads a job file.
    ///
    /// # Errors
    /// When the file cannot be read as UTF-8 text.
    pub fn open(path: &Path, overrides: &[String]) -> io::Result<Self> {
        Ok(Self {
            label: path.display().to_string(),
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            text: fs::read_to_string(path)?,
            overrides: overrides.to_vec(),
        })
    }
}

/// What a job may refer to beyond its own folder.
pub struct Surroundings<'a> {
    /// The folder that holds the packages of meshes.
    pub packages: PathBuf,
    /// The default set of built-in shapes: what patterns with `*` and `?` are held against, beside the half-shapes. Full
    /// names reach every shape.
    pub built_in: Vec<String>,
    /// Reads cameras out of scenes; [`no_scenes`](super::no_scenes) where there is no simulator.
    pub scenes: &'a SceneReader<'a>,
    /// Reads robots; [`no_robots`](super::no_robots) where there is no simulator.
    pub robots: &'a RobotReader<'a>,
    /// Tries hands that touch; [`no_hands`](super::no_hands) where there is no simulator.
    pub hands: &'a HandReader<'a>,
    /// Tries hands that grasp, likewise.
    pub grasping_hands: &'a HandReader<'a>,
    /// Reads datasets of grasps; [`no_grasps`](super::no_grasps) where there is nothing to read with.
    pub grasps: &'a GraspsReader<'a>,
}

/// A checked job whose meshes are found but not yet read.
#[derive(Clone, Debug, PartialEq)]
pub struct JobDraft {
    /// Name, for people.
    pub name: String,
    /// Seed of every random stream.
    pub seed: u64,
    /// Which defaults were taken.
    pub profile: Profile,
    /// What `--set` changed, those of the file first.
    pub overrides: Vec<String>,
    /// Samples a shard.
    pub shard_samples: u32,
    /// Things to tell the user.
    pub notes: Vec<String>,
    /// What is made of what.
    pub work: WorkDraft,
    pub(super) document: Document,
}

/// What a draft makes of what.
#[derive(Clone, Debug, PartialEq)]
pub enum WorkDraft {
    /// Pairs of grids, of meshes that are still to be prepared.
    Completion(CompletionDraft),
    /// A map of reachable poses: nothing is left to be read.
    Reachability(ReachabilityJob),
    /// Grasps, of meshes that are still to be prepared.
    Grasps(GraspDraft),
    /// Patches, of grasps that have been read.
    Patches(PatchJob),
}

/// A completion job before its meshes are read.
#[derive(Clone, Debug, PartialEq)]
pub struct CompletionDraft {
    /// How samples are made.
    pub settings: Completion,
    /// Of what.
    pub objects: ObjectsDraft,
}

/// A job for grasps before its meshes are read.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspDraft {
    /// How grasps are searched for and judged.
    pub settings: GraspSettings,
    /// The hand.
    pub hand: JobHand,
    /// Of what.
    pub objects: ObjectsDraft,
}

/// The objects of a job before their meshes are read.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectsDraft {
    /// Who trains and who tests; names may still be patterns.
    pub split: SplitSettings,
    /// The meshes to prepare, by name.
    pub meshes: Vec<FoundMesh>,
    /// What was found but cannot be used.
    pub refused: Vec<MeshRefusal>,
}

/// One mesh that a job names.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundMesh {
    /// How to prepare it.
    pub source: MeshSource,
    /// The package that holds it, where one does.
    pub package: Option<PackageFile>,
    /// What it weighs, where the job knows.
    pub mass: Option<KnownMass>,
    /// The content that it must have, where the job pins it.
    pub pinned: Option<crate::ids::ObjectId>,
}

impl JobDraft {
    /// Reads, checks and lists the meshes: everything but opening a mesh. All mistakes at once.
    ///
    /// # Errors
    /// Every mistake of the file and of its overrides.
    pub fn read(job: &JobText, surroundings: &Surroundings<'_>) -> Result<Self, JobErrors> {
        let Decoded { head, body, document, errors, wrong } = decode::decode(&job.label, &job.text, &job.overrides)?;
        let checker = Checker { document: &document, errors, wrong };
        let Worked { work, shard_samples, notes } = match body {
            BodySpec::Completion(spec) => completion(checker, &spec, &job.folder, surroundings)?,
            BodySpec::Reachability(spec) => reachability(checker, &spec, &job.folder, surroundings)?,
            BodySpec::Grasps(spec) => grasps(checker, &spec, &job.folder, surroundings)?,
            BodySpec::Patches(spec) => patches(checker, &spec, &job.folder, surroundings)?,
        };
        let file_name = Path::new(&job.label).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        Ok(Self {
            name: head.name.or(file_name).unwrap_or_else(|| "job".to_owned()),
            seed: u64::try_from(head.seed).expect("the schema asks for a seed from 0"),
            profile: head.profile,
            overrides: head.overrides.into_iter().chain(job.overrides.iter().cloned()).collect(),
            shard_samples,
            notes,
            work,
            document,
        })
    }

    /// [`JobDraft::read`] of a job for patches that takes its grasps from the dataset in `grasps`, whatever the file says. Where
    /// that is stands in the resolved job, as if the file had said it.
    ///
    /// # Errors
    /// Every mistake of the file and of its overrides.
    pub fn read_with_grasps(job: &JobText, grasps: &Path, surroundings: &Surroundings<'_>) -> Result<Self, JobErrors> {
        let mut job = job.clone();
        job.overrides.push(format!("grasps.dataset = {}", toml::Value::from(discover::with_slashes(grasps))));
        let mut draft = Self::read(&job, surroundings)?;
        draft.overrides.pop();
        Ok(draft)
    }

    /// What to prepare, in order: `resolve` wants the results in the same order.
    pub fn sources(&self) -> impl ExactSizeIterator<Item = &MeshSource> {
        let meshes = match &self.work {
            WorkDraft::Completion(draft) => &draft.objects.meshes[..],
            WorkDraft::Grasps(draft) => &draft.objects.meshes,
            WorkDraft::Reachability(_) | WorkDraft::Patches(_) => &[],
        };
        meshes.iter().map(|mesh| &mesh.source)
    }

    /// Whether it draws colours, which needs OpenGL.
    pub fn draws_colours(&self) -> bool {
        match &self.work {
            WorkDraft::Completion(draft) => draft.settings.renderer == Renderer::MujocoGl,
            WorkDraft::Patches(job) => job.settings.colour.is_some(),
            _ => false,
        }
    }

    /// The completion job, where it is one.
    pub fn completion(&self) -> Option<&CompletionDraft> {
        match &self.work {
            WorkDraft::Completion(draft) => Some(draft),
            _ => None,
        }
    }
}

/// What came of a product's keys.
struct Worked {
    work: WorkDraft,
    shard_samples: u32,
    notes: Vec<String>,
}

fn completion(
    mut checker: Checker<'_>,
    spec: &CompletionSpec,
    folder: &Path,
    surroundings: &Surroundings<'_>,
) -> Result<Worked, JobErrors> {
    let settings = check::completion(&mut checker, spec, folder, surroundings.scenes, surroundings.hands);
    let (objects, notes) = objects(checker, &spec.split, &spec.objects, folder, surroundings)?;
    let views = settings.views.len() as u32;
    Ok(Worked {
        work: WorkDraft::Completion(CompletionDraft { settings, objects }),
        shard_samples: spec.shards.samples.unwrap_or_else(|| default_shard_samples(views)),
        notes,
    })
}

/// Split and meshes, and what to tell the user; ends with all mistakes that have been found so far.
fn objects(
    mut checker: Checker<'_>,
    split: &SplitSpec,
    objects: &[ObjectsSpec],
    folder: &Path,
    surroundings: &Surroundings<'_>,
) -> Result<(ObjectsDraft, Vec<String>), JobErrors> {
    let split = check::split(&mut checker, split);
    let found = discover::discover(&mut checker, objects, folder, surroundings);
    let mut errors = checker.errors;
    errors.extend(found.table_errors);
    JobErrors::check(errors)?;
    Ok((ObjectsDraft { split, meshes: found.meshes, refused: found.refused }, found.notes))
}

fn grasps(
    mut checker: Checker<'_>,
    spec: &GraspsSpec,
    folder: &Path,
    surroundings: &Surroundings<'_>,
) -> Result<Worked, JobErrors> {
    let (settings, hand) = check::grasps(&mut checker, spec, folder, surroundings.grasping_hands);
    let (objects, notes) = objects(checker, &spec.split, &spec.objects, folder, surroundings)?;
    let hand = hand.expect("what is wrong with the hand was reported");
    Ok(Worked {
        shard_samples: spec.shards.runs.unwrap_or(settings.seeds),
        work: WorkDraft::Grasps(GraspDraft { settings, hand, objects }),
        notes,
    })
}

fn patches(
    mut checker: Checker<'_>,
    spec: &PatchesSpec,
    folder: &Path,
    surroundings: &Surroundings<'_>,
) -> Result<Worked, JobErrors> {
    let job = check::patches(&mut checker, spec, folder, surroundings.grasping_hands, surroundings.grasps);
    JobErrors::check(checker.errors)?;
    let job = job.expect("what is wrong with grasps, hand and camera was reported");
    Ok(Worked { work: WorkDraft::Patches(job), shard_samples: spec.shards.samples, notes: Vec::new() })
}

fn reachability(
    mut checker: Checker<'_>,
    spec: &ReachabilitySpec,
    folder: &Path,
    surroundings: &Surroundings<'_>,
) -> Result<Worked, JobErrors> {
    let job = check::reachability(&mut checker, spec, folder, surroundings.robots);
    JobErrors::check(checker.errors)?;
    let job = job.expect("what is wrong with robot and poses was reported");
    Ok(Worked {
        shard_samples: spec.shards.positions.unwrap_or_else(|| default_shard_positions(job.orientations())),
        work: WorkDraft::Reachability(job),
        notes: Vec::new(),
    })
}

/// Positions that make about 65,536 poses; one at least.
fn default_shard_positions(orientations: u32) -> u32 {
    (65_536 / orientations.max(1)).max(1)
}

/// The multiple of the views an object that is nearest below 4,096, so that shards end where objects end; 4,096 when an
/// object has more views than that.
pub fn default_shard_samples(views: u32) -> u32 {
    const ABOUT: u32 = 4096;
    if views == 0 || views > ABOUT { ABOUT } else { ABOUT / views * views }
}
