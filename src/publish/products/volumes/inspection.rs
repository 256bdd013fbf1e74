//! The facts of a dataset of volumes: what `inspect` prints.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use super::headline::headline;
use crate::{
    chart::{grouped, percent},
    inspection::{InspectionHeader, evenly, open_of},
    scene_objects::ScenesObject,
    tally::{Spread, SpreadRow, Tally},
};
use format::{
    Channel, PickState, Product, VolumeFacts,
    dataset::{DatasetError, DatasetReader, Fate},
};
use kernel::{files::Folder, ids::SampleIndex, words::Split};

/// Content of a dataset of volumes. `Display` writes text; serialising gives JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VolumesInspection {
    /// Facts that the inspections of all products share.
    #[serde(flatten)]
    pub header: InspectionHeader,
    /// Scenes of the fused images.
    pub scenes: u64,
    /// Fusions: kept + rejected.
    pub samples: u64,
    /// Kept volumes.
    pub kept: u64,
    /// Kept volumes by split.
    pub splits: BTreeMap<Split, u64>,
    /// Rejected volumes by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Images in all kept volumes.
    pub images: u64,
    /// Kept volumes by the number of images fused.
    pub by_images: BTreeMap<u32, u64>,
    /// Bodies of the scenes, counted in each kept volume.
    pub bodies: u64,
    /// Bodies that contain the centre of a voxel.
    pub bodies_inside: u64,
    /// Observed voxels.
    pub observed_voxels: Spread,
    /// Observed voxels nearer to the observed surface than the truncation.
    pub near_voxels: Spread,
    /// Voxels whose centre is inside a body.
    pub occupied_voxels: Spread,
    /// Grasps in the kept volumes, counted in each; `None` if the dataset has none.
    pub grasps: Option<VolumeGraspCounts>,
    /// One row per object, sorted by name.
    pub objects: Vec<ScenesObject>,
}

/// Counts of grasps in volumes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct VolumeGraspCounts {
    /// Free grasps with their centre in a cube, by [`PickState::ALL`].
    pub states: [u64; 3],
    /// Forbidden grasps of the scenes.
    pub forbidden: u64,
    /// Free grasps with their centre outside the cube.
    pub outside: u64,
}

/// Input of a page, except the pictures.
pub(crate) struct VolumeSurvey {
    pub facts: VolumesInspection,
    /// Kept volumes that a page shows.
    pub shown: Vec<SampleIndex>,
}

/// Maximum number of volumes on a page.
const SHOWN: usize = 12;

/// The facts of a finished dataset of volumes: reads tables and ledgers.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_volumes(folder: &Folder) -> Result<VolumesInspection, DatasetError> {
    Ok(VolumeSurvey::of(&open_of(folder, Product::VOLUMES)?)?.facts)
}

impl VolumeSurvey {
    /// Reads the ledgers of a dataset, one at a time.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let (mut kept, mut by_images) = (Vec::new(), BTreeMap::new());
        let [mut observed, mut near, mut occupied] = [(); 3].map(|()| Tally::with_step(1.0));
        for shard in 0..manifest.shards.len() {
            for row in reader.ledger(shard)?.rows {
                if matches!(row.fate, Fate::Kept(_)) {
                    let facts = VolumeFacts::from(&row.facts);
                    kept.push(row.index);
                    *by_images.entry(facts.images).or_default() += 1;
                    observed.add(f64::from(facts.observed_voxels));
                    near.add(f64::from(facts.near_voxels));
                    occupied.add(f64::from(facts.occupied_voxels));
                }
            }
        }
        let counts = &manifest.counts;
        let facts = VolumesInspection {
            header: InspectionHeader::of(reader, headline(reader)?)?,
            scenes: reader.assets()?.subjects.len() as u64,
            samples: counts.samples,
            kept: counts.kept,
            splits: counts.splits.clone(),
            rejected: counts.rejected.clone(),
            images: counts.fact("images"),
            by_images,
            bodies: counts.fact("bodies"),
            bodies_inside: counts.fact("bodies_inside"),
            observed_voxels: observed.spread(),
            near_voxels: near.spread(),
            occupied_voxels: occupied.spread(),
            grasps: manifest.channels().contains(&Channel::VOLUME_AFFORDANCE).then(|| VolumeGraspCounts {
                states: PickState::ALL.map(|state| counts.fact(state.name())),
                forbidden: counts.fact("forbidden"),
                outside: counts.fact("outside"),
            }),
            objects: ScenesObject::all(reader)?,
        };
        Ok(Self { facts, shown: evenly(&kept, SHOWN) })
    }
}

impl VolumesInspection {
    /// Rows of the distributions of kept volumes.
    pub(super) fn spread_rows(&self) -> Vec<SpreadRow> {
        vec![
            SpreadRow::new("observed voxels", 0, &self.observed_voxels),
            SpreadRow::new("near voxels", 0, &self.near_voxels),
            SpreadRow::new("occupied voxels", 0, &self.occupied_voxels),
        ]
    }
}

impl VolumeGraspCounts {
    /// The counts with their names.
    pub(super) fn rows(&self) -> Vec<(String, u64)> {
        let free = PickState::ALL.map(PickState::name).into_iter().zip(self.states);
        let free = free.map(|(name, count)| (format!("free in a cube, {name}"), count));
        free.chain([("free outside".to_owned(), self.outside), ("forbidden".to_owned(), self.forbidden)]).collect()
    }
}

/// A number of images as text.
pub(super) fn images_in_words(images: u32) -> String {
    format!("{images} image{}", if images == 1 { "" } else { "s" })
}

impl fmt::Display for VolumesInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.header.write_names(f)?;
        writeln!(f, "  job       {}", self.header.job)?;
        let share = percent(self.kept as f64 / self.samples.max(1) as f64);
        writeln!(f, "  samples   {} of {} volumes kept ({share})", grouped(self.kept), grouped(self.samples))?;
        InspectionHeader::write_rejected(f, &self.rejected)?;
        for (split, count) in &self.splits {
            writeln!(f, "            {:>9} {}", grouped(*count), split.name())?;
        }
        writeln!(f, "  scenes    {}", grouped(self.scenes))?;
        writeln!(f, "  images    {} in all volumes", grouped(self.images))?;
        for (images, count) in &self.by_images {
            writeln!(f, "            {:>9} of {}", grouped(*count), images_in_words(*images))?;
        }
        let (inside, bodies) = (grouped(self.bodies_inside), grouped(self.bodies));
        writeln!(f, "  bodies    {inside} of {bodies} contain the centre of a voxel")?;
        if let Some(grasps) = &self.grasps {
            writeln!(f, "  grasps    of the scenes, counted in each volume")?;
            for (name, count) in grasps.rows() {
                writeln!(f, "            {:>9} {name}", grouped(count))?;
            }
        }
        self.header.write_shards(f)?;
        writeln!(f)?;
        writeln!(
            f,
            "\n  {:<18} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}",
            "", "min", "5 %", "median", "95 %", "max", "mean"
        )?;
        for row in self.spread_rows() {
            writeln!(f, "{row}")?;
        }
        ScenesObject::write_all(&self.objects, f)?;
        if let Some(speed) = &self.header.notes.speed {
            writeln!(f, "\nspeed: {:.1} samples/s: {:.1} s on {} threads", speed.rate(), speed.seconds, speed.threads)?;
        }
        self.header.write_warnings(f)
    }
}
