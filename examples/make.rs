//! Makes a dataset by a job that the program itself writes, shows progress, and checks the result.
//!
//! From the root of the repository:
//!
//! ```text
//! cargo run --release --example make
//! ```

#![expect(clippy::print_stdout, reason = "an example prints what it makes")]

use std::error::Error;

use graspmill::{
    make::{Cancel, Event, JobContext, JobText, OpenJob, Parallelism, ParquetIndex, RunContext, run::regenerate},
    read::{DatasetReader, Folder, VerifyLevel, VerifyOptions, verify},
};

/// Completion pairs of two built-in shapes, 8 views of each. The keys are those of a job file.
const JOB: &str = r#"
name = "cans-and-cups"
seed = 7
objects = [{ built_in = ["can-01", "cup-01"] }]
views = { even = 8 }
split = { validation_objects = 0, test_objects = 1 }
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let temporary = tempfile::tempdir()?;
    // Links inside a dataset are not followed: everything in it is reached through a `Folder`.
    let folder = Folder::at(temporary.path());

    // A job from a file is read by `JobText::open(path, overrides)`; messages name it by its label.
    let text = JobText {
        label: "make.toml".to_owned(),
        folder: ".".into(),
        text: JOB.to_owned(),
        overrides: vec!["channels.depth=f32".to_owned()],
    };

    // Another thread may call `cancel.cancel()`: finished shards stay, and the same call resumes.
    let (parallelism, cancel) = (Parallelism::available(), Cancel::new());
    let context = RunContext { parallelism: &parallelism, cancel: &cancel, listener: &print_event };

    // Reads the job, prepares its meshes and makes the plan. Nothing is written yet.
    let job = OpenJob::open(&text, &JobContext::default(), &context)?;
    job.warnings().iter().for_each(|warning| println!("warning: {warning}"));

    let summary = job.run(&folder, &context)?;
    println!("{} samples, root {}", summary.manifest.counts.kept, summary.manifest.root);

    // Every byte against its digest; then four samples made again and compared with the stored ones.
    let options = VerifyOptions {
        level: VerifyLevel::Full,
        rules: &[],
        index: Some(&ParquetIndex),
        threads: parallelism.threads,
    };
    let report = verify(&folder, options, |_| ())?;
    let reader = DatasetReader::open(&folder)?;
    let again = regenerate(&reader, &job.job, &job.plan, 4, 1, &context)?;
    println!(
        "intact: {}; {} samples made again, {} differ",
        report.is_intact(),
        again.samples,
        again.differences.len()
    );
    Ok(())
}

/// Prints an event of the run. Events come from any thread.
fn print_event(event: Event) {
    match event {
        Event::Planned { samples, shards, threads, .. } => {
            println!("{samples} samples in {shards} shards, {threads} threads");
        }
        Event::ShardFinished { file, samples, .. } => println!("{file}: {samples} samples"),
        _ => {}
    }
}
