//! Methods that complete stored samples, and the meshes of their results.

use std::path::Path;

use super::{
    completion_args::{DetailName, SmoothArgs},
    exit::{Exit, Failure},
    model::refused,
    stored_samples::StoredSample,
};
use format::dataset::DatasetReader;
use kernel::{
    geom::{OccupancyGrid, TriMesh},
    words::{Show, Split},
};
use measure::{Baseline, GridOverlap, SeenCells, TrainingPairs};
use runtime::completion::{Answer, CompletionModel, LaplacianRule, Prediction, seen_points};

/// Baselines that remember the training pairs of the dataset.
const LEARNED: [&str; 2] = ["knn", "mean"];
/// Name of the network in this program.
pub const BUNDLED: &str = "bundled";
/// Ending of the name of a method whose meshes are smoothed.
const SMOOTHED: &str = "+smooth";

/// Method that completes samples.
pub enum CompletionMethod {
    Model {
        name: String,
        model: Box<CompletionModel>,
    },
    Baseline(Baseline),
    /// Vote of the nearest training pairs.
    Nearest(TrainingPairs),
    /// Cells that many training pairs contain; the same for every sample.
    Mean(OccupancyGrid),
    /// The true grids, as a perfect network would return them.
    Truth,
    /// Another method, with smoothed meshes.
    Smoothed(Box<CompletionMethod>, LaplacianRule),
}

impl CompletionMethod {
    /// Opens a model.
    pub fn open(folder: &Path) -> Result<Self, Failure> {
        let model = CompletionModel::open(folder).map_err(refused)?;
        Ok(Self::Model { name: folder.display().to_string(), model: Box::new(model) })
    }

    /// Selects a baseline by its name, and prepares it on the dataset if it learns from it.
    pub fn by_name(name: &str, smoothing: SmoothArgs, reader: &DatasetReader) -> Result<Self, Failure> {
        if let (plain, Some(rule)) = smoothed(name, smoothing) {
            return Ok(Self::Smoothed(Box::new(Self::by_name(plain, smoothing, reader)?), rule));
        }
        match name {
            "knn" => Ok(Self::Nearest(training_pairs(reader)?)),
            "mean" => mean_of(reader),
            "truth" => Ok(Self::Truth),
            BUNDLED => Ok(Self::Model { name: BUNDLED.to_owned(), model: Box::new(CompletionModel::bundled()) }),
            _ => baseline_of(name).map(Self::Baseline),
        }
    }

    pub fn name(&self) -> String {
        match self {
            Self::Model { name, .. } => name.clone(),
            Self::Baseline(baseline) => baseline.to_string(),
            Self::Nearest(_) => "knn".to_owned(),
            Self::Mean(_) => "mean".to_owned(),
            Self::Truth => "truth".to_owned(),
            Self::Smoothed(method, _) => method.name() + SMOOTHED,
        }
    }

    /// SHA-256 of a model's `model.json`; `None` for baselines.
    pub fn digest(&self) -> Option<&str> {
        match self {
            Self::Model { model, .. } => Some(model.digest()),
            _ => None,
        }
    }

    /// Whether the method is a baseline that a model must beat.
    pub fn is_baseline(&self) -> bool {
        match self {
            Self::Smoothed(method, _) => method.is_baseline(),
            _ => !matches!(self, Self::Model { .. } | Self::Truth),
        }
    }

    pub fn complete(&self, sample: &StoredSample) -> Result<Answer, Failure> {
        let (partial, placement) = (&sample.pair.partial, &sample.pair.grid);
        Ok(match self {
            Self::Model { model, .. } => Answer::of_model(model, sample.complete(model)?),
            Self::Baseline(baseline) => {
                let object = baseline.needs_points().then(|| sample.seen_object()).transpose()?;
                let points = object.map(seen_points).unwrap_or_default();
                if baseline.needs_table() && sample.support.is_none() {
                    let remedy = "it needs the table below an object, and the dataset has isolated ones: use pairs of scenes (product amodal)";
                    return Err(Failure::message(Exit::BadSpec, format!("--method {baseline}: {remedy}")));
                }
                let (free, support) = (sample.free.as_ref(), sample.support);
                let seen = SeenCells { partial, free, points: &points, placement, support };
                Answer::of_cells(&baseline.complete(&seen))
            }
            Self::Nearest(pairs) => Answer::of_cells(&pairs.nearest_vote(partial)),
            Self::Mean(grid) => Answer::of_cells(grid),
            Self::Truth => {
                let Answer { prediction, thresholds } = Answer::of_cells(&sample.pair.complete);
                Answer { prediction: Prediction { coverage: sample.coverage.clone(), ..prediction }, thresholds }
            }
            Self::Smoothed(method, _) => method.complete(sample)?,
        })
    }

    /// Mesh of a target from the method's result; without triangles if no cell is occupied.
    pub fn mesh(&self, answer: &Answer, sample: &StoredSample, detail: DetailName) -> Result<TriMesh, Failure> {
        if let Self::Smoothed(method, rule) = self {
            let mut mesh = method.mesh(answer, sample, detail)?;
            rule.smooth(&mut mesh);
            return Ok(mesh);
        }
        if answer.cells().count() == 0 {
            return Ok(TriMesh::default());
        }
        let (completed, _) = answer.mesh(detail.into(), &sample.pair.grid, &[], || sample.seen_object())?;
        Ok(completed.mesh)
    }
}

/// Method name without the ending for smoothing, and the smoothing rule if the name has that ending.
pub fn smoothed(name: &str, smoothing: SmoothArgs) -> (&str, Option<LaplacianRule>) {
    match name.strip_suffix(SMOOTHED) {
        Some(plain) => (plain, Some(smoothing.rule())),
        None => (name, None),
    }
}

/// Selects a baseline that learns nothing, by its name.
pub fn baseline_of(name: &str) -> Result<Baseline, Failure> {
    Baseline::from_name(name).ok_or_else(|| {
        let known: Vec<&str> = Baseline::ALL.map(Baseline::name).into_iter().chain(LEARNED).collect();
        let message = if LEARNED.contains(&name) {
            format!("--method {name}: it learns from training pairs; use it on a dataset")
        } else {
            format!(
                "--method {name}: no such method; use {BUNDLED} or one of {}, each also with the ending {SMOOTHED}",
                known.join(", ")
            )
        };
        Failure::message(Exit::BadSpec, message)
    })
}

fn pairs_of(reader: &DatasetReader, split: Split) -> Result<Vec<format::VoxelPair>, Failure> {
    let indices = reader.indices(format::dataset::Selection::from_split(split)).filter(|index| reader.is_kept(*index));
    indices.map(|index| Ok(StoredSample::read(reader, index)?.pair)).collect()
}

fn training_pairs(reader: &DatasetReader) -> Result<TrainingPairs, Failure> {
    let mut pairs = TrainingPairs::default();
    for pair in pairs_of(reader, Split::Training)? {
        pairs.add(&pair.partial, pair.complete);
    }
    if pairs.is_empty() {
        let message = format!(
            "{}: --method knn and mean need training pairs, and the dataset has none",
            reader.folder().path().shown()
        );
        return Err(Failure::message(Exit::BadSpec, message));
    }
    Ok(pairs)
}

/// Mean grid, thresholded at the share that fits the validation objects best; a dataset without validation objects uses its training objects.
fn mean_of(reader: &DatasetReader) -> Result<CompletionMethod, Failure> {
    let pairs = training_pairs(reader)?;
    let mut judges = pairs_of(reader, Split::Validation)?;
    if judges.is_empty() {
        judges = pairs_of(reader, Split::Training)?;
    }
    let score = |grid: &OccupancyGrid| {
        judges.iter().map(|pair| GridOverlap::new(grid, &pair.complete, &pair.partial).iou).sum::<f64>()
    };
    let mut best = (0.0, OccupancyGrid::new(pairs.mean_grid(1.0).resolution()));
    for share in (1..20).map(|step| f64::from(step) / 20.0) {
        let grid = pairs.mean_grid(share);
        let score = score(&grid);
        if score > best.0 {
            best = (score, grid);
        }
    }
    Ok(CompletionMethod::Mean(best.1))
}
