//! Outcomes of replaying the trials in plain MuJoCo (`export --to mujoco`), if they were replayed.

use serde::{Deserialize, Serialize};

use crate::chart::{grouped, percent};
use format::dataset::{DatasetError, Manifest};
use kernel::files::{Bound, Folder};

/// Path of a replay in the dataset's folder.
const AGREEMENT: &str = "replay/agreement.json";
/// Maximum number of grasps that are listed individually.
const SHOWN: usize = 20;

/// `agreement.json`, as `replay.py` writes it.
#[derive(Deserialize)]
struct Agreement {
    root: String,
    mujoco: String,
    contacts: String,
    replayed: u64,
    agreed: u64,
    /// Replayed grasps whose perturbed runs in the dataset all have the same outcome.
    sure: u64,
    sure_agreed: u64,
    others: Vec<Other>,
}

#[derive(Deserialize)]
struct Other {
    object: String,
    item: u32,
    grasp: u32,
    stored: String,
    replayed: String,
    perturbed: Vec<String>,
}

/// A replay as the page's template takes it.
#[derive(Serialize)]
pub(crate) struct ReplayView {
    mujoco: String,
    /// Whether contacts came from an octree of distances, instead of triangles.
    is_octree: bool,
    agreed: String,
    replayed: String,
    share: String,
    sure_agreed: String,
    sure: String,
    others: Vec<OtherView>,
    /// Count of others that are not shown.
    more: Option<usize>,
}

/// A grasp with a different outcome.
#[derive(Serialize)]
struct OtherView {
    object: String,
    item: u32,
    grasp: u32,
    stored: String,
    replayed: String,
    perturbed: String,
}

/// Reads the replay of a dataset's trials; `None` if there is none.
///
/// # Errors
/// When the file can't be read, or is of another dataset.
pub(crate) fn replay(folder: &Folder, manifest: &Manifest) -> Result<Option<ReplayView>, DatasetError> {
    let path = folder.path_of(AGREEMENT);
    let text = match folder.read_text(AGREEMENT, Bound::REPLAY) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(DatasetError::Io { action: "reading", path, source }),
    };
    let wrong = |problem: String| DatasetError::Invalid {
        path: path.clone(),
        problem,
        remedy: "export the trials again with `export --to mujoco` and run replay.py, or remove the folder",
    };
    let found: Agreement = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
    if found.root != manifest.root.hex() {
        return Err(wrong(format!("it belongs to the dataset with root {}", found.root)));
    }
    Ok(Some(ReplayView::of(found)))
}

impl ReplayView {
    fn of(found: Agreement) -> Self {
        Self {
            is_octree: found.contacts == "sdf",
            agreed: grouped(found.agreed),
            replayed: grouped(found.replayed),
            share: percent(found.agreed as f64 / found.replayed.max(1) as f64),
            sure_agreed: grouped(found.sure_agreed),
            sure: grouped(found.sure),
            more: found.others.len().checked_sub(SHOWN).filter(|more| *more > 0),
            others: found.others.into_iter().take(SHOWN).map(OtherView::of).collect(),
            mujoco: found.mujoco,
        }
    }
}

impl OtherView {
    fn of(other: Other) -> Self {
        let words = |verdict: &String| verdict.replace('_', " ");
        let perturbed: Vec<String> = other.perturbed.iter().map(words).collect();
        Self {
            stored: words(&other.stored),
            replayed: words(&other.replayed),
            perturbed: if perturbed.is_empty() { "not run".to_owned() } else { perturbed.join(", ") },
            object: other.object,
            item: other.item,
            grasp: other.grasp,
        }
    }
}

#[cfg(test)]
impl ReplayView {
    /// A replay with this number of grasps of this object that have a different outcome.
    pub fn example(object: &str, others: u32, contacts: &str) -> Self {
        let other = |item| Other {
            object: object.to_owned(),
            item,
            grasp: 0,
            stored: "held".to_owned(),
            replayed: "slipped_out".to_owned(),
            perturbed: if item == 0 { Vec::new() } else { vec!["lost_contact".to_owned()] },
        };
        Self::of(Agreement {
            root: String::new(),
            mujoco: "3.17.0".to_owned(),
            contacts: contacts.to_owned(),
            replayed: 300,
            agreed: 296,
            sure: 250,
            sure_agreed: 250,
            others: (0..others).map(other).collect(),
        })
    }
}
