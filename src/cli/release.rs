//! `graspmill release`.

use super::{
    args::ReleaseArgs,
    exit::{Exit, Failure},
    folder::refuse_set,
    machine,
    printer::Printer,
    run, verify,
};
use kernel::words::{Show, counted, size_in_words};
use publish::{Published, ReleaseError, ReleaseOptions, make_release};

/// Prepares a dataset for publication.
pub fn release(arguments: &ReleaseArgs, printer: &Printer) -> Result<Exit, Failure> {
    refuse_set(&arguments.dir)?;
    let options = ReleaseOptions {
        folder: &arguments.dir,
        out: &arguments.out,
        about: &arguments.about,
        recipe: arguments.recipe,
        threads: machine::threads(None),
    };
    let published = make_release(&options).map_err(failure)?;
    published.notes.iter().for_each(|note| printer.say(&format!("note: {}", note.shown())));
    if arguments.json {
        printer.json(&published)?;
    } else {
        printer.result(&words(&published));
    }
    Ok(Exit::Complete)
}

fn words(published: &Published) -> String {
    let Published { folder, root, files, bytes, left_out, .. } = published;
    let (count, size) = (counted(*files as u64, "file"), size_in_words(*bytes));
    let mut lines = vec![format!("{count}, {size}, in {}", folder.shown())];
    if !left_out.is_empty() {
        lines.push(format!("a recipe: {} of the dataset are not included", counted(left_out.len() as u64, "file")));
    }
    lines.push(format!("root {root}"));
    lines.join("\n")
}

fn failure(error: ReleaseError) -> Failure {
    match error {
        ReleaseError::Dataset(error) if error.is_foreign() => Failure::new(Exit::BadSpec, error),
        ReleaseError::Dataset(error) => verify::damage(error),
        ReleaseError::NotIntact { .. } => Failure::new(Exit::Mismatch, error),
        ReleaseError::Preview(error) => run::preview_failure(error),
        ReleaseError::NoAbout { .. }
        | ReleaseError::About { .. }
        | ReleaseError::MayNotShip { .. }
        | ReleaseError::NothingToLeaveOut { .. } => Failure::new(Exit::BadSpec, error),
    }
}
