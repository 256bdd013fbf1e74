//! Job files: which are accepted, which are refused and in what words, and that the schema agrees.

mod completion;
mod files;
mod grasps;
mod hands;
mod patches;
mod reachability;
mod renamed;
mod splits;

use std::path::{Path, PathBuf};

use graspmill::{
    assets::{AssetRecord, InsideMethod, Winding},
    factory::{
        job::{Job, JobContext, JobDraft, JobText},
        products::completion::{CompletionJob, CompletionSettings},
        work::{Work, WorkTables},
    },
    form::FormErrors,
    ids::{Digest, ObjectId},
};

/// Surroundings without packages of meshes.
fn context(packages: &str) -> JobContext {
    JobContext { packages: PathBuf::from(packages), ..JobContext::default() }
}

/// A job `test.toml` in `jobs/`.
fn job_text(text: impl Into<String>, overrides: &[&str]) -> JobText {
    JobText {
        label: "test.toml".to_owned(),
        folder: PathBuf::from("jobs"),
        text: text.into(),
        overrides: overrides.iter().map(|text| (*text).to_owned()).collect(),
    }
}

fn read(text: &str, overrides: &[&str]) -> Result<JobDraft, FormErrors> {
    JobDraft::read(&job_text(text, overrides), &context("no/such/folder"))
}

/// A made-up record, whose content and geometry follow from the name.
fn asset(name: &str) -> AssetRecord {
    AssetRecord {
        name: name.to_owned(),
        object: ObjectId(Digest::hash(name.as_bytes())),
        geometry: Digest::hash(format!("geometry of {name}").as_bytes()),
        file: None,
        triangles: 12,
        vertices: 8,
        bodies: 1,
        loose: None,
        euler: 2,
        watertight: true,
        winding: Winding::Outward,
        volume: 1e-3,
        lower: [0.0; 3],
        extents: [0.1; 3],
        scale: 1.0,
        repairs: Vec::new(),
        inside: InsideMethod::Crossings,
        solid_effort: None,
        warnings: Vec::new(),
        licence: None,
        citation: None,
        group: None,
    }
}

fn resolve(draft: JobDraft) -> Job {
    let assets = draft.sources().map(|source| Ok(AssetRecord { group: source.group.clone(), ..asset(&source.name) }));
    let assets = assets.collect();
    draft.resolve(assets).expect("the draft resolves")
}

/// The work of a job as that of one product.
fn work_of<W: Work>(job: &Job) -> &W {
    job.work_of().expect("a job of this product")
}

fn completion(job: &Job) -> &CompletionJob {
    work_of(job)
}

/// Settings of a completion job, with made-up meshes.
fn completion_settings(draft: JobDraft) -> CompletionSettings {
    completion(&resolve(draft)).settings.clone()
}

/// Requires that two jobs are the same: by digest, and by every key as written.
#[track_caller]
fn assert_same_job(one: &Job, other: &Job) {
    assert_eq!(one.digest(), other.digest());
    assert_eq!(one.to_toml(Path::new("jobs")), other.to_toml(Path::new("jobs")));
}

/// Items of each subject of a job, in order.
fn items(job: &Job) -> Vec<u32> {
    job.work.subjects().iter().map(|subject| subject.items).collect()
}

/// Tables that a job adds to its dataset.
fn tables(job: &Job) -> WorkTables {
    job.work.tables(None)
}

const MINIMAL: &str = "[[objects]]\nbuilt_in = [\"can-*\", \"bowl-*\"]\n";
