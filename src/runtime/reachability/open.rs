//! Maps read from datasets: the field at once, witnesses on request.

use super::{ReachabilityMap, ReachabilityParts, RobotFacts};
use format::{
    FieldHeader, Product, ReachabilityBlock, ReachabilityField,
    dataset::{DatasetError, DatasetReader, Selection},
    extras::read_field,
    products::reachability::FIELD,
};
use kernel::{files::Folder, geom::PoseLabel};

const REMEDY: &str = "`graspmill verify` finds the damaged file; `run` the job again";

impl ReachabilityMap {
    /// The product whose datasets have maps.
    pub const PRODUCT: Product = Product::REACHABILITY;

    /// Whether a folder has the file of a map, which may be damaged.
    pub fn is_in(folder: &Folder) -> bool {
        folder.contains(FIELD)
    }

    /// Opens the map of a reachability dataset without witnesses. Reads only `field.mcap`, so a robot needs no other file.
    ///
    /// # Errors
    /// When the folder has no field, or it is damaged.
    pub fn open(folder: &Folder) -> Result<Self, DatasetError> {
        let ReachabilityField { header, labels, distances } = read_field(folder)?;
        let FieldHeader { grid, metric, robot, joints, target, frame, .. } = header;
        let robot = RobotFacts { robot, joints, target, frame };
        Self::new(ReachabilityParts { grid, metric, labels, distances, witnesses: None, robot })
            .map_err(|error| invalid(folder, error.to_string()))
    }

    /// Reads the joint values of all reachable cells from the shards of the dataset of the map: 8 bytes per joint and reachable
    /// cell. Does nothing if the map already has them.
    ///
    /// # Errors
    /// When the dataset is not finished, a shard is missing or damaged, or the labels are those of another map.
    pub fn read_witnesses(&mut self, folder: &Folder) -> Result<(), DatasetError> {
        if self.has_witnesses() {
            return Ok(());
        }
        let reader = DatasetReader::open(folder)?;
        let (angles, joints) = (self.grid().orientations(), self.robot().joints.len());
        let reachable = self.clear_labels().iter().filter(|label| **label == PoseLabel::Reachable).count();
        let mut witnesses = Vec::with_capacity(reachable * joints);
        for (position, sample) in reader.iter(Selection::default()).enumerate() {
            let sample = sample?;
            let block = sample.read::<ReachabilityBlock>()?;
            let own = self.clear_labels().get(position * angles..(position + 1) * angles);
            if own != Some(block.labels.as_slice()) || block.joints as usize != joints {
                return Err(invalid(
                    folder,
                    format!("sample {} does not belong to the field of this map", sample.index),
                ));
            }
            witnesses.extend_from_slice(&block.witnesses);
        }
        self.set_witnesses(witnesses).map_err(|error| invalid(folder, error.to_string()))
    }
}

fn invalid(folder: &Folder, problem: String) -> DatasetError {
    DatasetError::Invalid { path: folder.path().to_owned(), problem, remedy: REMEDY }
}
