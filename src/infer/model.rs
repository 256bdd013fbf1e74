//! An opened model and its predictions.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use surface::CubeField;

use crate::{
    bundled,
    error::{ModelError, ModelProblem, PredictError},
    folder::{GOLDEN_NPZ, MODEL_ONNX, ModelFacts, ModelFolder, OUTPUTS, RESOLUTION},
    golden::{GoldenCheck, GoldenSamples},
    graph::{Graph, Written},
    onnx::{Network, WORK},
    sample::{InputName, Inputs, Prediction},
};

/// An opened and checked completion network. Threads can share it; each call runs on the thread of its caller.
pub struct CompletionModel {
    folder: PathBuf,
    facts: ModelFacts,
    inputs: Vec<InputName>,
    digest: String,
    graph: Graph,
    /// Multiply-adds of one sample.
    work: u64,
    golden: Vec<u8>,
}

/// Bound of the multiply-adds of all samples of `golden.npz`: four samples of the largest network.
const GOLDEN_WORK: u64 = 4 * WORK;

impl CompletionModel {
    /// Opens a model folder: hashes every file, and checks and prepares the network.
    ///
    /// # Errors
    /// When the folder does not match `docs/models.md`, with the file and the remedy.
    pub fn open(folder: &Path) -> Result<Self, ModelError> {
        Self::of_folder(ModelFolder::open(folder)?)
    }

    /// Opens the network in this program, trained on objects alone, on tables and in bins. `docs/models.md` has its recipe and scores.
    ///
    /// ```
    /// use graspmill_infer::{CompletionModel, InputName};
    ///
    /// let model = CompletionModel::bundled();
    /// assert_eq!(model.inputs(), [InputName::Partial, InputName::Free]);
    /// ```
    pub fn bundled() -> Self {
        Self::of_folder(bundled::folder()).expect("a network that a test has opened")
    }

    fn of_folder(folder: ModelFolder) -> Result<Self, ModelError> {
        let ModelFolder { path, facts, inputs, digest, onnx, golden } = folder;
        let failed = |problem| ModelError { file: path.join(MODEL_ONNX), problem };
        let network = Network::read(&onnx, &facts.inputs, &facts.outputs).map_err(failed)?;
        let (work, written) = (network.work, Written::of(network));
        // Frees the file's copy of a large network.
        drop(onnx);
        let graph = Graph::prepare(written, &facts.outputs).map_err(failed)?;
        Ok(Self { folder: path, facts, inputs, digest, graph, work, golden })
    }

    /// Content of `model.json`.
    pub fn facts(&self) -> &ModelFacts {
        &self.facts
    }

    /// Inputs of the network, in its order.
    pub fn inputs(&self) -> &[InputName] {
        &self.inputs
    }

    /// SHA-256 of `model.json`, which pins every other file of the folder.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// Completes one sample.
    ///
    /// # Errors
    /// When an input is missing, has a different resolution or is not finite, or an output is not a probability.
    pub fn predict(&self, inputs: &Inputs<'_>) -> Result<Prediction, PredictError> {
        let mut values: Vec<&[f32]> = Vec::new();
        for name in &self.inputs {
            let field = inputs.get(*name).ok_or(PredictError::MissingInput(*name))?;
            if field.side() != RESOLUTION as usize {
                return Err(PredictError::Resolution { input: *name, found: field.side(), wanted: RESOLUTION });
            }
            if !field.values().iter().all(|value| value.is_finite()) {
                return Err(PredictError::NotFinite(*name));
            }
            values.push(field.values());
        }
        let outputs = self.graph.run(&values).map_err(PredictError::Library)?;
        let mut fields = Vec::new();
        for (output, values) in OUTPUTS.into_iter().zip(outputs) {
            if let Some(value) = values.iter().find(|value| !(0.0..=1.0).contains(*value)) {
                return Err(PredictError::NoProbability { output, value: value.to_string() });
            }
            let field = CubeField::from_values(RESOLUTION as usize, values);
            fields.push(field.ok_or_else(|| PredictError::Library(format!("{output} has another size")))?);
        }
        let mut fields = fields.into_iter();
        let occupancy = fields.next().ok_or_else(|| PredictError::Library("no output".to_owned()))?;
        Ok(Prediction { occupancy, coverage: fields.next() })
    }

    /// Runs the samples of `golden.npz` and compares the results.
    ///
    /// # Errors
    /// When the file does not contain the model's inputs and outputs, or a sample cannot be completed.
    pub fn check_golden(&self) -> Result<GoldenCheck, ModelError> {
        let failed = |problem| ModelError { file: self.folder.join(GOLDEN_NPZ), problem };
        let samples = GoldenSamples::parse(&self.golden, &self.inputs, &self.facts.outputs).map_err(failed)?;
        let count = samples.samples.len() as u64;
        if self.work.saturating_mul(count) > GOLDEN_WORK {
            let found =
                format!("{count} samples take too long with this network; store at most {}", GOLDEN_WORK / self.work);
            return Err(failed(ModelProblem::Golden { found }));
        }
        let mut check = GoldenCheck::default();
        for sample in &samples.samples {
            let found = self.predict(&sample.inputs());
            let found = found.map_err(|error| failed(ModelProblem::Golden { found: error.to_string() }))?;
            check.add(sample, &found, &self.facts.thresholds);
        }
        Ok(check)
    }
}

impl fmt::Debug for CompletionModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CompletionModel")
            .field("folder", &self.folder)
            .field("digest", &self.digest)
            .finish_non_exhaustive()
    }
}
