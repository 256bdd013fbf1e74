//! The facts of a dataset of completion: what `inspect` prints and the report shows.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{inspection::InspectionHeader, tally::Spread, touch::TouchFacts};
use kernel::{ids::ObjectId, words::Split};

/// Content of a dataset of completion. `Display` writes text; serialising gives JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CompletionInspection {
    /// Facts that the inspections of all products share.
    #[serde(flatten)]
    pub header: InspectionHeader,
    /// Channels of every kept sample, by name.
    pub channels: Vec<String>,
    /// Grid and camera, from the first kept sample; `None` when nothing was kept.
    pub setup: Option<Setup>,
    /// Profile of the sensor whose noise the depth has; `None` for a perfect sensor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<String>,
    /// Rule by which a cell of the complete grid is occupied; `None` if the job's text does not state it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<String>,
    /// Samples of the plan: kept + rejected.
    pub planned: u64,
    /// Stored samples.
    pub kept: u64,
    /// Samples that were not stored, by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Occupied cells of the partial grids.
    pub partial_cells: Spread,
    /// Occupied cells of the complete grids.
    pub complete_cells: Spread,
    /// Partial cells over complete cells.
    pub seen_ratio: Spread,
    /// Share of the solid's volume inside the grid.
    pub solid_share: Spread,
    /// Hidden share of the object's pixels, over the views with something in front of the object; `None` if the dataset has no
    /// occluders.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hidden_share: Option<Spread>,
    /// Stored samples with something in front of the object.
    #[serde(default)]
    pub occluded: u64,
    /// Kept samples with less than 99 % of the solid inside the grid.
    pub cut_off: u64,
    /// Facts of touch; `None` without touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub touch: Option<TouchFacts>,
    /// One row per split.
    pub splits: Vec<SplitFacts>,
    /// Objects in each nested training subset, smallest first.
    pub training_subsets: Vec<u32>,
    /// Objects of equal geometry (regardless of triangle order) on different sides of the split, by name.
    pub leaking_geometry: Vec<Vec<String>>,
    /// One row per object, sorted by name.
    pub objects: Vec<CompletionObjectFacts>,
    /// Meshes that could not be used: file, problem and remedy as text.
    pub refused: Vec<String>,
}

/// Grid and camera of a dataset's samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// Cells along each axis of the grids.
    pub resolution: u32,
    /// Image width [px].
    pub width: u32,
    /// Image height [px].
    pub height: u32,
    /// Focal length along x [px].
    pub fx: f64,
    /// Focal length along y [px].
    pub fy: f64,
    /// Principal point, x [px].
    pub cx: f64,
    /// Principal point, y [px].
    pub cy: f64,
}

/// One split.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplitFacts {
    /// The split.
    pub split: Split,
    /// Stored samples.
    pub samples: u64,
    /// Objects with stored samples in it.
    pub objects: u64,
    /// Partial cells over complete cells.
    pub seen_ratio: Spread,
}

/// One object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CompletionObjectFacts {
    /// Name in the job.
    pub name: String,
    /// The object by content.
    pub object: ObjectId,
    /// Split of the whole object.
    pub split: Option<Split>,
    /// Category or family, where known.
    pub group: Option<String>,
    /// Triangles, where known.
    pub triangles: Option<u64>,
    /// Side lengths of the box [m], where known.
    pub extents: Option<[f64; 3]>,
    /// Whether the mesh is closed, where known.
    pub watertight: Option<bool>,
    /// Connected bodies, where known.
    pub bodies: Option<u64>,
    /// Method by which the solid was found, where known.
    pub inside: Option<String>,
    /// Repairs as text.
    pub repairs: Vec<String>,
    /// Remarks for the user.
    pub warnings: Vec<String>,
    /// Licence, where known.
    pub licence: Option<String>,
    /// Citation, where known.
    pub citation: Option<String>,
    /// Samples of the plan.
    pub planned: u64,
    /// Stored samples.
    pub kept: u64,
    /// Samples that were not stored, by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Mean count of occupied partial cells of the stored samples.
    pub mean_partial_cells: f64,
    /// Mean of partial cells over complete cells.
    pub mean_seen_ratio: f64,
    /// Smallest share of the solid inside the grid.
    pub min_solid_share: Option<f64>,
}

impl CompletionObjectFacts {
    /// The longest side [m], where known.
    pub fn longest_side(&self) -> Option<f64> {
        Some(self.extents?.into_iter().fold(0.0, f64::max))
    }
}
