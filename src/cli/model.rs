//! `graspmill model check`: checks a model folder file by file, and its stored results.

use std::{fmt::Write as _, time::Instant};

use serde::Serialize;

use super::{
    completion_args::ModelCheckArgs,
    exit::{Exit, Failure},
    picture::milliseconds_since,
    printer::Printer,
};
use infer::{CompletionModel, GoldenCheck, InputName, Inputs, ModelError, ModelProblem};
use surface::CubeField;

/// Maximum number of timed runs of a network.
const RUNS: usize = 9;
/// Time after which no further run starts [ms].
const TIMED: f64 = 1000.0;
/// Remedy for results that differ.
const REMEDY: &str = "the network's results differ from those stored after training: export it again";

/// Result of the check.
#[derive(Serialize)]
struct Report<'a> {
    network: &'a str,
    inputs: Vec<&'static str>,
    resolution: u32,
    thresholds: Thresholds,
    /// SHA-256 of `model.json`, which pins all other files.
    digest: &'a str,
    steps: u64,
    /// Root digests of the training datasets.
    trained_on: Vec<&'a str>,
    golden: GoldenCheck,
    agrees: bool,
    milliseconds: Times,
}

#[derive(Serialize)]
struct Thresholds {
    occupancy: f32,
    coverage: f32,
}

#[derive(Serialize)]
struct Times {
    open: f64,
    /// One sample on one thread.
    sample: f64,
}

/// `graspmill model check`.
pub fn check(arguments: &ModelCheckArgs, printer: &Printer) -> Result<Exit, Failure> {
    let began = Instant::now();
    let model = match &arguments.dir {
        Some(folder) => CompletionModel::open(folder).map_err(refused)?,
        None => CompletionModel::bundled(),
    };
    let open = milliseconds_since(began);
    let golden = model.check_golden().map_err(refused)?;
    let sample = milliseconds_per_sample(&model)?;
    let facts = model.facts();
    let report = Report {
        network: &facts.network,
        inputs: model.inputs().iter().copied().map(InputName::name).collect(),
        resolution: facts.resolution,
        thresholds: Thresholds { occupancy: facts.thresholds.occupancy, coverage: facts.thresholds.coverage },
        digest: model.digest(),
        steps: facts.steps,
        trained_on: facts.data.iter().map(|data| data.root.as_str()).collect(),
        agrees: golden.agrees(),
        golden,
        milliseconds: Times { open, sample },
    };
    if arguments.json {
        printer.json(&report)?;
    } else {
        printer.result(&text(&report));
    }
    Ok(if report.agrees { Exit::Complete } else { Exit::Mismatch })
}

/// Time of the network on one thread, the median of a few runs [ms].
fn milliseconds_per_sample(model: &CompletionModel) -> Result<f64, Failure> {
    let empty = CubeField::filled(model.facts().resolution as usize, 0.0);
    let inputs = Inputs { partial: Some(&empty), free: Some(&empty), touch: Some(&empty) };
    let mut times = Vec::new();
    while times.len() < RUNS && (times.is_empty() || times.iter().sum::<f64>() < TIMED) {
        let began = Instant::now();
        model.predict(&inputs).map_err(|error| Failure::new(Exit::BadSpec, error))?;
        times.push(milliseconds_since(began));
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}

/// Maps changed files to exit code 4 and other faults to the codes of inputs.
pub fn refused(error: ModelError) -> Failure {
    match &error.problem {
        ModelProblem::Digest { .. } => Failure::new(Exit::Mismatch, error),
        _ => Failure::of_input(error),
    }
}

fn text(report: &Report<'_>) -> String {
    let Report { network, inputs, resolution, thresholds, digest, steps, trained_on, golden, milliseconds, .. } =
        report;
    let mut text = format!("{network}: input {}, {resolution} cells along each axis\n", inputs.join(", "));
    _ = writeln!(text, "digest: {digest}");
    let roots = if trained_on.is_empty() { "no dataset".to_owned() } else { trained_on.join(", ") };
    _ = writeln!(text, "trained: {steps} steps on {roots}");
    _ = writeln!(text, "thresholds: occupancy {}, coverage {}", thresholds.occupancy, thresholds.coverage);
    _ = writeln!(
        text,
        "golden.npz: {} samples; largest difference {:.1e} in occupancy, {:.1e} in coverage; {} different cells",
        golden.samples, golden.occupancy, golden.coverage, golden.other_cells
    );
    if !report.agrees {
        _ = writeln!(text, "  {REMEDY}");
    }
    let Times { open, sample } = milliseconds;
    _ = write!(text, "opened in {open:.0} ms; {sample:.2} ms per sample on one thread");
    text
}
