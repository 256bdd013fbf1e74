//! What came of replaying the trials in plain MuJoCo, where somebody did (`export --to mujoco`).

use std::{fmt::Write as _, fs, path::Path};

use serde::Deserialize;

use super::{
    chart::{grouped, percent},
    page::escaped,
};
use crate::dataset::{DatasetError, Manifest};

/// Where a replay of the dataset's own trials stands in its folder.
const AGREEMENT: &str = "replay/agreement.json";
/// Grasps that are told one by one.
const SHOWN: usize = 20;

/// `agreement.json`, as `replay.py` writes it.
#[derive(Deserialize)]
struct Agreement {
    root: String,
    mujoco: String,
    contacts: String,
    replayed: u64,
    agreed: u64,
    /// Of these grasps such as no perturbed run of the dataset says otherwise of.
    sure: u64,
    sure_agreed: u64,
    others: Vec<Other>,
}

#[derive(Deserialize)]
struct Other {
    object: String,
    view: u32,
    grasp: u32,
    stored: String,
    replayed: String,
    perturbed: Vec<String>,
}

/// The paragraph of a page; nothing where nobody replayed.
///
/// # Errors
/// When the file can't be read, or is of another dataset.
pub(super) fn paragraph(folder: &Path, manifest: &Manifest) -> Result<String, DatasetError> {
    let path = folder.join(AGREEMENT);
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(String::new()),
        Err(source) => return Err(DatasetError::Io { action: "reading", path, source }),
    };
    let wrong = |problem: String| DatasetError::Invalid {
        path: path.clone(),
        problem,
        remedy: "export the trials anew with `export --to mujoco` and run replay.py, or remove the folder",
    };
    let found: Agreement = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
    if found.root != manifest.root.hex() {
        return Err(wrong(format!("it is of the dataset with root {}", found.root)));
    }
    let mut html = format!(
        "<p>Replayed in plain MuJoCo {} with its own contacts ({}): <b>{} of {} grasps ({}) held or not as stored here</b>, \
         {} of the {} of which all perturbed runs here say the same.",
        escaped(&found.mujoco),
        if found.contacts == "sdf" { "by an octree of distances" } else { "with the mesh's triangles" },
        grouped(found.agreed),
        grouped(found.replayed),
        percent(found.agreed as f64 / found.replayed.max(1) as f64),
        grouped(found.sure_agreed),
        grouped(found.sure),
    );
    if !found.others.is_empty() {
        html.push_str(" The others:</p><ul>");
        for Other { object, view, grasp, stored, replayed, perturbed } in found.others.iter().take(SHOWN) {
            let words = [stored, replayed].map(|verdict| escaped(&verdict.replace('_', " ")));
            let off: Vec<String> = perturbed.iter().map(|verdict| escaped(&verdict.replace('_', " "))).collect();
            let off = if off.is_empty() { "not run".to_owned() } else { off.join(", ") };
            let _ = write!(
                html,
                "<li>{}, run {view}, grasp {grasp}: {} here (perturbed: {off}), {} there</li>",
                escaped(object),
                words[0],
                words[1]
            );
        }
        if let Some(more) = found.others.len().checked_sub(SHOWN).filter(|more| *more > 0) {
            let _ = write!(html, "<li>and {more} more</li>");
        }
        html.push_str("</ul>");
    } else {
        html.push_str("</p>");
    }
    Ok(html)
}
