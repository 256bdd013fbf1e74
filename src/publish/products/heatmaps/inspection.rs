//! The facts of a dataset of heatmaps: what `inspect` prints.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use super::headline::headline;
use crate::{
    chart::{grouped, percent},
    grasp_types::TypeFacts,
    inspection::{InspectionHeader, evenly, open_of},
    scene_objects::ScenesObject,
};
use format::{
    HeatmapFacts, PickObstacle, PickState, Product, SceneHeatmap,
    dataset::{DatasetError, DatasetReader, Fate},
};
use kernel::{
    files::Folder,
    ids::{Digest, SampleIndex},
    words::{Show, Split},
};

/// Content of a dataset of heatmaps. `Display` writes text; serialising gives JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeatmapsInspection {
    /// Facts that the inspections of all products share.
    #[serde(flatten)]
    pub header: InspectionHeader,
    /// Name of the hand.
    pub hand: String,
    /// Digest of the exact numbers of the dataset of picks; `None` if no image is kept.
    pub picks: Option<Digest>,
    /// Scenes of the images.
    pub scenes: u64,
    /// Images: kept + rejected.
    pub samples: u64,
    /// Kept images.
    pub kept: u64,
    /// Kept images by split.
    pub splits: BTreeMap<Split, u64>,
    /// Rejected images by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Names of the hand's points.
    pub points: Vec<String>,
    /// The chosen grasp types, the most common first; empty for a hand without types.
    pub types: Vec<u32>,
    /// Kept images with a free grasp.
    pub images_with_grasps: u64,
    /// Free grasps in all kept images, counted in each image, by [`PickState::ALL`].
    pub states: [u64; 3],
    /// Forbidden grasps in all kept images, by [`PickObstacle::NAMES`].
    pub forbidden: [u64; 4],
    /// Free grasps of other types.
    pub other_types: u64,
    /// Points of the free grasps in the images.
    pub points_in_images: u64,
    /// Visible points among them.
    pub visible_points: u64,
    /// Grasps with patches.
    pub patches: u64,
    /// One row per object, sorted by name.
    pub objects: Vec<ScenesObject>,
}

/// Input of a page, except the pictures.
pub(crate) struct HeatmapSurvey {
    pub facts: HeatmapsInspection,
    /// Kept images on the page: with a grasp that held, or else with a free one.
    pub shown: Vec<SampleIndex>,
}

/// Maximum number of images on a page.
const SHOWN: usize = 6;

/// The facts of a finished dataset of heatmaps: reads tables, ledgers and one sample.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_heatmaps(folder: &Folder) -> Result<HeatmapsInspection, DatasetError> {
    Ok(HeatmapSurvey::of(&open_of(folder, Product::HEATMAPS)?)?.facts)
}

impl HeatmapSurvey {
    /// Reads the ledgers of a dataset, one at a time, and its first kept sample.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let (mut kept, mut with_grasps, mut with_held) = (Vec::new(), Vec::new(), Vec::new());
        for shard in 0..manifest.shards.len() {
            for row in reader.ledger(shard)?.rows.iter().filter(|row| matches!(row.fate, Fate::Kept(_))) {
                let facts = HeatmapFacts::from(&row.facts);
                kept.push(row.index);
                with_grasps.extend((facts.grasps() > 0).then_some(row.index));
                with_held.extend((facts.of_state(PickState::Held) > 0).then_some(row.index));
            }
        }
        let first = match kept.first() {
            Some(index) => reader.sample(*index)?.map(|sample| sample.read::<SceneHeatmap>()).transpose()?,
            None => None,
        };
        let assets = reader.assets()?;
        let counts = &manifest.counts;
        let facts = HeatmapsInspection {
            header: InspectionHeader::of(reader, headline(reader)?)?,
            hand: assets.hands.first().map_or_else(String::new, |hand| hand.name.clone()),
            picks: first.as_ref().map(|heatmap| heatmap.picks),
            scenes: assets.subjects.len() as u64,
            samples: counts.samples,
            kept: counts.kept,
            splits: counts.splits.clone(),
            rejected: counts.rejected.clone(),
            points: first.as_ref().map_or_else(Vec::new, |heatmap| heatmap.names.clone()),
            types: first.map_or_else(Vec::new, |heatmap| heatmap.types),
            images_with_grasps: with_grasps.len() as u64,
            states: PickState::ALL.map(|state| counts.fact(state.name())),
            forbidden: ["ground", "container", "own_object", "neighbour"]
                .map(|by| counts.fact(&format!("forbidden_by_{by}"))),
            other_types: counts.fact("other_types"),
            points_in_images: counts.fact("points"),
            visible_points: counts.fact("visible_points"),
            patches: counts.fact("patches"),
            objects: ScenesObject::all(reader)?,
        };
        let shown = if with_held.is_empty() { with_grasps } else { with_held };
        Ok(Self { facts, shown: evenly(if shown.is_empty() { &kept } else { &shown }, SHOWN) })
    }
}

impl HeatmapsInspection {
    /// Grasps that approach from the camera's side: free ones by their state, forbidden ones by obstacle.
    pub(super) fn ends(&self) -> Vec<(String, u64)> {
        let free = PickState::ALL.map(PickState::name).into_iter().zip(self.states);
        let free = free.map(|(name, count)| (format!("free, {name}"), count));
        let other = (self.other_types > 0).then(|| ("free, of other types".to_owned(), self.other_types));
        let forbidden = PickObstacle::NAMES.into_iter().zip(self.forbidden);
        free.chain(other).chain(forbidden.map(|(name, count)| (format!("forbidden by {name}"), count))).collect()
    }

    /// Visible share of the points in the images, as text.
    pub(super) fn visible_share(&self) -> String {
        percent(self.visible_points as f64 / self.points_in_images.max(1) as f64)
    }

    /// Rows of the chosen types: index, type and digits.
    pub(super) fn type_rows(&self) -> Vec<Vec<String>> {
        let row = |(index, kind): (usize, &u32)| {
            let head = [index.to_string(), kind.to_string()];
            head.into_iter().chain(TypeFacts::new(*kind, [0, 0]).digits_in_words()).collect()
        };
        self.types.iter().enumerate().map(row).collect()
    }
}

impl fmt::Display for HeatmapsInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.header.write_names(f)?;
        writeln!(f, "  job       {}", self.header.job)?;
        writeln!(f, "  hand      {}: {}", self.hand.shown(), self.points.join(", ").shown())?;
        if let Some(picks) = self.picks {
            writeln!(f, "  picks     {picks}")?;
        }
        let share = percent(self.kept as f64 / self.samples.max(1) as f64);
        writeln!(f, "  samples   {} of {} images kept ({share})", grouped(self.kept), grouped(self.samples))?;
        InspectionHeader::write_rejected(f, &self.rejected)?;
        for (split, count) in &self.splits {
            writeln!(f, "            {:>9} {}", grouped(*count), split.name())?;
        }
        writeln!(f, "  scenes    {}", grouped(self.scenes))?;
        if !self.types.is_empty() {
            let types: Vec<String> = self.types.iter().map(u32::to_string).collect();
            writeln!(f, "  types     {}", types.join(", "))?;
        }
        writeln!(f, "  grasps    in all images; {} images have a free one", grouped(self.images_with_grasps))?;
        for (name, count) in self.ends() {
            writeln!(f, "            {:>9} {name}", grouped(count))?;
        }
        let [visible, points] = [self.visible_points, self.points_in_images].map(grouped);
        writeln!(f, "  points    {visible} of {points} visible: {}", self.visible_share())?;
        writeln!(f, "  patches   {} grasps have one around each point", grouped(self.patches))?;
        self.header.write_shards(f)?;
        writeln!(f)?;
        ScenesObject::write_all(&self.objects, f)?;
        if let Some(speed) = &self.header.notes.speed {
            writeln!(f, "\nspeed: {:.1} images/s: {:.1} s on {} threads", speed.rate(), speed.seconds, speed.threads)?;
        }
        self.header.write_warnings(f)
    }
}
