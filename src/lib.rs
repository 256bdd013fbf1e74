//! graspmill: a simulation-driven synthetic data factory for robotic grasping.
//!
//! This crate is a facade: it gives the crates below `src/` one name. Data flows in one direction, and so do their
//! dependencies:
//!
//! ```text
//! jobs/*.toml -> factory::job -> factory::plan -> factory::run( factory::products x sim ) -> format -> runtime, publish
//! ```
//!
//! - A robot or a trainer links [`runtime`] (and below it [`format`](mod@format)) without simulator, Parquet or factory.
//! - A program that makes data begins with [`factory::run::OpenJob`].
//! - [`publish`] turns a dataset into reports, exports, previews and releases.
//! - [`geom`], [`voxel`] and [`render`] hold the kernels; [`kinematics`], [`collision`], [`hand`] and [`grasp`] know robots and
//!   hands without a simulator; [`sim`] is MuJoCo.
//!
//! A program that runs a job and reads its samples:
//!
//! ```
//! use graspmill::{
//!     factory::{Parallelism, RunContext, job::{JobContext, JobText}, run::OpenJob},
//!     files::Folder,
//!     format::dataset::{DatasetReader, Selection},
//! };
//!
//! let text = JobText {
//!     label: "cans.toml".to_owned(),
//!     folder: ".".into(),
//!     text: "objects = [{ built_in = [\"can-01\", \"cup-01\"] }]\nviews = { even = 4 }\n".to_owned(),
//!     overrides: vec!["split.test_objects=1".to_owned()],
//! };
//! let parallelism = Parallelism::available();
//! let context = RunContext::quiet(&parallelism);
//! let job = OpenJob::open(&text, &JobContext::default(), &context)?;
//!
//! let folder = tempfile::tempdir()?;
//! let dataset = Folder::at(folder.path());
//! let summary = job.run(&dataset, &context)?;
//! assert_eq!((summary.made, summary.manifest.counts.objects), (8, 2));
//!
//! for sample in DatasetReader::open(&dataset)?.iter(Selection::default()) {
//!     let pair = sample?.pair()?;
//!     assert_eq!(pair.both_cells, pair.partial_cells, "what is seen of a solid is part of it");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! See ARCHITECTURE.md.

pub use assets::{self, object};
pub use cli;
pub use factory::{self, cluster};
pub use form;
pub use format;
pub use infer;
pub use kernel::{contact, description, files, geom, ids, render, seed, voxel, words};
pub use measure;
pub use perception;
pub use publish::{self, export, preview};
pub use robot::{collision, grasp, hand, kinematics};
pub use runtime;
pub use sim;
pub use surface;
pub use tables;
