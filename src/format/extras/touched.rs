//! Pairs of completion and amodal samples, joined with their touch.

use crate::{
    Channel, Clutter, TactileContacts, VoxelPair,
    storage::{DatasetError, Sample},
};
use kernel::{geom::OccupancyGrid, ids::ObjectId};

/// Training input of a visual-tactile network: seen, touched, both, and the whole solid, on the pair's grid.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchedPair {
    /// Partial and complete grid, camera, poses.
    pub pair: VoxelPair,
    /// Contacts of each kind of touch.
    pub touch: Vec<(Channel, TactileContacts)>,
    /// Cells that hold a contact of any kind.
    pub tactile: OccupancyGrid,
    /// Cells that were seen or touched: the network's input.
    pub partial_or_tactile: OccupancyGrid,
}

impl Sample {
    /// The object that a pair is of: in clutter a body of the scene, otherwise the sample's subject.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn object(&self) -> Result<ObjectId, DatasetError> {
        let clutter = self.find::<Clutter>()?;
        Ok(clutter.map_or(self.id.subject, |clutter| clutter.object))
    }

    /// Contacts of every kind of touch that is stored, by channel.
    ///
    /// # Errors
    /// When a payload is not a valid record.
    pub fn touch(&self) -> Result<Vec<(Channel, TactileContacts)>, DatasetError> {
        let stored = self.channels().filter(|channel| channel.is_touch());
        let contacts = stored.map(|channel| {
            let decode = |payload: &[u8]| TactileContacts::decode_of(channel, payload);
            Ok((channel, self.leading(channel, decode)?))
        });
        contacts.collect()
    }

    /// The pair joined with all touch of the sample; `None` when no touch is stored.
    ///
    /// # Errors
    /// When a payload is not a valid record, or contacts do not fit the pair.
    pub fn touched(&self) -> Result<Option<TouchedPair>, DatasetError> {
        let touch = self.touch()?;
        if touch.is_empty() {
            return Ok(None);
        }
        let pair = self.read::<VoxelPair>()?;
        let mut tactile = OccupancyGrid::new(pair.grid.resolution);
        for (_, contacts) in &touch {
            contacts.check_beside(&pair).map_err(|source| self.broken(source))?;
            tactile = tactile.either(&contacts.tactile());
        }
        let partial_or_tactile = pair.partial.either(&tactile);
        Ok(Some(TouchedPair { pair, touch, tactile, partial_or_tactile }))
    }
}
