//! The command line: the only room that prints, reads the environment and selects exit codes.

mod args;
mod complete;
mod complete_dataset;
mod completion_args;
mod completion_method;
mod contacts;
mod dataset;
mod diff;
mod docs;
mod doctor;
mod estimate;
mod evaluate;
mod exit;
mod folder;
mod hand;
mod init;
mod jobs;
mod local_path;
mod log;
mod machine;
mod merge;
mod meshes;
mod model;
mod pairs;
mod parallel;
mod picture;
mod printer;
mod progress;
mod query;
mod release;
mod robot;
mod run;
mod scene_picture;
mod segment;
mod set;
mod stored_samples;
mod submit;
mod task;
mod true_meshes;
mod verify;

use std::{env, path, process::ExitCode, thread};

use clap::{CommandFactory, Parser};
use factory::job::JobSet;
use format::dataset::SetTable;

use args::{Cli, Command, MeshesCommand, QueryCommand, RunArgs, SubmitArgs, VerifyArgs};
use completion_args::{EvaluateCommand, ModelCommand};
use exit::{Exit, Failure};
use kernel::{files, words::Show};
use log::Level;
use printer::Printer;

/// Grammar of the command line: every command with its arguments.
pub fn command() -> clap::Command {
    Cli::command()
}

/// Stack of the program's main thread [bytes]: the default of Linux, regardless of `ulimit -s`.
const STACK_BYTES: usize = 8 << 20;

/// Parses the arguments, runs the command on a thread with its own stack, and returns its exit code.
pub fn main() -> ExitCode {
    let program = thread::Builder::new().name("main".to_owned()).stack_size(STACK_BYTES).spawn(run_command);
    match program.map(thread::JoinHandle::join) {
        Ok(Ok(exit)) => exit.into(),
        // The panic was printed; this is Rust's exit code for a panic.
        Ok(Err(_)) => ExitCode::from(101),
        Err(error) => {
            Printer::default()
                .say(&format!("graspmill: cannot start a thread with {STACK_BYTES} bytes of stack: {error}; raise `ulimit -v` or `ulimit -u`"));
            Exit::Failed.into()
        }
    }
}

/// Parses the arguments and runs the command.
fn run_command() -> Exit {
    let mut printer = Printer::default();
    let exit = match Cli::try_parse() {
        Ok(cli) => {
            let ready = machine::outlive_file_limits().and_then(|()| open_log(&cli.command, &mut printer));
            let exit = ready.and_then(|()| dispatch(&cli.command, &printer)).unwrap_or_else(|failure| {
                printer.error(&failure);
                failure.exit
            });
            printer.log(Level::Info, &format!("exit code {}", exit as u8));
            exit
        }
        Err(error) => {
            // clap prints help and version to stdout and calls them errors; wrong arguments mean 2.
            let wrong = error.use_stderr();
            if wrong {
                printer.say(&words_of_wrong_arguments(&error))
            } else {
                printer.result(&error.render().to_string())
            }
            if wrong { Exit::BadSpec } else { Exit::Complete }
        }
    };
    // A lost result is a failure.
    if exit == Exit::Complete && printer.has_lost_output() { Exit::InputOutput } else { exit }
}

/// Message about wrong arguments. clap repeats the arguments, so it is called again with their escaped forms.
fn words_of_wrong_arguments(error: &clap::Error) -> String {
    let shown = env::args_os().map(|argument| argument.to_string_lossy().shown().to_string());
    let again = Cli::try_parse_from(shown).err();
    again.as_ref().unwrap_or(error).render().to_string()
}

/// Opens the log that a command requests.
fn open_log(command: &Command, printer: &mut Printer) -> Result<(), Failure> {
    let (log, folder) = match command {
        Command::Run(RunArgs { log, out, .. }) | Command::Submit(SubmitArgs { log, out, .. }) => (log, out),
        Command::Verify(VerifyArgs { log, dir, .. }) => (log, dir),
        _ => return Ok(()),
    };
    let Some(log) = log else { return Ok(()) };
    if path::absolute(log)?.starts_with(path::absolute(folder.path())?) {
        let (log, folder) = (log.shown(), folder.path().shown());
        let message =
            format!("--log {log}: the log must not be in the dataset folder {folder}; give a file outside it");
        return Err(Failure::message(Exit::BadSpec, message));
    }
    let words = env::args_os().skip(1).map(|word| path::Path::new(&word).shown().to_string()).collect::<Vec<_>>();
    printer.open_log(log, format!("graspmill {}: {}", env!("CARGO_PKG_VERSION"), words.join(" ")))
}

fn dispatch(command: &Command, printer: &Printer) -> Result<Exit, Failure> {
    match command {
        Command::Init(arguments) => init::init(arguments, printer),
        Command::Estimate(arguments) => estimate::estimate(arguments, printer),
        Command::Run(arguments) => run_job(arguments, printer),
        Command::Status(arguments) => match SetTable::read(&arguments.dir)? {
            Some(table) => set::status(arguments, &table, printer),
            None => dataset::status(arguments, printer),
        },
        Command::Merge(arguments) => merge::merge(arguments, printer),
        Command::Submit(arguments) => submit::submit(arguments, printer),
        Command::Inspect(arguments) => dataset::inspect(arguments, printer),
        Command::Report(arguments) => match SetTable::read(&arguments.dir)? {
            Some(table) => set::report(arguments, &table, printer),
            None => dataset::report(arguments, printer),
        },
        Command::Export(arguments) => dataset::export(arguments, printer),
        Command::Release(arguments) => release::release(arguments, printer),
        Command::Query(QueryCommand::Reach(arguments)) => query::reach(arguments, printer),
        Command::Complete(arguments) if files::is_folder(&arguments.picture.depth) => {
            complete_dataset::complete_dataset(arguments, printer)
        }
        Command::Complete(arguments) => complete::complete(arguments, printer),
        Command::Evaluate(EvaluateCommand::Completion(arguments)) => evaluate::evaluate_completion(arguments, printer),
        Command::Segment(arguments) => segment::segment(arguments, printer),
        Command::Verify(arguments) => match SetTable::read(&arguments.dir).map_err(verify::damage)? {
            Some(table) => set::verify(arguments, &table, printer),
            None => verify::verify(arguments, printer),
        },
        Command::Diff(arguments) => diff::diff(arguments, printer),
        Command::Doctor(arguments) => doctor::doctor(arguments, printer),
        Command::Meshes(MeshesCommand::Check(arguments)) => meshes::check(arguments, printer),
        Command::Meshes(MeshesCommand::Split(arguments)) => meshes::split(arguments, printer),
        Command::Model(ModelCommand::Check(arguments)) => model::check(arguments, printer),
        Command::Robot(args::RobotCommand::Check(arguments)) => robot::check(arguments, printer),
        Command::Hand(args::HandCommand::Check(arguments)) => hand::check(arguments, printer),
        Command::Schema => jobs::schema(printer),
        Command::Version => docs::version(printer),
        Command::Digest(arguments) => match SetTable::read(&arguments.dir)? {
            Some(table) => set::digest(&arguments.dir, &table, printer),
            None => dataset::digest(arguments, printer),
        },
        Command::Completions(arguments) => docs::completions(arguments, printer),
        Command::Man(arguments) => docs::man(arguments, printer),
    }
}

/// Makes a job's dataset, one task's share of it, or the datasets of a set.
fn run_job(arguments: &RunArgs, printer: &Printer) -> Result<Exit, Failure> {
    let text = jobs::text(&arguments.job)?;
    match arguments.task {
        Some(choice) => task::run(arguments, choice, &text, printer),
        None if JobSet::is_one(&text) => set::run(arguments, &text, printer),
        None => run::run(arguments, &text, printer),
    }
}
