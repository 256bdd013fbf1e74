//! Facts of a volume.

use super::{SceneVolume, VolumeAffordance, VolumeTruth};
use crate::{FactFormat, FactKind, Facts};

/// Topic of the grasps, without which a dataset has no columns of them.
pub(super) const AFFORDANCE: &str = "/volumes/affordance";

/// Counts of a volume, for tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VolumeFacts {
    /// Images that were fused; 0 for a rejected volume without images.
    pub images: u32,
    /// Voxels that at least one image observed.
    pub observed_voxels: u32,
    /// Observed voxels nearer to the observed surface than the truncation.
    pub near_voxels: u32,
    /// Bodies of the scene.
    pub bodies: u32,
    /// Bodies that contain the centre of a voxel.
    pub bodies_inside: u32,
    /// Voxels whose centre is inside a body.
    pub occupied_voxels: u32,
    /// Grasps in the cube; zeros if the job names no picks.
    pub grasps: GraspsInVolume,
}

/// Counts of the grasps in a volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GraspsInVolume {
    /// Free grasps of each of [`PickState::ALL`](crate::PickState::ALL).
    pub states: [u32; 3],
    /// Grasps of the scene that are not free.
    pub forbidden: u32,
    /// Free grasps whose centre is outside the cube.
    pub outside: u32,
}

/// Index of the first fact that the record of the truth states; the volume states the ones before.
pub(super) const FIRST_OF_TRUTH: usize = 3;

/// Index of the first fact that the record of the grasps states.
pub(super) const FIRST_OF_GRASPS: usize = 6;

const fn fact(name: &'static str, kind: FactKind, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind, topic: None, meaning }
}

const fn of_grasps(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: Some(AFFORDANCE), meaning }
}

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; FIRST_OF_GRASPS + 5] = [
    fact("images", FactKind::Count, "Images that were fused."),
    fact("observed_voxels", FactKind::Integer, "Voxels that at least one image observed."),
    fact("near_voxels", FactKind::Integer, "Observed voxels nearer to the observed surface than the truncation."),
    fact("bodies", FactKind::Count, "Bodies of the scene."),
    fact("bodies_inside", FactKind::Count, "Bodies that contain the centre of a voxel."),
    fact("occupied_voxels", FactKind::Integer, "Voxels whose centre is inside a body."),
    of_grasps("untried", "Free grasps with their centre in the cube, without a conclusive trial."),
    of_grasps("held", "Free grasps with their centre in the cube that held in a trial."),
    of_grasps("failed", "Free grasps with their centre in the cube that failed in a trial."),
    of_grasps("forbidden", "Grasps of the scene that are not free."),
    of_grasps("outside", "Free grasps with their centre outside the cube."),
];

impl VolumeFacts {
    /// Facts of a volume, its truth and its grasps, if it has some.
    pub fn from_volume(volume: &SceneVolume, truth: &VolumeTruth, affordance: Option<&VolumeAffordance>) -> Self {
        Self {
            images: volume.views.len() as u32,
            observed_voxels: volume.observed(),
            near_voxels: volume.near(),
            bodies: truth.bodies.len() as u32,
            bodies_inside: truth.bodies_inside(),
            occupied_voxels: truth.occupied(),
            grasps: affordance.map(GraspsInVolume::from_affordance).unwrap_or_default(),
        }
    }

    fn values(self) -> impl Iterator<Item = u32> {
        let Self { images, observed_voxels, near_voxels, bodies, bodies_inside, occupied_voxels, grasps } = self;
        let counts = [images, observed_voxels, near_voxels, bodies, bodies_inside, occupied_voxels];
        counts.into_iter().chain(grasps.values())
    }
}

impl GraspsInVolume {
    /// Counts of the grasps in a volume.
    pub fn from_affordance(affordance: &VolumeAffordance) -> Self {
        let VolumeAffordance { forbidden, outside, .. } = affordance;
        Self { states: affordance.states(), forbidden: forbidden.iter().sum(), outside: *outside }
    }

    /// The counts in the order of their columns.
    pub(super) fn values(self) -> [u32; 5] {
        let Self { states: [untried, held, failed], forbidden, outside } = self;
        [untried, held, failed, forbidden, outside]
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
            grasps: GraspsInVolume {
                states: std::array::from_fn(|index| of(FIRST_OF_GRASPS + index)),
                forbidden: of(FIRST_OF_GRASPS + 3),
                outside: of(FIRST_OF_GRASPS + 4),
            },
        }
    }
}
