//! Sections of job files that several products share: objects, hands, splits, sensors and cameras, as written ([`spec`]) and as
//! checked.

mod built_in;
mod cameras;
mod context;
mod csv;
mod description;
mod discover;
mod found_mesh;
mod hand;
mod mesh_table;
mod objects;
mod packages;
mod paths;
mod profile;
mod resolved;
mod sensor;
pub mod spec;
mod split;

pub use cameras::{CAMERAS, NamedCamera, describe_cameras, named_camera};
pub use context::JobContext;
pub(crate) use csv::csv_records;
pub use description::{check_content, pinned_description};
pub use found_mesh::{FoundMesh, KnownMass, KnownObject, PackageFile};
pub use hand::{JobHand, read_hand};
pub use objects::{JobObject, JobObjects, ObjectsDraft, SplitInput, Weight};
pub use packages::{MeshPackage, PACKAGES, package};
pub use paths::{relative_to, tidy, with_slashes};
pub use profile::Profile;
pub use resolved::{keys_of, shards_section, subjects_section, without};
pub use sensor::{check_sensor, describe_sensors};
pub use split::{ObjectChoice, SplitSettings, SubsetSize};
