//! `model.json`: facts about a model, and the digests of its files.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use kernel::{
    files::{Bound, Folder},
    geom::GridPlacement,
};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::{
    error::{ModelError, ModelProblem},
    sample::InputName,
};

/// Version of the format.
const FORMAT: &str = "graspmill model 1";
/// Names of the outputs, in order; the second is optional.
pub(crate) const OUTPUTS: [&str; 2] = ["occupancy", "coverage"];
/// Cells along each axis of every network.
pub(crate) const RESOLUTION: u32 = 40;
pub(crate) const MODEL_JSON: &str = "model.json";
pub(crate) const MODEL_ONNX: &str = "model.onnx";
pub(crate) const GOLDEN_NPZ: &str = "golden.npz";
const CARD: &str = "card.md";
/// Maximum number of files of a model.
const MAX_FILES: usize = 32;

/// Content of `model.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelFacts {
    /// Version of the format.
    pub format: String,
    /// Name of the network's design.
    pub network: String,
    /// Names of the inputs, in the network's order.
    pub inputs: Vec<String>,
    /// Names of the outputs, in the network's order.
    pub outputs: Vec<String>,
    /// Cells along each axis.
    pub resolution: u32,
    /// Placement of grids about the visible part of an object.
    pub placement: PlacementRule,
    /// Probabilities from which on a cell counts.
    pub thresholds: Thresholds,
    /// Seed of the training.
    pub seed: u64,
    /// Steps of the training.
    pub steps: u64,
    /// Training datasets.
    pub data: Vec<DataSource>,
    /// Split of the objects: its digest or another identifier.
    pub split: serde_json::Value,
    /// Versions of the software that trained and exported the model.
    pub versions: serde_json::Value,
    /// Scores on validation objects.
    pub scores: serde_json::Value,
    /// SHA-256 of every file other than `model.json`, by name.
    pub files: BTreeMap<String, String>,
}

/// Version of a format, without its other keys.
#[derive(Deserialize)]
struct FormatVersion {
    format: String,
}

/// Placement of grids about the visible part of an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlacementRule {
    /// Share of the grid filled by the longest side of the visible part's box.
    pub fill: f64,
    /// Position of the box's centre in the grid, as shares of its side.
    pub anchor: [f64; 3],
}

/// Probabilities from which on a cell counts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thresholds {
    /// Threshold of an occupied cell.
    pub occupancy: f32,
    /// Threshold of normalised coverage for a cell inside.
    pub coverage: f32,
}

/// A training dataset of a model.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataSource {
    /// Root digest of the dataset.
    pub root: String,
    /// Digest of the dataset's job.
    pub job: String,
}

/// A folder whose files match its `model.json`.
pub(crate) struct ModelFolder {
    pub(crate) path: PathBuf,
    pub(crate) facts: ModelFacts,
    pub(crate) inputs: Vec<InputName>,
    /// SHA-256 of `model.json`, which pins all other files.
    pub(crate) digest: String,
    pub(crate) onnx: Vec<u8>,
    pub(crate) golden: Vec<u8>,
}

impl ModelFolder {
    pub(crate) fn open(path: &Path) -> Result<Self, ModelError> {
        let json = path.join(MODEL_JSON);
        let at_json = |problem| ModelError { file: json.clone(), problem };
        let folder = Folder::at(path);
        let text = folder.read(MODEL_JSON, Bound::MODEL_TABLE).map_err(|error| at_json(error.into()))?;
        let (facts, inputs) = parse_facts(&text).map_err(at_json)?;
        check_names(&folder, &facts).map_err(at_json)?;
        let mut contents: BTreeMap<&str, Vec<u8>> = BTreeMap::new();
        for (name, stated) in &facts.files {
            let file = path.join(name);
            let failed = |problem| ModelError { file: file.clone(), problem };
            let content = folder.read(name, bound_of(name)).map_err(|error| failed(error.into()))?;
            let calculated = sha256(&content);
            if calculated != *stated {
                return Err(failed(ModelProblem::Digest { calculated, stated: stated.clone() }));
            }
            if [MODEL_ONNX, GOLDEN_NPZ].contains(&name.as_str()) {
                contents.insert(name, content);
            }
        }
        let (onnx, golden) = (contents.remove(MODEL_ONNX), contents.remove(GOLDEN_NPZ));
        Ok(Self {
            path: path.to_owned(),
            inputs,
            digest: sha256(&text),
            onnx: onnx.unwrap_or_default(),
            golden: golden.unwrap_or_default(),
            facts,
        })
    }
}

/// Reads and checks the content of `model.json`; returns it with the inputs.
pub(crate) fn parse_facts(text: &[u8]) -> Result<(ModelFacts, Vec<InputName>), ModelProblem> {
    // Other kinds of models have different keys.
    if let Ok(FormatVersion { format }) = serde_json::from_slice(text)
        && format != FORMAT
    {
        let (found, wanted) = (format!("\"{format}\""), format!("\"{FORMAT}\""));
        return Err(ModelProblem::Value { key: "format", found, wanted });
    }
    let facts: ModelFacts = serde_json::from_slice(text).map_err(|error| {
        let message = error.to_string();
        let found = message.split(" at line ").next().unwrap_or_default().to_owned();
        ModelProblem::Json { line: error.line(), column: error.column(), found }
    })?;
    let inputs = check_values(&facts)?;
    Ok((facts, inputs))
}

pub(crate) fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Refuses values that this program does not support; returns the inputs.
fn check_values(facts: &ModelFacts) -> Result<Vec<InputName>, ModelProblem> {
    let wrong = |key, found: String, wanted: String| Err(ModelProblem::Value { key, found, wanted });
    if facts.resolution != RESOLUTION {
        return wrong("resolution", facts.resolution.to_string(), RESOLUTION.to_string());
    }
    let inputs: Option<Vec<InputName>> = facts.inputs.iter().map(|name| InputName::from_name(name)).collect();
    let inputs = match inputs {
        Some(inputs) if !inputs.is_empty() && inputs.windows(2).all(|pair| pair[0] < pair[1]) => inputs,
        _ => {
            return wrong(
                "inputs",
                format!("{:?}", facts.inputs),
                "some of partial, free, touch, in this order".to_owned(),
            );
        }
    };
    if facts.outputs != OUTPUTS && facts.outputs != OUTPUTS[..1] {
        let wanted = format!("{OUTPUTS:?}, or only the first of them");
        return wrong("outputs", format!("{:?}", facts.outputs), wanted);
    }
    let unit = GridPlacement { resolution: 1, centre: Default::default(), cell_size: 1.0 };
    let ours = PlacementRule { fill: GridPlacement::FILL, anchor: unit.anchor() };
    if facts.placement != ours {
        return wrong("placement", format!("{:?}", facts.placement), format!("{ours:?}"));
    }
    let Thresholds { occupancy, coverage } = facts.thresholds;
    if ![occupancy, coverage].iter().all(|threshold| *threshold > 0.0 && *threshold < 1.0) {
        return wrong("thresholds", format!("{occupancy} and {coverage}"), "numbers between 0 and 1".to_owned());
    }
    Ok(inputs)
}

/// Size bound of a file other than `model.json`.
fn bound_of(name: &str) -> Bound {
    match name {
        MODEL_ONNX => Bound::NETWORK,
        CARD => Bound::MODEL_TEXT,
        _ => Bound::MODEL_DATA,
    }
}

/// Refuses names that point outside the folder, and files that are missing in the list.
fn check_names(folder: &Folder, facts: &ModelFacts) -> Result<(), ModelProblem> {
    let wrong = |found: String| Err(ModelProblem::Files { found });
    let is_plain = |name: &String| {
        !name.is_empty()
            && name != MODEL_JSON
            && !name.starts_with('.')
            && name.chars().all(|letter| letter.is_ascii_alphanumeric() || "._-".contains(letter))
    };
    if let Some(name) = facts.files.keys().find(|name| !is_plain(name)) {
        return wrong(format!("'{name}' is listed"));
    }
    if facts.files.len() > MAX_FILES {
        return wrong(format!("more than {MAX_FILES} files are listed"));
    }
    if let Some(name) = [MODEL_ONNX, GOLDEN_NPZ, CARD].into_iter().find(|name| !facts.files.contains_key(*name)) {
        return wrong(format!("'{name}' is missing"));
    }
    for name in folder.names()? {
        let name = name.to_string_lossy().into_owned();
        if name != MODEL_JSON && !facts.files.contains_key(&name) {
            return wrong(format!("'{name}' is missing"));
        }
    }
    Ok(())
}
