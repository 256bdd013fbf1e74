//! The keys of a job that imports scenes.

use std::{collections::BTreeMap, path::PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use kernel::words::Split;

/// Imported arrangements in place of drawn ones: exactly one of `bop`, `csv` and `scenes`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImportSpec {
    /// Folders in the layout of the BOP challenge, each with `scene_gt.json` and `scene_camera.json`; relative to the
    /// job file. A resolved job lists their poses in `scenes`.
    #[schemars(length(min = 1), extend("examples" = [["../bop/ycbv/test/000048"]]))]
    pub bop: Option<Vec<PathBuf>>,
    /// With `bop`: images of every folder whose poses are a scene, by number. Default: the first of each folder, since
    /// all images of a folder show one arrangement.
    #[schemars(length(min = 1), extend("examples" = [[1, 36]]))]
    pub images: Option<Vec<u32>>,
    /// With `bop`: whether each image is a separate scene. Default: false.
    #[schemars(extend("examples" = [true]))]
    pub every_image: Option<bool>,
    /// With `bop`: name of the object of each `obj_id`. Default: `obj_000001` and so on, the names of BOP's model
    /// files.
    #[schemars(extend("examples" = [{ "1": "002_master_chef_can" }]))]
    pub objects: Option<BTreeMap<String, String>>,
    /// A CSV file of poses, relative to the job file. Its first line is `scene,object,x,y,z,qx,qy,qz,qw`: any name of a
    /// scene, the name of an object, its position in metres and its rotation. A resolved job lists them in `scenes`.
    #[schemars(extend("examples" = ["poses.csv"]))]
    pub csv: Option<PathBuf>,
    /// List of scenes.
    #[schemars(length(min = 1))]
    pub scenes: Option<Vec<ImportedSceneSpec>>,
    /// Split of all scenes; their objects must have that split in `[split]`. Default: `training`.
    #[schemars(extend("examples" = ["test"]))]
    pub split: Option<ImportSplitSpec>,
    /// Direction of the table's normal in the world of the files. Default: z. Required for files of BOP without
    /// `cam_R_w2c`, whose world is the camera's frame.
    #[schemars(extend("examples" = [[0.0, 0.0, 1.0]]))]
    pub up: Option<[f64; 3]>,
    /// Height of the table along `up` in the world of the files. By default the lowest point of each scene is on the
    /// table.
    #[schemars(extend("x-unit" = "m", "examples" = [0.0]))]
    pub table_height: Option<f64>,
    /// With `[container]`: its pose in the world of the files, x, y, z in metres, qx, qy, qz, qw. Its origin is the
    /// middle of its floor, z is up. Default: the origin of the files.
    #[schemars(extend("examples" = [[0.5, 0.0, 0.75, 0.0, 0.0, 0.0, 1.0]]))]
    pub container_pose: Option<[f64; 7]>,
}

/// One arrangement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImportedSceneSpec {
    /// Name or number of the scene in its files.
    #[schemars(extend("examples" = ["000048, image 1"]))]
    pub source: String,
    /// The bodies, 1 to 20.
    pub bodies: Vec<ImportedBodySpec>,
}

/// One body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImportedBodySpec {
    /// Name of the object in this job.
    #[schemars(extend("examples" = ["025_mug"]))]
    pub object: String,
    /// Pose of the object in the world of the files: x, y, z in metres, qx, qy, qz, qw.
    #[schemars(extend("examples" = [[0.1, 0.0, 0.04, 0.0, 0.0, 0.0, 1.0]]))]
    pub pose: [f64; 7],
}

/// Split of imported scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImportSplitSpec {
    /// Scenes of training objects.
    Training,
    /// Other arrangements of training objects.
    Holdout,
    /// Scenes of validation objects.
    Validation,
    /// Scenes of test objects.
    Test,
}

impl From<ImportSplitSpec> for Split {
    fn from(spec: ImportSplitSpec) -> Self {
        match spec {
            ImportSplitSpec::Training => Self::Training,
            ImportSplitSpec::Holdout => Self::Holdout,
            ImportSplitSpec::Validation => Self::Validation,
            ImportSplitSpec::Test => Self::Test,
        }
    }
}

impl From<Split> for ImportSplitSpec {
    fn from(split: Split) -> Self {
        match split {
            Split::Training => Self::Training,
            Split::Holdout => Self::Holdout,
            Split::Validation => Self::Validation,
            Split::Test => Self::Test,
        }
    }
}
