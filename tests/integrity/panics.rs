//! Panics in producers: an error names the sample in work, finished shards stay, and a run without the defect resumes
//! to the requested dataset.

use std::{
    panic::resume_unwind,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
};

use graspmill::{
    factory::{
        Cancel, Parallelism, ProduceError, RunContext, RunError, SampleWriter,
        job::{JobContext, JobObjects, JobText, SplitInput},
        plan::{JobSplits, SubjectItems},
        run::OpenJob,
        work::{Closing, OpenWork, Opening, Producer, Work, WorkTables},
    },
    files::Folder,
    format::{Channel, Product},
    ids::ItemId,
};

use crate::support::{
    jobs::{small_folder, small_jobs},
    program::Program,
    workspace::Workspace,
};

/// Text of the planted panics.
const MESSAGE: &str = "a planted defect";

/// Place of a panic.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// Opening the parts that all threads share.
    Open,
    /// Making the producer of a thread.
    Producer,
    /// Preparing a subject.
    Load,
    /// Before an item's samples are made.
    BeforeItem,
    /// After an item's samples were stored.
    AfterItem,
    /// Closing the dataset.
    Finish,
}

/// The work of a job with a defect: at its place, the `countdown`-th call panics.
#[derive(Debug)]
struct DefectiveWork {
    inner: Arc<dyn Work>,
    place: Place,
    countdown: AtomicU32,
}

impl DefectiveWork {
    fn pass(&self, place: Place) {
        if place == self.place && self.countdown.fetch_sub(1, Ordering::Relaxed) == 1 {
            // Unlike `panic!`, this prints nothing among the results of tests.
            resume_unwind(Box::new(MESSAGE.to_owned()));
        }
    }
}

impl Work for DefectiveWork {
    fn product(&self) -> Product {
        self.inner.product()
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        self.inner.subjects()
    }

    fn resolved(&self, folder: &Path, shard_samples: u32) -> toml::Table {
        self.inner.resolved(folder, shard_samples)
    }

    fn sample_keys(&self) -> toml::Table {
        self.inner.sample_keys()
    }

    fn subject_keys(&self) -> toml::Table {
        self.inner.subject_keys()
    }

    fn objects(&self) -> Option<&JobObjects> {
        self.inner.objects()
    }

    fn divided(&self) -> Option<SplitInput<'_>> {
        self.inner.divided()
    }

    fn tables(&self, splits: Option<&JobSplits>) -> WorkTables {
        self.inner.tables(splits)
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        self.pass(Place::Open);
        Ok(Box::new(DefectiveOpenWork { work: self, inner: self.inner.open(opening)? }))
    }
}

struct DefectiveOpenWork<'a> {
    work: &'a DefectiveWork,
    inner: Box<dyn OpenWork + 'a>,
}

impl OpenWork for DefectiveOpenWork<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        self.work.pass(Place::Producer);
        Ok(Box::new(DefectiveProducer { work: self.work, inner: self.inner.producer()? }))
    }

    fn finish(&self, closing: &mut Closing<'_>) -> Result<(), RunError> {
        self.inner.finish(closing)?;
        self.work.pass(Place::Finish);
        Ok(())
    }
}

struct DefectiveProducer<'a> {
    work: &'a DefectiveWork,
    inner: Box<dyn Producer + 'a>,
}

impl Producer for DefectiveProducer<'_> {
    fn channels(&self) -> Vec<Channel> {
        self.inner.channels()
    }

    fn load(&mut self, subject: usize, cancel: &Cancel) -> Result<(), ProduceError> {
        self.work.pass(Place::Load);
        self.inner.load(subject, cancel)
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        self.work.pass(Place::BeforeItem);
        self.inner.produce(item, out)?;
        self.work.pass(Place::AfterItem);
        Ok(())
    }
}

/// Places and the calls that panic there: the first ones, and a later one where shards can be done by then.
const PANICS: [(Place, u32); 8] = [
    (Place::Open, 1),
    (Place::Producer, 1),
    (Place::Load, 1),
    (Place::BeforeItem, 1),
    (Place::BeforeItem, 2),
    (Place::AfterItem, 1),
    (Place::AfterItem, 2),
    (Place::Finish, 1),
];

/// Settings of the job of grasps: its runs are made a dozen times, and need not be good.
const BRIEF: [&str; 2] = ["annealing.steps=300", "physics={ perturbed_runs = 0, table = false, confirm = \"none\" }"];

/// A job with a defect in the place of its work.
fn with_defect(job: &OpenJob, place: Place, countdown: u32) -> OpenJob {
    let mut job = job.clone();
    let inner = Arc::clone(&job.job.work);
    job.job.work = Arc::new(DefectiveWork { inner, place, countdown: AtomicU32::new(countdown) });
    job
}

#[test]
fn a_panic_names_what_was_being_made_and_loses_nothing() {
    assert_contained(&["completion"]);
}

#[test]
#[ignore = "slow: make test-all"]
fn a_panic_of_any_product_names_what_was_being_made_and_loses_nothing() {
    let names = small_jobs(small_folder()).map(|(name, _)| name);
    assert_contained(&names);
}

/// Panics in runs of the small jobs of these names, each resumed.
fn assert_contained(names: &[&str]) {
    let workspace = Workspace::new();
    let mut contained = 0;
    let jobs = small_jobs(small_folder()).into_iter().filter(|(name, _)| names.contains(name));
    for (name, text) in jobs {
        let overrides = if name == "grasps" { BRIEF.map(str::to_owned).to_vec() } else { Vec::new() };
        let (label, folder) = (format!("{name}.toml"), workspace.folder().to_owned());
        let text = JobText { label, folder, text, overrides };
        let parallelism = Parallelism { threads: 2, ..Parallelism::available() };
        let context = RunContext::quiet(&parallelism);
        let job = OpenJob::open(&text, &JobContext::default(), &context).expect("a job");
        let expected = job.run(&Folder::at(workspace.path(name)), &context).expect("a dataset").manifest.root;

        for (number, (place, countdown)) in PANICS.into_iter().enumerate() {
            let folder = workspace.path(format!("{name}-{number}"));
            let error = with_defect(&job, place, countdown).run(&Folder::at(&folder), &context);
            let at = format!("{name}, {place:?} {countdown}");
            let Err(RunError::Panicked { what, message }) = error else { panic!("{at}: {error:?}") };
            assert_eq!(message, MESSAGE, "{at}");
            let noun = match place {
                Place::Open | Place::Producer => "opening the job".to_owned(),
                Place::Finish => "closing the dataset".to_owned(),
                Place::Load => format!("preparing {}", job.job.product().subjects.one),
                Place::BeforeItem | Place::AfterItem => job.job.product().samples.one.to_owned(),
            };
            assert!(what.starts_with(&noun), "{at}: {what}");

            let resumed = job.run(&Folder::at(&folder), &context).unwrap_or_else(|error| panic!("{at}: {error}"));
            assert_eq!(resumed.manifest.root, expected, "{at}");
            if place == Place::Finish {
                assert_eq!(resumed.made, 0, "{at}: shards that were finished are made again");
            }
            contained += 1;
        }
        Program::on("verify", workspace.path(format!("{name}-0"))).succeed();
    }
    assert_eq!(contained, names.len() * PANICS.len());
}
