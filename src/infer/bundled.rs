//! The network in this program: the folder `tabletop`, made by `make tabletop-model`.

use std::path::PathBuf;

use crate::folder::{MODEL_JSON, ModelFolder, parse_facts, sha256};

const JSON: &[u8] = include_bytes!("tabletop/model.json");
const ONNX: &[u8] = include_bytes!("tabletop/model.onnx");
const GOLDEN: &[u8] = include_bytes!("tabletop/golden.npz");

/// The files as if they had been read from a folder.
pub(crate) fn folder() -> ModelFolder {
    let (facts, inputs) = parse_facts(JSON).unwrap_or_else(|problem| panic!("{MODEL_JSON}: {problem}"));
    ModelFolder {
        path: PathBuf::from("bundled"),
        facts,
        inputs,
        digest: sha256(JSON),
        onnx: ONNX.to_owned(),
        golden: GOLDEN.to_owned(),
    }
}
