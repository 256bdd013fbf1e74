//! Documents of the command line for shells and manual readers: completions, manual pages.

use std::{io, path::Path};

use clap::{Command, CommandFactory};

use super::{
    args::{Cli, CompletionsArgs, ManArgs},
    exit::{Exit, Failure},
    printer::Printer,
};
use kernel::{
    files::{Folder, Temporary},
    words::Show,
};

/// Prints a shell's completion script.
pub fn completions(arguments: &CompletionsArgs, printer: &Printer) -> Result<Exit, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "graspmill", &mut script);
    printer.result(&String::from_utf8(script)?);
    Ok(Exit::Complete)
}

/// Prints name and version of the program.
pub fn version(printer: &Printer) -> Result<Exit, Failure> {
    printer.result(&Cli::command().render_version());
    Ok(Exit::Complete)
}

/// Writes a manual page of the program and one of each command: `graspmill.1`, `graspmill-run.1`.
pub fn man(arguments: &ManArgs, printer: &Printer) -> Result<Exit, Failure> {
    let folder = &arguments.out;
    folder.create().map_err(|error| failed(folder.path(), error))?;
    let mut command = Cli::command();
    command.build();
    let mut pages = 0;
    write_pages(&command, folder, &mut pages)?;
    printer.result(&format!("{pages} pages in {}; put them into a folder man1 on MANPATH", folder.path().shown()));
    Ok(Exit::Complete)
}

fn write_pages(command: &Command, folder: &Folder, pages: &mut u32) -> Result<(), Failure> {
    let name = command.get_display_name().unwrap_or_else(|| command.get_name()).to_owned();
    let file = format!("{name}.1");
    let mut page = Vec::new();
    clap_mangen::Man::new(command.clone()).title(name).render(&mut page)?;
    Temporary::write(folder, &file, &page).map_err(|error| failed(&folder.path_of(&file), error))?;
    *pages += 1;
    let verbs = command.get_subcommands().filter(|verb| !verb.is_hide_set() && verb.get_name() != "help");
    verbs.into_iter().try_for_each(|verb| write_pages(verb, folder, pages))
}

fn failed(path: &Path, error: io::Error) -> Failure {
    anyhow::Error::new(error).context(path.shown().to_string()).into()
}
