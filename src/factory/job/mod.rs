//! Jobs: as written (TOML), then as checked: every default filled in, every file pinned by its content.
//!
//! ```text
//! JobText --JobDraft::read--> JobDraft --(meshes are prepared)--> JobDraft::resolve --> Job
//! ```
//!
//! [`JobDraft::read`] decodes the file by the schema of its product, checks it, lists its meshes, and reports every mistake
//! at once. [`Job::to_toml`] writes a job back with every default filled in; [`Job::digest`] names it.
//! [`OpenJob`](super::run::OpenJob) does all of it with one call.

mod canonical;
mod checked;
mod decode;
mod difference;
mod draft;
mod reference;
mod renamed;
mod schema;
mod set;
pub mod spec;
mod text;

pub use crate::{
    product::{DraftWork, MakeWork, ShardSamples, default_shard_samples},
    sections::{
        CAMERAS, FoundMesh, JobContext, JobHand, JobObject, JobObjects, KnownMass, KnownObject, MeshPackage,
        NamedCamera, ObjectChoice, ObjectsDraft, PACKAGES, PackageFile, Profile, SplitInput, SplitSettings, SubsetSize,
        Weight, check_content, check_sensor, describe_cameras, describe_sensors, keys_of, named_camera, package,
        pinned_description, read_hand, relative_to, shards_section, subjects_section, tidy, with_slashes, without,
    },
};
pub use checked::Job;
pub use difference::{InvalidSettings, SettingDifference, setting_differences};
pub use draft::JobDraft;
pub use reference::reference;
pub use renamed::{RENAMED_KEYS, RENAMED_VALUES, RenamedKey, RenamedValue};
pub use schema::schema;
pub use set::{JobSet, SetMember};
pub use text::JobText;
