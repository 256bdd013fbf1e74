//! Records of a completion sample. Records that amodal pairs have, too, are read from both.

use super::{Cloud, Coverage, Implicit, Occlusion, TactileContacts, Tsdf, Visibility, VoxelPair};
use crate::{
    Channel, Depth,
    dataset::{DatasetError, Sample},
};
use kernel::geom::OccupancyGrid;

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
    /// Partial and complete grid, camera, poses.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn pair(&self) -> Result<VoxelPair, DatasetError> {
        self.leading(self.alike(Channel::PAIR), VoxelPair::decode)
    }

    /// Cells seen to be free; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn visibility(&self) -> Result<Option<Visibility>, DatasetError> {
        self.decoded(self.alike(Channel::VISIBILITY), Visibility::decode)
    }

    /// The depth crop; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn depth(&self) -> Result<Option<Depth>, DatasetError> {
        self.decoded(self.alike(Channel::DEPTH), Depth::decode)
    }

    /// The partial point cloud; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn cloud(&self) -> Result<Option<Cloud>, DatasetError> {
        self.decoded(self.alike(Channel::CLOUD), Cloud::decode)
    }

    /// Truncated signed distance; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn tsdf(&self) -> Result<Option<Tsdf>, DatasetError> {
        self.decoded(self.alike(Channel::TSDF), Tsdf::decode)
    }

    /// Share of each cell that is solid; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn coverage(&self) -> Result<Option<Coverage>, DatasetError> {
        self.decoded(self.alike(Channel::COVERAGE), Coverage::decode)
    }

    /// Samples for implicit networks; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn implicit(&self) -> Result<Option<Implicit>, DatasetError> {
        self.decoded(self.alike(Channel::IMPLICIT), Implicit::decode)
    }

    /// The occluder between the camera and the object; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn occlusion(&self) -> Result<Option<Occlusion>, DatasetError> {
        self.decoded(Channel::OCCLUSION, Occlusion::decode)
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
        let pair = self.pair()?;
        let mut tactile = OccupancyGrid::new(pair.grid.resolution);
        for (_, contacts) in &touch {
            contacts.check_beside(&pair).map_err(|source| self.broken(source))?;
            tactile = tactile.either(&contacts.tactile());
        }
        let partial_or_tactile = pair.partial.either(&tactile);
        Ok(Some(TouchedPair { pair, touch, tactile, partial_or_tactile }))
    }
}
