//! Facts of the picks of a dataset, without the grasps.

use std::{collections::BTreeSet, path::PathBuf};

use super::spec::PicksSourceSpec;
use kernel::ids::{Digest, ObjectId};

/// The picks of a dataset, without the grasps.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundPicks {
    /// Digest of the dataset's exact numbers.
    pub root: Digest,
    /// Digest of its numbers of physics; `None` where nothing was tried.
    pub trials: Option<Digest>,
    /// The hand by content.
    pub hand: ObjectId,
    /// The scenes.
    pub scenes: BTreeSet<ObjectId>,
}

impl FoundPicks {
    /// The section of a resolved job that names them in a folder, or by content alone.
    pub fn spec(&self, dataset: Option<PathBuf>) -> PicksSourceSpec {
        PicksSourceSpec { dataset, root: Some(self.root.hex()), trials_root: self.trials.map(|root| root.hex()) }
    }
}
