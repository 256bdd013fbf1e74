//! A model that was opened, and its predictions.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use surface::CubeField;

use crate::{
    error::{ModelError, ModelProblem, PredictError},
    folder::{GOLDEN_NPZ, MODEL_ONNX, ModelFacts, ModelFolder, OUTPUTS, RESOLUTION},
    golden::{GoldenCheck, GoldenSamples},
    graph::{Graph, Written},
    onnx::{Network, WORK},
    sample::{InputName, Inputs, Prediction},
};

/// A completion network that was opened and checked. It can be shared by threads; each call runs on its caller's.
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

/// Multiply-adds of the samples of `golden.npz` together: four of the largest network.
const GOLDEN_WORK: u64 = 4 * WORK;

impl CompletionModel {
    /// Opens a model's folder: every file is hashed, the network checked and prepared.
    ///
    /// # Errors
    /// With the file and the remedy, when anything is not as `docs/models.md` says.
    pub fn open(folder: &Path) -> Result<Self, ModelError> {
        let ModelFolder { path, facts, inputs, digest, onnx, golden } = ModelFolder::open(folder)?;
        let failed = |problem| ModelError { file: path.join(MODEL_ONNX), problem };
        let network = Network::read(&onnx, &facts.inputs, &facts.outputs).map_err(failed)?;
        let (work, written) = (network.work, Written::of(network));
        // A large network is in memory once less.
        drop(onnx);
        let graph = Graph::prepare(written, &facts.outputs).map_err(failed)?;
        Ok(Self { folder: path, facts, inputs, digest, graph, work, golden })
    }

    /// Content of `model.json`.
    pub fn facts(&self) -> &ModelFacts {
        &self.facts
    }

    /// Inputs that the network takes, in its order.
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
    /// When an input is missing, of another resolution or not finite, or the network's answer is no probability.
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

    /// Runs the samples of `golden.npz` and compares.
    ///
    /// # Errors
    /// When the file does not hold the model's inputs and outputs, or a sample cannot be completed.
    pub fn check_golden(&self) -> Result<GoldenCheck, ModelError> {
        let failed = |problem| ModelError { file: self.folder.join(GOLDEN_NPZ), problem };
        let samples = GoldenSamples::parse(&self.golden, &self.inputs, &self.facts.outputs).map_err(failed)?;
        let count = samples.samples.len() as u64;
        if self.work.saturating_mul(count) > GOLDEN_WORK {
            let found = format!("{count} samples take too long with this network, {} at most", GOLDEN_WORK / self.work);
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
