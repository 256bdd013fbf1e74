//! Facts of a volume.

use super::{SceneVolume, VolumeTruth};
use crate::{FactFormat, FactKind, Facts};

/// Counts of a volume, for tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VolumeFacts {
    /// Images that were fused; 0 of a rejected volume without any.
    pub images: u32,
    /// Voxels that an image says something of.
    pub observed_voxels: u32,
    /// Observed voxels nearer to what is seen than the truncation.
    pub near_voxels: u32,
    /// Bodies of the scene.
    pub bodies: u32,
    /// Bodies that hold the centre of a voxel.
    pub bodies_inside: u32,
    /// Voxels whose centre is inside a body.
    pub occupied_voxels: u32,
}

/// Index of the first fact that the record of the truth states; the volume states the ones before.
pub(super) const FIRST_OF_TRUTH: usize = 3;

const fn fact(name: &'static str, kind: FactKind, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind, topic: None, meaning }
}

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; 6] = [
    fact("images", FactKind::Count, "Images that were fused."),
    fact("observed_voxels", FactKind::Integer, "Voxels that an image says something of."),
    fact("near_voxels", FactKind::Integer, "Observed voxels nearer to what is seen than the truncation."),
    fact("bodies", FactKind::Count, "Bodies of the scene."),
    fact("bodies_inside", FactKind::Count, "Bodies that hold the centre of a voxel."),
    fact("occupied_voxels", FactKind::Integer, "Voxels whose centre is inside a body."),
];

impl VolumeFacts {
    /// Facts of a volume and its truth.
    pub fn of(volume: &SceneVolume, truth: &VolumeTruth) -> Self {
        Self {
            images: volume.views.len() as u32,
            observed_voxels: volume.observed(),
            near_voxels: volume.near(),
            bodies: truth.bodies.len() as u32,
            bodies_inside: truth.bodies_inside(),
            occupied_voxels: truth.occupied(),
        }
    }

    fn values(self) -> [u32; FACTS.len()] {
        let Self { images, observed_voxels, near_voxels, bodies, bodies_inside, occupied_voxels } = self;
        [images, observed_voxels, near_voxels, bodies, bodies_inside, occupied_voxels]
    }
}

impl SceneVolume {
    /// The facts that the record states alone, with their indices.
    pub(super) fn stated_facts(&self) -> Vec<(usize, f64)> {
        let counts = [self.views.len() as u32, self.observed(), self.near()];
        counts.map(f64::from).into_iter().enumerate().collect()
    }
}

impl VolumeTruth {
    /// The facts that the record states alone, with their indices.
    pub(super) fn stated_facts(&self) -> Vec<(usize, f64)> {
        let counts = [self.bodies.len() as u32, self.bodies_inside(), self.occupied()];
        (FIRST_OF_TRUTH..).zip(counts.map(f64::from)).collect()
    }
}

impl From<VolumeFacts> for Facts {
    fn from(facts: VolumeFacts) -> Self {
        Self::new(facts.values().map(f64::from))
    }
}

impl From<&Facts> for VolumeFacts {
    fn from(facts: &Facts) -> Self {
        let of = |index: usize| facts.integer(index);
        Self {
            images: of(0),
            observed_voxels: of(1),
            near_voxels: of(2),
            bodies: of(3),
            bodies_inside: of(4),
            occupied_voxels: of(5),
        }
    }
}
