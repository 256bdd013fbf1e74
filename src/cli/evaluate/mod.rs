//! `graspmill evaluate completion`: models and baselines on the samples of a dataset.

mod comparison;
mod outcome;
mod shown;
mod words;

use self::{
    comparison::{Comparison, Report},
    outcome::{outcomes, truth_mesh},
    shown::samples_to_show,
    words::{evaluation, text},
};
use super::{
    completion_args::{EvaluateCompletionArgs, RulesName},
    completion_method::{BUNDLED, CompletionMethod},
    exit::{Exit, Failure},
    machine,
    parallel::in_parallel,
    printer::Printer,
    stored_samples::{StoredSample, choose_samples},
    true_meshes::TrueMeshes,
};
use format::dataset::DatasetReader;
use kernel::words::Show;
use publish::has_perfect_sensor;

/// `graspmill evaluate completion`.
pub fn evaluate_completion(arguments: &EvaluateCompletionArgs, printer: &Printer) -> Result<Exit, Failure> {
    let (reader, chosen) =
        choose_samples(&arguments.dir, "evaluate completion", Some(&arguments.split), arguments.limit)?;
    let methods = methods(arguments, &reader)?;
    let truths = arguments.truth.as_deref().map(|folder| TrueMeshes::new(folder, &reader, &chosen)).transpose()?;
    let has_coverage = StoredSample::read(&reader, chosen[0])?.coverage.is_some();
    let is_perfect_sensor = has_perfect_sensor(&reader)?;
    let work = |index: usize| {
        let sample = StoredSample::read(&reader, chosen[index])?;
        let truth = match &truths {
            Some(truths) => truths.in_camera(&sample),
            None => truth_mesh(&sample),
        };
        outcomes(arguments, &methods, &sample, (&truth, is_perfect_sensor))
    };
    let results = in_parallel(chosen.len(), machine::threads(arguments.threads), work);
    let by_sample = results.into_iter().collect::<Result<Vec<_>, Failure>>()?;
    let report = Report {
        dataset: reader.manifest().root.hex(),
        split: arguments.split.clone(),
        samples: chosen.len(),
        surface_samples: arguments.surface_samples,
        truth: if truths.is_some() {
            "the objects' meshes"
        } else if has_coverage {
            "coverage of the dataset"
        } else {
            "occupied cells of the dataset, about 0.7 cells too large"
        },
        has_thesis_rules: arguments.rules == RulesName::Thesis,
        rows: Comparison::new(&methods, &arguments.detail, &by_sample).rows(),
    };
    if let Some(path) = &arguments.out {
        let shown = samples_to_show(&methods, arguments.detail.len(), &by_sample, (&reader, &chosen))?;
        evaluation(&report, &reader, shown)?.write(path)?;
    }
    if arguments.json {
        printer.json(&report)?;
    } else {
        printer.result(&text(&report));
        if let Some(path) = &arguments.out {
            printer.result(&format!("page: {}", path.shown()));
        }
    }
    Ok(Exit::Complete)
}

fn methods(arguments: &EvaluateCompletionArgs, reader: &DatasetReader) -> Result<Vec<CompletionMethod>, Failure> {
    let models = arguments.model.iter().map(|folder| CompletionMethod::open(folder));
    let by_name = |name: &String| CompletionMethod::by_name(name, arguments.smoothing, reader);
    let methods = arguments.method.iter().map(by_name);
    let is_default = arguments.model.is_empty() && arguments.method.is_empty();
    let bundled = is_default.then(|| CompletionMethod::by_name(BUNDLED, arguments.smoothing, reader));
    models.chain(methods).chain(bundled).collect()
}
