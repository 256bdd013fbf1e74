//! Jobs: as written (TOML), then as checked: every default filled in, every file pinned by its content.
//!
//! ```text
//! JobText --JobDraft::read--> JobDraft --(meshes are prepared)--> JobDraft::resolve --> Job
//! ```
//!
//! [`JobDraft::read`] decodes the file by the schema of its product, checks it, lists its meshes, and reports every mistake
//! at once. [`Job::to_toml`] writes a job back with every default filled in; [`Job::digest`] names it.
//! [`OpenJob`](super::run::OpenJob) does all of it with one call.

mod built_in;
mod cameras;
mod canonical;
mod checked;
mod csv;
mod decode;
mod description;
mod difference;
mod discover;
mod draft;
mod draft_work;
mod found_mesh;
mod hand;
mod mesh_table;
mod objects;
mod packages;
mod paths;
mod reference;
mod renamed;
mod schema;
mod sensor;
mod set;
pub mod spec;
mod split;
mod text;

pub use cameras::{CAMERAS, NamedCamera, describe_cameras, named_camera};
pub use canonical::{keys_of, shards_section, subjects_section, without};
pub use checked::{Job, Profile};
pub(crate) use csv::csv_records;
pub use description::{check_content, pinned_description};
pub use difference::{InvalidSettings, SettingDifference, setting_differences};
pub use draft::JobDraft;
pub use draft_work::{DraftWork, MakeWork, ShardSamples, default_shard_samples};
pub use found_mesh::{FoundMesh, KnownMass, KnownObject, PackageFile};
pub use hand::{JobHand, read_hand};
pub use objects::{JobObject, JobObjects, ObjectsDraft, SplitInput, Weight};
pub use packages::{MeshPackage, PACKAGES, package};
pub use paths::{relative_to, tidy, with_slashes};
pub use reference::reference;
pub use renamed::{RENAMED_KEYS, RENAMED_VALUES, RenamedKey, RenamedValue};
pub use schema::schema;
pub use sensor::{check_sensor, describe_sensors};
pub use set::{JobSet, SetMember};
pub use split::{ObjectChoice, SplitSettings, SubsetSize};
pub use text::{JobContext, JobText};
