//! graspmill: a simulation-driven synthetic data factory for robotic grasping.
//!
//! The library has four doors. Each is a module and a cargo feature of the same name; all are on by default.
//!
//! | door | use it to | does not link |
//! | --- | --- | --- |
//! | [`read`] | read, verify and compare datasets | MuJoCo, ONNX, Parquet, the command line |
//! | [`runtime`] | query reachability maps and complete the objects of depth images, on a robot | MuJoCo, Parquet, the command line |
//! | [`make`] | check meshes, simulate hands, run jobs that make datasets | ONNX, the command line |
//! | [`publish`] | write reports, exports, previews and releases | MuJoCo, ONNX, the command line |
//!
//! A program that only reads datasets turns the other doors off:
//!
//! ```toml
//! [dependencies]
//! graspmill = { version = "0.1", default-features = false, features = ["read"] }
//! ```
//!
//! Every other door opens `read`, too. The feature `cli` builds the program `graspmill` and requires all doors. Only `make` needs
//! libmujoco to link.

/// Read datasets: manifest, splits, samples and their records; verify and compare them.
///
/// [`DatasetReader`](read::DatasetReader) opens a folder through a [`Folder`](read::Folder), which follows no link inside it.
/// A sample has the same bytes in every dataset that contains it; [`verify`](read::verify) compares all of them with their
/// digests. `examples/read.rs` is a whole program.
///
/// ```no_run
/// use graspmill::read::{DatasetReader, Folder, Selection, Split, VoxelPair};
///
/// let reader = DatasetReader::open(&Folder::at("datasets/quickstart"))?;
/// println!("root {}", reader.manifest().root);
/// for sample in reader.shuffled(Selection::from_split(Split::Training), 1) {
///     let pair = sample?.read::<VoxelPair>()?;
///     println!("the camera saw {} of {} cells", pair.both_cells, pair.complete_cells);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[cfg(feature = "read")]
pub mod read {
    pub use format::{
        self,
        dataset::{
            AssetRow, AssetTable, DatasetDifference, DatasetError, DatasetReader, Ledger, LedgerRow, Manifest, Problem,
            Sample, Samples, Selection, SetEntry, SetTable, VerifyLevel, VerifyOptions, VerifyReport, diff, verify,
        },
        *,
    };
    pub use kernel::{
        files::{self, Folder},
        geom::{self, Pose},
        ids::{self, ObjectId, SampleId},
        seed, voxel,
        words::{self, Split, SplitTable},
    };
}

/// Query reachability maps and complete the objects that a camera saw, on a robot and without a simulator.
///
/// [`ReachabilityMap`](runtime::ReachabilityMap) returns the distance of an end-effector pose to the reachable set.
/// [`Completer`](runtime::completion::Completer) turns the clusters of a depth image into closed meshes, by a network or a
/// baseline. `examples/runtime.rs` is a whole program.
///
/// ```no_run
/// use graspmill::runtime::{EndEffectorVolume, Folder, Obstacle, Pose, ReachabilityMap};
///
/// let mut map = ReachabilityMap::open(&Folder::at("datasets/fetch-reachability"))?;
/// let pose = [0.6, 0.1, 0.9, 0.0, 0.5, 0.2];
/// println!("distance {}", map.distance(&pose));
///
/// let table = Obstacle::cuboid(&Pose::from_xyz_rpy([0.9, 0.0, 0.7, 0.0, 0.0, 0.0]), [0.5, 0.8, 0.02])?;
/// map.add_obstacle(&table, &EndEffectorVolume::default());
/// println!("distance with a table {}", map.distance(&pose));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[cfg(feature = "runtime")]
pub mod runtime {
    pub use ::runtime::*;
    pub use infer;
    pub use kernel::{
        files::Folder,
        geom::{self, Pose},
    };
    pub use measure::{self, Baseline};
    pub use perception;
    pub use planner::{
        self,
        energy::{EnergyForm, grasp_energy},
    };
    pub use robot::{self, collision, grasp, hand, kinematics};
    pub use surface;
}

/// Make datasets: check meshes, simulate hands with MuJoCo, open jobs and run them.
///
/// [`OpenJob`](make::OpenJob) reads a job, prepares its meshes and makes the plan;
/// [`run`](make::OpenJob::run) fills a folder and resumes one that was interrupted. [`check_report`](make::check_report) checks
/// meshes without a job. `examples/make.rs` and `examples/check_meshes.rs` are whole programs.
///
/// ```
/// use graspmill::{
///     make::{JobContext, JobText, OpenJob, Parallelism, RunContext},
///     read::{DatasetReader, Folder, Selection, VoxelPair},
/// };
///
/// let text = JobText {
///     label: "cans.toml".to_owned(),
///     folder: ".".into(),
///     text: "objects = [{ built_in = [\"can-01\", \"cup-01\"] }]\nviews = { even = 4 }\n".to_owned(),
///     overrides: vec!["split.test_objects=1".to_owned()],
/// };
/// let parallelism = Parallelism::available();
/// let context = RunContext::quiet(&parallelism);
/// let job = OpenJob::open(&text, &JobContext::default(), &context)?;
///
/// let folder = tempfile::tempdir()?;
/// let dataset = Folder::at(folder.path());
/// let summary = job.run(&dataset, &context)?;
/// assert_eq!((summary.made, summary.manifest.counts.objects), (8, 2));
///
/// for sample in DatasetReader::open(&dataset)?.iter(Selection::default()) {
///     let pair = sample?.read::<VoxelPair>()?;
///     assert_eq!(pair.both_cells, pair.partial_cells, "every seen cell of a solid is part of it");
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[cfg(feature = "make")]
pub mod make {
    pub use assets::{self, object::PreparedObject, *};
    pub use factory::{
        self,
        job::{JobContext, JobText},
        run::OpenJob,
        *,
    };
    pub use kernel::{contact, files::Folder, geom, render, voxel};
    pub use robot::{self, collision, grasp, hand, kinematics, suction};
    pub use sim;
    pub use tables::{self, ParquetIndex};
}

/// Publish datasets: reports, cards, exports, previews and releases.
///
/// [`report`](publish::report) writes one page without scripts or links to other servers;
/// `make_release` adds card, licences, provenance and digests; `export` writes other formats. `examples/publish.rs` is a whole program.
///
/// ```no_run
/// use graspmill::publish::{Folder, inspect, report};
///
/// let folder = Folder::at("datasets/quickstart");
/// println!("{}", inspect(&folder)?);
/// let page = report(&folder, None)?;
/// println!("{}: {} bytes", page.path.display(), page.bytes);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[cfg(feature = "publish")]
pub mod publish {
    pub use ::publish::*;
    pub use kernel::{files::Folder, words::Split};
    pub use tables::{self, ParquetIndex};
}

// The crates below the doors, for the tests of this repository.
#[cfg(feature = "publish")]
#[doc(hidden)]
pub use ::publish::{export, preview};
#[cfg(feature = "cli")]
#[doc(hidden)]
pub use cli;
#[cfg(feature = "make")]
#[doc(hidden)]
pub use {
    assets::{self, object},
    factory::{self, cluster},
    robot::{collision, grasp, hand, kinematics},
    sim,
};
#[cfg(any(feature = "make", feature = "publish"))]
#[doc(hidden)]
pub use {form, tables};
#[cfg(feature = "read")]
#[doc(hidden)]
pub use {
    format,
    kernel::{contact, description, files, geom, ids, render, seed, voxel, words},
};
#[cfg(feature = "runtime")]
#[doc(hidden)]
pub use {infer, measure, perception, surface};
