//! Turns a dataset into a report page and an export for NumPy.
//!
//! From the root of the repository:
//!
//! ```text
//! cargo run --release --example publish                       # makes a small dataset first
//! cargo run --release --example publish -- datasets/quickstart
//! ```
//!
//! Both go to `graspmill-example-published` among the system's temporary files.

#![expect(clippy::print_stdout, reason = "an example prints what it writes")]

mod support;

use std::{env, error::Error};

use graspmill::{
    publish::{
        export::{ExportFormat, ExportSelection, export},
        inspect, report,
    },
    read::{Folder, Selection, Split},
};

/// Pairs of three built-in shapes, 4 views of each.
const JOB: &str = r#"
name = "three-shapes"
objects = [{ built_in = ["bowl-01", "can-01", "cup-01"] }]
views = { even = 4 }
split = { validation_objects = 0, test_objects = 1 }
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = match env::args_os().nth(1) {
        Some(folder) => Folder::at(folder),
        None => {
            let folder = support::fresh_folder("publish")?;
            support::make_dataset(JOB, &folder)?;
            folder
        }
    };
    let out = support::fresh_folder("published")?;

    // The facts of a dataset: as text here, as JSON by serde.
    println!("{}", inspect(&folder)?);

    let page = report(&folder, Some(&out.path_of("report.html")))?;
    println!("{}: {} bytes, {} with pictures", page.path.display(), page.bytes, page.shown);

    // Training pairs as one array per grid. `graspmill::publish::export::FORMATS` lists the formats.
    let format = ExportFormat::from_name("npy").ok_or("a format of the table")?;
    let selection = ExportSelection { samples: Selection::from_split(Split::Training), ..ExportSelection::default() };
    let summary = export(&folder, format, &out.path_of("npy"), &selection)?;
    let (count, counted) = (summary.count, summary.counted.for_count(summary.count));
    println!("{}: {count} {counted} in {} files", summary.folder.display(), summary.files);
    Ok(())
}
