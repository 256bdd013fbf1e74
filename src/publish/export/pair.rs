//! A pair as input of the formats.

use super::selected::SelectedSample;
use format::{TouchedPair, VoxelPair, dataset::Sample};
use kernel::{geom::OccupancyGrid, ids::SampleIndex};

/// A pair with everything that a format may write.
pub(super) struct PairSample<'a> {
    /// The stored sample, for its further channels.
    pub sample: &'a Sample,
    /// The pair.
    pub pair: &'a VoxelPair,
    /// Touch; `None` in a dataset without.
    pub touched: Option<&'a TouchedPair>,
    /// Names of the sample, its object and split.
    pub names: &'a SelectedSample<'a>,
    /// Path that the files of this sample share: `<object>/view_00003`.
    pub stem: &'a str,
}

impl PairSample<'_> {
    /// Index in the dataset.
    pub fn index(&self) -> SampleIndex {
        self.sample.index
    }

    /// Cells that any kind of touch met.
    pub fn tactile(&self) -> Option<&OccupancyGrid> {
        self.touched.map(|touched| &touched.tactile)
    }

    /// The grids that a format stores, by name.
    pub fn grids(&self) -> impl Iterator<Item = (&'static str, &OccupancyGrid)> {
        let tactile = self.tactile().map(|grid| ("tactile", grid));
        [("partial", &self.pair.partial), ("complete", &self.pair.complete)].into_iter().chain(tactile)
    }
}
