//! From the keys of a job for suction to settings that make sense: every mistake that the schema cannot see.

use std::path::{Path as FilePath, PathBuf};

use super::spec::SuctionJobSpec;
use crate::products::settled::{FoundScenes, ObjectKeys, SCENES, found_scenes, object_keys};
use form::Checker;
use robot::suction::{InvalidCup, SuctionCup};

/// A job for suction but for the meshes.
pub(super) struct Checked {
    pub scenes_folder: PathBuf,
    pub scenes: FoundScenes,
    pub keys: ObjectKeys,
    pub cup: SuctionCup,
}

/// The job; `None` when something is wrong, which is reported.
pub(super) fn checked(checker: &mut Checker, spec: &SuctionJobSpec, folder: &FilePath) -> Option<Checked> {
    let cup = cup(checker, spec);
    let scenes_folder = SCENES.folder(checker, spec.scenes.dataset.as_ref(), folder)?;
    let scenes = found_scenes(checker, &spec.scenes, &scenes_folder)?;
    let keys = object_keys(checker, &scenes)?;
    Some(Checked { scenes_folder, scenes, keys, cup: cup? })
}

fn cup(checker: &mut Checker, spec: &SuctionJobSpec) -> Option<SuctionCup> {
    match SuctionCup::new(spec.cup) {
        Ok(cup) => Some(cup),
        Err(InvalidCup { key, value, range }) => {
            checker.invalid(format!("cup.{key}").as_str(), range, value.to_string());
            None
        }
    }
}
