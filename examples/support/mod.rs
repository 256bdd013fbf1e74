//! Shared by the examples: jobs from code, and a folder to work in.

use std::{env, error::Error, fs, io};

use graspmill::{
    make::{JobContext, JobText, OpenJob, Parallelism, RunContext, run::RunSummary},
    read::Folder,
};

/// Makes a dataset in a folder by the text of a job. Paths in the job are relative to the current folder.
pub fn make_dataset(job: &str, folder: &Folder) -> Result<RunSummary, Box<dyn Error>> {
    let text = JobText {
        label: "the job of this example".to_owned(),
        folder: ".".into(),
        text: job.to_owned(),
        overrides: Vec::new(),
    };
    let parallelism = Parallelism::available();
    let context = RunContext::quiet(&parallelism);
    let job = OpenJob::open(&text, &JobContext::default(), &context)?;
    Ok(job.run(folder, &context)?)
}

/// An empty folder `graspmill-example-NAME` among the system's temporary files. It stays, so that you can look into it; the
/// next run of the example empties it.
pub fn fresh_folder(name: &str) -> io::Result<Folder> {
    let folder = env::temp_dir().join(format!("graspmill-example-{name}"));
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    Ok(Folder::at(folder))
}
